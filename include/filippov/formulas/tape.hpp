// SPDX-License-Identifier: BSD-3-Clause
// Formulas as programs of a register machine, which runs them for every scalar.
//
// A machine whose instructions meet in memory waits for each number to come back from there. So the
// last result stays at hand, in `acc`: most instructions take it as an operand.
#pragma once

#include <filippov/core/elementary.hpp>
#include <filippov/core/scalar.hpp>
#include <filippov/formulas/detail/instruction.hpp>
#include <filippov/formulas/detail/tape_steps.hpp>
#include <filippov/formulas/external.hpp>

#include <algorithm>
#include <array>
#include <concepts>
#include <limits>
#include <memory>
#include <vector>

namespace filippov {

/// A program that computes some expressions. `write_tape` makes it of them; without any it does
/// nothing.
class Tape {
public:
    std::size_t size() const { return code_.size(); }

    /// @param x    state, and p: parameters with what is derived from them
    /// @param out  one entry an output; not x
    /// @tparam Outputs  how many there are, where that is known
    /// @cost no allocation, except for derivatives of external functions
    template <int Outputs = -1, class S>
    FILIPPOV_INLINE void run(const S& t, const S* x, const S* p, S* out) const {
        if constexpr (!std::same_as<S, double>) {
            run_in_loop(t, x, p, out);
        } else if constexpr (Outputs >= 0 && Outputs <= few) {
            double numbers[few];
            take_steps(t, x, p, numbers);
            copy_singly<Outputs>(numbers, out); // nobody else is told of `out`: it may be registers
        } else {
            run_in_steps(t, x, p, out);
        }
    }
    /// The same by a loop over the instructions, whatever the scalar.
    template <class S> void run_in_loop(const S& t, const S* x, const S* p, S* out) const {
        if (n_slots_ <= few)
            run_in<few>(t, x, p, out);
        else
            run_in<most>(t, x, p, out);
    }

private:
    static constexpr int few = 32, most = 1024; ///< numbers that are kept at once

    /// @param numbers  `few`: outputs come first there, as many as fit
    void take_steps(double t, const double* x, const double* p, double* numbers) const;
    void run_in_steps(double t, const double* x, const double* p, double* out) const;
    void all_steps(double t, const double* x, const double* p, double* numbers) const {
        for (const detail::TapeStep* i = steps_.data(); i != nullptr;)
            i = i->run(i, numbers, x, p, 0.0, t);
    }
    /// What has just been written one by one, and is going to be used all at once: if it were read
    /// all at once here, it would have to leave the store buffer first.
    template <int N> FILIPPOV_INLINE static void copy_singly(const double* from, double* to) {
        std::array<double, std::size_t(N)> copy;
        for (std::size_t k = 0; k < copy.size(); ++k)
            copy[k] = static_cast<const volatile double&>(from[k]);
        for (std::size_t k = 0; k < copy.size(); ++k)
            to[k] = copy[k];
    }

    template <int Slots, class S>
    FILIPPOV_INLINE void run_in(const S& t, const S* x, const S* p, S* out) const {
        // raw: numbers with derivatives would all be set to zero first
        alignas(S) std::byte raw[sizeof(S) * Slots];
        Interpreter<S>::run(*this, reinterpret_cast<S*>(raw), t, x, p, out);
    }
    /// A class, so that one line says of a scalar that the library filippov::compiled runs it.
    template <class S> struct Interpreter {
        FILIPPOV_NOINLINE static void run(const Tape& tape, S* slots, const S& t, const S* x,
                                          const S* p, S* out);
    };

    std::vector<detail::Instruction> code_{1}; ///< the last one is `halt`
    std::vector<detail::Operand> outputs_;
    std::vector<std::shared_ptr<const External>> functions_;
    int n_slots_ = 0;
    std::vector<detail::TapeStep> steps_{1}; ///< the same for plain numbers
    int n_numbers_ = 0;                      ///< slots and outputs

    friend class TapeWriter;
};

template <class S>
void Tape::Interpreter<S>::run(const Tape& tape, S* slots, const S& t, const S* x, const S* p,
                               S* out) {
    using detail::Code;
    using elementary::cos;
    using elementary::sin;
    using std::abs, std::asin, std::atan, std::cosh, std::exp, std::log, std::pow, std::sinh,
        std::sqrt, std::tan, std::tanh;
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
    const detail::Instruction* i = tape.code_.data();
    for (;; ++i) {
        switch (i->code) {
        case Code::halt:
            for (std::size_t k = 0; k < tape.outputs_.size(); ++k)
                out[k] = at(tape.outputs_[k]);
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
        case Code::mul_add:
            acc = fused(at(i->a), at(i->b), at(i->c));
            break;
        case Code::mul_add_a:
            acc = fused(S(acc), at(i->b), at(i->c));
            break;
        case Code::mul_add_ra:
            acc = fused(at(i->a), at(i->b), S(acc));
            break;
        case Code::mul_sub:
            acc = fused(at(i->a), at(i->b), S(-at(i->c)));
            break;
        case Code::mul_sub_a:
            acc = fused(S(acc), at(i->b), S(-at(i->c)));
            break;
        case Code::mul_sub_ra:
            acc = fused(at(i->a), at(i->b), S(-acc));
            break;
        case Code::sub_mul:
            acc = fused(S(-at(i->a)), at(i->b), at(i->c));
            break;
        case Code::sub_mul_a:
            acc = fused(S(-acc), at(i->b), at(i->c));
            break;
        case Code::sub_mul_ra:
            acc = fused(S(-at(i->a)), at(i->b), S(acc));
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
        case Code::magnitude:
            acc = abs(at(i->a));
            break;
        case Code::magnitude_a:
            acc = abs(S(acc));
            break;
        case Code::sign:
            acc = sign(at(i->a));
            break;
        case Code::sign_a:
            acc = sign(S(acc));
            break;
        case Code::call: {
            const External& f = *tape.functions_[i->a.index];
            for (int k = 0; k < f.outputs; ++k)
                std::construct_at(slots + i->slot + k, S(std::numeric_limits<double>::quiet_NaN()));
            evaluate(f, t, x, p, slots + i->slot);
            continue;
        }
        default:
            FILIPPOV_UNREACHABLE();
        }
        std::construct_at(slots + i->slot, acc);
    }
}

#if !defined(FILIPPOV_COMPILED) || defined(FILIPPOV_COMPILING)
FILIPPOV_NOINLINE FILIPPOV_IN_LIBRARY void
Tape::take_steps(double t, const double* x, const double* p, double* numbers) const {
    if (n_numbers_ <= few) [[likely]]
        return all_steps(t, x, p, numbers);
    double many[2 * most];
    all_steps(t, x, p, many);
    std::copy_n(many, std::min(outputs_.size(), std::size_t(few)), numbers);
}
FILIPPOV_NOINLINE FILIPPOV_IN_LIBRARY void Tape::run_in_steps(double t, const double* x,
                                                              const double* p, double* out) const {
    double many[2 * most];
    all_steps(t, x, p, many);
    std::copy_n(many, outputs_.size(), out);
}
#endif

#if defined(FILIPPOV_COMPILED)
// Of scalars for which systems of every size, or all with several surfaces, ask.
extern template struct Tape::Interpreter<Taylor<double, 1>>;
extern template struct Tape::Interpreter<Taylor<double, 2>>;
extern template struct Tape::Interpreter<Taylor<double, 4>>;
extern template struct Tape::Interpreter<Taylor<double, 9>>;
extern template struct Tape::Interpreter<Taylor<Taylor<double, 1>, 1>>;
extern template struct Tape::Interpreter<Taylor<Taylor<double, 2>, 1>>;
extern template struct Tape::Interpreter<Taylor<Taylor<double, 4>, 1>>;
extern template struct Tape::Interpreter<Taylor<Taylor<Taylor<double, 1>, 1>, 1>>;
extern template struct Tape::Interpreter<Taylor<Taylor<Taylor<double, 2>, 1>, 1>>;
extern template struct Tape::Interpreter<Taylor<Taylor<Taylor<double, 4>, 1>, 1>>;
extern template struct Tape::Interpreter<Dual<Dual<double, 2>, 2>>;
#endif

} // namespace filippov
