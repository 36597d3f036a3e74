// SPDX-License-Identifier: BSD-3-Clause
// A picture of the states of a forced system when the strobe flashes, and runs from its points.
#pragma once

#include <filippov/basins/cells.hpp>
#include <filippov/basins/detail/exit_basins.hpp>
#include <filippov/ensemble/any_lanes.hpp>
#include <filippov/orbits/discrete.hpp>
#include <filippov/orbits/maps.hpp>
#include <filippov/orbits/system_interface.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace filippov {

/// Whether cells are labelled by an exit from stick to slip, looked up (quotient.hpp).
enum class UseQuotient : unsigned char {
    automatic, ///< where it applies, and no times are wanted
    never,
    always, ///< else the run is refused, with the reason
};

/// What a picture of basins is told.
struct BasinSettings {
    RunSettings run{};
    /// When trajectories start, and the strobe flashes. Where the state jumps whenever it flashes
    /// it does so a little later: a millionth of a period, if nothing jumps then.
    double t0 = 0;
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

namespace detail {

inline std::span<const double> view(const Vector& x) { return {x.data(), std::size_t(x.size())}; }
/// Runs that are to be much more exact than what is judged by them.
inline RunSettings tightened(RunSettings run) {
    run.rtol = std::min(run.rtol, 1e-12);
    for (double& atol : run.atol)
        atol = std::min(atol, 1e-13);
    return run;
}
inline BasinSettings tightened(BasinSettings settings) {
    settings.run = tightened(std::move(settings.run));
    return settings;
}

/// What all parts of a picture ask.
class StrobePicture {
public:
    /// @error std::invalid_argument for a system that is not forced, or settings, parameters or a
    ///        grid that make no sense
    StrobePicture(const AnySystem& of, const AnyLanes& in, const CellGrid& over, Vector params,
                  BasinSettings given)
        : system(of), lanes(in), grid(over), p(std::move(params)), settings(std::move(given)),
          unit(Vector::Ones(system.dim())) {
        validate();
        T = require_period(system, p).value;
        constant = constant_components(system, settings.t0, samples(), p);
        if (unit.size() > 2 || has_jumps(system))
            measure();
        for (int k = 0; k < 2; ++k)
            unit[grid.axis(k).coordinate] = grid.axis(k).high - grid.axis(k).low;
        refuse_clocks();
    }

    /// The state of a point of the picture.
    Vector state(const std::array<double, 2>& point) const {
        Vector x = settings.rest;
        put(point, {x.data(), std::size_t(x.size())});
        return x;
    }
    /// The two coordinates of a state that the picture has.
    void put(const std::array<double, 2>& point, std::span<double> x) const {
        for (int k = 0; k < 2; ++k)
            x[std::size_t(grid.axis(k).coordinate)] = point[std::size_t(k)];
    }
    /// When the strobe flashes first.
    double first_flash() const { return settings.t0 + shift; }
    /// Where a start is then; none if the run there fails.
    std::optional<Vector> at_first_flash(const Vector& x) const {
        if (shift == 0)
            return x;
        const History h = system.run(settings.t0, x, first_flash(), p);
        return h.status == Status::ok ? std::optional(h.x) : std::nullopt;
    }
    std::int32_t cell_of(std::span<const double> x) const {
        return grid.cell_of(x[std::size_t(grid.axis(0).coordinate)],
                            x[std::size_t(grid.axis(1).coordinate)]);
    }
    /// In units of the picture.
    double apart(const Vector& a, const Vector& b) const {
        return (a - b).cwiseQuotient(unit).norm();
    }
    bool cancelled() const {
        const auto& ask = settings.parallel.cancelled;
        return system.interrupted() || (ask && ask());
    }
    /// @param state  nothing is run unless it is `ok`; `interrupted` afterwards if the run was
    LaneCounters run(std::size_t n, AnyPopulation& population, const RunSettings& how,
                     const Parallel& parallel, Status& state) const {
        if (n == 0 || stopped(state))
            return {};
        const PopulationRun run = lanes.run(n, population, how, parallel);
        state = run.status;
        return run.counters;
    }
    /// The same without progress.
    void run(std::size_t n, AnyPopulation& population, const RunSettings& how,
             Status& state) const {
        Parallel parallel = settings.parallel;
        parallel.progress = nullptr;
        run(n, population, how, parallel, state);
    }
    /// Asked between runs of the scalar engine, on the calling thread.
    bool stopped(Status& state) const {
        if (state == Status::ok && cancelled())
            state = Status::interrupted;
        return state != Status::ok;
    }

    const AnySystem& system;
    const AnyLanes& lanes;
    const CellGrid grid;
    const Vector p;
    BasinSettings settings;
    /// Of length, of each coordinate: the width of the picture, and of those that it does not have
    /// the range of their values at the flashes of some runs.
    Vector unit;
    double T = 0; ///< the period of the forcing
    std::vector<int>
        constant;     ///< components of constant rate: clocks and latches may be among them
    double shift = 0; ///< of the flashes, to times at which nothing jumps

private:
    /// Sixteen points of the picture.
    std::vector<Vector> samples() const {
        std::vector<Vector> points;
        for (int k = 0; k < 16; ++k) {
            const auto at = [&](int axis, int i) {
                const CellAxis& a = grid.axis(axis);
                return a.low + (a.high - a.low) * (i + 0.5) / 4;
            };
            points.push_back(state({at(0, k / 4), at(1, k % 4)}));
        }
        return points;
    }
    /// The median of the ranges over ten periods, from sixteen points of the picture.
    void measure() {
        std::vector<Vector> ranges, sizes;
        std::vector<double> phases; // of jumps, but for those of the first period
        for (const Vector& start : samples()) {
            Vector x = start, low = x, high = x;
            Status status = Status::ok;
            for (int n = 0; n < 10 && status == Status::ok && !cancelled(); ++n) {
                const History turn = system.run(settings.t0, x, settings.t0 + T, p);
                status = turn.status;
                x = turn.x;
                for (const Happening& e : turn.events)
                    if (e.kind == EventKind::jump && (n > 0 || e.t > settings.t0 + T / 2))
                        phases.push_back((e.t - settings.t0) / T);
                low = low.cwiseMin(x);
                high = high.cwiseMax(x);
            }
            if (status != Status::ok)
                continue;
            ranges.push_back(high - low);
            sizes.push_back(low.cwiseAbs().cwiseMax(high.cwiseAbs()));
        }
        for (Eigen::Index i = 0; !ranges.empty() && i < unit.size(); ++i) {
            const auto median = [i](std::vector<Vector>& all) {
                std::ranges::sort(all, {}, [i](const Vector& v) { return v[i]; });
                return all[all.size() / 2][i];
            };
            // what hardly moves has its size for a unit
            const double range = median(ranges), size = median(sizes);
            const double length = range > 1e-3 * size ? range : size;
            unit[i] = length > 0 && std::isfinite(length) ? length : 1;
        }
        measure_clocks(sizes);
        move_flashes(phases);
    }
    /// At the flashes a clock always shows the same: its unit is what it moves between them.
    void measure_clocks(const std::vector<Vector>& sizes) {
        const Vector rate = system.field(region(), settings.t0, settings.rest, p);
        for (const int i : constant) {
            double length = std::abs(rate[i]) * T;
            for (const Vector& size : sizes)
                length = std::max(length, size[i]);
            unit[i] = length > 0 && std::isfinite(length) ? length : 1;
        }
    }
    /// The mode of the region where all h are positive.
    int region() const {
        int mode = 0;
        for (int j = 0; j < system.surfaces(); ++j)
            mode = 3 * mode + 1;
        return mode;
    }
    /// Of a state that jumps when the strobe flashes it would depend on rounding whether it is that
    /// before or after: the flashes come a little later.
    /// @param phases  of jumps, in periods
    void move_flashes(const std::vector<double>& phases) {
        const auto apart = [&](double phase) { // of the jumps
            double least = 1;
            for (const double each : phases) {
                const double d = each - phase - std::floor(each - phase);
                least = std::min({least, d, 1 - d});
            }
            return least;
        };
        if (apart(0) > 1e-9)
            return;
        for (double later = 1e-6; later < 0.2; later *= 3)
            if (apart(later) > later / 2) {
                shift = later * T;
                return;
            }
        refuse("t0", settings.t0,
               "expected a time at which the state does not jump, nor a period later");
    }
    /// A coordinate of the picture that is a clock has attractors of its own for each value.
    void refuse_clocks() const {
        for (int axis = 0; axis < 2; ++axis) {
            const int i = grid.axis(axis).coordinate;
            if (std::find(constant.begin(), constant.end(), i) != constant.end() && is_clock(i))
                refuse("grid.axis(" + std::to_string(axis) + ").coordinate", i,
                       "expected no clock: its rate is constant, and jumps shift it by constants, "
                       "so that every value has attractors of its own. Set it by rest");
        }
    }
    /// True if component i runs, some maps set it back, and all leave it what it is but for a
    /// constant.
    bool is_clock(int i) const {
        int maps = 0;
        constexpr int periods = 3;
        const double run = system.field(region(), settings.t0, settings.rest, p)[i] * periods * T;
        const Eigen::Index d = unit.size();
        for (const Vector& start : samples()) {
            const auto x = at_first_flash(start);
            if (!x || cancelled())
                continue;
            const Mapped m = strobe(system, first_flash(), *x, p, periods);
            if (!m.ok() || m.singular)
                continue;
            const DiscretePart part = discrete_part(m.slope.topLeftCorner(d, d), constant);
            const auto at = std::find(part.discrete.begin(), part.discrete.end(), i);
            if (at == part.discrete.end() ||
                !part.neutral()[std::size_t(at - part.discrete.begin())])
                return false;
            maps += std::abs(m.x[i] - (*x)[i] - run) > 0.5 * std::abs(run);
        }
        return maps > 0;
    }
    void validate() {
        const int dim = system.dim();
        if (settings.rest.size() == 0)
            settings.rest = Vector::Zero(dim);
        require_point(system, settings.t0, settings.rest, p);
        if (lanes.dim() != dim || lanes.params() != int(p.size()))
            refuse("lanes.dim()", lanes.dim(), "expected lanes of the same system");
        for (int k = 0; k < 2; ++k)
            if (grid.axis(k).coordinate >= dim)
                refuse("grid.axis(" + std::to_string(k) + ").coordinate", grid.axis(k).coordinate,
                       "expected an index below dim");
        const auto at_least = [](const char* name, int value, int least) {
            if (!(value >= least))
                refuse(name, value, "expected an integer >= " + std::to_string(least));
        };
        at_least("seeds", settings.seeds, 1);
        at_least("settle", settings.settle, 1);
        at_least("longest", settings.longest, 1);
        at_least("periods", settings.periods, 1);
        at_least("audit", settings.audit, 0);
        at_least("newtons", settings.newtons, 0);
        if (!(settings.distance >= 0 && settings.distance < 1))
            refuse("distance", settings.distance, "expected 0 <= distance < 1");
        const auto& escape = settings.escape;
        if (!(escape.empty() || escape.size() == std::size_t(dim)))
            refuse("escape.size()", double(escape.size()), "expected dim entries, or none");
        for (const double bound : escape)
            if (!(bound > 0))
                refuse("escape", bound, "expected numbers > 0");
        if (settings.quotient == UseQuotient::always && settings.times)
            throw std::invalid_argument("filippov: times = true: expected false where the quotient "
                                        "is always used, which does not know times");
    }
};

/// Members that all start when the strobe flashes, with the same parameters.
class Flashes : public AnyPopulation {
public:
    explicit Flashes(const StrobePicture& picture) : picture_(picture) {
        same_params = true;
        escape = picture.settings.escape;
    }
    double leg(std::size_t) override { return picture_.T; }

protected:
    /// From the flash `first` on: at 0, from the time at which the picture starts.
    void start(MemberView& m, std::span<const double> x, int periods, int first = 0) const {
        begin(m, x, first > 0 ? picture_.first_flash() : picture_.settings.t0, first, periods);
    }
    /// From the first flash on.
    void start_flashed(MemberView& m, std::span<const double> x, int periods) const {
        begin(m, x, picture_.first_flash(), 0, periods);
    }
    const StrobePicture& picture_;

private:
    void begin(MemberView& m, std::span<const double> x, double t0, int first, int periods) const {
        std::copy(x.begin(), x.end(), m.x.begin());
        std::copy(picture_.p.begin(), picture_.p.end(), m.p.begin());
        m.t0 = t0 + first * picture_.T;
        m.t_end = picture_.first_flash() + (first + periods) * picture_.T;
    }
};

/// What the points of runs are.
enum class PointsAre : unsigned char {
    starts,  ///< of the picture
    flashed, ///< states when the strobe flashes
};

/// Follows points for a number of periods and keeps the states at the last flashes.
class Followed final : public Flashes {
public:
    std::vector<std::vector<Vector>> states; ///< of each point
    std::vector<Status> status;

    Followed(const StrobePicture& picture, const std::vector<Vector>& points, PointsAre are,
             int before, int kept)
        : Flashes(picture), states(points.size()), status(points.size(), Status::interrupted),
          points_(points), are_(are), before_(before), kept_(std::size_t(kept)) {}

    void member(std::size_t id, MemberView& m) override {
        if (are_ == PointsAre::flashed)
            start_flashed(m, view(points_[id]), before_);
        else
            start(m, view(points_[id]), before_);
    }
    bool goes_on(std::size_t id, const OutcomeView& o) override {
        states[id].push_back(Eigen::Map<const Vector>(o.x.data(), Eigen::Index(o.x.size())));
        return states[id].size() < kept_;
    }
    void take(std::size_t id, const OutcomeView& o) override { status[id] = o.status; }

private:
    const std::vector<Vector>& points_;
    const PointsAre are_;
    const int before_;
    const std::size_t kept_;
};

} // namespace detail

} // namespace filippov
