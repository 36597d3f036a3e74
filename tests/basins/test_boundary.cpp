// SPDX-License-Identifier: BSD-3-Clause
// Boundaries of basins and unstable sets, against closed forms, and on the oscillator against
// labels, images, other grids and the geometry of the belt.

#include "catch.hpp"
#include "systems.hpp"

#include <filippov/basins/unstable_set.hpp>
#include <filippov/models/oscillator.hpp>
#include <filippov/orbits/any_system.hpp>

#include <cmath>
#include <limits>
#include <numbers>

using namespace filippov;
using Catch::Matchers::ContainsSubstring;

namespace {

using Point = std::array<double, 2>;

/// In u and w, u' = a (u - u^3) + r side, w' = -b w + cos t, bent: Y = w + d u^2, X = u + c Y^2.
/// The surface is u = -wall. Far away, with r = 0, there are attractors at u = -1 and 1 and a
/// saddle at u = 0; at 0, with r > 0, it repels on both sides. Either way the basins' boundary is
/// X = c Y^2.
struct Bent {
    static constexpr int dim = 2;
    static constexpr std::array<std::string_view, 4> params{"a", "b", "r", "wall"};
    static constexpr std::array<double, 4> defaults{0.15, 0.2, 0, 50};
    static constexpr double c = 0.5, d = 0.3;

    template <Scalar S> using X = Vec<S, 2>;
    template <Scalar S> using P = Vec<S, 4>;
    template <Scalar S> static S u_of(const X<S>& x) { return x[0] - S(c) * x[1] * x[1]; }
    template <Scalar S> static X<S> bent(const S& t, const X<S>& x, const P<S>& p, const S& side) {
        using elementary::cos;
        const S u = u_of(x), w = x[1] - S(d) * u * u;
        const S du = p[0] * (u - u * u * u) + p[2] * side;
        const S dw = cos(t) - p[1] * w;
        const S dy = dw + S(2 * d) * u * du;
        return {S(du + S(2 * c) * x[1] * dy), dy};
    }
    template <Scalar S> X<S> f1(const S& t, const X<S>& x, const P<S>& p) const {
        return bent(t, x, p, S(-1));
    }
    template <Scalar S> X<S> f2(const S& t, const X<S>& x, const P<S>& p) const {
        return bent(t, x, p, S(1));
    }
    template <Scalar S> S h(const S&, const X<S>& x, const P<S>& p) const { return u_of(x) + p[3]; }
    template <Scalar S> S period(const P<S>&) const {
        return S(6.283185307179586476925286766559005768L);
    }
};

#if defined(__SANITIZE_ADDRESS__)
constexpr bool slow = true; ///< thirty times: closed forms run the same code as the oscillator
#else
constexpr bool slow = false;
#endif

/// A system, its basins, and what they were found with; once for all tests.
struct Scene {
    std::shared_ptr<const AnySystem> system;
    std::shared_ptr<const AnyLanes> lanes;
    Vector p;
    BasinSettings settings{};
    Basins basins;

    Scene(std::shared_ptr<const AnySystem> s, std::shared_ptr<const AnyLanes> l, Vector params,
          const CellGrid& grid)
        : system(std::move(s)), lanes(std::move(l)), p(std::move(params)), settings(quick()),
          basins(BasinFinder(*system, *lanes, grid, p, settings).run()) {}
    static BasinSettings quick() {
        BasinSettings s;
        s.seeds = 32;
        s.newtons = 36;
        s.audit = 0;
        return s;
    }
    BasinLabeller labeller() const {
        return {*system, *lanes, basins.grid, basins.attractors, p, detail::tightened(settings)};
    }
    std::int32_t label(const Point& at) const {
        CellLabel found;
        labeller()(std::span(&at, 1), std::span(&found, 1));
        return found.label;
    }
    BasinBoundary boundary(double distance) const {
        return basin_boundary(*system, *lanes, basins, p, settings,
                              {.contours = {.distance = distance}});
    }
    UnstableSet unstable(const UnstableSettings& how = {}) const {
        return unstable_set(*system, *lanes, basins, basins.saddles.at(0), p, settings, how);
    }
    Vector unit() const {
        const auto width = [&](int k) {
            return basins.grid.axis(k).high - basins.grid.axis(k).low;
        };
        return Vector{{width(0), width(1)}};
    }
    double apart(const Vector& a, const Vector& b) const {
        return (a - b).cwiseQuotient(unit()).norm();
    }
};

const CellGrid bent_grid({0, -1.5, 2, 13}, {1, -1.5, 1.6, 11});
Scene bent_scene(double r, double wall) {
    static const auto system = any_system(Bent{});
    static const auto lanes = any_lanes(Bent{});
    Vector p = system->defaults();
    p[2] = r;
    p[3] = wall;
    return {system, lanes, p, bent_grid};
}
const Scene& smooth_scene() {
    static const Scene scene = bent_scene(0, 50);
    return scene;
}
constexpr double orbit_w = 0.2 / 1.04; // w at t = 0: (b cos t + sin t)/(1 + b^2)

const Scene& block_scene() {
    static const auto system = oscillator_system();
    static const Scene scene(system, any_lanes(models::Oscillator{}),
                             params_at(*system, 3.6, 1.067), {{0, -4, 4, 16}, {1, -3, 4, 16}});
    return scene;
}
constexpr Point block_picture{8, 7};
const BasinBoundary& block_boundary() {
    static const BasinBoundary boundary = block_scene().boundary(1e-3);
    return boundary;
}
const BoundaryCorner* corner_near(const BasinBoundary& b, const Point& at, double within) {
    for (const BoundaryCorner& c : b.corners)
        if (std::hypot(c.at[0] - at[0], c.at[1] - at[1]) <= within)
            return &c;
    return nullptr;
}
/// A point of the bracket's line, so many pictures to the left of the boundary.
Point aside(const BoundaryPoint& point, double by) {
    const auto [width, height] = block_picture;
    const double x = (point.left[0] - point.right[0]) / width,
                 y = (point.left[1] - point.right[1]) / height, r = std::hypot(x, y);
    return {point.at[0] + by * width * x / r, point.at[1] + by * height * y / r};
}
/// From a point to a polyline, in pictures.
double distance_to(const Vector& x, const std::vector<Vector>& line, const Vector& unit) {
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k + 1 < line.size(); ++k) {
        const Vector a = (line[k] - x).cwiseQuotient(unit),
                     chord = (line[k + 1] - line[k]).cwiseQuotient(unit);
        const double s =
            chord.squaredNorm() > 0 ? std::clamp(-a.dot(chord) / chord.squaredNorm(), 0.0, 1.0) : 0;
        least = std::min(least, (a + s * chord).norm());
    }
    return least;
}

/// Where the line v = 1 meets the boundary near y, by runs of the scalar engine alone.
double crossing_on_belt(const Scene& scene, double y) {
    const auto nearer_to_first = [&](double at) {
        const Mapped m = strobe(*scene.system, 0, Eigen::Vector2d(at, 1), scene.p, 60);
        REQUIRE(m.ok());
        const auto& attractors = scene.basins.attractors;
        return scene.apart(m.x, attractors[0].cycle.points[0]) <
               scene.apart(m.x, attractors[1].cycle.points[0]);
    };
    double low = y - 1e-3, high = y + 1e-3;
    const bool first = nearer_to_first(low);
    REQUIRE(nearer_to_first(high) != first);
    while (high - low > 1e-10) {
        const double middle = (low + high) / 2;
        (nearer_to_first(middle) == first ? low : high) = middle;
    }
    return low;
}
/// The direction across the stable set, in pictures: the gradient of where the map comes to, along
/// the saddle's unstable direction.
PicturePoint across(const Scene& scene, const Point& at) {
    const StrobeCycle& saddle = scene.basins.saddles[0];
    const Eigen::EigenSolver<Matrix> left(saddle.slopes[0].transpose());
    Eigen::Index largest = 0;
    left.eigenvalues().cwiseAbs().maxCoeff(&largest);
    const Mapped m = strobe(*scene.system, 0, Eigen::Vector2d(at[0], at[1]), scene.p, 6);
    REQUIRE(m.ok());
    REQUIRE_FALSE(m.singular);
    REQUIRE(scene.apart(m.x, saddle.points[0]) < 1e-3);
    const Vector gradient =
        m.slope.topLeftCorner(2, 2).transpose() * left.eigenvectors().col(largest).real();
    return PicturePoint(gradient.cwiseProduct(scene.unit())).normalized();
}

} // namespace

TEST_CASE("boundary: the stable set of a saddle in closed form", "[boundary]") {
    const Scene& scene = smooth_scene();
    REQUIRE(scene.basins.attractors.size() == 2);
    REQUIRE(scene.basins.saddles.size() == 1);
    constexpr double distance = slow ? 1e-3 : 1e-4;
    const BasinBoundary b = scene.boundary(distance);
    REQUIRE(b.work.status == Status::ok);
    REQUIRE(b.curves.size() == 1);
    CHECK(b.corners.empty());
    CHECK(b.curves[0].coarse == 0);
    CHECK(b.curves[0].distance <= distance);
    const double T = 2 * std::numbers::pi, up = std::exp(0.15 * T), down = std::exp(-0.2 * T);
    // Nearest where what is left across the saddle, |w - w0| down^n, is what is right along it,
    // 1e-12 up^n: at 1e-12^theta.
    const double theta = std::log(down) / std::log(down / up);
    double off = 0, between = 0;
    const auto from_parabola = [](double x, double y) { return std::abs(x - Bent::c * y * y); };
    for (std::size_t k = 0; k < b.curves[0].points.size(); ++k) {
        const BoundaryPoint& point = b.curves[0].points[k];
        off = std::max(off, from_parabola(point.at[0], point.at[1]));
        CHECK(point.kind == BoundaryKind::stable_set);
        CHECK(point.saddle == 0);
        CHECK(point.approach <= 4 * std::pow(1e-12, theta));
        CHECK(point.apart < 1e-3);
        if (k == 0)
            continue;
        const Point& before = b.curves[0].points[k - 1].at;
        between = std::max(
            between, from_parabola((point.at[0] + before[0]) / 2, (point.at[1] + before[1]) / 2));
    }
    // a bracket of 1e-12 of 3.5, and runs of 1e-12, whose errors grow with e^(a t) at most as the
    // distance does
    CHECK(off <= 4e-11);
    CHECK(between <= 3.5 * distance * std::hypot(1, 1.5));
}

TEST_CASE("unstable_set: that of a saddle in closed form", "[unstable_set]") {
    const Scene& scene = smooth_scene();
    const UnstableSet set = scene.unstable();
    REQUIRE(set.status == Status::ok);
    CHECK(set.turn == 1);
    CHECK(set.multiplier == Approx(std::exp(0.3 * std::numbers::pi)).epsilon(1e-10));
    std::array<int, 2> ends{};
    for (std::size_t k = 0; k < 2; ++k) {
        const UnstableBranch& branch = set.branches[k];
        CHECK(branch.breaks.empty());
        double off = 0, between = 0, last = 0;
        bool ordered = true;
        const auto from_curve = [](const Vector& x) {
            const double u = Bent::u_of<double>(x);
            return std::abs(x[1] - (orbit_w + Bent::d * u * u));
        };
        for (std::size_t j = 0; j < branch.points.size(); ++j) {
            const Vector& x = branch.points[j];
            const double u = Bent::u_of<double>(x);
            off = std::max(off, from_curve(x));
            if (j > 0)
                between = std::max(between, from_curve((x + branch.points[j - 1]) / 2));
            ordered = ordered && std::abs(u) >= std::abs(last);
            last = u;
        }
        // The first segment is a straight line: off by half its curvature, 2 d, times its length
        // squared (3.5e-6 of u, grown by 2.6), times down, as its first image is taken. Runs of
        // 1e-12 after that.
        CHECK(off <= 5e-11);
        CHECK(between <= 3.5 * 1e-6); // `distance`, in a picture of 3.5 by 3.1
        CHECK(ordered);
        CHECK(std::abs(std::abs(last) - 1) <= 3.5 * 1e-4);
        ends[k] = branch.attractor;
        const Vector& end =
            scene.basins.attractors.at(std::size_t(branch.attractor)).cycle.points[0];
        CHECK((end - branch.points.back()).norm() <= 3.5 * 1.5e-4);
    }
    CHECK(ends[0] != ends[1]);
}

TEST_CASE("unstable_set: a cycle gone round twice has the same set", "[unstable_set]") {
    const Scene& scene = smooth_scene();
    StrobeCycle twice = scene.basins.saddles.at(0);
    twice.points.push_back(twice.points[0]);
    twice.slopes.push_back(twice.slopes[0]);
    const UnstableSet once = scene.unstable(),
                      both = unstable_set(*scene.system, *scene.lanes, scene.basins, twice, scene.p,
                                          scene.settings, {}, 1);
    REQUIRE(both.status == Status::ok);
    CHECK(both.turn == 2);
    CHECK(both.multiplier == Approx(once.multiplier * once.multiplier).epsilon(1e-12));
    for (std::size_t k = 0; k < 2; ++k) {
        CHECK(both.branches[k].attractor == once.branches[k].attractor);
        const auto& points = both.branches[k].points;
        const auto a = std::size_t(both.branches[k].attractor);
        for (std::size_t j = 0; j < points.size(); j += 7)
            if (scene.apart(points[j], scene.basins.attractors[a].cycle.points[0]) > 1e-4) // `near`
                CHECK(distance_to(points[j], once.branches[k].points, scene.unit()) <=
                      1e-6); // `distance`
    }
}

TEST_CASE("boundary: where a surface repels the same curve is a jump", "[boundary]") {
    const Scene scene = bent_scene(0.5, 0);
    REQUIRE(scene.basins.attractors.size() == 2);
    const BasinBoundary b = scene.boundary(1e-4);
    REQUIRE(b.work.status == Status::ok);
    REQUIRE(b.curves.size() == 1);
    double off = 0;
    for (const BoundaryPoint& point : b.curves[0].points) {
        CHECK(point.kind == BoundaryKind::jump);
        CHECK(point.periods == 1);
        CHECK(point.apart > 0.1);
        off = std::max(off, std::abs(point.at[0] - Bent::c * point.at[1] * point.at[1]));
    }
    CHECK(off <= 4e-12); // the first sign of h decides
}

// --- the oscillator ------------------------------------------------------------------------------

TEST_CASE("boundary: the oscillator's basins are bounded by the stable set of the saddle",
          "[boundary]") {
    if (slow)
        return;
    const Scene& scene = block_scene();
    const BasinBoundary& b = block_boundary();
    REQUIRE(b.work.status == Status::ok);
    REQUIRE(scene.basins.saddles.size() == 1);
    CHECK(b.unresolved == 0);
    CHECK(b.work.stuck == 0);
    REQUIRE(b.curves.size() == 2);
    const double mu = scene.basins.saddles[0].multipliers[0].real();
    CHECK(mu == Approx(2.126).margin(5e-4));
    for (const BoundaryCurve& c : b.curves) {
        CHECK(c.coarse == 0);
        CHECK(c.distance <= 1e-3);
        CHECK(c.left == 1);
        CHECK(c.right == 2);
        for (const BoundaryPoint& point : c.points) {
            REQUIRE(point.kind == BoundaryKind::stable_set);
            CHECK(point.saddle == 0);
            // The other multiplier is 0: after the slides of a few periods a bracket of width w is
            // as near as w mu^n. Lines of the map stretch it by less than 10 beside that.
            CHECK(point.periods <= 8);
            CHECK(point.approach <= 10e-12 * std::pow(mu, point.periods));
        }
    }
}

TEST_CASE("boundary: beside the oscillator's labels differ, and starts ten times nearer to it come "
          "ten times nearer to the saddle",
          "[boundary]") {
    if (slow)
        return;
    const Scene& scene = block_scene();
    const Vector saddle = scene.basins.saddles[0].points[0];
    int tried = 0;
    for (const BoundaryCurve& c : block_boundary().curves)
        for (std::size_t k = 3; k < c.points.size(); k += 11) {
            const BoundaryPoint& point = c.points[k];
            ++tried;
            CAPTURE(point.at[0], point.at[1]);
            CHECK(scene.label(aside(point, 1e-6)) == c.left);
            CHECK(scene.label(aside(point, -1e-6)) == c.right);
            // offsets of 1e-6 and 1e-7, after the periods that lead to the saddle
            std::array<double, 2> apart{};
            for (const std::size_t i : {0u, 1u}) {
                const Vector x = scene.labeller().state(aside(point, i == 0 ? 1e-6 : 1e-7));
                const Mapped m = strobe(*scene.system, 0, x, scene.p, std::max(point.periods, 4));
                REQUIRE(m.ok());
                apart[i] = scene.apart(m.x, saddle);
            }
            CHECK(apart[0] / apart[1] == Approx(10).epsilon(0.01));
        }
    CHECK(tried >= 5);
}

TEST_CASE("boundary: the oscillator's corners are on the belt", "[boundary]") {
    if (slow)
        return;
    const BasinBoundary& b = block_boundary();
    REQUIRE(b.corners.size() == 3);
    for (const BoundaryCorner& c : b.corners) {
        CAPTURE(c.at[0], c.at[1], c.turn);
        CHECK(c.at[1] == Approx(1).margin(1e-9)); // v = 1: the field changes there, at a crossing
        CHECK(c.error < 1e-10);
    }
}

TEST_CASE("boundary: a grid of another part of the picture has the same corners",
          "[.long][boundary]") {
    const Scene& scene = block_scene();
    const BasinLabeller labeller = scene.labeller();
    const auto in_part = [](const PicturePoint& u) {
        return Point{-1.35 + 0.8 * u.x(), 0.85 + 0.4 * u.y()};
    };
    const PointLabeller labels_of = [&](auto points, auto labels) {
        for (std::size_t k = 0; k < points.size(); ++k) {
            const Point at = in_part(points[k]);
            CellLabel found;
            labeller(std::span(&at, 1), std::span(&found, 1));
            labels[k] = found.label;
        }
        return true;
    };
    Contours contours = trace_contours(labels_of, 9, 10);
    const auto corners = find_corners(labels_of, contours);
    REQUIRE(contours.work.status == Status::ok);
    REQUIRE(corners.size() == 2);
    for (const ContourCorner& c : corners)
        CHECK(corner_near(block_boundary(), in_part(c.at), 1e-9) != nullptr);
}

TEST_CASE("boundary: its corners by bisection along the belt, their turns by derivatives",
          "[boundary]") {
    if (slow)
        return;
    const Scene& scene = block_scene();
    for (const BoundaryCorner& c : block_boundary().corners) {
        CAPTURE(c.at[0], c.turn);
        CHECK(crossing_on_belt(scene, c.at[0]) == Approx(c.at[0]).margin(1e-8));
        // 1e-6 above and below: the tangents turn by about as much on the way there
        const double turn = detail::turn_between(across(scene, {c.at[0], 1 - 1e-6}),
                                                 across(scene, {c.at[0], 1 + 1e-6}));
        CHECK(std::abs(turn) == Approx(std::abs(c.turn)).margin(1e-4));
    }
}
TEST_CASE("unstable_set: the oscillator's unstable set is invariant and ends at both attractors",
          "[unstable_set]") {
    const Scene& scene = block_scene();
    const Vector unit = scene.unit();
    const UnstableSet set = scene.unstable();
    REQUIRE(set.status == Status::ok);
    CHECK(set.branches[0].attractor + set.branches[1].attractor == 1);
    for (const UnstableBranch& branch : set.branches) {
        CHECK(branch.breaks.empty());
        CHECK(branch.attractor >= 0);
        for (std::size_t k = 1; k < branch.points.size(); k += 37) {
            const Mapped m = strobe(*scene.system, 0, branch.points[k], scene.p);
            REQUIRE(m.ok());
            // as near as the polyline is to the curve; what is beyond its end is near the attractor
            const Vector end =
                scene.basins.attractors[std::size_t(branch.attractor)].cycle.points[0];
            const double beyond = scene.apart(m.x, end);
            CHECK((distance_to(m.x, branch.points, unit) <= 1e-6 || beyond <= 1e-4));
        }
    }
}

TEST_CASE("boundary: work on basins is interrupted, limited and refused", "[boundary]") {
    const Scene& scene = slow ? smooth_scene() : block_scene();
    const StrobeCycle& saddle = scene.basins.saddles[0];
    BasinSettings settings = scene.settings;
    settings.parallel.cancelled = [] { return true; };
    const auto boundary = [&](const BasinSettings& s, const BoundarySettings& how) {
        return basin_boundary(*scene.system, *scene.lanes, scene.basins, scene.p, s, how);
    };
    CHECK(boundary(settings, {}).work.status == Status::interrupted);
    CHECK(
        unstable_set(*scene.system, *scene.lanes, scene.basins, saddle, scene.p, settings).status ==
        Status::interrupted);
    std::size_t last = 0;
    settings = scene.settings;
    settings.parallel.progress = [&](std::size_t done, std::size_t) { last = done; };
    const BasinBoundary few = boundary(settings, {.contours = {.max_labels = 300}});
    CHECK(few.work.status == Status::max_steps);
    CHECK(few.work.labels <= 300);
    CHECK(std::size_t(few.work.labels) == last);
    for (const BoundaryCurve& c : few.curves)
        for (const BoundaryPoint& point : c.points)
            CHECK(point.kind == BoundaryKind::unknown);
    for (const UnstableSettings& how :
         {UnstableSettings{.length = 0.01}, UnstableSettings{.generations = 3},
          UnstableSettings{.max_points = 50}}) {
        const UnstableSet set = scene.unstable(how);
        CHECK(set.status == Status::max_steps);
        CHECK(set.branches[0].status == Status::max_steps);
        CHECK(set.branches[0].attractor == -1);
    }
    const double nan = std::numeric_limits<double>::quiet_NaN();
    CHECK_THROWS_WITH(boundary(scene.settings, {.near = nan}), ContainsSubstring("near = nan"));
    CHECK_THROWS_WITH(boundary(scene.settings, {.turn = 0}), ContainsSubstring("turn = 0"));
    CHECK_THROWS_WITH(scene.unstable({.gap = 0}), ContainsSubstring("gap = 0"));
    CHECK_THROWS_WITH(unstable_set(*scene.system, *scene.lanes, scene.basins, saddle, scene.p,
                                   scene.settings, {}, 1),
                      ContainsSubstring("point = 1"));
    CHECK_THROWS_WITH(unstable_set(*scene.system, *scene.lanes, scene.basins,
                                   scene.basins.attractors[0].cycle, scene.p, scene.settings),
                      ContainsSubstring("saddle.multipliers = 0"));
}
