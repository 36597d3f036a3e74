// SPDX-License-Identifier: BSD-3-Clause
// What the analysis of orbits needs of a system, with derivatives: a few maps, behind an interface.
//
// Shooting, continuation and bifurcations are linear algebra on top of these maps. They see nothing
// else of a system and are compiled once, not once a system. any_system.hpp makes one of any
// system.
#pragma once

#include <filippov/core/status.hpp>
#include <filippov/run/counters.hpp>
#include <filippov/run/event.hpp>
#include <filippov/run/settings.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace filippov {

using Vector = Eigen::VectorXd;
using Matrix = Eigen::MatrixXd;

/// A value and its derivatives in the directions (x, t0, t1, a, b): the start, its time, the time
/// of the end, and two parameters.
struct Jet {
    Vector value; ///< shape (m,)
    Matrix slope; ///< shape (m, dim + 4)
    Matrix bend;  ///< derivatives of slope * v, shape (m, dim + 4), if a v was given
    Status status = Status::ok;
};

/// Which derivatives are wanted.
struct Directions {
    std::array<int, 2> active{-1, -1}; ///< indices of parameters a and b; -1: none
    const Vector* v = nullptr;         ///< direction of a second derivative, shape (dim + 4,)
};

/// Entry j of the mode with this code, see Mode::code.
constexpr int mode_entry(int code, int j) {
    for (; j > 0; --j)
        code = (code - ((code % 3 + 4) % 3 - 1)) / 3;
    return (code % 3 + 4) % 3 - 1;
}
/// The mode of the first n surfaces with this code; the others are not met, and above.
template <int M> Mode<M> mode_of(int code, int n = M) {
    Mode<M> mode;
    for (int j = 0; j < M; ++j)
        mode.set(j, j < n ? mode_entry(code, j) : 1);
    return mode;
}
/// How many surfaces it slides on.
constexpr int slid_on(int code, int surfaces) {
    int n = 0;
    for (int j = 0; j < surfaces; ++j)
        n += mode_entry(code, j) == 0;
    return n;
}
/// Its entries as characters `-`, `0` and `+`.
inline std::string mode_text(int code, int surfaces) {
    std::string text;
    for (int j = 0; j < surfaces; ++j)
        text += "-0+"[mode_entry(code, j) + 1];
    return text;
}

/// A scalar function of a point, with its derivatives along a flow.
struct Quantity {
    enum class Kind : unsigned char {
        h,      ///< the switching function, along the field of mode `side`
        margin, ///< s_max + s (side -1) or s_max - s (side +1), along the field of mode `slide`
    };
    Kind kind = Kind::h;
    int side = -1;
    int order = 0;   ///< which derivative along the flow, time included; 0 to 3
    int surface = 0; ///< whose h, or s
    int slide = 0;   ///< mode that s belongs to; 0: all surfaces are slid on
};

/// An event of a run.
struct Happening {
    EventKind kind{};
    double t = 0;
    Vector x;
    int before = 0, after = 0; ///< modes
    double s = 0;
    int surface = 0;       ///< that was hit or left
    unsigned contacts = 0; ///< surfaces that the point is on: bit j for surface j
};

/// A run with its events.
struct History {
    Status status = Status::ok;
    std::string message;
    double t = 0; ///< at the end
    Vector x;
    int mode = 0;
    int surfaces = 1;
    std::vector<Happening> events; ///< changes of mode, grazings and extrema
    Counters counters{};
};

/// A run that may end at an event: where it starts, and what ends it.
struct Leg {
    double t0 = 0;
    Vector x;
    double t_end = 0;
    int boundary = 0;  ///< it starts at the end of a slide, at s = -1 or +1; 0: nothing is known
    bool held = false; ///< if it starts in a slide so do its neighbours
    std::function<bool(const Happening&)> ends{}; ///< asked at every event; may be empty
};

/// What came of it, with derivatives.
struct Journey {
    Status status = Status::ok; ///< `event` if an event ended it
    std::string message;
    Jet end;               ///< (x, t) at the end, m = dim + 1; NaN slopes where singular
    std::string word;      ///< the modes passed through, as `-`, `0` and `+`; see mode_text
    int slides = 0;        ///< how many of them slide
    int first = 0;         ///< the first of them
    int last = 0;          ///< the last of them
    int lost = 0;          ///< directions that the tangent space has lost, at least
    bool singular = false; ///< an event was tangential within the tolerance
};

/// A least distance inside a segment.
struct Least {
    double t = 0;
    Vector x;
    double value = 0;
    int side = 0; ///< in a slide: the boundary s = side; off the surface: the side itself
};

/// A period and its derivatives with respect to two parameters.
struct PeriodJet {
    double value = 0;
    std::array<double, 2> slope{};
    std::array<std::array<double, 2>, 2> bend{};
};

/// How exactly an AnySystem computes.
struct Precision {
    double rtol = 1e-12;
    double atol = 1e-13;              ///< units of x
    long long max_steps = 10'000'000; ///< in one run
    /// May be empty. Asked now and then; from true on arcs and runs end with `interrupted`.
    std::function<bool()> interrupted{};
};

/// See the top of the file. Modes are given by their codes, see Mode::code: for one surface -1, +1
/// and 0 (sliding).
class AnySystem {
public:
    virtual ~AnySystem() = default;
    AnySystem() = default;
    AnySystem(const AnySystem&) = delete;
    AnySystem& operator=(const AnySystem&) = delete;

    virtual int dim() const = 0;
    /// What each surface is.
    virtual std::vector<SurfaceKind> kinds() const = 0;
    int surfaces() const { return int(kinds().size()); }
    virtual std::vector<std::string> params() const = 0;
    virtual Vector defaults() const = 0;
    /// Relative tolerance of arcs and runs.
    virtual double rtol() const = 0;
    /// True if the fields repeat with a period.
    virtual bool forced() const = 0;
    /// The period with its derivatives with respect to a and b; zeros if there is none.
    virtual PeriodJet period(const Vector& p, const Directions& along) const = 0;

    /// Sliding is kept while |s| is below this: 1, or more with static friction.
    virtual double s_max(const Vector& p) const = 0;

    /// The field of a mode at a point.
    virtual Vector field(int mode, double t, const Vector& x, const Vector& p) const = 0;
    /// The same with derivatives (t0 is its time; t1 plays no part); m = dim.
    virtual Jet rate(int mode, double t, const Vector& x, const Vector& p,
                     const Directions& along) const = 0;
    /// A quantity at a point (t0 is its time; t1 plays no part); m = 1.
    virtual Jet quantity(const Quantity& q, double t, const Vector& x, const Vector& p,
                         const Directions& along) const = 0;
    /// x(t1) of a prescribed mode from x at t0; m = dim. Any sign of t1 - t0.
    virtual Jet arc(int mode, double t0, const Vector& x, double t1, const Vector& p,
                    const Directions& along) const = 0;
    /// (h(t1) - sum_k<order h^(k) tau^k/k!) / tau^order along the field of a side, tau = t1 - t0,
    /// by its Taylor series at t0: what is left of h when its roots at the start are divided out;
    /// m = 1. No value if tau is too long for the series to be exact to rounding (or as exact as
    /// differences are, of functions known by their values), for second derivatives, nor with
    /// several surfaces.
    virtual std::optional<Jet> rise(int side, int order, double t0, const Vector& x, double t1,
                                    const Vector& p, const Directions& along) const = 0;
    /// Interior minima along a prescribed mode: of |h| off the surface, of 1 + s and 1 - s on it.
    /// (Of a system with one surface.)
    virtual std::vector<Least> minima(int mode, double t0, const Vector& x, double t1,
                                      const Vector& p) const = 0;
    /// The solution from x at t0 to t_end.
    virtual History run(double t0, const Vector& x, double t_end, const Vector& p) const = 0;
    /// The same with derivatives of its end, which may be an event.
    virtual Journey journey(const Leg& leg, const Vector& p, const Directions& along) const = 0;
    /// True if the caller has asked to stop. What arcs and runs gave since then is of no use.
    virtual bool interrupted() const = 0;

    /// What arcs, runs and journeys did so far, all together.
    virtual Counters counters() const = 0;
};

/// True if a field or h depends on time at this point.
inline bool depends_on_time(const AnySystem& system, double t, const Vector& x, const Vector& p) {
    const int d = system.dim(), surfaces = system.surfaces();
    // what is no number, as the derivative of a root at zero, says nothing
    const auto moves = [d](const Jet& jet) { return (jet.slope.col(d).array().abs() > 0).any(); };
    for (int region = 0; region < 1 << surfaces; ++region) {
        int mode = 0;
        for (int j = surfaces - 1; j >= 0; --j)
            mode = 3 * mode + ((region >> j & 1) != 0 ? 1 : -1);
        if (moves(system.rate(mode, t, x, p, {})))
            return true;
    }
    for (int j = 0; j < surfaces; ++j)
        if (moves(system.quantity({Quantity::Kind::h, -1, 0, j}, t, x, p, {})))
            return true;
    return false;
}

namespace detail {

/// @error std::invalid_argument for anything but one surface at which only the field jumps
inline void require_one_surface(const AnySystem& system) {
    if (system.surfaces() != 1)
        refuse("surfaces", system.surfaces(), "expected 1");
    if (system.kinds()[0] != SurfaceKind::switching)
        throw std::invalid_argument("filippov: system: expected one switching surface");
}
/// @param name  of the state among the caller's arguments
inline void require_point(const AnySystem& system, double t0, const Vector& x, const Vector& p,
                          const std::string& name = "x") {
    if (x.size() != system.dim())
        refuse(name + ".size()", double(x.size()), "expected dim entries");
    if (p.size() != Eigen::Index(system.params().size()))
        refuse("p.size()", double(p.size()), "expected one entry a parameter");
    for (Eigen::Index i = 0; i < x.size(); ++i)
        if (!std::isfinite(x[i]))
            refuse(name + "[" + std::to_string(i) + "]", x[i], "expected a finite number");
    for (Eigen::Index i = 0; i < p.size(); ++i)
        if (!std::isfinite(p[i]))
            refuse("p[" + std::to_string(i) + "]", p[i], "expected a finite number");
    if (!std::isfinite(t0))
        refuse("t0", t0, "expected a finite number");
}
inline PeriodJet require_period(const AnySystem& system, const Vector& p,
                                const Directions& along = {}) {
    if (!system.forced())
        throw std::invalid_argument("filippov: system: expected one with a period");
    const PeriodJet T = system.period(p, along);
    if (!(T.value > 0 && T.value < std::numeric_limits<double>::infinity()))
        refuse("period", T.value, "expected a finite number > 0");
    return T;
}
inline void require_parameter(const AnySystem& system, const std::string& name, int k) {
    if (!(k >= 0 && std::size_t(k) < system.params().size()))
        refuse(name, k, "expected an index of a parameter");
}
inline void require_range(const std::string& name, double low, double high) {
    if (!(low < high && std::isfinite(high - low)))
        refuse(name, low, "expected finite low < high");
}
/// True if there are surfaces at which the state jumps.
inline bool has_jumps(const AnySystem& system) {
    const auto kinds = system.kinds();
    return std::find(kinds.begin(), kinds.end(), SurfaceKind::jump) != kinds.end();
}
/// @error std::invalid_argument for a system whose state jumps
inline void refuse_jumps(const AnySystem& system) {
    if (has_jumps(system))
        throw std::invalid_argument("filippov: system: expected no jumps of the state");
}

} // namespace detail

} // namespace filippov
