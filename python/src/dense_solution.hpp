// SPDX-License-Identifier: BSD-3-Clause
// A trajectory of the engine behind the interface Solution.
#pragma once

#include "model.hpp"

#include <filippov/engine/trajectory.hpp>

#include <algorithm>
#include <cstddef>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace filippov::python {

/// The solution of a run as its dense pieces.
template <class Sys> class DenseSolution final : public Solution {
public:
    static constexpr int N = dim_v<Sys>;
    static constexpr int M = surfaces_v<Sys>;
    using X = Vec<double, N>;

    Trajectory<Sys, double> trajectory;

    explicit DenseSolution(Trajectory<Sys, double> kept)
        : trajectory(std::move(kept)), n_(component_count(trajectory.sys)),
          m_(surface_count(trajectory.sys)) {}

    std::span<const double> knots() const override { return trajectory.t; }
    void states(std::span<const double> times, std::span<double> out) const override {
        for (std::size_t k = 0; k < times.size(); ++k) {
            const X x = state(times[k]);
            std::copy_n(x.data(), n_, out.begin() + std::ptrdiff_t(k) * n_);
        }
    }
    void modes(std::span<const double> times, std::span<signed char> out) const override {
        for (std::size_t k = 0; k < times.size(); ++k) {
            const Mode<M> mode = mode_at(times[k]);
            std::copy_n(mode.side.data(), m_, out.begin() + std::ptrdiff_t(k) * m_);
        }
    }
    void blend(std::span<const double> times, std::span<double> out) const override {
        for (std::size_t k = 0; k < times.size(); ++k) {
            const double time = times[k];
            const Mode<M> mode = mode_at(time);
            const double T = period(trajectory.sys, trajectory.p);
            for (int j = 0; j < m_; ++j) {
                double& s = out[k * std::size_t(m_) + std::size_t(j)];
                s = mode[j];
                const double local = Clock<double>::at(time, T).local;
                if (mode[j] != 0) {
                    if (is_directed(trajectory.sys, j)) // an entry of the direction that it has
                        s = sides_and_directions(trajectory.sys, mode, local, state(time),
                                                 trajectory.p)[j];
                    continue;
                }
                s = is_kind(trajectory.sys, j, SurfaceKind::jump)
                        ? std::numeric_limits<double>::quiet_NaN() // contact: a force, and no s
                        : sliding_margin(trajectory.sys, mode, j, local, state(time), trajectory.p)
                              .s;
            }
        }
    }

    PackedSolution packed() const override {
        PackedSolution all;
        const auto append = [&](std::vector<double>& column, const X& x) {
            column.insert(column.end(), x.begin(), x.begin() + n_);
        };
        all.params.assign(trajectory.p.begin(),
                          trajectory.p.begin() + given_params(trajectory.sys));
        append(all.scale, trajectory.scale);
        all.t = trajectory.t;
        for (const X& x : trajectory.x)
            append(all.x, x);
        for (const Mode<M>& mode : trajectory.mode)
            all.mode.insert(all.mode.end(), mode.side.begin(), mode.side.begin() + m_);
        for (const auto& piece : trajectory.pieces) {
            all.period.push_back(piece.clock.index);
            all.t_local.push_back(piece.clock.local);
            all.carry.push_back(piece.clock.carry);
            all.dt.push_back(piece.dt);
            append(all.x0, piece.x0);
            for (const X& c : piece.polynomial.c)
                append(all.polynomial, c);
            all.closed_form.push_back(
                static_cast<signed char>(piece.closed_form | (piece.mode.second_order << 1)));
        }
        return all;
    }
    static std::shared_ptr<const Solution> of(const Sys& sys, const PackedSolution& all) {
        const int n = component_count(sys), m = surface_count(sys);
        const auto vector = [n](const std::vector<double>& column, std::size_t row,
                                double rest = 0.0) {
            return padded<N>(std::span(column).subspan(row * std::size_t(n)), n, rest);
        };
        const auto p = all_params<double>(sys, all.params);
        Trajectory<Sys, double> kept{sys, p, all.t, {}, {}, {}, {}, {}, vector(all.scale, 0, 1.0)};
        for (std::size_t k = 0; k < all.t.size(); ++k) {
            kept.x.push_back(vector(all.x, k));
            Mode<M> mode;
            for (int j = 0; j < M; ++j)
                mode.set(j, j < m ? all.mode[k * std::size_t(m) + std::size_t(j)] : 1);
            kept.mode.push_back(mode);
        }
        for (std::size_t k = 0; k < all.dt.size(); ++k) {
            DensePiece<double, N, M> piece{
                {filippov::period(sys, p), all.period[k], all.t_local[k], all.carry[k]},
                all.dt[k],
                vector(all.x0, k),
                kept.mode[k + 1],
                {},
                (all.closed_form[k] & 1) != 0};
            if (all.closed_form[k] == 2 && piece.mode[0] == 0) // a slide of second order
                piece.mode.hold_rate(0);
            for (std::size_t i = 0; i < solution_terms; ++i)
                piece.polynomial.c[i] = vector(all.polynomial, k * solution_terms + i);
            kept.pieces.push_back(piece);
        }
        return std::make_shared<DenseSolution>(std::move(kept));
    }

private:
    X state(double time) const {
        if (const auto k = knot(time))
            return trajectory.x[*k];
        return trajectory(time);
    }
    Mode<M> mode_at(double time) const {
        if (trajectory.pieces.empty())
            return trajectory.mode.front();
        return trajectory.mode_at(time);
    }
    /// The knot at exactly this time, the first if there are several: the value from before.
    std::optional<std::size_t> knot(double time) const {
        const auto& t = trajectory.t;
        const bool forward = t.back() >= t.front();
        const auto before = [forward](double a, double b) { return forward ? a < b : a > b; };
        const auto found = std::lower_bound(t.begin(), t.end(), time, before);
        if (found == t.end() || *found != time)
            return std::nullopt;
        return std::size_t(found - t.begin());
    }

    const int n_, m_; ///< components, surfaces
};

} // namespace filippov::python
