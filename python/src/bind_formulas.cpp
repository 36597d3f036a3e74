// SPDX-License-Identifier: BSD-3-Clause
#include "bind.hpp"
#include "tape_shapes.hpp"

#include <filippov/engine/time_stepping.hpp>
#include <filippov/formulas/switch_formulas.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>
#include <memory>
#include <tuple>
#include <utility>

namespace filippov::python {

namespace {

using GraphPointer = std::shared_ptr<Graph>;
using NodeRow = std::tuple<std::string, Expr, Expr, Expr, int, double>;

struct Named {
    Op op;
    const char* name;
};
constexpr std::array names{
    Named{Op::constant, "constant"}, Named{Op::time, "time"},
    Named{Op::state, "state"},       Named{Op::param, "param"},
    Named{Op::call, "call"},         Named{Op::add, "add"},
    Named{Op::sub, "sub"},           Named{Op::mul, "mul"},
    Named{Op::div, "div"},           Named{Op::pow, "pow"},
    Named{Op::neg, "neg"},           Named{Op::powi, "powi"},
    Named{Op::sqrt, "sqrt"},         Named{Op::exp, "exp"},
    Named{Op::log, "log"},           Named{Op::sin, "sin"},
    Named{Op::cos, "cos"},           Named{Op::tan, "tan"},
    Named{Op::asin, "asin"},         Named{Op::atan, "atan"},
    Named{Op::sinh, "sinh"},         Named{Op::cosh, "cosh"},
    Named{Op::tanh, "tanh"},         Named{Op::sign, "sign"},
    Named{Op::where, "where"},       Named{Op::magnitude, "magnitude"},
    Named{Op::unit2, "unit2"},       Named{Op::unit3, "unit3"},
};
const char* name_of(Op op) {
    for (const Named& n : names)
        if (n.op == op)
            return n.name;
    return "";
}
Op op_of(const std::string& name) {
    for (const Named& n : names)
        if (name == n.name)
            return n.op;
    throw std::invalid_argument("filippov._core: no operation " + name);
}

/// An expression of this graph.
Expr known(const Graph& graph, Expr e) {
    expect(e >= 0 && std::size_t(e) < graph.size(), "an expression is a number of its graph");
    return e;
}
std::vector<Expr> all_known(const Graph& graph, const std::vector<Expr>& all) {
    for (const Expr e : all)
        known(graph, e);
    return all;
}

std::vector<NodeRow> rows_of(const Graph& graph) {
    std::vector<NodeRow> rows;
    for (Expr e = 0; e < Expr(graph.size()); ++e) {
        const Graph::Node& n = graph[e];
        rows.emplace_back(name_of(n.op), n.arg[0], n.arg[1], n.arg[2], n.index, n.value);
    }
    return rows;
}
/// A graph again from its rows. Each is made as it was: its number is its place.
GraphPointer graph_of(const std::vector<NodeRow>& rows) {
    auto graph = std::make_shared<Graph>();
    for (const auto& [name, a, b, c, index, value] : rows) {
        const Op op = op_of(name);
        expect(op != Op::call, "functions cannot be written down");
        expect(std::isfinite(value), "a constant is finite");
        expect(index > -1000 && index < 1000 && (index >= 0 || op == Op::powi) &&
                   (!is_unit(op) || index < arity(op)),
               "an index is one of a component, a parameter or a power");
        const std::array<Expr, 3> arg{a, b, c};
        for (int k = 0; k < 3; ++k)
            if (k < arity(op))
                known(*graph, arg[std::size_t(k)]);
            else
                expect(arg[std::size_t(k)] == -1, "an operation has its operands");
        const Expr e = graph->restore({op, arg, index, value});
        expect(std::size_t(e) + 1 == graph->size(), "nodes of a graph are made once");
    }
    return graph;
}

/// An object of Python's that C++ holds, in whatever thread it lets go of it.
std::shared_ptr<py::object> held(py::object object) {
    return {new py::object(std::move(object)), [](py::object* o) {
                py::gil_scoped_acquire gil;
                delete o;
            }};
}
std::shared_ptr<External> external(const std::string& name, int dim, int params, int outputs,
                                   const std::vector<double>& scale) {
    auto f = std::make_shared<External>();
    f->name = name;
    f->dim = dim;
    f->params = params;
    f->outputs = outputs;
    f->scale = scale;
    expect(dim >= 1 && params >= 0 && outputs >= 1, "a function has inputs and outputs");
    expect(scale.size() == std::size_t(f->inputs()), "scale has one entry an input");
    for (const double size : scale)
        expect(size > 0 && std::isfinite(size), "a scale is positive");
    return f;
}
External::Function pointer(std::uintptr_t address, const std::shared_ptr<py::object>& owner) {
    using Pointer = void (*)(double, const double*, const double*, double*);
    expect(address != 0, "an address is not null");
    return [f = reinterpret_cast<Pointer>(address),
            owner](double t, const double* x, const double* p, double* out) { f(t, x, p, out); };
}
/// A function of machine code, and its Jacobian's address or 0. `owner` is kept as long as they
/// are.
int add_pointer(Graph& graph, const std::string& name, int dim, int params, int outputs,
                const std::vector<double>& scale, std::uintptr_t address, std::uintptr_t jacobian,
                py::object owner) {
    const auto kept = held(std::move(owner));
    auto f = external(name, dim, params, outputs, scale);
    f->value = pointer(address, kept);
    if (jacobian != 0) {
        auto j = external(name, dim, params, outputs * dim, scale);
        j->value = pointer(jacobian, kept);
        f->jacobian = std::move(j);
    }
    return graph.add_function(std::move(f));
}
/// A function f(t, x, p) of Python's, of a number and two tuples; it returns a sequence.
int add_callable(Graph& graph, const std::string& name, int dim, int params, int outputs,
                 const std::vector<double>& scale, py::object function) {
    auto f = external(name, dim, params, outputs, scale);
    f->value = [function = held(std::move(function)), dim, params,
                outputs](double t, const double* x, const double* p, double* out) {
        py::gil_scoped_acquire gil;
        const auto tuple_of = [](const double* values, int n) {
            py::tuple tuple(static_cast<std::size_t>(n));
            for (int i = 0; i < n; ++i)
                tuple[static_cast<std::size_t>(i)] = values[i];
            return tuple;
        };
        try {
            const py::sequence result = (*function)(t, tuple_of(x, dim), tuple_of(p, params));
            expect(result.size() == std::size_t(outputs), "a function returns its outputs");
            for (int i = 0; i < outputs; ++i)
                out[i] = py::cast<double>(result[static_cast<std::size_t>(i)]);
        } catch (const py::error_already_set& error) {
            if (!SignalCheck::defers(error))
                throw;
            std::fill_n(out, outputs, std::numeric_limits<double>::quiet_NaN());
        }
    };
    return graph.add_function(std::move(f));
}

/// Smoothing of a right-hand side: a law, and which parameters are its steepness and band.
struct SmoothingParams {
    SmoothLaw law;
    int c1, band; ///< band -1: nobody watches
};

/// @error std::invalid_argument for formulas with a direction
void refuse_directions(const Graph& graph, const std::vector<Expr>& field, const char* done) {
    for (const Expr e : graph.below(field))
        if (is_unit(graph[e].op))
            throw std::invalid_argument(
                std::string("filippov: a direction (unit) cannot be ") + done +
                ": write v/np.sqrt(v @ v + eps**2), with a parameter eps, for it");
}

/// Splits a right-hand side whose switches are smoothed. The surfaces are the ends of the bands, as
/// in Smoothed.
void split_smoothed(Definition& d, const std::vector<Expr>& field, const std::vector<Expr>& named,
                    const SmoothingParams& how) {
    Graph& graph = d.graph;
    const Expr c1 = graph.param(how.c1), one = graph.constant(1);
    refuse_directions(graph, field, "smoothed");
    const SmoothFormulas smooth = smooth_formulas(graph, field, how.law, c1);
    if (smooth.argument.empty())
        throw std::invalid_argument("filippov: nothing switches that could be smoothed");
    filippov::detail::Splitter splitter(graph, d.dim, d.defaults);
    for (const Expr h : named)
        splitter.add_surface(h);
    for (const Expr u : smooth.argument)
        splitter.side_of(u);
    const std::vector<Expr> surfaces(splitter.surfaces().begin(), splitter.surfaces().end());
    for (const Expr u : smooth.argument)
        d.layer.push_back(graph.mul(c1, u));
    std::vector<Expr> corners;
    if (how.law == SmoothLaw::saturation)
        for (const Expr u : smooth.argument) {
            const Expr v = graph.mul(c1, u);
            corners.push_back(graph.sub(graph.neg(v), one));
            corners.push_back(graph.sub(v, one));
        }
    split(d, smooth.field, corners);
    if (how.band < 0 || how.law == SmoothLaw::saturation)
        return;
    const Expr band = graph.param(how.band);
    for (const Expr h : surfaces) {
        watch(d, graph.sub(graph.neg(h), band));
        watch(d, graph.sub(h, band));
    }
}

/// True if systems of n components and these surfaces are compiled as this shape.
template <int N, int M> bool holds(const TapeProgram& tapes, int n) {
    const auto& kinds = tapes.kind;
    if (tapes.directions && M <= 2)
        return false;
    if (M == 1)
        return kinds.size() == 1 && kinds[0] == SurfaceKind::switching && fits_dims<N>(n);
    return kinds.size() <= std::size_t(M) && n <= N;
}
/// The model of the first shape that holds n components and these surfaces.
template <int... N, int... M>
std::shared_ptr<const Model> tape_model_of(TapeShapes<TapeShape<N, M>...>, int n,
                                           const Facts& facts,
                                           const std::shared_ptr<const TapeProgram>& tapes) {
    std::shared_ptr<const Model> model;
    static_cast<void>(
        ((holds<N, M>(*tapes, n) && (model = tape_model<N, M>(facts, tapes))) || ...));
    expect(n >= 1 && model, "not too many components");
    return model;
}
template <int... N, int... M> constexpr int most_of(TapeShapes<TapeShape<N, M>...>) {
    return std::max({N...});
}

/// A system of formulas, and these split along its surfaces.
struct DefinedSystem {
    std::shared_ptr<Model> model;
    std::vector<Expr> h;
    std::vector<std::vector<Expr>> region;
    GraphPointer graph;
};

DefinedSystem define(const GraphPointer& graph, const std::string& name,
                     const std::vector<std::string>& state, const std::vector<std::string>& params,
                     const std::vector<double>& defaults, const std::vector<Expr>& field,
                     const std::vector<Expr>& named,
                     const std::vector<std::pair<Expr, std::vector<Expr>>>& jumps,
                     const std::optional<Expr>& period,
                     const std::optional<std::tuple<int, int, int>>& smoothing) {
    expect(state.size() == field.size(), "field has one entry a component");
    expect(params.size() == defaults.size(), "defaults has one entry a parameter");
    // formulas may come from a file
    const int dim = int(state.size()), n_params = int(params.size());
    std::vector<Expr> roots = all_known(*graph, field); // beside them may be what was found before
    std::ranges::copy(all_known(*graph, named), std::back_inserter(roots));
    for (const auto& [h, after] : jumps) {
        roots.push_back(known(*graph, h));
        std::ranges::copy(all_known(*graph, after), std::back_inserter(roots));
    }
    if (period)
        roots.push_back(known(*graph, *period));
    for (const Expr e : graph->below(roots)) {
        const Graph::Node& n = (*graph)[e];
        expect((n.op != Op::state || (n.index >= 0 && n.index < dim)) &&
                   (n.op != Op::param || (n.index >= 0 && n.index < n_params)) &&
                   (n.op != Op::powi || std::abs(n.index) < 1000),
               "a formula is one of this state and these parameters");
    }
    Definition d;
    d.graph = *graph;
    d.dim = int(state.size());
    d.state_names = state;
    d.param_names = params;
    d.defaults = defaults;
    d.period = period ? known(*graph, *period) : -1;
    if (smoothing) {
        const auto [law, c1, band] = *smoothing;
        expect(law >= 0 && law <= static_cast<int>(SmoothLaw::saturation) && c1 >= 0 &&
                   c1 < n_params && band < n_params,
               "a smoothing has a law and parameters");
        split_smoothed(d, all_known(*graph, field), all_known(*graph, named),
                       {static_cast<SmoothLaw>(law), c1, band});
    } else {
        split(d, all_known(*graph, field), all_known(*graph, named));
    }
    for (const auto& [h, after] : jumps) {
        expect(after.size() == state.size(), "a jump has one entry a component");
        d.h.push_back(known(*graph, h));
        d.kind.push_back(SurfaceKind::jump);
        d.jump.push_back(all_known(*graph, after));
    }
    if (d.surfaces() > most_split_surfaces)
        throw std::invalid_argument("filippov: the field switches on " +
                                    std::to_string(d.surfaces()) + " surfaces, of which " +
                                    std::to_string(most_split_surfaces) + " are possible");
    Facts facts;
    facts.name = name;
    facts.state = state;
    const auto tapes = std::make_shared<const TapeProgram>(d, tape_params);
    const auto model = tape_model_of(CompiledShapes(), int(state.size()), facts, tapes);
    return {.model = std::const_pointer_cast<Model>(model), // the holder type has no const
            .h = std::move(d.h),
            .region = std::move(d.region),
            .graph = std::make_shared<Graph>(std::move(d.graph))};
}

/// What time stepping asks of formulas.
class FormulaBlend {
public:
    static constexpr int any = Eigen::Dynamic;

    /// @param n_params  of the system; the blend variables come behind them
    FormulaBlend(Definition& d, const std::vector<Expr>& field, std::vector<double> params)
        : dim_(d.dim), first_(params.size()), kind_(d.kind), p_(std::move(params)) {
        Graph& graph = d.graph;
        const std::vector<Expr> f = blend_formulas(d, field, int(first_));
        const int m = d.surfaces();
        std::vector<Expr> f_x, f_s, h_x;
        for (const Expr e : f) {
            for (int k = 0; k < dim_; ++k)
                f_x.push_back(graph.derivative(e, graph.state(k)));
            for (int j = 0; j < m; ++j)
                f_s.push_back(graph.derivative(e, graph.param(int(first_) + j)));
        }
        for (const Expr e : d.h)
            for (int k = 0; k < dim_; ++k)
                h_x.push_back(graph.derivative(e, graph.state(k)));
        f_ = write_tape(graph, f);
        f_x_ = write_tape(graph, f_x);
        f_s_ = write_tape(graph, f_s);
        h_ = write_tape(graph, d.h);
        h_x_ = write_tape(graph, h_x);
        p_.resize(first_ + std::size_t(m));
    }
    int dim() const { return dim_; }
    int surfaces() const { return int(kind_.size()); }
    bool slides(int j) const { return kind_[std::size_t(j)] == SurfaceKind::switching; }
    void at(double t, const Eigen::VectorXd& x, const Eigen::VectorXd& s,
            BlendSlopes<any, any>& r) const {
        std::copy(s.begin(), s.end(), p_.begin() + std::ptrdiff_t(first_));
        const auto run = [&](const Tape& tape, double* out) {
            tape.run(t, x.data(), p_.data(), out);
        };
        run(f_, r.f.data());
        run(h_, r.h.data());
        fill(f_x_, r.f_x, run);
        fill(f_s_, r.f_s, run);
        fill(h_x_, r.h_x, run);
    }

private:
    /// Tapes write row by row.
    template <class Run> static void fill(const Tape& tape, Eigen::MatrixXd& m, const Run& run) {
        Eigen::Matrix<double, any, any, Eigen::RowMajor> rows(m.rows(), m.cols());
        run(tape, rows.data());
        m = rows;
    }
    int dim_;
    std::size_t first_;
    std::vector<SurfaceKind> kind_;
    mutable std::vector<double> p_;
    Tape f_, f_x_, f_s_, h_, h_x_;
};

/// Steps of equal length, a row each that is kept.
struct StepColumns {
    std::string status, message;
    long long n_steps = 0, newtons = 0;
    py::array_t<double> t, y, s;
    py::object raised = py::none();
};

StepColumns step_in_time(const GraphPointer& graph, const std::vector<double>& defaults,
                         const std::vector<double>& params, const std::vector<Expr>& field,
                         const std::vector<Expr>& named, const std::vector<double>& x0, double t0,
                         double t_end, long long steps, double theta, long long keep) {
    expect(params.size() == defaults.size() && x0.size() == field.size(), "sizes fit");
    Definition d;
    d.graph = *graph;
    d.dim = int(field.size());
    d.defaults = defaults;
    refuse_directions(*graph, all_known(*graph, field), "stepped in time by complementarity");
    split(d, all_known(*graph, field), all_known(*graph, named));
    if (d.has_directions())
        throw std::invalid_argument(
            "filippov: a vector over its length cannot be stepped in time by complementarity: "
            "write v/np.sqrt(v @ v + eps**2), with a parameter eps, for it");
    const FormulaBlend blend(d, field, params);
    SignalCheck signals;
    TimeSteppingSettings settings{steps, theta, keep};
    settings.interrupted = [&signals] { return signals(); };
    const Eigen::VectorXd start =
        Eigen::Map<const Eigen::VectorXd>(x0.data(), Eigen::Index(x0.size()));
    TimeSteps<Eigen::Dynamic, Eigen::Dynamic> r;
    {
        const py::gil_scoped_release unlocked;
        r = time_stepping<FormulaBlend, Eigen::Dynamic, Eigen::Dynamic>(blend, start, t0, t_end,
                                                                        settings);
    }
    std::vector<double> x, s;
    for (std::size_t i = 0; i < r.t.size(); ++i) {
        x.insert(x.end(), r.x[i].begin(), r.x[i].end());
        s.insert(s.end(), r.s[i].begin(), r.s[i].end());
    }
    const auto n = py::ssize_t(r.t.size());
    return {.status = std::string(name(r.status)),
            .message = r.message(),
            .n_steps = r.steps,
            .newtons = r.newtons,
            .t = as_array(std::move(r.t), {n}),
            .y = as_array(std::move(x), {n, py::ssize_t(x0.size())}),
            .s = as_array(std::move(s), {n, py::ssize_t(blend.surfaces())}),
            .raised = signals.raised()};
}

} // namespace

void bind_formulas(py::module_& m) {
    py::class_<Graph, GraphPointer>(m, "Graph")
        .def(py::init<>())
        .def("__len__", &Graph::size)
        .def("nodes", &rows_of)
        .def_static("of", &graph_of)
        .def("constant", &Graph::constant)
        .def("time", &Graph::time)
        .def("state", &Graph::state)
        .def("param", &Graph::param)
        .def("varies", [](const Graph& g, Expr e) { return g.varies(known(g, e)); })
        .def("of_params",
             [](const Graph& g, Expr e, const std::vector<double>& p) {
                 expect(!g.varies(known(g, e)), "expected an expression of the parameters alone");
                 return g.value(e, 0, {}, p);
             })
        .def("binary",
             [](Graph& g, const std::string& name, Expr a, Expr b) {
                 known(g, a);
                 known(g, b);
                 switch (op_of(name)) {
                 case Op::add:
                     return g.add(a, b);
                 case Op::sub:
                     return g.sub(a, b);
                 case Op::mul:
                     return g.mul(a, b);
                 case Op::div:
                     return g.div(a, b);
                 case Op::pow:
                     return g.pow(a, b);
                 default:
                     throw std::invalid_argument("filippov._core: not of two numbers: " + name);
                 }
             })
        .def("unary", [](Graph& g, const std::string& name,
                         Expr a) { return g.unary(op_of(name), known(g, a)); })
        .def("unit",
             [](Graph& g, const std::vector<Expr>& a, int k) {
                 expect(a.size() >= 2 && a.size() <= 3 && k >= 0 && k < int(a.size()),
                        "a direction has two or three entries");
                 return g.unit(all_known(g, a), k);
             })
        .def("abs", [](Graph& g, Expr a) { return g.abs(known(g, a)); })
        .def("step", [](Graph& g, Expr a) { return g.step(known(g, a)); })
        .def("where", [](Graph& g, Expr condition, Expr a,
                         Expr b) { return g.where(known(g, condition), known(g, a), known(g, b)); })
        .def("add_pointer", &add_pointer)
        .def("add_callable", &add_callable)
        .def("call", &Graph::call)
        .def("functions", [](const Graph& g) {
            std::vector<std::pair<std::string, bool>>
                all; // their names, and if they have Jacobians
            for (const auto& f : g.functions())
                all.emplace_back(f->name, f->jacobian != nullptr);
            return all;
        });
    bind_struct<DefinedSystem>(m, "DefinedSystem")
        .field("model", &DefinedSystem::model)
        .field("h", &DefinedSystem::h)
        .field("region", &DefinedSystem::region)
        .field("graph", &DefinedSystem::graph);
    m.def("define", &define);
    bind_struct<StepColumns>(m, "StepColumns")
        .field("status", &StepColumns::status)
        .field("message", &StepColumns::message)
        .field("n_steps", &StepColumns::n_steps)
        .field("newtons", &StepColumns::newtons)
        .field("t", &StepColumns::t)
        .field("y", &StepColumns::y)
        .field("s", &StepColumns::s)
        .field("raised", &StepColumns::raised);
    m.def("time_stepping", &step_in_time);
    m.attr("most_tape_dims") = most_of(CompiledShapes());
    m.attr("most_tape_params") = tape_params;
}

} // namespace filippov::python
