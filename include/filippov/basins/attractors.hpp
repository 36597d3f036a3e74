// SPDX-License-Identifier: BSD-3-Clause
// What trajectories of a forced system end on, found without prior knowledge: cycles of the strobe
// map, refined by Newton's method and fenced in, other attractors as clouds of points, and saddles.
#pragma once

#include <filippov/basins/labels.hpp>
#include <filippov/core/statistics.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <optional>
#include <random>
#include <span>
#include <vector>

namespace filippov {

/// What the strobe map leads to, or keeps apart.
struct LimitSets {
    std::vector<Attractor> attractors; ///< by period, then by their first point
    std::vector<StrobeCycle> saddles;  ///< unstable cycles that were found
    Status state = Status::ok;         ///< `interrupted`: not all that would have been found
};

namespace detail {

/// S with |A v|_S <= r |v|_S for |v|_S^2 = v' S v: it solves S = 1 + A' S A / r^2.
/// @pre r is larger than the spectral radius of A
inline Matrix contracting_norm(const Matrix& A, double r) {
    const Matrix one = Matrix::Identity(A.rows(), A.cols());
    Matrix S = one;
    for (int k = 0; k < 100'000; ++k) {
        const Matrix next = one + A.transpose() * S * A / (r * r);
        const double change = (next - S).norm() / next.norm();
        S = next;
        if (!(change > 1e-15))
            break;
    }
    return S;
}

/// Runs from random cells, from groups of the plain cell map and from given points settle; Newton's
/// method makes cycles of their ends, and finds saddles; each stable cycle is fenced in.
class AttractorFinder {
public:
    /// @param state  nothing is looked for unless it is `ok`
    AttractorFinder(const StrobePicture& picture, Status state)
        : picture_(picture), newton_(picture.system, picture.p, picture.first_flash(), picture.unit,
                                     picture.constant) {
        sets_.state = state;
    }

    /// @param also  points that lie near attractors, when the strobe flashes
    LimitSets find(const CellMap& plain, const std::vector<Vector>& also) {
        const std::vector<CellGroup> groups = largest_groups(plain);
        const States random = seeds();
        const auto few = random.begin() + std::min<std::ptrdiff_t>(16, std::ssize(random));
        States points(random.begin(), few);
        for (const CellGroup& g : groups)
            points.push_back(centre(g.cells.front()));
        for (const Vector& x : also)
            if (x.allFinite())
                points.push_back(x);
        settle(points);
        complete(groups);
        // most of the others land soon on what is known; it is enough to settle the rest
        const std::size_t known = sets_.attractors.size();
        settle(not_landing({few, random.end()}));
        if (sets_.attractors.size() > known)
            complete(groups);
        return std::move(sets_);
    }

private:
    using States = std::vector<Vector>;

    bool stopped() { return picture_.stopped(sets_.state); }
    Vector centre(std::int32_t cell) const { return picture_.state(picture_.grid.centre(cell)); }
    void settle(const States& points) {
        Followed ends(picture_, points, PointsAre::starts, settings_.settle, settings_.longest + 1);
        picture_.run(points.size(), ends, settings_.run, sets_.state);
        for (std::size_t k = 0; k < points.size() && !stopped(); ++k)
            if (ends.status[k] == Status::ok)
                add_end(ends.states[k]);
    }
    States not_landing(const States& points) {
        const Landings landings(sets_.attractors, picture_.unit, 0, false);
        const auto labels = label_points(picture_, points, landings, settings_.settle, sets_.state);
        States left;
        for (std::size_t k = 0; k < points.size(); ++k)
            if (labels[k].label == 0)
                left.push_back(points[k]);
        return left;
    }
    /// Saddles, the order, and the fences, which depend on what else there is.
    void complete(const std::vector<CellGroup>& groups) {
        find_saddles(groups);
        sort();
        for (Attractor& a : sets_.attractors)
            fence_in(a);
    }
    States seeds() const {
        std::mt19937_64 random(settings_.seed);
        States points;
        for (int k = 0; k < settings_.seeds; ++k)
            points.push_back(centre(std::int32_t(random() % std::uint64_t(picture_.grid.cells()))));
        return points;
    }
    /// A plain map can have very many groups: those that say most.
    std::vector<CellGroup> largest_groups(const CellMap& plain) const {
        std::vector<CellGroup> groups = plain.groups;
        std::stable_sort(groups.begin(), groups.end(),
                         [](const auto& a, const auto& b) { return a.basin > b.basin; });
        if (groups.size() > std::size_t(settings_.seeds))
            groups.resize(std::size_t(settings_.seeds));
        return groups;
    }
    bool on_cycle(const StrobeCycle& c, const Vector& x, double distance) const {
        return std::any_of(c.points.begin(), c.points.end(),
                           [&](const Vector& y) { return picture_.apart(x, y) <= distance; });
    }
    bool known_cycle(const Vector& x) const {
        return std::any_of(sets_.attractors.begin(), sets_.attractors.end(),
                           [&](const Attractor& a) { return on_cycle(a.cycle, x, 1e-7); });
    }
    /// The end of a run lies on what is known: all of it as near to a cycle as errors of a run
    /// leave it, or most of it in the boxes of what is no cycle.
    bool known(const States& states) const {
        const auto stays_at = [&](const Attractor& a) {
            return std::all_of(states.begin(), states.end(),
                               [&](const Vector& x) { return on_cycle(a.cycle, x, 1e-5); });
        };
        const auto mostly_in = [&](const VisitedBoxes& boxes) {
            const auto inside = std::count_if(states.begin(), states.end(), [&](const Vector& x) {
                return boxes.holds(view(x));
            });
            return 2 * std::size_t(inside) > states.size();
        };
        return std::any_of(sets_.attractors.begin(), sets_.attractors.end(), stays_at) ||
               std::any_of(clouds_.begin(), clouds_.end(), mostly_in);
    }
    /// The stable cycle that the end of a run has come to.
    std::optional<StrobeCycle> settled_on(const States& states) const {
        for (std::size_t q = 1; q < states.size(); ++q) {
            const double gap = picture_.apart(states.back(), states[states.size() - 1 - q]);
            if (!(gap < 1e-2))
                continue;
            const auto cycle = newton_(states.back(), int(q));
            if (!cycle || !cycle->stable())
                continue;
            // of gaps that shrink by the multiplier, all that are to come
            const double to_come = gap / (1 - cycle->growth);
            if (on_cycle(*cycle, states.back(), std::min(4 * to_come + 1e-9, 0.05)))
                return cycle;
        }
        return std::nullopt;
    }
    /// What a run has come to, if it is new: a cycle, or after a much longer run what is none.
    void add_end(const States& states) {
        constexpr int longer = 4000;
        constexpr std::size_t most_clouds = 8;
        if (known(states) || add_cycle(states) || clouds_.size() >= most_clouds)
            return;
        const States from{states.back()};
        Followed on(picture_, from, PointsAre::flashed, 1, longer + int(states.size()));
        picture_.run(1, on, settings_.run, sets_.state);
        if (sets_.state != Status::ok || on.status.front() != Status::ok)
            return;
        States& cloud = on.states.front();
        const States last(cloud.end() - std::ptrdiff_t(states.size()), cloud.end());
        if (known(last) || add_cycle(last))
            return;
        clouds_.emplace_back(cloud, picture_.unit);
        sets_.attractors.push_back({.periodic = false, .cloud = std::move(cloud)});
    }
    bool add_cycle(const States& states) {
        const auto cycle = settled_on(states);
        if (cycle && !known_cycle(cycle->points.front()))
            sets_.attractors.push_back({.periodic = true, .cycle = *cycle});
        return cycle.has_value();
    }
    void find_saddles(const std::vector<CellGroup>& groups) {
        const auto look = [&](const Vector& x, int period) {
            if (stopped())
                return;
            const auto from = picture_.at_first_flash(x);
            const auto cycle = from ? newton_(*from, period) : std::nullopt;
            const auto same = [&](const StrobeCycle& s) {
                return on_cycle(s, cycle->points.front(), 1e-7);
            };
            if (cycle && !cycle->stable() && in_picture(*cycle) &&
                std::none_of(sets_.saddles.begin(), sets_.saddles.end(), same))
                sets_.saddles.push_back(*cycle);
        };
        for (const CellGroup& g : groups)
            if (g.period <= settings_.longest)
                look(centre(g.cells.front()), g.period);
        std::vector<int> periods{1};
        for (const Attractor& a : sets_.attractors)
            if (a.periodic)
                periods.push_back(a.cycle.period());
        std::sort(periods.begin(), periods.end());
        periods.erase(std::unique(periods.begin(), periods.end()), periods.end());
        for (const int period : periods) {
            // as many periods are run for each
            const int side = int(std::sqrt(double(settings_.newtons) / period));
            for (int i = 0; i < side; ++i)
                for (int j = 0; j < side; ++j)
                    look(picture_.state(
                             {between(0, (i + 0.5) / side), between(1, (j + 0.5) / side)}),
                         period);
        }
    }
    double between(int axis, double u) const {
        return picture_.grid.axis(axis).low +
               u * (picture_.grid.axis(axis).high - picture_.grid.axis(axis).low);
    }
    bool in_picture(const StrobeCycle& c) const {
        return std::any_of(c.points.begin(), c.points.end(),
                           [&](const Vector& x) { return picture_.cell_of(view(x)) >= 0; });
    }
    void sort() {
        const auto less = [](const StrobeCycle& a, const StrobeCycle& b) {
            if (a.period() != b.period())
                return a.period() < b.period();
            const Vector &x = a.points.front(), &y = b.points.front();
            return std::lexicographical_compare(x.begin(), x.end(), y.begin(), y.end());
        };
        std::sort(sets_.saddles.begin(), sets_.saddles.end(), less);
        std::stable_sort(sets_.attractors.begin(), sets_.attractors.end(),
                         [&](const Attractor& a, const Attractor& b) {
                             return a.periodic != b.periodic ? a.periodic
                                    : a.periodic             ? less(a.cycle, b.cycle)
                                                             : false;
                         });
    }

    /// The largest ellipsoids, of sizes tried downwards, that P^period is seen to map well into
    /// themselves: points on many shells in many directions must all come nearer. No other cycle,
    /// nor half the way to it, is inside.
    void fence_in(Attractor& a) {
        a.norms.clear();
        a.radius = 0;
        if (!a.periodic)
            return;
        const Matrix to = picture_.unit.asDiagonal(),
                     from = picture_.unit.cwiseInverse().asDiagonal();
        const double rate = (1 + a.cycle.growth) / 2;
        const DiscretePart& part = a.cycle.part;
        for (std::size_t k = 0; k < a.cycle.slopes.size(); ++k) {
            a.norms.push_back(Matrix::Zero(to.rows(), to.cols()));
            a.norms.back()(part.rest, part.rest) =
                contracting_norm(part.of_rest(Matrix(from * a.cycle.round(k) * to)), rate);
        }
        pin_clocks(a, largest_radius);
        const double most = std::min(largest_radius, 0.5 * distance_to_others(a));
        for (double radius = most; radius > 1e-7 && !stopped(); radius *= 0.7)
            if (draws_together(a, radius, (1 + rate) / 2)) {
                a.radius = radius;
                pin_clocks(a, radius);
                return;
            }
    }
    static constexpr double largest_radius = 0.25;
    /// Inside an ellipsoid clocks and latches are those of the cycle, to 1e-4 of what they move.
    static void pin_clocks(Attractor& a, double radius) {
        for (Matrix& S : a.norms)
            for (const int i : a.cycle.part.discrete)
                S(i, i) = (radius / 1e-4) * (radius / 1e-4);
    }
    bool draws_together(const Attractor& a, double radius, double rate) {
        for (const double shell : {1.0, 0.05, 0.8, 0.6, 0.4, 0.2}) // those that tell most first
            if (!shell_shrinks(a, shell * radius, rate))
                return false;
        return true;
    }
    double size_at(const Attractor& a, std::size_t k, const Vector& v) const {
        return std::sqrt(v.dot(a.norms[k] * v));
    }
    /// From the points of a cycle, in its norms.
    double distance_to_others(const Attractor& a) const {
        double nearest = std::numeric_limits<double>::infinity();
        const auto look = [&](const States& points) {
            for (std::size_t k = 0; k < a.norms.size(); ++k)
                for (const Vector& x : points)
                    nearest = std::min(
                        nearest,
                        size_at(a, k, (x - a.cycle.points[k]).cwiseQuotient(picture_.unit)));
        };
        for (const Attractor& other : sets_.attractors)
            if (&other != &a)
                look(other.periodic ? other.cycle.points : other.cloud);
        for (const StrobeCycle& saddle : sets_.saddles)
            look(saddle.points);
        return nearest;
    }
    bool shell_shrinks(const Attractor& a, double size, double rate) {
        const std::vector<int>& rest = a.cycle.part.rest;
        const int period = a.cycle.period(), directions = std::max(96 / period, 8);
        if (rest.empty())
            return true;
        std::mt19937_64 random(settings_.seed);
        States points;
        for (std::size_t k = 0; k < a.norms.size(); ++k)
            for (int d = 0; d < directions; ++d) {
                Vector v = Vector::Zero(picture_.unit.size());
                v(rest) = direction(d, directions, int(rest.size()), random);
                points.push_back(a.cycle.points[k] +
                                 Vector(size / size_at(a, k, v) * v.cwiseProduct(picture_.unit)));
            }
        Followed run(picture_, points, PointsAre::flashed, period, 1);
        // on the way round a long cycle errors grow: they must not hide the contraction
        picture_.run(points.size(), run, tightened(settings_.run), sets_.state);
        for (std::size_t n = 0; n < points.size(); ++n) {
            if (run.status[n] != Status::ok)
                return false;
            const std::size_t k = n / std::size_t(directions);
            const Vector v =
                (run.states[n].back() - a.cycle.points[k]).cwiseQuotient(picture_.unit);
            if (!(size_at(a, k, v) <= rate * size))
                return false;
        }
        return true;
    }
    /// In the plane evenly, else at random.
    static Vector direction(int k, int n, int dim, std::mt19937_64& random) {
        Vector v(dim);
        if (dim == 2) {
            const double angle = 2 * std::numbers::pi * (k + 0.5) / n;
            v << std::cos(angle), std::sin(angle);
            return v;
        }
        for (int i = 0; i < dim; ++i)
            v[i] = 2 * uniform(random) - 1;
        return v.norm() > 1e-3 ? Vector(v.normalized()) : Vector(Vector::Unit(dim, 0));
    }

    const StrobePicture& picture_;
    const BasinSettings& settings_ = picture_.settings;
    const CycleNewton newton_;
    std::vector<VisitedBoxes> clouds_; ///< boxes of the attractors that are not periodic
    LimitSets sets_;
};

} // namespace detail

} // namespace filippov
