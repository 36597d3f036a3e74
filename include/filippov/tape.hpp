// SPDX-License-Identifier: BSD-3-Clause
// Formulas as programs of a register machine, which runs them for every scalar.
//
// A machine whose instructions meet in memory waits for each number to come back from there. So the
// last result stays at hand, in `acc`: most instructions take it as an operand.
#pragma once

#include <filippov/elementary.hpp>
#include <filippov/expression.hpp>
#include <filippov/scalar.hpp>

#include <algorithm>
#include <memory>
#include <optional>

namespace filippov {

/// Expressions of parameters alone, computed once for many evaluations of everything else: they
/// stand behind the parameters that are given.
class Derived {
public:
    Derived(int given, int capacity) : given_(given), capacity_(capacity) {
        if (given > capacity)
            throw std::invalid_argument("filippov: more parameters than fit");
    }
    /// Where an expression without time and state is kept; -1 if there is no more room.
    int place(Expr e) {
        const auto found = std::find(all_.begin(), all_.end(), e);
        if (found != all_.end())
            return given_ + int(found - all_.begin());
        if (given_ + int(all_.size()) >= capacity_)
            return -1;
        all_.push_back(e);
        return given_ + int(all_.size()) - 1;
    }
    std::span<const Expr> all() const { return all_; }
    int given() const { return given_; }

private:
    int given_, capacity_;
    std::vector<Expr> all_;
};

namespace detail {

/// Instructions. `_a` has the last result for its (first) operand, `_ra` for its second; k is a
/// constant.
enum class Code : std::uint8_t {
    halt,
    set, // k
    add,
    add_a,
    add_k,
    add_ka,
    sub,
    sub_a,
    sub_ra,
    sub_k, // k - a
    sub_ka,
    mul,
    mul_a,
    mul_k,
    mul_ka,
    div,
    div_a,
    div_ra,
    div_k, // k / a
    div_ka,
    div_by_k, // a / k
    div_by_ka,
    // a b + c, a b - c and c - a b, each rounded twice; `_a` has a at hand, `_ra` has c
    mul_add,
    mul_add_a,
    mul_add_ra,
    mul_sub,
    mul_sub_a,
    mul_sub_ra,
    sub_mul,
    sub_mul_a,
    sub_mul_ra,
    div_add, // a / b + c; `_a` has b at hand, `_ra` has c
    div_add_a,
    div_add_ra,
    pow,
    where,
    powi,
    powi_a,
    neg,
    neg_a,
    sqrt,
    sqrt_a,
    exp,
    exp_a,
    log,
    log_a,
    sin,
    sin_a,
    cos,
    cos_a,
    sin_mul, // of a b
    sin_mul_a,
    cos_mul,
    cos_mul_a,
    tan,
    tan_a,
    asin,
    asin_a,
    atan,
    atan_a,
    sinh,
    sinh_a,
    cosh,
    cosh_a,
    tanh,
    tanh_a,
    sign,
    sign_a,
};

/// Where an operand is.
struct Operand {
    enum Space : std::uint16_t { slot, state, param, time, nowhere };
    Space space = nowhere;
    std::uint16_t index = 0;
};

struct Instruction {
    Code code = Code::halt;
    std::uint16_t slot = 0; ///< of the result
    Operand a{}, b{}, c{};  ///< (an exponent is the index of b)
    double k = 0;
};

} // namespace detail

/// A program that computes some expressions.
class Tape {
public:
    /// @param derived  where expressions of parameters alone are taken from; may be null
    Tape(const Graph& graph, std::span<const Expr> outputs, Derived* derived = nullptr);

    std::size_t size() const { return code_.size(); }

    /// @param x    state, and p: parameters with what is derived from them
    /// @param out  one entry an output; not x
    /// @cost no allocation
    template <class S> void run(const S& t, const S* x, const S* p, S* out) const {
        if (n_slots_ <= few)
            run_in<few>(t, x, p, out);
        else
            run_in<most>(t, x, p, out);
    }

private:
    static constexpr int few = 32, most = 1024; ///< numbers that are kept at once

    template <int Slots, class S>
    FILIPPOV_INLINE void run_in(const S& t, const S* x, const S* p, S* out) const {
        // raw: numbers with derivatives would all be set to zero first
        alignas(S) std::byte raw[sizeof(S) * Slots];
        interpret(reinterpret_cast<S*>(raw), t, x, p, out);
    }
    template <class S>
    FILIPPOV_NOINLINE void interpret(S* slots, const S& t, const S* x, const S* p, S* out) const;

    std::vector<detail::Instruction> code_; ///< the last one is `halt`
    std::vector<detail::Operand> outputs_;
    int n_slots_ = 0;

    friend class TapeWriter;
};

/// Writes a tape.
class TapeWriter {
    using Code = detail::Code;
    using Operand = detail::Operand;

public:
    TapeWriter(const Graph& graph, Derived* derived, Tape& tape)
        : graph_(graph), derived_(derived), tape_(tape), size_(graph.size(), 0),
          uses_(graph.size(), 0), at_(graph.size()) {}

    void write(std::span<const Expr> outputs) {
        measure(outputs);
        for (const Expr e : outputs)
            require(e);
        for (const Expr e : outputs)
            tape_.outputs_.push_back(at_[std::size_t(e)]);
        tape_.code_.push_back({});
    }

private:
    static constexpr int deepest = 5000;

    static Operand operand(Operand::Space space, int index) {
        return {space, static_cast<std::uint16_t>(index)};
    }
    bool is_placed(Expr e) const { return at(e).space != Operand::nowhere; }

    /// Finds what has to be computed, how much there is to each, and how often it is needed.
    void measure(std::span<const Expr> outputs) {
        std::vector<bool> needed(graph_.size(), false), computed(graph_.size(), false);
        for (const Expr e : outputs) {
            needed[std::size_t(e)] = true;
            ++uses_[std::size_t(e)]; // never given back
        }
        for (Expr e = Expr(graph_.size()); e-- > 0;) {
            if (!needed[std::size_t(e)] || place(e))
                continue;
            computed[std::size_t(e)] = true;
            for (int k = 0; k < arity(graph_[e].op); ++k) {
                const auto j = std::size_t(graph_[e].arg[std::size_t(k)]);
                needed[j] = true;
                ++uses_[j];
            }
        }
        std::vector<int> depth(graph_.size(), 0);
        for (std::size_t i = 0; i < graph_.size(); ++i) {
            if (!computed[i])
                continue;
            const Graph::Node& n = graph_[Expr(i)];
            size_[i] = 1;
            for (int k = 0; k < arity(n.op); ++k) {
                const auto j = std::size_t(n.arg[std::size_t(k)]);
                size_[i] = std::min(size_[i] + size_[j], 1'000'000);
                depth[i] = std::max(depth[i], depth[j] + 1);
            }
            if (depth[i] > deepest)
                throw std::invalid_argument("filippov: a formula is nested too deeply");
        }
    }
    /// True of what needs no instruction: leaves but constants, and what is derived.
    bool place(Expr e) {
        const Graph::Node& n = graph_[e];
        Operand& at = at_[std::size_t(e)];
        if (n.op == Op::time)
            at = operand(Operand::time, 0);
        else if (n.op == Op::state)
            at = operand(Operand::state, n.index);
        else if (n.op == Op::param)
            at = operand(Operand::param, n.index);
        else if (derived_ != nullptr && !graph_.varies(e) && graph_.has_params(e)) {
            if (const int k = derived_->place(e); k >= 0)
                at = operand(Operand::param, k);
        }
        return is_placed(e);
    }

    void require(Expr e) {
        if (!is_placed(e))
            compute(e);
    }
    /// Operands first; the last one to be computed is at hand then.
    void compute(Expr e) {
        const Graph::Node n = graph_[e];
        const int m = arity(n.op);
        detail::Instruction i;
        if (const auto parts = fused_parts(n)) {
            require_all(*parts);
            encode_fused(n, *parts, i);
            for (const Expr part : parts->e)
                if (part >= 0)
                    release(part);
        } else {
            std::array<Expr, 3> needed{-1, -1, -1};
            const bool has_k =
                n.op == Op::add || n.op == Op::sub || n.op == Op::mul || n.op == Op::div;
            for (std::size_t k = 0; k < std::size_t(m); ++k)
                if (!(has_k && graph_.is_constant(n.arg[k])))
                    needed[k] = n.arg[k];
            require_all({needed, 0});
            encode(n, i);
            for (int k = 0; k < m; ++k)
                release(n.arg[std::size_t(k)]);
        }
        i.slot = take_slot();
        at_[std::size_t(e)] = operand(Operand::slot, i.slot);
        tape_.code_.push_back(i);
        at_hand_ = e;
    }
    /// Three numbers, some of which may be missing.
    struct Three {
        std::array<Expr, 3> e;
        int inner = 0; ///< which operand of the node the first two are operands of
    };
    /// The most work first.
    void require_all(Three three) {
        std::stable_sort(three.e.begin(), three.e.end(), [&](Expr a, Expr b) {
            return (a < 0 ? -1 : size_[std::size_t(a)]) > (b < 0 ? -1 : size_[std::size_t(b)]);
        });
        for (const Expr e : three.e)
            if (e >= 0)
                require(e);
    }
    /// What one instruction makes a node of that has an operand which nothing else needs: the
    /// operands of that one, and the other operand.
    std::optional<Three> fused_parts(const Graph::Node& n) {
        const bool sum = n.op == Op::add || n.op == Op::sub,
                   wave = n.op == Op::sin || n.op == Op::cos;
        for (int k = 0; (sum || wave) && k < arity(n.op); ++k) {
            const Expr inner = n.arg[std::size_t(k)], rest = sum ? n.arg[std::size_t(1 - k)] : -1;
            const Op op = graph_[inner].op;
            if (!(op == Op::mul || (op == Op::div && n.op == Op::add)) ||
                uses_[std::size_t(inner)] != 1 || is_placed(inner))
                continue;
            const Three three{{graph_[inner].arg[0], graph_[inner].arg[1], rest}, k};
            if (keep_constant(three.e[0]) && keep_constant(three.e[1]) && keep_constant(rest))
                return three;
        }
        return std::nullopt;
    }
    /// Among what is derived, where instructions without a constant of their own find it; false if
    /// there is no more room.
    bool keep_constant(Expr e) {
        if (e < 0 || !graph_.is_constant(e) || is_placed(e))
            return true;
        const int k = derived_ != nullptr ? derived_->place(e) : -1;
        if (k >= 0)
            at_[std::size_t(e)] = operand(Operand::param, k);
        return k >= 0;
    }
    void encode_fused(const Graph::Node& n, const Three& parts, detail::Instruction& i) const {
        auto [a, b, c] = parts.e;
        const bool divides = graph_[n.arg[std::size_t(parts.inner)]].op == Op::div;
        const Code code = n.op == Op::sin    ? Code::sin_mul
                          : n.op == Op::cos  ? Code::cos_mul
                          : divides          ? Code::div_add
                          : n.op == Op::add  ? Code::mul_add
                          : parts.inner == 0 ? Code::mul_sub
                                             : Code::sub_mul;
        if (!divides && b == at_hand_)
            std::swap(a, b);
        i.a = at(a);
        i.b = at(b);
        i.c = c < 0 ? Operand{} : at(c);
        i.code = (divides ? b : a) == at_hand_ ? after(code, 1)
                 : c >= 0 && c == at_hand_     ? after(code, 2)
                                               : code;
    }
    void encode(const Graph::Node& n, detail::Instruction& i) const {
        const auto [a, b, c] = n.arg;
        switch (n.op) {
        case Op::constant:
            i.code = Code::set;
            i.k = n.value;
            return;
        case Op::add:
            return commutative(i, a, b, Code::add);
        case Op::mul:
            return commutative(i, a, b, Code::mul);
        case Op::sub:
            if (graph_.is_constant(b)) {
                one(i, a, Code::add_k);
                i.k = -graph_[b].value;
            } else if (graph_.is_constant(a)) {
                one(i, b, Code::sub_k);
                i.k = graph_[a].value;
            } else {
                ordered(i, a, b, Code::sub);
            }
            return;
        case Op::div:
            if (graph_.is_constant(b)) {
                one(i, a, Code::mul_k);
                i.k = 1 / graph_[b].value;
            } else if (graph_.is_constant(a)) {
                one(i, b, Code::div_k);
                i.k = graph_[a].value;
            } else {
                ordered(i, a, b, Code::div);
            }
            return;
        case Op::pow:
        case Op::where:
            i.code = n.op == Op::pow ? Code::pow : Code::where;
            i.a = at(a);
            i.b = at(b);
            i.c = c < 0 ? Operand{} : at(c);
            return;
        case Op::powi:
            i.b.index = static_cast<std::uint16_t>(n.index);
            return one(i, a, Code::powi);
        default:
            return one(i, a, function(n.op));
        }
    }
    Operand at(Expr e) const { return at_[std::size_t(e)]; }
    static Code after(Code code, int n) { return static_cast<Code>(int(code) + n); }
    void one(detail::Instruction& i, Expr a, Code code) const {
        i.a = at(a);
        i.code = a == at_hand_ ? after(code, 1) : code;
    }
    void commutative(detail::Instruction& i, Expr a, Expr b, Code code) const {
        if (graph_.is_constant(a) || b == at_hand_)
            std::swap(a, b);
        if (graph_.is_constant(b)) {
            i.k = graph_[b].value;
            return one(i, a, after(code, 2));
        }
        i.a = at(a);
        i.b = at(b);
        i.code = a == at_hand_ ? after(code, 1) : code;
    }
    void ordered(detail::Instruction& i, Expr a, Expr b, Code code) const {
        i.a = at(a);
        i.b = at(b);
        i.code = a == at_hand_ ? after(code, 1) : b == at_hand_ ? after(code, 2) : code;
    }
    static Code function(Op op) {
        switch (op) {
        case Op::neg:
            return Code::neg;
        case Op::sqrt:
            return Code::sqrt;
        case Op::exp:
            return Code::exp;
        case Op::log:
            return Code::log;
        case Op::sin:
            return Code::sin;
        case Op::cos:
            return Code::cos;
        case Op::tan:
            return Code::tan;
        case Op::asin:
            return Code::asin;
        case Op::atan:
            return Code::atan;
        case Op::sinh:
            return Code::sinh;
        case Op::cosh:
            return Code::cosh;
        case Op::tanh:
            return Code::tanh;
        case Op::sign:
            return Code::sign;
        default:
            throw std::logic_error("filippov: an operation that tapes do not know");
        }
    }
    std::uint16_t take_slot() {
        if (!free_.empty()) {
            const std::uint16_t slot = free_.back();
            free_.pop_back();
            return slot;
        }
        if (tape_.n_slots_ == Tape::most)
            throw std::invalid_argument("filippov: a formula needs too many numbers at once");
        return static_cast<std::uint16_t>(tape_.n_slots_++);
    }
    void release(Expr e) {
        if (--uses_[std::size_t(e)] == 0 && at(e).space == Operand::slot)
            free_.push_back(at(e).index);
    }

    const Graph& graph_;
    Derived* derived_;
    Tape& tape_;
    std::vector<int> size_, uses_;
    std::vector<Operand> at_;
    std::vector<std::uint16_t> free_;
    Expr at_hand_ = -1;
};

inline Tape::Tape(const Graph& graph, std::span<const Expr> outputs, Derived* derived) {
    TapeWriter(graph, derived, *this).write(outputs);
}

template <class S>
void Tape::interpret(S* slots, const S& t, const S* x, const S* p, S* out) const {
    using detail::Code;
    using elementary::cos;
    using elementary::sin;
    using std::asin, std::atan, std::cosh, std::exp, std::log, std::pow, std::sinh, std::sqrt,
        std::tan, std::tanh;
    const S* const base[4] = {slots, x, p, &t};
    const auto at = [&base](detail::Operand o)
                        FILIPPOV_LAMBDA_INLINE -> const S& { return base[o.space][o.index]; };
    const auto sign = [](const S& v) {
        return select(v > S(0), S(1), select(v < S(0), S(-1), S(v * S(0))));
    };
    const auto exponent = [](const detail::Instruction& n) {
        return int(static_cast<std::int16_t>(n.b.index));
    };
    S acc(0);
    const detail::Instruction* i = code_.data();
    for (;; ++i) {
        switch (i->code) {
        case Code::halt:
            for (std::size_t k = 0; k < outputs_.size(); ++k)
                out[k] = at(outputs_[k]);
            return;
        case Code::set:
            acc = S(i->k);
            break;
        case Code::add:
            acc = at(i->a) + at(i->b);
            break;
        case Code::add_a:
            acc = acc + at(i->b);
            break;
        case Code::add_k:
            acc = at(i->a) + S(i->k);
            break;
        case Code::add_ka:
            acc = acc + S(i->k);
            break;
        case Code::sub:
            acc = at(i->a) - at(i->b);
            break;
        case Code::sub_a:
            acc = acc - at(i->b);
            break;
        case Code::sub_ra:
            acc = at(i->a) - acc;
            break;
        case Code::sub_k:
            acc = S(i->k) - at(i->a);
            break;
        case Code::sub_ka:
            acc = S(i->k) - acc;
            break;
        case Code::mul:
            acc = at(i->a) * at(i->b);
            break;
        case Code::mul_a:
            acc = acc * at(i->b);
            break;
        case Code::mul_k:
            acc = at(i->a) * S(i->k);
            break;
        case Code::mul_ka:
            acc = acc * S(i->k);
            break;
        case Code::div:
            acc = at(i->a) / at(i->b);
            break;
        case Code::div_a:
            acc = acc / at(i->b);
            break;
        case Code::div_ra:
            acc = at(i->a) / acc;
            break;
        case Code::div_k:
            acc = S(i->k) / at(i->a);
            break;
        case Code::div_ka:
            acc = S(i->k) / acc;
            break;
        case Code::div_by_k:
            acc = at(i->a) / S(i->k);
            break;
        case Code::div_by_ka:
            acc = acc / S(i->k);
            break;
        case Code::mul_add:
            acc = at(i->a) * at(i->b) + at(i->c);
            break;
        case Code::mul_add_a:
            acc = acc * at(i->b) + at(i->c);
            break;
        case Code::mul_add_ra:
            acc = at(i->a) * at(i->b) + acc;
            break;
        case Code::mul_sub:
            acc = at(i->a) * at(i->b) - at(i->c);
            break;
        case Code::mul_sub_a:
            acc = acc * at(i->b) - at(i->c);
            break;
        case Code::mul_sub_ra:
            acc = at(i->a) * at(i->b) - acc;
            break;
        case Code::sub_mul:
            acc = at(i->c) - at(i->a) * at(i->b);
            break;
        case Code::sub_mul_a:
            acc = at(i->c) - acc * at(i->b);
            break;
        case Code::sub_mul_ra:
            acc = acc - at(i->a) * at(i->b);
            break;
        case Code::div_add:
            acc = at(i->a) / at(i->b) + at(i->c);
            break;
        case Code::div_add_a:
            acc = at(i->a) / acc + at(i->c);
            break;
        case Code::div_add_ra:
            acc = at(i->a) / at(i->b) + acc;
            break;
        case Code::pow:
            acc = S(pow(at(i->a), at(i->b)));
            break;
        case Code::where:
            acc = select(at(i->a) > S(0.5), at(i->b), at(i->c));
            break;
        case Code::powi:
            acc = S(pow(at(i->a), exponent(*i)));
            break;
        case Code::powi_a:
            acc = S(pow(S(acc), exponent(*i)));
            break;
        case Code::neg:
            acc = -at(i->a);
            break;
        case Code::neg_a:
            acc = -acc;
            break;
        case Code::sqrt:
            acc = sqrt(at(i->a));
            break;
        case Code::sqrt_a:
            acc = sqrt(S(acc));
            break;
        case Code::exp:
            acc = exp(at(i->a));
            break;
        case Code::exp_a:
            acc = exp(S(acc));
            break;
        case Code::log:
            acc = log(at(i->a));
            break;
        case Code::log_a:
            acc = log(S(acc));
            break;
        case Code::sin:
            acc = sin(at(i->a));
            break;
        case Code::sin_a:
            acc = sin(S(acc));
            break;
        case Code::cos:
            acc = cos(at(i->a));
            break;
        case Code::cos_a:
            acc = cos(S(acc));
            break;
        case Code::sin_mul:
            acc = sin(S(at(i->a) * at(i->b)));
            break;
        case Code::sin_mul_a:
            acc = sin(S(acc * at(i->b)));
            break;
        case Code::cos_mul:
            acc = cos(S(at(i->a) * at(i->b)));
            break;
        case Code::cos_mul_a:
            acc = cos(S(acc * at(i->b)));
            break;
        case Code::tan:
            acc = tan(at(i->a));
            break;
        case Code::tan_a:
            acc = tan(S(acc));
            break;
        case Code::asin:
            acc = asin(at(i->a));
            break;
        case Code::asin_a:
            acc = asin(S(acc));
            break;
        case Code::atan:
            acc = atan(at(i->a));
            break;
        case Code::atan_a:
            acc = atan(S(acc));
            break;
        case Code::sinh:
            acc = sinh(at(i->a));
            break;
        case Code::sinh_a:
            acc = sinh(S(acc));
            break;
        case Code::cosh:
            acc = cosh(at(i->a));
            break;
        case Code::cosh_a:
            acc = cosh(S(acc));
            break;
        case Code::tanh:
            acc = tanh(at(i->a));
            break;
        case Code::tanh_a:
            acc = tanh(S(acc));
            break;
        case Code::sign:
            acc = sign(at(i->a));
            break;
        case Code::sign_a:
            acc = sign(S(acc));
            break;
        default:
            FILIPPOV_UNREACHABLE();
        }
        std::construct_at(slots + i->slot, acc);
    }
}

} // namespace filippov
