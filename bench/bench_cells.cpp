// SPDX-License-Identifier: BSD-3-Clause
// What does the image pass of a cell map cost at which error, in lanes, beside a loop written by
// hand for this one problem?
//
// The oscillator at (A, omega) = (3.6, 1.067), the centres of n x n cells of [-4, 4] x [-3, 4], one
// forcing period forward. Errors are those of the images, against a run at 1e-13 that is itself
// compared with quadruple precision. Times are of the processor, but those of two threads.

#include "measure.hpp"
#include "pictures.hpp"
#include "rivals/hand_loop.hpp"
#include "rivals/reference_oscillator.hpp"

#include <filippov/basins/cells.hpp>
#include <filippov/ensemble/ensemble.hpp>
#include <filippov/models/oscillator.hpp>

#include <atomic>
#include <cmath>
#include <cstdio>
#include <string_view>

namespace {

using namespace filippov;
using Sys = models::Oscillator;
using X = Vec<double, 2>;
using P = Params<Sys, double>;
using Run = Settings<double, 2>;

/// Starts at t = 0 that are run together.
struct Scene {
    P p;
    double t_end;
    std::vector<X> starts{};

    double n() const { return double(starts.size()); }
};

/// What came of a scene, and what was done for it; what a method does not count is 0.
struct Pass {
    std::vector<X> images{};
    bool ok = true;
    LaneCounters done{};
};

P oscillator() {
    P p = default_params<Sys>();
    p[0] = 3.6;
    p[1] = 1.067;
    return p;
}
double forcing_period() { return Sys{}.period(oscillator()); }

Scene cell_centres(int n) {
    const CellGrid grid({0, -4, 4, n}, {1, -3, 4, n});
    Scene scene{oscillator(), forcing_period()};
    for (std::int32_t cell = 0; cell < grid.cells(); ++cell)
        scene.starts.push_back({grid.centre(cell)[0], grid.centre(cell)[1]});
    return scene;
}

// --- methods -------------------------------------------------------------------------------------

Pass by_hand(const Scene& scene, double tolerance) {
    Pass pass;
    for (const X& x : scene.starts) {
        const auto r = rivals::hand_loop(scene.p[0], scene.p[1], x[0], x[1], 1, tolerance);
        pass.images.push_back({r.y, r.v});
        pass.done.steps += r.n_steps + r.n_rejected;
    }
    return pass;
}

template <class Tableau> Pass one_by_one(const Scene& scene, double tolerance) {
    const Run settings{.rtol = tolerance, .atol = tolerance};
    Pass pass;
    for (const X& x : scene.starts) {
        const auto r = flow<Tableau>(Sys{}, scene.p, x, 0.0, scene.t_end, settings);
        pass.images.push_back(r.x);
        pass.ok = pass.ok && r.status == Status::ok;
        pass.done.steps += r.counters.steps + r.counters.rejected;
        pass.done.searches += r.counters.root_searches;
        pass.done.landings += r.counters.landings;
    }
    return pass;
}

class Cells : public Population<2, 10> {
public:
    std::vector<X> images;
    std::atomic<bool> ok{true};

    explicit Cells(const Scene& scene) : images(scene.starts.size()), scene_(scene) {
        same_params = true;
    }
    Member<2, 10> member(std::size_t id) override {
        return {scene_.starts[id], scene_.p, 0, scene_.t_end};
    }
    void take(std::size_t id, const Outcome<2>& o) override {
        images[id] = o.x;
        if (o.status != Status::ok)
            ok = false;
    }

private:
    const Scene& scene_;
};

template <class Tableau, int W = native_lanes>
Pass run_lanes(const Scene& scene, const Run& settings, int threads = 1) {
    Cells cells(scene);
    const auto run = run_population<Tableau, W>(Sys{}, scene.starts.size(), cells, settings,
                                                Parallel{.threads = threads});
    return {std::move(cells.images), cells.ok, run.counters};
}
template <class Tableau, int W> Pass in_lanes(const Scene& scene, double tolerance) {
    return run_lanes<Tableau, W>(scene, {.rtol = tolerance, .atol = tolerance});
}

struct Candidate {
    std::string_view name, tableau;
    int lanes; ///< 0: not in lanes
    Pass (*run)(const Scene&, double tolerance);
};

std::vector<Candidate> methods() {
    std::vector<Candidate> all{{"hand", "dopri5", 0, by_hand},
                               {"scalar", "dopri5", 0, one_by_one<DormandPrince5>},
                               {"scalar", "dop853", 0, one_by_one<DormandPrince8>},
                               {"lanes", "dopri5", 1, in_lanes<DormandPrince5, 1>},
                               {"lanes", "dop853", 1, in_lanes<DormandPrince8, 1>}};
    if constexpr (native_lanes > 1) {
        constexpr int W = native_lanes;
        all.push_back({"lanes", "dopri5", W, in_lanes<DormandPrince5, W>});
        all.push_back({"lanes", "dop853", W, in_lanes<DormandPrince8, W>});
    }
    return all;
}

// --- the reference -------------------------------------------------------------------------------

struct Reference {
    std::vector<X> images{};
    std::vector<int> events{};
    double exits = 0; ///< ends of slides, a start
};

struct CountEvents {
    int events = 0, exits = 0;
    operator Observer<double, 2, 1>() {
        return {.event = [this](const Event<double, 2, 1>& e) {
            events += e.mode_before != e.mode_after && e.kind != EventKind::start;
            exits += e.kind == EventKind::exit_sliding;
        }};
    }
};

Reference reference_of(const Scene& scene) {
    const Run settings{.rtol = 1e-13, .atol = 1e-13};
    Reference r;
    for (const X& x : scene.starts) {
        CountEvents seen;
        r.images.push_back(
            flow<DormandPrince8>(Sys{}, scene.p, x, 0.0, scene.t_end, settings, seen).x);
        r.events.push_back(seen.events);
        r.exits += seen.exits / scene.n();
    }
    return r;
}

/// The largest difference of such a run from quadruple precision; infinite if an event is missing.
double error_of_reference() {
    Scene scene{oscillator(), forcing_period()};
    for (const auto& exact : rivals::reference_images)
        scene.starts.push_back({exact.y0, exact.v0});
    const Reference r = reference_of(scene);
    double worst = 0;
    for (std::size_t i = 0; i < r.images.size(); ++i) {
        const auto& exact = rivals::reference_images[i];
        if (r.events[i] != exact.n_events)
            return std::numeric_limits<double>::infinity();
        const X x(static_cast<double>(exact.y), static_cast<double>(exact.v));
        worst = std::max(worst, (r.images[i] - x).cwiseAbs().maxCoeff());
    }
    return worst;
}

struct Errors {
    double median, nearly_all, largest; ///< nearly all: 99 %
};

Errors errors_of(const Pass& pass, const Reference& reference) {
    std::vector<double> each;
    for (std::size_t i = 0; i < pass.images.size(); ++i) {
        const double e = (pass.images[i] - reference.images[i]).cwiseAbs().maxCoeff();
        each.push_back(e >= 0 ? e : std::numeric_limits<double>::infinity());
    }
    std::sort(each.begin(), each.end());
    return {each[each.size() / 2], each[each.size() * 99 / 100], each.back()};
}

// --- rows ----------------------------------------------------------------------------------------

struct Row {
    Candidate method;
    double tolerance;
    Errors error;
    LaneCounters done;
    double n; ///< cells
    double ms = 0;

    double a_cell(long long count) const { return double(count) / n; }
    double ns_a_cell() const { return 1e6 * ms / n; }
};

/// What a row must be, whatever time it took.
bool is_right(const Row& row, const Pass& pass) {
    // below some thousand cells, lanes that run dry at the end count
    const bool full = row.n < 1e4 || row.done.occupancy() >= 0.9;
    return pass.ok && full && row.error.nearly_all < 100 * row.tolerance &&
           row.error.largest < 1000 * row.tolerance;
}

void print(const Row& r) {
    const Candidate& m = r.method;
    std::printf("%-6s %-6s %5d %7.0e %8.0f %8.1e %8.1e %8.1e %6.1f", m.name.data(),
                m.tableau.data(), m.lanes, r.tolerance, 1e9 / r.ns_a_cell(), r.error.median,
                r.error.nearly_all, r.error.largest, r.a_cell(r.done.steps));
    if (r.done.searches > 0)
        std::printf(" %8.2f %8.2f", r.a_cell(r.done.searches), r.a_cell(r.done.landings));
    if (m.lanes > 0)
        std::printf(" %7.2f %8.4f %6.3f", r.a_cell(r.done.windows), r.a_cell(r.done.handed_over),
                    r.done.occupancy());
    std::printf("\n");
}
nlohmann::json to_json(const Row& r) {
    return {{"method", r.method.name},
            {"tableau", r.method.tableau},
            {"lanes", r.method.lanes},
            {"tolerance", r.tolerance},
            {"cells_per_second", 1e9 / r.ns_a_cell()},
            {"error_median", r.error.median},
            {"error_99_percent", r.error.nearly_all},
            {"error_largest", r.error.largest},
            {"steps", r.a_cell(r.done.steps)},
            {"searches", r.a_cell(r.done.searches)},
            {"landings", r.a_cell(r.done.landings)},
            {"windows", r.a_cell(r.done.windows)},
            {"handed_over", r.a_cell(r.done.handed_over)},
            {"occupancy", r.done.occupancy()}};
}
nlohmann::json print(const std::vector<Row>& rows) {
    std::printf("%-6s %-6s %5s %7s %8s %8s %8s %8s %6s %8s %8s %7s %8s %6s\n", "method", "pair",
                "lanes", "tol", "cells/s", "median", "99 %", "largest", "steps", "searches",
                "landings", "windows", "handed", "full");
    nlohmann::json results = nlohmann::json::array();
    for (const Row& row : rows) {
        print(row);
        results.push_back(to_json(row));
    }
    return results;
}

/// Time in which 99 % of the cells have no larger error, by the faster pair of a method.
double time_at_error(const std::vector<Row>& rows, double error, std::string_view name, int lanes) {
    double best = std::numeric_limits<double>::infinity();
    for (const std::string_view tableau : {"dopri5", "dop853"}) {
        std::vector<bench::Point> points;
        for (const Row& row : rows)
            if (row.method.name == name && row.method.lanes == lanes &&
                row.method.tableau == tableau)
                points.push_back({row.error.nearly_all, row.ms});
        best = std::min(best, bench::time_at_error(points, error));
    }
    return best;
}

nlohmann::json compare_with_hand(const std::vector<Row>& rows) {
    std::printf("\ntime of the hand loop / time, where 99 %% of the cells have no larger error\n"
                "%8s %8s %8s %8s\n",
                "error", "scalar", "1 lane", (std::to_string(native_lanes) + " lanes").c_str());
    nlohmann::json gains = nlohmann::json::array();
    for (const double error : {1e-5, 1e-7, 1e-9, 1e-11}) {
        const auto gain = [&](std::string_view name, int lanes) {
            return time_at_error(rows, error, "hand", 0) / time_at_error(rows, error, name, lanes);
        };
        const double scalar = gain("scalar", 0), one = gain("lanes", 1),
                     all = gain("lanes", native_lanes);
        std::printf("%8.0e %8.2f %8.2f %8.2f\n", error, scalar, one, all);
        gains.push_back({{"error", error}, {"scalar", scalar}, {"one_lane", one}, {"lanes", all}});
    }
    return gains;
}

// --- the floor -----------------------------------------------------------------------------------

volatile double sink; ///< what a loop that is only timed computes goes here

/// A number that the compiler does not know: with constants it would compute beforehand.
double unknown(double known) {
    volatile double v = known;
    return v;
}

/// A point in slip, in every lane.
template <int W> struct InSlip {
    Lanes<W> t{unknown(0.3)};
    Vec<Lanes<W>, 2> x{Lanes<W>(unknown(0.5)), Lanes<W>(unknown(-0.5))};
    Vec<Lanes<W>, 10> p;

    InSlip() {
        const P known = oscillator();
        for (int i = 0; i < 10; ++i)
            p[i] = unknown(known[i]);
    }
};

constexpr std::size_t n_pieces = 4000; ///< timed together

/// Evaluations of a field, of which eight at a time do not wait for each other.
template <int W> FILIPPOV_FLATTEN void evaluate_fields() {
    using T = Lanes<W>;
    const InSlip<W> at;
    const Vec<T, 10> p = at.p;
    const T tiny = unknown(1e-9);
    std::array<Vec<T, 2>, 8> points;
    for (std::size_t j = 0; j < points.size(); ++j)
        points[j] = {at.x[0] + T(0.1 * double(j)), at.x[1]};
    T t = at.t;
    for (std::size_t k = 0; k < n_pieces; k += points.size()) {
        for (auto& x : points) {
            const Vec<T, 2> f = Sys{}.f1(t, x, p);
            x = {fused(tiny, f[0], x[0]), fused(tiny, f[1], x[1])};
        }
        t += tiny;
    }
    for (const auto& x : points)
        sink = (x[0] + x[1])[0];
}

/// Steps without error, guard or clock, each from the end of the last.
template <class Tableau, int W> FILIPPOV_FLATTEN void take_bare_steps() {
    using T = Lanes<W>;
    const InSlip<W> at;
    const Vec<T, 10> p = at.p;
    const T dt = unknown(1e-5);
    const auto rhs = [&](std::size_t, const T& t, const Vec<T, 2>& x)
                         FILIPPOV_LAMBDA_INLINE { return Sys{}.f1(t, x, p); };
    RungeKutta<Tableau, T, 2> rk;
    T t = at.t;
    Vec<T, 2> x = at.x;
    rk.k[0] = rhs(0, t, x);
    for (std::size_t k = 0; k < n_pieces; ++k) {
        Vec<T, 2> x1;
        rk.step(rhs, t, x, dt, x1);
        rk.k[0] = rk.k[rk.last];
        x = x1;
        t += dt;
    }
    sink = (x[0] + x[1])[0];
}

/// Nanoseconds a lane.
struct Floor {
    double field, step, step_of_two; ///< of two: in twice as many lanes
};
template <class Tableau> Floor floor_of(int turns) {
    constexpr int W = native_lanes;
    const auto ms = bench::time_in_turns(
        {evaluate_fields<W>, take_bare_steps<Tableau, W>, take_bare_steps<Tableau, 2 * W>},
        20 * turns, bench::cpu_ms);
    const double ns = 1e6 / double(n_pieces) / W;
    return {ns * ms[0], ns * ms[1], ns * ms[2] / 2};
}

// --- where the time of a run goes ----------------------------------------------------------------

/// Nanoseconds a lane of what a run does.
struct Costs {
    double start = 0, step = 0, event = 0, window = 0, exit = 0;
};

/// Measures each with scenes that consist of it. What these need besides is subtracted, so that
/// errors add up: least is known of exits.
template <class Tableau> class CostsOf {
public:
    CostsOf(const Scene& cells, double tolerance, int turns)
        : cells_(cells), turns_(turns), plain_{.rtol = tolerance, .atol = tolerance} {}

    Costs measure() {
        const P p = cells_.p;
        const double T0 = forcing_period();
        P free = p; // no friction, and the surface out of reach
        free[5] = 1000;
        free[6] = free[8] = free[9] = 0;
        P slow = p; // a belt that nearly rests: slides without end
        slow[0] = 1;
        slow[5] = 1e-3;
        // A first step that is known lets lanes judge an exit at once, as one that was learned.
        Run known = plain_;
        known.first_step = 0.05;
        enum { at_once, short_slip, long_slip, short_slide, long_slide, crossing, leaving };
        add({p, 1e-9 * T0, cells_.starts}, plain_);
        add({free, T0, cells_.starts}, plain_);
        add({free, 3 * T0, cells_.starts}, plain_);
        add(all_at({slow, 4 * T0}, {0, 1e-3}, {0, 1e-3}), plain_);
        add(all_at({slow, 40 * T0}, {0, 1e-3}, {0, 1e-3}), plain_);
        add(all_at({p, 0.01}, {-9, 0.99}, {-6, 0.99}), plain_);
        // from the edge of the sliding region, y = A + 4 at t = 0
        add(all_at({p, 0.5}, {7.595, 1}, {7.599, 1}), known);
        time();
        Costs c;
        c.step = (ns_[long_slip] - ns_[short_slip]) /
                 double(done_[long_slip].steps - done_[short_slip].steps);
        c.window = (ns_[long_slide] - ns_[short_slide]) /
                   double(done_[long_slide].windows - done_[short_slide].windows);
        c.start = beyond(at_once, c) / cells_.n();
        c.event = beyond(crossing, c) / double(done_[crossing].landings);
        c.exit = beyond(leaving, c) / cells_.n();
        return c;
    }

private:
    void add(const Scene& scene, const Run& settings) {
        scenes_.push_back(scene);
        settings_.push_back(settings);
    }
    /// Starts on a line, as many as there are cells.
    Scene all_at(Scene scene, const X& from, const X& to) const {
        for (std::size_t i = 0; i < cells_.starts.size(); ++i)
            scene.starts.push_back(from + (to - from) * (double(i) / cells_.n()));
        return scene;
    }
    void time() {
        std::vector<std::function<void()>> runs;
        for (std::size_t k = 0; k < scenes_.size(); ++k) {
            const auto run = [this, k] { return run_lanes<Tableau>(scenes_[k], settings_[k]); };
            done_.push_back(run().done);
            runs.push_back([run] { static_cast<void>(run()); });
        }
        for (const double ms : bench::time_in_turns(runs, turns_, bench::cpu_ms))
            ns_.push_back(1e6 * ms);
    }
    /// Time of a scene without what is known.
    double beyond(std::size_t k, const Costs& c) const {
        return ns_[k] - cells_.n() * c.start - double(done_[k].steps) * c.step -
               double(done_[k].landings) * c.event - double(done_[k].windows) * c.window;
    }

    const Scene& cells_;
    int turns_;
    Run plain_;
    std::vector<Scene> scenes_;
    std::vector<Run> settings_;
    std::vector<LaneCounters> done_;
    std::vector<double> ns_;
};

template <class Tableau>
nlohmann::json explain(const Row& row, const Scene& cells, const Reference& reference, int turns) {
    const double total = row.ns_a_cell();
    std::printf("\n%s in %d lanes, tolerance %.0e: %.0f ns a cell\n", row.method.tableau.data(),
                native_lanes, row.tolerance, total);
    nlohmann::json parts = nlohmann::json::object();
    const auto part = [&](const char* what, double count, double each) {
        const double ns = count * each;
        std::printf("  %-24s %6.1f of %6.2f ns = %5.0f ns, %3.0f %%\n", what, count, each, ns,
                    100 * ns / total);
        parts[what] = {{"count", count}, {"ns_each", each}, {"share", ns / total}};
        return ns;
    };
    const Floor floor = floor_of<Tableau>(turns);
    const double tries = row.a_cell(row.done.steps + row.done.searches + row.done.landings);
    const double fields = tries * (Tableau::stages - 1) +
                          row.a_cell(row.done.searches) * double(Tableau::extra_stages);
    part("floor: fields alone", fields, floor.field);
    part("floor: bare steps", tries, floor.step);
    part("... two in each other", tries, floor.step_of_two);

    const Costs c = CostsOf<Tableau>(cells, row.tolerance, turns).measure();
    const double known = part("starts and ends", 1, c.start) +
                         part("steps", row.a_cell(row.done.steps), c.step) +
                         part("events", row.a_cell(row.done.landings), c.event) +
                         part("windows of slides", row.a_cell(row.done.windows), c.window) +
                         part("ends of slides", reference.exits, c.exit);
    part("rest", 1, total - known);
    return {{"tableau", row.method.tableau},
            {"tolerance", row.tolerance},
            {"ns_a_cell", total},
            {"parts", parts}};
}

// --- threads -------------------------------------------------------------------------------------

/// Wall time of one thread over that of two; 0 without threads.
double gain_of_two_threads(const Scene& cells, int turns) {
    if (detail::team_size(2, 2) < 2)
        return 0;
    const Run settings{.rtol = 1e-8, .atol = 1e-8};
    const auto with = [&](int threads) {
        return [&cells, settings, threads] {
            static_cast<void>(run_lanes<DormandPrince8>(cells, settings, threads));
        };
    };
    const auto ms = bench::time_in_turns({with(1), with(2)}, 5 * turns);
    return ms[0] / ms[1];
}

/// The same bits in one lane and in many, on one thread and on two.
template <class Tableau> bool depends_on_cells_alone(const Scene& cells) {
    const Run settings{.rtol = 1e-6, .atol = 1e-6};
    const auto one = run_lanes<Tableau, 1>(cells, settings).images;
    return one == run_lanes<Tableau>(cells, settings).images &&
           one == run_lanes<Tableau>(cells, settings, 2).images;
}

} // namespace

int main(int argc, char** argv) {
    int n = 100, side = 500;
    const auto options = bench::parse(argc, argv, "Cell maps and basins", [&](CLI::App& app) {
        app.add_option("--cells", n, "cells along either coordinate")->check(CLI::Range(2, 2000));
        app.add_option("--picture", side, "the same, of the picture of basins")
            ->check(CLI::Range(2, 2000));
    });
    if (options.quick) {
        n = std::min(n, 20);
        side = std::min(side, 30);
    }
    const Scene cells = cell_centres(n);
    const Reference reference = reference_of(cells);
    const double reference_error = error_of_reference();
    bool right = reference_error < 1e-12 && depends_on_cells_alone<DormandPrince5>(cells) &&
                 depends_on_cells_alone<DormandPrince8>(cells);

    std::vector<Row> rows;
    std::vector<std::function<void()>> runs;
    for (const Candidate& method : methods())
        for (int k = 4; k <= (method.run == by_hand ? 13 : 12); ++k) {
            const double tolerance = std::pow(10.0, -k);
            const Pass pass = method.run(cells, tolerance);
            rows.push_back({method, tolerance, errors_of(pass, reference), pass.done, cells.n()});
            right = right && is_right(rows.back(), pass);
            runs.push_back([&cells, method, tolerance] { method.run(cells, tolerance); });
        }
    const auto ms = bench::time_in_turns(runs, options.turns, bench::cpu_ms);
    for (std::size_t i = 0; i < rows.size(); ++i)
        rows[i].ms = ms[i];

    std::printf("%d x %d cells; reference within %.1e of quadruple precision\n\n", n, n,
                reference_error);
    nlohmann::json results{{"cells", n}, {"native_lanes", native_lanes}};
    results["rows"] = print(rows);
    results["gain_over_hand_at_equal_error"] = compare_with_hand(rows);
    for (const Row& row : rows)
        if (row.method.name == "lanes" && row.method.lanes == native_lanes &&
            (row.tolerance == 1e-6 || row.tolerance == 1e-9))
            results["where_the_time_goes"].push_back(
                row.method.tableau == "dopri5"
                    ? explain<DormandPrince5>(row, cells, reference, options.turns)
                    : explain<DormandPrince8>(row, cells, reference, options.turns));
    const double two = gain_of_two_threads(cells, options.turns);
    std::printf("\nwall time on one thread / on two (dop853, tolerance 1e-08): %.2f\n", two);
    results["gain_of_two_threads"] = two;
    const bench::Pictures pictures = bench::pictures(side, options.quick ? 1 : 6, options.turns);
    results["pictures"] = pictures.results;
    right = right && pictures.same;
    bench::write_json(options, results);
    if (!right)
        std::printf("a run is wrong: a status, an error beyond the tolerance, idle lanes, bits "
                    "that depend on lanes or threads, or two labels of a cell\n");
    return right ? 0 : 1;
}
