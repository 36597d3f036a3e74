// SPDX-License-Identifier: BSD-3-Clause
// Contours and their corners, against curves in closed form.

#include "catch.hpp"

#include <filippov/basins/corners.hpp>

#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

using namespace filippov;
using Catch::Matchers::ContainsSubstring;

namespace {

/// A labeller from a function of one point.
template <class F> PointLabeller labels_of(F f) {
    return [f](std::span<const PicturePoint> points, std::span<std::int32_t> labels) {
        for (std::size_t k = 0; k < points.size(); ++k)
            labels[k] = f(points[k].x(), points[k].y());
        return true;
    };
}
template <class F> Contours trace(F f, int n, const ContourSettings& settings = {}) {
    return trace_contours(labels_of(f), n, n, settings);
}
/// Contours with what there is of corners.
struct Cornered {
    Contours contours;
    std::vector<ContourCorner> corners;
};
template <class F>
Cornered trace_corners(F f, int n, const ContourSettings& settings = {}, double least = 0.02) {
    Cornered found{trace(f, n, settings), {}};
    found.corners = find_corners(labels_of(f), found.contours, settings, least);
    REQUIRE(found.contours.work.status == Status::ok);
    return found;
}

/// Calls visit(a, b) for the ends of every chord.
template <class Visit> void visit_chords(const Contour& curve, Visit visit) {
    const std::size_t n = curve.points.size();
    for (std::size_t k = 0; k + (curve.closed ? 0 : 1) < n; ++k)
        visit(curve.points[k].middle(), curve.points[(k + 1) % n].middle());
}
double length_of(const Contour& curve) {
    double length = 0;
    visit_chords(curve, [&](const auto& a, const auto& b) { length += (b - a).norm(); });
    return length;
}
/// The largest distance of points along the polyline from a curve that a function is zero on.
template <class F> double largest_off(const Contour& curve, F distance) {
    double most = 0;
    visit_chords(curve, [&](const PicturePoint& a, const PicturePoint& b) {
        for (int j = 0; j < 8; ++j) {
            const PicturePoint at = a + j / 8.0 * (b - a);
            most = std::max(most, std::abs(distance(at.x(), at.y())));
        }
    });
    return most;
}

} // namespace

TEST_CASE("contours: a circle is one closed curve, as near as it says, without corners",
          "[contours]") {
    const auto radius = [](double x, double y) { return std::hypot(x - 0.51, y - 0.47); };
    const auto circle = [&](double x, double y) { return radius(x, y) < 0.35 ? 1 : 2; };
    for (const double distance : {1e-3, 1e-5, 1e-7}) {
        const auto [contours, corners] = trace_corners(circle, 23, {.distance = distance});
        REQUIRE(contours.curves.size() == 1);
        const Contour& c = contours.curves[0];
        CHECK(c.closed);
        CHECK(c.left == 1);
        CHECK(c.right == 2);
        CHECK(c.coarse == 0);
        CHECK(c.distance <= distance);
        CHECK(corners.empty());
        CHECK(largest_off(c, [&](double x, double y) { return radius(x, y) - 0.35; }) <= distance);
        // chords of a circle's arcs, each within `distance` of it
        CHECK(length_of(c) <= 2 * std::numbers::pi * 0.35);
        CHECK(length_of(c) >= 2 * std::numbers::pi * (0.35 - distance));
        double area = 0;
        visit_chords(c, [&](const PicturePoint& a, const PicturePoint& b) {
            area += detail::cross(a, b) / 2;
        });
        CHECK(area > 0); // the inside is on the left
        for (const Bracket& b : c.points) {
            CHECK(b.width() <= 1e-12);
            CHECK(radius(b.left.x(), b.left.y()) < 0.35);
            CHECK(radius(b.right.x(), b.right.y()) >= 0.35);
        }
    }
}

TEST_CASE("contours: three labels make three curves that end within a cell of each other",
          "[contours]") {
    const PicturePoint meet{0.4321, 0.5678};
    const auto sectors = [&](double x, double y) {
        const double angle = std::atan2(y - meet.y(), x - meet.x());
        return angle < -1.9 ? 3 : angle < 0.3 ? 1 : angle < 2.2 ? 2 : 3;
    };
    for (const int n : {10, 13, 24}) {
        CAPTURE(n);
        const Contours b = trace(sectors, n);
        REQUIRE(b.work.status == Status::ok);
        REQUIRE(b.curves.size() == 3);
        for (const Contour& c : b.curves) {
            const auto far = [&](const Bracket& end) { return (end.middle() - meet).norm(); };
            CHECK(std::min(far(c.points.front()), far(c.points.back())) <= 1.5 / n);
            CHECK_FALSE(c.closed);
        }
    }
}

TEST_CASE("contours: quadrants of two labels give curves that do not cross", "[contours]") {
    const auto quadrants = [](double x, double y) { return (x > 0.5003) == (y > 0.4998) ? 1 : 2; };
    const Contours b = trace(quadrants, 16);
    REQUIRE(b.work.status == Status::ok);
    REQUIRE(b.curves.size() == 2);
    double length = 0;
    for (const Contour& c : b.curves) {
        length += length_of(c);
        const auto side = [](const Bracket& p) { // of the diagonal through where they would cross
            return p.middle().x() - 0.5003 > p.middle().y() - 0.4998;
        };
        const auto below = std::count_if(c.points.begin(), c.points.end(), side);
        CHECK((below == 0 || below == std::ptrdiff_t(c.points.size())));
    }
    CHECK(length == Approx(2 * (1 - 1.0 / 16)).margin(2e-3)); // chords of 1e-3 cut both corners
}

TEST_CASE("contours: escaped is a label as others, unresolved is none", "[contours]") {
    const Contours b = trace(
        [](double x, double y) { return x * x + y * y > 0.8  ? -1
                                        : x > 0.6 && y < 0.3 ? 0
                                                             : 1; },
        20);
    REQUIRE(b.work.status == Status::ok);
    CHECK(b.unresolved > 0);
    REQUIRE(b.curves.size() == 1);
    CHECK(b.curves[0].left == -1);
    CHECK(b.curves[0].right == 1);
    const auto off = [](double x, double y) { return std::hypot(x, y) - std::sqrt(0.8); };
    CHECK(largest_off(b.curves[0], off) <= 1e-3);
}

TEST_CASE("contours: a bracket beside what is unresolved stays wide, and is counted",
          "[contours]") {
    const Contours b =
        trace([](double x, double) { return std::abs(x - 0.43) < 1e-3 ? 0
                                            : x < 0.43                ? 1
                                                                      : 2; }, 8);
    REQUIRE(b.work.status == Status::ok);
    CHECK(b.work.stuck >= 7);
    REQUIRE(b.curves.size() == 1);
    for (const Bracket& point : b.curves[0].points) {
        CHECK(point.left.x() < 0.43);
        CHECK(point.right.x() > 0.43);
    }
}

TEST_CASE("contours: labels that are known need not be asked for, and are checked where it counts",
          "[contours]") {
    const auto f = [](double x, double y) { return y > 0.4 + 0.2 * std::sin(5 * x) ? 1 : 2; };
    constexpr int n = 25;
    std::vector<std::int32_t> known;
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) {
            const double x = (i + 0.5) / n, y = (j + 0.5) / n;
            // wrong beside the boundary, as labels of a looser tolerance may be
            known.push_back(std::abs(y - 0.4 - 0.2 * std::sin(5 * x)) < 0.02 ? 1 : f(x, y));
        }
    const Contours all = trace(f, n), few = trace_contours(labels_of(f), n, n, {}, known);
    CHECK(few.work.labels < all.work.labels);
    REQUIRE(few.curves.size() == 1);
    REQUIRE(few.curves[0].points.size() == all.curves[0].points.size());
    for (std::size_t k = 0; k < few.curves[0].points.size(); ++k)
        CHECK(few.curves[0].points[k].middle() == all.curves[0].points[k].middle());
}

TEST_CASE("contours: limits and interruptions are statuses, misuse is refused", "[contours]") {
    const auto half = labels_of([](double x, double) { return x > 0.4 ? 1 : 2; });
    const Contours few = trace_contours(half, 20, 20, {.max_labels = 500});
    CHECK(few.work.status == Status::max_steps);
    CHECK_THAT(few.work.message, ContainsSubstring("max_labels"));
    CHECK(few.work.labels <= 500);
    CHECK(few.curves.size() == 1); // brackets that are wide, but brackets
    int batches = 0;
    const PointLabeller stops = [&](auto points, auto labels) {
        half(points, labels);
        return ++batches < 10;
    };
    const Contours stopped = trace_contours(stops, 20, 20);
    CHECK(stopped.work.status == Status::interrupted);
    CHECK(batches == 10);
    CHECK(stopped.curves.size() == 1);
    const Contours none = trace([](double, double) { return 1; }, 5);
    CHECK(none.work.status == Status::ok);
    CHECK(none.curves.empty());
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const auto refused = [&](const ContourSettings& s, const char* why) {
        CHECK_THROWS_WITH(trace_contours(half, 5, 5, s), ContainsSubstring(why));
    };
    refused({.width = nan}, "width = nan");
    refused({.distance = 1e-13}, "distance = 1e-13");
    refused({.max_labels = 0}, "max_labels = 0");
    CHECK_THROWS_WITH(trace_contours(half, 0, 5), ContainsSubstring("first.n = 0"));
    const std::int32_t one[] = {1};
    CHECK_THROWS_WITH(trace_contours(half, 5, 5, {}, one), ContainsSubstring("known.size() = 1"));
    Contours empty;
    CHECK_THROWS_WITH(find_corners(half, empty, {}, nan), ContainsSubstring("turn = nan"));
}

// --- corners -------------------------------------------------------------------------------------

TEST_CASE("corners: are located to 1e-10, wherever the grid's lines are", "[corners]") {
    // a bump on y = 0.3 + 0.2 x^2: turns by known angles at x = 0.4 and 0.7
    const auto edge = [](double x) {
        const double base = 0.3 + 0.2 * x * x;
        return x < 0.4   ? base
               : x < 0.7 ? base + 0.8 * (x - 0.4)
                         : base + 0.24 + 0.05 * std::sin(x - 0.7);
    };
    const auto bump = [&](double x, double y) { return y > edge(x) ? 1 : 2; };
    const std::array<double, 2> x{0.4, 0.7}, turn{std::atan(0.16 + 0.8) - std::atan(0.16),
                                                  std::atan(0.28 + 0.05) - std::atan(0.28 + 0.8)};
    for (const auto& [n, distance] :
         {std::pair{17, 1e-5}, {20, 1e-5}, {31, 1e-7}, {12, 1e-3}, {26, 1e-3}}) {
        CAPTURE(n, distance);
        const auto [contours, corners] = trace_corners(bump, n, {.distance = distance});
        REQUIRE(contours.curves.size() == 1);
        REQUIRE(corners.size() == 2);
        // label 1, above, is on the left of the curve: it runs to the right
        for (std::size_t k = 0; k < 2; ++k) {
            const ContourCorner& c = corners[k];
            CHECK((c.at - PicturePoint(x[k], edge(x[k]))).norm() <= 1e-10);
            CHECK(c.turn == Approx(turn[k]).margin(1e-6));
            CHECK(c.error < 1e-10);
            // chords beside it were refined
            CHECK((contours.curves[0].points[c.point].middle() - c.at).norm() <= 2e-3);
        }
    }
}

TEST_CASE("corners: less than the least turn is none, more is found", "[corners]") {
    const auto kinked = [](double slope) {
        return [slope](double x, double y) {
            return y > 0.4 + 0.1 * x * x + (x > 0.523 ? slope * (x - 0.523) : 0) ? 1 : 2;
        };
    };
    CHECK(trace_corners(kinked(0.01), 20, {.distance = 1e-5}).corners.empty());
    const auto corners = trace_corners(kinked(0.03), 20, {.distance = 1e-5}).corners;
    REQUIRE(corners.size() == 1);
    CHECK(corners[0].at.x() == Approx(0.523).margin(1e-9));
    CHECK(trace_corners(kinked(0.03), 20, {.distance = 1e-5}, 0.05).corners.empty());
}

TEST_CASE("corners: a rotated rectangle has four of a right angle", "[corners]") {
    const double s = std::sin(0.3), c = std::cos(0.3);
    const auto inside = [&](double x, double y) {
        const double a = c * (x - 0.5) + s * (y - 0.5), b = c * (y - 0.5) - s * (x - 0.5);
        return std::abs(a) < 0.2 && std::abs(b) < 0.25 ? 1 : 2;
    };
    const auto [contours, corners] = trace_corners(inside, 30);
    REQUIRE(contours.curves.size() == 1);
    CHECK(contours.curves[0].closed);
    REQUIRE(corners.size() == 4);
    double shortest = 1;
    for (const ContourCorner& corner : corners) {
        CHECK(corner.turn == Approx(std::numbers::pi / 2).margin(1e-7));
        const PicturePoint v = corner.at - PicturePoint(0.5, 0.5);
        CHECK(std::abs(c * v.x() + s * v.y()) == Approx(0.2).margin(1e-10));
        CHECK(std::abs(c * v.y() - s * v.x()) == Approx(0.25).margin(1e-10));
        for (const ContourCorner& other : corners)
            if (&other != &corner)
                shortest = std::min(shortest, (other.at - corner.at).norm());
    }
    CHECK(shortest == Approx(0.4).margin(1e-9)); // four different ones
    // cut off at corners by less than chords of 1e-5 off
    CHECK(length_of(contours.curves[0]) == Approx(1.8).margin(4e-3));
}

TEST_CASE("corners: brackets that stay wide are not fitted", "[corners]") {
    // beside the corner, on one side, a wedge of nothing known hides where the boundary is
    const auto wedge = [](double x, double y) {
        const double off = y - 0.3 - std::abs(x - 0.47);
        return x > 0.47 && std::abs(off) < 0.02 * (x - 0.47) ? 0 : off > 0 ? 1 : 2;
    };
    const auto [contours, corners] = trace_corners(wedge, 12);
    CHECK(contours.work.stuck > 0);
    for (const ContourCorner& c : corners) // none, or the true one
        CHECK((c.at - PicturePoint(0.47, 0.3)).norm() <= 1e-9);
}

TEST_CASE("corners: are not looked for beyond an interruption", "[corners]") {
    const auto wedge =
        labels_of([](double x, double y) { return y > 0.3 + std::abs(x - 0.47) ? 1 : 2; });
    Contours contours = trace_contours(wedge, 12, 12);
    int batches = 0;
    const PointLabeller stops = [&](auto points, auto labels) {
        wedge(points, labels);
        return ++batches < 5;
    };
    CHECK(find_corners(stops, contours).empty());
    CHECK(contours.work.status == Status::interrupted);
    CHECK(batches == 5);
}
