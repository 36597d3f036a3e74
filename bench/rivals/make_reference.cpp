// SPDX-License-Identifier: BSD-3-Clause
//
// Which digits are right? Reference orbits of the dry friction oscillator in quadruple precision.
//
// Method: Taylor series of the one-sided fields (order 30 or 40, step by the size of the last
// coefficients), transitions by Newton's method on the series, the stick phase in closed form with
// Newton's method for its end. Nothing is shared with the library or with the loops it is measured
// against. Every orbit is computed twice, with different order and step; the program prints the
// difference, and what happens to the final state when the constants of the friction law are
// rounded to double.
//
// Build and run (needs Boost.Multiprecision and libquadmath, hence the GNU dialect):
//   g++ -std=gnu++20 -O2 make_reference.cpp -o make_reference -lquadmath
//   ./make_reference > reference_oscillator.hpp        (the comparison goes to stderr)
//
// omega is the double nearest to the printed decimal; T = 2 pi / omega in quadruple precision.
// The constants of the friction law are the exact decimals, unless `rounded` is set.

#include <boost/multiprecision/float128.hpp>

#include <array>
#include <iomanip>
#include <iostream>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

namespace {

using Real = boost::multiprecision::float128;

struct Constants {
    Real g_alpha, g_beta, g_eta, gamma; // g mu(r) = g_alpha/(1 + gamma r) + g_beta + g_eta r^2
};

Constants constants(bool rounded) {
    if (rounded)
        return {Real(10) * Real(0.3), Real(10) * Real(0.1), Real(10) * Real(0.01), Real(1.42)};
    return {Real(3), Real(1), Real(1) / 10, Real(142) / 100};
}

struct Problem {
    std::string name;
    double A, omega;
    int n_periods;
    double y0 = 0, v0 = 0; // not on the surface
};

struct Method {
    int order;
    Real safety;
};

struct Event {
    char kind; // s: stick begins, 1: stick ends into S1, 2: into S2, u: crosses up, d: crosses down
    Real t;
};

struct Orbit {
    Real y, v;
    std::vector<Event> events;
};

using Series = std::vector<Real>;

Real value(const Series& c, const Real& t) {
    Real sum = 0;
    for (std::size_t k = c.size(); k-- > 0;)
        sum = sum * t + c[k];
    return sum;
}

Real slope(const Series& c, const Real& t) {
    Real sum = 0;
    for (std::size_t k = c.size() - 1; k > 0; --k)
        sum = sum * t + Real(k) * c[k];
    return sum;
}

Real product(const Series& a, const Series& b, std::size_t n) {
    Real sum = 0;
    for (std::size_t j = 0; j <= n; ++j)
        sum += a[j] * b[n - j];
    return sum;
}

struct Expansion {
    Series y, v;
};

class Oscillator {
public:
    Oscillator(const Problem& problem, const Constants& c, const Method& method)
        : A_(problem.A), omega_(problem.omega), c_(c), method_(method),
          period_(2 * acos(Real(-1)) / omega_), t_end_(problem.n_periods * period_), y_(problem.y0),
          v_(problem.v0), side_(problem.v0 < 1 ? 1 : -1) {}

    Orbit run() {
        while (t_ < t_end_) {
            if (stuck_)
                stick();
            else
                slip();
        }
        return {y_, v_, events_};
    }

private:
    // S1 is side = +1 (V - v > 0), S2 is side = -1.
    Expansion expand() const {
        const auto n_max = static_cast<std::size_t>(method_.order);
        Series y(n_max + 1), v(n_max + 1), r(n_max + 1), den(n_max + 1), inv(n_max + 1);
        Series c(n_max + 1), s(n_max + 1);
        const Real phase = omega_ * fmod(t_, period_);
        y[0] = y_;
        v[0] = v_;
        c[0] = cos(phase);
        s[0] = sin(phase);
        for (std::size_t n = 0; n < n_max; ++n) {
            r[n] = side_ * ((n == 0 ? Real(1) : Real(0)) - v[n]);
            den[n] = (n == 0 ? Real(1) : Real(0)) + c_.gamma * r[n];
            Real rest = n == 0 ? Real(1) : Real(0);
            for (std::size_t j = 0; j < n; ++j)
                rest -= inv[j] * den[n - j];
            inv[n] = rest / den[0];
            Real friction = c_.g_alpha * inv[n] + c_.g_eta * product(r, r, n);
            if (n == 0)
                friction += c_.g_beta;
            const Real over = Real(1) / Real(n + 1);
            y[n + 1] = v[n] * over;
            v[n + 1] = (-y[n] + A_ * c[n] + side_ * friction) * over;
            c[n + 1] = -omega_ * s[n] * over;
            s[n + 1] = omega_ * c[n] * over;
        }
        if (after_stick_)
            v[1] = 0; // exact there; only rounding stands in its place
        return {std::move(y), std::move(v)};
    }

    Real step_size(const Expansion& e) const {
        const auto n = e.v.size() - 1;
        const Real eps = Real(1e-34);
        Real h = Real(1) / 20;
        for (const std::size_t k : {n - 1, n}) {
            const Real size = abs(e.v[k]) + abs(e.y[k]);
            if (size > 0)
                h = std::min(h, Real(pow(eps / size, Real(1) / Real(k))));
        }
        return method_.safety * h;
    }

    Real gap(const Expansion& e, const Real& dt) const { return side_ * (1 - value(e.v, dt)); }

    // First of 64 equal parts at whose end the surface lies behind; 0 if there is none.
    int first_part_behind(const Expansion& e, const Real& h) const {
        for (int k = 1; k <= 64; ++k)
            if (gap(e, h * k / 64) <= 0)
                return k;
        return 0;
    }

    Real root(const Expansion& e, Real lo, Real hi) const {
        Real dt = (lo + hi) / 2;
        for (int i = 0; i < 200; ++i) {
            const Real w = gap(e, dt);
            (w > 0 ? lo : hi) = dt;
            Real next = dt + w / (side_ * slope(e.v, dt));
            if (!(next > lo && next < hi))
                next = (lo + hi) / 2;
            if (abs(next - dt) < Real(1e-33))
                return next;
            dt = next;
        }
        return dt;
    }

    void slip() {
        const Expansion e = expand();
        const Real h = std::min(step_size(e), Real(t_end_ - t_));
        const bool last = !(h < t_end_ - t_);
        const int part = first_part_behind(e, h);
        after_stick_ = false;
        if (part != 0) {
            const Real dt = root(e, h * (part - 1) / 64, h * part / 64);
            y_ = value(e.y, dt);
            v_ = 1;
            t_ += dt;
            arrive();
            return;
        }
        y_ = value(e.y, h);
        v_ = value(e.v, h);
        t_ = last ? t_end_ : Real(t_ + h);
    }

    Real q(const Real& y, const Real& t) const { return -y + A_ * cos(omega_ * fmod(t, period_)); }

    void arrive() {
        const Real edge = c_.g_alpha + c_.g_beta;
        const Real q_now = q(y_, t_);
        if (abs(q_now) < edge) {
            stuck_ = true;
            events_.push_back({'s', t_});
            return;
        }
        side_ = -side_;
        events_.push_back({side_ < 0 ? 'u' : 'd', t_});
    }

    void stick() {
        const Real edge = c_.g_alpha + c_.g_beta;
        const Real y0 = y_, t0 = t_;
        const Real step = method_.safety / 1000;
        Real dt = 0;
        while (abs(q(y0 + dt, t0 + dt)) < edge && t0 + dt < t_end_ + step)
            dt += step;
        const bool lower = q(y0 + dt, t0 + dt) < 0;
        Real lo = dt - step, hi = dt;
        for (int i = 0; i < 200; ++i) {
            const Real now = q(y0 + dt, t0 + dt);
            const Real inside = lower ? Real(now + edge) : Real(edge - now);
            (inside > 0 ? lo : hi) = dt;
            const Real rate = -1 - A_ * omega_ * sin(omega_ * fmod(t0 + dt, period_));
            Real next = dt - inside / (lower ? rate : Real(-rate));
            if (!(next > lo && next < hi))
                next = (lo + hi) / 2;
            const bool done = abs(next - dt) < Real(1e-33);
            dt = next;
            if (done)
                break;
        }
        v_ = 1;
        if (t0 + dt >= t_end_) {
            y_ = y0 + (t_end_ - t0);
            t_ = t_end_;
            return;
        }
        y_ = y0 + dt;
        t_ = t0 + dt;
        stuck_ = false;
        after_stick_ = true;
        side_ = lower ? 1 : -1;
        events_.push_back({lower ? '1' : '2', t_});
    }

    Real A_, omega_;
    Constants c_;
    Method method_;
    Real period_, t_end_;
    Real t_ = 0, y_, v_;
    int side_;
    bool stuck_ = false, after_stick_ = false;
    std::vector<Event> events_;
};

Orbit solve(const Problem& problem, const Method& method, bool rounded) {
    return Oscillator(problem, constants(rounded), method).run();
}

Real distance(const Orbit& a, const Orbit& b) {
    return std::max(Real(abs(a.y - b.y)), Real(abs(a.v - b.v)));
}

Real event_distance(const Orbit& a, const Orbit& b) {
    if (a.events.size() != b.events.size())
        return std::numeric_limits<Real>::infinity();
    Real worst = 0;
    for (std::size_t i = 0; i < a.events.size(); ++i)
        worst = std::max(worst, Real(abs(a.events[i].t - b.events[i].t)));
    return worst;
}

std::string digits(const Real& x) { return x.str(27, std::ios_base::scientific) + "L"; }

void print_head() {
    std::cout << R"(// SPDX-License-Identifier: BSD-3-Clause
//
// Reference orbits of the dry friction oscillator, written by make_reference.cpp: Taylor series in
// quadruple precision, every orbit computed twice with different order and step. All start at
// t = 0, from (y, v) = (0, 0) where no start is given. A and omega are the doubles nearest to the
// decimals shown, T = 2 pi/omega in quadruple precision; the constants of the friction law are the
// exact decimals. Rounding those to double moves the final states by the amount given with each.

#pragma once

#include <array>
#include <string_view>

namespace filippov::rivals {

struct ReferenceOrbit {
    double A, omega;
    int n_periods;
    int n_events;           // in all n_periods
    long double y, v;       // at t = n_periods T
    std::string_view kinds; // s: stick begins, 1: stick ends into S1, 2: into S2, u, d: crossings
    std::array<long double, 10> t_event;
};

struct ReferenceImage {
    double y0, v0;
    int n_events;
    long double y, v; // at t = T
};
)";
}

void print_orbit(const Problem& p, const Orbit& o, const Real& agreement, const Real& shift) {
    std::string kinds;
    for (std::size_t i = 0; i < 10; ++i)
        kinds += o.events.at(i).kind;
    std::cout << "\n// two computations differ by " << agreement.str(1, std::ios_base::scientific)
              << ", constants rounded to double by " << shift.str(1, std::ios_base::scientific)
              << "\ninline constexpr ReferenceOrbit " << p.name << "{\n    " << p.A << ",\n    "
              << p.omega << ",\n    " << p.n_periods << ",\n    " << o.events.size() << ",\n    "
              << digits(o.y) << ",\n    " << digits(o.v) << ",\n    \"" << kinds << "\",\n    {";
    for (std::size_t i = 0; i < 10; ++i)
        std::cout << (i == 0 ? "" : i % 2 == 0 ? ",\n     " : ", ") << digits(o.events[i].t);
    std::cout << "}};\n";
}

/// Images under one period of the centres of n x n cells of [-4, 4] x [-3, 4]; true if the two
/// computations agree.
bool print_images(double A, double omega, int n, const Method& coarse, const Method& fine) {
    std::string rows;
    Real agreement = 0, shift = 0;
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) {
            const Problem p{"", A, omega, 1, -4 + 8 * (i + 0.5) / n, -3 + 7 * (j + 0.5) / n};
            const Orbit a = solve(p, coarse, false), b = solve(p, fine, false);
            agreement = std::max({agreement, distance(a, b), event_distance(a, b)});
            shift = std::max(shift, distance(b, solve(p, coarse, true)));
            std::ostringstream row;
            row << "    {" << p.y0 << ", " << p.v0 << ", " << b.events.size() << ", " << digits(b.y)
                << ", " << digits(b.v) << "},\n";
            rows += row.str();
        }
    std::cout << "\n// A = " << A << ", omega = " << omega << ", the centres of " << n << " x " << n
              << " cells of [-4, 4] x [-3, 4]\n// two computations differ by "
              << agreement.str(1, std::ios_base::scientific) << ", constants rounded to double by "
              << shift.str(1, std::ios_base::scientific)
              << "\ninline constexpr std::array<ReferenceImage, " << n * n
              << "> reference_images{{\n"
              << rows << "}};\n";
    std::cerr << "images: difference " << agreement << '\n';
    return agreement < Real(1e-22);
}

} // namespace

int main() {
    const std::array<Problem, 3> problems{{{"reference_home", 0.5, 2.94, 200},
                                           {"reference_5_172", 5.0, 1.72, 50},
                                           {"reference_5_160", 5.0, 1.6, 50}}};
    const Method coarse{30, Real(1) / 4}, fine{40, Real(1) / 5};
    print_head();
    bool agreed = true;
    for (const Problem& p : problems) {
        const Orbit a = solve(p, coarse, false), b = solve(p, fine, false);
        const Real agreement = std::max(distance(a, b), event_distance(a, b));
        print_orbit(p, b, agreement, distance(b, solve(p, coarse, true)));
        std::cerr << p.name << ": " << b.events.size() << " events, difference " << agreement
                  << '\n';
        agreed = agreed && agreement < Real(1e-22);
    }
    agreed = print_images(3.6, 1.067, 4, coarse, fine) && agreed;
    std::cout << "\n} // namespace filippov::rivals\n";
    return agreed ? 0 : 1;
}
