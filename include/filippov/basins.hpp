// SPDX-License-Identifier: BSD-3-Clause
// Basins of attraction of a forced system: attractors found, refined and fenced in, and every cell
// labelled by its own trajectory.
#pragma once

#include <filippov/any_lanes.hpp>
#include <filippov/any_system.hpp>
#include <filippov/cells.hpp>
#include <filippov/maps.hpp>
#include <filippov/quotient.hpp>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <complex>
#include <cstdint>
#include <numbers>
#include <optional>
#include <random>
#include <span>
#include <stdexcept>
#include <string>
#include <unordered_set>
#include <vector>

namespace filippov {

/// A cycle of the strobe map P: an orbit of `period()` forcing periods.
struct StrobeCycle {
    std::vector<Vector> points;                    ///< x, P(x), ..., shape (period, dim)
    std::vector<std::complex<double>> multipliers; ///< of P^period, largest first
    std::vector<Matrix> slopes;                    ///< of P at each point
    double residual = 0;                           ///< |P^period(x) - x|, in units of the picture

    int period() const { return int(points.size()); }
    bool stable() const { return !multipliers.empty() && std::abs(multipliers.front()) < 1; }
};

/// What trajectories end on.
struct Attractor {
    bool periodic = true;
    StrobeCycle cycle{};         ///< if it is periodic
    std::vector<Vector> cloud{}; ///< else points of it, one a forcing period
    /// Ellipsoids around the points of a cycle that P^period is seen to map into themselves,
    /// |v|^2 = v' S v in units of the picture: one S a point, one radius for all; 0: none found.
    std::vector<Matrix> norms{};
    double radius = 0;
};

/// Whether cells are labelled by an exit from stick to slip, looked up (quotient.hpp).
enum class UseQuotient : unsigned char {
    automatic, ///< where it applies, and no times are wanted
    never,
    always, ///< else the run is refused, with the reason
};

/// What a picture of basins is told.
struct BasinSettings {
    EnsembleSettings run{};
    double t0 = 0;       ///< when the strobe flashes, and trajectories start
    Vector rest{};       ///< of the state, for coordinates that are not on the grid; empty: zeros
    int seeds = 256;     ///< cells, drawn at random, that are followed to find attractors, > 0
    int settle = 200;    ///< forcing periods before a cycle is looked for, > 0
    int longest = 64;    ///< forcing periods of the longest cycle looked for, > 0
    int newtons = 144;   ///< points from which Newton looks for saddles, >= 0
    int periods = 10000; ///< forcing periods to wait for an attractor, > 0
    /// A trajectory has landed when it is nearer than this to the attractor, in units of the
    /// picture, < 1; 0: when it has entered its ellipsoid, which it does not leave.
    double distance = 0;
    bool times = true; ///< `Basins::time` is wanted, which the quotient does not know
    UseQuotient quotient = UseQuotient::automatic;
    TransitionSettings transition{}; ///< of the quotient's map
    QuotientSettings exits{};        ///< of the quotient
    int audit = 500; ///< cells, drawn at random, that are followed on to the attractor, >= 0
    std::vector<double> escape{}; ///< |x_i| > 0 beyond which a trajectory has escaped; empty: none
    std::uint64_t seed = 1;
    Parallel parallel{}; ///< progress counts each cell twice: its first period, and its label
};

/// How plain cell mapping labels the cells of one of its groups, beside the certified labels.
struct GroupCheck {
    std::int32_t group = 0; ///< of the plain map: an index, or `CellGrid::sink`, `unresolved`
    /// The attractor (from 1) of which a point lies in the group or next to it, 0: none, the group
    /// is spurious. Of several groups at one attractor the one with the largest basin stands for
    /// it; of several attractors at one group the one with the most of its cells.
    std::int32_t attractor = 0;
    std::vector<std::int64_t>
        cells{}; ///< that it takes, by certified label: escaped, unresolved, 1...
};

/// A picture of basins.
struct Basins {
    CellGrid grid;
    /// Shape (cells,): 1, 2, ... the attractor, 0 unresolved, -1 escaped.
    std::vector<std::int32_t> label{};
    /// Shape (cells,), empty if it is not wanted: the number of the flash, from 0, at which the
    /// trajectory had first landed, -1 where it did not. On an attractor that is not periodic: the
    /// first of the flashes at which it was seen there in a row.
    std::vector<std::int32_t> time{};
    /// Of the cell's run, why it is unresolved; `not_converged`: it did not land in `periods`.
    std::vector<Status> status{};
    std::vector<Attractor> attractors{}; ///< by period, then by their first point
    std::vector<StrobeCycle> saddles{};  ///< unstable cycles that were found
    CellMap plain{};                     ///< simple cell mapping of the same cells
    std::vector<GroupCheck>
        confusion{}; ///< one row a group of it, and those of sink and unresolved
    std::int64_t unresolved = 0;
    /// Cells, drawn at random, that were followed until a tenth of the ellipsoid and 1e-4 pictures
    /// from an attractor, and those of them that were not at the one of their label then.
    int audited = 0, disagreements = 0;
    bool by_exit = false;                   ///< the quotient was used
    std::string by_exit_reason{};           ///< why, or why not
    std::int64_t looked_up = 0;             ///< cells of which the label comes from it
    ExitBasins exits{};                     ///< the quotient, if it was built
    std::vector<std::int32_t> exit_label{}; ///< of each of its attractors: 1, 2, ..., 0 unresolved
    long long periods = 0; ///< forcing periods, begun, of all trajectories of the labelling
    LaneCounters counters{};
    Status state = Status::ok; ///< `interrupted`: cells that were not labelled are unresolved
};

namespace detail {

/// The unit of length of each coordinate: the width of the picture, and 1 for the rest.
inline Vector picture_units(const CellGrid& grid, int dim) {
    Vector unit = Vector::Ones(dim);
    for (int k = 0; k < 2; ++k)
        if (const CellAxis& axis = grid.axis(k); axis.coordinate < dim)
            unit[axis.coordinate] = axis.high - axis.low;
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
    /// From the flash `first` on.
    void start(MemberView& m, std::span<const double> x, int periods, int first = 0) const {
        std::copy(x.begin(), x.end(), m.x.begin());
        std::copy(p_.begin(), p_.end(), m.p.begin());
        m.t0 = t0_ + first * T_;
        m.t_end = t0_ + (first + periods) * T_;
    }
    static std::span<const double> view(const Vector& x) {
        return {x.data(), std::size_t(x.size())};
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

    void member(std::size_t id, MemberView& m) override { start(m, view(points_[id]), before_); }
    bool goes_on(std::size_t id, const OutcomeView& o) override {
        states[id].push_back(Eigen::Map<const Vector>(o.x.data(), Eigen::Index(o.x.size())));
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
        const Eigen::Index n = x.size();
        StrobeCycle c;
        Vector y = x;
        Matrix round = Matrix::Identity(n, n);
        for (int k = 0; k < period; ++k) {
            if (k > 0 && scaled(y - x) < 1e-9)
                break; // a shorter cycle, gone round more than once
            const Mapped m = strobe(system_, t0_, y, p_, 1);
            if (!m.ok() || m.singular)
                return std::nullopt;
            c.points.push_back(y);
            c.slopes.push_back(m.slope.topLeftCorner(n, n));
            round = c.slopes.back() * round;
            y = m.x;
        }
        c.residual = scaled(y - x);
        if (!round.allFinite())
            return std::nullopt;
        const Eigen::VectorXcd mu = round.eigenvalues();
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

/// Boxes that a non-periodic attractor visits.
class VisitedBoxes {
public:
    VisitedBoxes(const std::vector<Vector>& cloud, const Vector& unit) : unit_(unit) {
        for (const Vector& x : cloud)
            if (const auto k = key({x.data(), std::size_t(x.size())}))
                visited_.insert(*k);
    }
    bool holds(std::span<const double> x) const {
        const auto k = key(x);
        return k && visited_.contains(*k);
    }

private:
    static constexpr double boxes = 100; ///< along the width of the picture
    std::optional<std::uint64_t> key(std::span<const double> x) const {
        std::uint64_t k = 0xcbf29ce484222325u;
        for (std::size_t i = 0; i < x.size(); ++i) {
            const double box = std::floor(x[i] / unit_[Eigen::Index(i)] * boxes);
            if (!(std::abs(box) < 1e15))
                return std::nullopt;
            k = (k ^ static_cast<std::uint64_t>(static_cast<std::int64_t>(box))) * 0x100000001b3u;
        }
        return k;
    }
    Vector unit_;
    std::unordered_set<std::uint64_t> visited_; ///< hashes
};

/// Where a trajectory stands that is followed to its attractor.
struct Progress {
    std::int32_t periods = 0; ///< that are over
    std::int32_t box = 0;     ///< the non-periodic attractor that is visited, and how often
    std::int32_t in_box = 0;  ///< in a row
    std::int32_t time = -1;   ///< when it had landed
};

/// Tells whether trajectories have landed. Without allocations: it is asked once a period.
class Landings {
public:
    /// @param distance  from cycles, in units of the picture; 0: their ellipsoids
    /// @param strict    a tenth of the ellipsoids and ten times the visits, for an audit
    Landings(const std::vector<Attractor>& attractors, const Vector& unit, double distance,
             bool strict)
        : dim_(std::size_t(unit.size())), visits_(strict ? 200 : 20) {
        const Matrix scale = unit.cwiseInverse().asDiagonal();
        for (std::size_t a = 0; a < attractors.size(); ++a) {
            const Attractor& at = attractors[a];
            boxes_.emplace_back(at.cloud, unit);
            for (std::size_t k = 0; k < at.norms.size(); ++k) {
                const double bound = strict         ? std::min(at.radius / 10, 1e-4)
                                     : distance > 0 ? distance
                                                    : at.radius;
                if (!(bound > 0))
                    continue;
                const bool ball = !strict && distance > 0;
                const Matrix S =
                    scale *
                    (ball ? Matrix::Identity(unit.size(), unit.size()).eval() : at.norms[k]) *
                    scale / (bound * bound);
                labels_.push_back(std::int32_t(a + 1));
                const Vector& x = at.cycle.points[k];
                numbers_.insert(numbers_.end(), x.begin(), x.end());
                numbers_.insert(numbers_.end(), S.data(), S.data() + S.size());
            }
        }
    }

    /// The attractor, from 1, at which a trajectory is known to be by this flash; 0: none.
    std::int32_t visit(std::span<const double> x, Progress& at) const {
        const double* from = numbers_.data();
        for (std::size_t k = 0; k < labels_.size(); ++k, from += dim_ * (dim_ + 1))
            if (size(x, from) <= 1) {
                at.time = at.periods;
                return labels_[k];
            }
        for (std::size_t a = 0; a < boxes_.size(); ++a)
            if (boxes_[a].holds(x)) {
                const auto label = std::int32_t(a + 1);
                at.in_box = at.box == label ? at.in_box + 1 : 1;
                at.box = label;
                if (at.in_box < visits_)
                    return 0;
                at.time = at.periods - at.in_box + 1;
                return label;
            }
        at.in_box = 0;
        return 0;
    }

private:
    /// (x - c)' S (x - c) of the c and S that are stored there.
    double size(std::span<const double> x, const double* c) const {
        const double* S = c + dim_;
        double sum = 0;
        for (std::size_t i = 0; i < dim_; ++i) {
            double row = 0;
            for (std::size_t j = 0; j < dim_; ++j)
                row += S[i * dim_ + j] * (x[j] - c[j]);
            sum += (x[i] - c[i]) * row;
        }
        return sum;
    }

    const std::size_t dim_;
    const int visits_;
    std::vector<std::int32_t> labels_;
    std::vector<double> numbers_; ///< of each ellipsoid: centre, and S, for the bound 1
    std::vector<VisitedBoxes> boxes_;
};

/// Follows points to their attractors.
class Labelling : public Flashes {
public:
    Labelling(const AnySystem& system, const Vector& p, const BasinSettings& settings,
              const Landings& landings, std::vector<Progress> progress)
        : Flashes(system, p, settings), landings_(landings), most_(settings.periods),
          progress_(std::move(progress)) {}

    bool goes_on(std::size_t id, const OutcomeView& o) override {
        Progress& at = progress_[id];
        ++at.periods;
        const std::int32_t label = landings_.visit(o.x, at);
        if (label > 0)
            land(id, label, at);
        return label == 0 && at.periods < most_;
    }
    void take(std::size_t id, const OutcomeView& o) override {
        const bool in_between = o.status != Status::ok;
        periods_ += progress_[id].periods + in_between;
        if (progress_[id].time < 0)
            end(id, o);
    }
    long long periods() const { return periods_; }

protected:
    virtual void land(std::size_t id, std::int32_t label, const Progress& at) = 0;
    /// It has ended without; with the status `ok` after as many periods as it may take.
    virtual void end(std::size_t id, const OutcomeView& o) = 0;

private:
    const Landings& landings_;
    const int most_;
    std::vector<Progress> progress_;
    std::atomic<long long> periods_{0};
};

/// Both exit curves of a transition map, as cubics in the phase.
class ExitCurves {
public:
    explicit ExitCurves(const TransitionMap& map) {
        for (const int boundary : {-1, 1})
            for (int k = 0; k < n; ++k) {
                const auto e = map.exit_point({boundary, k * width});
                Node& node = nodes_[circle(boundary)][std::size_t(k)];
                for (int i = 0; e && i < 2; ++i) {
                    node.x[std::size_t(i)] = e->x[i];
                    node.slope[std::size_t(i)] = e->rate[i] * map.period() / n;
                }
            }
    }
    /// Whether a slide ended where the map has the end of slides at this phase. It may have ended
    /// on another branch of the curve, of which the map knows nothing.
    bool hold(const Transition& at, std::span<const double> x) const {
        const auto& nodes = nodes_[circle(at.boundary)];
        const auto k = std::min(std::size_t(at.phase / width), std::size_t(n - 1));
        const Node &a = nodes[k], &b = nodes[(k + 1) % n];
        const double u = at.phase / width - double(k), v = 1 - u;
        double apart = 0, size = 1;
        for (std::size_t i = 0; i < 2; ++i) {
            const double rise = b.x[i] - a.x[i];
            const double on =
                a.x[i] + v * v * u * a.slope[i] + u * u * ((1 + 2 * v) * rise - v * b.slope[i]);
            apart += std::abs(x[i] - on);
            size += std::abs(on);
        }
        return apart <= 1e-6 * size;
    }

private:
    static constexpr int n = 256;
    static constexpr double width = TransitionMap::turn / n;
    static constexpr double nan = std::numeric_limits<double>::quiet_NaN();
    struct Node {
        std::array<double, 2> x{nan, nan}, slope{nan, nan}; ///< by u = phase / width
    };
    std::array<std::array<Node, std::size_t(n)>, 2> nodes_;
};

} // namespace detail

/// Finds what there is to fall to, and labels.
///
/// 1. The quotient is built, if it is to be used. 2. Every centre is mapped by one period: the
/// plain cell map. 3. Runs from random cells, from its groups and from the quotient's attractors
/// settle; Newton's method makes cycles of their ends. 4. Each is fenced in. 5. Every cell is
/// followed on from its image until it is inside a fence, or to its next exit from stick to slip,
/// which is looked up. 6. Random cells are followed on, to compare.
///
/// The result is the same for any number of threads, to the last bit in one build.
class BasinFinder {
public:
    /// @param system, lanes  of the same model; they must outlive the finder
    /// @error std::invalid_argument for a system that is not forced, or settings, parameters or a
    ///        grid that make no sense
    BasinFinder(const AnySystem& system, const AnyLanes& lanes, const CellGrid& grid, Vector p,
                BasinSettings settings = {})
        : system_(system), lanes_(lanes), grid_(grid), p_(std::move(p)),
          settings_(std::move(settings)), unit_(detail::picture_units(grid, system.dim())) {
        validate();
    }

    /// The whole picture.
    /// @error std::invalid_argument where the quotient is wanted (`always`) and does not apply
    /// @cost  a period a cell, and as many as it takes until it has landed or left a slide; memory
    ///        29 + 8 dim bytes a cell
    Basins run() {
        const auto n = std::size_t(grid_.cells());
        Basins basins{.grid = grid_};
        basins.label.assign(n, 0);
        basins.status.assign(n, Status::interrupted);
        if (settings_.times)
            basins.time.assign(n, -1);
        const Quotient quotient = build_quotient(basins);
        Images images(*this, basins.status);
        plain(basins, images);
        find(basins, quotient);
        label(basins, quotient, images);
        audit(basins);
        basins.unresolved = std::count(basins.label.begin(), basins.label.end(), 0);
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
        const auto& escape = settings_.escape;
        if (!(escape.empty() || escape.size() == std::size_t(dim)))
            detail::refuse("escape.size()", double(escape.size()), "expected dim entries, or none");
        for (const double bound : escape)
            if (!(bound > 0))
                detail::refuse("escape", bound, "expected numbers > 0");
        if (settings_.quotient == UseQuotient::always && settings_.times)
            throw std::invalid_argument("filippov: times = true: expected false where the quotient "
                                        "is always used, which does not know times");
    }

    // --- what all parts ask --------------------------------------------------------------------

    bool cancelled() const {
        const auto& ask = settings_.parallel.cancelled;
        return system_.interrupted() || (ask && ask());
    }
    /// Asked between runs of the scalar engine, on the calling thread.
    bool stopped(Basins& basins) const {
        if (basins.state == Status::ok && cancelled())
            basins.state = Status::interrupted;
        return basins.state != Status::ok;
    }
    PopulationRun run_lanes(Basins& basins, std::size_t n, AnyPopulation& population,
                            const EnsembleSettings& how, const Parallel& parallel) const {
        if (n == 0 || stopped(basins))
            return {basins.state, {}};
        const PopulationRun run = lanes_.run(n, population, how, parallel);
        basins.state = run.status;
        return run;
    }
    /// The runs of cells. `done`: progress before them.
    void run_cells(Basins& basins, std::size_t n, AnyPopulation& population,
                   std::size_t done) const {
        Parallel parallel = settings_.parallel;
        const std::size_t all = 2 * basins.label.size();
        if (parallel.progress)
            parallel.progress = [&, done, all](std::size_t more, std::size_t) {
                settings_.parallel.progress(done + more, all);
            };
        const PopulationRun run = run_lanes(basins, n, population, settings_.run, parallel);
        if (n > 0)
            basins.counters += run.counters;
    }
    /// Other runs, which show no progress.
    void run_points(Basins& basins, std::size_t n, AnyPopulation& population,
                    const EnsembleSettings& how) const {
        Parallel parallel = settings_.parallel;
        parallel.progress = nullptr;
        run_lanes(basins, n, population, how, parallel);
    }
    std::span<const double> view(const Vector& x) const {
        return {x.data(), std::size_t(x.size())};
    }
    double apart(const Vector& a, const Vector& b) const {
        return (a - b).cwiseQuotient(unit_).norm();
    }

    // --- the quotient --------------------------------------------------------------------------

    /// What cells are looked up in.
    struct Quotient {
        std::optional<TransitionMap> map;
        std::optional<detail::ExitCurves> curves;
        std::vector<Vector> flashed; ///< a state of each of its attractors when the strobe flashes
    };

    Quotient build_quotient(Basins& basins) const {
        Quotient q;
        if (settings_.quotient == UseQuotient::never)
            basins.by_exit_reason = "It was not asked for.";
        else if (settings_.times)
            basins.by_exit_reason = "It does not know times, which are asked for.";
        else if (const auto can = quotient_applies(system_, p_, settings_.transition); !can)
            basins.by_exit_reason = can.reason;
        else
            fill(q, basins);
        if (settings_.quotient == UseQuotient::always && !basins.by_exit && !stopped(basins))
            throw std::invalid_argument("filippov: quotient = always: " + basins.by_exit_reason);
        return q;
    }
    void fill(Quotient& q, Basins& basins) const {
        q.map.emplace(system_, p_, settings_.transition);
        basins.exits = exit_basins(*q.map, settings_.exits);
        if (basins.exits.status == Status::interrupted)
            basins.state = Status::interrupted;
        // `ambiguous`: some phases are not resolved, which then are followed
        basins.by_exit =
            basins.exits.status == Status::ok || basins.exits.status == Status::ambiguous;
        basins.by_exit_reason = basins.exits.message;
        q.curves.emplace(*q.map);
        for (const MapAttractor& a : basins.exits.attractors)
            q.flashed.push_back(at_flash(*q.map, a));
    }
    /// A point of an attractor of the transition map, when the strobe flashes next; NaN if a run to
    /// there fails.
    Vector at_flash(const TransitionMap& map, const MapAttractor& a) const {
        const Vector none = Vector::Constant(2, std::numeric_limits<double>::quiet_NaN());
        const Transition at = a.periodic ? a.orbit.points.front() : some_phase(a);
        const auto exit = map.exit_point(at);
        if (!exit)
            return none;
        const double t = map.time_of(at.phase), T = map.period(), since = t - settings_.t0;
        const Leg leg{.t0 = t,
                      .x = exit->x,
                      .t_end = settings_.t0 + T * (std::floor(since / T) + 1),
                      .boundary = at.boundary};
        const Journey journey = system_.journey(leg, p_, {});
        return journey.status == Status::ok ? Vector(journey.end.value.head(2)) : none;
    }
    static Transition some_phase(const MapAttractor& a) {
        for (const int boundary : {-1, 1}) {
            const auto& cells = a.cells[detail::circle(boundary)];
            const auto visited = std::find(cells.begin(), cells.end(), true);
            if (visited != cells.end())
                return {boundary, TransitionMap::turn * (double(visited - cells.begin()) + 0.5) /
                                      double(cells.size())};
        }
        return {};
    }

    // --- plain cell mapping --------------------------------------------------------------------

    /// Images of all cells after one period.
    class Images final : public detail::Flashes {
    public:
        std::vector<std::int32_t> cell;
        std::vector<double> states; ///< shape (cells, dim)

        Images(const BasinFinder& f, std::vector<Status>& status)
            : Flashes(f.system_, f.p_, f.settings_), cell(status.size(), CellGrid::unresolved),
              states(status.size() * std::size_t(f.unit_.size())), f_(f), status_(status) {}
        std::span<const double> state(std::size_t id) const {
            const auto dim = std::size_t(f_.unit_.size());
            return {states.data() + id * dim, dim};
        }
        void member(std::size_t id, MemberView& m) override {
            const Vector& rest = f_.settings_.rest;
            start(m, f_.view(rest), 1);
            f_.put(f_.grid_.centre(std::int32_t(id)), m.x);
        }
        void take(std::size_t id, const OutcomeView& o) override {
            status_[id] = o.status;
            std::copy(o.x.begin(), o.x.end(), states.begin() + std::ptrdiff_t(id * o.x.size()));
            if (o.status == Status::escaped)
                cell[id] = CellGrid::sink;
            if (o.status == Status::ok)
                cell[id] = f_.grid_.cell_of(o.x[std::size_t(f_.grid_.axis(0).coordinate)],
                                            o.x[std::size_t(f_.grid_.axis(1).coordinate)]);
        }

    private:
        const BasinFinder& f_;
        std::vector<Status>& status_;
    };
    void put(const std::array<double, 2>& point, std::span<double> x) const {
        for (int k = 0; k < 2; ++k)
            x[std::size_t(grid_.axis(k).coordinate)] = point[std::size_t(k)];
    }
    void plain(Basins& basins, Images& images) const {
        run_cells(basins, images.cell.size(), images, 0);
        basins.plain = cell_map(grid_, images.cell);
    }

    // --- attractors and saddles ----------------------------------------------------------------

    using States = std::vector<Vector>;
    /// Boxes of the attractors that are not periodic.
    using Clouds = std::vector<detail::VisitedBoxes>;

    void find(Basins& basins, const Quotient& quotient) const {
        const std::vector<CellGroup> groups = largest_groups(basins.plain);
        States points = seeds();
        for (const CellGroup& g : groups)
            points.push_back(state(grid_.centre(g.cells.front())));
        for (const Vector& x : quotient.flashed)
            if (x.allFinite())
                points.push_back(x);
        detail::Followed ends(system_, p_, settings_, points, settings_.settle,
                              settings_.longest + 1);
        run_points(basins, points.size(), ends, settings_.run);
        const detail::CycleNewton newton(system_, p_, settings_.t0, unit_);
        Clouds clouds;
        for (std::size_t k = 0; k < points.size() && !stopped(basins); ++k)
            if (ends.status[k] == Status::ok)
                add_end(basins, newton, clouds, ends.states[k]);
        find_saddles(basins, newton, groups);
        sort(basins);
        for (Attractor& a : basins.attractors)
            fence_in(a, basins);
    }
    States seeds() const {
        std::mt19937_64 random(settings_.seed);
        States points;
        for (int k = 0; k < settings_.seeds; ++k)
            points.push_back(
                state(grid_.centre(std::int32_t(random() % std::uint64_t(grid_.cells())))));
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
                           [&](const Vector& y) { return apart(x, y) <= distance; });
    }
    bool known_cycle(const Basins& basins, const Vector& x) const {
        return std::any_of(basins.attractors.begin(), basins.attractors.end(),
                           [&](const Attractor& a) { return on_cycle(a.cycle, x, 1e-7); });
    }
    /// The end of a run lies on what is known: all of it as near to a cycle as errors of a run
    /// leave it, or most of it in the boxes of what is no cycle.
    bool known(const Basins& basins, const Clouds& clouds, const States& states) const {
        const auto stays_at = [&](const Attractor& a) {
            return std::all_of(states.begin(), states.end(),
                               [&](const Vector& x) { return on_cycle(a.cycle, x, 1e-5); });
        };
        const auto mostly_in = [&](const detail::VisitedBoxes& boxes) {
            const auto inside = std::count_if(states.begin(), states.end(), [&](const Vector& x) {
                return boxes.holds(view(x));
            });
            return 2 * std::size_t(inside) > states.size();
        };
        return std::any_of(basins.attractors.begin(), basins.attractors.end(), stays_at) ||
               std::any_of(clouds.begin(), clouds.end(), mostly_in);
    }
    /// The stable cycle that the end of a run has come to.
    std::optional<StrobeCycle> settled_on(const detail::CycleNewton& newton,
                                          const States& states) const {
        for (std::size_t q = 1; q < states.size(); ++q) {
            const double gap = apart(states.back(), states[states.size() - 1 - q]);
            if (!(gap < 1e-2))
                continue;
            const auto cycle = newton(states.back(), int(q));
            if (!cycle || !cycle->stable())
                continue;
            // of gaps that shrink by the multiplier, all that are to come
            const double to_come = gap / (1 - std::abs(cycle->multipliers.front()));
            if (on_cycle(*cycle, states.back(), std::min(4 * to_come + 1e-9, 0.05)))
                return cycle;
        }
        return std::nullopt;
    }
    /// What a run has come to, if it is new: a cycle, or after a much longer run what is none.
    void add_end(Basins& basins, const detail::CycleNewton& newton, Clouds& clouds,
                 const States& states) const {
        constexpr int longer = 4000;
        constexpr std::size_t most_clouds = 8;
        if (known(basins, clouds, states) || add_cycle(basins, newton, states) ||
            clouds.size() >= most_clouds)
            return;
        const States from{states.back()};
        detail::Followed on(system_, p_, settings_, from, 1, longer + int(states.size()));
        run_points(basins, 1, on, settings_.run);
        if (basins.state != Status::ok || on.status.front() != Status::ok)
            return;
        States& cloud = on.states.front();
        const States last(cloud.end() - std::ptrdiff_t(states.size()), cloud.end());
        if (known(basins, clouds, last) || add_cycle(basins, newton, last))
            return;
        clouds.emplace_back(cloud, unit_);
        basins.attractors.push_back({.periodic = false, .cloud = std::move(cloud)});
    }
    bool add_cycle(Basins& basins, const detail::CycleNewton& newton, const States& states) const {
        const auto cycle = settled_on(newton, states);
        if (cycle && !known_cycle(basins, cycle->points.front()))
            basins.attractors.push_back({.periodic = true, .cycle = *cycle});
        return cycle.has_value();
    }
    void find_saddles(Basins& basins, const detail::CycleNewton& newton,
                      const std::vector<CellGroup>& groups) const {
        const auto look = [&](const Vector& x, int period) {
            if (stopped(basins))
                return;
            const auto cycle = newton(x, period);
            const auto same = [&](const StrobeCycle& s) {
                return on_cycle(s, cycle->points.front(), 1e-7);
            };
            if (cycle && !cycle->stable() && in_picture(*cycle) &&
                std::none_of(basins.saddles.begin(), basins.saddles.end(), same))
                basins.saddles.push_back(*cycle);
        };
        for (const CellGroup& g : groups)
            if (g.period <= settings_.longest)
                look(state(grid_.centre(g.cells.front())), g.period);
        std::vector<int> periods{1};
        for (const Attractor& a : basins.attractors)
            if (a.periodic)
                periods.push_back(a.cycle.period());
        std::sort(periods.begin(), periods.end());
        periods.erase(std::unique(periods.begin(), periods.end()), periods.end());
        for (const int period : periods) {
            // as many periods are run for each
            const int side = int(std::sqrt(double(settings_.newtons) / period));
            for (int i = 0; i < side; ++i)
                for (int j = 0; j < side; ++j)
                    look(state({between(0, (i + 0.5) / side), between(1, (j + 0.5) / side)}),
                         period);
        }
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

    /// The largest ellipsoids, of sizes tried downwards, that P^period is seen to map well into
    /// themselves: points on many shells in many directions must all come nearer. No other cycle,
    /// nor half the way to it, is inside.
    void fence_in(Attractor& a, Basins& basins) const {
        if (!a.periodic)
            return;
        const Matrix to = unit_.asDiagonal(), from = unit_.cwiseInverse().asDiagonal();
        const double rate = (1 + std::abs(a.cycle.multipliers.front())) / 2;
        const auto& slopes = a.cycle.slopes;
        for (std::size_t k = 0; k < slopes.size(); ++k) {
            Matrix round = slopes[k];
            for (std::size_t j = 1; j < slopes.size(); ++j)
                round = slopes[(k + j) % slopes.size()] * round;
            a.norms.push_back(detail::contracting_norm(from * round * to, rate));
        }
        const double most = std::min(0.25, 0.5 * distance_to_others(a, basins));
        for (double radius = most; radius > 1e-7 && !stopped(basins); radius *= 0.7)
            if (draws_together(a, radius, (1 + rate) / 2, basins)) {
                a.radius = radius;
                return;
            }
    }
    bool draws_together(const Attractor& a, double radius, double rate, Basins& basins) const {
        for (const double shell : {1.0, 0.05, 0.8, 0.6, 0.4, 0.2}) // those that tell most first
            if (!shell_shrinks(a, shell * radius, rate, basins))
                return false;
        return true;
    }
    double size_at(const Attractor& a, std::size_t k, const Vector& v) const {
        return std::sqrt(v.dot(a.norms[k] * v));
    }
    /// From the points of a cycle, in its norms.
    double distance_to_others(const Attractor& a, const Basins& basins) const {
        double nearest = std::numeric_limits<double>::infinity();
        const auto look = [&](const States& points) {
            for (std::size_t k = 0; k < a.norms.size(); ++k)
                for (const Vector& x : points)
                    nearest = std::min(nearest,
                                       size_at(a, k, (x - a.cycle.points[k]).cwiseQuotient(unit_)));
        };
        for (const Attractor& other : basins.attractors)
            if (&other != &a)
                look(other.periodic ? other.cycle.points : other.cloud);
        for (const StrobeCycle& saddle : basins.saddles)
            look(saddle.points);
        return nearest;
    }
    bool shell_shrinks(const Attractor& a, double size, double rate, Basins& basins) const {
        const int dim = system_.dim(), period = a.cycle.period(),
                  directions = std::max(96 / period, 8);
        std::mt19937_64 random(settings_.seed);
        States points;
        for (std::size_t k = 0; k < a.norms.size(); ++k)
            for (int d = 0; d < directions; ++d) {
                const Vector v = direction(d, directions, dim, random);
                points.push_back(a.cycle.points[k] +
                                 Vector(size / size_at(a, k, v) * v.cwiseProduct(unit_)));
            }
        detail::Followed run(system_, p_, settings_, points, period, 1);
        run_points(basins, points.size(), run, tight());
        for (std::size_t n = 0; n < points.size(); ++n) {
            if (run.status[n] != Status::ok)
                return false;
            const std::size_t k = n / std::size_t(directions);
            const Vector v = (run.states[n].back() - a.cycle.points[k]).cwiseQuotient(unit_);
            if (!(size_at(a, k, v) <= rate * size))
                return false;
        }
        return true;
    }
    /// On the way round a long cycle errors of the runs grow: they must not hide the contraction.
    EnsembleSettings tight() const {
        EnsembleSettings s = settings_.run;
        s.rtol = std::min(s.rtol, 1e-12);
        for (double& atol : s.atol)
            atol = std::min(atol, 1e-13);
        return s;
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

    /// Cells on their way from their images.
    class Cells final : public detail::Labelling {
    public:
        enum Exit : char { none, unknown, looked_up };
        std::vector<Exit> exit; ///< what the quotient said of each

        /// @param quotient  looks exits up; null: cells are followed until they have landed
        Cells(const BasinFinder& f, Basins& basins, const Images& images,
              const std::vector<std::int32_t>& cells, std::vector<detail::Progress> progress,
              const detail::Landings& landings, const Quotient* quotient)
            : Labelling(f.system_, f.p_, f.settings_, landings, std::move(progress)),
              exit(cells.size(), none), basins_(basins), images_(images), cells_(cells),
              quotient_(quotient) {
            ends_at_exit = quotient != nullptr;
        }
        void member(std::size_t id, MemberView& m) override {
            start(m, images_.state(cell(id)), 1, 1);
        }

    protected:
        void land(std::size_t id, std::int32_t label, const detail::Progress& at) override {
            BasinFinder::land(basins_, cell(id), label, at.time);
        }
        void end(std::size_t id, const OutcomeView& o) override {
            if (o.status == Status::event)
                look_up(id, o);
            else
                BasinFinder::lose(basins_, cell(id), o.status);
        }

    private:
        std::size_t cell(std::size_t id) const { return std::size_t(cells_[id]); }
        void look_up(std::size_t id, const OutcomeView& o) {
            // nearer to an end than a run is exact
            constexpr double too_near = 1e-6;
            const double turns = o.clock.local / o.clock.period;
            const Transition at{o.mode, TransitionMap::wrapped(turns * TransitionMap::turn)};
            const bool on = (o.mode == -1 || o.mode == 1) && quotient_->curves->hold(at, o.x);
            const ExitLabel label = on ? basins_.exits.at(at) : ExitLabel{};
            const std::int32_t found = label.attractor > 0 && label.distance > too_near
                                           ? basins_.exit_label[std::size_t(label.attractor - 1)]
                                           : 0;
            exit[id] = found > 0 ? looked_up : unknown;
            if (found > 0)
                BasinFinder::land(basins_, cell(id), found, -1);
        }
        Basins& basins_;
        const Images& images_;
        const std::vector<std::int32_t>& cells_;
        const Quotient* quotient_;
    };
    static void land(Basins& basins, std::size_t cell, std::int32_t label, std::int32_t time) {
        basins.label[cell] = label;
        basins.status[cell] = Status::ok;
        if (!basins.time.empty())
            basins.time[cell] = time;
    }
    static void lose(Basins& basins, std::size_t cell, Status status) {
        basins.label[cell] = status == Status::escaped ? -1 : 0;
        basins.status[cell] = status == Status::ok ? Status::not_converged : status;
    }

    void label(Basins& basins, const Quotient& quotient, const Images& images) const {
        if (stopped(basins))
            return std::fill(basins.status.begin(), basins.status.end(), Status::interrupted);
        const detail::Landings landings(basins.attractors, unit_, settings_.distance, false);
        if (basins.by_exit)
            basins.exit_label = follow(basins, quotient.flashed, landings);
        basins.periods = grid_.cells();
        std::vector<std::int32_t> open;
        std::vector<detail::Progress> progress;
        begin(basins, images, landings, open, progress);
        if (basins.by_exit)
            label_open(basins, images, landings, &quotient, open, progress);
        label_open(basins, images, landings, nullptr, open, progress);
    }
    /// Labels what has landed after no period or one, and lists the rest.
    void begin(Basins& basins, const Images& images, const detail::Landings& landings,
               std::vector<std::int32_t>& open, std::vector<detail::Progress>& progress) const {
        Vector x = settings_.rest;
        for (std::size_t cell = 0; cell < basins.label.size(); ++cell) {
            detail::Progress at;
            put(grid_.centre(std::int32_t(cell)), {x.data(), std::size_t(x.size())});
            std::int32_t label = landings.visit(view(x), at);
            if (label == 0 && basins.status[cell] == Status::ok) {
                ++at.periods;
                label = landings.visit(images.state(cell), at);
            }
            if (label > 0) {
                land(basins, cell, label, at.time);
            } else if (basins.status[cell] != Status::ok || at.periods >= settings_.periods) {
                lose(basins, cell, basins.status[cell]);
            } else {
                open.push_back(std::int32_t(cell));
                progress.push_back(at);
            }
        }
    }
    /// Labels cells, and keeps those in the list that it could not look up.
    void label_open(Basins& basins, const Images& images, const detail::Landings& landings,
                    const Quotient* quotient, std::vector<std::int32_t>& open,
                    std::vector<detail::Progress>& progress) const {
        for (const std::int32_t cell : open)
            basins.status[std::size_t(cell)] = Status::interrupted;
        Cells cells(*this, basins, images, open, progress, landings, quotient);
        run_cells(basins, open.size(), cells, 2 * basins.label.size() - open.size());
        // their images are counted
        basins.periods += cells.periods() - static_cast<long long>(open.size());
        basins.looked_up += std::count(cells.exit.begin(), cells.exit.end(), Cells::looked_up);
        std::vector<std::int32_t> left;
        std::vector<detail::Progress> left_at;
        for (std::size_t k = 0; k < open.size(); ++k)
            if (cells.exit[k] == Cells::unknown) {
                left.push_back(open[k]);
                left_at.push_back(progress[k]);
            }
        open = std::move(left);
        progress = std::move(left_at);
    }

    /// Points and their labels, each by its own trajectory.
    class Points final : public detail::Labelling {
    public:
        std::vector<std::int32_t> label;

        Points(const BasinFinder& f, const States& points, const detail::Landings& landings)
            : Labelling(f.system_, f.p_, f.settings_, landings,
                        std::vector<detail::Progress>(points.size())),
              label(points.size(), 0), points_(points) {}
        void member(std::size_t id, MemberView& m) override {
            const Vector& x = points_[id];
            start(m, {x.data(), std::size_t(x.size())}, 1);
        }

    protected:
        void land(std::size_t id, std::int32_t found, const detail::Progress&) override {
            label[id] = found;
        }
        void end(std::size_t id, const OutcomeView& o) override {
            if (o.status == Status::escaped)
                label[id] = -1;
        }

    private:
        const States& points_;
    };
    std::vector<std::int32_t> follow(Basins& basins, const States& points,
                                     const detail::Landings& landings) const {
        Points run(*this, points, landings);
        run_points(basins, points.size(), run, settings_.run);
        return run.label;
    }
    void audit(Basins& basins) const {
        if (stopped(basins))
            return;
        std::mt19937_64 random(settings_.seed + 1);
        std::vector<std::size_t> cells;
        States points;
        for (int k = 0; k < settings_.audit; ++k) {
            cells.push_back(std::size_t(random() % std::uint64_t(grid_.cells())));
            points.push_back(state(grid_.centre(std::int32_t(cells.back()))));
        }
        const detail::Landings strict(basins.attractors, unit_, settings_.distance, true);
        const std::vector<std::int32_t> label = follow(basins, points, strict);
        if (basins.state != Status::ok)
            return;
        basins.audited = settings_.audit;
        for (std::size_t k = 0; k < cells.size(); ++k)
            basins.disagreements += label[k] != basins.label[cells[k]];
    }

    // --- the plain map, checked ----------------------------------------------------------------

    void check(Basins& basins) const {
        const std::size_t n = basins.plain.groups.size(), columns = basins.attractors.size() + 2;
        for (std::size_t g = 0; g < n + 2; ++g) {
            basins.confusion.push_back({.group = g < n    ? std::int32_t(g)
                                                 : g == n ? CellGrid::sink
                                                          : CellGrid::unresolved});
            basins.confusion.back().cells.assign(columns, 0);
        }
        for (std::size_t c = 0; c < basins.label.size(); ++c) {
            const std::int32_t group = basins.plain.group[c];
            const std::size_t k = group >= 0                ? std::size_t(group)
                                  : group == CellGrid::sink ? n
                                                            : n + 1;
            ++basins.confusion[k].cells[std::size_t(basins.label[c] + 1)];
        }
        for (std::size_t a = 0; a < basins.attractors.size(); ++a)
            if (const auto g = group_at(basins, basins.attractors[a])) {
                GroupCheck& row = basins.confusion[*g];
                if (row.attractor == 0 ||
                    row.cells[a + 2] > row.cells[std::size_t(row.attractor + 1)])
                    row.attractor = std::int32_t(a + 1);
            }
    }
    /// The group that stands for an attractor.
    std::optional<std::size_t> group_at(const Basins& basins, const Attractor& a) const {
        std::optional<std::size_t> best;
        for (std::size_t g = 0; g < basins.plain.groups.size(); ++g)
            if ((!best || basins.plain.groups[g].basin > basins.plain.groups[*best].basin) &&
                is_at(basins.plain.groups[g], a))
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
