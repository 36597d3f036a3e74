// SPDX-License-Identifier: BSD-3-Clause
// Systems that are known at run time only, as tapes.
#pragma once

#include <filippov/formulas/detail/quick_sums.hpp>
#include <filippov/formulas/detail/slide_swing.hpp>
#include <filippov/formulas/split.hpp>
#include <filippov/formulas/tape_writer.hpp>
#include <filippov/sliding/sliding.hpp>
#include <filippov/system/smooth_law.hpp>

#include <memory>

namespace filippov {

/// Everything that a system of formulas computes, as tapes.
///
/// On one surface whose gradient has one component, a constant, that component of the state is
/// known in a slide, and what is asked for there is written without it: s, and the sliding field. A
/// constant sliding field is a slide in closed form; if formulas show how soon s may turn, nothing
/// has to be looked for between its probes.
class TapeProgram {
public:
    /// @param capacity  parameters and what is derived from them, at most
    TapeProgram(Definition& d, int capacity) : derived_(int(d.defaults.size()), capacity) {
        dim = d.dim;
        external = !d.graph.functions().empty();
        state_names = d.state_names;
        param_names = d.param_names;
        defaults = d.defaults;
        Graph& graph = d.graph;
        const auto undivided = [&](std::span<const Expr> outputs) {
            std::vector<Expr> quick;
            for (const Expr e : outputs)
                quick.push_back(without_divisions(graph, e));
            return quick;
        };
        const auto tape = [&](std::span<const Expr> outputs) {
            return write_tape(graph, undivided(outputs), &derived_);
        };
        const auto field_tape = [&](std::span<const Expr> outputs) {
            std::vector<Expr> quick = undivided(outputs);
            detail::QuickSums sums(graph, quick);
            for (Expr& e : quick)
                e = sums(e, derived_.room());
            return write_tape(graph, quick, &derived_);
        };
        const std::vector<Expr> x = states(d);
        d.h = without_units(graph, d.h);
        h = tape(d.h);
        if (d.surfaces() == 1)
            find_plane(d);
        for (const Expr e : d.h) {
            std::vector<Expr> gradient;
            for (const Expr i : x)
                gradient.push_back(graph.derivative(e, i));
            const Expr rate = graph.derivative(e, graph.time());
            grad_h.push_back(tape(gradient));
            h_t.push_back(tape(std::array{rate}));
            gradient.push_back(rate);
            linear_h = linear_h && !graph.may_jump(e);
            for (const Expr slope : gradient)
                linear_h = linear_h && !graph.varies(slope);
        }
        for (const auto& f : d.region)
            region.push_back(field_tape(f));
        for (const auto& after : d.jump)
            jump.push_back(tape(without_units(graph, after)));
        if (d.layer.size() > std::size_t(most_split_surfaces))
            throw std::invalid_argument("filippov: more than " +
                                        std::to_string(most_split_surfaces) +
                                        " switches are smoothed");
        for (const Expr u : d.layer) {
            std::vector<Expr> gradient;
            for (const Expr i : x)
                gradient.push_back(graph.derivative(u, i));
            grad_layer.push_back(tape(gradient));
        }
        layer = tape(d.layer);
        if (d.period >= 0)
            period.push_back(tape(without_units(graph, std::array{d.period})));
        kind = d.kind;
        for (const SurfaceKind k : kind)
            splits += k == SurfaceKind::switching || k == SurfaceKind::kink;
        directions = d.has_directions();
        if (d.surfaces() == 1 && d.kind[0] == SurfaceKind::switching)
            write_slide(d, field_tape);
        derived = write_tape(graph, derived_.all());
    }

    int dim = 0;
    bool external = false; ///< it calls functions of which only values are known
    std::vector<std::string> state_names, param_names;
    std::vector<double> defaults;

    int given() const { return derived_.given(); }
    int n_derived() const { return int(derived_.all().size()); }

    /// h = slope x_i + p_k, the simplest surface; component -1: it is another.
    struct Plane {
        int component = -1;
        double slope = 0;
        int offset = 0;
    };
    Plane plane;
    Tape h, derived;
    std::vector<Tape> grad_h, h_t, region, jump;
    Tape layer; ///< what changes over a distance of about 1; its gradients
    std::vector<Tape> grad_layer;
    std::vector<Tape> period; ///< none, or one
    std::vector<SurfaceKind> kind;
    bool linear_h = true; ///< every h is linear in t and x
    int splits = 0;       ///< surfaces that switch or bend; they come first, directions behind them
    bool directions = false;
    // of one surface
    Tape normal; ///< L1 and L2 in a slide
    Tape slide;  ///< the sliding field
    bool constant_slide = false;
    int swing = -1; ///< where it is told how soon s may turn in a constant slide; -1: nowhere

private:
    /// Where nothing slides, as after a jump, there is a direction or there is none: at rest such a
    /// formula is no number.
    static std::vector<Expr> without_units(Graph& graph, std::span<const Expr> all) {
        std::vector<Expr> plain;
        for (const Expr e : all)
            plain.push_back(graph.rewrite(e, [&](Expr i, std::span<const Expr> arg) {
                const Graph::Node n = graph[i];
                return is_unit(n.op)
                           ? graph.over_length(arg.first(std::size_t(arity(n.op))), n.index)
                           : graph.with_args(i, arg);
            }));
        return plain;
    }
    /// It with factors 1/p in place of divisions by what is known before.
    static Expr without_divisions(Graph& graph, Expr e) {
        return graph.rewrite(e, [&](Expr i, std::span<const Expr> arg) {
            return graph[i].op == Op::div && !graph.varies(arg[1]) && !graph.is_constant(arg[1])
                       ? graph.mul(arg[0], graph.div(graph.constant(1), arg[1]))
                       : graph.with_args(i, arg);
        });
    }
    static std::vector<Expr> states(Definition& d) {
        std::vector<Expr> x;
        for (int i = 0; i < d.dim; ++i)
            x.push_back(d.graph.state(i));
        return x;
    }
    void find_plane(Definition& d) {
        Graph& graph = d.graph;
        Expr rest = d.h[0];
        int component = -1;
        double slope = 0;
        for (int i = 0; i < d.dim; ++i) {
            const Expr g = graph.derivative(d.h[0], graph.state(i));
            if (graph.is_constant(g, 0))
                continue;
            if (component >= 0 || !graph.is_constant(g))
                return;
            component = i;
            slope = graph[g].value;
            rest = graph.substitute(rest, graph.state(i), graph.constant(0));
        }
        if (component < 0 || graph.varies(rest) || graph.may_jump(d.h[0]))
            return;
        if (const int k = derived_.place(rest); k >= 0)
            plane = {component, slope, k};
    }
    template <class Write> void write_slide(Definition& d, const Write& tape) {
        Graph& graph = d.graph;
        const std::vector<Expr> x = states(d);
        std::vector<Expr> gradient;
        int only = -1, n = 0;
        for (const Expr i : x) {
            gradient.push_back(graph.derivative(d.h[0], i));
            if (!graph.is_constant(gradient.back(), 0)) {
                only = int(gradient.size()) - 1;
                ++n;
            }
        }
        const Expr rate = graph.derivative(d.h[0], graph.time());
        const auto component = std::size_t(only);
        const bool jumps = graph.may_jump(d.h[0]);
        const bool known = n == 1 && !graph.varies(gradient[component]) && !jumps;
        // where the component that h fixes is
        const Expr there =
            known ? graph.neg(graph.div(graph.substitute(d.h[0], x[component], graph.constant(0)),
                                        gradient[component]))
                  : -1;
        const auto in_slide = [&](Expr e) {
            return known ? graph.substitute(e, x[component], there) : e;
        };
        const auto normal_of = [&](const std::vector<Expr>& f) {
            Expr sum = rate;
            for (std::size_t i = 0; i < f.size(); ++i)
                sum = graph.add(sum, graph.mul(gradient[i], f[i]));
            return in_slide(sum);
        };
        const Expr l1 = normal_of(d.region[0]), l2 = normal_of(d.region[1]);
        normal = tape(std::array{l1, l2});

        const Expr w = graph.sub(l1, l2), share1 = graph.div(graph.neg(l2), w),
                   share2 = graph.div(l1, w);
        std::vector<Expr> f;
        constant_slide = !jumps;
        for (std::size_t i = 0; i < x.size(); ++i) {
            const Expr f1 = in_slide(d.region[0][i]), f2 = in_slide(d.region[1][i]);
            f.push_back(known && i == component ? graph.neg(graph.div(rate, gradient[component]))
                        : f1 == f2              ? f1
                                   : graph.add(graph.mul(share1, f1), graph.mul(share2, f2)));
            constant_slide = constant_slide && !graph.varies(f.back());
        }
        // A surface that moves evenly carries its component along: also a constant field.
        slide = tape(f);
        if (constant_slide)
            if (const auto soon = detail::SlideWaves(graph, f).swing(l1, l2))
                swing = derived_.place(*soon);
    }

    Derived derived_;
};

/// Systems of this many components and one surface are compiled for just as many; any other may
/// have fewer than it is compiled for.
inline constexpr int most_exact_dims = 4;
/// True if a system of n components and one surface can be one that is compiled for N.
template <int N> constexpr bool fits_dims(int n) { return N <= most_exact_dims ? n == N : n <= N; }
/// With this many and one surface they run in lanes.
inline constexpr int most_lane_dims = 8;

/// A system of N components and M surfaces that runs tapes. P parameters at most, derived ones
/// included.
template <int N, int M, int P> class TapeSystem {
public:
    static constexpr int dim = N;
    static constexpr int surfaces = M;
    static constexpr bool exact = M == 1 && N <= most_exact_dims,
                          lanes = M == 1 && N <= most_lane_dims;
    static constexpr bool sides_are_data = true;
    /// What may have directions takes longer to compile: those with room for more than two surfaces
    /// do for all.
    static constexpr bool may_have_directions = M > 2;
    static constexpr std::array<std::string_view, std::size_t(P)> params{}; ///< how many fit
    /// What is compiled for; `kind` says what is so.
    static constexpr auto kinds = [] {
        std::array<SurfaceKind, std::size_t(M)> all{};
        all.fill(M == 1 ? SurfaceKind::switching : SurfaceKind::jump);
        return all;
    }();

    template <class S> using X = Vec<S, N>;
    template <class S> using Q = Vec<S, P>;

    explicit TapeSystem(std::shared_ptr<const TapeProgram> program)
        : program_(std::move(program)), plane_(program_->plane) {
        if (exact ? components() != N : components() > N)
            throw std::invalid_argument("filippov: tapes of another number of components");
        if (count() > M || given() + program_->n_derived() > P)
            throw std::invalid_argument("filippov: tapes of more surfaces or parameters than fit");
    }

    std::shared_ptr<const TapeProgram> tapes() const { return program_; }

    int components() const { return program_->dim; }
    /// Differences are good to 1e-12 of a function, and derivatives may be a thousandth of it.
    double derivative_error() const { return program_->external ? 1e-9 : 0.0; }

    bool limits_errors() const { return !program_->grad_layer.empty(); }
    /// See `limit_to_layer`.
    template <class S>
    X<S> largest_error(const S& t0, const X<S>& x0, const S& t1, const X<S>& x1,
                       const Q<S>& p) const {
        X<S> largest = X<S>::Constant(S(std::numeric_limits<Real<S>>::max()));
        std::array<S, most_split_surfaces> before, after;
        program_->layer.run(t0, x0.data(), p.data(), before.data());
        program_->layer.run(t1, x1.data(), p.data(), after.data());
        for (std::size_t j = 0; j < program_->grad_layer.size(); ++j)
            limit_to_layer(largest, before[j], after[j], field(program_->grad_layer[j], t1, x1, p));
        return largest;
    }

    // --- parameters ------------------------------------------------------------------------------

    int given() const { return program_->given(); }
    std::vector<std::string> param_names() const { return program_->param_names; }
    std::vector<double> default_values() const { return program_->defaults; }
    /// Computes the parameters behind those given.
    template <class S> void complete(Q<S>& p) const {
        const S t(0);
        const X<S> x = X<S>::Constant(S(0));
        program_->derived.run(t, x.data(), p.data(), p.data() + given());
    }
    bool is_forced() const { return !program_->period.empty(); }
    template <class S> S period(const Q<S>& p) const {
        S T(0);
        if (is_forced()) {
            const S t(0);
            const X<S> x = X<S>::Constant(S(0));
            program_->period[0].run(t, x.data(), p.data(), &T);
        }
        return T;
    }

    // --- fields and surfaces ---------------------------------------------------------------------

    /// How many surfaces there are; h of the others is 1.
    int count() const { return int(program_->kind.size()); }
    SurfaceKind kind(int j) const {
        return j < count() ? program_->kind[std::size_t(j)] : SurfaceKind::kink;
    }
    template <class S>
    X<S> f1(const S& t, const X<S>& x, const Q<S>& p) const
        requires(M == 1)
    {
        return field(program_->region[0], t, x, p);
    }
    template <class S>
    X<S> f2(const S& t, const X<S>& x, const Q<S>& p) const
        requires(M == 1)
    {
        return field(program_->region[1], t, x, p);
    }
    template <class S>
    S h(const S& t, const X<S>& x, const Q<S>& p) const
        requires(M == 1)
    {
        if (plane_.component >= 0)
            return S(plane_.slope) * x[plane_.component] + p[plane_.offset];
        return number(program_->h, t, x, p);
    }
    template <class S>
    X<S> grad_h(const S& t, const X<S>& x, const Q<S>& p) const
        requires(M == 1)
    {
        if (plane_.component >= 0) {
            X<S> g = X<S>::Constant(S(0));
            g[plane_.component] = S(plane_.slope);
            return g;
        }
        return field(program_->grad_h[0], t, x, p);
    }
    template <class S>
    S h_t(const S& t, const X<S>& x, const Q<S>& p) const
        requires(M == 1)
    {
        return plane_.component >= 0 ? S(0) : number(program_->h_t[0], t, x, p);
    }

    // --- several surfaces ------------------------------------------------------------------------

    template <class S>
    X<S> region(const S& t, const X<S>& x, const Mode<M>& side, const Q<S>& p) const
        requires(M > 1)
    {
        if constexpr (may_have_directions)
            if (has_directions())
                return directed(t, x, sides_and_directions(*this, side, t, x, p), p);
        std::size_t code = 0;
        for (int j = 0; j < program_->splits; ++j)
            code |= std::size_t(side[j] > 0) << j;
        return field(program_->region[code], t, x, p);
    }
    bool has_directions() const
        requires(may_have_directions)
    {
        return program_->directions;
    }
    /// The field with given directions; of other surfaces s says the side.
    template <class S>
    X<S> directed(const S& t, const X<S>& x, const Vec<S, M>& s, const Q<S>& p) const
        requires(may_have_directions)
    {
        std::size_t code = 0;
        for (int j = 0; j < program_->splits; ++j)
            code |= std::size_t(s[j] > S(0)) << j;
        Vec<S, N + M> all = Vec<S, N + M>::Constant(S(0)); // the entries behind the state
        for (int i = 0; i < components(); ++i)
            all[i] = x[i];
        for (int j = program_->splits; j < count(); ++j)
            all[components() + j - program_->splits] = s[j];
        X<S> f = X<S>::Constant(S(0));
        program_->region[code].run(t, all.data(), p.data(), f.data());
        return f;
    }
    template <class S>
    Vec<S, M> h(const S& t, const X<S>& x, const Q<S>& p) const
        requires(M > 1)
    {
        Vec<S, M> value = Vec<S, M>::Constant(S(1));
        program_->h.run(t, x.data(), p.data(), value.data());
        return value;
    }
    template <class S>
    X<S> grad_h(int j, const S& t, const X<S>& x, const Q<S>& p) const
        requires(M > 1)
    {
        if (j < count())
            return field(program_->grad_h[std::size_t(j)], t, x, p);
        return X<S>::Constant(S(0));
    }
    template <class S>
    S h_t(int j, const S& t, const X<S>& x, const Q<S>& p) const
        requires(M > 1)
    {
        return j < count() ? number(program_->h_t[std::size_t(j)], t, x, p) : S(0);
    }
    template <class S>
    X<S> jump(int j, const S& t, const X<S>& x, const Q<S>& p) const
        requires(M > 1)
    {
        return field(program_->jump[std::size_t(j)], t, x, p);
    }

    // --- slides ----------------------------------------------------------------------------------

    template <class S>
    Vec<S, 2> slide_components(const S& t, const X<S>& x, const Q<S>& p) const
        requires(M == 1)
    {
        Vec<S, 2> l;
        program_->normal.run<2>(t, x.data(), p.data(), l.data());
        return l;
    }
    template <class S>
    X<S> slide_field(const S& t, const X<S>& x, const Q<S>& p) const
        requires(M == 1)
    {
        return field(program_->slide, t, x, p);
    }
    bool has_linear_h() const { return program_->linear_h; }
    bool has_sliding_flow() const { return program_->constant_slide; }
    template <class S>
    X<S> sliding_flow(const S& t, const X<S>& x, const Q<S>& p, const S& dt) const
        requires(M == 1)
    {
        return x + dt * field(program_->slide, t, x, p);
    }
    bool has_slide_swing() const { return program_->swing >= 0; }
    template <class S>
    S slide_swing(const Q<S>& p) const
        requires(M == 1)
    {
        return p[program_->swing];
    }

private:
    template <class S>
    FILIPPOV_INLINE X<S> field(const Tape& tape, const S& t, const X<S>& x, const Q<S>& p) const {
        X<S> f;
        if constexpr (!exact)
            f.setConstant(S(0));
        tape.run<exact ? N : -1>(t, x.data(), p.data(), f.data());
        return f;
    }
    template <class S>
    FILIPPOV_INLINE S number(const Tape& tape, const S& t, const X<S>& x, const Q<S>& p) const {
        S value;
        tape.run<1>(t, x.data(), p.data(), &value);
        return value;
    }

    std::shared_ptr<const TapeProgram> program_;
    TapeProgram::Plane plane_;
};

} // namespace filippov
