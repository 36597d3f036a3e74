// SPDX-License-Identifier: BSD-3-Clause
// Several numbers at once: the only header that knows how a machine does that.
//
// Lanes are kept in registers of the machine the code is compiled for, in as many of them as it
// takes: vectors of the compiler with GCC and Clang, single numbers elsewhere, where the same code
// runs one lane after the other.
//
// A lane's bits depend on nothing but its own operands: the operations are those of IEEE 754,
// products are fused with sums where `fused` says so and the machine can, and nowhere else if the
// compiler is told so (-ffp-contract=off, which the CMake target does).
#pragma once

#include <filippov/core/elementary.hpp>
#include <filippov/core/scalar.hpp>

#include <bit>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>
#include <utility>

#if defined(__GNUC__) && defined(__x86_64__)
#include <immintrin.h>
#endif

#if defined(__GNUC__)
// What the compiler says about vectors passed between functions concerns calls between objects
// that are compiled for different machines; such are never linked together.
#pragma GCC diagnostic ignored "-Wpsabi"
#endif

namespace filippov {

/// Doubles in a register of the machine that this is compiled for.
#if defined(__AVX512F__) && defined(__AVX512DQ__)
inline constexpr int native_lanes = 8;
#elif defined(__AVX2__) && defined(__FMA__)
inline constexpr int native_lanes = 4;
#elif defined(__GNUC__)
inline constexpr int native_lanes = 2;
#else
inline constexpr int native_lanes = 1;
#endif

namespace detail {

/// A register of W doubles, and masks for it; what is here is what the language has no operator
/// for.
template <int W> struct LaneRegister;

/// One lane: a plain number.
template <> struct LaneRegister<1> {
    using Value = double;
    using Integer = std::int64_t;
    using Mask = bool;

    static double get(double v, int) { return v; }
    static void set(double& v, int, double value) { v = value; }
    static bool less(double a, double b) { return a < b; }
    static bool at_most(double a, double b) { return a <= b; }
    static bool equal(double a, double b) { return a == b; }
    static bool both(bool a, bool b) { return a && b; }
    static bool either(bool a, bool b) { return a || b; }
    static bool opposite(bool a) { return !a; }
    static unsigned word(bool m) { return m; }
    static bool mask(unsigned word) { return (word & 1u) != 0; }
    static double choose(bool m, double a, double b) { return m ? a : b; }
    static double smaller(double a, double b) { return b < a ? b : a; }
    static double larger(double a, double b) { return a < b ? b : a; }
    static double fused(double a, double b, double c) { return filippov::fused(a, b, c); }
    static double root(double v) { return std::sqrt(v); }
    static std::int64_t bits(double v) { return std::bit_cast<std::int64_t>(v); }
    static double of_bits(std::int64_t n) { return std::bit_cast<double>(n); }
    static double number(std::int64_t n) { return static_cast<double>(n); }
    static std::int64_t integer(double v) { return static_cast<std::int64_t>(v); }
};

#if defined(__GNUC__)
template <class T, int W> struct CompilerVector {
    typedef T type __attribute__((vector_size(sizeof(T) * W)));
};
/// A vector of the compiler; a mask is -1 where true and 0 elsewhere.
///
/// Only arithmetic is left to the compiler. Comparisons and choices are not: g++ 12 crashes on them
/// where vectors are wider than SSE2 knows operations for, and at low levels of optimisation.
template <int W> struct VectorRegister {
    using Value = typename CompilerVector<double, W>::type;
    using Integer = typename CompilerVector<std::int64_t, W>::type;
    using Unsigned = typename CompilerVector<std::uint64_t, W>::type;
    using Mask = Integer;

    static double get(const Value& v, int l) { return v[l]; }
    static void set(Value& v, int l, double value) { v[l] = value; }
    FILIPPOV_INLINE static Mask less(const Value& a, const Value& b) {
#if defined(__AVX__)
        if constexpr (W == 4)
            return reinterpret_cast<Mask>(_mm256_cmp_pd(a, b, _CMP_LT_OQ));
#endif
#if defined(__x86_64__)
        if constexpr (W == 2)
            return reinterpret_cast<Mask>(_mm_cmplt_pd(a, b));
#endif
        return each([](double x, double y) { return x < y; }, a, b);
    }
    FILIPPOV_INLINE static Mask at_most(const Value& a, const Value& b) {
#if defined(__AVX__)
        if constexpr (W == 4)
            return reinterpret_cast<Mask>(_mm256_cmp_pd(a, b, _CMP_LE_OQ));
#endif
#if defined(__x86_64__)
        if constexpr (W == 2)
            return reinterpret_cast<Mask>(_mm_cmple_pd(a, b));
#endif
        return each([](double x, double y) { return x <= y; }, a, b);
    }
    FILIPPOV_INLINE static Mask equal(const Value& a, const Value& b) {
#if defined(__AVX__)
        if constexpr (W == 4)
            return reinterpret_cast<Mask>(_mm256_cmp_pd(a, b, _CMP_EQ_OQ));
#endif
#if defined(__x86_64__)
        if constexpr (W == 2)
            return reinterpret_cast<Mask>(_mm_cmpeq_pd(a, b));
#endif
        return each([](double x, double y) { return x == y; }, a, b);
    }
    FILIPPOV_INLINE static Mask both(const Mask& a, const Mask& b) { return a & b; }
    FILIPPOV_INLINE static Mask either(const Mask& a, const Mask& b) { return a | b; }
    FILIPPOV_INLINE static Mask opposite(const Mask& a) { return ~a; }
    FILIPPOV_INLINE static unsigned word(const Mask& m) {
#if defined(__AVX__)
        if constexpr (W == 4)
            return static_cast<unsigned>(_mm256_movemask_pd(reinterpret_cast<__m256d>(m)));
#endif
#if defined(__x86_64__)
        if constexpr (W == 2)
            return static_cast<unsigned>(_mm_movemask_pd(reinterpret_cast<__m128d>(m)));
#endif
        unsigned all = 0;
        for (int l = 0; l < W; ++l)
            all |= static_cast<unsigned>(m[l] & 1) << l;
        return all;
    }
    FILIPPOV_INLINE static Mask mask(unsigned word) {
        return [&]<int... L>(std::integer_sequence<int, L...>) FILIPPOV_LAMBDA_INLINE {
#if defined(__AVX2__)
            const auto shifted = (Unsigned{} + word) >> Unsigned{L...};
            return -reinterpret_cast<Mask>(shifted & 1u);
#else
            return Mask{-static_cast<std::int64_t>((word >> L) & 1u)...};
#endif
        }(std::make_integer_sequence<int, W>{});
    }
    FILIPPOV_INLINE static Value choose(const Mask& m, const Value& a, const Value& b) {
#if defined(__AVX__)
        if constexpr (W == 4)
            return _mm256_blendv_pd(b, a, reinterpret_cast<__m256d>(m));
#endif
        const auto x = reinterpret_cast<Integer>(a), y = reinterpret_cast<Integer>(b);
        return reinterpret_cast<Value>((x & m) | (y & ~m));
    }
    FILIPPOV_INLINE static Value smaller(const Value& a, const Value& b) {
#if defined(__AVX__)
        if constexpr (W == 4)
            return _mm256_min_pd(b, a); // the second one where either is NaN
#endif
#if defined(__x86_64__)
        if constexpr (W == 2)
            return _mm_min_pd(b, a);
#endif
        return choose(less(b, a), b, a);
    }
    FILIPPOV_INLINE static Value larger(const Value& a, const Value& b) {
#if defined(__AVX__)
        if constexpr (W == 4)
            return _mm256_max_pd(b, a);
#endif
#if defined(__x86_64__)
        if constexpr (W == 2)
            return _mm_max_pd(b, a);
#endif
        return choose(less(a, b), b, a);
    }
    FILIPPOV_INLINE static Value fused(const Value& a, const Value& b, const Value& c) {
#if defined(__FP_FAST_FMA)
#if defined(__AVX512F__)
        if constexpr (W == 8)
            return _mm512_fmadd_pd(a, b, c);
#endif
#if defined(__x86_64__)
        if constexpr (W == 4)
            return _mm256_fmadd_pd(a, b, c);
        if constexpr (W == 2)
            return _mm_fmadd_pd(a, b, c);
#endif
        Value r{};
        for (int l = 0; l < W; ++l)
            r[l] = __builtin_fma(a[l], b[l], c[l]);
        return r;
#else
        return a * b + c;
#endif
    }
    FILIPPOV_INLINE static Value root(const Value& v) {
#if defined(__AVX512F__)
        if constexpr (W == 8)
            return _mm512_mask_sqrt_pd(v, 0xff, v);
#endif
#if defined(__AVX__)
        if constexpr (W == 4)
            return _mm256_sqrt_pd(v);
#endif
#if defined(__x86_64__)
        if constexpr (W == 2)
            return _mm_sqrt_pd(v);
#endif
        Value r{};
        for (int l = 0; l < W; ++l)
            r[l] = std::sqrt(v[l]);
        return r;
    }
    FILIPPOV_INLINE static Integer bits(const Value& v) { return reinterpret_cast<Integer>(v); }
    FILIPPOV_INLINE static Value of_bits(const Integer& n) { return reinterpret_cast<Value>(n); }
    /// Either half as the last digits of a number large enough, and both together rounded once.
    FILIPPOV_INLINE static Value number(const Integer& n) {
        constexpr std::int64_t low = 0x4330000000000000, // 2^52
            high = 0x4530000080000000;                   // 2^84 + 2^63
        const Value lower = of_bits((n & 0xffffffff) | low);
        const Value upper =
            of_bits(reinterpret_cast<Integer>(reinterpret_cast<Unsigned>(n) >> 32) ^ high);
        return (upper - (0x1p84 + 0x1p63 + 0x1p52)) + lower;
    }
    /// The nearest integer, where the language takes the lower one: above 2^52 all are integers.
    FILIPPOV_INLINE static Integer integer(const Value& v) {
        constexpr double rounds = 0x1.8p52; // what is added to it is rounded to an integer
        const Value upper = v * 0x1p-32 + rounds;
        const Value lower = (v - (upper - rounds) * 0x1p32) + rounds;
        const Integer zero = bits(rounds - Value{});
        return ((bits(upper) - zero) << 32) + (bits(lower) - zero);
    }

private:
    template <class F> static Mask each(F f, const Value& a, const Value& b) {
        Mask m{};
        for (int l = 0; l < W; ++l)
            m[l] = -std::int64_t(f(a[l], b[l]));
        return m;
    }
};
template <int W> struct LaneRegister : VectorRegister<W> {};

#if defined(__AVX512F__) && defined(__AVX512DQ__)
/// AVX-512 has registers for masks.
template <> struct LaneRegister<8> : VectorRegister<8> {
    using Mask = __mmask8;

    FILIPPOV_INLINE static Mask less(const Value& a, const Value& b) {
        return _mm512_cmp_pd_mask(a, b, _CMP_LT_OQ);
    }
    FILIPPOV_INLINE static Mask at_most(const Value& a, const Value& b) {
        return _mm512_cmp_pd_mask(a, b, _CMP_LE_OQ);
    }
    FILIPPOV_INLINE static Mask equal(const Value& a, const Value& b) {
        return _mm512_cmp_pd_mask(a, b, _CMP_EQ_OQ);
    }
    FILIPPOV_INLINE static Mask both(Mask a, Mask b) { return _kand_mask8(a, b); }
    FILIPPOV_INLINE static Mask either(Mask a, Mask b) { return _kor_mask8(a, b); }
    FILIPPOV_INLINE static Mask opposite(Mask a) { return _knot_mask8(a); }
    FILIPPOV_INLINE static unsigned word(Mask m) { return m; }
    FILIPPOV_INLINE static Mask mask(unsigned word) { return static_cast<Mask>(word); }
    FILIPPOV_INLINE static Value choose(Mask m, const Value& a, const Value& b) {
        return _mm512_mask_blend_pd(m, b, a);
    }
    FILIPPOV_INLINE static Value smaller(const Value& a, const Value& b) {
        return _mm512_mask_min_pd(a, 0xff, b, a); // the second one where either is NaN
    }
    FILIPPOV_INLINE static Value larger(const Value& a, const Value& b) {
        return _mm512_mask_max_pd(a, 0xff, b, a);
    }
    FILIPPOV_INLINE static Value number(const Integer& n) {
        return __builtin_convertvector(n, Value);
    }
    FILIPPOV_INLINE static Integer integer(const Value& v) {
        return __builtin_convertvector(v, Integer);
    }
};
#endif
#endif

/// What lanes are kept in: as many registers as it takes.
template <int W> struct LaneLayout {
    static_assert(W >= 1 && (W & (W - 1)) == 0 && W <= 32, "filippov: lanes come in powers of two");
    static constexpr int each = W < native_lanes ? W : native_lanes;
    static constexpr int n = W / each;
    using Register = LaneRegister<each>;
    template <class T> struct Array {
        T part[n];
    };
    using Values = Array<typename Register::Value>;
    using Masks = Array<typename Register::Mask>;
};

/// f of each register.
template <class R, class F, class... A> FILIPPOV_INLINE R in_registers(F f, const A&... a) {
    R r;
    for (std::size_t k = 0; k < std::size(r.part); ++k)
        r.part[k] = f(a.part[k]...);
    return r;
}

} // namespace detail

/// A truth value in each of W lanes.
template <int W> struct LaneMask {
    using Layout = detail::LaneLayout<W>;
    using Register = typename Layout::Register;
    using Masks = typename Layout::Masks;
    Masks m;

    LaneMask() = default;
    explicit LaneMask(const Masks& masks) : m(masks) {}
    explicit LaneMask(bool everywhere) : LaneMask(from_word(everywhere ? ~0u : 0u)) {}
    /// Bit l of `word` for lane l.
    FILIPPOV_INLINE static LaneMask from_word(unsigned word) {
        LaneMask r;
        for (int k = 0; k < Layout::n; ++k)
            r.m.part[k] = Register::mask(word >> (k * Layout::each));
        return r;
    }
    /// Bit l for lane l.
    FILIPPOV_INLINE unsigned word() const {
        unsigned all = 0;
        for (int k = 0; k < Layout::n; ++k)
            all |= Register::word(m.part[k]) << (k * Layout::each);
        return all;
    }
    bool operator[](int l) const { return ((word() >> l) & 1u) != 0; }

    FILIPPOV_INLINE friend LaneMask operator&(const LaneMask& a, const LaneMask& b) {
        return LaneMask(detail::in_registers<Masks>(
            [](const auto& x, const auto& y) { return Register::both(x, y); }, a.m, b.m));
    }
    FILIPPOV_INLINE friend LaneMask operator|(const LaneMask& a, const LaneMask& b) {
        return LaneMask(detail::in_registers<Masks>(
            [](const auto& x, const auto& y) { return Register::either(x, y); }, a.m, b.m));
    }
    FILIPPOV_INLINE friend LaneMask operator~(const LaneMask& a) {
        return LaneMask(
            detail::in_registers<Masks>([](const auto& x) { return Register::opposite(x); }, a.m));
    }
    FILIPPOV_INLINE friend bool any(const LaneMask& a) { return a.word() != 0; }
};

/// W doubles; a `Scalar` whose comparisons give a LaneMask.
template <int W> struct Lanes {
    using Layout = detail::LaneLayout<W>;
    using Register = typename Layout::Register;
    using Array = typename Layout::Values;
    using Mask = LaneMask<W>;
    static constexpr int width = W;

    Array v;

    Lanes() = default;
    explicit Lanes(const Array& values) : v(values) {}
    // Not left to the compiler: it would copy several at once, by parts of registers, and to load
    // a whole register where parts were stored takes long.
    FILIPPOV_INLINE Lanes(const Lanes& other) { *this = other; }
    FILIPPOV_INLINE Lanes& operator=(const Lanes& other) {
        for (int k = 0; k < Layout::n; ++k)
            v.part[k] = other.v.part[k];
        return *this;
    }
    FILIPPOV_INLINE Lanes(double everywhere) {
        for (int k = 0; k < Layout::n; ++k)
            v.part[k] = everywhere - typename Register::Value{};
    }

    /// value(l) in lane l.
    template <class F> FILIPPOV_INLINE static Lanes of(const F& value) {
        Lanes r;
        for (int k = 0; k < Layout::n; ++k)
            r.v.part[k] = [&]<int... L>(std::integer_sequence<int, L...>) FILIPPOV_LAMBDA_INLINE {
                return typename Register::Value{value(k * Layout::each + L)...};
            }(std::make_integer_sequence<int, Layout::each>{});
        return r;
    }

    double operator[](int l) const {
        return Register::get(v.part[l / Layout::each], l % Layout::each);
    }
    void set(int l, double value) {
        Register::set(v.part[l / Layout::each], l % Layout::each, value);
    }

    FILIPPOV_INLINE friend Lanes operator+(const Lanes& a, const Lanes& b) {
        return Lanes(detail::in_registers<Array>([](const auto& x, const auto& y) { return x + y; },
                                                 a.v, b.v));
    }
    FILIPPOV_INLINE friend Lanes operator-(const Lanes& a, const Lanes& b) {
        return Lanes(detail::in_registers<Array>([](const auto& x, const auto& y) { return x - y; },
                                                 a.v, b.v));
    }
    FILIPPOV_INLINE friend Lanes operator*(const Lanes& a, const Lanes& b) {
        return Lanes(detail::in_registers<Array>([](const auto& x, const auto& y) { return x * y; },
                                                 a.v, b.v));
    }
    FILIPPOV_INLINE friend Lanes operator/(const Lanes& a, const Lanes& b) {
        return Lanes(detail::in_registers<Array>([](const auto& x, const auto& y) { return x / y; },
                                                 a.v, b.v));
    }
    FILIPPOV_INLINE friend Lanes operator-(const Lanes& a) {
        return Lanes(detail::in_registers<Array>([](const auto& x) { return -x; }, a.v));
    }
    FILIPPOV_INLINE friend Lanes operator+(const Lanes& a) { return a; }
    FILIPPOV_INLINE Lanes& operator+=(const Lanes& b) { return *this = *this + b; }
    FILIPPOV_INLINE Lanes& operator-=(const Lanes& b) { return *this = *this - b; }
    FILIPPOV_INLINE Lanes& operator*=(const Lanes& b) { return *this = *this * b; }
    FILIPPOV_INLINE Lanes& operator/=(const Lanes& b) { return *this = *this / b; }

    FILIPPOV_INLINE friend Mask operator<(const Lanes& a, const Lanes& b) {
        return Mask(detail::in_registers<typename Layout::Masks>(
            [](const auto& x, const auto& y) { return Register::less(x, y); }, a.v, b.v));
    }
    FILIPPOV_INLINE friend Mask operator<=(const Lanes& a, const Lanes& b) {
        return Mask(detail::in_registers<typename Layout::Masks>(
            [](const auto& x, const auto& y) { return Register::at_most(x, y); }, a.v, b.v));
    }
    FILIPPOV_INLINE friend Mask operator==(const Lanes& a, const Lanes& b) {
        return Mask(detail::in_registers<typename Layout::Masks>(
            [](const auto& x, const auto& y) { return Register::equal(x, y); }, a.v, b.v));
    }
    FILIPPOV_INLINE friend Mask operator>(const Lanes& a, const Lanes& b) { return b < a; }
    FILIPPOV_INLINE friend Mask operator>=(const Lanes& a, const Lanes& b) { return b <= a; }

    /// a where m, b elsewhere.
    FILIPPOV_INLINE friend Lanes select(const Mask& m, const Lanes& a, const Lanes& b) {
        return Lanes(detail::in_registers<Array>(
            [](const auto& w, const auto& x, const auto& y) { return Register::choose(w, x, y); },
            m.m, a.v, b.v));
    }
    // As std::min and std::max: the first operand where either is NaN.
    FILIPPOV_INLINE friend Lanes min(const Lanes& a, const Lanes& b) {
        return Lanes(detail::in_registers<Array>(
            [](const auto& x, const auto& y) { return Register::smaller(x, y); }, a.v, b.v));
    }
    FILIPPOV_INLINE friend Lanes max(const Lanes& a, const Lanes& b) {
        return Lanes(detail::in_registers<Array>(
            [](const auto& x, const auto& y) { return Register::larger(x, y); }, a.v, b.v));
    }
    FILIPPOV_INLINE friend Lanes abs(const Lanes& a) {
        return Lanes(detail::in_registers<Array>(
            [](const auto& x) { return Register::of_bits(Register::bits(x) & 0x7fffffffffffffff); },
            a.v));
    }
    FILIPPOV_INLINE friend Lanes ulp(const Lanes& t) {
        return max(Lanes(epsilon<double>) * abs(t), Lanes(std::numeric_limits<double>::min()));
    }
    FILIPPOV_INLINE friend Lanes ratio(const Lanes& a, double b) { return a * Lanes(1 / b); }
    /// a b + c, rounded once where the machine can do that as fast as twice.
    FILIPPOV_INLINE friend Lanes fused(const Lanes& a, const Lanes& b, const Lanes& c) {
        return Lanes(detail::in_registers<Array>(
            [](const auto& x, const auto& y, const auto& z) { return Register::fused(x, y, z); },
            a.v, b.v, c.v));
    }
    FILIPPOV_INLINE friend Lanes sqrt(const Lanes& a) {
        return Lanes(
            detail::in_registers<Array>([](const auto& x) { return Register::root(x); }, a.v));
    }

    // Beyond the bound of `elementary` these are NaN: a call into the library, were it never made,
    // would keep the compiler from holding anything in registers around it. Members of an ensemble
    // in such lanes are run by the scalar engine.
    FILIPPOV_INLINE friend Lanes cos(const Lanes& a) {
        return select(a.is_near(), elementary::detail::near_cos(a), Lanes(not_a_number));
    }
    FILIPPOV_INLINE friend Lanes sin(const Lanes& a) {
        return select(a.is_near(), elementary::detail::near_sin(a), Lanes(not_a_number));
    }
    /// value with its sign changed where `rounded`, an integer plus 1.5 * 2^52, is odd.
    FILIPPOV_INLINE friend Lanes flip_if_odd(const Lanes& value, const Lanes& rounded) {
        return Lanes(detail::in_registers<Array>(
            [](const auto& x, const auto& n) {
                return Register::of_bits(Register::bits(x) ^ (Register::bits(n) << 63));
            },
            value.v, rounded.v));
    }
    // The bits of each lane as a number, and back: logarithms and powers of 2, roughly.
    FILIPPOV_INLINE friend Lanes number_of_bits(const Lanes& a) {
        return Lanes(detail::in_registers<Array>(
            [](const auto& x) { return Register::number(Register::bits(x)); }, a.v));
    }
    FILIPPOV_INLINE friend Lanes with_bits(const Lanes& a) {
        return Lanes(detail::in_registers<Array>(
            [](const auto& x) { return Register::of_bits(Register::integer(x)); }, a.v));
    }

    // The library's functions, one lane after the other.
    friend Lanes exp(const Lanes& a) {
        return each([](double x) { return std::exp(x); }, a);
    }
    friend Lanes log(const Lanes& a) {
        return each([](double x) { return std::log(x); }, a);
    }
    friend Lanes tan(const Lanes& a) {
        return each([](double x) { return std::tan(x); }, a);
    }
    friend Lanes atan(const Lanes& a) {
        return each([](double x) { return std::atan(x); }, a);
    }
    friend Lanes asin(const Lanes& a) {
        return each([](double x) { return std::asin(x); }, a);
    }
    friend Lanes sinh(const Lanes& a) {
        return each([](double x) { return std::sinh(x); }, a);
    }
    friend Lanes cosh(const Lanes& a) {
        return each([](double x) { return std::cosh(x); }, a);
    }
    friend Lanes tanh(const Lanes& a) {
        return each([](double x) { return std::tanh(x); }, a);
    }
    friend Lanes floor(const Lanes& a) {
        return each([](double x) { return std::floor(x); }, a);
    }
    friend Lanes pow(const Lanes& a, int n) {
        return each([n](double x) { return std::pow(x, n); }, a);
    }
    friend Lanes pow(const Lanes& a, const Lanes& e) {
        return each([](double x, double y) { return std::pow(x, y); }, a, e);
    }

private:
    static constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

    FILIPPOV_INLINE Mask is_near() const {
        return abs(*this) < Lanes(elementary::detail::near_bound);
    }
    template <class F, class... A> static Lanes each(F f, const A&... a) {
        Lanes r;
        for (int l = 0; l < W; ++l)
            r.set(l, f(a[l]...));
        return r;
    }
};

/// Declared only, for `Real`: lanes have no one value.
template <int W> double value_of(const Lanes<W>& x);

template <int W> inline constexpr bool is_plain<Lanes<W>> = true;
template <int W> inline constexpr bool is_wide<Lanes<W>> = true;

} // namespace filippov

template <int W> struct Eigen::NumTraits<filippov::Lanes<W>> : Eigen::NumTraits<double> {
    using Real = filippov::Lanes<W>;
    using NonInteger = Real;
    using Literal = Real;
    using Nested = Real;
    enum { IsComplex = 0, IsInteger = 0, IsSigned = 1, RequireInitialization = 1 };
};
