// SPDX-License-Identifier: BSD-3-Clause
#include "catch.hpp"

#include <filippov/events/roots.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>

using namespace filippov;

namespace {

struct Result {
    Contact contact;
    double theta;
    int evaluations;
};

/// `first_contact` of g, with its evaluations counted.
template <class G> Result contact(G g, double band = 0) {
    Result r{Contact::none, -1, 0};
    const auto counted = [&](double theta) {
        ++r.evaluations;
        return g(theta);
    };
    r.contact = first_contact(counted, g(0.0), band, r.theta);
    return r;
}

constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

// `bracketed_root` promises six digits.
constexpr double six_digits = 1e-6;

// Worst case: 2047 pieces of five evaluations, and in each of the 1024 smallest a minimum of 43;
// then one bracket of 100.
constexpr int bound = 2047 * 5 + 1024 * 43 + 100;

template <class G> void check_root(G g, double expected, double margin = six_digits) {
    const Result r = contact(g);
    CAPTURE(expected, r.evaluations);
    CHECK(r.contact == Contact::root);
    CHECK(std::abs(r.theta - expected) <= margin);
    CHECK(r.evaluations <= bound);
}

} // namespace

TEST_CASE(
    "bracketed_root: finds the change of sign to six digits in a bounded number of evaluations",
    "[roots]") {
    const auto find = [](auto g, double positive, double negative) {
        int n = 0;
        const auto counted = [&](double x) {
            ++n;
            return g(x);
        };
        const double root = bracketed_root(counted, positive, g(positive), negative, g(negative));
        CHECK(n <= 100);
        return root;
    };
    CHECK(std::abs(find([](double x) { return 0.3 - x; }, 0, 1) - 0.3) <= six_digits);
    CHECK(std::abs(find([](double x) { return x - 0.3; }, 1, 0) - 0.3) <=
          six_digits); // bracket the other way round
    CHECK(std::abs(find([](double x) { return std::cos(x); }, 0, 3) - std::acos(0.0)) <=
          2 * six_digits);
    CHECK(std::abs(find([](double x) { return std::pow(0.7 - x, 3); }, 0, 1) - 0.7) <= six_digits);
    CHECK(std::abs(find([](double x) { return std::pow(0.7 - x, 9); }, 0, 1) - 0.7) <= six_digits);
    CHECK(std::abs(find([](double x) { return std::cbrt(0.7 - x); }, 0, 1) - 0.7) <= six_digits);
    CHECK(std::abs(find([](double x) { return 1e-300 * (0.3 - x); }, 0, 1) - 0.3) <= six_digits);
    CHECK(std::abs(find([](double x) { return std::exp(-40 * x) - 1e-12; }, 0, 1) -
                   std::log(1e12) / 40) <= six_digits);
    CHECK(std::abs(find([](double x) { return x < 0.618 ? 1.0 : -1.0; }, 0, 1) - 0.618) <=
          six_digits);
    CHECK(std::abs(find([](double x) { return x < 0.618 ? 1.0 : not_a_number; }, 0, 1) - 0.618) <=
          six_digits);
    // relative digits: a root near the start of a step
    CHECK(std::abs(find([](double x) { return 1e-7 - x; }, 0, 1) / 1e-7 - 1) <= six_digits);
}

TEST_CASE("minimum: finds a minimum well enough to start Newton's iteration", "[roots]") {
    // 24 golden sections shrink the interval to 1e-5
    CHECK(std::abs(minimum([](double x) { return (x - 0.37) * (x - 0.37); }, 0.0, 1.0) - 0.37) <
          1e-5);
    CHECK(std::abs(minimum([](double x) { return std::abs(x - 0.37); }, 0.0, 1.0) - 0.37) < 1e-5);
    CHECK(minimum([](double x) { return x; }, 0.0, 1.0) < 1e-5);
    CHECK(minimum([](double x) { return -x; }, 0.0, 1.0) > 1 - 1e-5);
}

TEST_CASE("first_contact: finds simple roots", "[roots]") {
    for (const double root : {1e-6, 0.01, 0.3, 0.5, 1.0 / 3, 0.999999}) {
        check_root([&](double x) { return root - x; }, root);
        check_root([&](double x) { return (root - x) * (2 + std::sin(5 * x)); }, root);
        check_root([&](double x) { return 1e-200 * (root - x); }, root);
    }
    check_root([](double x) { return std::cos(3 * x); }, std::acos(0.0) / 3);
    check_root([](double x) { return 1 - x; }, 1); // at the very end
}

TEST_CASE("first_contact: reports nothing where there is nothing, and cheaply", "[roots]") {
    const auto check = [](auto g, int evaluations) {
        const Result r = contact(g);
        CHECK(r.contact == Contact::none);
        CHECK(r.evaluations <= evaluations);
    };
    check([](double) { return 1.0; }, 5);
    check([](double x) { return 0.01 + x; }, 5);
    check([](double x) { return 0.1 + (x - 0.5) * (x - 0.5); },
          5); // a cubic is seen through at once
    check([](double x) { return 1.1 + std::cos(3 * x); }, 25);
    check([](double x) { return 0.001 + (x - 0.5) * (x - 0.5); }, 35);
    check([](double x) { return 1.001 - x; }, 35);
}

TEST_CASE("first_contact: finds the first of a close pair", "[roots]") {
    for (const double gap : {1e-1, 1e-2, 1e-3, 1e-4, 1e-5}) {
        CAPTURE(gap);
        for (const double at : {0.05, 0.21, 0.5, 0.777, 0.95}) {
            check_root([&](double x) { return (x - at) * (x - at - gap); }, at,
                       1e-6 * at + 1e-4 * gap);
            // on a function that is no cubic
            check_root(
                [&](double x) {
                    return (x - at) * (x - at - gap) * std::exp(2 * x) * (1.5 + std::sin(4 * x));
                },
                at, 1e-6 * at + 1e-4 * gap);
        }
    }
}

TEST_CASE("first_contact: finds triple roots", "[roots]") {
    for (const double at : {0.05, 0.21, 0.5, 0.777}) {
        check_root([&](double x) { return std::pow(at - x, 3); }, at);
        check_root([&](double x) { return std::pow(at - x, 3) * std::exp(x); }, at);
        check_root([&](double x) { return (at - x) * (at + 0.02 - x) * (at + 0.04 - x); }, at);
    }
}

TEST_CASE("first_contact: a minimum within the band is a touch, one above it is nothing, one below "
          "zero a root",
          "[roots]") {
    const double band = 1e-8;
    for (const double at : {0.08, 0.37, 0.5, 0.9}) {
        CAPTURE(at);
        const auto bowl = [&](double depth) {
            return [=](double x) { return (x - at) * (x - at) * (1 + 0.3 * x) + depth; };
        };
        Result r = contact(bowl(0.5e-8), band);
        CHECK(r.contact == Contact::touch);
        CHECK(std::abs(r.theta - at) <
              1e-4); // the minimum of a bowl is flat: a value to 1e-8 is a place to 1e-4
        r = contact(bowl(-0.5e-8), band);
        CHECK(r.contact == Contact::touch);
        r = contact(bowl(4e-8), band);
        CHECK(r.contact == Contact::none);
        CHECK(r.evaluations < 400);
        r = contact(bowl(-4e-8), band);
        CHECK(r.contact == Contact::root);
        CHECK(std::abs(r.theta - (at - 2e-4 / std::sqrt(1 + 0.3 * at))) < 1e-6);
        r = contact(bowl(0.5e-8), 0.0);
        CHECK(r.contact == Contact::none);
    }
}

TEST_CASE("first_contact: a touch does not hide a root before it, nor a root a touch", "[roots]") {
    const auto root_then_touch = [](double x) {
        return (0.2 - x) * ((x - 0.6) * (x - 0.6) + 1e-10);
    };
    Result r = contact(root_then_touch, 1e-8);
    CHECK(r.contact == Contact::root);
    CHECK(std::abs(r.theta - 0.2) <= six_digits);
    const auto touch_then_root = [](double x) {
        return (0.8 - x) * ((x - 0.4) * (x - 0.4) + 1e-10);
    };
    r = contact(touch_then_root, 1e-8);
    CHECK(r.contact == Contact::touch);
    CHECK(std::abs(r.theta - 0.4) < 1e-4);
    r = contact(touch_then_root, 0.0);
    CHECK(r.contact == Contact::root);
    CHECK(std::abs(r.theta - 0.8) <= six_digits);
}

TEST_CASE("first_contact: finds the first of several oscillations", "[roots]") {
    // Six samples of the whole step cannot see more than three swings; a step of a few digits has
    // less than one.
    for (const double frequency : {6.0, 9.0, 12.0, 15.0, 18.0}) {
        CAPTURE(frequency);
        check_root([&](double x) { return std::cos(frequency * x); }, std::acos(0.0) / frequency);
        check_root([&](double x) { return 0.5 + std::cos(frequency * x); },
                   std::acos(-0.5) / frequency);
        // swings that grow, the first one too small to reach zero
        const auto g = [&](double x) { return 1.2 - std::exp(x) * std::cos(frequency * x + 2); };
        double first = 0;
        while (g(first) > 0)
            first += 1e-6;
        check_root(g, first, 2e-6);
    }
}

TEST_CASE("first_contact: kinks and jumps end in bisection", "[roots]") {
    check_root([](double x) { return std::abs(x - 0.6) - 0.1; }, 0.5);
    check_root([](double x) { return std::abs(x - 0.6123) - 1e-3; }, 0.6113);
    check_root([](double x) { return std::max(0.1, 0.7 - x) - std::max(0.0, x - 0.8) * 2; }, 0.85);
    check_root([](double x) { return x < 0.6180339 ? 1.0 : -1.0; }, 0.6180339);
    check_root([](double x) { return x < 0.6180339 ? 1.0 + x : -1e-9; }, 0.6180339);
    check_root([](double x) { return x < 0.25   ? 1.0
                                     : x < 0.75 ? -1.0
                                                : 1.0; },
               0.25); // there and back
}

TEST_CASE("first_contact: a function that is not finite beyond a point ends there", "[roots]") {
    check_root([](double x) { return x < 0.7 ? 1 - x : not_a_number; }, 0.7);
    check_root([](double x) { return std::sqrt(0.25 - x); }, 0.25); // positive, then NaN
    const Result before = contact([](double x) { return x < 0.7 ? 0.3 - x : not_a_number; });
    CHECK(before.contact == Contact::root);
    CHECK(std::abs(before.theta - 0.3) <= six_digits);
}

TEST_CASE("first_contact: work is bounded whatever the function", "[roots]") {
    std::mt19937 random(3);
    const auto noise = [&](double) {
        return 1e-9 + static_cast<double>(random()) / 4294967296.0;
    }; // never a root
    const Result r = contact(noise, 1e-12);
    CHECK(r.contact == Contact::none);
    CHECK(r.evaluations <= bound);
    const Result q = contact([](double x) { return 1 + 0.999 * std::sin(1e5 * x); });
    CHECK(q.contact == Contact::none);
    CHECK(q.evaluations <= bound);
    CHECK(contact([](double x) { return x == 0 ? 1.0 : not_a_number; }).evaluations <= bound);
    CHECK(contact([](double x) { return x == 0 ? 1.0 : 1 / x; }).evaluations <= bound);
    CHECK(contact([](double) { return std::numeric_limits<double>::infinity(); }).evaluations <=
          bound);
}

namespace {

/// Polynomials of degree seven, as an interpolant of the 8th-order pair is one, with seven real
/// roots around (0, 1): how many have one there, and how often another one or none was found first.
struct Sample {
    int total = 0, wrong = 0;
};
Sample random_polynomials(int n, double least_gap, bool pairs) {
    std::mt19937 random(4);
    const auto uniform = [&](double a, double b) {
        return a + (b - a) * (static_cast<double>(random()) / 4294967296.0);
    };
    Sample sample;
    for (int k = 0; k < n; ++k) {
        std::array<double, 7> roots;
        for (double& root : roots)
            root = uniform(-0.5, 1.5);
        if (pairs)
            roots[1] = roots[0] + std::pow(10.0, uniform(-4, -1));
        double first = 2, gap = 1;
        for (std::size_t i = 0; i < roots.size(); ++i) {
            if (roots[i] > 0)
                first = std::min(first, roots[i]);
            for (std::size_t j = 0; j < i; ++j)
                gap = std::min(gap, std::abs(roots[i] - roots[j]));
            gap = std::min({gap, std::abs(roots[i]), std::abs(roots[i] - 1)});
        }
        if (first > 1 || gap < least_gap)
            continue;
        const auto product = [&](double x) {
            double v = 1;
            for (const double root : roots)
                v *= x - root;
            return v;
        };
        const double orientation = product(0) > 0 ? 1 : -1;
        const Result r = contact([&](double x) { return orientation * product(x); });
        ++sample.total;
        sample.wrong += r.contact != Contact::root || std::abs(r.theta - first) > six_digits;
    }
    return sample;
}

} // namespace

TEST_CASE("first_contact: finds the first root of random polynomials whose roots are 0.02 apart",
          "[roots]") {
    const Sample s = random_polynomials(40'000, 0.02, false);
    CAPTURE(s.total);
    CHECK(s.total > 5000);
    CHECK(s.wrong == 0);
}

TEST_CASE("first_contact: misses a close pair in fewer than one of a thousand random polynomials "
          "that have one",
          "[roots]") {
    // Pairs 1e-4 to 1e-1 apart: the dip between them can be smaller than what the prediction of a
    // piece is off.
    const Sample s = random_polynomials(20'000, 1e-4, true);
    CAPTURE(s.total);
    CHECK(s.total > 10'000);
    CHECK(s.wrong * 1000 < s.total);
}

TEMPLATE_TEST_CASE("first_contact: works in every scalar", "[roots]", float, long double) {
    using S = TestType;
    S theta(-1);
    CHECK(first_contact([](S x) { return S(0.3) - x; }, S(0.3), S(0), theta) == Contact::root);
    CHECK(std::abs(theta - S(0.3)) <= S(six_digits));
    CHECK(first_contact([](S x) { return S(1) + x; }, S(1), S(0), theta) == Contact::none);
    CHECK(first_contact([](S x) { return (x - S(0.4)) * (x - S(0.4)); }, S(0.16), S(1e-5), theta) ==
          Contact::touch);
}

TEST_CASE("falls_smoothly: a cubic that falls once does, up to the first value that is no number",
          "[roots]") {
    const auto fall = [](double x) { return 0.5 - x; };
    CHECK(falls_smoothly(0.5, fall));
    CHECK_FALSE(falls_smoothly(0.5, [](double x) { return x - 0.5; }));
    CHECK_FALSE(falls_smoothly(0.5, [](double x) { return 0.5 - x + 0.01 * std::sin(500 * x); }));
    for (int bad = 1; bad <= 10; ++bad) { // each of the places where it looks
        CAPTURE(bad);
        int asked = 0;
        const auto broken = [&](double x) { return ++asked == bad ? std::nan("") : 0.5 - x; };
        CHECK_FALSE(falls_smoothly(0.5, broken));
        CHECK(asked == (bad <= 5 ? 5 : 10));
    }
}
