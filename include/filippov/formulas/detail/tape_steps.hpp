// SPDX-License-Identifier: BSD-3-Clause
// A tape as steps: for plain numbers, of which one run alone asks for many.
//
// A loop over instructions looks up for every operand where it is. A step is a function of its own
// for what is computed and for where its operands are; each goes on to the next one by itself, and
// what they share stays in registers. Functions are made for what formulas have often, and one for
// all else.
#pragma once

#include <filippov/formulas/detail/instruction.hpp>
#include <filippov/formulas/external.hpp>

#include <memory>
#include <span>
#include <vector>

namespace filippov::detail {

struct TapeStep {
    /// Takes this step and those after it.
    /// @param numbers  outputs, then slots
    /// @param last     the last result
    /// @return where to go on, since each step may need some of the stack if it was not compiled
    ///         for speed; null at the end
    using Run = const TapeStep* (*)(const TapeStep* i, double* numbers, const double* x,
                                    const double* p, double last, double t);

    static const TapeStep* halt(const TapeStep*, double*, const double*, const double*, double,
                                double) {
        return nullptr;
    }

    Run run = halt;
    union {
        double k = 0;
        const External* function;
    };
    Operand a{}, b{}, c{}; ///< slots are numbers; what is at hand is nowhere else
    std::uint16_t to = 0;  ///< which number is the result
};

/// The steps of a program, the outputs of which come first among its numbers.
FILIPPOV_IN_LIBRARY std::vector<TapeStep>
steps_of(std::span<const Instruction> code, std::span<const Operand> outputs,
         std::span<const std::shared_ptr<const External>> functions, int n_slots);

} // namespace filippov::detail

#if !defined(FILIPPOV_COMPILED) || defined(FILIPPOV_COMPILING)

#include <filippov/core/elementary.hpp>

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <type_traits>
#include <utility>

namespace filippov::detail {

/// Where a step finds an operand. `any`: it looks where.
enum class From : std::uint8_t { last, slot, state, param, time, any };

/// Which operand is at hand, from 1; 0: none.
inline int at_hand(Code code) {
    switch (code) {
    case Code::sub_ra:
    case Code::div_ra:
    case Code::div_add_a:
        return 2;
    case Code::mul_add_ra:
    case Code::mul_sub_ra:
    case Code::sub_mul_ra:
    case Code::div_add_ra:
        return 3;
    case Code::add_a:
    case Code::add_ka:
    case Code::sub_a:
    case Code::sub_ka:
    case Code::mul_a:
    case Code::mul_ka:
    case Code::div_a:
    case Code::div_ka:
    case Code::mul_add_a:
    case Code::mul_sub_a:
    case Code::sub_mul_a:
        return 1;
    default: // from powi on, codes without and with a number at hand take turns
        return code > Code::powi && code < Code::call ? (int(code) - int(Code::powi)) % 2 : 0;
    }
}

template <From F>
FILIPPOV_INLINE double number(const Operand& o, const double* numbers, const double* x,
                              const double* p, double last, double t) {
    if constexpr (F == From::last)
        return last;
    else if constexpr (F == From::slot)
        return numbers[o.index];
    else if constexpr (F == From::state)
        return x[o.index];
    else if constexpr (F == From::param)
        return p[o.index];
    else if constexpr (F == From::time)
        return t;
    else
        return o.space == Operand::slot    ? numbers[o.index]
               : o.space == Operand::state ? x[o.index]
               : o.space == Operand::param ? p[o.index]
               : o.space == Operand::time  ? t
                                           : last;
}

/// @tparam Keep  the result is needed later than by the next step
template <class Op, bool Keep, From... F>
const TapeStep* take_step(const TapeStep* i, double* numbers, const double* x, const double* p,
                          double last, double t) {
    constexpr std::array<From, 3> from{F...};
    const auto at = [&]<std::size_t K>(const Operand& o) FILIPPOV_LAMBDA_INLINE {
        return number<from[K]>(o, numbers, x, p, last, t);
    };
    if constexpr (sizeof...(F) == 0)
        last = Op{}(*i);
    else if constexpr (sizeof...(F) == 1)
        last = Op{}(*i, at.template operator()<0>(i->a));
    else if constexpr (sizeof...(F) == 2)
        last = Op{}(*i, at.template operator()<0>(i->a), at.template operator()<1>(i->b));
    else
        last = Op{}(*i, at.template operator()<0>(i->a), at.template operator()<1>(i->b),
                    at.template operator()<2>(i->c));
    if constexpr (Keep)
        numbers[i->to] = last;
    return i[1].run(i + 1, numbers, x, p, last, t);
}
inline const TapeStep* call_step(const TapeStep* i, double* numbers, const double* x,
                                 const double* p, double last, double t) {
    const External& f = *i->function;
    for (int k = 0; k < f.outputs; ++k)
        numbers[i->to + k] = std::numeric_limits<double>::quiet_NaN();
    evaluate(f, t, x, p, numbers + i->to);
    return i[1].run(i + 1, numbers, x, p, last, t);
}
inline const TapeStep* rest_step(const TapeStep* i, double*, const double*, const double*, double,
                                 double) {
    return i + 1;
}

/// Finds the functions of steps.
class StepChooser {
    using I = TapeStep;

public:
    /// @param keep   the result is needed later than by the next step
    /// @param fresh  nothing is at hand
    StepChooser(const Instruction& i, bool keep, bool fresh)
        : i_(i), keep_(keep), at_hand_(fresh ? 0 : at_hand(i.code)) {}

    I::Run operator()() const {
        switch (i_.code) {
        case Code::add:
        case Code::add_a:
            return two([](const I&, double a, double b) { return a + b; });
        case Code::sub:
        case Code::sub_a:
        case Code::sub_ra:
            return two([](const I&, double a, double b) { return a - b; });
        case Code::mul:
        case Code::mul_a:
            return two([](const I&, double a, double b) { return a * b; });
        case Code::div:
        case Code::div_a:
        case Code::div_ra:
            return two([](const I&, double a, double b) { return a / b; });
        case Code::mul_add:
        case Code::mul_add_a:
        case Code::mul_add_ra:
            return three([](const I&, double a, double b, double c) { return fused(a, b, c); });
        case Code::mul_sub:
        case Code::mul_sub_a:
        case Code::mul_sub_ra:
            return three([](const I&, double a, double b, double c) { return fused(a, b, -c); });
        case Code::sub_mul:
        case Code::sub_mul_a:
        case Code::sub_mul_ra:
            return three([](const I&, double a, double b, double c) { return fused(-a, b, c); });
        case Code::div_add:
        case Code::div_add_a:
        case Code::div_add_ra:
            return quotient([](const I&, double a, double b, double c) { return a / b + c; });
        default:
            return with_constant();
        }
    }

    /// A number that is given, as an output.
    I::Run copies() const {
        return one([](const I&, double a) { return a; });
    }

private:
    I::Run with_constant() const {
        switch (i_.code) {
        case Code::set:
            return none([](const I& i) { return i.k; });
        case Code::add_k:
        case Code::add_ka:
            return one([](const I& i, double a) { return a + i.k; });
        case Code::sub_k:
        case Code::sub_ka:
            return one([](const I& i, double a) { return i.k - a; });
        case Code::mul_k:
        case Code::mul_ka:
            return one([](const I& i, double a) { return a * i.k; });
        case Code::div_k:
        case Code::div_ka:
            return one([](const I& i, double a) { return i.k / a; });
        default:
            return function();
        }
    }
    I::Run function() const {
        switch (i_.code) {
        case Code::pow:
            return rare([](const I&, double a, double b) { return std::pow(a, b); });
        case Code::where:
            return rare([](const I&, double a, double b, double c) { return a > 0.5 ? b : c; });
        case Code::powi:
        case Code::powi_a:
            return some([](const I& i, double a) {
                return std::pow(a, int(static_cast<std::int16_t>(i.b.index)));
            });
        case Code::neg:
        case Code::neg_a:
            return some([](const I&, double a) { return -a; });
        case Code::sqrt:
        case Code::sqrt_a:
            return some([](const I&, double a) { return std::sqrt(a); });
        case Code::exp:
        case Code::exp_a:
            return some([](const I&, double a) { return std::exp(a); });
        case Code::log:
        case Code::log_a:
            return some([](const I&, double a) { return std::log(a); });
        case Code::sin:
        case Code::sin_a:
            return some([](const I&, double a) { return elementary::sin(a); });
        case Code::cos:
        case Code::cos_a:
            return some([](const I&, double a) { return elementary::cos(a); });
        case Code::sin_mul:
        case Code::sin_mul_a:
            return wave([](const I&, double a, double b) { return elementary::sin(a * b); });
        case Code::cos_mul:
        case Code::cos_mul_a:
            return wave([](const I&, double a, double b) { return elementary::cos(a * b); });
        default:
            return rarer_function();
        }
    }
    I::Run rarer_function() const {
        switch (i_.code) {
        case Code::tan:
        case Code::tan_a:
            return some([](const I&, double a) { return std::tan(a); });
        case Code::asin:
        case Code::asin_a:
            return some([](const I&, double a) { return std::asin(a); });
        case Code::atan:
        case Code::atan_a:
            return some([](const I&, double a) { return std::atan(a); });
        case Code::sinh:
        case Code::sinh_a:
            return some([](const I&, double a) { return std::sinh(a); });
        case Code::cosh:
        case Code::cosh_a:
            return some([](const I&, double a) { return std::cosh(a); });
        case Code::tanh:
        case Code::tanh_a:
            return some([](const I&, double a) { return std::tanh(a); });
        case Code::magnitude:
        case Code::magnitude_a:
            return some([](const I&, double a) { return std::abs(a); });
        case Code::sign:
        case Code::sign_a:
            return some([](const I&, double a) { return a > 0 ? 1.0 : a < 0 ? -1.0 : a * 0.0; });
        case Code::call:
            return call_step;
        default:
            return I::halt;
        }
    }

    static constexpr std::size_t n_places = std::size_t(From::time);
    static constexpr From from(std::size_t place) { return static_cast<From>(place); }
    /// Where operand `which` is; `n_places` and more for what few steps have.
    std::size_t place(const Operand& o, int which) const {
        return std::size_t(at_hand_ == which           ? From::last
                           : o.space == Operand::slot  ? From::slot
                           : o.space == Operand::state ? From::state
                           : o.space == Operand::param ? From::param
                                                       : From::time);
    }
    template <class Op, From... F> I::Run pick(Op) const {
        return keep_ ? take_step<Op, true, F...> : take_step<Op, false, F...>;
    }
    template <class Op, class Table> I::Run pick_at(Op, Table table, std::size_t at) const {
        static constexpr auto kept = table.template operator()<Op, true>(),
                              handed_on = table.template operator()<Op, false>();
        return keep_ ? kept[at] : handed_on[at];
    }

    template <class Op> I::Run none(Op op) const { return pick<Op>(op); }
    template <class Op> I::Run one(Op op) const {
        constexpr auto table = []<class F, bool Keep>() {
            return []<std::size_t... K>(std::index_sequence<K...>) {
                return std::array<I::Run, n_places + 1>{take_step<F, Keep, from(K)>...};
            }(std::make_index_sequence<n_places + 1>{});
        };
        return pick_at(op, table, place(i_.a, 1));
    }
    template <class Op> I::Run two(Op op) const {
        constexpr auto table = []<class F, bool Keep>() {
            return []<std::size_t... K>(std::index_sequence<K...>) {
                return std::array<I::Run, n_places * n_places>{
                    take_step<F, Keep, from(K / n_places), from(K % n_places)>...};
            }(std::make_index_sequence<n_places * n_places>{});
        };
        const std::size_t a = place(i_.a, 1), b = place(i_.b, 2);
        return a < n_places && b < n_places ? pick_at(op, table, a * n_places + b) : rare(op);
    }
    /// a, b and c: b is a slot or a parameter mostly, c no state.
    template <class Op> I::Run three(Op op) const {
        constexpr auto table = []<class F, bool Keep>() {
            return []<std::size_t... K>(std::index_sequence<K...>) {
                constexpr std::array second{From::slot, From::param};
                constexpr std::array third{From::last, From::slot, From::param};
                return std::array<I::Run, n_places * 6>{
                    take_step<F, Keep, from(K / 6), second[K / 3 % 2], third[K % 3]>...};
            }(std::make_index_sequence<n_places * 6>{});
        };
        constexpr auto last = std::size_t(From::last), slot = std::size_t(From::slot),
                       param = std::size_t(From::param);
        const std::size_t a = place(i_.a, 1), b = place(i_.b, 2), c = place(i_.c, 3);
        const bool often =
            a < n_places && (b == slot || b == param) && (c == last || c == slot || c == param);
        return often ? pick_at(op, table,
                               a * 6 + (b == param ? 3 : 0) +
                                   (c == last   ? 0
                                    : c == slot ? 1
                                                : 2))
                     : rare(op);
    }
    template <class Op> I::Run quotient(Op op) const {
        const bool of_param = i_.a.space == Operand::param && at_hand_ == 2;
        if (of_param && i_.c.space == Operand::slot)
            return pick<Op, From::param, From::last, From::slot>(op);
        if (of_param && i_.c.space == Operand::param)
            return pick<Op, From::param, From::last, From::param>(op);
        return rare(op);
    }
    /// A function of one number, which is at hand or anywhere.
    template <class Op> I::Run some(Op op) const {
        return at_hand_ == 1 ? pick<Op, From::last>(op) : pick<Op, From::any>(op);
    }
    /// A function of a product, of time and a parameter mostly.
    template <class Op> I::Run wave(Op op) const {
        const bool by_param = i_.b.space == Operand::param;
        if (by_param && at_hand_ == 1)
            return pick<Op, From::last, From::param>(op);
        if (by_param && i_.a.space == Operand::time)
            return pick<Op, From::time, From::param>(op);
        return rare(op);
    }
    template <class Op> I::Run rare(Op op) const {
        if constexpr (std::is_invocable_v<Op, const I&, double, double>)
            return pick<Op, From::any, From::any>(op);
        else
            return pick<Op, From::any, From::any, From::any>(op);
    }

    const Instruction& i_;
    bool keep_;
    int at_hand_;
};

/// Makes steps of a program.
class StepMaker {
public:
    StepMaker(std::span<const Instruction> code, std::span<const Operand> outputs,
              std::span<const std::shared_ptr<const External>> functions, int n_slots)
        : code_(code.first(code.size() - 1)), outputs_(outputs), functions_(functions),
          number_of_(std::size_t(n_slots)) {
        number();
        find_what_is_kept();
    }

    std::vector<TapeStep> operator()() {
        copy_given();
        for (std::size_t k = 0; k < code_.size(); ++k) {
            if (k > 0 && is_fresh(k))
                rest();
            add(code_[k], kept_[k], is_fresh(k));
        }
        copy_results();
        steps_.emplace_back();
        return std::move(steps_);
    }

private:
    static constexpr std::size_t stretch = 64; ///< so many steps between two rests

    static bool is_fresh(std::size_t k) { return k % stretch == 0; }

    /// The slot of an output is no other's afterwards: it is that output's number. (What a function
    /// returns lies in a row, and stays where it is.)
    void number() {
        const std::size_t n = outputs_.size();
        for (std::size_t s = 0; s < number_of_.size(); ++s)
            number_of_[s] = static_cast<std::uint16_t>(n + s);
        for (std::size_t k = 0; k < n && functions_.empty(); ++k)
            if (const Operand& o = outputs_[k];
                o.space == Operand::slot && number_of_[o.index] >= n)
                number_of_[o.index] = static_cast<std::uint16_t>(k);
    }
    void find_what_is_kept() {
        std::vector<bool> needed(number_of_.size(), false);
        const auto need = [&](const Operand& o, bool at_hand) {
            if (o.space == Operand::slot && !at_hand)
                needed[o.index] = true;
        };
        kept_.resize(code_.size());
        for (const Operand& o : outputs_)
            need(o, false);
        for (std::size_t k = code_.size(); k-- > 0;) {
            const Instruction& i = code_[k];
            const int has = is_fresh(k) ? 0 : at_hand(i.code);
            kept_[k] = needed[i.slot];
            needed[i.slot] = false;
            need(i.a, has == 1);
            need(i.b, has == 2);
            need(i.c, has == 3);
        }
    }
    /// The same product with a state first: fewer steps are needed.
    static Instruction with_state_first(Instruction i) {
        const bool has_product = i.code >= Code::mul_add && i.code < Code::div_add;
        if (has_product && at_hand(i.code) != 1 && i.b.space == Operand::state)
            std::swap(i.a, i.b);
        return i;
    }
    void add(const Instruction& as_written, bool keep, bool fresh) {
        const Instruction i = with_state_first(as_written);
        TapeStep step;
        step.run = StepChooser(i, keep, fresh)();
        const int has = fresh ? 0 : at_hand(i.code);
        step.a = has == 1 ? Operand{} : placed(i.a);
        step.b = has == 2 ? Operand{} : placed(i.b);
        step.c = has == 3 ? Operand{} : placed(i.c);
        step.to = number_of_[i.slot];
        if (i.code == Code::call)
            step.function = functions_[i.a.index].get();
        else
            step.k = i.k;
        steps_.push_back(step);
    }
    void copy(std::size_t k) {
        Instruction i;
        i.a = outputs_[k];
        TapeStep step;
        step.run = StepChooser(i, true, true).copies();
        step.a = placed(i.a);
        step.to = static_cast<std::uint16_t>(k);
        steps_.push_back(step);
        if (k % stretch == stretch - 1)
            rest();
    }
    /// Outputs that are states, parameters, or the time.
    void copy_given() {
        for (std::size_t k = 0; k < outputs_.size(); ++k)
            if (outputs_[k].space != Operand::slot)
                copy(k);
    }
    /// What two outputs are, or a function returned.
    void copy_results() {
        for (std::size_t k = 0; k < outputs_.size(); ++k)
            if (outputs_[k].space == Operand::slot && number_of_[outputs_[k].index] != k)
                copy(k);
    }
    void rest() {
        steps_.emplace_back();
        steps_.back().run = rest_step;
    }
    Operand placed(Operand o) const {
        if (o.space == Operand::slot)
            o.index = number_of_[o.index];
        return o;
    }

    std::span<const Instruction> code_; ///< without `halt`
    std::span<const Operand> outputs_;
    std::span<const std::shared_ptr<const External>> functions_;
    std::vector<std::uint16_t> number_of_; ///< of each slot
    std::vector<bool> kept_;               ///< results that are needed later than by the next step
    std::vector<TapeStep> steps_;
};

FILIPPOV_IN_LIBRARY std::vector<TapeStep>
steps_of(std::span<const Instruction> code, std::span<const Operand> outputs,
         std::span<const std::shared_ptr<const External>> functions, int n_slots) {
    return StepMaker(code, outputs, functions, n_slots)();
}

} // namespace filippov::detail

#endif
