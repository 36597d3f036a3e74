// SPDX-License-Identifier: BSD-3-Clause
#include "bind_basins.hpp"

#include <filippov/basins/basin_numbers.hpp>
#include <filippov/basins/refine.hpp>

namespace filippov::python {

namespace {

using Doubles = Array<double>;
using Complexes = Array<std::complex<double>>;

/// Some cells as MappedCells: a row a cell.
struct MappedCellsColumns {
    py::array_t<std::int32_t> image;
    py::array_t<double> state;
    py::array_t<signed char> status;
    py::dict counters;
    py::object raised = py::none();
};

/// LimitSets, with the plain cell map that they were found from.
struct LimitSetsResult {
    CellMapColumns plain;
    std::vector<AttractorColumns> attractors{};
    std::vector<StrobeCycleColumns> saddles{};
    py::object raised = py::none();
};

/// Some cells as CellLabels: a row a cell.
struct CellLabelsColumns {
    py::array_t<std::int32_t> label, time;
    py::array_t<signed char> status;
    long long periods = 0;
    std::int64_t looked_up = 0;
    py::dict counters;
    py::object raised = py::none();
};

/// What `BasinFinder::complete` finds out about a picture.
struct BasinChecks {
    std::vector<GroupCheck> confusion;
    bool by_exit = false;
    std::string by_exit_reason;
    int audited = 0, disagreements = 0;
    py::object raised = py::none();
};

/// Labels of points of a picture, and when they had landed: a row a point.
struct PointLabels {
    py::array_t<std::int32_t> label, time;
    py::object raised = py::none();
};

/// Pairs of points of a picture: a count a distance.
struct PairCounts {
    std::vector<PairCount> counts;
    py::object raised = py::none();
};

/// A Refined picture: a row a square that was not split, and one a level.
struct RefinedColumns {
    py::array_t<std::int32_t> squares, label, time; // a square
    py::array_t<long long> counts;                  // a level
    long long trajectories = 0;
    BoundaryDimension dimension;
    Audit audit;
    std::string status, message;
    py::object raised = py::none();
};

py::array_t<double> stacked(const std::vector<Matrix>& matrices, Eigen::Index dim) {
    std::vector<double> all;
    for (const Matrix& m : matrices) // of symmetric ones the order does not matter
        all.insert(all.end(), m.data(), m.data() + m.size());
    return as_array(std::move(all), {py::ssize_t(matrices.size()), dim, dim});
}
Complexes multipliers_of(const StrobeCycle& c) {
    return as_array(std::vector(c.multipliers), {py::ssize_t(c.multipliers.size())});
}
StrobeCycleColumns columns_of(const StrobeCycle& c, Eigen::Index dim) {
    return {
        .points = rows(c.points, dim), .multipliers = multipliers_of(c), .residual = c.residual};
}
AttractorColumns columns_of(const Attractor& a, Eigen::Index dim) {
    return {.periodic = a.periodic,
            .points = rows(a.periodic ? a.cycle.points : a.cloud, dim),
            .multipliers = multipliers_of(a.cycle),
            .residual = a.cycle.residual,
            .radius = a.radius,
            .norms = stacked(a.norms, dim)};
}
std::vector<signed char> bytes(const std::vector<Status>& status) {
    std::vector<signed char> all;
    for (const Status s : status)
        all.push_back(static_cast<signed char>(s));
    return all;
}
std::vector<Status> statuses(const Array<signed char>& bytes) {
    std::vector<Status> all;
    for (const signed char s : view(bytes))
        all.push_back(static_cast<Status>(s));
    return all;
}

LabelGrid labels_of(const Array<std::int32_t>& labels) {
    expect(labels.ndim() == 2, "labels have two axes");
    return {view(labels), std::size_t(labels.shape(1))};
}

/// A BasinFinder whose parts are called one by one. What a call raised, or a signal, ends all later
/// calls too.
class Finder : public PictureOf {
public:
    template <class... Args>
    explicit Finder(Args&&... args)
        : PictureOf(std::forward<Args>(args)...),
          finder_(*analysis_.system, lanes_in(lanes_), grid_, p_, settings_) {}

    MappedCellsColumns images(std::int32_t first, std::int32_t count, const py::object& show) {
        MappedCells images =
            unlocked(show, [&] { return finder_.images({.first = first, .count = count}); });
        return {.image = as_array(std::move(images.cell), {count}),
                .state = as_array(std::move(images.states), {count, dim()}),
                .status = as_array(bytes(images.status), {count}),
                .counters = lane_counters_to_dict(images.counters),
                .raised = analysis_.signals.raised()};
    }
    /// @param image  of all cells
    LimitSetsResult find(const Array<std::int32_t>& image) {
        CellMap plain;
        const LimitSets sets = unlocked(py::none(), [&] {
            plain = cell_map(grid_, view(image));
            return finder_.find(plain);
        });
        LimitSetsResult result{.plain = python::columns_of(plain),
                               .raised = analysis_.signals.raised()};
        for (const Attractor& a : sets.attractors)
            result.attractors.push_back(columns_of(a, dim()));
        for (const StrobeCycle& s : sets.saddles)
            result.saddles.push_back(columns_of(s, dim()));
        return result;
    }
    /// @param state, status  of the images of these cells
    CellLabelsColumns labels(const std::vector<AttractorColumns>& attractors, std::int32_t first,
                             std::int32_t count, const Doubles& state,
                             const Array<signed char>& status, const py::object& show) {
        const std::vector<Attractor> known = attractors_of(attractors);
        MappedCells images;
        images.states = copy(state);
        images.status = statuses(status);
        CellLabels labels =
            unlocked(show, [&] { return finder_.labels(known, {first, count}, images); });
        labels.time.resize(std::size_t(count), -1);
        return {.label = as_array(std::move(labels.label), {count}),
                .time = as_array(std::move(labels.time), {count}),
                .status = as_array(bytes(labels.status), {count}),
                .periods = labels.periods,
                .looked_up = labels.looked_up,
                .counters = lane_counters_to_dict(labels.counters),
                .raised = analysis_.signals.raised()};
    }
    /// @param image, label  of all cells
    BasinChecks complete(const std::vector<AttractorColumns>& attractors,
                         const Array<std::int32_t>& image, const Array<std::int32_t>& label) {
        expect(label.size() == grid_.cells(), "every cell has a label");
        Basins b{.grid = grid_};
        b.attractors = attractors_of(attractors);
        b.label = copy(label);
        unlocked(py::none(), [&] {
            b.plain = cell_map(grid_, view(image));
            finder_.complete(b);
            return 0;
        });
        return {.confusion = std::move(b.confusion),
                .by_exit = b.by_exit,
                .by_exit_reason = std::move(b.by_exit_reason),
                .audited = b.audited,
                .disagreements = b.disagreements,
                .raised = analysis_.signals.raised()};
    }
    /// @param points  of the picture, shape (k, 2)
    PointLabels points(const std::vector<AttractorColumns>& attractors, const Doubles& points) {
        expect(points.ndim() == 2 && points.shape(1) == 2, "points have two columns");
        const BasinLabeller labeller = labeller_of(attractors);
        std::vector<std::array<double, 2>> at;
        for (py::ssize_t k = 0; k < points.shape(0); ++k)
            at.push_back({points.at(k, 0), points.at(k, 1)});
        std::vector<CellLabel> found(at.size(), {.label = 0, .time = -1});
        unlocked(py::none(), [&] { return labeller(at, found); });
        std::vector<std::int32_t> label, time;
        for (const CellLabel& l : found) {
            label.push_back(l.label);
            time.push_back(l.time);
        }
        const auto n = py::ssize_t(at.size());
        return {.label = as_array(std::move(label), {n}),
                .time = as_array(std::move(time), {n}),
                .raised = analysis_.signals.raised()};
    }
    PairCounts pairs(const std::vector<AttractorColumns>& attractors,
                     const std::vector<double>& epsilons, long long n, std::uint64_t seed,
                     const py::object& show) {
        const BasinLabeller labeller = labeller_of(attractors);
        std::vector<PairCount> counts;
        std::size_t done = 0;
        const std::size_t total = epsilons.size() * static_cast<std::size_t>(std::max(n, 0LL));
        const auto ask = [&](std::span<const std::array<double, 2>> at, std::span<Label> labels) {
            std::vector<CellLabel> found(at.size());
            if (!labeller(at, found))
                return false;
            for (std::size_t k = 0; k < at.size(); ++k)
                labels[k] = found[k].label;
            show_(done += at.size() / 2, total);
            return !analysis_.signals.has_raised();
        };
        unlocked(show, [&] {
            counts = count_pairs({grid_.axis(0).low, grid_.axis(1).low},
                                 {grid_.axis(0).high, grid_.axis(1).high}, ask, epsilons, n, seed);
            return 0;
        });
        return {.counts = std::move(counts), .raised = analysis_.signals.raised()};
    }
    /// The picture on squares that are split along the boundaries.
    RefinedColumns refine(const std::vector<AttractorColumns>& attractors, int coarse, int levels,
                          int time_jump, double full_dimension, long long max_points, int audit,
                          std::uint64_t seed) {
        const BasinLabeller labeller = labeller_of(attractors);
        const Rectangle box{{grid_.axis(0).low, grid_.axis(1).low},
                            {grid_.axis(0).high, grid_.axis(1).high}};
        const RefineSettings settings{.coarse = coarse,
                                      .levels = levels,
                                      .time_jump = time_jump,
                                      .full_dimension = full_dimension,
                                      .max_points = max_points,
                                      .audit = audit,
                                      .seed = seed};
        const Refined r =
            unlocked(py::none(), [&] { return filippov::refine(labeller, box, settings); });
        std::vector<std::int32_t> squares, label, time;
        for (const Leaf& leaf : r.leaves()) {
            squares.insert(squares.end(), {leaf.level, leaf.i, leaf.j});
            label.push_back(leaf.label.label);
            time.push_back(leaf.label.time);
        }
        std::vector<long long> counts;
        for (const LevelCount& c : r.counts)
            counts.insert(counts.end(), {c.boundary, c.marked});
        const auto n = py::ssize_t(label.size()), rounds = py::ssize_t(r.counts.size());
        return {.squares = as_array(std::move(squares), {n, 3}),
                .label = as_array(std::move(label), {n}),
                .time = as_array(std::move(time), {n}),
                .counts = as_array(std::move(counts), {rounds, 2}),
                .trajectories = r.trajectories,
                .dimension = r.dimension,
                .audit = r.audit,
                .status = std::string(name(r.status)),
                .message = r.message,
                .raised = analysis_.signals.raised()};
    }

private:
    BasinLabeller labeller_of(const std::vector<AttractorColumns>& attractors) const {
        return {*analysis_.system, lanes_in(lanes_), grid_, attractors_of(attractors), p_,
                settings_};
    }

    BasinFinder finder_;
};

void bind_results(py::module_& m) {
    bind_struct<StrobeCycleColumns>(m, "StrobeCycleColumns")
        .def_readwrite("points", &StrobeCycleColumns::points)
        .def_readwrite("multipliers", &StrobeCycleColumns::multipliers)
        .def_readwrite("residual", &StrobeCycleColumns::residual);
    using State = std::tuple<bool, Doubles, Complexes, double, double, Doubles>;
    bind_struct<AttractorColumns>(m, "AttractorColumns")
        .def_readwrite("periodic", &AttractorColumns::periodic)
        .def_readwrite("points", &AttractorColumns::points)
        .def_readwrite("multipliers", &AttractorColumns::multipliers)
        .def_readwrite("residual", &AttractorColumns::residual)
        .def_readwrite("radius", &AttractorColumns::radius)
        .def_readwrite("norms", &AttractorColumns::norms)
        .def(py::pickle(
            [](const AttractorColumns& a) {
                return State(a.periodic, a.points, a.multipliers, a.residual, a.radius, a.norms);
            },
            [](const State& state) {
                const auto& [periodic, points, multipliers, residual, radius, norms] = state;
                return AttractorColumns{.periodic = periodic,
                                        .points = points,
                                        .multipliers = multipliers,
                                        .residual = residual,
                                        .radius = radius,
                                        .norms = norms};
            }));
    bind_struct<MappedCellsColumns>(m, "MappedCellsColumns")
        .def_readwrite("image", &MappedCellsColumns::image)
        .def_readwrite("state", &MappedCellsColumns::state)
        .def_readwrite("status", &MappedCellsColumns::status)
        .def_readwrite("counters", &MappedCellsColumns::counters)
        .def_readwrite("raised", &MappedCellsColumns::raised);
    bind_struct<LimitSetsResult>(m, "LimitSetsResult")
        .def_readwrite("plain", &LimitSetsResult::plain)
        .def_readwrite("attractors", &LimitSetsResult::attractors)
        .def_readwrite("saddles", &LimitSetsResult::saddles)
        .def_readwrite("raised", &LimitSetsResult::raised);
    bind_struct<CellLabelsColumns>(m, "CellLabelsColumns")
        .def_readwrite("label", &CellLabelsColumns::label)
        .def_readwrite("time", &CellLabelsColumns::time)
        .def_readwrite("status", &CellLabelsColumns::status)
        .def_readwrite("periods", &CellLabelsColumns::periods)
        .def_readwrite("looked_up", &CellLabelsColumns::looked_up)
        .def_readwrite("counters", &CellLabelsColumns::counters)
        .def_readwrite("raised", &CellLabelsColumns::raised);
    bind_struct<GroupCheck>(m, "GroupCheck")
        .def_readwrite("group", &GroupCheck::group)
        .def_readwrite("attractor", &GroupCheck::attractor)
        .def_readwrite("cells", &GroupCheck::cells);
    bind_struct<BasinChecks>(m, "BasinChecks")
        .def_readwrite("confusion", &BasinChecks::confusion)
        .def_readwrite("by_exit", &BasinChecks::by_exit)
        .def_readwrite("by_exit_reason", &BasinChecks::by_exit_reason)
        .def_readwrite("audited", &BasinChecks::audited)
        .def_readwrite("disagreements", &BasinChecks::disagreements)
        .def_readwrite("raised", &BasinChecks::raised);
    bind_struct<PointLabels>(m, "PointLabels")
        .def_readwrite("label", &PointLabels::label)
        .def_readwrite("time", &PointLabels::time)
        .def_readwrite("raised", &PointLabels::raised);
    bind_struct<PairCount>(m, "PairCount")
        .def_readwrite("epsilon", &PairCount::epsilon)
        .def_readwrite("uncertain", &PairCount::uncertain)
        .def_readwrite("trials", &PairCount::trials)
        .def_readwrite("unresolved", &PairCount::unresolved);
    bind_struct<PairCounts>(m, "PairCounts")
        .def_readwrite("counts", &PairCounts::counts)
        .def_readwrite("raised", &PairCounts::raised);
    bind_struct<BoundaryDimension>(m, "BoundaryDimension")
        .def_readwrite("value", &BoundaryDimension::value)
        .def_readwrite("error", &BoundaryDimension::error)
        .def_readwrite("levels", &BoundaryDimension::levels);
    bind_struct<Audit>(m, "Audit")
        .def_readwrite("points", &Audit::points)
        .def_readwrite("wrong", &Audit::wrong)
        .def_readwrite("share", &Audit::share)
        .def_readwrite("bound", &Audit::bound);
    bind_struct<RefinedColumns>(m, "RefinedColumns")
        .def_readwrite("squares", &RefinedColumns::squares)
        .def_readwrite("label", &RefinedColumns::label)
        .def_readwrite("time", &RefinedColumns::time)
        .def_readwrite("counts", &RefinedColumns::counts)
        .def_readwrite("trajectories", &RefinedColumns::trajectories)
        .def_readwrite("dimension", &RefinedColumns::dimension)
        .def_readwrite("audit", &RefinedColumns::audit)
        .def_readwrite("status", &RefinedColumns::status)
        .def_readwrite("message", &RefinedColumns::message)
        .def_readwrite("raised", &RefinedColumns::raised);
}

/// Numbers of a picture's labels, shape (rows, columns), or of independent points.
void bind_numbers(py::module_& m) {
    bind_struct<Fraction>(m, "Fraction")
        .def_readwrite("label", &Fraction::label)
        .def_readwrite("value", &Fraction::value)
        .def_readwrite("low", &Fraction::low)
        .def_readwrite("high", &Fraction::high)
        .def_readwrite("count", &Fraction::count);
    bind_struct<BasinEntropy>(m, "BasinEntropy")
        .def_readwrite("mean", &BasinEntropy::mean)
        .def_readwrite("mean_error", &BasinEntropy::mean_error)
        .def_readwrite("boundary", &BasinEntropy::boundary)
        .def_readwrite("boundary_error", &BasinEntropy::boundary_error)
        .def_readwrite("boxes", &BasinEntropy::boxes)
        .def_readwrite("boundary_boxes", &BasinEntropy::boundary_boxes)
        .def_readwrite("unresolved", &BasinEntropy::unresolved)
        .def("passes_log2_test", &BasinEntropy::passes_log2_test);
    bind_struct<BoxCount>(m, "BoxCount")
        .def_readwrite("size", &BoxCount::size)
        .def_readwrite("boxes", &BoxCount::boxes);
    bind_struct<BoxDimension>(m, "BoxDimension")
        .def_readwrite("dimension", &BoxDimension::dimension)
        .def_readwrite("error", &BoxDimension::error)
        .def_readwrite("counts", &BoxDimension::counts);
    bind_struct<UncertaintyExponent>(m, "UncertaintyExponent")
        .def_readwrite("alpha", &UncertaintyExponent::alpha)
        .def_readwrite("error", &UncertaintyExponent::error)
        .def_readwrite("dimension", &UncertaintyExponent::dimension)
        .def_readwrite("log_factor", &UncertaintyExponent::log_factor)
        .def_readwrite("chi2", &UncertaintyExponent::chi2)
        .def_readwrite("degrees", &UncertaintyExponent::degrees)
        .def_readwrite("probability", &UncertaintyExponent::probability)
        .def_readwrite("left_out", &UncertaintyExponent::left_out);
    m.def("grid_fractions",
          [](const Array<std::int32_t>& labels) { return grid_fractions(labels_of(labels)); });
    m.def("basin_entropy", [](const Array<std::int32_t>& labels, std::size_t box) {
        return basin_entropy(labels_of(labels), box);
    });
    m.def("box_dimension",
          [](const Array<std::int32_t>& labels, std::size_t smallest, std::size_t largest) {
              return box_dimension(labels_of(labels), smallest, largest);
          });
    m.def("sampled_fractions",
          [](const Array<std::int32_t>& labels, double level, const std::vector<Label>& also) {
              const std::vector<Label> all(labels.data(), labels.data() + labels.size());
              return sampled_fractions(all, level, also);
          });
    m.def("uncertainty_exponent",
          [](const std::vector<PairCount>& counts) { return uncertainty_exponent(counts); });
}

} // namespace

void bind_basins(py::module_& m) {
    bind_struct<BasinSettings>(m, "BasinSettings")
        .def_readwrite("run", &BasinSettings::run)
        .def_readwrite("t0", &BasinSettings::t0)
        .def_property(
            "rest", [](const BasinSettings& s) { return array_of(s.rest); },
            [](BasinSettings& s, const Array<double>& rest) { s.rest = vector_of(rest); })
        .def_readwrite("seeds", &BasinSettings::seeds)
        .def_readwrite("settle", &BasinSettings::settle)
        .def_readwrite("longest", &BasinSettings::longest)
        .def_readwrite("saddle_starts", &BasinSettings::newtons)
        .def_readwrite("max_periods", &BasinSettings::periods)
        .def_readwrite("distance", &BasinSettings::distance)
        .def_readwrite("times", &BasinSettings::times)
        .def_readwrite("audit", &BasinSettings::audit)
        .def_readwrite("escape", &BasinSettings::escape)
        .def_readwrite("seed", &BasinSettings::seed)
        .def_property(
            "threads", [](const BasinSettings& s) { return s.parallel.threads; },
            [](BasinSettings& s, int threads) { s.parallel.threads = threads; });

    bind_results(m);
    py::class_<PictureOf>(m, "Picture"); // what other functions of basins take
    py::class_<Finder, PictureOf>(m, "BasinFinder")
        .def(py::init<const Model&, py::capsule, const Axes&, const Doubles&,
                      const BasinSettings&>(),
             py::keep_alive<1, 2>())
        .def("images", &Finder::images)
        .def("find", &Finder::find)
        .def("labels", &Finder::labels)
        .def("complete", &Finder::complete)
        .def("points", &Finder::points)
        .def("pairs", &Finder::pairs)
        .def("refine", &Finder::refine);

    bind_boundary(m);
    bind_numbers(m);

    // Ids of the attractors found, and the next one to be given.
    m.def("match_attractors",
          [](const std::vector<std::pair<Label, Doubles>>& known, const std::vector<Doubles>& found,
             const Doubles& scale, double threshold, Label next_id) {
              std::vector<KnownAttractor> before;
              for (const auto& [id, points] : known)
                  before.push_back({id, points_of(points)});
              std::vector<AttractorPoints> now;
              for (const Doubles& points : found)
                  now.push_back(points_of(points));
              const AttractorMatch match =
                  match_attractors(before, now, vector_of(scale), threshold, next_id);
              return py::make_tuple(match.ids, match.distances, match.next_id);
          });
}

} // namespace filippov::python
