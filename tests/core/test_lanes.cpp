// SPDX-License-Identifier: BSD-3-Clause
// Lanes against plain numbers, lane by lane and to the last bit.

#include "catch.hpp"

#include <filippov/core/lanes.hpp>
#include <filippov/core/taylor.hpp>
#include <filippov/methods/control.hpp>
#include <filippov/methods/dormand_prince5.hpp>
#include <filippov/methods/dormand_prince8.hpp>
#include <filippov/models/oscillator.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

using namespace filippov;

#define EACH_WIDTH ((int W), W), 1, 2, 4, 8, 16, 32

namespace {

constexpr double inf = std::numeric_limits<double>::infinity();
constexpr double no_number = std::numeric_limits<double>::quiet_NaN();

/// Where functions change their mind, and numbers of every size.
std::vector<double> samples() {
    std::vector<double> v{0.0,
                          1.0,
                          0.1,
                          0.75,
                          3.141592653589793,
                          1e5,
                          std::nextafter(1e5, 0.0),
                          std::nextafter(1e5, inf),
                          6755399441055744.0,
                          std::numeric_limits<double>::max(),
                          std::numeric_limits<double>::min(),
                          std::numeric_limits<double>::denorm_min(),
                          1e-300,
                          inf,
                          no_number};
    std::mt19937_64 random(7);
    const auto unit = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
    for (int k = 0; k < 33; ++k)
        v.push_back(unit() * std::pow(10.0, 12 * unit() - 6));
    for (std::size_t k = v.size(); k-- > 0;)
        v.push_back(-v[k]);
    return v;
}

bool same_bits(double a, double b) {
    return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}
/// Which NaN comes of two is not said by IEEE 754.
bool same(double a, double b) { return same_bits(a, b) || (std::isnan(a) && std::isnan(b)); }

template <int W> Lanes<W> load(const std::vector<double>& v, std::size_t from) {
    Lanes<W> r(0.0);
    for (int l = 0; l < W; ++l)
        r.set(l, v[(from + std::size_t(l)) % v.size()]);
    return r;
}

/// All pairs of samples, as two long lists.
struct Pairs {
    std::vector<double> a, b;
    Pairs() {
        const auto v = samples();
        for (const double x : v)
            for (const double y : v) {
                a.push_back(x);
                b.push_back(y);
            }
    }
};
const Pairs& pairs() {
    static const Pairs all;
    return all;
}

/// In how many lanes f differs from g on doubles.
template <int W, class F, class G> int differing(F f, G g, bool to_the_bit = false) {
    const auto& [a, b] = pairs();
    int n = 0;
    for (std::size_t k = 0; k < a.size(); k += W) {
        const Lanes<W> x = load<W>(a, k), y = load<W>(b, k), r = f(x, y);
        for (int l = 0; l < W; ++l) {
            const double expected = g(x[l], y[l]);
            n += !(to_the_bit ? same_bits(r[l], expected) : same(r[l], expected));
        }
    }
    return n;
}
template <int W, class F, class G> int differing_masks(F f, G g) {
    const auto& [a, b] = pairs();
    int n = 0;
    for (std::size_t k = 0; k < a.size(); k += W) {
        const Lanes<W> x = load<W>(a, k), y = load<W>(b, k);
        const LaneMask<W> m = f(x, y);
        for (int l = 0; l < W; ++l)
            n += m[l] != g(x[l], y[l]) || (((m.word() >> l) & 1u) != 0) != m[l];
        n += any(m) != (m.word() != 0);
    }
    return n;
}

constexpr unsigned full(int W) { return W == 32 ? ~0u : (1u << W) - 1u; }

/// Words of W bits: all of them, or a thousand.
std::vector<unsigned> words(int W) {
    std::vector<unsigned> v;
    if (W <= 8) {
        for (unsigned w = 0; w <= full(W); ++w)
            v.push_back(w);
        return v;
    }
    std::mt19937_64 random(3);
    v = {0u, full(W)};
    for (int l = 0; l < W; ++l)
        v.push_back(1u << l);
    for (int k = 0; k < 1000; ++k)
        v.push_back(static_cast<unsigned>(random()) & full(W));
    return v;
}

} // namespace

TEMPLATE_TEST_CASE_SIG("lanes: arithmetic is that of doubles", "[lanes]", EACH_WIDTH) {
    using T = Lanes<W>;
    static_assert(Scalar<T>);
    const auto check = [](auto f) { CHECK(differing<W>(f, f) == 0); };
    check([](auto x, auto y) { return x + y; });
    check([](auto x, auto y) { return x - y; });
    check([](auto x, auto y) { return x * y; });
    check([](auto x, auto y) { return x / y; });
    check([](auto x, auto y) { return x += y; });
    check([](auto x, auto y) { return x -= y; });
    check([](auto x, auto y) { return x *= y; });
    check([](auto x, auto y) { return x /= y; });
    // a constant and a sign change are no arithmetic: the sign of zero stays, and every NaN
    const auto exactly = [](auto f) { CHECK(differing<W>(f, f, true) == 0); };
    exactly([](auto x, auto) { return -x; });
    exactly([](auto x, auto) { return +x; });
    for (const double v : samples())
        for (int l = 0; l < W; ++l)
            if (!same(T(v)[l], v))
                FAIL_CHECK("T(" << v << ")[" << l << "] = " << T(v)[l]);
    CHECK(std::signbit(T(-0.0)[W - 1]));
}

TEMPLATE_TEST_CASE_SIG("lanes: comparisons, NaN included, are those of doubles", "[lanes]",
                       EACH_WIDTH) {
    const auto check = [](auto f) { CHECK(differing_masks<W>(f, f) == 0); };
    check([](auto x, auto y) { return x < y; });
    check([](auto x, auto y) { return x <= y; });
    check([](auto x, auto y) { return x > y; });
    check([](auto x, auto y) { return x >= y; });
    check([](auto x, auto y) { return x == y; });
}

TEMPLATE_TEST_CASE_SIG("lanes: min, max, abs and select copy bits as the library's do", "[lanes]",
                       EACH_WIDTH) {
    CHECK(differing<W>([](auto x, auto y) { return min(x, y); },
                       [](double x, double y) { return std::min(x, y); }, true) == 0);
    CHECK(differing<W>([](auto x, auto y) { return max(x, y); },
                       [](double x, double y) { return std::max(x, y); }, true) == 0);
    CHECK(differing<W>([](auto x, auto) { return abs(x); },
                       [](double x, double) { return std::abs(x); }, true) == 0);
    CHECK(differing<W>([](auto x, auto y) { return select(x < y, y, x); },
                       [](double x, double y) { return x < y ? y : x; }, true) == 0);
}

TEMPLATE_TEST_CASE_SIG("lanes: fused and sqrt are those of doubles", "[lanes]", EACH_WIDTH) {
    const auto third = [](auto x, auto y) { return fused(x, y, decltype(x)(-0.01)); };
    CHECK(differing<W>(third, third) == 0);
    const auto residue = [](auto x, auto y) { return fused(x, y, decltype(x)(-(x * y))); };
    CHECK(differing<W>(residue, residue) == 0);
    const auto own = [](auto x, auto y) { return fused(x, x, y); };
    CHECK(differing<W>(own, own) == 0);
    CHECK(differing<W>([](auto x, auto) { return sqrt(x); },
                       [](double x, double) { return std::sqrt(x); }) == 0);
}

TEMPLATE_TEST_CASE_SIG("lanes: cos and sin are the elementary ones below their bound, NaN beyond",
                       "[lanes]", EACH_WIDTH) {
    const auto in_bound = [](double x) { return std::abs(x) < elementary::detail::near_bound; };
    CHECK(differing<W>(
              [](auto x, auto) { return cos(x); },
              [&](double x, double) { return in_bound(x) ? elementary::cos(x) : no_number; }) == 0);
    CHECK(differing<W>(
              [](auto x, auto) { return sin(x); },
              [&](double x, double) { return in_bound(x) ? elementary::sin(x) : no_number; }) == 0);
    std::mt19937_64 random(11);
    int n = 0;
    for (int k = 0; k < 4000; ++k) {
        Lanes<W> x(0.0);
        for (int l = 0; l < W; ++l)
            x.set(l, (static_cast<double>(random() >> 11) * 0x1p-52 - 1) * (k % 2 ? 1e5 : 10.0));
        const Lanes<W> c = cos(x), s = sin(x);
        for (int l = 0; l < W; ++l)
            n += !same_bits(c[l], elementary::cos(x[l])) || !same_bits(s[l], elementary::sin(x[l]));
    }
    CHECK(n == 0);
}

TEMPLATE_TEST_CASE_SIG("lanes: the library's functions, lane by lane", "[lanes]", EACH_WIDTH) {
    const auto check = [](auto f) { CHECK(differing<W>(f, f) == 0); };
    using std::asin, std::atan, std::cosh, std::exp, std::floor, std::log, std::pow, std::sinh,
        std::tan, std::tanh;
    check([](auto x, auto) { return exp(x); });
    check([](auto x, auto) { return log(x); });
    check([](auto x, auto) { return tan(x); });
    check([](auto x, auto) { return atan(x); });
    check([](auto x, auto) { return asin(x); });
    check([](auto x, auto) { return sinh(x); });
    check([](auto x, auto) { return cosh(x); });
    check([](auto x, auto) { return tanh(x); });
    check([](auto x, auto) { return floor(x); });
    check([](auto x, auto) { return decltype(x)(pow(x, 3)); });
    check([](auto x, auto y) { return pow(x, y); });
}

TEMPLATE_TEST_CASE_SIG("lanes: signs, logarithms and powers by bits are those of doubles",
                       "[lanes]", EACH_WIDTH) {
    using namespace filippov::detail;
    using filippov::elementary::detail::flip_if_odd;
    CHECK(differing<W>(
              [](auto x, auto y) {
                  const decltype(x) magic(6755399441055744.0);
                  return flip_if_odd(x, decltype(x)(y + magic));
              },
              [](double x, double y) { return flip_if_odd(x, y + 6755399441055744.0); },
              true) == 0);
    const auto number = [](auto x, auto) { return number_of_bits(x); };
    CHECK(differing<W>(number, number, true) == 0);
    const auto logarithm = [](auto x, auto) { return log2_of(x); };
    CHECK(differing<W>(logarithm, logarithm, true) == 0);
    // bits that are those of a number: others do not come from a logarithm
    const auto back = [](auto x, auto) { return with_bits(number_of_bits(x)); };
    CHECK(differing<W>(back, back, true) == 0);
    for (double e = -1000; e < 1000; e += 0.37) {
        const Lanes<W> r = exp2_of(Lanes<W>(e));
        for (int l = 0; l < W; ++l)
            if (!same_bits(r[l], exp2_of(e)))
                FAIL_CHECK("exp2_of(" << e << ")[" << l << "]");
    }
    CHECK(log2_of(Lanes<W>(8.0))[W - 1] == 3.0);
    CHECK(exp2_of(Lanes<W>(-3.0))[W - 1] == 0.125);
}

TEMPLATE_TEST_CASE_SIG("lanes: masks are words of W bits", "[lanes]", EACH_WIDTH) {
    using M = LaneMask<W>;
    CHECK(M(true).word() == full(W));
    CHECK(M(false).word() == 0);
    CHECK_FALSE(any(M(false)));
    CHECK(M::from_word(~0u).word() == full(W)); // bits beyond the last lane mean nothing
    unsigned previous = 0x5a5a5a5au & full(W);
    int wrong = 0;
    for (const unsigned w : words(W)) {
        const M a = M::from_word(w), b = M::from_word(previous);
        wrong += a.word() != w || any(a) != (w != 0);
        for (int l = 0; l < W; ++l)
            wrong += a[l] != (((w >> l) & 1u) != 0);
        wrong += (a & b).word() != (w & previous);
        wrong += (a | b).word() != (w | previous);
        wrong += (~a).word() != (~w & full(W)) || any(~a) != (w != full(W));
        wrong += (~~a).word() != w;
        const Lanes<W> chosen = select(a, Lanes<W>(1.0), Lanes<W>(-0.0));
        for (int l = 0; l < W; ++l)
            wrong += !same_bits(chosen[l], a[l] ? 1.0 : -0.0);
        previous = w;
    }
    CHECK(wrong == 0);
}

TEMPLATE_TEST_CASE_SIG("lanes: setting one leaves the others", "[lanes]", EACH_WIDTH) {
    Lanes<W> v(0.25);
    for (int l = 0; l < W; ++l) {
        v.set(l, l);
        for (int k = 0; k < W; ++k)
            CHECK(v[k] == (k <= l ? double(k) : 0.25));
    }
}

TEMPLATE_TEST_CASE_SIG("lanes: are the scalar of Eigen's vectors", "[lanes]", EACH_WIDTH) {
    using T = Lanes<W>;
    const auto expression = [](const auto& a, const auto& b) {
        using X = std::decay_t<decltype(a)>;
        using S = typename X::Scalar;
        const X c = a + b - S(0.5) * a, d = -c / S(3) + X::Unit(1) - X::Zero();
        return X(d + X::Constant(c.dot(d)) + c.cwiseProduct(d) + X::Constant(c.squaredNorm()));
    };
    std::mt19937_64 random(5);
    const auto unit = [&] { return static_cast<double>(random() >> 11) * 0x1p-53 - 0.5; };
    Vec<T, 2> a, b;
    for (int i = 0; i < 2; ++i)
        for (int l = 0; l < W; ++l) {
            a[i].set(l, unit());
            b[i].set(l, unit());
        }
    const Vec<T, 2> r = expression(a, b);
    for (int l = 0; l < W; ++l) {
        const Vec<double, 2> expected =
            expression(Vec<double, 2>(a[0][l], a[1][l]), Vec<double, 2>(b[0][l], b[1][l]));
        CHECK(same_bits(r[0][l], expected[0]));
        CHECK(same_bits(r[1][l], expected[1]));
    }
}

TEMPLATE_TEST_CASE_SIG("lanes: power series of them differentiate", "[lanes]", EACH_WIDTH) {
    const auto f = [](const auto& x) {
        using S = std::decay_t<decltype(x)>;
        return exp(x) / (S(2) + x * x) - pow(x, 3) * log(S(3) + x) + sqrt(x + S(2)) * tanh(x);
    };
    const auto wave = [](const auto& x) { return cos(x) * sin(x + x); };
    // nothing that a compiler could know: its exp and log may differ from the library's
    std::mt19937_64 random(19);
    Lanes<W> at(0.0);
    for (int l = 0; l < W; ++l)
        at.set(l, 9 * static_cast<double>(random() >> 11) * 0x1p-53 - 0.9);
    const auto r = f(Taylor<Lanes<W>, 2>::variable(at)),
               s = wave(Taylor<Lanes<W>, 2>::variable(at));
    for (int l = 0; l < W; ++l) {
        const auto expected = f(Taylor<double, 2>::variable(at[l])),
                   waving = wave(Taylor<double, 2>::variable(at[l]));
        for (std::size_t k = 0; k < 3; ++k) {
            CHECK(same_bits(r.c[k][l], expected.c[k]));
            // the library's cos and sin there, the elementary ones here: two ulps of 1 each
            CHECK(s.c[k][l] == Approx(waving.c[k]).epsilon(0).margin(1e-14));
        }
    }
}

TEMPLATE_TEST_CASE_SIG("lanes: each has its own step control", "[lanes]", EACH_WIDTH) {
    const auto check = [](auto tableau) {
        using Tableau = decltype(tableau);
        StepControl<Tableau, Lanes<W>> lanes;
        std::array<StepControl<Tableau>, W> plain;
        std::mt19937_64 random(13);
        int n = 0;
        for (int k = 0; k < 500; ++k) {
            Lanes<W> error(0.0);
            unsigned accepted = 0;
            for (int l = 0; l < W; ++l) {
                const int kind = static_cast<int>(random() % 50);
                error.set(l, kind == 0   ? 0.0
                             : kind == 1 ? inf
                             : kind == 2 ? no_number
                                         : std::ldexp(1.0, static_cast<int>(random() % 80) - 60));
                accepted |= static_cast<unsigned>(error[l] <= 1) << l;
            }
            const Lanes<W> factor = lanes.factor(error, LaneMask<W>::from_word(accepted));
            for (std::size_t l = 0; l < W; ++l) {
                const int lane = static_cast<int>(l);
                n += !same_bits(factor[lane],
                                plain[l].factor(error[lane], ((accepted >> l) & 1u) != 0));
                n += !same_bits(lanes.previous[lane], plain[l].previous);
                n += !same_bits(lanes.largest[lane], plain[l].largest);
            }
        }
        CHECK(n == 0);
    };
    check(DormandPrince5{});
    check(DormandPrince8{});
}

TEMPLATE_TEST_CASE_SIG("lanes: a step has the bits of a step in one lane", "[lanes]", EACH_WIDTH) {
    const auto check = [](auto tableau) {
        using Tableau = decltype(tableau);
        const models::Oscillator sys;
        /// State, error and a point of the interpolant of lane 0 ... of as many as there are.
        const auto step = [&](auto width, const auto& starts) {
            using T = Lanes<decltype(width)::value>;
            Vec<T, 10> p;
            for (int i = 0; i < 10; ++i)
                p[i] = T(models::Oscillator::defaults[std::size_t(i)]);
            Vec<T, 2> x, x1;
            T dt(0.0);
            for (int l = 0; l < T::width; ++l) {
                x[0].set(l, starts[std::size_t(l)][0]);
                x[1].set(l, starts[std::size_t(l)][1]);
                dt.set(l, starts[std::size_t(l)][2]);
            }
            const T t(0.4);
            RungeKutta<Tableau, T, 2> rk;
            auto rhs = [&](std::size_t, const T& tau, const Vec<T, 2>& y) {
                return sys.f2(tau, y, p);
            };
            rk.k[0] = sys.f2(t, x, p);
            rk.step(rhs, t, x, dt, x1);
            const Vec<T, 2> weight(T(1e6) * dt, T(1e6) * dt);
            const T error = Tableau::squared_error(rk, weight);
            const Vec<T, 2> middle = rk.interpolant(rhs, t, x, dt, x1)(T(0.3));
            return std::array<T, 5>{x1[0], x1[1], error, middle[0], middle[1]};
        };
        std::mt19937_64 random(17);
        int n = 0;
        for (int k = 0; k < 100; ++k) {
            std::vector<std::array<double, 3>> starts;
            for (int l = 0; l < W; ++l)
                starts.push_back({4 * static_cast<double>(random() >> 11) * 0x1p-53 - 2,
                                  1 + 2 * static_cast<double>(random() >> 11) * 0x1p-53,
                                  0.01 + 0.2 * static_cast<double>(random() >> 11) * 0x1p-53});
            const auto all = step(std::integral_constant<int, W>{}, starts);
            for (int l = 0; l < W; ++l) {
                const auto one =
                    step(std::integral_constant<int, 1>{}, std::vector{starts[std::size_t(l)]});
                for (std::size_t i = 0; i < one.size(); ++i)
                    n += !same_bits(all[i][l], one[i][0]);
            }
        }
        CHECK(n == 0);
    };
    check(DormandPrince5{});
    check(DormandPrince8{});
}
