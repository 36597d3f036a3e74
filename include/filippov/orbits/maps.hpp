// SPDX-License-Identifier: BSD-3-Clause
// Maps of a flow with their derivatives: strobe, section, and the transition map of section 4.5.
#pragma once

#include <filippov/orbits/system_interface.hpp>

#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace filippov {

/// Where a map leads, with derivatives.
struct Mapped {
    Status status = Status::ok;
    std::string message;   ///< of a failure
    double t = 0;          ///< time there
    Vector x;              ///< state there
    Matrix slope;          ///< d(x, t)/d(x0, t0), shape (dim + 1, dim + 1)
    Matrix param_slope;    ///< d(x, t)/d(a, b), the active parameters; shape (dim + 1, 2)
    std::string word;      ///< modes passed through, of several surfaces with spaces between
    int slides = 0;        ///< how many of them slide
    int lost = 0;          ///< directions that the slope has lost, at least
    bool singular = false; ///< an event was tangential: no slopes, they are NaN
    bool ok() const { return status == Status::ok; }
};

namespace detail {

/// The parameters to derive by: indices, or -1 for none.
inline void require_active(const Directions& along, const Vector& p) {
    for (const int i : along.active)
        if (!(i >= -1 && i < p.size()))
            refuse("along.active", i, "expected an index of a parameter, or -1");
    if (along.v != nullptr)
        throw std::invalid_argument("filippov: along.v: maps have no second derivatives");
}

inline Mapped mapped(const AnySystem& system, const Journey& journey) {
    const int d = system.dim();
    Mapped m;
    m.status = journey.status;
    if (!m.ok())
        m.message = journey.message;
    m.x = journey.end.value.head(d);
    m.t = journey.end.value[d];
    m.slope = journey.end.slope.leftCols(d + 1);
    m.param_slope = journey.end.slope.rightCols(2);
    m.word = journey.word;
    m.slides = journey.slides;
    m.lost = journey.lost;
    m.singular = journey.singular;
    return m;
}

/// True if the state jumps at the end of a journey, but for rounding of its time.
inline bool jump_is_due(const AnySystem& system, const Journey& journey, const Vector& p,
                        double period) {
    const int d = system.dim();
    const Vector x = journey.end.value.head(d);
    const auto kinds = system.kinds();
    for (int j = 0; j < int(kinds.size()); ++j) {
        if (kinds[std::size_t(j)] != SurfaceKind::jump || mode_entry(journey.last, j) == 0)
            continue;
        const Jet h =
            system.quantity({Quantity::Kind::h, +1, 0, j}, journey.end.value[d], x, p, {});
        const auto rate = journey.end.slope.col(d + 1).head(d);
        const double approach = -(h.slope.row(0).head(d).dot(rate) + h.slope(0, d));
        if (approach > 0 && std::abs(h.value[0]) <= 1e-10 * period * approach)
            return true;
    }
    return false;
}

/// A journey to a time at which the state jumps: to right after the jump, wherever rounding had
/// left it. It goes on for a moment, and back along what comes after the jump.
inline Journey past_jump(const AnySystem& system, const Leg& leg, const Journey& before,
                         const Vector& p, const Directions& along, double period) {
    if (!(before.status == Status::ok && has_jumps(system) &&
          jump_is_due(system, before, p, period)))
        return before;
    const int d = system.dim();
    Leg longer = leg;
    longer.t_end += 1e-9 * period;
    Journey after = system.journey(longer, p, along);
    if (after.status != Status::ok || after.singular)
        return before;
    const Jet back =
        system.arc(after.last, longer.t_end, after.end.value.head(d), leg.t_end, p, along);
    if (back.status != Status::ok)
        return before;
    const Matrix slope = back.slope.leftCols(d) * after.end.slope.topRows(d);
    after.end.value.head(d) = back.value;
    after.end.value[d] = leg.t_end;
    after.end.slope.topRows(d) = slope;
    after.end.slope.col(d + 1).head(d) = back.slope.col(d + 1);
    after.end.slope.topRightCorner(d, 2) += back.slope.rightCols(2);
    return after;
}

} // namespace detail

/// The strobe map: the state `iterate` forcing periods later.
///
/// Where the state jumps at that time it is the state after the jump. Time is carried along, t +
/// iterate T, so that the slope is that of a section, too. A slide makes the slope singular: its
/// multiplier 0 is exact where the slide is the last mode.
/// @param along  parameters for `param_slope`, which the period may depend on
inline Mapped strobe(const AnySystem& system, double t0, const Vector& x0, const Vector& p,
                     int iterate = 1, const Directions& along = {}) {
    detail::require_point(system, t0, x0, p);
    detail::require_positive("iterate", iterate);
    detail::require_active(along, p);
    const PeriodJet T = detail::require_period(system, p, along);
    const int d = system.dim();
    Leg leg{.t0 = t0, .x = x0, .t_end = t0 + iterate * T.value};
    const Journey journey =
        detail::past_jump(system, leg, system.journey(leg, p, along), p, along, T.value);
    Mapped m = detail::mapped(system, journey);
    // The end is a period after the start, and moves with it and with the period.
    const auto by_end = journey.end.slope.col(d + 1);
    m.slope.col(d) += by_end;
    for (int k = 0; k < 2; ++k)
        m.param_slope.col(k) += iterate * T.slope[std::size_t(k)] * by_end;
    return m;
}

/// Which events a section map goes to.
struct SectionOf {
    /// cross, enter_sliding or exit_sliding. A neighbour of a solution that touches something does
    /// not touch it: such events make no map.
    EventKind kind = EventKind::exit_sliding;
    int after = 2;    ///< only those after which the surface's mode is this one; 2: all
    int surface = -1; ///< only those of this surface; -1: all
};

namespace detail {

inline void require_section(const SectionOf& section, int surfaces) {
    const EventKind kind = section.kind;
    if (kind != EventKind::cross && kind != EventKind::enter_sliding &&
        kind != EventKind::exit_sliding)
        throw std::invalid_argument("filippov: section.kind = " + std::string(name(kind)) +
                                    ": expected cross, enter_sliding or exit_sliding");
    if (section.after < -1 || section.after > 2)
        refuse("section.after", section.after, "expected -1, 0, +1, or 2 for all");
    if (!(section.surface >= -1 && section.surface < surfaces))
        refuse("section.surface", section.surface, "expected a surface, or -1 for all");
}

} // namespace detail

/// The section map: state and time at the next event of a kind, `iterate` times.
/// @param max_time  to wait, once for each of them, in all
/// @param along  parameters for `param_slope`
/// @return status `escaped` if no such event comes in this time
inline Mapped section_map(const AnySystem& system, const SectionOf& section, double t0,
                          const Vector& x0, const Vector& p, double max_time, int iterate = 1,
                          const Directions& along = {}) {
    detail::require_point(system, t0, x0, p);
    detail::require_positive("iterate", iterate);
    detail::require_active(along, p);
    detail::require_section(section, system.surfaces());
    if (!(max_time > 0 && max_time < std::numeric_limits<double>::infinity()))
        detail::refuse("max_time", max_time, "expected a finite number > 0");
    int left = iterate;
    const int surfaces = system.surfaces();
    Leg leg{.t0 = t0, .x = x0, .t_end = t0 + iterate * max_time};
    leg.ends = [&](const Happening& e) {
        if (!is_change(e.kind))
            return false;
        // Several surfaces may change their modes at once.
        bool counts = false;
        for (int j = 0; j < surfaces; ++j) {
            const int before = mode_entry(e.before, j), after = mode_entry(e.after, j);
            counts = counts || ((section.surface < 0 || section.surface == j) && before != after &&
                                kind_of(before, after) == section.kind &&
                                (section.after == 2 || section.after == after));
        }
        left -= counts;
        return counts && left == 0;
    };
    Mapped m = detail::mapped(system, system.journey(leg, p, along));
    if (m.status == Status::event) {
        m.status = Status::ok;
        m.message.clear();
    } else if (m.status == Status::ok) {
        m.status = Status::escaped;
        m.message = "no event of kind " + std::string(name(section.kind)) + " within max_time.";
    }
    return m;
}

// --- the transition map ----------------------------------------------------------------------

/// A transition from stick to slip: the boundary of the sliding region that is left, and when.
struct Transition {
    int boundary = -1; ///< s there: -1 (into h < 0) or +1 (into h > 0)
    double phase = 0;  ///< 2 pi t / T, in [0, 2 pi)
};

/// The point of the exit curve at a phase.
struct ExitPoint {
    Vector x;
    Vector rate;            ///< dx/dt along the curve
    double drift = 0;       ///< derivative of 1 - |s| along the slide
    bool attracting = true; ///< sliding attracts here
    /// The slide leaves; else it goes on from here, and this phase is never the image of another.
    bool true_exit() const { return drift < 0; }
};

/// Where the transition map leads.
struct Image {
    Status status = Status::ok; ///< not ok: the map is not defined, `message` says why
    std::string message;
    Transition to;
    double slope = 0;      ///< d(to.phase)/d(phase)
    std::string word;      ///< modes on the way, a bar between iterates
    bool true_exit = true; ///< of the start
    long long turns = 0;   ///< how often the phase passed 2 pi
    bool singular = false; ///< passed a tangency: no slope
    bool ok() const { return status == Status::ok; }
};

/// How the transition map is computed.
struct TransitionSettings {
    double max_periods = 50; ///< forcing periods to wait for a transition, > 0
    Vector guess{};          ///< a point near the exit curves at phase 0; empty: the origin
};

/// P_trans of a forced planar system: from one transition from stick to slip to the next.
///
/// Acts on (boundary, phase), two circles: at a phase the exit curve (h = 0, |s| = 1) has one point
/// on either boundary, found by Newton from its neighbours, so the map is one-dimensional. Where
/// the slide does not leave there but goes on, the map starts with this slide. Should a curve have
/// several branches, it is the one nearest to the guess; images on another are undefined.
/// @source chapter, section 4.5
class TransitionMap {
public:
    /// @error std::invalid_argument for a system that is not planar, not forced or has static
    ///        friction, and for parameters and settings that make no sense
    TransitionMap(const AnySystem& system, Vector p, TransitionSettings settings = {})
        : system_(&system), p_(std::move(p)), settings_(std::move(settings)) {
        validate();
        for (const int boundary : {-1, 1})
            trace(boundary);
    }

    const AnySystem& system() const { return *system_; }
    const Vector& params() const { return p_; }
    double period() const { return T_; }
    double time_of(double phase) const { return phase / turn * T_; }
    bool interrupted() const { return system_->interrupted(); }

    static constexpr double turn = 2 * std::numbers::pi;
    /// The same phase in [0, 2 pi).
    static double wrapped(double phase) {
        const double r = phase - turn * std::floor(phase / turn);
        return r < turn ? r : 0.0;
    }

    /// The point of the exit curve; none if Newton finds no point there.
    std::optional<ExitPoint> exit_point(const Transition& at) const {
        const auto& nodes = curve(at.boundary);
        const double phase = wrapped(at.phase);
        if (!std::isfinite(phase))
            return std::nullopt;
        const auto k = std::size_t(std::lround(phase / turn * double(nodes.size())));
        const Vector& near = nodes[k % nodes.size()];
        if (near.size() == 0)
            return std::nullopt;
        const auto x = solve(at.boundary, time_of(phase), near);
        return x ? std::optional(describe(at.boundary, time_of(phase), *x)) : std::nullopt;
    }

    /// True if the end of a slide is on the branch of the exit curve that was traced: there may be
    /// several points at a phase.
    bool knows(const Transition& at, const Vector& x) const {
        const auto known = exit_point(at);
        if (!known)
            return false;
        double size = 0;
        for (const Vector& node : curve(at.boundary))
            size = std::max(size, node.size() > 0 ? node.lpNorm<1>() : 0.0);
        return (known->x - x).lpNorm<1>() <= 1e-6 * size;
    }
    /// P_trans^iterate.
    /// @error std::invalid_argument for a boundary, a phase or a number that make no sense
    Image operator()(const Transition& from, int iterate = 1) const {
        curve(from.boundary); // refuses another
        if (!std::isfinite(from.phase))
            detail::refuse("from.phase", from.phase, "expected a finite number");
        detail::require_positive("iterate", iterate);
        Image total;
        total.to = {from.boundary, wrapped(from.phase)};
        total.slope = 1;
        for (int k = 0; k < iterate; ++k) {
            const Image next = step(total.to);
            total.status = next.status;
            total.word += (k > 0 ? "|" : "") + next.word;
            if (k == 0)
                total.true_exit = next.true_exit;
            total.slope *= next.slope;
            total.singular = total.singular || next.singular;
            total.turns += next.turns;
            total.to = next.to;
            if (!next.ok()) {
                total.message = next.message;
                break;
            }
        }
        return total;
    }

private:
    using Curve = std::vector<Vector>;

    void validate() {
        detail::require_one_surface(*system_);
        if (system_->dim() != 2)
            detail::refuse("dim", system_->dim(),
                           "expected 2: on the surface of a planar system a slide ends in points");
        if (settings_.guess.size() == 0)
            settings_.guess = Vector::Zero(2);
        detail::require_point(*system_, 0, settings_.guess, p_);
        T_ = detail::require_period(*system_, p_).value;
        if (!(system_->s_max(p_) == 1))
            detail::refuse("s_max", system_->s_max(p_), "expected 1, no static friction");
        if (!(settings_.max_periods > 0 && settings_.max_periods <= 1e9))
            detail::refuse("max_periods", settings_.max_periods, "expected a number > 0, <= 1e9");
    }

    const Curve& curve(int boundary) const {
        if (boundary != -1 && boundary != 1)
            detail::refuse("boundary", boundary, "expected -1 or +1");
        return curves_[boundary < 0 ? 0 : 1];
    }
    /// The exit curve at phases all round, each point found from the one before.
    void trace(int boundary) {
        Curve& nodes = curves_[boundary < 0 ? 0 : 1];
        nodes.resize(64);
        std::optional<Vector> last;
        for (std::size_t k = 0; k < nodes.size(); ++k) {
            const double t = T_ * double(k) / double(nodes.size());
            const auto x = last ? solve(boundary, t, *last) : search(boundary, t);
            if (x)
                last = nodes[k] = *x;
        }
    }
    /// A first point of the curve: from the guess, and from around it.
    std::optional<Vector> search(int boundary, double t) const {
        const double size = settings_.guess.norm() > 0 ? settings_.guess.norm() : 1.0;
        for (const double radius : {0.0, 0.1, 1.0, 10.0})
            for (int k = 0; k < 8; ++k) {
                const double angle = turn * k / 8;
                const Vector from =
                    settings_.guess +
                    radius * size * Eigen::Vector2d(std::cos(angle), std::sin(angle));
                if (const auto x = solve(boundary, t, from))
                    return x;
                if (radius == 0)
                    break;
            }
        return std::nullopt;
    }
    Jet quantity(Quantity::Kind kind, int side, int order, double t, const Vector& x) const {
        return system_->quantity({kind, side, order}, t, x, p_, {});
    }
    /// Newton on h = 0 and 1 - |s| = 0.
    std::optional<Vector> solve(int boundary, double t, Vector x) const {
        for (int k = 0; k < 30; ++k) {
            Eigen::Vector2d g;
            const Eigen::Matrix2d J = gradients(boundary, t, x, &g);
            const Eigen::Vector2d dx = -J.partialPivLu().solve(g);
            x += dx;
            const double size = dx.norm();
            if (!(size < std::numeric_limits<double>::infinity()))
                return std::nullopt;
            if (size <= 4e-15 * (x.norm() + size) || size < 1e-300)
                return x;
            // At the floor of rounding steps no longer shrink.
            if (k >= 6 && size <= 1e-12 * x.norm())
                return x;
        }
        return std::nullopt;
    }
    Eigen::Matrix2d gradients(int boundary, double t, const Vector& x, Eigen::Vector2d* value,
                              Eigen::Vector2d* by_time = nullptr) const {
        const Jet h = quantity(Quantity::Kind::h, -1, 0, t, x);
        const Jet margin = quantity(Quantity::Kind::margin, boundary, 0, t, x);
        *value << h.value[0], margin.value[0];
        if (by_time != nullptr)
            *by_time << h.slope(0, 2), margin.slope(0, 2);
        Eigen::Matrix2d J;
        J << h.slope(0, 0), h.slope(0, 1), margin.slope(0, 0), margin.slope(0, 1);
        return J;
    }
    ExitPoint describe(int boundary, double t, const Vector& x) const {
        ExitPoint e;
        Eigen::Vector2d value, by_time;
        const Eigen::Matrix2d J = gradients(boundary, t, x, &value, &by_time);
        e.x = x;
        e.rate = -J.partialPivLu().solve(by_time);
        e.drift = quantity(Quantity::Kind::margin, boundary, 1, t, x).value[0];
        const double l1 = quantity(Quantity::Kind::h, -1, 1, t, x).value[0];
        const double l2 = quantity(Quantity::Kind::h, +1, 1, t, x).value[0];
        e.attracting = l1 - l2 > 0;
        return e;
    }

    Image undefined(Status status, std::string why) const {
        Image image;
        image.status = status;
        image.message = std::move(why);
        image.slope = std::numeric_limits<double>::quiet_NaN();
        return image;
    }
    Image step(const Transition& from) const {
        if (interrupted())
            return undefined(Status::interrupted, std::string(message(Status::interrupted)));
        const auto exit = exit_point(from);
        if (!exit)
            return undefined(Status::not_converged,
                             "Newton's iteration found no end of a slide at this phase; give a "
                             "guess near it.");
        if (!exit->attracting)
            return undefined(Status::ambiguous, "Sliding repels at this end of a slide.");
        const double t0 = time_of(from.phase);
        Leg leg{.t0 = t0, .x = exit->x, .t_end = t0 + settings_.max_periods * T_};
        leg.boundary = from.boundary;
        int after = 0;
        leg.ends = [&](const Happening& e) {
            after = e.after;
            return e.kind == EventKind::exit_sliding;
        };
        const Journey journey = system_->journey(leg, p_, {});
        Image image = journey.status == Status::event ? arrived(*exit, journey, after)
                                                      : undefined(journey.status, journey.message);
        if (image.ok() && !knows(image.to, journey.end.value.head(2)))
            image = undefined(Status::not_converged,
                              "The next slide ends on another branch of the exit curve; give a "
                              "guess near it.");
        image.true_exit = exit->true_exit();
        image.word = journey.word;
        if (journey.status == Status::ok) {
            image.status = Status::escaped;
            image.message = journey.word.back() == '0'
                                ? "The stick lasts longer than max_periods."
                                : "No stick within max_periods forcing periods.";
        }
        return image;
    }
    Image arrived(const ExitPoint& exit, const Journey& journey, int after) const {
        Image image;
        const double t = journey.end.value[2];
        const auto& dt = journey.end.slope.row(2);
        image.to = {after, wrapped(t / T_ * turn)};
        image.slope = dt[0] * exit.rate[0] + dt[1] * exit.rate[1] + dt[2];
        image.turns = std::llround(((t / T_ * turn) - image.to.phase) / turn);
        image.singular = journey.singular;
        return image;
    }

    const AnySystem* system_;
    Vector p_;
    TransitionSettings settings_;
    double T_ = 0;
    std::array<Curve, 2> curves_;
};

} // namespace filippov
