// SPDX-License-Identifier: BSD-3-Clause
#include "bind.hpp"

#include <filippov/orbits/lyapunov.hpp>
#include <filippov/orbits/map_graph.hpp>

namespace filippov::python {

namespace {

using Doubles = Array<double>;

/// What both functions need: a map and the ears for Ctrl-C.
class Mapping {
public:
    Mapping(const Model& model, const Doubles& p, const RunSettings& run, double max_periods,
            const std::optional<Doubles>& guess)
        : analysis_(model, run) {
        expect(std::size_t(p.size()) == model.facts().params.size(), "p has one entry a parameter");
        TransitionSettings settings;
        settings.max_periods = max_periods;
        if (guess) {
            expect(guess->size() == model.facts().dim, "guess has dim entries");
            settings.guess = vector_of(*guess);
        }
        map_.emplace(*analysis_.system, vector_of(p), std::move(settings));
    }
    Mapping(const Mapping&) = delete;
    Mapping& operator=(const Mapping&) = delete;

    const TransitionMap& operator*() const { return *map_; }
    SignalCheck& signals() { return analysis_.signals; }
    py::object raised() const { return analysis_.signals.raised(); }

private:
    Analysis analysis_;
    std::optional<TransitionMap> map_;
};

/// Points of a graph, a row each.
struct MapSampleColumns {
    py::array_t<double> phase;
    py::array_t<signed char> boundary;
    py::array_t<double> value;
    py::array_t<signed char> value_boundary;
    py::array_t<double> slope;
    py::array_t<long long> turns;
    py::array_t<unsigned char> true_exit;
    py::array_t<int> status;
    std::vector<std::string> word;
};

MapSampleColumns columns_of(const std::vector<MapSample>& samples) {
    const auto n = py::ssize_t(samples.size());
    const auto column = [&](auto get) {
        std::vector<decltype(get(samples[0]))> values;
        values.reserve(samples.size());
        for (const MapSample& s : samples)
            values.push_back(get(s));
        return as_array(std::move(values), {n});
    };
    const auto number = [](const MapSample& s, double value) {
        return s.image.ok() ? value : std::numeric_limits<double>::quiet_NaN();
    };
    MapSampleColumns c;
    c.phase = column([](const MapSample& s) { return s.at.phase; });
    c.boundary = column([](const MapSample& s) { return static_cast<signed char>(s.at.boundary); });
    c.value = column([&](const MapSample& s) { return number(s, s.image.to.phase); });
    c.value_boundary = column([](const MapSample& s) {
        return static_cast<signed char>(s.image.ok() ? s.image.to.boundary : 0);
    });
    c.slope = column([&](const MapSample& s) { return number(s, s.image.slope); });
    c.turns = column([](const MapSample& s) { return s.image.ok() ? s.image.turns : 0LL; });
    c.true_exit = column([](const MapSample& s) -> unsigned char { return s.image.true_exit; });
    c.status = column([](const MapSample& s) { return static_cast<int>(s.image.status); });
    for (const MapSample& s : samples)
        c.word.push_back(s.image.word);
    return c;
}

/// A FixedPoint, with its time and its state.
struct FixedPointResult {
    double phase = 0;
    int boundary = 0;
    double slope = 0;
    bool stable = false;
    int iterate = 1, prime = 1;
    long long turns = 0;
    bool tangent = false;
    double t = 0;
    std::vector<double> x;
};

FixedPointResult result_of(const TransitionMap& map, const FixedPoint& f) {
    const auto exit = map.exit_point(f.at);
    return {.phase = f.at.phase,
            .boundary = f.at.boundary,
            .slope = f.slope,
            .stable = f.stable(),
            .iterate = f.iterate,
            .prime = f.prime,
            .turns = f.turns,
            .tangent = f.tangent,
            .t = map.time_of(f.at.phase),
            .x = {exit->x.begin(), exit->x.end()}};
}

/// The graph of a map: samples, breaks with what is left and right of each, and fixed points.
struct MapGraphResult {
    MapSampleColumns samples, left, right;
    std::vector<bool> jump; // a break
    std::vector<FixedPointResult> points;
    std::string status, message;
    long long evaluations = 0;
    py::object raised = py::none();
};

MapGraphResult graph(const Model& model, const Doubles& p, const RunSettings& run,
                     double max_periods, const std::optional<Doubles>& guess, int iterate,
                     int samples, long long max_evaluations, const py::object& show) {
    Mapping map(model, p, run, max_periods, guess);
    const GraphSettings settings{.samples = samples,
                                 .max_evaluations = max_evaluations,
                                 .progress = progress(show, map.signals())};
    MapGraph g;
    {
        const py::gil_scoped_release unlocked;
        g = map_graph(*map, iterate, settings);
    }
    MapGraphResult r;
    std::vector<MapSample> left, right;
    for (const MapBreak& b : g.breaks) {
        left.push_back(b.left);
        right.push_back(b.right);
        r.jump.push_back(b.jump());
    }
    for (const FixedPoint& f : g.fixed_points)
        r.points.push_back(result_of(*map, f));
    r.samples = columns_of(g.samples);
    r.left = columns_of(left);
    r.right = columns_of(right);
    r.status = name(g.status);
    r.message = g.message;
    r.evaluations = g.evaluations;
    r.raised = map.raised();
    return r;
}

/// Where a map leads from points that were asked for.
struct MapImages {
    MapSampleColumns samples;
    py::object raised = py::none();
};

MapImages images(const Model& model, const Doubles& p, const RunSettings& run, double max_periods,
                 const std::optional<Doubles>& guess, int iterate, const Array<int>& boundary,
                 const Doubles& phase) {
    expect(boundary.size() == phase.size(), "boundary and phase have one size");
    const Mapping map(model, p, run, max_periods, guess);
    std::vector<MapSample> samples;
    {
        const py::gil_scoped_release unlocked;
        for (py::ssize_t k = 0; k < phase.size(); ++k) {
            const Transition at{boundary.data()[k], phase.data()[k]};
            samples.push_back({at, (*map)(at, iterate)});
            if (samples.back().image.status == Status::interrupted)
                break;
        }
    }
    return {.samples = columns_of(samples), .raised = map.raised()};
}

// --- strobe and section ------------------------------------------------------------------------

/// Where a map leads from many starts, a row each.
struct MappedColumns {
    py::array_t<double> x, t, slope, param_slope;
    std::vector<std::string> word;
    py::array_t<long long> slides;
    py::array_t<unsigned char> singular;
    std::vector<std::string> status, message;
    py::object raised = py::none();
};

/// Takes images without the lock, until they are made columns.
struct MappedRecorder {
    std::vector<double> x, t, slope, param_slope;
    std::vector<std::string> word, status, message;
    std::vector<long long> slides;
    std::vector<unsigned char> singular;

    /// @param by_params  shape (dim + 1, n): derivatives by the parameters that were asked for
    void add(const Mapped& m, const Matrix& by_params) {
        x.insert(x.end(), m.x.begin(), m.x.end());
        t.push_back(m.t);
        append(slope, m, m.slope);
        append(param_slope, m, by_params);
        word.push_back(m.word);
        status.emplace_back(name(m.status));
        message.push_back(m.message);
        slides.push_back(m.slides);
        singular.push_back(m.singular);
    }
    MappedColumns columns(py::ssize_t dim, py::ssize_t params) {
        const auto n = py::ssize_t(t.size());
        return {.x = as_array(std::move(x), {n, dim}),
                .t = as_array(std::move(t), {n}),
                .slope = as_array(std::move(slope), {n, dim + 1, dim + 1}),
                .param_slope = as_array(std::move(param_slope), {n, dim + 1, params}),
                .word = std::move(word),
                .slides = as_array(std::move(slides), {n}),
                .singular = as_array(std::move(singular), {n}),
                .status = std::move(status),
                .message = std::move(message)};
    }

private:
    /// Row by row; the end of a failure is no value of the map and has no derivatives.
    static void append(std::vector<double>& out, const Mapped& m, const Matrix& slope) {
        for (Eigen::Index i = 0; i < slope.rows(); ++i)
            for (Eigen::Index j = 0; j < slope.cols(); ++j)
                out.push_back(m.ok() ? slope(i, j) : std::numeric_limits<double>::quiet_NaN());
    }
};

/// Applies `map(system, t0, x0, p, along)` to all starts, twice and more for more than two
/// parameters.
template <class Map>
MappedColumns map_all(const Model& model, const Doubles& t0, const Doubles& x0, const Doubles& p,
                      const std::vector<int>& active, const RunSettings& run, Map map) {
    const auto dim = py::ssize_t(model.facts().dim);
    expect(x0.ndim() == 2 && x0.shape(1) == dim, "x0 has shape (k, dim)");
    expect(t0.size() == x0.shape(0), "t0 has one entry a start");
    const Analysis analysis(model, run);
    const Vector params = vector_of(p);
    MappedRecorder all;
    const auto one = [&](double time, const Vector& start) {
        Mapped first;
        Matrix by_params(dim + 1, active.size());
        for (std::size_t k = 0; k < std::max<std::size_t>(active.size(), 1); k += 2) {
            Directions along;
            for (std::size_t i = k; i < std::min(k + 2, active.size()); ++i)
                along.active[i - k] = active[i];
            Mapped m = map(*analysis.system, time, start, params, along);
            for (std::size_t i = k; i < std::min(k + 2, active.size()); ++i)
                by_params.col(Eigen::Index(i)) = m.param_slope.col(Eigen::Index(i - k));
            if (k == 0)
                first = std::move(m);
        }
        all.add(first, by_params);
    };
    {
        const py::gil_scoped_release unlocked;
        for (py::ssize_t k = 0; k < x0.shape(0) && !analysis.signals.has_raised(); ++k)
            one(t0.data()[k], Eigen::Map<const Vector>(x0.data(k, 0), dim));
    }
    MappedColumns c = all.columns(dim, py::ssize_t(active.size()));
    c.raised = analysis.signals.raised();
    return c;
}

MappedColumns strobes(const Model& model, const Doubles& t0, const Doubles& x0, const Doubles& p,
                      const std::vector<int>& active, const RunSettings& run, int iterate) {
    return map_all(
        model, t0, x0, p, active, run,
        [&](const AnySystem& system, double t, const Vector& x, const Vector& q,
            const Directions& along) { return strobe(system, t, x, q, iterate, along); });
}

MappedColumns sections(const Model& model, const Doubles& t0, const Doubles& x0, const Doubles& p,
                       const std::vector<int>& active, const RunSettings& run, int iterate,
                       int kind, int after, int surface, double max_time) {
    const SectionOf section{static_cast<EventKind>(kind), after, surface};
    return map_all(model, t0, x0, p, active, run,
                   [&](const AnySystem& system, double t, const Vector& x, const Vector& q,
                       const Directions& along) {
                       return section_map(system, section, t, x, q, max_time, iterate, along);
                   });
}

/// Lyapunov exponents of one solution over a window.
struct LyapunovResult {
    py::array_t<double> exponents, error;
    double t_begin = 0, t_end = 0;
    long long slides = 0, stretches = 0, skipped = 0;
    py::array_t<double> x;
    std::string status, message;
    py::object raised = py::none();
};

LyapunovResult exponents(const Model& model, const Doubles& p, const Doubles& x0,
                         const RunSettings& run, double transient, double window, double stretch,
                         int batches, const py::object& show) {
    Analysis analysis(model, run);
    const LyapunovSettings settings{.transient = transient,
                                    .window = window,
                                    .stretch = stretch,
                                    .batches = batches,
                                    .progress = progress(show, analysis.signals)};
    Lyapunov l;
    {
        const py::gil_scoped_release unlocked;
        l = lyapunov(*analysis.system, vector_of(p), vector_of(x0), settings);
    }
    return {.exponents = array_of(l.exponents),
            .error = array_of(l.error),
            .t_begin = l.t_begin,
            .t_end = l.t_end,
            .slides = l.slides,
            .stretches = l.stretches,
            .skipped = l.skipped,
            .x = array_of(l.x),
            .status = std::string(name(l.status)),
            .message = l.message,
            .raised = analysis.signals.raised()};
}

} // namespace

void bind_maps(py::module_& m) {
    bind_struct<LyapunovResult>(m, "LyapunovResult")
        .field("exponents", &LyapunovResult::exponents)
        .field("error", &LyapunovResult::error)
        .field("t_begin", &LyapunovResult::t_begin)
        .field("t_end", &LyapunovResult::t_end)
        .field("slides", &LyapunovResult::slides)
        .field("stretches", &LyapunovResult::stretches)
        .field("skipped", &LyapunovResult::skipped)
        .field("x", &LyapunovResult::x)
        .field("status", &LyapunovResult::status)
        .field("message", &LyapunovResult::message)
        .field("raised", &LyapunovResult::raised);
    m.def("lyapunov", &exponents);
    bind_struct<MapSampleColumns>(m, "MapSampleColumns")
        .field("phase", &MapSampleColumns::phase)
        .field("boundary", &MapSampleColumns::boundary)
        .field("value", &MapSampleColumns::value)
        .field("value_boundary", &MapSampleColumns::value_boundary)
        .field("slope", &MapSampleColumns::slope)
        .field("turns", &MapSampleColumns::turns)
        .field("true_exit", &MapSampleColumns::true_exit)
        .field("status", &MapSampleColumns::status)
        .field("word", &MapSampleColumns::word);
    bind_struct<FixedPointResult>(m, "FixedPointResult")
        .field("phase", &FixedPointResult::phase)
        .field("boundary", &FixedPointResult::boundary)
        .field("slope", &FixedPointResult::slope)
        .field("stable", &FixedPointResult::stable)
        .field("iterate", &FixedPointResult::iterate)
        .field("prime", &FixedPointResult::prime)
        .field("turns", &FixedPointResult::turns)
        .field("tangent", &FixedPointResult::tangent)
        .field("t", &FixedPointResult::t)
        .field("x", &FixedPointResult::x);
    bind_struct<MapGraphResult>(m, "MapGraphResult")
        .field("samples", &MapGraphResult::samples)
        .field("left", &MapGraphResult::left)
        .field("right", &MapGraphResult::right)
        .field("jump", &MapGraphResult::jump)
        .field("points", &MapGraphResult::points)
        .field("status", &MapGraphResult::status)
        .field("message", &MapGraphResult::message)
        .field("evaluations", &MapGraphResult::evaluations)
        .field("raised", &MapGraphResult::raised);
    m.def("map_graph", &graph);
    bind_struct<MapImages>(m, "MapImages")
        .field("samples", &MapImages::samples)
        .field("raised", &MapImages::raised);
    m.def("map_images", &images);
    bind_struct<MappedColumns>(m, "MappedColumns")
        .field("x", &MappedColumns::x)
        .field("t", &MappedColumns::t)
        .field("slope", &MappedColumns::slope)
        .field("param_slope", &MappedColumns::param_slope)
        .field("word", &MappedColumns::word)
        .field("slides", &MappedColumns::slides)
        .field("singular", &MappedColumns::singular)
        .field("status", &MappedColumns::status)
        .field("message", &MappedColumns::message)
        .field("raised", &MappedColumns::raised);
    m.def("section_map", &sections);
    m.def("strobe_map", &strobes);
}

} // namespace filippov::python
