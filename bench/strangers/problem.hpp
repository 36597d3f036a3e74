// SPDX-License-Identifier: BSD-3-Clause
// A problem of the campaign: what an oracle says of it, how it is disguised, and what an engine is
// asked and tells.
#pragma once

#include "wave.hpp"

#include <filippov/core/status.hpp>

#include <array>
#include <memory>
#include <string>
#include <vector>

namespace filippov::strangers {

constexpr int most = 4; ///< components
using Natural = std::array<Long, most>;

/// A surface that is crossed, slid on or left: its mode from then on.
struct Change {
    Long t;
    int surface, mode;
};

/// What happens exactly, in natural coordinates.
struct Exactly {
    enum Fate {
        ok,
        undecided, ///< it depends on rounding
        stops,     ///< in a two-fold: at t, in z
    } fate = ok;
    Long t = 0;
    Natural z{};
    Long largest = 0; ///< of a component on the way
    std::vector<Change> changes{};
    std::vector<Long> met{}; ///< roots of the section
    bool slides = false;

    bool same_story(const Exactly& other) const {
        if (fate != other.fate || changes.size() != other.changes.size() ||
            met.size() != other.met.size())
            return false;
        for (std::size_t i = 0; i < changes.size(); ++i)
            if (changes[i].mode != other.changes[i].mode ||
                changes[i].surface != other.changes[i].surface)
                return false;
        return true;
    }
};

/// An error that is added in every step of an oracle.
struct Nudge {
    Long size = 0;
    int ways = 0; ///< its signs, by bits

    Long of(int component) const { return (ways >> component) % 2 ? -size : size; }
};

/// x_i = size_i y_i with y_i = z_i + bend_i z_{i+1}^2; time runs `speed` times as fast in natural
/// units, and h_j is `height_j` times as high.
struct Disguise {
    int n = most;
    std::array<double, most> size{1, 1, 1, 1}, bend{};
    double speed = 1;
    std::array<double, 3> height{1, 1, 1};
    double period = 0; ///< declared, engine's units; 0: none

    template <class S, class X> X natural(const X& x) const {
        X z = x;
        for (int i = n - 1; i >= 0; --i) {
            z[i] = x[i] * S(1 / size[std::size_t(i)]);
            if (i + 1 < n && bend[std::size_t(i)] != 0)
                z[i] = z[i] - S(bend[std::size_t(i)]) * z[i + 1] * z[i + 1];
        }
        return z;
    }
    template <class S, class X> X disguised(const X& z) const {
        X x = z;
        for (int i = 0; i < n; ++i) {
            if (i + 1 < n && bend[std::size_t(i)] != 0)
                x[i] = z[i] + S(bend[std::size_t(i)]) * z[i + 1] * z[i + 1];
            x[i] = x[i] * S(size[std::size_t(i)]);
        }
        return x;
    }
    /// Rates in the engine's units, of those of z.
    template <class S, class X> X rates(const X& z, const X& rate) const {
        X f = rate;
        for (int i = 0; i < n; ++i) {
            if (i + 1 < n && bend[std::size_t(i)] != 0)
                f[i] = rate[i] + S(2 * bend[std::size_t(i)]) * z[i + 1] * rate[i + 1];
            f[i] = f[i] * S(size[std::size_t(i)] * speed);
        }
        return f;
    }
    Natural exact(const std::array<double, most>& x) const {
        Natural z{};
        for (int i = 0; i < n; ++i)
            z[std::size_t(i)] = x[std::size_t(i)];
        struct Access {
            Natural v;
            Long& operator[](int i) { return v[std::size_t(i)]; }
            const Long& operator[](int i) const { return v[std::size_t(i)]; }
        };
        return natural<Long>(Access{z}).v;
    }
    std::array<double, most> seen(const Natural& z) const {
        struct Access {
            Natural v;
            Long& operator[](int i) { return v[std::size_t(i)]; }
            const Long& operator[](int i) const { return v[std::size_t(i)]; }
        };
        const Natural v = disguised<Long>(Access{z}).v;
        std::array<double, most> x{};
        for (int i = 0; i < n; ++i)
            x[std::size_t(i)] = double(v[std::size_t(i)]);
        return x;
    }
    /// The largest component that the engine sees, in natural units: errors are relative to it.
    Long largest_seen(const std::array<double, most>& x) const {
        Long largest = 0;
        for (std::size_t i = 0; i < std::size_t(n); ++i)
            largest = std::max(largest, std::abs(Long(x[i]) / Long(size[i])));
        return largest;
    }
    /// Random units; curved coordinates that differ by a quarter of `reach` at most.
    void draw(Dice& dice, double reach, bool curved) {
        for (int i = 0; i < n; ++i)
            size[std::size_t(i)] = std::exp2(std::floor(dice.uniform(-20, 20)));
        speed = dice.logarithmic(1e-6, 1e6);
        for (double& each : height)
            each = dice.logarithmic(1e-9, 1e9);
        for (int i = 0; curved && i + 1 < n; ++i)
            bend[std::size_t(i)] = dice.uniform(-0.25, 0.25) / reach;
    }
};

enum class Method { dopri5, dop853, rodas5p };
constexpr std::array<const char*, 3> method_names{"dopri5", "dop853", "rodas5p"};

/// One run, engine's units.
struct Ask {
    Method method = Method::dopri5;
    bool in_lanes = false;
    double tolerance = 1e-8;
    std::array<double, most> x0{};
    double t0 = 0, t_end = 0;
};
struct Told {
    Status status = Status::ok;
    double t = 0;
    std::array<double, most> x{};
    bool has_story = true; ///< lanes only count
    struct Seen {
        double t;
        int surface, mode;
    };
    std::vector<Seen> changes{};
    std::vector<double> met{};
    int count = 0; ///< of changes of mode
    std::string message{};
};

/// A problem, its start and its end in the engine's units.
struct Problem {
    Disguise disguise{};
    std::array<double, most> x0{};
    double t0 = 0, t_end = 0;
    bool on_surface = false;   ///< it begins there, but for rounding
    bool coupled = true;       ///< an error of one component grows into others
    bool counts_jumps = false; ///< else impacts are not compared: they may accumulate
    bool back = false;         ///< without slides it may be run backwards
    double pace = 1;           ///< over which time its quickest term changes, natural

    Problem() = default;
    Problem(const Problem&) = default;
    virtual ~Problem() = default;
    /// @param way  -1: backwards in time
    virtual Exactly follow(const Natural& z0, Long t0, Long t_end, const Nudge& nudge) const = 0;
    virtual Told ask(const Ask& ask) const = 0;
    /// In natural coordinates, as formulas.
    virtual std::string text() const = 0;
};

} // namespace filippov::strangers
