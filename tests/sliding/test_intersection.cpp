// SPDX-License-Identifier: BSD-3-Clause
// Sliding on several surfaces at once: the blend, what attracts, and what holds a solution.
#include "catch.hpp"

#include <filippov/core/dual.hpp>
#include <filippov/models/blocks.hpp>
#include <filippov/models/dieci_lopez.hpp>
#include <filippov/models/impacts.hpp>
#include <filippov/models/switches.hpp>
#include <filippov/sliding/junction.hpp>

#include <Eigen/LU>

#include <cmath>
#include <random>

using namespace filippov;

namespace {

/// Normal components of n surfaces, random.
template <int M> NormalField<double, M> random_field(int n, std::mt19937& random) {
    std::uniform_real_distribution<double> any(-1, 1);
    NormalField<double, M> w;
    w.n = n;
    for (unsigned v = 0; v < w.regions(); ++v)
        for (int i = 0; i < n; ++i)
            w.normal[v][i] = any(random);
    return w;
}
/// ... in each region towards the surfaces, with strength 0.1 to 1.
template <int M> NormalField<double, M> nodal_field(int n, std::mt19937& random) {
    auto w = random_field<M>(n, random);
    for (unsigned v = 0; v < w.regions(); ++v)
        for (int i = 0; i < n; ++i)
            w.normal[v][i] = ((v >> i & 1u) != 0 ? -1 : 1) * (0.1 + 0.9 * std::abs(w(v, i)));
    return w;
}

/// The largest normal component of a blend, computed plainly from its shares.
template <int M> double residual(const NormalField<double, M>& w, const Blend<double, M>& blend) {
    double largest = 0;
    for (int i = 0; i < w.n; ++i) {
        double sum = 0;
        for (unsigned v = 0; v < w.regions(); ++v)
            sum += blend.share[v] * w(v, i);
        largest = std::max(largest, std::abs(sum));
    }
    return largest;
}
template <int M> bool inside(const NormalField<double, M>& w, const Blend<double, M>& blend) {
    for (int i = 0; i < w.n; ++i)
        if (!(blend.below[i] >= 0 && blend.above[i] >= 0))
            return false;
    return true;
}

/// Follows z' = w(sign z) in the plane by itself: straight lines between half-axes, slides along
/// them. True if z comes a thousand times nearer, false if it leaves (far: it may go round); a
/// solution that does neither in a million pieces counts as leaving.
bool comes_near(const NormalField<double, 2>& w, double x, double y) {
    const double start = std::abs(x) + std::abs(y);
    for (int piece = 0; piece < 1000000; ++piece) {
        const double size = std::abs(x) + std::abs(y);
        if (size < 1e-3 * start)
            return true;
        if (size > 1e12 * start)
            return false;
        double z[2] = {x, y}, rate[2];
        const int axis = x == 0 ? 0 : y == 0 ? 1 : -1;
        unsigned region = unsigned(x > 0) | unsigned(y > 0) << 1;
        if (axis >= 0) {
            const unsigned bit = 1u << axis;
            const double l = w(region & ~bit, axis), r = w(region | bit, axis);
            if (l > 0 && r < 0) { // slides
                const int k = 1 - axis;
                rate[k] = (l * w(region | bit, k) - r * w(region & ~bit, k)) / (l - r);
                return rate[k] * z[k] < 0;
            }
            if (l < 0 && r > 0) // repels: either side, and the slide; no simple answer
                return false;
            region = r > 0 ? region | bit : region & ~bit;
        }
        for (int i = 0; i < 2; ++i)
            rate[i] = w(region, i);
        double t = 1e300;
        int hit = -1;
        for (int i = 0; i < 2; ++i)
            if (z[i] != 0 && z[i] * rate[i] < 0 && -z[i] / rate[i] < t) {
                t = -z[i] / rate[i];
                hit = i;
            }
        if (hit < 0)
            return false;
        x = hit == 0 ? 0 : x + t * rate[0];
        y = hit == 1 ? 0 : y + t * rate[1];
    }
    return false;
}

} // namespace

TEST_CASE("intersection: the blend makes all normal components vanish", "[intersection]") {
    std::mt19937 random(1);
    const auto check = [&]<int M>(std::integral_constant<int, M>, int n) {
        for (int k = 0; k < 2000; ++k) {
            const auto w = nodal_field<M>(n, random);
            const auto blend = detail::multilinear_blend(w);
            INFO("n = " << n << ", case " << k);
            REQUIRE(inside(w, blend));
            REQUIRE(residual(w, blend) < 1e-14);
            double sum = 0;
            for (unsigned v = 0; v < w.regions(); ++v)
                sum += blend.share[v];
            REQUIRE(sum == Approx(1).epsilon(1e-14));
        }
    };
    check(std::integral_constant<int, 1>{}, 1);
    check(std::integral_constant<int, 2>{}, 2);
    check(std::integral_constant<int, 3>{}, 3);
    check(std::integral_constant<int, 6>{}, 4);
    check(std::integral_constant<int, 6>{}, 6);
}

TEST_CASE("intersection: for fields affine in s the blend is Utkin's equivalent control",
          "[intersection]") {
    // L = c + B s: s = -B^-1 c, by Eigen
    std::mt19937 random(2);
    std::uniform_real_distribution<double> any(-1, 1);
    for (int k = 0; k < 2000; ++k) {
        Mat<double, 4, 4> B;
        Vec<double, 4> c;
        for (int i = 0; i < 4; ++i) {
            c[i] = any(random);
            for (int j = 0; j < 4; ++j)
                B(i, j) = 0.4 * any(random) - (i == j ? 2 : 0);
        }
        NormalField<double, 4> w;
        w.n = 4;
        for (unsigned v = 0; v < 16; ++v) {
            Vec<double, 4> s;
            for (int i = 0; i < 4; ++i)
                s[i] = (v >> i & 1u) != 0 ? 1 : -1;
            w.normal[v] = c + B * s;
        }
        const Vec<double, 4> s = -B.partialPivLu().solve(c);
        const auto blend = detail::multilinear_blend(w);
        for (int i = 0; i < 4; ++i) {
            CHECK(blend.below[i] == Approx(1 + s[i]).epsilon(0).margin(1e-13));
            CHECK(blend.above[i] == Approx(1 - s[i]).epsilon(0).margin(1e-13));
        }
        // diagonally dominant, so that every solution near comes in
        CHECK(attracts(w));
    }
}

TEST_CASE("intersection: the distance from an end loses no digits", "[intersection]") {
    // w of one region is tiny: 1 + s_0 = 2 tiny/(tiny + 1) to full relative accuracy
    for (const double tiny : {1e-3, 1e-8, 1e-15, 1e-100}) {
        NormalField<double, 2> w;
        w.n = 2;
        for (unsigned v = 0; v < 4; ++v) {
            w.normal[v][0] = (v & 1u) != 0 ? -1 : tiny;
            w.normal[v][1] = (v & 2u) != 0 ? -1 : 3;
        }
        const auto blend = detail::multilinear_blend(w);
        CHECK(blend.below[0] == Approx(2 * tiny / (1 + tiny)).epsilon(4e-16));
        CHECK(blend.above[1] == Approx(0.5).epsilon(4e-16));
    }
}

TEST_CASE("intersection: a blend in duals has the derivatives of its difference quotient",
          "[intersection]") {
    std::mt19937 random(3);
    for (int k = 0; k < 200; ++k) {
        const auto w = nodal_field<3>(3, random), dw = random_field<3>(3, random);
        NormalField<Dual<double, 1>, 3> dual;
        auto plus = w, minus = w;
        dual.n = 3;
        const double h = 1e-6;
        for (unsigned v = 0; v < 8; ++v)
            for (int i = 0; i < 3; ++i) {
                dual.normal[v][i] = Dual<double, 1>(w(v, i));
                dual.normal[v][i].d[0] = dw(v, i);
                plus.normal[v][i] += h * dw(v, i);
                minus.normal[v][i] -= h * dw(v, i);
            }
        const auto exact = detail::multilinear_blend(dual);
        const auto a = detail::multilinear_blend(plus), b = detail::multilinear_blend(minus);
        for (int i = 0; i < 3; ++i) // h^2 and rounding/h, times a condition of up to a hundred
            CHECK(exact.below[i].d[0] ==
                  Approx((a.below[i] - b.below[i]) / (2 * h)).epsilon(1e-5).margin(1e-6));
    }
}

TEST_CASE("intersection: the moments blend is the one of its four equations", "[intersection]") {
    std::mt19937 random(4);
    for (int k = 0; k < 1000; ++k) {
        const auto w = nodal_field<2>(2, random);
        const auto blend = detail::moments_blend(w);
        CHECK(residual(w, blend) < 1e-14);
        CHECK(inside(w, blend));
        for (unsigned v = 0; v < 4; ++v)
            CHECK(blend.share[v] >= 0);
        // each component in units of its size
        double size[2] = {0, 0}, moment = 0, sum = 0;
        for (unsigned v = 0; v < 4; ++v)
            for (int i = 0; i < 2; ++i)
                size[i] += w(v, i) * w(v, i);
        for (unsigned v = 0; v < 4; ++v) {
            const double length =
                std::sqrt(w(v, 0) * w(v, 0) / size[0] + w(v, 1) * w(v, 1) / size[1]);
            moment += (v == 0 || v == 3 ? 1 : -1) * length * blend.share[v];
            sum += blend.share[v];
        }
        CHECK(moment == Approx(0).margin(1e-14));
        CHECK(sum == Approx(1).epsilon(1e-14));
    }
}

TEST_CASE("intersection: what attracts in the plane is what solutions reach", "[intersection]") {
    std::mt19937 random(5);
    int attracting = 0, repelling = 0;
    for (int k = 0; k < 20000; ++k) {
        const auto w = random_field<2>(2, random);
        // starts in all quadrants and on all half-axes
        bool all = true;
        for (const double x : {-1.0, 0.0, 1.0})
            for (const double y : {-1.0, 0.0, 1.0})
                all = all && ((x == 0 && y == 0) || comes_near(w, x, y));
        // a half-axis that repels has no simple answer for the one who follows solutions
        bool repels = false;
        for (int axis = 0; axis < 2; ++axis)
            for (unsigned v = 0; v < 4; ++v)
                repels = repels || (w(v & ~(1u << axis), axis) < 0 && w(v | 1u << axis, axis) > 0);
        if (repels)
            continue;
        INFO("case " << k);
        CHECK(attracts(w) == all);
        ++(all ? attracting : repelling);
    }
    CHECK(attracting > 500); // the test saw both
    CHECK(repelling > 500);
}

TEST_CASE("intersection: what is said to attract in space does", "[intersection]") {
    // Chains of friction with random couplings: B = -K F, K symmetric and positive, attracts; B =
    // +K F does not.
    std::mt19937 random(6);
    std::uniform_real_distribution<double> any(0.1, 1);
    for (int k = 0; k < 500; ++k) {
        NormalField<double, 5> w;
        w.n = 5;
        Vec<double, 5> force;
        Mat<double, 5, 5> K = Mat<double, 5, 5>::Zero();
        for (int i = 0; i < 5; ++i) {
            force[i] = any(random);
            K(i, i) += 1.1;
            if (i > 0) {
                const double c = 0.5 * any(random);
                K(i, i - 1) = K(i - 1, i) = -c;
            }
        }
        for (unsigned v = 0; v < 32; ++v) {
            Vec<double, 5> s;
            for (int i = 0; i < 5; ++i)
                s[i] = (v >> i & 1u) != 0 ? force[i] : -force[i];
            w.normal[v] = -K * s;
        }
        CHECK(attracts(w));
        for (auto& normal : w.normal)
            normal = -normal;
        CHECK(!attracts(w));
    }
}

TEST_CASE("intersection: a saddle between two gates is found, and said not to attract",
          "[intersection]") {
    // GeneSwitch at (low, low): s = (0.2, 0.2) balances both, and repels along the diagonal of wins
    const models::GeneSwitch genes;
    const auto p = default_params<models::GeneSwitch>();
    const auto v = admissible(
        genes, Mode<4>{{-1, -1, -1, -1}},
        [] {
            SurfaceSet<4> on;
            on.add(0);
            on.add(1);
            return on;
        }(),
        0.0, Vec<double, 2>(4, 4), p, Arrival<double>{1, 0.1, 0, false, false}, SlideEnd<4>{},
        NonUnique::stop);
    CHECK(!v.unique);
    CHECK(v.n_options == 3);
    bool stays = false;
    for (int k = 0; k < v.kept(); ++k)
        stays = stays || v.option[std::size_t(k)] == Mode<4>{{0, 0, -1, -1}};
    CHECK(stays);
    const auto slide = joint_sliding(genes, Mode<4>{{0, 0, -1, -1}}, 0.0, Vec<double, 2>(4, 4), p);
    CHECK(slide.below[0] == Approx(1.2).epsilon(1e-14));
    CHECK(slide.below[1] == Approx(1.2).epsilon(1e-14));
    CHECK(slide.f.norm() < 1e-14);
    CHECK(slide.w < 0);
}

namespace {

/// Two spheres of radius 1 around (0, 0, 0) and (1, 0, 0), which meet in a circle at x = 1/2.
struct Spheres {
    static constexpr int dim = 3;
    static constexpr int surfaces = 2;
    template <Scalar S>
    Vec<S, 3> field(const S&, const Vec<S, 3>& x, const Vec<S, 2>&, const Vec<S, 0>&) const {
        return x;
    }
    template <Scalar S> Vec<S, 2> h(const S&, const Vec<S, 3>& x, const Vec<S, 0>&) const {
        const S r = x[1] * x[1] + x[2] * x[2];
        return {x[0] * x[0] + r - S(1), (x[0] - S(1)) * (x[0] - S(1)) + r - S(1)};
    }
};

} // namespace

TEST_CASE("intersection: constraints hold a point to rounding, by the smallest change",
          "[intersection]") {
    const Spheres sys;
    const Constraints<Spheres> both(sys, Mode<2>{{0, 0}});
    const Vec<double, 3> unit = Vec<double, 3>::Ones();
    const Vec<double, 3> y =
        project(sys, both, 0.0, Vec<double, 3>(0.52, 0.6, 0.61), Vec<double, 0>(), unit);
    CHECK(sys.h(0.0, y, Vec<double, 0>()).cwiseAbs().maxCoeff() < 5e-16);
    CHECK(y[0] == Approx(0.5).epsilon(1e-15));
    CHECK(y[1] / y[2] == Approx(0.6 / 0.61).epsilon(1e-4)); // radially, but for the curvature
    CHECK(independent(sys, both, 0.0, y, Vec<double, 0>(), unit));
    // where both gradients are parallel they are not independent
    CHECK(!independent(sys, both, 0.0, Vec<double, 3>(3, 0, 0), Vec<double, 0>(), unit));
}

TEST_CASE("intersection: contact takes the normal acceleration, and nothing else",
          "[intersection]") {
    const models::BouncingBall ball;
    const Vec<double, 2> p(9.8, 0.9), x(0, 0);
    const auto slide = joint_sliding(ball, Mode<1>{{0}}, 0.0, x, p);
    CHECK(slide.f.norm() < 1e-15);
    CHECK(slide.above[0] > 0);
    CHECK(slide.w > 0);
    const auto push = contact_push(ball, Mode<1>{{1}}, 0, 0.0, x, p);
    CHECK(push == Vec<double, 2>(0, 1));
    // upside down nothing holds it
    CHECK(joint_sliding(ball, Mode<1>{{0}}, 0.0, x, Vec<double, 2>(-9.8, 0.9)).above[0] < 0);
}
