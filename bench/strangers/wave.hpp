// SPDX-License-Identifier: BSD-3-Clause
// Functions of time that are known with their derivatives and antiderivatives: what drives the
// problems of this campaign.
#pragma once

#include <filippov/core/elementary.hpp>
#include <filippov/core/scalar.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>
#include <string>
#include <vector>

namespace filippov::strangers {

using Long = long double;

/// c (t - q)^p with p = 0, 1, 2;  c cos(p t + q);  c exp(-p (t - q));  c/(1 + ((t - q)/p)^2).
struct Term {
    enum Kind { power, wave, decay, bump } kind = power;
    double c = 0, p = 0, q = 0;

    template <class S> S value(const S& t) const {
        using elementary::cos;
        using std::exp;
        switch (kind) {
        case wave:
            return S(c) * cos(S(p) * t + S(q));
        case decay:
            return S(c) * exp(S(-p) * (t - S(q)));
        case bump: {
            const S u = (t - S(q)) / S(p);
            return S(c) / (S(1) + u * u);
        }
        default:
            return p == 0 ? S(c) : p == 1 ? S(c) * (t - S(q)) : S(c) * (t - S(q)) * (t - S(q));
        }
    }

    /// Derivative of order n, or antiderivative of order -n; -2 <= n <= 2.
    Long exact(Long t, int n) const {
        switch (kind) {
        case wave: {
            const Long phase = Long(p) * t + Long(q), unit = std::pow(Long(p), Long(n));
            const int quarter = ((n % 4) + 4) % 4;
            return Long(c) * unit *
                   (quarter == 0   ? std::cos(phase)
                    : quarter == 1 ? -std::sin(phase)
                    : quarter == 2 ? -std::cos(phase)
                                   : std::sin(phase));
        }
        case decay:
            return Long(c) * std::pow(Long(-p), Long(n)) * std::exp(-Long(p) * (t - Long(q)));
        case bump:
            return bump_of((t - Long(q)) / Long(p), n) * Long(c) / std::pow(Long(p), Long(n));
        default: {
            Long factor = c, left = p; // d^n/dt^n of u^p
            for (int k = 0; k < n; ++k)
                factor *= left--;
            for (int k = 0; k > n; --k)
                factor /= ++left;
            return factor == 0 ? 0 : factor * std::pow(t - Long(q), left);
        }
        }
    }
    /// Over which time it changes.
    double pace() const {
        return kind == wave    ? 1 / std::abs(p)
               : kind == decay ? 1 / std::abs(p)
               : kind == bump  ? p / 3
                               : 1e300;
    }
    std::string text() const {
        char s[120];
        if (kind == power && p == 0)
            std::snprintf(s, sizeof s, "%.17g", c);
        else if (kind == power)
            std::snprintf(s, sizeof s, "%.17g*(t - %.17g)%s", c, q, p == 2 ? "**2" : "");
        else if (kind == bump)
            std::snprintf(s, sizeof s, "%.17g/(1 + ((t - %.17g)/%.17g)**2)", c, q, p);
        else if (kind == wave)
            std::snprintf(s, sizeof s, "%.17g*np.cos(%.17g*t + %.17g)", c, p, q);
        else
            std::snprintf(s, sizeof s, "%.17g*np.exp(-%.17g*(t - %.17g))", c, p, q);
        return s;
    }

private:
    static Long bump_of(Long u, int n) {
        const Long d = 1 + u * u;
        switch (n) {
        case -2:
            return u * std::atan(u) - std::log(d) / 2;
        case -1:
            return std::atan(u);
        case 0:
            return 1 / d;
        case 1:
            return -2 * u / (d * d);
        default:
            return (6 * u * u - 2) / (d * d * d);
        }
    }
};

/// A sum of terms.
struct Wave {
    std::vector<Term> terms;

    Wave() = default;
    explicit Wave(double constant) { add({Term::power, constant, 0, 0}); }

    Wave& add(const Term& term) {
        terms.push_back(term);
        return *this;
    }
    template <class S> S operator()(const S& t) const {
        S sum(0);
        for (const Term& term : terms)
            sum = sum + term.value(t);
        return sum;
    }
    Long exact(Long t, int n) const {
        Long sum = 0;
        for (const Term& term : terms)
            sum += term.exact(t, n);
        return sum;
    }
    double pace() const {
        double least = 1e300;
        for (const Term& term : terms)
            if (term.c != 0)
                least = std::min(least, term.pace());
        return least;
    }
    void scale(double by) {
        for (Term& term : terms)
            term.c *= by;
    }
    std::string text() const {
        std::string sum;
        for (const Term& term : terms)
            sum += (sum.empty() ? "" : " + ") + term.text();
        return sum.empty() ? "0" : sum;
    }
};

/// What problems are drawn with.
class Dice {
public:
    explicit Dice(std::uint64_t seed) : random_(seed) {}
    bool chance(double p) { return uniform(0, 1) < p; }
    double uniform(double a, double b) { return std::uniform_real_distribution<>(a, b)(random_); }
    /// From a to b, all orders of magnitude alike.
    double logarithmic(double a, double b) { return std::exp(uniform(std::log(a), std::log(b))); }
    double normal() { return std::normal_distribution<>()(random_); }
    double sign() { return chance(0.5) ? 1 : -1; }
    int whole(int n) { return int(random_() % std::uint64_t(n)); }

    /// A wave with the quickest frequency `fast`. Without `periodic` also polynomials, decays and
    /// bumps between t0 and t0 + span.
    Wave wave(double size, double fast, bool periodic, double t0, double span) {
        Wave w;
        w.add({Term::wave, size * uniform(0.3, 1), fast, uniform(-3, 3)});
        if (periodic) { // fast is a multiple of these
            if (chance(0.4))
                w.add(
                    {Term::wave, size * uniform(-0.6, 0.6), fast / (1 + whole(3)), uniform(-3, 3)});
            return w;
        }
        const int more = whole(3);
        for (int k = 0; k < more; ++k) {
            const double c = size * uniform(-0.6, 0.6);
            switch (whole(5)) {
            case 0:
                w.add({Term::wave, c, fast * uniform(0.05, 1), uniform(-3, 3)});
                break;
            case 1:
                w.add({Term::decay, c, uniform(0.05, 2) / span, t0});
                break;
            case 2:
                w.add({Term::bump, c, span * logarithmic(0.02, 0.5), t0 + span * uniform(0, 1)});
                break;
            case 3:
                w.add({Term::power, c / span, 1, t0});
                break;
            default:
                w.add({Term::power, c / (span * span), 2, t0});
            }
        }
        return w;
    }

    /// A wave of a swing or two in `span`, with a small ripple of this frequency on top.
    Wave rippled(double size, double fast, double span) {
        const double slow = std::min(uniform(1, 12) / span, fast / 4);
        Wave w;
        w.add({Term::wave, size * uniform(0.3, 1), slow, uniform(-3, 3)});
        w.add({Term::wave, size * logarithmic(1e-4, 0.03), fast, uniform(-3, 3)});
        return w;
    }

private:
    std::mt19937_64 random_;
};

} // namespace filippov::strangers
