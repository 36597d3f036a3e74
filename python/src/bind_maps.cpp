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

/// Points of a graph, one column a field.
py::dict columns(const std::vector<MapSample>& samples) {
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
    py::dict d;
    d["phase"] = column([](const MapSample& s) { return s.at.phase; });
    d["boundary"] =
        column([](const MapSample& s) { return static_cast<signed char>(s.at.boundary); });
    d["value"] = column([&](const MapSample& s) { return number(s, s.image.to.phase); });
    d["value_boundary"] = column([](const MapSample& s) {
        return static_cast<signed char>(s.image.ok() ? s.image.to.boundary : 0);
    });
    d["slope"] = column([&](const MapSample& s) { return number(s, s.image.slope); });
    d["turns"] = column([](const MapSample& s) { return s.image.ok() ? s.image.turns : 0LL; });
    d["true_exit"] = column([](const MapSample& s) -> unsigned char { return s.image.true_exit; });
    d["status"] = column([](const MapSample& s) { return static_cast<int>(s.image.status); });
    std::vector<std::string> words;
    for (const MapSample& s : samples)
        words.push_back(s.image.word);
    d["word"] = words;
    return d;
}

py::list points(const TransitionMap& map, const MapGraph& graph) {
    py::list list;
    for (const FixedPoint& f : graph.fixed_points) {
        const auto exit = map.exit_point(f.at);
        py::dict d;
        d["phase"] = f.at.phase;
        d["boundary"] = f.at.boundary;
        d["slope"] = f.slope;
        d["stable"] = f.stable();
        d["iterate"] = f.iterate;
        d["prime"] = f.prime;
        d["turns"] = f.turns;
        d["tangent"] = f.tangent;
        d["t"] = map.time_of(f.at.phase);
        d["x"] = std::vector<double>(exit->x.begin(), exit->x.end());
        list.append(d);
    }
    return list;
}

py::dict graph(const Model& model, const Doubles& p, const RunSettings& run, double max_periods,
               const std::optional<Doubles>& guess, int iterate, int samples,
               long long max_evaluations, const py::object& show) {
    Mapping map(model, p, run, max_periods, guess);
    const GraphSettings settings{.samples = samples,
                                 .max_evaluations = max_evaluations,
                                 .progress = progress(show, map.signals())};
    MapGraph g;
    {
        const py::gil_scoped_release unlocked;
        g = map_graph(*map, iterate, settings);
    }
    std::vector<MapSample> left, right;
    std::vector<bool> jump;
    for (const MapBreak& b : g.breaks) {
        left.push_back(b.left);
        right.push_back(b.right);
        jump.push_back(b.jump());
    }
    py::dict d;
    d["samples"] = columns(g.samples);
    d["left"] = columns(left);
    d["right"] = columns(right);
    d["jump"] = jump;
    d["points"] = points(*map, g);
    d["status"] = std::string(name(g.status));
    d["message"] = g.message;
    d["evaluations"] = g.evaluations;
    d["raised"] = map.raised();
    return d;
}

py::dict images(const Model& model, const Doubles& p, const RunSettings& run, double max_periods,
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
    py::dict d = columns(samples);
    d["raised"] = map.raised();
    return d;
}

// --- strobe and section ------------------------------------------------------------------------

/// What maps of many starts give, one entry each.
struct MappedColumns {
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
    py::dict to_dict(py::ssize_t dim, py::ssize_t params) {
        const auto n = py::ssize_t(t.size());
        py::dict d;
        d["x"] = as_array(std::move(x), {n, dim});
        d["t"] = as_array(std::move(t), {n});
        d["slope"] = as_array(std::move(slope), {n, dim + 1, dim + 1});
        d["param_slope"] = as_array(std::move(param_slope), {n, dim + 1, params});
        d["word"] = word;
        d["status"] = status;
        d["message"] = message;
        d["slides"] = as_array(std::move(slides), {n});
        d["singular"] = as_array(std::move(singular), {n});
        return d;
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
py::dict map_all(const Model& model, const Doubles& t0, const Doubles& x0, const Doubles& p,
                 const std::vector<int>& active, const RunSettings& run, Map map) {
    const auto dim = py::ssize_t(model.facts().dim);
    expect(x0.ndim() == 2 && x0.shape(1) == dim, "x0 has shape (k, dim)");
    expect(t0.size() == x0.shape(0), "t0 has one entry a start");
    const Analysis analysis(model, run);
    const Vector params = vector_of(p);
    MappedColumns columns;
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
        columns.add(first, by_params);
    };
    {
        const py::gil_scoped_release unlocked;
        for (py::ssize_t k = 0; k < x0.shape(0) && !analysis.signals.has_raised(); ++k)
            one(t0.data()[k], Eigen::Map<const Vector>(x0.data(k, 0), dim));
    }
    py::dict d = columns.to_dict(dim, py::ssize_t(active.size()));
    d["raised"] = analysis.signals.raised();
    return d;
}

py::dict strobes(const Model& model, const Doubles& t0, const Doubles& x0, const Doubles& p,
                 const std::vector<int>& active, const RunSettings& run, int iterate) {
    return map_all(
        model, t0, x0, p, active, run,
        [&](const AnySystem& system, double t, const Vector& x, const Vector& q,
            const Directions& along) { return strobe(system, t, x, q, iterate, along); });
}

py::dict sections(const Model& model, const Doubles& t0, const Doubles& x0, const Doubles& p,
                  const std::vector<int>& active, const RunSettings& run, int iterate, int kind,
                  int after, int surface, double max_time) {
    const SectionOf section{static_cast<EventKind>(kind), after, surface};
    return map_all(model, t0, x0, p, active, run,
                   [&](const AnySystem& system, double t, const Vector& x, const Vector& q,
                       const Directions& along) {
                       return section_map(system, section, t, x, q, max_time, iterate, along);
                   });
}

py::dict exponents(const Model& model, const Doubles& p, const Doubles& x0, const RunSettings& run,
                   double transient, double window, double stretch, int batches,
                   const py::object& show) {
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
    py::dict d;
    d["exponents"] = array_of(l.exponents);
    d["error"] = array_of(l.error);
    d["t_begin"] = l.t_begin;
    d["t_end"] = l.t_end;
    d["slides"] = l.slides;
    d["stretches"] = l.stretches;
    d["skipped"] = l.skipped;
    d["x"] = array_of(l.x);
    d["status"] = std::string(name(l.status));
    d["message"] = l.message;
    d["raised"] = analysis.signals.raised();
    return d;
}

} // namespace

void bind_maps(py::module_& m) {
    m.def("lyapunov", &exponents);
    m.def("map_graph", &graph);
    m.def("map_images", &images);
    m.def("section_map", &sections);
    m.def("strobe_map", &strobes);
}

} // namespace filippov::python
