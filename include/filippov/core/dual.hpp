// SPDX-License-Identifier: BSD-3-Clause
// Dual numbers: a value and its derivatives in K directions.
//
// Why not Eigen's AutoDiffScalar: it neither nests (second derivatives) nor works as the
// coefficient of a Taylor series (Lie derivatives with their gradients) without a dozen
// specialisations of its own.
#pragma once

#include <filippov/core/elementary.hpp>
#include <filippov/core/taylor.hpp>

#include <algorithm>
#include <array>
#include <concepts>
#include <type_traits>

namespace filippov {

/// v + d_1 e_1 + ... + d_K e_K with e_i e_j = 0. Nested, Dual<Dual<double, 1>, K> has K second
/// derivatives along the inner direction.
template <class S, int K> struct Dual {
    S v;
    std::array<S, std::size_t(K)> d;

    Dual() : Dual(S(0)) {}
    Dual(const S& value) : v(value) { d.fill(S(0)); }
    template <class T>
        requires(std::is_arithmetic_v<T> && !std::same_as<T, S>)
    Dual(T value) : Dual(S(value)) {}

    /// value + e_i
    static Dual variable(const S& value, int i) {
        Dual x(value);
        x.d[std::size_t(i)] = S(1);
        return x;
    }

    Dual& operator+=(const Dual& b) {
        v += b.v;
        for (std::size_t i = 0; i < d.size(); ++i)
            d[i] += b.d[i];
        return *this;
    }
    Dual& operator-=(const Dual& b) {
        v -= b.v;
        for (std::size_t i = 0; i < d.size(); ++i)
            d[i] -= b.d[i];
        return *this;
    }
    Dual& operator*=(const Dual& b) { return *this = *this * b; }
    Dual& operator/=(const Dual& b) { return *this = *this / b; }

    friend Dual operator+(const Dual& a) { return a; }
    friend Dual operator-(const Dual& a) { return a.along(-a.v, S(-1)); }
    friend Dual operator+(Dual a, const Dual& b) { return a += b; }
    friend Dual operator-(Dual a, const Dual& b) { return a -= b; }
    friend Dual operator*(const Dual& a, const Dual& b) {
        Dual r(S(a.v * b.v));
        for (std::size_t i = 0; i < r.d.size(); ++i)
            r.d[i] = a.d[i] * b.v + a.v * b.d[i];
        return r;
    }
    friend Dual operator/(const Dual& a, const Dual& b) {
        const S inverse = S(1) / b.v;
        Dual r(S(a.v * inverse));
        for (std::size_t i = 0; i < r.d.size(); ++i)
            r.d[i] = (a.d[i] - r.v * b.d[i]) * inverse;
        return r;
    }
    // A plain number has no derivatives to multiply.
    template <std::floating_point T> friend Dual operator*(const Dual& a, T b) {
        Dual r(S(a.v * b));
        for (std::size_t i = 0; i < r.d.size(); ++i)
            r.d[i] = a.d[i] * b;
        return r;
    }
    template <std::floating_point T> friend Dual operator*(T b, const Dual& a) { return a * b; }

    // A comparison looks at the value only: the branch taken is the branch at e = 0.
    friend bool operator<(const Dual& a, const Dual& b) { return a.v < b.v; }
    friend bool operator>(const Dual& a, const Dual& b) { return a.v > b.v; }
    friend bool operator<=(const Dual& a, const Dual& b) { return a.v <= b.v; }
    friend bool operator>=(const Dual& a, const Dual& b) { return a.v >= b.v; }
    friend bool operator==(const Dual& a, const Dual& b) { return a.v == b.v; }

    friend Dual abs(const Dual& a) { return a.v < S(0) ? -a : a; }
    friend Dual sqrt(const Dual& a) {
        using std::sqrt;
        const S r = sqrt(a.v);
        return a.along(r, S(1) / (r + r));
    }
    friend Dual exp(const Dual& a) {
        using std::exp;
        const S r = exp(a.v);
        return a.along(r, r);
    }
    friend Dual log(const Dual& a) {
        using std::log;
        return a.along(log(a.v), S(1) / a.v);
    }
    friend Dual sin(const Dual& a) {
        using elementary::cos;
        using elementary::sin;
        return a.along(sin(a.v), cos(a.v));
    }
    friend Dual cos(const Dual& a) {
        using elementary::cos;
        using elementary::sin;
        return a.along(cos(a.v), -sin(a.v));
    }
    friend Dual tan(const Dual& a) {
        using std::tan;
        const S r = tan(a.v);
        return a.along(r, S(1) + r * r);
    }
    friend Dual asin(const Dual& a) {
        using std::asin;
        using std::sqrt;
        return a.along(asin(a.v), S(1) / sqrt(S(S(1) - a.v * a.v)));
    }
    friend Dual atan(const Dual& a) {
        using std::atan;
        return a.along(atan(a.v), S(1) / (S(1) + a.v * a.v));
    }
    friend Dual sinh(const Dual& a) {
        using std::cosh;
        using std::sinh;
        return a.along(sinh(a.v), cosh(a.v));
    }
    friend Dual cosh(const Dual& a) {
        using std::cosh;
        using std::sinh;
        return a.along(cosh(a.v), sinh(a.v));
    }
    friend Dual tanh(const Dual& a) {
        using std::tanh;
        const S r = tanh(a.v);
        return a.along(r, S(1) - r * r);
    }
    /// a^n for an integer n, exact at a = 0.
    friend Dual pow(const Dual& a, int n) {
        if (n < 0)
            return Dual(1) / pow(a, -n);
        Dual r(1), base = a;
        for (; n > 0; n /= 2, base = base * base)
            if (n % 2 == 1)
                r = r * base;
        return r;
    }
    /// a^e for a real exponent; a > 0, or zero and e > 0 or a constant.
    friend Dual pow(const Dual& a, const Dual& e) {
        if constexpr (std::same_as<decltype(a.v == S(0)), bool>) // (lanes are not of one kind)
            if (a.v == S(0) && (e.v > S(0) || e.is_constant()))
                return power_at_zero(a, e.v);
        return exp(e * log(a));
    }

    bool is_constant() const { return std::all_of(d.begin(), d.end(), detail::is_nil<S>); }

private:
    static Dual power_at_zero(const Dual& a, const S& e) {
        using std::pow;
        Dual r(pow(a.v, e));
        const S slope = detail::is_nil(e) ? S(0) : S(e * pow(a.v, S(e - S(1))));
        for (std::size_t i = 0; i < a.d.size(); ++i)
            if (!detail::is_nil(a.d[i])) // zero times infinity is none of them
                r.d[i] = slope * a.d[i];
        return r;
    }
    /// A function of this number: its value and its derivative here.
    Dual along(const S& value, const S& slope) const {
        Dual r(value);
        for (std::size_t i = 0; i < d.size(); ++i)
            r.d[i] = slope * d[i];
        return r;
    }
};

template <class T> inline constexpr bool is_dual_v = false;
template <class S, int K> inline constexpr bool is_dual_v<Dual<S, K>> = true;
template <class T>
concept DualNumber = is_dual_v<T>;

/// How many times duals are nested.
template <class T> inline constexpr int nesting_v = 0;
template <class S, int K> inline constexpr int nesting_v<Dual<S, K>> = 1 + nesting_v<S>;

template <class S, int K> auto value_of(const Dual<S, K>& x) { return value_of(x.v); }

/// The part of a scalar whose powers vanish: all but its value.
template <DualNumber D> D infinitesimal(D x) {
    x -= D(value_of(x));
    return x;
}

/// The values of a vector.
template <class S, int N> auto values_of(const Vec<S, N>& x) {
    Vec<Real<S>, N> r;
    for (int i = 0; i < N; ++i)
        r[i] = value_of(x[i]);
    return r;
}

} // namespace filippov

template <class S, int K> struct Eigen::NumTraits<filippov::Dual<S, K>> : Eigen::NumTraits<double> {
    using Real = filippov::Dual<S, K>;
    using NonInteger = Real;
    using Literal = Real;
    using Nested = Real;
    enum { IsComplex = 0, IsInteger = 0, IsSigned = 1, RequireInitialization = 1 };
};
