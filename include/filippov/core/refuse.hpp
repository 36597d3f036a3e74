// SPDX-License-Identifier: BSD-3-Clause
// How an argument that makes no sense is refused.
#pragma once

#include <cstdio>
#include <stdexcept>
#include <string>

namespace filippov::detail {

/// Throws std::invalid_argument with "argument = value: expectation".
template <class Number>
[[noreturn]] void refuse(const std::string& argument, Number value,
                         const std::string& expectation) {
    char digits[40];
    std::snprintf(digits, sizeof digits, "%Lg", static_cast<long double>(value));
    throw std::invalid_argument("filippov: " + argument + " = " + digits + ": " + expectation);
}
inline void require_positive(const std::string& argument, long long n) {
    if (!(n > 0))
        refuse(argument, n, "expected an integer > 0");
}
/// Of what may be an empty std::function.
template <class F> void require_callable(const std::string& argument, const F& f) {
    if constexpr (requires {
                      static_cast<bool>(f);
                      f == nullptr;
                  })
        if (f == nullptr)
            throw std::invalid_argument("filippov: " + argument +
                                        ": expected a function, not an empty one");
}

} // namespace filippov::detail
