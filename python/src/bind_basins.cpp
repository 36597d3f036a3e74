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
        .field("points", &StrobeCycleColumns::points)
        .field("multipliers", &StrobeCycleColumns::multipliers)
        .field("residual", &StrobeCycleColumns::residual);
    using State = std::tuple<bool, Doubles, Complexes, double, double, Doubles>;
    bind_struct<AttractorColumns>(m, "AttractorColumns")
        .field("periodic", &AttractorColumns::periodic)
        .field("points", &AttractorColumns::points)
        .field("multipliers", &AttractorColumns::multipliers)
        .field("residual", &AttractorColumns::residual)
        .field("radius", &AttractorColumns::radius)
        .field("norms", &AttractorColumns::norms)
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
        .field("image", &MappedCellsColumns::image)
        .field("state", &MappedCellsColumns::state)
        .field("status", &MappedCellsColumns::status)
        .field("counters", &MappedCellsColumns::counters)
        .field("raised", &MappedCellsColumns::raised);
    bind_struct<LimitSetsResult>(m, "LimitSetsResult")
        .field("plain", &LimitSetsResult::plain)
        .field("attractors", &LimitSetsResult::attractors)
        .field("saddles", &LimitSetsResult::saddles)
        .field("raised", &LimitSetsResult::raised);
    bind_struct<CellLabelsColumns>(m, "CellLabelsColumns")
        .field("label", &CellLabelsColumns::label)
        .field("time", &CellLabelsColumns::time)
        .field("status", &CellLabelsColumns::status)
        .field("periods", &CellLabelsColumns::periods)
        .field("looked_up", &CellLabelsColumns::looked_up)
        .field("counters", &CellLabelsColumns::counters)
        .field("raised", &CellLabelsColumns::raised);
    bind_struct<GroupCheck>(m, "GroupCheck")
        .field("group", &GroupCheck::group)
        .field("attractor", &GroupCheck::attractor)
        .field("cells", &GroupCheck::cells);
    bind_struct<BasinChecks>(m, "BasinChecks")
        .field("confusion", &BasinChecks::confusion)
        .field("by_exit", &BasinChecks::by_exit)
        .field("by_exit_reason", &BasinChecks::by_exit_reason)
        .field("audited", &BasinChecks::audited)
        .field("disagreements", &BasinChecks::disagreements)
        .field("raised", &BasinChecks::raised);
    bind_struct<PointLabels>(m, "PointLabels")
        .field("label", &PointLabels::label)
        .field("time", &PointLabels::time)
        .field("raised", &PointLabels::raised);
    bind_struct<PairCount>(m, "PairCount")
        .field("epsilon", &PairCount::epsilon)
        .field("uncertain", &PairCount::uncertain)
        .field("trials", &PairCount::trials)
        .field("unresolved", &PairCount::unresolved);
    bind_struct<PairCounts>(m, "PairCounts")
        .field("counts", &PairCounts::counts)
        .field("raised", &PairCounts::raised);
    bind_struct<BoundaryDimension>(m, "BoundaryDimension")
        .field("value", &BoundaryDimension::value)
        .field("error", &BoundaryDimension::error)
        .field("levels", &BoundaryDimension::levels);
    bind_struct<Audit>(m, "Audit")
        .field("points", &Audit::points)
        .field("wrong", &Audit::wrong)
        .field("share", &Audit::share)
        .field("bound", &Audit::bound);
    bind_struct<RefinedColumns>(m, "RefinedColumns")
        .field("squares", &RefinedColumns::squares)
        .field("label", &RefinedColumns::label)
        .field("time", &RefinedColumns::time)
        .field("counts", &RefinedColumns::counts)
        .field("trajectories", &RefinedColumns::trajectories)
        .field("dimension", &RefinedColumns::dimension)
        .field("audit", &RefinedColumns::audit)
        .field("status", &RefinedColumns::status)
        .field("message", &RefinedColumns::message)
        .field("raised", &RefinedColumns::raised);
}

/// Numbers of a picture's labels, shape (rows, columns), or of independent points.
void bind_numbers(py::module_& m) {
    bind_struct<Fraction>(m, "Fraction")
        .field("label", &Fraction::label)
        .field("value", &Fraction::value)
        .field("low", &Fraction::low)
        .field("high", &Fraction::high)
        .field("count", &Fraction::count);
    bind_struct<BasinEntropy>(m, "BasinEntropy")
        .field("mean", &BasinEntropy::mean)
        .field("mean_error", &BasinEntropy::mean_error)
        .field("boundary", &BasinEntropy::boundary)
        .field("boundary_error", &BasinEntropy::boundary_error)
        .field("boxes", &BasinEntropy::boxes)
        .field("boundary_boxes", &BasinEntropy::boundary_boxes)
        .field("unresolved", &BasinEntropy::unresolved)
        .def("passes_log2_test", &BasinEntropy::passes_log2_test);
    bind_struct<BoxCount>(m, "BoxCount")
        .field("size", &BoxCount::size)
        .field("boxes", &BoxCount::boxes);
    bind_struct<BoxDimension>(m, "BoxDimension")
        .field("dimension", &BoxDimension::dimension)
        .field("error", &BoxDimension::error)
        .field("counts", &BoxDimension::counts);
    bind_struct<UncertaintyExponent>(m, "UncertaintyExponent")
        .field("alpha", &UncertaintyExponent::alpha)
        .field("error", &UncertaintyExponent::error)
        .field("dimension", &UncertaintyExponent::dimension)
        .field("log_factor", &UncertaintyExponent::log_factor)
        .field("chi2", &UncertaintyExponent::chi2)
        .field("degrees", &UncertaintyExponent::degrees)
        .field("probability", &UncertaintyExponent::probability)
        .field("left_out", &UncertaintyExponent::left_out);
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
