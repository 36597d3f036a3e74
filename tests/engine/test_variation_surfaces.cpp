// SPDX-License-Identifier: BSD-3-Clause
// Derivatives of flows with several surfaces, jumps of the state and accumulation.
#include "run.hpp"

#include <filippov/engine/variation.hpp>
#include <filippov/models/blocks.hpp>
#include <filippov/models/dieci_lopez.hpp>
#include <filippov/models/impacts.hpp>
#include <filippov/models/switches.hpp>

#include <cmath>

using namespace filippov;

namespace {

/// The end of a run with its derivatives with respect to the start and the parameters.
template <class Sys> struct Varied {
    static constexpr int N = dim_v<Sys>, P = params_v<Sys>;
    bool singular = false;
    Vec<double, N> x;
    Mat<double, N, N + P> slope;
    int mode = 0;
};

template <class Sys>
Varied<Sys> vary(const Sys& sys, const Params<Sys, double>& p, const State<Sys, double>& x0,
                 double t_end, double tol = 1e-12) {
    constexpr int N = dim_v<Sys>, P = params_v<Sys>;
    using D = Dual<double, N + P>;
    Vec<D, N> x;
    for (int i = 0; i < N; ++i)
        x[i] = D::variable(x0[i], i);
    Vec<D, P> q;
    for (int i = 0; i < P; ++i)
        q[i] = D::variable(p[i], N + i);
    const auto r = flow<DormandPrince8>(sys, q, x, D(0.0), D(t_end), tolerance<N>(tol));
    INFO(r.run.message());
    CHECK(r.run.status == Status::ok);
    Varied<Sys> result;
    result.singular = r.singular;
    result.mode = r.run.mode.code();
    for (int i = 0; i < N; ++i) {
        result.x[i] = value_of(r.x[i]);
        for (int k = 0; k < N + P; ++k)
            result.slope(i, k) = r.x[i].d[std::size_t(k)];
    }
    return result;
}

/// The same by central differences of plain runs.
template <class Sys>
Mat<double, dim_v<Sys>, dim_v<Sys> + params_v<Sys>>
differences(const Sys& sys, const Params<Sys, double>& p, const State<Sys, double>& x0,
            double t_end, double h) {
    constexpr int N = dim_v<Sys>, P = params_v<Sys>;
    Mat<double, N, N + P> slope;
    const auto end = [&](int k, double by) {
        State<Sys, double> x = x0;
        Params<Sys, double> q = p;
        (k < N ? x[k] : q[k - N]) += by;
        const auto r = flow<DormandPrince8>(sys, q, x, 0.0, t_end, tolerance<N>(1e-13));
        CHECK(r.status == Status::ok);
        return r.x;
    };
    for (int k = 0; k < N + P; ++k)
        slope.col(k) = (end(k, h) - end(k, -h)) / (2 * h);
    return slope;
}

/// Both agree to `margin` of the largest derivative.
template <class Sys>
void check_differences(const Sys& sys, const Params<Sys, double>& p, const State<Sys, double>& x0,
                       double t_end, double margin, double h = 1e-6) {
    const auto exact = vary(sys, p, x0, t_end);
    CHECK_FALSE(exact.singular);
    const auto near = differences(sys, p, x0, t_end, h);
    INFO("\n" << exact.slope << "\n and \n" << near);
    CHECK((exact.slope - near).cwiseAbs().maxCoeff() <= margin * near.cwiseAbs().maxCoeff());
}

} // namespace

// Margins: h^2 times a third derivative, and 1e-13 of global error over h = 1e-6.

TEST_CASE("variation: through slides on one and two of two surfaces", "[variation]") {
    const models::BeltChain<2> chain;
    const auto p = default_params<models::BeltChain<2>>();
    const Vec<double, 4> x0(0.5, 0, -0.3, 0);
    for (const double t_end : {1.5, 3.0, 10.0, 13.0, 15.0, 16.0}) {
        INFO("t = " << t_end);
        check_differences(chain, p, x0, t_end, 1e-5);
    }
    // each surface slid on takes a direction, exactly
    const auto two = vary(chain, p, x0, 5.0);
    CHECK(two.mode == 0);
    CAPTURE(two.slope);
    CHECK(two.slope.block<1, 4>(1, 0).cwiseAbs().maxCoeff() == 0);
    CHECK(two.slope.block<1, 4>(3, 0).cwiseAbs().maxCoeff() == 0);
}

TEST_CASE("variation: starts on an intersection fall onto it with all their neighbours",
          "[variation]") {
    const models::BeltChain<2> chain;
    const auto p = default_params<models::BeltChain<2>>();
    const double V = p[0];
    // both stick to the belt
    check_differences(chain, p, Vec<double, 4>(0.1, V, 0.2, V), 0.5, 1e-5);
    check_differences(chain, p, Vec<double, 4>(0.1, V, 0.2, V), 6.0, 1e-5);
}

namespace {

/// Slides on y = 0 up to x = 0, where the field in y turns up so much that it leaves both at once.
struct LeaveBoth {
    static constexpr int dim = 2;
    static constexpr int surfaces = 2;
    static constexpr std::array<std::string_view, 1> params{"right"};
    template <Scalar S>
    Vec<S, 2> field(const S&, const Vec<S, 2>&, const Vec<S, 2>& s, const Vec<S, 1>& p) const {
        return {S(1), -s[1] + p[0] * (S(1) + s[0]) * S(0.5)};
    }
    template <Scalar S> Vec<S, 2> h(const S&, const Vec<S, 2>& x, const Vec<S, 1>&) const {
        return x;
    }
};

/// Both of x and y fall to zero and are set to 1; z then becomes 2z, and z + 1 or 3z.
struct Corner {
    static constexpr int dim = 3;
    static constexpr int surfaces = 2;
    static constexpr std::array kinds{SurfaceKind::jump, SurfaceKind::jump};
    bool adds = false;
    template <Scalar S> Vec<S, 3> f(const S&, const Vec<S, 3>&, const Vec<S, 0>&) const {
        return {S(-1), S(-1), S(0)};
    }
    template <Scalar S> Vec<S, 2> h(const S&, const Vec<S, 3>& x, const Vec<S, 0>&) const {
        return {x[0], x[1]};
    }
    template <Scalar S> Vec<S, 3> jump(int j, const S&, Vec<S, 3> x, const Vec<S, 0>&) const {
        x[j] = S(1);
        x[2] = j == 0 ? S(S(2) * x[2]) : adds ? S(x[2] + S(1)) : S(S(3) * x[2]);
        return x;
    }
};

} // namespace

TEST_CASE("variation: two surfaces left at once by one event", "[variation]") {
    // from (-1, 0.3): y = 0 at t = 0.3, x = 0 at t = 1, from there y' = right - 1
    const Vec<double, 1> p(2.0);
    check_differences(LeaveBoth{}, p, Vec<double, 2>(-1, 0.3), 2.0, 1e-6);
    const auto r = vary(LeaveBoth{}, p, Vec<double, 2>(-1, 0.3), 2.0);
    CHECK(r.mode == 4);
    CHECK(r.slope(1, 0) == Approx(1).epsilon(1e-12)); // sooner there
    CHECK(r.slope(1, 1) == 0);
    CHECK(r.slope(1, 2) == Approx(1).epsilon(1e-12));
}

TEST_CASE("variation: at jumps of two surfaces at once the order must not matter", "[variation]") {
    const auto free = vary(Corner{}, {}, Vec<double, 3>(1, 1, 1), 1.5);
    CHECK_FALSE(free.singular);
    CHECK(free.x[2] == 6);
    CHECK(free.slope(2, 2) == 6);
    CHECK(vary(Corner{true}, {}, Vec<double, 3>(1, 1, 1), 1.5).singular);
}

TEST_CASE("variation: through seventeen crossings of four surfaces to rest", "[variation]") {
    const models::TwoBlocks blocks;
    check_differences(blocks, default_params<models::TwoBlocks>(), Vec<double, 4>(-2, 0.1, 3, -0.1),
                      8.0, 1e-5);
}

TEST_CASE("variation: an orbit that leaves an intersection at a point forgets where it was",
          "[variation]") {
    // Dieci and Lopez's orbit leaves at (1, 0.2, 0.4): what is left of the start is when
    const auto r = vary(models::DieciLopez2{}, {}, Vec<double, 3>(0.04, -0.01, -0.02), 5.0);
    CHECK_FALSE(r.singular);
    const auto field = side_field(models::DieciLopez2{}, Mode<2>{{-1, -1}}, 0.0, r.x, {});
    for (int k = 0; k < 3; ++k) {
        const double delay = r.slope(0, k) / field[0];
        for (int i = 0; i < 3; ++i)
            CHECK(r.slope(i, k) == Approx(delay * field[i]).epsilon(1e-9).margin(1e-12));
    }
    check_differences(models::DieciLopez2{}, {}, Vec<double, 3>(0.04, -0.01, -0.02), 5.0, 1e-5);
}

TEST_CASE("variation: a jump has the saltation matrix of impacts", "[variation]") {
    // Free flight, one impact: x+ = (0, -e v). With v1 = -sqrt(v^2 + 2 g x) at the impact, time
    // t1 = (v - v1)/g, the state at t is (u w - g w^2/2, u - g w), u = -e v1, w = t - t1.
    const double g = 9.8, e = 0.9, x = 10, v = 0.3, t = 2;
    const auto r = vary(models::BouncingBall{}, {g, e}, Vec<double, 2>(x, v), t);
    const double v1 = -std::sqrt(v * v + 2 * g * x), t1 = (v - v1) / g, u = -e * v1, w = t - t1;
    const double dv1_dx = g / v1, dv1_dv = v / v1;
    const double dt_dx = -dv1_dx / g, dt_dv = (1 - dv1_dv) / g;
    CHECK(r.slope(0, 0) == Approx(-e * dv1_dx * w - (u - g * w) * dt_dx).epsilon(1e-12));
    CHECK(r.slope(0, 1) == Approx(-e * dv1_dv * w - (u - g * w) * dt_dv).epsilon(1e-12));
    CHECK(r.slope(1, 0) == Approx(-e * dv1_dx + g * dt_dx).epsilon(1e-12));
    CHECK(r.slope(1, 1) == Approx(-e * dv1_dv + g * dt_dv).epsilon(1e-12));
    check_differences(models::BouncingBall{}, {g, e}, Vec<double, 2>(x, v), 9.0, 1e-6);
}

TEST_CASE("variation: friction and impacts together", "[variation]") {
    check_differences(models::ImpactBelt{}, default_params<models::ImpactBelt>(),
                      Vec<double, 2>(0.1, 0.2), 8.0, 1e-4);
    check_differences(models::ImpactBelt{}, default_params<models::ImpactBelt>(),
                      Vec<double, 2>(0.1, 0.2), 20.0, 1e-3);
}

TEST_CASE("variation: what has come to rest by accumulation has no derivatives but zero",
          "[variation]") {
    const auto r = vary(models::BouncingBall{}, {9.8, 0.5}, Vec<double, 2>(1, 0.3), 5);
    CHECK_FALSE(r.singular);
    CHECK(r.mode == 0);
    CHECK(r.slope.cwiseAbs().maxCoeff() == 0);
    const auto spiral =
        vary(models::SignPlane{}, default_params<models::SignPlane>(), Vec<double, 2>(0.3, 1), 5);
    CHECK_FALSE(spiral.singular);
    CHECK(spiral.slope.cwiseAbs().maxCoeff() == 0);
}

namespace {

/// A ball that rolls while it bounces, and slower while it rolls on the floor: what happened to it
/// is in its place. x' = v, v' = -g, y' = 1, and friction -mu y' in contact by W = (0, 1 + e, mu').
struct RollingBall {
    static constexpr int dim = 3;
    static constexpr std::array<std::string_view, 2> params{"g", "e"};
    static constexpr std::array kinds{SurfaceKind::jump};
    template <Scalar S> Vec<S, 3> f(const S&, const Vec<S, 3>& x, const Vec<S, 2>& p) const {
        return {x[1], -p[0], S(1)};
    }
    template <Scalar S> S h(const S&, const Vec<S, 3>& x, const Vec<S, 2>&) const { return x[0]; }
    /// Each impact throws it back by a tenth of its normal speed.
    template <Scalar S>
    Vec<S, 3> jump(int, const S&, const Vec<S, 3>& x, const Vec<S, 2>& p) const {
        return {x[0], -p[1] * x[1], x[2] + S(0.1) * x[1]};
    }
};

} // namespace

TEST_CASE("variation: contact goes on as impacts did", "[variation]") {
    // y' = 1 in flight, y+ = y + 0.1 v at impacts; in contact the push (0, 1, -0.1/(1 + e)) holds
    // v, so y' = 1 - 0.1 g/(1 + e): on average the same as while bouncing.
    const double g = 2, e = 0.5;
    const Vec<double, 3> x0(1, 0, 0);
    const auto r = vary(RollingBall{}, {g, e}, x0, 8);
    CHECK(r.mode == 0);
    // exact: impacts of speeds 2 e^k take 0.2 e^k each, 0.4 in all; they end at t1 = 3
    const double t1 = std::sqrt(2 / g), v1 = g * t1, rest = t1 * (1 + 2 * e / (1 - e));
    CHECK(r.x[2] ==
          Approx(rest - 0.1 * v1 / (1 - e) + (8 - rest) * (1 - 0.1 * g / (1 + e))).epsilon(1e-10));
    check_differences(RollingBall{}, {g, e}, x0, 8, 1e-4);
}
