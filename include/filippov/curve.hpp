// SPDX-License-Identifier: BSD-3-Clause
// Curves of bifurcations in two parameters, and the points of codimension two on them.
#pragma once

#include <filippov/branch.hpp>

#include <Eigen/SVD>

namespace filippov {

/// A rectangle in two parameters.
struct Box {
    std::array<int, 2> parameters{};
    std::array<double, 2> low{}, high{};

    double width(std::size_t k) const { return high[k] - low[k]; }
};

/// A curve of one kind of bifurcation.
struct Curve : Branch {
    Kind kind{};
};

/// Where a curve of bifurcations starts: an orbit that bifurcates, and how.
struct CurveStart {
    Kind kind{};
    SlidingCondition condition; ///< of a sliding bifurcation
    Cycle cycle;                ///< of a fold or a flip
    /// A segment whose duration grows from zero along the curve, -1: both directions are wanted.
    int growing = -1;
    int growing_rate = 0; ///< +-1: the second derivative at the node grows in this direction
};

/// The start of a curve from a bifurcation on a branch.
inline CurveStart curve_start(const SpecialPoint& s) {
    CurveStart start;
    start.kind = s.kind;
    start.cycle = s.cycle;
    if (!is_sliding(s.kind))
        return start;
    start.condition = {s.kind, s.cycle, s.node, s.side};
    return start;
}

/// The three curves that meet at a degenerate switching-sliding point: at node `k` of `c` the orbit
/// enters its slide where the field of the far side, b, is tangent to second order.
inline std::vector<CurveStart> curves_at_degenerate(const Cycle& c, std::size_t k, int b) {
    const Cycle base = detail::rotated(c, k);
    std::vector<CurveStart> all(3);
    // switching: the entry stays on the boundary, and is pushed inwards (b L' < 0)
    all[0].kind = Kind::switching_sliding;
    all[0].condition = {all[0].kind, base, 0, b};
    all[0].growing_rate = -b;
    // crossing: a visit to the far side before the slide, tangent at its start
    all[1].kind = Kind::crossing_sliding;
    Cycle visit = base;
    detail::insert(visit, 0, {b, Until::surface}, base.t[0], base.x[0]);
    all[1].condition = {all[1].kind, visit, 0, b};
    all[1].growing = 0;
    // adding: the slide touches its boundary later than where it starts
    all[2].kind = Kind::adding_sliding;
    Cycle touch = base;
    detail::insert(touch, 0, {0, detail::extremum(b)}, base.t[0], base.x[0]);
    all[2].condition = {all[2].kind, touch, 1, b};
    all[2].growing = 0;
    return all;
}

/// Follows a bifurcation in two parameters.
class CurveTracer {
public:
    CurveTracer(const AnySystem& system, const Box& box, const BranchSettings& settings = {})
        : system_(system), box_(box), settings_(settings) {
        for (std::size_t k = 0; k < 2; ++k) {
            detail::require_parameter(system, "box.parameters", box.parameters[k]);
            detail::require_range("box.low", box.low[k], box.high[k]);
        }
        if (box.parameters[0] == box.parameters[1])
            detail::refuse("box.parameters", box.parameters[1], "expected two different ones");
        detail::validate(settings);
    }

    /// Where a curve met a degenerate switching-sliding point: the other curves start from there.
    struct Degenerate {
        Cycle cycle; ///< with the plain word
        std::size_t node = 0;
        int side = 0;
    };
    const std::vector<Degenerate>& degenerate() const { return degenerate_; }

    /// @error std::invalid_argument unless there is one surface, a switching one without static
    /// friction
    Curve trace(const CurveStart& start) {
        detail::require_continuable(
            system_, (is_sliding(start.kind) ? start.condition.cycle : start.cycle).p);
        Branch forward, backward;
        run(start, +1, forward);
        if (forward.end == detail::closed)
            backward.end = detail::closed;
        else if (start.growing < 0 && start.growing_rate == 0)
            run(start, -1, backward);
        else
            backward.end = "a point of codimension two";
        return {detail::joined(backward, forward), start.kind};
    }

private:
    /// A point of a curve: its equations, unknowns (nodes, a, b, and v for folds and flips), and
    /// tangent.
    struct Place {
        Kind kind{};
        SlidingCondition condition; ///< its cycle is the start
        std::shared_ptr<Shooting> shooting;
        std::optional<Arclength> curve;
        Vector z, t;
        std::vector<Test>
            twins; ///< what vanishes at the start as well, in a symmetric orbit's half

        Cycle cycle(const Vector& u) const { return shooting->unpack(u.head(shooting->columns())); }
        double parameter(const Vector& u, std::size_t k) const {
            return u[shooting->rows() + Eigen::Index(k)];
        }
    };

    Vector scales(const Shooting& shooting, const Cycle& c) const {
        Vector scale = shooting.scales(c);
        for (std::size_t k = 0; k < 2; ++k)
            scale[shooting.rows() + Eigen::Index(k)] = box_.width(k);
        return scale;
    }

    std::optional<Place> place(const CurveStart& start, int direction) {
        return is_sliding(start.kind) ? sliding_place(start, direction)
                                      : smooth_place(start, direction);
    }

    std::optional<Place> sliding_place(const CurveStart& start, int direction) {
        const SlidingCondition s = start.condition;
        Place p;
        p.kind = start.kind;
        p.condition = s;
        const int tangent = s.kind == Kind::crossing_sliding ? int(s.node) : -1;
        p.shooting = std::make_shared<Shooting>(system_, s.cycle, box_.parameters, tangent);
        p.z = p.shooting->pack(s.cycle);
        p.curve.emplace(equations_with(*p.shooting, s), scales(*p.shooting, s.cycle));
        if (!p.curve->tangent_at(p.z, Vector::Unit(p.z.size(), p.shooting->rows()), p.t))
            return std::nullopt;
        p.t *= orientation(start, p) * direction;
        for (const Test& test : other_tests(p, p.z))
            if (std::abs(test.value) < 1e-9 && test.what != Test::What::duration)
                p.twins.push_back(test);
        return p;
    }
    /// +1 if the tangent leads away from a point of codimension two, into the curve's own side.
    double orientation(const CurveStart& start, const Place& p) const {
        const Vector dz = p.curve->scale().cwiseProduct(p.t);
        double grows = 1;
        if (start.growing >= 0) {
            grows = p.shooting->growth(std::size_t(start.growing), dz);
        } else if (start.growing_rate != 0) {
            const Quantity rate{Quantity::Kind::h, p.condition.side, 2};
            grows = start.growing_rate *
                    p.shooting->at_node(p.z, p.condition.node, rate).second.dot(dz);
        }
        return grows < 0 ? -1 : 1;
    }

    /// Folds and flips: F = 0, K v = 0 and v of length one, K for variations that return with
    /// the factor 1 or -1.
    std::optional<Place> smooth_place(const CurveStart& start, int direction) {
        Place p;
        p.kind = start.kind;
        p.shooting = std::make_shared<Shooting>(system_, start.cycle, box_.parameters);
        const int n = p.shooting->rows(), m = p.shooting->columns();
        const double turned = start.kind == Kind::flip ? -1 : 1;
        const Vector scale = scales(*p.shooting, start.cycle);
        Vector z(m + n);
        z.head(m) = p.shooting->pack(start.cycle);
        const Vector none = Vector::Zero(m);
        const auto at = p.shooting->evaluate(z.head(m), &none, turned);
        if (at.status != Status::ok)
            return std::nullopt;
        const Matrix K = at.K.leftCols(n) * scale.head(n).asDiagonal();
        const Vector v = Eigen::JacobiSVD<Matrix>(K, Eigen::ComputeFullV).matrixV().col(n - 1);
        z.tail(n) = scale.head(n).cwiseProduct(v);
        const Vector normal = v.cwiseQuotient(scale.head(n));
        const Equations equations = [shooting = p.shooting, normal, turned, n,
                                     m](const Vector& u, Vector& F, Matrix& J) {
            Vector direction_ = Vector::Zero(m);
            direction_.head(n) = u.tail(n);
            const auto e = shooting->evaluate(u.head(m), &direction_, turned);
            if (e.status != Status::ok)
                return false;
            F.resize(2 * n + 1);
            F << e.F, e.K.leftCols(n) * u.tail(n), normal.dot(u.tail(n)) - 1;
            J = Matrix::Zero(2 * n + 1, m + n);
            J.topLeftCorner(n, m) = e.J;
            J.block(n, 0, n, m) = e.B;
            J.block(n, m, n, n) = e.K.leftCols(n);
            J.block(2 * n, m, 1, n) = normal.transpose();
            return true;
        };
        Vector all(m + n);
        all << scale, scale.head(n);
        p.curve.emplace(equations, all);
        p.z = z;
        if (!p.curve->tangent_at(p.z, Vector::Unit(m + n, n), p.t))
            return std::nullopt;
        p.t *= direction;
        return p;
    }

    BranchPoint point_of(const Place& p, const Vector& z) const {
        BranchPoint point{p.cycle(z), multipliers_of(p, z)};
        detail::normalize(system_, point.cycle);
        return point;
    }
    /// Of the orbit without the node at which it bifurcates, where no return map has a slope.
    std::vector<std::complex<double>> multipliers_of(const Place& p, const Vector& z) const {
        if (!is_sliding(p.kind))
            return floquet(system_, p.cycle(z));
        SlidingCondition s = p.condition;
        s.cycle = p.cycle(z);
        return floquet(system_, parent_of(s));
    }

    void run(const CurveStart& start, int direction, Branch& curve) {
        auto here = place(start, direction);
        if (detail::stopped(system_, curve))
            return;
        if (!here) {
            curve.status = Status::not_finite;
            curve.end = "the start cannot be evaluated";
            return;
        }
        Matrix J;
        const Convergence first = here->curve->step(here->z, J, here->t, 0);
        curve.corrections += first.iterations;
        if (first.ok())
            here->t = here->curve->tangent(J, here->t);
        curve.points.push_back(point_of(*here, here->z));
        start_ = here->cycle(here->z);
        detail::walk(system_, settings_, curve,
                     [&](double& ds) { return advance(*here, ds, curve); });
    }

    bool advance(Place& here, double& ds, Branch& curve) {
        std::string trouble = "Newton's iteration does not converge";
        for (; ds >= settings_.min_step; ds /= 2) {
            Vector z = here.z;
            Matrix J;
            const Convergence c = here.curve->step(z, J, here.t, ds);
            curve.corrections += c.iterations;
            if (system_.interrupted())
                return false;
            if (!c.ok())
                continue;
            const Vector t = here.curve->tangent(J, here.t);
            if (!(t.dot(here.t) > 0.9))
                continue;
            // A step that leaves the bounds becomes one to the bound.
            double length = ds;
            bool last = false, lost = false;
            for (std::size_t k = 0; k < 2; ++k) {
                const double value = here.parameter(z, k);
                if (value >= box_.low[k] && value <= box_.high[k])
                    continue;
                const Located at = at_bound(here, z, k, length);
                curve.corrections += at.convergence.iterations;
                lost = lost || !at.ok();
                if (!at.ok())
                    break;
                z = at.z;
                length = here.t.dot((z - here.z).cwiseQuotient(here.curve->scale()));
                last = true;
            }
            if (lost)
                continue;
            const double before = second_order_test(here, here.z),
                         after = second_order_test(here, z);
            if (curve.points.size() > 1 && before * after < 0)
                if (second_order_point(here, length, before, after, curve))
                    return false;
            const std::vector<Test> failed = failures(here, z);
            if (!failed.empty()) {
                const auto outcome = change_word(here, z, length, failed, curve, trouble);
                if (outcome == Outcome::retry)
                    continue;
                ds = std::min(ds, settings_.first_step);
                return outcome == Outcome::switched;
            }
            BranchPoint next = point_of(here, z);
            if (!(std::abs(next.multipliers[0]) < detail::largest_multiplier)) {
                trouble = detail::too_unstable;
                break;
            }
            if (is_sliding(here.kind))
                for (const Kind kind : {Kind::fold, Kind::flip})
                    smooth_point(here, length, kind, next.multipliers, curve);
            if (passes_start(here, z, length)) {
                curve.points.push_back(curve.points.front());
                curve.end = detail::closed;
                return false;
            }
            curve.points.push_back(std::move(next));
            if (last) {
                curve.end = "bound of the parameters";
                return false;
            }
            here.z = z;
            here.t = t;
            if (!is_sliding(here.kind) && !renew(here))
                break;
            if (c.iterations <= 3)
                ds = std::min(1.5 * ds, settings_.max_step);
            return true;
        }
        if (ends_at_short_segment(here, curve))
            return false;
        curve.status = Status::not_converged;
        curve.end = trouble;
        return false;
    }

    /// True if the step from `here` to z goes through the start again.
    bool passes_start(const Place& here, const Vector& z, double length) const {
        const Vector way = here.t.cwiseProduct(here.curve->scale());
        const auto first = here.shooting->rows();
        const std::size_t k = std::abs(here.t[first]) > std::abs(here.t[first + 1]) ? 0 : 1;
        const auto from = [&](const Vector& u, const Matrix&) {
            return here.parameter(u, k) - start_.p[box_.parameters[k]];
        };
        const Matrix none;
        const double f0 = from(here.z, none), f1 = from(z, none);
        if (!(f0 * f1 < 0))
            return false;
        // only where a straight step comes near in the other parameter, too
        const std::size_t other = 1 - k;
        const double apart = here.parameter(here.z, other) +
                             f0 / (f0 - f1) * length * way[first + Eigen::Index(other)] -
                             start_.p[box_.parameters[other]];
        if (!(std::abs(apart) <= length * box_.width(other)))
            return false;
        const Located at = zero_along(*here.curve, here.z, here.t, length, from, f0, f1);
        return at.ok() && detail::same_orbit(system_, here.cycle(at.z), start_);
    }

    /// Normalizes the null vector anew where it has turned so far from the one at the start that
    /// its length, measured along that one, dominates the steps.
    bool renew(Place& here) {
        const auto m = here.shooting->columns(), n = here.shooting->rows();
        const Vector scaled = here.z.tail(n).cwiseQuotient(here.curve->scale().tail(n));
        if (scaled.norm() < 1.5)
            return true;
        CurveStart start;
        start.kind = here.kind;
        start.cycle = here.cycle(here.z);
        auto anew = smooth_place(start, +1);
        if (!anew)
            return false;
        if (anew->t.head(m).dot(here.t.head(m)) < 0)
            anew->t = -anew->t;
        here = *anew;
        return true;
    }
    /// Where the curve leaves the range of parameter k, before a point z at a distance `length`.
    Located at_bound(const Place& here, const Vector& z, std::size_t k, double length) const {
        const double bound = here.parameter(z, k) < box_.low[k] ? box_.low[k] : box_.high[k];
        const auto excess = [&](const Vector& u, const Matrix&) {
            return here.parameter(u, k) - bound;
        };
        const Matrix none;
        return zero_along(*here.curve, here.z, here.t, length, excess, excess(here.z, none),
                          excess(z, none));
    }

    // --- points of codimension two -------------------------------------------------------------

    /// What distinguishes a bifurcation from a degenerate one: the next derivative at the node; for
    /// a fold the second derivative along its null vector, w^T (F_uu v v).
    double second_order_test(const Place& here, const Vector& z) const {
        if (is_sliding(here.kind)) {
            const int order = here.kind == Kind::adding_sliding ? 3 : 2;
            const Quantity q{Quantity::Kind::h, here.condition.side, order};
            return here.shooting->at_node(z.head(here.shooting->columns()), here.condition.node, q)
                .first;
        }
        if (here.kind != Kind::fold)
            return 1;
        const int n = here.shooting->rows(), m = here.shooting->columns();
        Vector v = Vector::Zero(m);
        v.head(n) = z.tail(n);
        const auto e = here.shooting->evaluate(z.head(m), &v);
        const Vector bent = e.B * v;
        // Bordered, so that w keeps its sign along the curve: w and v appear in one determinant.
        Matrix bordered(n + 1, n + 1);
        const Vector scale = here.curve->scale().head(n);
        const Matrix K = e.K.leftCols(n) * scale.asDiagonal();
        bordered << K, bent, v.head(n).cwiseQuotient(scale).transpose(), 0.0;
        return bordered.partialPivLu().determinant();
    }
    /// A point located on the curve.
    SpecialPoint special_at(const Place& here, const Located& at, Kind kind) const {
        SpecialPoint special;
        special.kind = kind;
        special.cycle = here.cycle(at.z);
        special.word_before = special.word_after = special.cycle.word.string();
        special.convergence = at.convergence;
        if (is_sliding(here.kind)) {
            special.node = here.condition.node;
            special.side = here.condition.side;
            special.conditions =
                detail::conditions_at(system_, special.cycle, special.node, special.side);
        }
        return special;
    }
    /// True at a cusp: the parameters stand still while the orbit moves on. (The determinant of the
    /// test also changes its sign where a second multiplier reaches 1.)
    static bool parameters_pause(const Place& here, const Located& at) {
        const auto first = here.shooting->rows();
        const Vector t = here.curve->tangent(at.J, here.t);
        return t.segment(first, 2).norm() < 1e-3 * here.t.segment(first, 2).norm();
    }
    /// True if the curve ends there.
    bool second_order_point(const Place& here, double ds, double before, double after,
                            Branch& curve) {
        const Located at = zero_along(
            *here.curve, here.z, here.t, ds,
            [&](const Vector& z, const Matrix&) { return second_order_test(here, z); }, before,
            after);
        curve.corrections += at.convergence.iterations;
        if (!at.ok())
            return false;
        if (here.kind == Kind::fold) {
            if (!parameters_pause(here, at))
                return false;
            SpecialPoint cusp = special_at(here, at, Kind::cusp);
            cusp.conditions = {{"w.F_uu v v", second_order_test(here, at.z)}};
            cusp.multipliers = floquet(system_, cusp.cycle);
            detail::normalize(system_, cusp.cycle);
            curve.special.push_back(cusp);
            return false;
        }
        if (here.kind == Kind::switching_sliding || here.kind == Kind::crossing_sliding) {
            // the visit of a crossing has no length
            end_at_degenerate(here, at, here.condition.node, here.kind == Kind::crossing_sliding,
                              curve);
            return true;
        }
        curve.special.push_back(special_at(here, at, here.kind));
        curve.points.push_back(point_of(here, at.z));
        curve.end = "degenerate";
        return true;
    }
    /// @param first    where the cycle with the plain word starts
    /// @param vanishes the segment there has no length and is none of that word's
    void end_at_degenerate(const Place& here, const Located& at, std::size_t first, bool vanishes,
                           Branch& curve) {
        const SpecialPoint special = special_at(here, at, Kind::degenerate_switching_sliding);
        Cycle plain = detail::rotated(special.cycle, first);
        if (vanishes)
            detail::erase_first(plain);
        degenerate_.push_back({plain, 0, special.side});
        curve.special.push_back(special);
        curve.points.push_back(point_of(here, at.z));
        curve.end = "degenerate switching-sliding";
    }

    /// A fold or a flip of an orbit that has a sliding bifurcation: a multiplier passes 1 or -1.
    void smooth_point(const Place& here, double ds, Kind kind,
                      const std::vector<std::complex<double>>& after, Branch& curve) {
        const double border = kind == Kind::fold ? 1 : -1;
        const auto test = [&](const std::vector<std::complex<double>>& multipliers) {
            return detail::border_test(multipliers, border, system_.forced());
        };
        const double f0 = test(curve.points.back().multipliers), f1 = test(after);
        if (!(f0 * f1 < 0))
            return;
        const Located at = zero_along(
            *here.curve, here.z, here.t, ds,
            [&](const Vector& z, const Matrix&) { return test(multipliers_of(here, z)); }, f0, f1);
        if (!at.ok())
            return;
        SpecialPoint special = special_at(here, at, kind);
        special.multipliers = multipliers_of(here, at.z);
        special.conditions.emplace_back(kind == Kind::fold ? "det(M - 1)" : "det(M + 1)",
                                        test(special.multipliers));
        curve.special.push_back(special);
    }

    /// The tests of a cycle but for the place's own.
    std::vector<Test> other_tests(const Place& here, const Vector& z) const {
        std::vector<Test> others;
        for (const Test& test : tests_of(system_, here.cycle(z))) {
            const bool own = is_sliding(here.kind) && test.what == Test::What::far_side &&
                             test.i == here.condition.node;
            if (!own)
                others.push_back(test);
        }
        return others;
    }
    std::vector<Test> failures(const Place& here, const Vector& z, double slack = 1e-11) const {
        std::vector<Test> failed;
        for (const Test& test : other_tests(here, z)) {
            const bool twin = std::any_of(here.twins.begin(), here.twins.end(), [&](const Test& t) {
                return t.what == test.what && t.i == test.i && t.least.side == test.least.side;
            });
            if (!(test.value > (twin ? -1e-8 : -slack)))
                failed.push_back(test);
        }
        return failed;
    }

    enum class Outcome : unsigned char { retry, switched, ended };

    /// Another bifurcation happens to the same orbit: a point of codimension two. Where the orbit
    /// and its derivative go on through it, so does the curve, with the next word.
    Outcome change_word(Place& here, const Vector& beyond, double ds,
                        const std::vector<Test>& failed, Branch& curve, std::string& trouble) {
        trouble = "several bifurcations of the same orbit at once";
        const std::vector<Test> causes = causes_of(failed, here.cycle(beyond));
        if (causes.size() > 1)
            return Outcome::retry;
        const Test& cause = causes[0];
        const Located at = locate(here, beyond, ds, cause);
        curve.corrections += at.convergence.iterations;
        if (!at.ok())
            return Outcome::retry;
        for (const Test& test : failures(here, at.z, 1e-8))
            if (test.what != cause.what || test.i != cause.i)
                return Outcome::retry; // something else has happened before
        if (touch_meets_entry(here, cause)) {
            end_at_degenerate(here, at, cause.i, true, curve);
            return Outcome::ended;
        }
        const Cycle there = here.cycle(at.z);
        Test exact = cause;
        if (cause.what == Test::What::nearest)
            exact.least = detail::polished(system_, there, cause.i, cause.least);
        auto second = condition_of(there, exact);
        if (!second) {
            trouble = "the orbit touches the surface where it is crossed: no orbit of any word "
                      "goes on";
            return Outcome::retry;
        }
        second->kind = detail::named(system_, *second);
        const bool dies = cause.what == Test::What::duration;
        BranchPoint last = point_of(here, at.z);
        if (!is_sliding(here.kind) && dies && !meet(here.kind, *second, last, curve)) {
            trouble = "the point where it meets a curve of sliding bifurcations was not located";
            return Outcome::retry;
        }
        curve.points.push_back(std::move(last));
        SpecialPoint special = second_bifurcation(here, *second, at.convergence);
        const auto next = continued(here, at, *second, !dies);
        if (next)
            special.word_after = next->shooting->word().string();
        curve.special.push_back(special);
        if (!next) {
            curve.end = same_orbit_has(second->kind);
            return Outcome::ended;
        }
        here = *next;
        return Outcome::switched;
    }

    static std::string same_orbit_has(Kind kind) {
        return "the same orbit has a bifurcation of the kind " + std::string(name(kind));
    }
    /// The sliding bifurcation of an orbit that bifurcates otherwise, too.
    SpecialPoint second_bifurcation(const Place& here, const SlidingCondition& s,
                                    const Convergence& convergence) const {
        SpecialPoint special = detail::special_point(system_, s, convergence);
        special.word_before = special.word_after = here.shooting->word().string();
        return special;
    }
    /// Moves a sliding bifurcation along its curve to where the orbit with more segments has the
    /// fold or flip, too: where a segment has no length the equations of those are singular.
    /// @param last  becomes the end of their curve
    bool meet(Kind kind, SlidingCondition& s, BranchPoint& last, Branch& curve) const {
        const Shooting shooting(system_, s.cycle, box_.parameters,
                                s.kind == Kind::crossing_sliding ? int(s.node) : -1);
        const Arclength along(equations_with(shooting, s), scales(shooting, s.cycle));
        Vector z = shooting.pack(s.cycle), t;
        Matrix J;
        if (!along.tangent_at(z, Vector::Unit(z.size(), shooting.rows()), t) ||
            !along.step(z, J, t, 0).ok())
            return false;
        t = along.tangent(J, t);
        SlidingCondition moved = s;
        const auto test = [&](const Vector& u, const Matrix&) {
            moved.cycle = shooting.unpack(u);
            return detail::border_test(floquet_of_child(system_, moved),
                                       kind == Kind::fold ? 1 : -1, system_.forced());
        };
        const double f0 = test(z, J);
        for (double reach = 1e-6; reach < 0.1; reach *= 4)
            for (const double ds : {reach, -reach}) {
                Vector u = z;
                const Convergence c = along.step(u, J, t, ds);
                curve.corrections += c.iterations;
                const double f1 = c.ok() ? test(u, J) : f0;
                if (!(f0 * f1 <= 0))
                    continue;
                const Located at = zero_along(along, z, t, ds, test, f0, f1);
                if (!at.ok())
                    return false;
                s.cycle = shooting.unpack(at.z);
                last = {child_of(s), floquet_of_child(system_, s)};
                detail::normalize(system_, last.cycle);
                return true;
            }
        return false;
    }
    /// True if a fold or flip that cannot be followed further is about to lose a segment: then its
    /// curve ends there.
    bool ends_at_short_segment(const Place& here, Branch& curve) const {
        const Cycle c = here.cycle(here.z);
        Test test;
        for (std::size_t i = 1; i < c.size(); ++i)
            if (c.duration(i) < c.duration(test.i))
                test.i = i;
        if (is_sliding(here.kind) || !(c.duration(test.i) < 1e-2 * c.period))
            return false;
        auto s = condition_of(c, test);
        if (!s)
            return false;
        s->kind = detail::named(system_, *s);
        BranchPoint last;
        if (!meet(here.kind, *s, last, curve))
            return false;
        for (std::size_t k = 0; k < 2; ++k)
            if (!(std::abs(last.cycle.p[box_.parameters[k]] - here.parameter(here.z, k)) <
                  1e-3 * box_.width(k)))
                return false;
        Convergence located; // by meet
        located.status = Status::ok;
        curve.special.push_back(second_bifurcation(here, *s, located));
        curve.special.back().word_after = parent_of(*s).word.string();
        curve.points.push_back(std::move(last));
        curve.end = same_orbit_has(s->kind);
        return true;
    }
    /// The same test of a neighbouring cycle; NaN if it has none.
    double value_of(const Cycle& c, const Test& like) const {
        if (like.what == Test::What::nearest)
            return detail::polished(system_, c, like.i, like.least).value;
        for (const Test& test : tests_of(system_, c))
            if (test.what == like.what && test.i == like.i)
                return test.value;
        return std::numeric_limits<double>::quiet_NaN();
    }
    Located locate(const Place& here, const Vector& beyond, double ds, const Test& test) const {
        const auto value = [&](const Vector& z, const Matrix&) {
            return value_of(here.cycle(z), test);
        };
        const Matrix none;
        const double f0 = value(here.z, none), f1 = value(beyond, none);
        if (!(f0 * f1 < 0))
            return {};
        return zero_along(*here.curve, here.z, here.t, ds, value, f0, f1);
    }

    /// The slide's touch runs into its entry: the degenerate switching-sliding point.
    bool touch_meets_entry(const Place& here, const Test& test) const {
        const Word& word = here.shooting->word();
        const std::size_t n = word.size(), before = (here.condition.node + n - 1) % n;
        return here.kind == Kind::adding_sliding && test.what == Test::What::duration &&
               test.i == before && word[before + n - 1].mode == -here.condition.side;
    }
    /// The curve with the next word, in the direction in which the parameters went.
    std::optional<Place> continued(const Place& here, const Located& at,
                                   const SlidingCondition& second, bool born) {
        if (second.kind == Kind::grazing_sliding || here.kind == Kind::grazing_sliding)
            return std::nullopt; // multipliers jump, and with them the curve
        if (!is_sliding(here.kind) && born)
            return std::nullopt; // a segment without length: the equations are singular
        const Cycle next = born ? child_of(second) : parent_of(second);
        CurveStart start;
        start.kind = here.kind;
        start.cycle = next;
        if (is_sliding(here.kind)) {
            start.condition = here.condition;
            start.condition.cycle = next;
            start.condition.node = node_at(next, here.cycle(at.z).t[here.condition.node]);
        }
        auto place_ = place(start, +1);
        if (!place_)
            return std::nullopt;
        double along = 0;
        for (std::size_t k = 0; k < 2; ++k)
            along += here.t[here.shooting->rows() + Eigen::Index(k)] *
                     place_->t[place_->shooting->rows() + Eigen::Index(k)];
        if (along < 0)
            place_->t = -place_->t;
        return place_;
    }
    /// The node at a time, up to whole periods.
    static std::size_t node_at(const Cycle& c, double t) {
        const auto apart = [&](std::size_t i) {
            return std::abs(std::remainder(c.t[i] - t, c.period));
        };
        std::size_t best = 0;
        for (std::size_t i = 1; i < c.size(); ++i)
            if (apart(i) < apart(best))
                best = i;
        return best;
    }

    const AnySystem& system_;
    Box box_;
    BranchSettings settings_;
    Cycle start_; ///< of the curve being followed
    std::vector<Degenerate> degenerate_;
};

namespace detail {

inline bool same_place(const Box& box, const Vector& p, const Vector& q) {
    for (std::size_t k = 0; k < 2; ++k) {
        const Eigen::Index i = box.parameters[k];
        if (!(std::abs(p[i] - q[i]) <= 1e-6 * box.width(k)))
            return false;
    }
    return true;
}

} // namespace detail

/// A curve, the curves that start at its degenerate switching-sliding points, those that start at
/// theirs, and so on: up to `most` of them.
inline std::vector<Curve> trace_connected(const AnySystem& system, const Box& box,
                                          const CurveStart& start,
                                          const BranchSettings& settings = {},
                                          std::size_t most = 16) {
    CurveTracer tracer(system, box, settings);
    std::vector<Curve> all{tracer.trace(start)};
    std::vector<Vector> left; // points whose curves have been followed
    for (std::size_t i = 0; i < tracer.degenerate().size(); ++i) {
        const auto point = tracer.degenerate()[i]; // tracing finds more of them
        const auto here = [&](const Vector& p) {
            return detail::same_place(box, p, point.cycle.p);
        };
        if (std::ranges::any_of(left, here))
            continue;
        left.push_back(point.cycle.p);
        const auto arrives = [&](const Curve& curve, Kind kind) {
            return curve.kind == kind &&
                   std::ranges::any_of(curve.special, [&](const SpecialPoint& s) {
                       return s.kind == Kind::degenerate_switching_sliding && here(s.cycle.p);
                   });
        };
        for (const CurveStart& next : curves_at_degenerate(point.cycle, point.node, point.side))
            if (all.size() < most && std::ranges::none_of(all, [&](const Curve& curve) {
                    return arrives(curve, next.kind);
                }))
                all.push_back(tracer.trace(next));
    }
    return all;
}

} // namespace filippov
