// SPDX-License-Identifier: BSD-3-Clause
// Branches of periodic orbits over one parameter, through folds and sliding bifurcations.
#pragma once

#include <filippov/bifurcation.hpp>
#include <filippov/orbit.hpp>

namespace filippov {

/// A point of a branch.
struct BranchPoint {
    Cycle cycle;
    std::vector<std::complex<double>> multipliers;

    bool stable(bool forced) const { return is_stable(multipliers, forced); }
};

/// A bifurcation that was located.
struct SpecialPoint {
    Kind kind{};
    Cycle cycle;             ///< the orbit, with a node where it bifurcates
    std::size_t node = 0;    ///< that node, for sliding bifurcations
    int side = 0;            ///< the boundary of the sliding region that is met: s = side
    std::string word_before; ///< in the direction of the branch
    std::string word_after;
    std::vector<std::pair<std::string, double>> conditions; ///< names and residuals
    /// At the bifurcation, on the side of the word with fewer segments; and on the other side,
    /// where those of a grazing-sliding bifurcation jump.
    std::vector<std::complex<double>> multipliers, multipliers_child;
    std::string border_class; ///< of a grazing-sliding bifurcation, see border_collision()
    Convergence convergence;
};

/// A branch, from one end to the other.
struct Branch {
    std::vector<BranchPoint> points;
    std::vector<SpecialPoint> special;
    Status status = Status::ok; ///< of the end that went worse
    std::string begin, end;     ///< why it ends there
    long long corrections = 0;  ///< Newton iterations, each one flow with derivatives
};

/// How a branch is followed.
struct BranchSettings {
    double first_step = 0.01; ///< in units of the orbit's size and the bounds' width
    double max_step = 0.05;
    double min_step = 1e-7;
    int max_points = 2000; ///< steps in each direction
    /// May be empty. Called with the number of points so far, in both directions together.
    std::function<void(std::size_t points)> progress{};
};

namespace detail {

/// The residuals that the chapter lists, (4.24)-(4.29), in the signs of this library.
inline std::vector<std::pair<std::string, double>>
conditions_at(const AnySystem& system, const Cycle& c, std::size_t node, int side) {
    using K = Quantity::Kind;
    const auto at = [&](K kind, int order) {
        return system.quantity({kind, side, order}, c.t[node], c.x[node], c.p, {}).value[0];
    };
    const std::string L = side < 0 ? "L1" : "L2";
    return {{"h", at(K::h, 0)},
            {side < 0 ? "1 + s" : "1 - s", at(K::margin, 0)},
            {L, at(K::h, 1)},
            {L + "'", at(K::h, 2)},
            {L + "''", at(K::h, 3)}};
}

/// True if a branch ends because the caller asks to stop.
inline bool stopped(const AnySystem& system, Branch& branch) {
    if (!system.interrupted())
        return false;
    branch.status = Status::interrupted;
    branch.end = message(Status::interrupted);
    return true;
}
/// Steps until `advance(ds)` says that the branch ends.
template <class Advance>
void walk(const AnySystem& system, const BranchSettings& settings, Branch& branch,
          Advance advance) {
    double ds = settings.first_step;
    for (int k = 0; k < settings.max_points; ++k) {
        const bool goes_on = advance(ds);
        if (stopped(system, branch) || !goes_on)
            return;
    }
    branch.status = Status::max_steps;
    branch.end = "max_points reached";
}
/// One branch of the two directions in which it was followed from a start, the first point of both.
inline Branch joined(const Branch& backward, const Branch& forward) {
    Branch all;
    all.points.assign(backward.points.rbegin(), backward.points.rend());
    for (auto s = backward.special.rbegin(); s != backward.special.rend(); ++s) {
        all.special.push_back(*s);
        std::swap(all.special.back().word_before, all.special.back().word_after);
    }
    const auto first = forward.points.begin();
    if (!forward.points.empty())
        all.points.insert(all.points.end(), first + (all.points.empty() ? 0 : 1),
                          forward.points.end());
    all.special.insert(all.special.end(), forward.special.begin(), forward.special.end());
    all.begin = backward.end;
    all.end = forward.end;
    all.status = backward.status != Status::ok ? backward.status : forward.status;
    all.corrections = backward.corrections + forward.corrections;
    return all;
}

inline constexpr const char* closed = "the branch is closed: it comes back to its start";
inline constexpr const char* shrunk = "the orbit shrinks to an equilibrium";

/// Beyond this no digit of the other multipliers is left, and few of the orbit's.
inline constexpr double largest_multiplier = 1e12;
inline constexpr const char* too_unstable =
    "the orbit is too unstable for double precision: a multiplier of 1e12";

/// The multipliers without the 1 that an autonomous system has anyway.
inline std::vector<std::complex<double>> nontrivial(std::vector<std::complex<double>> multipliers,
                                                    bool forced) {
    const auto one = std::find(multipliers.begin(), multipliers.end(), 1.0);
    if (!forced && one != multipliers.end())
        multipliers.erase(one);
    return multipliers;
}
/// The product of (mu - border) over these.
inline double border_test(const std::vector<std::complex<double>>& multipliers, double border,
                          bool forced) {
    std::complex<double> product = 1;
    for (const auto& m : nontrivial(multipliers, forced))
        product *= m - border;
    return product.real();
}
/// Crossing and switching have the same equation; what follows where L' pushes tells them apart.
inline Kind named(const AnySystem& system, const SlidingCondition& s) {
    if (s.kind != Kind::switching_sliding && s.kind != Kind::crossing_sliding)
        return s.kind;
    const double push = system
                            .quantity({Quantity::Kind::h, s.side, 2}, s.cycle.t[s.node],
                                      s.cycle.x[s.node], s.cycle.p, {})
                            .value[0];
    return s.side * push < 0 ? Kind::switching_sliding : Kind::crossing_sliding;
}
/// A located sliding bifurcation with all that belongs to it, but for the words.
inline SpecialPoint special_point(const AnySystem& system, const SlidingCondition& s) {
    SpecialPoint special;
    special.kind = s.kind;
    special.cycle = s.cycle;
    special.node = s.node;
    special.side = s.side;
    special.conditions = conditions_at(system, s.cycle, s.node, s.side);
    special.multipliers = floquet(system, parent_of(s));
    special.multipliers_child =
        s.kind == Kind::grazing_sliding ? floquet_of_child(system, s) : special.multipliers;
    return special;
}

inline void validate(const BranchSettings& s) {
    if (!(s.min_step > 0 && s.min_step <= s.max_step && std::isfinite(s.max_step)))
        refuse("min_step", s.min_step, "expected 0 < min_step <= max_step");
    if (!(s.first_step > 0 && std::isfinite(s.first_step)))
        refuse("first_step", s.first_step, "expected a number > 0");
    require_positive("max_points", s.max_points);
}
/// With static friction a slide ends in a jump of the field, and no sliding bifurcation is one of
/// the four.
inline void require_continuable(const AnySystem& system, const Vector& p) {
    require_one_surface(system);
    if (const double limit = system.s_max(p); !(limit == 1))
        refuse("s_max", limit, "expected 1, no static friction");
}

} // namespace detail

/// Follows periodic orbits over one parameter.
class BranchTracer {
public:
    BranchTracer(const AnySystem& system, int parameter, double low, double high,
                 const BranchSettings& settings = {})
        : system_(system), parameter_(parameter), low_(low), high_(high), settings_(settings) {
        detail::require_parameter(system, "parameter", parameter);
        detail::require_range("low", low, high);
        detail::validate(settings);
    }

    /// The branch through a solved cycle, in both directions.
    /// @error std::invalid_argument unless there is one surface, a switching one without static
    /// friction
    Branch trace(const Cycle& start) {
        detail::require_continuable(system_, start.p);
        Branch backward, forward;
        both_ways(start, backward, forward);
        return detail::joined(backward, forward);
    }
    /// The branch through a bifurcation, that one among its special points: from one of the four
    /// sliding bifurcations the orbit with fewer segments goes one way, that with more the other.
    /// @error std::invalid_argument unless there is one surface, a switching one without static
    /// friction
    Branch trace(const SpecialPoint& start) {
        detail::require_continuable(system_, start.cycle.p);
        if (start.kind > Kind::adding_sliding)
            return trace_smooth(start);
        SlidingCondition s{start.kind, start.cycle, start.node, start.side};
        SpecialPoint here = describe(s, start.convergence);
        start_ = parent_of(s);
        Branch backward, forward;
        run(parent(s), backward, 0);
        auto next = child(s);
        here.word_before = start_.word.string();
        if (next) {
            next->entered = here.multipliers_child;
            here.word_after = next->shooting.word().string();
            run_on(std::move(next), backward, forward);
        } else {
            forward.end = no_orbit;
        }
        forward.special.insert(forward.special.begin(), here);
        return detail::joined(backward, forward);
    }

private:
    Branch trace_smooth(const SpecialPoint& start) {
        Branch backward, forward;
        both_ways(start.cycle, backward, forward);
        const auto is_start = [&](const SpecialPoint& s) {
            return s.kind == start.kind &&
                   std::abs(s.cycle.p[parameter_] - start.cycle.p[parameter_]) <
                       1e-7 * (high_ - low_);
        };
        // To rounding the test function is zero there: a step from it may see a change of sign.
        if (std::none_of(backward.special.begin(), backward.special.end(), is_start) &&
            std::none_of(forward.special.begin(), forward.special.end(), is_start)) {
            SpecialPoint here = start;
            name_smooth(here);
            forward.special.insert(forward.special.begin(), here);
        }
        return detail::joined(backward, forward);
    }
    void both_ways(const Cycle& start, Branch& backward, Branch& forward) {
        start_ = start;
        const auto up = place(start, [](const Vector& dz) { return dz[dz.size() - 1]; });
        auto down = up;
        if (down)
            down->t = -down->t;
        run(down, backward, 0);
        run_on(up, backward, forward);
    }

    /// Where the tracer is: a point of a word's curve with its tangent.
    struct Place {
        Shooting shooting;
        Arclength curve;
        Vector z, t;
        /// While no point of its word is on the branch: its multipliers at the bifurcation, none
        /// if they are not known.
        std::optional<std::vector<std::complex<double>>> entered;

        double slope() const { return t[t.size() - 1]; }
        double parameter() const { return parameter_of(z); }
        static double parameter_of(const Vector& u) { return u[u.size() - 1]; }
        /// How far along the tangent another point of the curve lies.
        double along(const Vector& u) const { return t.dot((u - z).cwiseQuotient(curve.scale())); }
    };

    static Equations equations_of(const Shooting& shooting) {
        return [&shooting](const Vector& z, Vector& F, Matrix& J) {
            auto e = shooting.evaluate(z);
            F = std::move(e.F);
            J = std::move(e.J);
            return e.status == Status::ok;
        };
    }
    Vector scales(const Shooting& shooting, const Cycle& c) const {
        Vector scale = shooting.scales(c);
        scale[scale.size() - 1] = high_ - low_;
        return scale;
    }
    /// A place on the curve of the cycle's word, its tangent such that `forward` of it is positive.
    /// @param lengths  in which steps are measured; empty: the orbit's own
    std::optional<Place> place(const Cycle& c, const std::function<double(const Vector&)>& forward,
                               const Vector& lengths = {}) {
        auto shooting = std::make_shared<Shooting>(system_, c, std::array<int, 2>{parameter_, -1});
        const Vector scale = lengths.size() > 0 ? lengths : scales(*shooting, c);
        Place p{*shooting,
                Arclength([shooting](const Vector& z, Vector& F,
                                     Matrix& J) { return equations_of(*shooting)(z, F, J); },
                          scale),
                shooting->pack(c),
                Vector(),
                {}};
        if (!p.curve.tangent_at(p.z, Vector::Unit(p.z.size(), p.z.size() - 1), p.t))
            return std::nullopt;
        if (forward(scale.cwiseProduct(p.t)) < 0)
            p.t = -p.t;
        return p;
    }

    BranchPoint point_of(const Cycle& c, const std::vector<Jet>& arcs = {}) const {
        BranchPoint p{c, floquet(system_, c, arcs)};
        detail::normalize(system_, p.cycle);
        return p;
    }

    static constexpr const char* no_orbit = "no orbit continues beyond this bifurcation";

    /// The other direction. The start is the first point of both.
    void run_on(std::optional<Place> here, const Branch& backward, Branch& forward) {
        if (backward.end == detail::closed)
            forward.end = detail::closed;
        else
            run(std::move(here), forward, std::max<std::size_t>(backward.points.size(), 1) - 1);
    }
    void run(std::optional<Place> here, Branch& branch, std::size_t points_before) {
        const auto tell = [&] {
            if (settings_.progress)
                settings_.progress(points_before + branch.points.size());
        };
        if (detail::stopped(system_, branch))
            return;
        if (!here) {
            branch.status = Status::not_finite;
            branch.end = "the start cannot be evaluated";
        } else {
            branch.points.push_back(point_of(start_));
            tell();
        }
        if (detail::stopped(system_, branch) || !here)
            return;
        detail::walk(system_, settings_, branch, [&](double& ds) {
            const bool goes_on = advance(*here, ds, branch);
            tell();
            return goes_on;
        });
    }

    /// One step, whatever it meets; false at the end of the branch.
    bool advance(Place& here, double& ds, Branch& branch) {
        static constexpr const char* diverges = "Newton's iteration does not converge";
        std::string trouble = diverges;
        for (; ds >= settings_.min_step; ds /= 2) {
            Vector z = here.z;
            Matrix J;
            const Convergence c = here.curve.step(z, J, here.t, ds);
            branch.corrections += c.iterations;
            if (!c.ok()) {
                trouble = trouble == detail::shrunk ? diverges : trouble;
                continue;
            }
            const Vector t = here.curve.tangent(J, here.t);
            if (!(t.dot(here.t) > 0.9))
                continue;
            Cycle cycle = here.shooting.unpack(z);
            // A step that leaves the bounds becomes one to the bound.
            const bool last = !(here.parameter_of(z) >= low_ && here.parameter_of(z) <= high_);
            if (last && !stop_at_bound(here, cycle, z, J, branch))
                continue;
            if (passes_equilibrium(here, cycle)) {
                trouble = detail::shrunk;
                continue;
            }
            if (passes_start(here, cycle)) {
                branch.points.push_back(point_of(start_));
                branch.end = detail::closed;
                return false;
            }
            std::vector<Test> failed = failures(cycle);
            if (!failed.empty()) {
                const auto outcome =
                    bifurcate(here, cycle, failed, branch, trouble, ds < 2 * settings_.min_step);
                if (outcome == Outcome::retry)
                    continue;
                ds =
                    std::min(ds, 0.1 * settings_.first_step); // to see what happens right behind it
                return outcome == Outcome::switched;
            }
            BranchPoint next = point_of(cycle, here.shooting.arcs_in(J));
            if (!(std::abs(next.multipliers[0]) < detail::largest_multiplier)) {
                trouble = detail::too_unstable;
                break;
            }
            const bool merged = smooth_bifurcations(here, here.curve.tangent(J, here.t),
                                                    here.along(z), branch, next);
            if (system_.interrupted())
                return false;
            if (merged) {
                branch.end = "it ends on the orbit of half its period, which flips there";
                return false;
            }
            branch.points.push_back(std::move(next));
            if (last) {
                branch.end = "bound of the parameter";
                return false;
            }
            here.z = z;
            here.t = t;
            here.entered.reset();
            if (needs_phase(cycle))
                renew_phase(here, cycle);
            if (c.iterations <= 3)
                ds = std::min(1.5 * ds, settings_.max_step);
            return true;
        }
        if (trouble != detail::shrunk)
            branch.status = Status::not_converged;
        branch.end = trouble;
        return false;
    }

    /// True for an orbit without events of an autonomous system: its only node is where it passes
    /// a plane.
    bool needs_phase(const Cycle& c) const {
        return !system_.forced() && c.word[0].until == Until::phase;
    }
    /// True if such an orbit is next to nothing, or has turned inside out since `here`: it shrinks
    /// to an equilibrium, where the parameter turns as well (a Hopf bifurcation, and no fold).
    bool passes_equilibrium(const Place& here, const Cycle& to) const {
        if (!needs_phase(to))
            return false;
        const auto length = [this](const Cycle& c) {
            return Vector(c.period * system_.field(c.word[0].mode, c.t[0], c.x[0], c.p));
        };
        const Vector now = length(to);
        return now.norm() <= 1e-4 * here.curve.scale().head(now.size()).norm() ||
               now.dot(length(here.shooting.unpack(here.z))) <= 0;
    }
    /// Puts the plane across the orbit that it is now: the one before may touch it further on,
    /// which would look like a fold.
    void renew_phase(Place& here, const Cycle& cycle) {
        const Vector lengths = here.curve.scale(), before = here.t.cwiseQuotient(lengths);
        const auto forward = [&](const Vector& dz) { return before.dot(dz); };
        if (auto renewed = place(cycle, forward, lengths))
            here = std::move(*renewed);
    }

    /// True if the step from `here` to a cycle of the same word goes through the start again.
    bool passes_start(const Place& here, const Cycle& to) {
        const double value = start_.p[parameter_], from = here.parameter(), past = to.p[parameter_];
        if (!((from - value) * (past - value) < 0) || to.size() != start_.size())
            return false;
        const double fraction = (value - from) / (past - from);
        Cycle c = here.shooting.unpack(here.z + fraction * (here.shooting.pack(to) - here.z));
        c.p = start_.p;
        return shoot(system_, c).ok() && detail::same_orbit(system_, c, start_);
    }

    std::vector<Test> failures(const Cycle& c) const {
        std::vector<Test> failed;
        for (const Test& test : tests_of(system_, c))
            if (!(test.value > -1e-13))
                failed.push_back(test);
        return failed;
    }

    /// The point at the bound between `here` and z, with its Jacobian.
    bool stop_at_bound(const Place& here, Cycle& cycle, Vector& z, Matrix& J,
                       Branch& branch) const {
        const double value = here.parameter_of(z), bound = value < low_ ? low_ : high_;
        const double fraction = (bound - here.parameter()) / (value - here.parameter());
        cycle = here.shooting.unpack(here.z + fraction * (z - here.z));
        cycle.p[parameter_] = bound;
        const Convergence converged = shoot(system_, cycle);
        branch.corrections += converged.iterations;
        if (!converged.ok())
            return false;
        z = here.shooting.pack(cycle);
        auto e = here.shooting.evaluate(z);
        J = std::move(e.J);
        return e.status == Status::ok;
    }

    enum class Outcome : unsigned char { retry, switched, ended };

    /// A word ends between `here` and `beyond`: find out where and why, and go on with the next.
    Outcome bifurcate(Place& here, const Cycle& beyond, const std::vector<Test>& failed,
                      Branch& branch, std::string& trouble, bool last_try) {
        std::vector<Test> causes = causes_of(failed, beyond);
        const bool born = causes[0].what != Test::What::duration;
        const auto others = std::erase_if(causes, [born](const Test& test) {
            return born != (test.what != Test::What::duration);
        });
        if (others > 0 && !last_try) { // which one comes first, a smaller step may tell
            trouble = "several bifurcations at once";
            return Outcome::retry;
        }
        const Cycle before = here.shooting.unpack(here.z);
        std::vector<SlidingCondition> conditions = conditions_behind(before, beyond, causes);
        if (conditions.empty()) {
            trouble = "the orbit touches the surface where it is crossed: no orbit of any word "
                      "goes on";
            return Outcome::retry;
        }
        std::vector<SpecialPoint> special;
        const double from = here.parameter(), to = beyond.p[parameter_];
        const double slack = 0.1 * std::abs(to - from) + 1e-9 * (high_ - low_);
        for (SlidingCondition& s : conditions) {
            const Convergence c = solve(s);
            branch.corrections += c.iterations;
            const double value = s.cycle.p[parameter_];
            if (!c.ok() ||
                !(value >= std::min(from, to) - slack && value <= std::max(from, to) + slack)) {
                trouble = "a bifurcation could not be located";
                return Outcome::retry;
            }
            if (system_.interrupted())
                return Outcome::ended;
            special.push_back(describe(s, c));
            special.back().word_before = before.word.string();
        }
        const bool together = keep_first(conditions, special, to - from);
        if ((!together && !born) || !alone(conditions[0])) {
            trouble = "several bifurcations at once";
            return Outcome::retry;
        }
        const auto next = !born                    ? parent(conditions[0])
                          : conditions.size() == 1 ? child(conditions[0])
                                                   : children(conditions);
        if (conditions.size() == 1)
            flip_before(here, conditions[0], special[0], born, branch);
        if (next) {
            const Cycle after = next->shooting.unpack(next->z);
            const Cycle one = detail::shortest(system_, after);
            if (one.period < 0.9 * after.period) { // passed several times, and met at each
                special[0].word_after = one.word.string();
                branch.special.push_back(std::move(special[0]));
                branch.end = "it ends on an orbit of a part of its period";
                return Outcome::ended;
            }
        }
        for (SpecialPoint& s : special) {
            if (next)
                s.word_after = next->shooting.word().string();
            branch.special.push_back(std::move(s));
        }
        if (!next) {
            branch.end = no_orbit;
            return Outcome::ended;
        }
        here = *next;
        here.entered.emplace();
        if (conditions.size() == 1)
            here.entered =
                born ? branch.special.back().multipliers_child : branch.special.back().multipliers;
        return Outcome::switched;
    }

    /// True if nothing else has happened before a bifurcation: the orbit there is one of its word,
    /// and what is born where a slide begins is no second slide.
    bool alone(const SlidingCondition& s) const {
        const Cycle c = parent_of(s);
        for (const Test& test : tests_of(system_, c))
            if (!(test.value > -1e-8))
                return false;
        return s.kind != Kind::crossing_sliding || s.cycle.word[s.node].mode != 0;
    }

    /// The conditions behind failed tests, each for the word without any of the segments that
    /// vanish; none if a word cannot change into another there.
    std::vector<SlidingCondition> conditions_behind(const Cycle& before, const Cycle& beyond,
                                                    const std::vector<Test>& causes) const {
        std::vector<SlidingCondition> all;
        const Cycle at = nearer(before, beyond, causes[0]);
        for (const Test& own : causes) {
            Cycle c = at;
            for (const Test& other : causes)
                if (&other != &own && other.what == Test::What::duration) {
                    const auto gone = condition_of(c, vanishing(c, at.t[other.i]));
                    if (!gone)
                        return {};
                    c = parent_of(*gone);
                }
            const bool dies = own.what == Test::What::duration;
            const auto condition = condition_of(c, dies ? vanishing(c, at.t[own.i]) : own);
            if (!condition)
                return {};
            all.push_back(*condition);
        }
        return all;
    }
    /// The duration of the segment that starts and ends near a time, up to whole cycles.
    static Test vanishing(const Cycle& c, double t) {
        Test test;
        const auto apart = [&](std::size_t i) {
            return std::abs(std::remainder(c.t[i] - t, c.period)) + std::abs(c.duration(i));
        };
        for (std::size_t i = 1; i < c.size(); ++i)
            if (apart(i) < apart(test.i))
                test.i = i;
        return test;
    }
    /// Keeps those that come first in the direction of the branch; true if they are all.
    bool keep_first(std::vector<SlidingCondition>& conditions, std::vector<SpecialPoint>& special,
                    double direction) const {
        const auto along = [&](const SlidingCondition& s) {
            return direction < 0 ? -s.cycle.p[parameter_] : s.cycle.p[parameter_];
        };
        double first = std::numeric_limits<double>::infinity();
        for (const SlidingCondition& s : conditions)
            first = std::min(first, along(s));
        const std::size_t n = conditions.size();
        for (std::size_t i = n; i-- > 0;)
            if (along(conditions[i]) > first + 1e-9 * (high_ - low_)) {
                conditions.erase(conditions.begin() + std::ptrdiff_t(i));
                special.erase(special.begin() + std::ptrdiff_t(i));
            }
        return conditions.size() == n;
    }

    /// The cycle between the last good and the first bad one where a test vanishes, to first order.
    Cycle nearer(const Cycle& before, const Cycle& beyond, const Test& test) const {
        double good = 0;
        for (const Test& other : tests_of(system_, before))
            if (other.what == test.what && other.i == test.i &&
                other.least.side == test.least.side && (good == 0 || other.value < good))
                good = other.value;
        const double fraction = good > 0 ? good / (good - test.value) : 1.0;
        Cycle c = before;
        for (std::size_t i = 0; i < c.size(); ++i) {
            c.t[i] += fraction * (beyond.t[i] - before.t[i]);
            c.x[i] += fraction * (beyond.x[i] - before.x[i]);
        }
        c.period += fraction * (beyond.period - before.period);
        c.p += fraction * (beyond.p - before.p);
        return c;
    }

    /// Newton on the shooting equations and the condition, the parameter free.
    Convergence solve(SlidingCondition& s) const {
        const Shooting shooting(system_, s.cycle, {parameter_, -1});
        Vector z = shooting.pack(s.cycle);
        Matrix J;
        const Convergence c =
            newton(equations_with(shooting, s), scales(shooting, s.cycle), z, J, 1e-13);
        if (c.ok())
            s.cycle = shooting.unpack(z);
        return c;
    }

    /// Names the bifurcation by its conditions (model of the chapter, (4.24)-(4.29), in our signs).
    SpecialPoint describe(SlidingCondition& s, const Convergence& c) const {
        s.kind = detail::named(system_, s);
        SpecialPoint special = detail::special_point(system_, s);
        special.convergence = c;
        if (s.kind == Kind::grazing_sliding)
            special.border_class = border_collision(special.multipliers, special.multipliers_child);
        return special;
    }

    /// The curve of the word with one segment more, in the direction in which that grows.
    std::optional<Place> child(const SlidingCondition& s) {
        if (s.kind == Kind::grazing_sliding) {
            const double far = system_
                                   .quantity({Quantity::Kind::h, -s.side, 1}, s.cycle.t[s.node],
                                             s.cycle.x[s.node], s.cycle.p, {})
                                   .value[0];
            if (!(s.side * far > 0))
                return std::nullopt;
        }
        const Cycle c = child_of(s);
        const Shooting shape(system_, c, {parameter_, -1});
        return place(c, [&](const Vector& dz) { return shape.growth(0, dz); });
    }
    /// The curve of the word with several segments more, born together as in the halves of a
    /// symmetric orbit. At the bifurcation it may cross others, so it is taken up where the
    /// segments are short, but have a length.
    std::optional<Place> children(const std::vector<SlidingCondition>& all) {
        Cycle c = child_of(all[0]);
        for (std::size_t k = 1; k < all.size(); ++k)
            c = child_of(moved_to(c, all[k]));
        const double length = 1e-4 * c.period;
        std::size_t first = c.size();
        for (std::size_t i = c.size(); i-- > 0;)
            if (!(c.duration(i) > 0) && i + 1 < c.size()) {
                // an extremum that was passed is undercut before and after
                c.t[i] -= length / 3;
                c.t[i + 1] += 2 * length / 3;
                first = i;
            }
        if (first == c.size())
            return std::nullopt;
        Shooting shooting(system_, c, {parameter_, -1});
        Vector z = shooting.pack(c), scale = scales(shooting, c);
        const Equations equations = [&](const Vector& u, Vector& F, Matrix& J) {
            const auto e = shooting.evaluate(u);
            if (e.status != Status::ok)
                return false;
            Vector gradient = Vector::Zero(u.size());
            for (Eigen::Index i = 0; i < u.size(); ++i)
                gradient[i] = shooting.growth(first, Vector::Unit(u.size(), i));
            F.resize(u.size());
            J.resize(u.size(), u.size());
            F << e.F, gradient.dot(u) - length;
            J << e.J, gradient.transpose();
            return true;
        };
        Matrix J;
        if (!newton(equations, scale, z, J).ok())
            return std::nullopt;
        const Cycle at = shooting.unpack(z);
        return place(at, [&](const Vector& dz) { return shooting.growth(first, dz); });
    }
    /// The curve of the word with one segment less, in the direction in which it becomes right.
    std::optional<Place> parent(const SlidingCondition& s) {
        auto augmented = place(s.cycle, [&](const Vector& dz) {
            const Shooting shape(system_, s.cycle, {parameter_, -1});
            const auto [value, gradient] = shape.at_node(shape.pack(s.cycle), s.node, s.vanishes());
            int sign = 1;
            if (s.kind == Kind::grazing_sliding || s.kind == Kind::crossing_sliding)
                sign = s.side;
            else if (s.kind == Kind::switching_sliding)
                sign = -s.side;
            return sign * gradient.dot(dz);
        });
        if (!augmented)
            return std::nullopt;
        SlidingCondition moved = s;
        moved.cycle = augmented->shooting.unpack(
            augmented->z + 1e-3 * augmented->curve.scale().cwiseProduct(augmented->t));
        const Cycle at = parent_of(s), later = parent_of(moved);
        const Shooting shape(system_, at, {parameter_, -1});
        const Vector direction = shape.pack(later) - shape.pack(at);
        const Vector scale = scales(shape, at);
        return place(at, [&](const Vector& dz) {
            return direction.cwiseQuotient(scale).dot(dz.cwiseQuotient(scale));
        });
    }

    // --- fold, flip, Neimark-Sacker ------------------------------------------------------------

    double flip_test(const std::vector<std::complex<double>>& m) const {
        return detail::border_test(m, -1, system_.forced());
    }
    /// |mu|^2 - 1 of the complex pair nearest to the unit circle; 1 if there is none.
    static double torus_test(const std::vector<std::complex<double>>& m) {
        double best = 1;
        for (const auto& v : m)
            if (v.imag() > 0 && std::abs(std::norm(v) - 1) < std::abs(best))
                best = std::norm(v) - 1;
        return best;
    }

    /// A smooth bifurcation within a step, and how far along.
    struct Passed {
        double along;
        SpecialPoint special;
    };

    /// Those within the step from `here`, in their order. True if the branch ends at the last: on
    /// an orbit of half its period.
    bool smooth_bifurcations(const Place& here, const Vector& t, double ds, Branch& branch,
                             const BranchPoint& next) {
        std::vector<Passed> passed;
        const auto& before = multipliers_at(here, branch);
        // Where a segment is born the parameter may begin like the square of its length: a slope of
        // nothing but rounding, and no fold.
        if (std::abs(here.slope()) > 1e-9 && here.slope() * t[t.size() - 1] < 0)
            passed.push_back(locate(here, t, ds, Kind::fold, branch, next.multipliers));
        if (!before.empty()) {
            if (flip_test(before) * flip_test(next.multipliers) < 0)
                passed.push_back(locate(here, t, ds, Kind::flip, branch, next.multipliers));
            const bool pairs = before.size() == next.multipliers.size() && torus_test(before) < 1 &&
                               torus_test(next.multipliers) < 1;
            if (pairs && torus_test(before) * torus_test(next.multipliers) < 0)
                passed.push_back(
                    locate(here, t, ds, Kind::neimark_sacker, branch, next.multipliers));
        }
        if (system_.interrupted()) // what was located is not what it seems
            return false;
        std::stable_sort(passed.begin(), passed.end(),
                         [](const Passed& a, const Passed& b) { return a.along < b.along; });
        for (Passed& p : passed) {
            const bool merges = p.special.kind == Kind::fold && halve(p.special);
            branch.special.push_back(std::move(p.special));
            if (merges)
                return true;
        }
        return false;
    }

    /// A flip between `here` and the sliding bifurcation that ends its word.
    void flip_before(const Place& here, const SlidingCondition& s, const SpecialPoint& end,
                     bool born, Branch& branch) {
        const auto& before = multipliers_at(here, branch);
        const auto& after = born ? end.multipliers : end.multipliers_child;
        if (before.empty() || !(flip_test(before) * flip_test(after) < 0))
            return;
        const double length = along_to(here, born ? parent_of(s) : child_of(s));
        if (!(length > 0))
            return;
        Passed flip = locate(here, here.t, length, Kind::flip, branch, after);
        if (!system_.interrupted())
            branch.special.push_back(std::move(flip.special));
    }
    /// How far along the tangent a cycle of the tracer's word lies, wherever it is cut; NaN if it
    /// is of another word.
    double along_to(const Place& here, const Cycle& c) const {
        const Cycle from = here.shooting.unpack(here.z);
        double along = std::numeric_limits<double>::quiet_NaN(),
               least = std::numeric_limits<double>::infinity();
        for (const Cycle& r : detail::aligned(system_, c, from)) {
            const Vector z = here.shooting.pack(r);
            const double distance = (z - here.z).cwiseQuotient(here.curve.scale()).norm();
            if (distance < least) {
                least = distance;
                along = here.along(z);
            }
        }
        return along;
    }
    /// At the point of the branch where the tracer is, as an orbit of its word.
    static const std::vector<std::complex<double>>& multipliers_at(const Place& here,
                                                                   const Branch& branch) {
        // they jump where the word changes
        return here.entered ? *here.entered : branch.points.back().multipliers;
    }

    Passed locate(const Place& here, const Vector& t, double ds, Kind kind, Branch& branch,
                  const std::vector<std::complex<double>>& after) {
        const auto test = [this, kind](const std::vector<std::complex<double>>& m) {
            return kind == Kind::flip ? flip_test(m) : torus_test(m);
        };
        const bool fold = kind == Kind::fold;
        const auto value = [&](const Vector& z, const Matrix& J) {
            if (fold) {
                const Vector tangent = here.curve.tangent(J, here.t);
                return tangent[tangent.size() - 1];
            }
            return test(floquet(system_, here.shooting.unpack(z)));
        };
        const auto& before = multipliers_at(here, branch);
        const Located at =
            zero_along(here.curve, here.z, here.t, ds, value, fold ? here.slope() : test(before),
                       fold ? t[t.size() - 1] : test(after));
        branch.corrections += at.convergence.iterations;
        // where the search came if it did not come to rest, as it does beside a flip of an orbit of
        // half the period: the curve's equations are singular there
        const Vector& z = at.z.size() > 0 ? at.z : here.z;
        Passed passed{here.along(z), {}};
        SpecialPoint& special = passed.special;
        special.kind = kind;
        special.convergence = at.convergence;
        special.cycle = here.shooting.unpack(z);
        name_smooth(special);
        return passed;
    }
    /// All that belongs to a smooth bifurcation but its kind and its cycle.
    void name_smooth(SpecialPoint& special) const {
        special.multipliers = floquet(system_, special.cycle);
        detail::normalize(system_, special.cycle);
        special.conditions.clear();
        if (special.kind == Kind::fold)
            special.conditions = {{"mu - 1", distance_to_one(special.multipliers)}};
        else if (special.kind == Kind::flip)
            special.conditions = {{"det(M + 1)", flip_test(special.multipliers)}};
        else if (special.kind == Kind::neimark_sacker)
            special.conditions = {{"|mu|^2 - 1", torus_test(special.multipliers)}};
        special.word_before = special.word_after = special.cycle.word.string();
    }
    /// A turn of the parameter that is the flip of an orbit of half the period: the branch comes
    /// back on itself, half a period later. Then the flip of that orbit takes its place.
    bool halve(SpecialPoint& special) const {
        Cycle one = detail::shortest(system_, special.cycle, 1e-3);
        if (!(std::abs(one.period - special.cycle.period / 2) < 0.01 * one.period))
            return false;
        // secant on the flip's test function, along the orbits of half the period
        const double from = special.cycle.p[parameter_];
        const auto at = [&](double value) {
            one.p[parameter_] = value;
            const Convergence c = shoot(system_, one);
            return c.ok() ? flip_test(floquet(system_, one))
                          : std::numeric_limits<double>::quiet_NaN();
        };
        double a = from, b = from + 1e-6 * (high_ - low_), fa = at(a), fb = at(b);
        for (int k = 0; k < 20 && std::abs(b - a) > 1e-15 * std::abs(b) && fa != fb; ++k) {
            const double next = b - fb * (b - a) / (fb - fa);
            a = b;
            fa = fb;
            b = next;
            fb = at(b);
        }
        if (!(std::abs(fb) < 1e-9 && std::abs(b - from) < 1e-6 * (high_ - low_)))
            return false;
        const std::string before = special.word_before;
        special.kind = Kind::flip;
        special.cycle = one;
        special.convergence.status = Status::ok;
        name_smooth(special);
        special.word_before = before;
        return true;
    }
    /// Of the multiplier nearest to 1.
    double distance_to_one(const std::vector<std::complex<double>>& m) const {
        double best = std::numeric_limits<double>::infinity();
        for (const auto& v : detail::nontrivial(m, system_.forced()))
            best = std::min(best, std::abs(v - 1.0));
        return best;
    }

    const AnySystem& system_;
    int parameter_;
    double low_, high_;
    BranchSettings settings_;
    Cycle start_;
};

} // namespace filippov
