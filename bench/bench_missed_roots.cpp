// SPDX-License-Identifier: BSD-3-Clause
// How often does a step over a surface that is met many times miss a crossing?
//
// A point goes round the unit circle; h is a trigonometric polynomial of up to eight random
// harmonics, up to sixteen roots a turn, many of them close pairs: an even number within one step,
// or nearly a touch. They are found on a fine grid of the exact solution. At loose tolerances a
// pair between which |h| stays within the error of the solution is no error; it counts as missed
// here all the same.

#include "measure.hpp"

#include <filippov/engine/flow.hpp>
#include <filippov/methods/rodas5p.hpp>

#include <cmath>
#include <cstdio>
#include <random>
#include <string>
#include <vector>

namespace {

using namespace filippov;

/// x = (sin t, cos t) on both sides of h = c + sum_k Re((a_k + i b_k) e^(ikt)).
struct RandomSurface {
    static constexpr int dim = 2;
    std::array<double, 8> a{}, b{};
    double c = 0;

    template <Scalar S> Vec<S, 2> f1(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return {x[1], -x[0]};
    }
    template <Scalar S> Vec<S, 2> f2(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return {x[1], -x[0]};
    }
    template <Scalar S> S h(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        S re(1), im(0), sum(c);
        for (std::size_t k = 0; k < a.size(); ++k) {
            const S next = re * x[1] - im * x[0];
            im = re * x[0] + im * x[1];
            re = next;
            sum += S(a[k]) * re - S(b[k]) * im;
        }
        return sum;
    }
};

constexpr double turn = 6.28;

RandomSurface random_surface(std::mt19937_64& random) {
    std::normal_distribution<> normal;
    RandomSurface sys;
    const std::size_t n = 1 + random() % 8;
    for (std::size_t k = 0; k < n; ++k) {
        sys.a[k] = normal(random);
        sys.b[k] = normal(random);
    }
    sys.c = 2 * normal(random);
    return sys;
}

struct Root {
    double t;
    bool up;
    bool close = false; ///< it has a neighbour nearer than a hundredth of the turn
};

std::vector<Root> roots_on_grid(const RandomSurface& sys) {
    const int n = 20'000;
    std::vector<Root> roots;
    bool above = false;
    for (int k = 0; k <= n; ++k) {
        const double t = turn * k / n;
        const bool now = sys.h(t, Vec<double, 2>(std::sin(t), std::cos(t)), Vec<double, 0>()) > 0;
        if (k > 0 && now != above)
            roots.push_back({t, now});
        above = now;
    }
    for (std::size_t k = 1; k < roots.size(); ++k)
        if (roots[k].t - roots[k - 1].t < turn / 100)
            roots[k].close = roots[k - 1].close = true;
    return roots;
}

struct Row {
    std::string method;
    double tolerance;
    long long roots = 0, missed = 0, close = 0, missed_close = 0, invented = 0, failed = 0;
};

/// Counts both lists off against each other: roots of one direction and nearly one time are one.
void compare(const std::vector<Root>& exact, const std::vector<Root>& found, Row& row) {
    // near a touch a root moves like the square root of the error
    const double same = 4 * std::sqrt(row.tolerance) + 1e-3;
    std::size_t k = 0;
    for (const Root& root : exact) {
        while (k < found.size() && found[k].t < root.t - same) {
            ++row.invented;
            ++k;
        }
        ++row.roots;
        row.close += root.close;
        if (k < found.size() && found[k].t <= root.t + same && found[k].up == root.up) {
            ++k;
        } else {
            ++row.missed;
            row.missed_close += root.close;
        }
    }
    row.invented += static_cast<long long>(found.size() - k);
}

template <class Tableau> Row count(const char* method, double tolerance, int runs) {
    std::mt19937_64 random(7);
    Row row{method, tolerance};
    const Settings<double, 2> settings{.rtol = tolerance, .atol = tolerance};
    for (int i = 0; i < runs; ++i) {
        const RandomSurface sys = random_surface(random);
        EventLog<double, 2, 1> log;
        const auto run =
            flow<Tableau>(sys, Vec<double, 0>(), Vec<double, 2>(0, 1), 0.0, turn, settings, log);
        row.failed += run.status != Status::ok;
        std::vector<Root> found;
        for (const auto& e : log.events)
            if (e.kind == EventKind::cross)
                found.push_back({e.t, e.mode_after[0] > 0});
        compare(roots_on_grid(sys), found, row);
    }
    return row;
}

} // namespace

int main(int argc, char** argv) {
    const auto options = bench::parse(argc, argv, "How many crossings a run misses");
    const int runs = options.quick ? 500 : 20'000;
    std::vector<Row> rows;
    for (const double tolerance : {1e-3, 1e-6, 1e-9}) {
        rows.push_back(count<DormandPrince5>("dopri5", tolerance, runs));
        rows.push_back(count<DormandPrince8>("dop853", tolerance, runs));
        rows.push_back(count<Rodas5P>("rodas5p", tolerance, runs));
    }
    nlohmann::json results = nlohmann::json::array();
    bool right = true;
    std::printf("%-7s %8s %8s %7s %8s %7s %9s %9s\n", "method", "tol", "roots", "missed", "close",
                "missed", "invented", "missed");
    for (const Row& r : rows) {
        const double rate = double(r.missed) / double(r.roots);
        right =
            right && r.failed == 0 && (r.tolerance > 1e-6 || (r.missed == 0 && r.invented == 0));
        std::printf("%-7s %8.0e %8lld %7lld %8lld %7lld %9lld %7.4f %%\n", r.method.c_str(),
                    r.tolerance, r.roots, r.missed, r.close, r.missed_close, r.invented,
                    100 * rate);
        results.push_back({{"method", r.method},
                           {"tolerance", r.tolerance},
                           {"roots", r.roots},
                           {"missed", r.missed},
                           {"close", r.close},
                           {"missed_close", r.missed_close},
                           {"invented", r.invented},
                           {"failed", r.failed}});
    }
    bench::write_json(options, results);
    if (!right)
        std::printf("a root missed or invented at a tight tolerance, or a run that failed\n");
    return right ? 0 : 1;
}
