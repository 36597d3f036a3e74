// SPDX-License-Identifier: BSD-3-Clause
// Truncated power series in one variable: the library's automatic differentiation.
//
// Why not Eigen's AutoDiffScalar: the engine needs derivatives *along a flow* up to order four
// (Lie derivatives of the switching function), which a first-order dual gives only by nesting four
// deep. A truncated series gives them in one pass, its order 1 is the dual number, and it nests.
#pragma once

#include <filippov/core/scalar.hpp>

#include <algorithm>
#include <array>
#include <type_traits>

namespace filippov {

namespace detail {

/// True if this is zero with all its derivatives.
template <class S> bool is_nil(const S& v) {
    if constexpr (requires { v.is_constant(); })
        return v == S(0) && v.is_constant();
    else
        return v == S(0);
}

} // namespace detail

/// c[0] + c[1] tau + ... + c[K] tau^K, arithmetic modulo tau^(K+1).
///
/// Recurrences: Griewank & Walther, Evaluating Derivatives, 2nd ed., tables 13.1 and 13.2.
template <class S, int K> struct Taylor {
    std::array<S, K + 1> c{};

    Taylor() { c.fill(S(0)); }
    Taylor(const S& value) : Taylor() { c[0] = value; }
    template <class T>
        requires(std::is_arithmetic_v<T> && !std::same_as<T, S>)
    Taylor(T value) : Taylor(S(value)) {}

    /// value + tau
    static Taylor variable(const S& value) {
        Taylor x(value);
        if constexpr (K >= 1)
            x.c[1] = S(1);
        return x;
    }

    Taylor& operator+=(const Taylor& b) { return *this = *this + b; }
    Taylor& operator-=(const Taylor& b) { return *this = *this - b; }
    Taylor& operator*=(const Taylor& b) { return *this = *this * b; }
    Taylor& operator/=(const Taylor& b) { return *this = *this / b; }

    friend Taylor operator+(const Taylor& a) { return a; }
    friend Taylor operator-(const Taylor& a) {
        Taylor r;
        for (int k = 0; k <= K; ++k)
            r.c[k] = -a.c[k];
        return r;
    }
    friend Taylor operator+(const Taylor& a, const Taylor& b) {
        Taylor r;
        for (int k = 0; k <= K; ++k)
            r.c[k] = a.c[k] + b.c[k];
        return r;
    }
    friend Taylor operator-(const Taylor& a, const Taylor& b) {
        Taylor r;
        for (int k = 0; k <= K; ++k)
            r.c[k] = a.c[k] - b.c[k];
        return r;
    }
    friend Taylor operator*(const Taylor& a, const Taylor& b) {
        Taylor r;
        for (int k = 0; k <= K; ++k)
            for (int j = 0; j <= k; ++j)
                r.c[k] += a.c[j] * b.c[k - j];
        return r;
    }
    friend Taylor operator/(const Taylor& a, const Taylor& b) {
        Taylor r;
        for (int k = 0; k <= K; ++k) {
            S sum = a.c[k];
            for (int j = 1; j <= k; ++j)
                sum -= b.c[j] * r.c[k - j];
            r.c[k] = sum / b.c[0];
        }
        return r;
    }

    // A comparison looks at the value only: the branch taken is the branch at tau = 0.
    friend bool operator<(const Taylor& a, const Taylor& b) { return a.c[0] < b.c[0]; }
    friend bool operator>(const Taylor& a, const Taylor& b) { return a.c[0] > b.c[0]; }
    friend bool operator<=(const Taylor& a, const Taylor& b) { return a.c[0] <= b.c[0]; }
    friend bool operator>=(const Taylor& a, const Taylor& b) { return a.c[0] >= b.c[0]; }
    friend bool operator==(const Taylor& a, const Taylor& b) { return a.c[0] == b.c[0]; }

    friend Taylor abs(const Taylor& a) { return a < Taylor(0) ? -a : a; }
    friend Taylor sqrt(const Taylor& a) {
        using std::sqrt;
        if constexpr (std::same_as<decltype(a.c[0] == S(0)), bool>) // (lanes are not of one kind)
            if (detail::is_nil(a))
                return a; // what stays zero has a root that does
        Taylor r(sqrt(a.c[0]));
        for (int k = 1; k <= K; ++k) {
            S sum = a.c[k];
            for (int j = 1; j < k; ++j)
                sum -= r.c[j] * r.c[k - j];
            r.c[k] = sum / (S(2) * r.c[0]);
        }
        return r;
    }
    friend Taylor exp(const Taylor& a) {
        using std::exp;
        Taylor r(exp(a.c[0]));
        for (int k = 1; k <= K; ++k) {
            for (int j = 1; j <= k; ++j)
                r.c[k] += S(j) * a.c[j] * r.c[k - j];
            r.c[k] = r.c[k] / S(k);
        }
        return r;
    }
    friend Taylor log(const Taylor& a) {
        using std::log;
        return integrate(log(a.c[0]), a, a);
    }
    friend Taylor sin(const Taylor& a) { return sin_cos(a)[0]; }
    friend Taylor cos(const Taylor& a) { return sin_cos(a)[1]; }
    friend Taylor tan(const Taylor& a) {
        const auto sc = sin_cos(a);
        return sc[0] / sc[1];
    }
    friend Taylor atan(const Taylor& a) {
        using std::atan;
        return integrate(atan(a.c[0]), a, Taylor(1) + a * a);
    }
    friend Taylor asin(const Taylor& a) {
        using std::asin;
        return integrate(asin(a.c[0]), a, sqrt(Taylor(1) - a * a));
    }
    friend Taylor sinh(const Taylor& a) { return (exp(a) - exp(-a)) / Taylor(2); }
    friend Taylor cosh(const Taylor& a) { return (exp(a) + exp(-a)) / Taylor(2); }
    friend Taylor tanh(const Taylor& a) {
        using std::tanh;
        // r' = (1 - r^2) a', order by order
        Taylor r(tanh(a.c[0]));
        for (int k = 1; k <= K; ++k) {
            S sum(0);
            for (int j = 1; j <= k; ++j) {
                S one_minus_r2 = (k == j) ? S(1) : S(0);
                for (int i = 0; i <= k - j; ++i)
                    one_minus_r2 -= r.c[i] * r.c[k - j - i];
                sum += S(j) * a.c[j] * one_minus_r2;
            }
            r.c[k] = sum / S(k);
        }
        return r;
    }
    /// a^n for an integer n, by repeated multiplication: exact at a = 0.
    friend Taylor pow(const Taylor& a, int n) {
        if (n < 0)
            return Taylor(1) / pow(a, -n);
        Taylor r(1), base = a;
        for (; n > 0; n /= 2, base = base * base)
            if (n % 2 == 1)
                r = r * base;
        return r;
    }
    /// a^e for a real exponent; a.c[0] > 0, or zero and e a constant.
    friend Taylor pow(const Taylor& a, const Taylor& e) {
        if constexpr (std::same_as<decltype(a.c[0] == S(0)), bool>) // (lanes are not of one kind)
            if (a.c[0] == S(0) && e.is_constant())
                return power_at_zero(a, e.c[0]);
        return exp(e * log(a));
    }

    bool is_constant() const { return std::all_of(c.begin() + 1, c.end(), detail::is_nil<S>); }

private:
    /// a^e by the binomial series in a - a.c[0], where there is no logarithm. Derivatives beyond
    /// those that a^e has are infinite.
    static Taylor power_at_zero(const Taylor& a, const S& e) {
        using std::pow;
        Taylor r(pow(a.c[0], e)), change = a, power(1);
        change.c[0] = S(0);
        S binomial(1);
        for (int m = 1; m <= K; ++m) {
            binomial = binomial * (e - S(m - 1)) / S(m);
            if (detail::is_nil(binomial))
                break; // an integer exponent
            power = power * change;
            for (int k = m; k <= K; ++k)
                if (!detail::is_nil(power.c[k])) // zero times infinity is none of them
                    r.c[k] += binomial * pow(a.c[0], S(e - S(m))) * power.c[k];
        }
        return r;
    }
    /// The series r with r(0) = value and r' = a' / d.
    static Taylor integrate(const S& value, const Taylor& a, const Taylor& d) {
        Taylor r(value);
        for (int k = 1; k <= K; ++k) {
            S sum = S(k) * a.c[k];
            for (int j = 1; j < k; ++j)
                sum -= S(j) * r.c[j] * d.c[k - j];
            r.c[k] = sum / (S(k) * d.c[0]);
        }
        return r;
    }
    static std::array<Taylor, 2> sin_cos(const Taylor& a) {
        using std::cos;
        using std::sin;
        Taylor s(sin(a.c[0])), c(cos(a.c[0]));
        for (int k = 1; k <= K; ++k) {
            for (int j = 1; j <= k; ++j) {
                s.c[k] += S(j) * a.c[j] * c.c[k - j];
                c.c[k] -= S(j) * a.c[j] * s.c[k - j];
            }
            s.c[k] = s.c[k] / S(k);
            c.c[k] = c.c[k] / S(k);
        }
        return {s, c};
    }
};

template <class S, int K> auto value_of(const Taylor<S, K>& x) { return value_of(x.c[0]); }

} // namespace filippov

template <class S, int K>
struct Eigen::NumTraits<filippov::Taylor<S, K>> : Eigen::NumTraits<double> {
    using Real = filippov::Taylor<S, K>;
    using NonInteger = Real;
    using Literal = Real;
    using Nested = Real;
    enum { IsComplex = 0, IsInteger = 0, IsSigned = 1, RequireInitialization = 1 };
};
