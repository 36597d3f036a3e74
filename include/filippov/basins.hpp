// SPDX-License-Identifier: BSD-3-Clause
// Basins of attraction of a forced system: attractors found, refined and fenced in, and every cell
// labelled by its own trajectory.
#pragma once

#include <filippov/any_lanes.hpp>
#include <filippov/any_system.hpp>
#include <filippov/cells.hpp>
#include <filippov/maps.hpp>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <complex>
#include <cstdint>
#include <optional>
#include <random>
#include <string>
#include <unordered_set>
#include <vector>

namespace filippov {

/// A cycle of the strobe map P: an orbit of `period()` forcing periods.
struct StrobeCycle {
    std::vector<Vector> points;                    ///< x, P(x), ..., shape (period, dim)
    std::vector<std::complex<double>> multipliers; ///< of P^period, largest first
    std::vector<Matrix> slopes;                    ///< of P^period at each point
    double residual = 0;                           ///< |P^period(x) - x|, in units of the picture

    int period() const { return int(points.size()); }
    bool stable() const { return !multipliers.empty() && std::abs(multipliers.front()) < 1; }
};

/// What trajectories end on.
struct Attractor {
    bool periodic = true;
    StrobeCycle cycle{};         ///< if it is periodic
    std::vector<Vector> cloud{}; ///< else points of it, one a forcing period
    /// Ellipsoids around the points of a cycle that P^period maps into themselves, |v|^2 = v' S v
    /// in units of the picture: one S a point, and one radius for all.
    std::vector<Matrix> norms{};
    double radius = 0;
};

/// What a picture of basins is told.
struct BasinSettings {
    EnsembleSettings run{};
    double t0 = 0;       ///< when the strobe flashes, and trajectories start
    Vector rest{};       ///< of the state, for coordinates that are not on the grid; empty: zeros
    int seeds = 256;     ///< cells, drawn at random, that are followed to find attractors, > 0
    int settle = 200;    ///< forcing periods before a cycle is looked for, > 0
    int longest = 64;    ///< forcing periods of the longest cycle looked for, > 0
    int newtons = 144;   ///< cells from which Newton looks for saddles, >= 0
    int periods = 10000; ///< forcing periods to wait for an attractor, > 0
    /// A trajectory has landed when it is nearer than this to the attractor, in units of the
    /// picture; 0: when it has entered its ellipsoid, which it does not leave.
    double distance = 0;
    int audit = 500; ///< cells, drawn at random, that are followed on to the attractor itself, >= 0
    std::vector<double> escape{}; ///< |x_i| beyond which a trajectory has escaped; empty: none
    std::uint64_t seed = 1;
    Parallel parallel{}; ///< progress counts cells that are labelled
};

/// How plain cell mapping labels the cells of one of its groups, beside the certified labels.
struct GroupCheck {
    std::int32_t group = 0; ///< of the plain map: an index, or `CellGrid::sink`, `unresolved`
    /// The attractor (from 1) of which a point lies in the group or next to it, 0: none, the group
    /// is spurious. Of several groups at one attractor the one with the largest basin stands for
    /// it.
    std::int32_t attractor = 0;
    std::vector<std::int64_t>
        cells{}; ///< that it takes, by certified label: escaped, unresolved, 1...
};

/// A picture of basins.
struct Basins {
    CellGrid grid;
    /// Shape (cells,): 1, 2, ... the attractor, 0 unresolved, -1 escaped.
    std::vector<std::int32_t> label{};
    std::vector<std::int32_t> time{}; ///< forcing periods until it had landed, -1 where it did not
    std::vector<Status> status{};     ///< of the cell's run: why it is unresolved
    std::vector<Attractor> attractors{}; ///< by period, then by their first point
    std::vector<StrobeCycle> saddles{};  ///< unstable cycles that were found
    CellMap plain{};                     ///< simple cell mapping of the same cells
    std::vector<GroupCheck>
        confusion{}; ///< one row a group of it, and those of sink and unresolved
    std::int64_t unresolved = 0;
    /// Cells, drawn at random, that were followed until 1e-4 pictures from an attractor, and those
    /// of them that were not at the one of their label then.
    int audited = 0, disagreements = 0;
    long long periods = 0; ///< forcing periods of all trajectories of the labelling
    LaneCounters counters{};
    Status state = Status::ok; ///< `interrupted`: cells that were not labelled are unresolved
};

namespace detail {

/// The unit of length of each coordinate: the width of the picture, and 1 for the rest.
inline Vector picture_units(const CellGrid& grid, int dim) {
    Vector unit = Vector::Ones(dim);
    for (int k = 0; k < 2; ++k)
        unit[grid.axis(k).coordinate] = grid.axis(k).high - grid.axis(k).low;
    return unit;
}

/// Members that all start when the strobe flashes, with the same parameters.
class Flashes : public AnyPopulation {
public:
    Flashes(const AnySystem& system, const Vector& p, const BasinSettings& settings)
        : p_(p), t0_(settings.t0), T_(require_period(system, p).value) {
        same_params = true;
        escape = settings.escape;
    }
    double leg(std::size_t) override { return T_; }

protected:
    void start(MemberView& m, const Vector& x, int periods) const {
        std::copy_n(x.data(), x.size(), m.x.begin());
        std::copy_n(p_.data(), p_.size(), m.p.begin());
        m.t0 = t0_;
        m.t_end = t0_ + periods * T_;
    }
    static Vector state_of(const OutcomeView& o) {
        return Eigen::Map<const Vector>(o.x.data(), Eigen::Index(o.x.size()));
    }

private:
    const Vector p_;
    const double t0_, T_;
};

/// Follows points for a number of periods and keeps the states at the last flashes.
class Followed final : public Flashes {
public:
    std::vector<std::vector<Vector>> states; ///< of each point
    std::vector<Status> status;

    Followed(const AnySystem& system, const Vector& p, const BasinSettings& settings,
             const std::vector<Vector>& points, int before, int kept)
        : Flashes(system, p, settings), states(points.size()),
          status(points.size(), Status::interrupted), points_(points), before_(before),
          kept_(std::size_t(kept)) {}

    void member(std::size_t id, MemberView& m) override { start(m, points_[id], before_); }
    bool goes_on(std::size_t id, const OutcomeView& o) override {
        states[id].push_back(state_of(o));
        return states[id].size() < kept_;
    }
    void take(std::size_t id, const OutcomeView& o) override { status[id] = o.status; }

private:
    const std::vector<Vector>& points_;
    const int before_;
    const std::size_t kept_;
};

/// Newton on P^period(x) = x, in units of the picture.
class CycleNewton {
public:
    CycleNewton(const AnySystem& system, const Vector& p, double t0, const Vector& unit)
        : system_(system), p_(p), t0_(t0), unit_(unit) {}

    /// The cycle near x, of the least period; none if Newton does not converge.
    std::optional<StrobeCycle> operator()(Vector x, int period) const {
        for (int k = 0; k < 25; ++k) {
            const Mapped m = strobe(system_, t0_, x, p_, period);
            if (!m.ok() || m.singular)
                return std::nullopt;
            const Eigen::Index n = x.size();
            const Matrix J = m.slope.topLeftCorner(n, n) - Matrix::Identity(n, n);
            const Vector step = J.partialPivLu().solve(m.x - x);
            const double size = scaled(step);
            if (!(size < 1))
                return std::nullopt;
            x -= step;
            if (size < 1e-13)
                return describe(x, period);
            if (size < 1e-11 && k > 6)
                return describe(x, period); // at the floor of rounding
        }
        return std::nullopt;
    }
    double scaled(const Vector& v) const { return v.cwiseQuotient(unit_).norm(); }

private:
    std::optional<StrobeCycle> describe(const Vector& x, int period) const {
        StrobeCycle c;
        Vector y = x;
        for (int k = 0; k < period; ++k) {
            if (k > 0 && scaled(y - x) < 1e-9)
                break; // a shorter cycle, gone round more than once
            c.points.push_back(y);
            const Mapped m = strobe(system_, t0_, y, p_, 1);
            if (!m.ok())
                return std::nullopt;
            y = m.x;
        }
        const Eigen::Index n = x.size();
        for (const Vector& point : c.points) {
            const Mapped m = strobe(system_, t0_, point, p_, c.period());
            if (!m.ok())
                return std::nullopt;
            c.slopes.push_back(m.slope.topLeftCorner(n, n));
            c.residual = std::max(c.residual, scaled(m.x - point));
        }
        const Eigen::VectorXcd mu = c.slopes.front().eigenvalues();
        c.multipliers.assign(mu.begin(), mu.end());
        std::sort(c.multipliers.begin(), c.multipliers.end(),
                  [](const auto& a, const auto& b) { return std::abs(a) > std::abs(b); });
        begin_with_smallest(c);
        return c;
    }
    static void begin_with_smallest(StrobeCycle& c) {
        const auto less = [](const Vector& a, const Vector& b) {
            return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end());
        };
        const auto first = std::min_element(c.points.begin(), c.points.end(), less);
        const auto by = first - c.points.begin();
        std::rotate(c.points.begin(), c.points.begin() + by, c.points.end());
        std::rotate(c.slopes.begin(), c.slopes.begin() + by, c.slopes.end());
    }

    const AnySystem& system_;
    const Vector p_;
    const double t0_;
    const Vector unit_;
};

/// S with |A v|_S <= r |v|_S for |v|_S^2 = v' S v, and S >= 1: the sum of (A')^k A^k / r^(2k).
/// @pre r is larger than the spectral radius of A
inline Matrix contracting_norm(const Matrix& A, double r) {
    Matrix S = Matrix::Identity(A.rows(), A.cols()), power = S;
    for (int k = 0; k < 100'000; ++k) {
        power = A * power / r;
        const Matrix term = power.transpose() * power;
        S += term;
        if (!(term.norm() > 1e-15 * S.norm()))
            break;
    }
    return S;
}

/// Boxes that a non-periodic attractor visits.
class VisitedBoxes {
public:
    VisitedBoxes(const std::vector<Vector>& cloud, const Vector& unit) : unit_(unit) {
        for (const Vector& x : cloud)
            visited_.insert(key(x));
    }
    bool holds(const Vector& x) const { return visited_.contains(key(x)); }

private:
    static constexpr double boxes = 100; ///< along the width of the picture
    std::uint64_t key(const Vector& x) const {
        std::uint64_t k = 0xcbf29ce484222325u;
        for (Eigen::Index i = 0; i < x.size(); ++i) {
            const double box = std::floor(x[i] / unit_[i] * boxes);
            const auto n = std::abs(box) < 1e15 ? static_cast<std::int64_t>(box) : 0;
            k = (k ^ static_cast<std::uint64_t>(n)) * 0x100000001b3u;
        }
        return k;
    }
    Vector unit_;
    std::unordered_set<std::uint64_t> visited_;
};

/// Labels points by their own trajectories.
class Labelling : public Flashes {
public:
    static constexpr int visits = 20; ///< in a row that tell a non-periodic attractor

    Labelling(const AnySystem& system, const Vector& p, const BasinSettings& settings,
              const std::vector<Attractor>& attractors, const Vector& unit, std::size_t n)
        : Flashes(system, p, settings), settings_(settings), attractors_(attractors),
          inverse_unit_(unit.cwiseInverse()), progress_(n) {
        for (const Attractor& a : attractors)
            boxes_.emplace_back(a.cloud, unit);
    }

    bool goes_on(std::size_t id, const OutcomeView& o) override {
        Progress& at = progress_[id];
        const Vector x = state_of(o);
        if (const std::int32_t label = landed(x, at); label > 0) {
            land(id, label, at.periods);
            return false;
        }
        return ++at.periods <= settings_.periods;
    }
    void take(std::size_t id, const OutcomeView& o) override {
        periods_ += std::max(progress_[id].periods, 1);
        end(id, o.status);
    }
    long long periods() const { return periods_; }

protected:
    /// A member has landed, after so many periods.
    virtual void land(std::size_t id, std::int32_t label, int periods) = 0;
    /// It has ended, with a status that is `ok` if it ran as long as it may.
    virtual void end(std::size_t id, Status status) = 0;
    /// It starts: true if it stands in an attractor's neighbourhood already.
    bool begin(std::size_t id, const Vector& x) {
        Progress& at = progress_[id];
        const std::int32_t label = landed(x, at);
        at.periods = 1;
        if (label > 0)
            land(id, label, 0);
        return label > 0;
    }

private:
    struct Progress {
        std::int32_t periods = 0; ///< of the leg that is run
        std::int32_t box = 0;     ///< the non-periodic attractor that is visited, and how often
        std::int32_t in_box = 0;
    };

    std::int32_t landed(const Vector& x, Progress& at) const {
        for (std::size_t a = 0; a < attractors_.size(); ++a) {
            const auto label = std::int32_t(a + 1);
            if (attractors_[a].periodic) {
                if (near(attractors_[a], x))
                    return label;
            } else if (boxes_[a].holds(x)) {
                at.in_box = at.box == label ? at.in_box + 1 : 1;
                at.box = label;
                return at.in_box >= visits ? label : 0;
            }
        }
        at.in_box = 0;
        return 0;
    }
    bool near(const Attractor& a, const Vector& x) const {
        const double bound = settings_.distance > 0 ? settings_.distance : a.radius;
        for (std::size_t k = 0; k < a.cycle.points.size(); ++k) {
            const Vector v = (x - a.cycle.points[k]).cwiseProduct(inverse_unit_);
            if (!(v.squaredNorm() <= bound * bound)) // the norms are at least the plain one
                continue;
            if (settings_.distance > 0 || v.dot(a.norms[k] * v) <= bound * bound)
                return true;
        }
        return false;
    }

    const BasinSettings& settings_;
    const std::vector<Attractor>& attractors_;
    const Vector inverse_unit_;
    std::vector<VisitedBoxes> boxes_;
    std::vector<Progress> progress_;
    std::atomic<long long> periods_{0};
};

} // namespace detail

/// Finds what there is to fall to, and labels.
class BasinFinder {
public:
    /// @error std::invalid_argument for a system that is not forced, or settings, parameters or a
    ///        grid that make no sense
    BasinFinder(const AnySystem& system, const AnyLanes& lanes, const CellGrid& grid, Vector p,
                BasinSettings settings = {})
        : system_(system), lanes_(lanes), grid_(grid), p_(std::move(p)),
          settings_(std::move(settings)), unit_(detail::picture_units(grid, system.dim())) {
        validate();
    }

    /// The whole picture.
    Basins run() {
        Basins basins{.grid = grid_};
        plain(basins);
        if (basins.state == Status::ok)
            find(basins);
        if (basins.state == Status::ok)
            label(basins);
        if (basins.state == Status::ok)
            audit(basins);
        if (basins.state != Status::ok)
            basins.label.resize(std::size_t(grid_.cells()), 0);
        check(basins);
        return basins;
    }

    /// The state of a point of the picture.
    Vector state(const std::array<double, 2>& point) const {
        Vector x = settings_.rest;
        for (int k = 0; k < 2; ++k)
            x[grid_.axis(k).coordinate] = point[std::size_t(k)];
        return x;
    }

private:
    void validate() {
        const int dim = system_.dim();
        if (settings_.rest.size() == 0)
            settings_.rest = Vector::Zero(dim);
        detail::require_point(system_, settings_.t0, settings_.rest, p_);
        detail::require_period(system_, p_);
        if (lanes_.dim() != dim || lanes_.params() != int(p_.size()))
            detail::refuse("lanes.dim()", lanes_.dim(), "expected lanes of the same system");
        for (int k = 0; k < 2; ++k)
            if (grid_.axis(k).coordinate >= dim)
                detail::refuse("grid.axis(" + std::to_string(k) + ").coordinate",
                               grid_.axis(k).coordinate, "expected an index below dim");
        const auto positive = [](const char* name, int value) {
            if (!(value > 0))
                detail::refuse(name, value, "expected an integer > 0");
        };
        positive("seeds", settings_.seeds);
        positive("settle", settings_.settle);
        positive("longest", settings_.longest);
        positive("periods", settings_.periods);
        if (!(settings_.audit >= 0))
            detail::refuse("audit", settings_.audit, "expected an integer >= 0");
        if (!(settings_.newtons >= 0))
            detail::refuse("newtons", settings_.newtons, "expected an integer >= 0");
        if (!(settings_.distance >= 0 && settings_.distance < 1))
            detail::refuse("distance", settings_.distance, "expected 0 <= distance < 1");
    }

    /// The work beside the labelling shows no progress.
    Parallel quiet() const {
        Parallel how = settings_.parallel;
        how.progress = nullptr;
        return how;
    }

    // --- plain cell mapping --------------------------------------------------------------------

    /// Images of all cells after one period.
    class Images final : public detail::Flashes {
    public:
        std::vector<std::int32_t> image;

        explicit Images(const BasinFinder& f)
            : Flashes(f.system_, f.p_, f.settings_),
              image(std::size_t(f.grid_.cells()), CellGrid::unresolved), f_(f) {}
        void member(std::size_t id, MemberView& m) override {
            start(m, f_.state(f_.grid_.centre(std::int32_t(id))), 1);
        }
        void take(std::size_t id, const OutcomeView& o) override {
            if (o.status == Status::escaped)
                image[id] = CellGrid::sink;
            if (o.status == Status::ok)
                image[id] = f_.grid_.cell_of(o.x[std::size_t(f_.grid_.axis(0).coordinate)],
                                             o.x[std::size_t(f_.grid_.axis(1).coordinate)]);
        }

    private:
        const BasinFinder& f_;
    };
    void plain(Basins& basins) const {
        Images images(*this);
        basins.state = lanes_.run(images.image.size(), images, settings_.run, quiet()).status;
        basins.plain = cell_map(grid_, images.image);
    }

    // --- attractors and saddles ----------------------------------------------------------------

    void find(Basins& basins) const {
        std::vector<Vector> points = seeds();
        for (const CellGroup& g : basins.plain.groups)
            points.push_back(state(grid_.centre(g.cells.front())));
        detail::Followed ends(system_, p_, settings_, points, settings_.settle,
                              settings_.longest + 1);
        basins.state = lanes_.run(points.size(), ends, settings_.run, quiet()).status;
        const detail::CycleNewton newton(system_, p_, settings_.t0, unit_);
        std::vector<Vector> restless;
        for (std::size_t k = 0; k < points.size() && basins.state == Status::ok; ++k) {
            if (ends.status[k] != Status::ok || on_a_known_cycle(basins, ends.states[k].back()))
                continue;
            if (const auto cycle = settled_on(newton, ends.states[k]))
                add(basins, *cycle);
            else
                restless.push_back(ends.states[k].back());
            if (system_.interrupted())
                basins.state = Status::interrupted;
        }
        add_clouds(basins, restless);
        find_saddles(basins, newton);
        sort(basins);
        for (Attractor& a : basins.attractors)
            fence_in(a, basins);
    }
    std::vector<Vector> seeds() const {
        std::mt19937_64 random(settings_.seed);
        std::vector<Vector> points;
        for (int k = 0; k < settings_.seeds; ++k)
            points.push_back(
                state(grid_.centre(std::int32_t(random() % std::uint64_t(grid_.cells())))));
        return points;
    }
    double apart(const Vector& a, const Vector& b) const {
        return (a - b).cwiseQuotient(unit_).norm();
    }
    bool on_cycle(const StrobeCycle& c, const Vector& x, double distance) const {
        return std::any_of(c.points.begin(), c.points.end(),
                           [&](const Vector& y) { return apart(x, y) <= distance; });
    }
    bool on_a_known_cycle(const Basins& basins, const Vector& x) const {
        return std::any_of(basins.attractors.begin(), basins.attractors.end(),
                           [&](const Attractor& a) { return on_cycle(a.cycle, x, 1e-7); });
    }
    /// The stable cycle that the end of a run has come to.
    std::optional<StrobeCycle> settled_on(const detail::CycleNewton& newton,
                                          const std::vector<Vector>& states) const {
        for (int q = 1; q < int(states.size()); ++q) {
            const double gap = apart(states.back(), states[states.size() - 1 - std::size_t(q)]);
            if (!(gap < 1e-2))
                continue;
            const auto cycle = newton(states.back(), q);
            if (cycle && cycle->stable() && on_cycle(*cycle, states.back(), 20 * gap + 1e-9))
                return cycle;
        }
        return std::nullopt;
    }
    void add(Basins& basins, const StrobeCycle& cycle) const {
        const bool known = on_a_known_cycle(basins, cycle.points.front());
        if (!known)
            basins.attractors.push_back({.periodic = true, .cycle = cycle});
    }
    /// Runs that did not settle on a cycle: those that visit the same places are on one attractor.
    void add_clouds(Basins& basins, std::vector<Vector>& restless) const {
        constexpr int points = 4000;
        for (int clouds = 0; clouds < 8 && !restless.empty() && basins.state == Status::ok;
             ++clouds) {
            detail::Followed run(system_, p_, settings_, restless, 1, points);
            basins.state = lanes_.run(restless.size(), run, settings_.run, quiet()).status;
            const detail::VisitedBoxes boxes(run.states.front(), unit_);
            std::vector<Vector> left;
            for (std::size_t k = 1; k < restless.size(); ++k) {
                const auto& states = run.states[k];
                const auto inside = std::count_if(states.begin(), states.end(),
                                                  [&](const Vector& x) { return boxes.holds(x); });
                if (2 * std::size_t(inside) < states.size())
                    left.push_back(restless[k]);
            }
            basins.attractors.push_back(
                {.periodic = false, .cloud = std::move(run.states.front())});
            restless = std::move(left);
        }
    }
    void find_saddles(Basins& basins, const detail::CycleNewton& newton) const {
        std::vector<int> periods{1};
        for (const Attractor& a : basins.attractors)
            if (a.periodic &&
                std::find(periods.begin(), periods.end(), a.cycle.period()) == periods.end())
                periods.push_back(a.cycle.period());
        const auto look = [&](const Vector& x, int period) {
            if (basins.state != Status::ok || system_.interrupted()) {
                basins.state = Status::interrupted;
                return;
            }
            const auto cycle = newton(x, period);
            if (cycle && !cycle->stable() && in_picture(*cycle) &&
                std::none_of(basins.saddles.begin(), basins.saddles.end(), [&](const auto& s) {
                    return on_cycle(s, cycle->points.front(), 1e-7);
                }))
                basins.saddles.push_back(*cycle);
        };
        for (const CellGroup& g : basins.plain.groups)
            if (g.period <= settings_.longest)
                look(state(grid_.centre(g.cells.front())), g.period);
        const int side = int(std::sqrt(double(settings_.newtons)));
        for (const int period : periods)
            for (int i = 0; i < side; ++i)
                for (int j = 0; j < side; ++j)
                    look(state({between(0, (i + 0.5) / side), between(1, (j + 0.5) / side)}),
                         period);
    }
    double between(int axis, double u) const {
        return grid_.axis(axis).low + u * (grid_.axis(axis).high - grid_.axis(axis).low);
    }
    bool in_picture(const StrobeCycle& c) const {
        return std::any_of(c.points.begin(), c.points.end(), [&](const Vector& x) {
            return grid_.cell_of(x[grid_.axis(0).coordinate], x[grid_.axis(1).coordinate]) >= 0;
        });
    }
    static void sort(Basins& basins) {
        const auto less = [](const StrobeCycle& a, const StrobeCycle& b) {
            if (a.period() != b.period())
                return a.period() < b.period();
            const Vector &x = a.points.front(), &y = b.points.front();
            return std::lexicographical_compare(x.begin(), x.end(), y.begin(), y.end());
        };
        std::sort(basins.saddles.begin(), basins.saddles.end(), less);
        std::stable_sort(basins.attractors.begin(), basins.attractors.end(),
                         [&](const Attractor& a, const Attractor& b) {
                             return a.periodic != b.periodic ? a.periodic
                                    : a.periodic             ? less(a.cycle, b.cycle)
                                                             : false;
                         });
    }

    /// The largest ellipsoids, of sizes that are halved, that the cycle is seen to draw together:
    /// points on many shells in many directions must all come nearer. No other cycle, nor half the
    /// way to it, is inside.
    void fence_in(Attractor& a, Basins& basins) const {
        if (!a.periodic)
            return;
        const Matrix to = unit_.asDiagonal(), from = unit_.cwiseInverse().asDiagonal();
        const double rate = (1 + std::abs(a.cycle.multipliers.front())) / 2;
        for (const Matrix& A : a.cycle.slopes)
            a.norms.push_back(detail::contracting_norm(from * A * to, rate));
        const double most = std::min(0.25, 0.5 * distance_to_others(a, basins));
        for (double radius = most; radius > 1e-7 && basins.state == Status::ok; radius /= 2)
            if (draws_together(a, radius, (1 + rate) / 2, basins)) {
                a.radius = radius;
                return;
            }
    }
    /// From the points of a cycle, in its norms.
    double distance_to_others(const Attractor& a, const Basins& basins) const {
        double nearest = std::numeric_limits<double>::infinity();
        const auto look = [&](const std::vector<Vector>& points) {
            for (std::size_t k = 0; k < a.norms.size(); ++k)
                for (const Vector& x : points) {
                    const Vector v = (x - a.cycle.points[k]).cwiseQuotient(unit_);
                    nearest = std::min(nearest, std::sqrt(v.dot(a.norms[k] * v)));
                }
        };
        for (const Attractor& other : basins.attractors)
            if (&other != &a)
                look(other.periodic ? other.cycle.points : other.cloud);
        for (const StrobeCycle& saddle : basins.saddles)
            look(saddle.points);
        return nearest;
    }
    bool draws_together(const Attractor& a, double radius, double rate, Basins& basins) const {
        constexpr int directions = 96;
        const int dim = system_.dim();
        std::mt19937_64 random(settings_.seed);
        std::vector<Vector> points;
        std::vector<std::size_t> around;
        std::vector<double> sizes;
        for (std::size_t k = 0; k < a.norms.size(); ++k)
            for (int d = 0; d < directions; ++d) {
                const Vector v = direction(d, directions, dim, random);
                for (const double shell : {1.0, 0.8, 0.6, 0.4, 0.2, 0.05}) {
                    const double size = shell * radius, length = std::sqrt(v.dot(a.norms[k] * v));
                    points.push_back(a.cycle.points[k] +
                                     Vector(size / length * v.cwiseProduct(unit_)));
                    around.push_back(k);
                    sizes.push_back(size);
                }
            }
        detail::Followed run(system_, p_, settings_, points, a.cycle.period(), 1);
        const Status status = lanes_.run(points.size(), run, settings_.run, quiet()).status;
        if (status != Status::ok)
            basins.state = status;
        for (std::size_t n = 0; n < points.size(); ++n) {
            if (run.status[n] != Status::ok)
                return false;
            const Vector v =
                (run.states[n].back() - a.cycle.points[around[n]]).cwiseQuotient(unit_);
            if (!(std::sqrt(v.dot(a.norms[around[n]] * v)) <= rate * sizes[n]))
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
            v[i] = double(random() >> 11) * 0x1p-52 - 1;
        return v.norm() > 1e-3 ? Vector(v.normalized()) : Vector(Vector::Unit(dim, 0));
    }

    // --- labels --------------------------------------------------------------------------------

    class Cells final : public detail::Labelling {
    public:
        Cells(const BasinFinder& f, Basins& basins)
            : Labelling(f.system_, f.p_, f.settings_, basins.attractors, f.unit_,
                        std::size_t(f.grid_.cells())),
              f_(f), basins_(basins) {}
        void member(std::size_t id, MemberView& m) override {
            const Vector x = f_.state(f_.grid_.centre(std::int32_t(id)));
            start(m, x, begin(id, x) ? 0 : 1);
        }

    protected:
        void land(std::size_t id, std::int32_t label, int periods) override {
            basins_.label[id] = label;
            basins_.time[id] = periods;
        }
        void end(std::size_t id, Status status) override {
            basins_.status[id] = status;
            if (status == Status::escaped)
                basins_.label[id] = -1;
        }

    private:
        const BasinFinder& f_;
        Basins& basins_;
    };
    void label(Basins& basins) const {
        const auto n = std::size_t(grid_.cells());
        basins.label.assign(n, 0);
        basins.time.assign(n, -1);
        basins.status.assign(n, Status::interrupted);
        Cells cells(*this, basins);
        const PopulationRun run = lanes_.run(n, cells, settings_.run, settings_.parallel);
        basins.state = run.status;
        basins.counters = run.counters;
        basins.periods = cells.periods();
        basins.unresolved = std::count(basins.label.begin(), basins.label.end(), 0);
    }

    class Audited final : public detail::Labelling {
    public:
        std::vector<std::int32_t> label;

        Audited(const BasinFinder& f, const BasinSettings& settings,
                const std::vector<Attractor>& attractors, const std::vector<std::int32_t>& cells)
            : Labelling(f.system_, f.p_, settings, attractors, f.unit_, cells.size()),
              label(cells.size(), 0), f_(f), cells_(cells) {}
        void member(std::size_t id, MemberView& m) override {
            const Vector x = f_.state(f_.grid_.centre(cells_[id]));
            start(m, x, begin(id, x) ? 0 : 1);
        }

    protected:
        void land(std::size_t id, std::int32_t found, int) override { label[id] = found; }
        void end(std::size_t id, Status status) override {
            if (status == Status::escaped)
                label[id] = -1;
        }

    private:
        const BasinFinder& f_;
        const std::vector<std::int32_t>& cells_;
    };
    void audit(Basins& basins) const {
        std::mt19937_64 random(settings_.seed + 1);
        std::vector<std::int32_t> cells;
        for (int k = 0; k < settings_.audit; ++k)
            cells.push_back(std::int32_t(random() % std::uint64_t(grid_.cells())));
        BasinSettings longer = settings_;
        longer.distance = 1e-4;
        Audited audited(*this, longer, basins.attractors, cells);
        basins.state = lanes_.run(cells.size(), audited, settings_.run, quiet()).status;
        basins.audited = int(cells.size());
        for (std::size_t k = 0; k < cells.size(); ++k)
            basins.disagreements += audited.label[k] != basins.label[std::size_t(cells[k])];
    }

    // --- the plain map, checked ----------------------------------------------------------------

    void check(Basins& basins) const {
        const auto row = [&](std::int32_t group) {
            GroupCheck g{.group = group};
            g.cells.assign(basins.attractors.size() + 2, 0);
            return g;
        };
        for (std::size_t g = 0; g < basins.plain.groups.size(); ++g)
            basins.confusion.push_back(row(std::int32_t(g)));
        basins.confusion.push_back(row(CellGrid::sink));
        basins.confusion.push_back(row(CellGrid::unresolved));
        for (std::size_t c = 0; c < basins.label.size(); ++c) {
            const std::int32_t group = basins.plain.group[c];
            const std::size_t n = basins.plain.groups.size();
            const std::size_t k = group >= 0                ? std::size_t(group)
                                  : group == CellGrid::sink ? n
                                                            : n + 1;
            ++basins.confusion[k].cells[std::size_t(basins.label[c] + 1)];
        }
        for (std::size_t a = 0; a < basins.attractors.size(); ++a)
            if (const auto g = group_at(basins, basins.attractors[a]))
                basins.confusion[*g].attractor = std::int32_t(a + 1);
    }
    /// The group that stands for an attractor.
    std::optional<std::size_t> group_at(const Basins& basins, const Attractor& a) const {
        std::optional<std::size_t> best;
        for (std::size_t g = 0; g < basins.plain.groups.size(); ++g)
            if (is_at(basins.plain.groups[g], a) &&
                (!best || basins.plain.groups[g].basin > basins.plain.groups[*best].basin))
                best = g;
        return best;
    }
    bool is_at(const CellGroup& group, const Attractor& a) const {
        const auto next_to = [&](const Vector& x) {
            const std::int32_t n = grid_.axis(1).n,
                               cell = grid_.cell_of(x[grid_.axis(0).coordinate],
                                                    x[grid_.axis(1).coordinate]);
            return cell >= 0 &&
                   std::any_of(group.cells.begin(), group.cells.end(), [&](std::int32_t c) {
                       return std::abs(c / n - cell / n) <= 1 && std::abs(c % n - cell % n) <= 1;
                   });
        };
        const auto& points = a.periodic ? a.cycle.points : a.cloud;
        return std::any_of(points.begin(), points.end(), next_to);
    }

    const AnySystem& system_;
    const AnyLanes& lanes_;
    const CellGrid grid_;
    const Vector p_;
    BasinSettings settings_;
    const Vector unit_;
};

} // namespace filippov
