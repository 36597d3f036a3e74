// SPDX-License-Identifier: BSD-3-Clause
// Writes formulas as tapes.
#pragma once

#include <filippov/formulas/expression.hpp>
#include <filippov/formulas/tape.hpp>

#include <algorithm>
#include <map>
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
    /// How many more there may be.
    std::size_t room() const { return std::size_t(capacity_ - given_) - all_.size(); }

private:
    int given_, capacity_;
    std::vector<Expr> all_;
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
        tape_.code_.clear();
        measure(outputs);
        for (const Expr e : outputs)
            require(e);
        for (const Expr e : outputs)
            tape_.outputs_.push_back(at_[std::size_t(e)]);
        tape_.code_.push_back({});
        if (outputs.size() > std::size_t(Tape::most))
            throw std::invalid_argument("filippov: formulas have too many results at once");
        tape_.n_numbers_ = tape_.n_slots_ + int(outputs.size());
        tape_.steps_ =
            detail::steps_of(tape_.code_, tape_.outputs_, tape_.functions_, tape_.n_slots_);
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
        if (n.op == Op::call)
            return call(e, n);
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
            for (std::size_t k = 0; k < std::size_t(m); ++k)
                if (!in_instruction(n, k))
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
    /// True of a constant operand that the instruction itself has: one of them, where both are and
    /// the graph could not fold them, as in 1/0.
    bool in_instruction(const Graph::Node& n, std::size_t k) const {
        const bool has_k = n.op == Op::add || n.op == Op::sub || n.op == Op::mul ||
                           (n.op == Op::div && (k == 0 || has_reciprocal(n.arg[1])));
        return has_k && graph_.is_constant(n.arg[k]) && (k == 1 || !graph_.is_constant(n.arg[1]));
    }
    bool has_reciprocal(Expr e) const {
        return graph_.is_constant(e) && std::isnormal(1 / graph_[e].value);
    }
    /// The first output that is needed calls the function for all.
    void call(Expr e, const Graph::Node& n) {
        const auto function = std::size_t(n.value);
        const auto [found, is_new] = called_.try_emplace(function, std::uint16_t(0));
        if (is_new) {
            const auto& f = graph_.functions()[function];
            found->second = take_slots(f->outputs);
            detail::Instruction i;
            i.code = Code::call;
            i.slot = found->second;
            i.a.index = static_cast<std::uint16_t>(tape_.functions_.size());
            tape_.functions_.push_back(f);
            tape_.code_.push_back(i);
            at_hand_ = -1;
        }
        at_[std::size_t(e)] = operand(Operand::slot, found->second + n.index);
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
        i.code = taking(code, divides ? b : a, c);
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
            if (has_reciprocal(b)) {
                one(i, a, Code::mul_k);
                i.k = 1 / graph_[b].value;
            } else if (graph_.is_constant(a) && !graph_.is_constant(b)) {
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
    /// The code that takes one of two operands from where it is at hand.
    Code taking(Code code, Expr first, Expr second = -1) const {
        const bool is_first = first >= 0 && first == at_hand_,
                   is_second = second >= 0 && second == at_hand_;
        return after(code, is_first ? 1 : is_second ? 2 : 0);
    }
    void one(detail::Instruction& i, Expr a, Code code) const {
        i.a = at(a);
        i.code = taking(code, a);
    }
    void commutative(detail::Instruction& i, Expr a, Expr b, Code code) const {
        if ((graph_.is_constant(a) && !graph_.is_constant(b)) || b == at_hand_)
            std::swap(a, b);
        if (graph_.is_constant(b)) {
            i.k = graph_[b].value;
            return one(i, a, after(code, 2));
        }
        i.a = at(a);
        i.b = at(b);
        i.code = taking(code, a);
    }
    void ordered(detail::Instruction& i, Expr a, Expr b, Code code) const {
        i.a = at(a);
        i.b = at(b);
        i.code = taking(code, a, b);
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
        case Op::magnitude:
            return Code::magnitude;
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
        return take_slots(1);
    }
    /// Slots in a row.
    std::uint16_t take_slots(int n) {
        if (tape_.n_slots_ + n > Tape::most)
            throw std::invalid_argument("filippov: a formula needs too many numbers at once");
        tape_.n_slots_ += n;
        return static_cast<std::uint16_t>(tape_.n_slots_ - n);
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
    std::map<std::size_t, std::uint16_t> called_; ///< external functions, and their first slots
    Expr at_hand_ = -1;
};

/// A tape that computes some expressions.
/// @param derived  where expressions of parameters alone are taken from; may be null
inline Tape write_tape(const Graph& graph, std::span<const Expr> outputs,
                       Derived* derived = nullptr) {
    Tape tape;
    TapeWriter(graph, derived, tape).write(outputs);
    return tape;
}

} // namespace filippov
