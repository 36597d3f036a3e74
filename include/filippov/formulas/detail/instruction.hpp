// SPDX-License-Identifier: BSD-3-Clause
// Instructions of tapes.
#pragma once

#include <cstdint>

namespace filippov::detail {

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
    // a b + c, a b - c and c - a b, see `fused`; `_a` has a at hand, `_ra` has c
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
    magnitude,
    magnitude_a,
    sign,
    sign_a,
    call, // external function a, into as many slots as it has outputs; nothing is at hand after it
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

} // namespace filippov::detail
