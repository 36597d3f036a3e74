// SPDX-License-Identifier: BSD-3-Clause
#include "bind_basins.hpp"

#include <filippov/basins/basin_numbers.hpp>
#include <filippov/basins/refine.hpp>

namespace filippov::python {

namespace {

using Doubles = Array<double>;

// --- limit sets, as dictionaries that can be stored and sent -------------------------------------

py::array_t<double> stacked(const std::vector<Matrix>& matrices, Eigen::Index dim) {
    std::vector<double> all;
    for (const Matrix& m : matrices) // of symmetric ones the order does not matter
        all.insert(all.end(), m.data(), m.data() + m.size());
    return as_array(std::move(all), {py::ssize_t(matrices.size()), dim, dim});
}
py::dict to_dict(const StrobeCycle& c, Eigen::Index dim) {
    py::dict d;
    d["points"] = rows(c.points, dim);
    d["multipliers"] = as_array(std::vector(c.multipliers), {py::ssize_t(c.multipliers.size())});
    d["residual"] = c.residual;
    return d;
}
py::dict to_dict(const Attractor& a, Eigen::Index dim) {
    py::dict d = to_dict(a.cycle, dim);
    d["periodic"] = a.periodic;
    d["radius"] = a.radius;
    d["norms"] = stacked(a.norms, dim);
    if (!a.periodic)
        d["points"] = rows(a.cloud, dim);
    return d;
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
py::list rows_of(const std::vector<Fraction>& fractions) {
    py::list rows;
    for (const Fraction& f : fractions)
        rows.append(py::make_tuple(f.label, f.value, f.low, f.high, f.count));
    return rows;
}

/// A BasinFinder whose parts are called one by one. What a call raised, or a signal, ends all later
/// calls too.
class Finder : public PictureOf {
public:
    template <class... Args>
    explicit Finder(Args&&... args)
        : PictureOf(std::forward<Args>(args)...),
          finder_(*analysis_.system, lanes_in(lanes_), grid_, p_, settings_) {}

    py::dict images(std::int32_t first, std::int32_t count, const py::object& show) {
        MappedCells images =
            unlocked(show, [&] { return finder_.images({.first = first, .count = count}); });
        py::dict d;
        d["image"] = as_array(std::move(images.cell), {count});
        d["state"] = as_array(std::move(images.states), {count, dim()});
        d["status"] = as_array(bytes(images.status), {count});
        d["counters"] = lane_counters_to_dict(images.counters);
        d["raised"] = analysis_.signals.raised();
        return d;
    }
    /// @param image  of all cells
    py::dict find(const Array<std::int32_t>& image) {
        CellMap plain;
        const LimitSets sets = unlocked(py::none(), [&] {
            plain = cell_map(grid_, view(image));
            return finder_.find(plain);
        });
        py::list attractors, saddles;
        for (const Attractor& a : sets.attractors)
            attractors.append(to_dict(a, dim()));
        for (const StrobeCycle& s : sets.saddles)
            saddles.append(to_dict(s, dim()));
        py::dict d;
        d["plain"] = cell_map_to_dict(plain);
        d["attractors"] = attractors;
        d["saddles"] = saddles;
        d["raised"] = analysis_.signals.raised();
        return d;
    }
    /// @param state, status  of the images of these cells
    py::dict labels(const py::list& attractors, std::int32_t first, std::int32_t count,
                    const Doubles& state, const Array<signed char>& status,
                    const py::object& show) {
        const std::vector<Attractor> known = attractors_of(attractors);
        MappedCells images;
        images.states = copy(state);
        images.status = statuses(status);
        CellLabels labels =
            unlocked(show, [&] { return finder_.labels(known, {first, count}, images); });
        labels.time.resize(std::size_t(count), -1);
        py::dict d;
        d["label"] = as_array(std::move(labels.label), {count});
        d["time"] = as_array(std::move(labels.time), {count});
        d["status"] = as_array(bytes(labels.status), {count});
        d["periods"] = labels.periods;
        d["looked_up"] = labels.looked_up;
        d["counters"] = lane_counters_to_dict(labels.counters);
        d["raised"] = analysis_.signals.raised();
        return d;
    }
    /// @param image, label  of all cells
    py::dict complete(const py::list& attractors, const Array<std::int32_t>& image,
                      const Array<std::int32_t>& label) {
        expect(label.size() == grid_.cells(), "every cell has a label");
        Basins b{.grid = grid_};
        b.attractors = attractors_of(attractors);
        b.label = copy(label);
        unlocked(py::none(), [&] {
            b.plain = cell_map(grid_, view(image));
            finder_.complete(b);
            return 0;
        });
        py::list confusion;
        for (const GroupCheck& g : b.confusion)
            confusion.append(py::make_tuple(g.group, g.attractor, g.cells));
        py::dict d;
        d["confusion"] = confusion;
        d["by_exit"] = b.by_exit;
        d["by_exit_reason"] = b.by_exit_reason;
        d["audited"] = b.audited;
        d["disagreements"] = b.disagreements;
        d["raised"] = analysis_.signals.raised();
        return d;
    }
    /// @param points  of the picture, shape (k, 2)
    py::dict points(const py::list& attractors, const Doubles& points) {
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
        py::dict d;
        d["label"] = as_array(std::move(label), {n});
        d["time"] = as_array(std::move(time), {n});
        d["raised"] = analysis_.signals.raised();
        return d;
    }
    /// Pairs of points of the picture, a row (epsilon, uncertain, trials, unresolved) a distance.
    py::dict pairs(const py::list& attractors, const std::vector<double>& epsilons, long long n,
                   std::uint64_t seed, const py::object& show) {
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
        py::list rows;
        for (const PairCount& c : counts)
            rows.append(py::make_tuple(c.epsilon, c.uncertain, c.trials, c.unresolved));
        py::dict d;
        d["counts"] = rows;
        d["raised"] = analysis_.signals.raised();
        return d;
    }
    /// The picture on squares that are split along the boundaries.
    py::dict refine(const py::list& attractors, int coarse, int levels, int time_jump,
                    double full_dimension, long long max_points, int audit, std::uint64_t seed) {
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
        py::dict d;
        d["squares"] = as_array(std::move(squares), {n, 3});
        d["label"] = as_array(std::move(label), {n});
        d["time"] = as_array(std::move(time), {n});
        d["counts"] = as_array(std::move(counts), {rounds, 2});
        d["trajectories"] = r.trajectories;
        d["dimension"] = py::make_tuple(r.dimension.value, r.dimension.error, r.dimension.levels);
        d["audit"] = py::make_tuple(r.audit.points, r.audit.wrong, r.audit.share, r.audit.bound);
        d["status"] = std::string(name(r.status));
        d["message"] = r.message;
        d["raised"] = analysis_.signals.raised();
        return d;
    }

private:
    BasinLabeller labeller_of(const py::list& attractors) const {
        return {*analysis_.system, lanes_in(lanes_), grid_, attractors_of(attractors), p_,
                settings_};
    }

    BasinFinder finder_;
};

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

    // Numbers of a picture's labels, shape (rows, columns).
    m.def("grid_fractions", [](const Array<std::int32_t>& labels) {
        return rows_of(grid_fractions(labels_of(labels)));
    });
    m.def("basin_entropy", [](const Array<std::int32_t>& labels, std::size_t box) {
        const BasinEntropy e = basin_entropy(labels_of(labels), box);
        return py::make_tuple(e.mean, e.mean_error, e.boundary, e.boundary_error, e.boxes,
                              e.boundary_boxes, e.unresolved, e.passes_log2_test());
    });
    m.def("box_dimension",
          [](const Array<std::int32_t>& labels, std::size_t smallest, std::size_t largest) {
              const BoxDimension b = box_dimension(labels_of(labels), smallest, largest);
              py::list counts;
              for (const BoxCount& c : b.counts)
                  counts.append(py::make_tuple(c.size, c.boxes));
              return py::make_tuple(b.dimension, b.error, counts);
          });
    // Of independent points, rows (label, value, low, high, count).
    m.def("sampled_fractions",
          [](const Array<std::int32_t>& labels, double level, const std::vector<Label>& also) {
              const std::vector<Label> all(labels.data(), labels.data() + labels.size());
              return rows_of(sampled_fractions(all, level, also));
          });
    // Rows (epsilon, uncertain, trials, unresolved).
    m.def("uncertainty_exponent",
          [](const std::vector<std::tuple<double, long long, long long, long long>>& rows) {
              std::vector<PairCount> counts;
              for (const auto& [epsilon, uncertain, trials, unresolved] : rows)
                  counts.push_back({epsilon, uncertain, trials, unresolved});
              const UncertaintyExponent u = uncertainty_exponent(counts);
              return py::make_tuple(u.alpha, u.error, u.dimension, u.log_factor, u.chi2, u.degrees,
                                    u.probability, u.left_out);
          });
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
