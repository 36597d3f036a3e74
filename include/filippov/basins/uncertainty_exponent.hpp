// SPDX-License-Identifier: BSD-3-Clause
// The uncertainty exponent of a boundary, from pairs of starts.
#pragma once

#include <filippov/basins/detail/label_grid.hpp>
#include <filippov/core/statistics.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <random>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

namespace filippov {

/// Pairs of starts at a distance: in how many of them the two have different labels.
struct PairCount {
    double epsilon = 0;       ///< the distance, in any unit, > 0
    long long uncertain = 0;  ///< pairs with different labels
    long long trials = 0;     ///< pairs with both labels known
    long long unresolved = 0; ///< pairs left out, with a label unknown
};

/// f(epsilon) ~ epsilon^alpha, fitted.
struct UncertaintyExponent {
    double alpha = detail::unknown;
    double error = detail::unknown;       ///< standard error of alpha, and of the dimension
    double dimension = detail::unknown;   ///< of the boundary, D - alpha
    double log_factor = detail::unknown;  ///< ln f = log_factor + alpha ln epsilon
    double chi2 = 0;                      ///< of the fit, from the binomial weights alone
    int degrees = 0;                      ///< of freedom
    double probability = detail::unknown; ///< of a chi^2 above this one; NaN without freedom
    std::vector<std::size_t> left_out;    ///< indices of counts with none or only uncertain pairs
};

/// The uncertainty exponent of a boundary, by weighted least squares in ln f over ln epsilon.
///
/// The variance of ln f is (1 - f)/(n f), that of a binomial count to first order. Counts of none
/// (ln f infinite) or all pairs (no longer a power law) are left out and listed; where few are
/// expected that is a choice by outcome, and weights from counts k have a bias of order 1/(2k): ten
/// uncertain pairs or more at the least distance are wanted. A fractal's f may wiggle about its
/// power law: if chi2 exceeds the degrees of freedom, the error is enlarged by the root of their
/// ratio, and `probability` tells how bad it is.
/// @param counts  independent ones; not two different distances left: alpha is NaN
/// @param D       dimension of the space in which the pairs lie
/// @error         std::invalid_argument for counts or distances that make no sense
/// @source        Grebogi, McDonald, Ott, Yorke, Phys. Lett. A 99 (1983) 415; McDonald et al.,
///                Physica D 17 (1985) 125
inline UncertaintyExponent uncertainty_exponent(std::span<const PairCount> counts, double D = 2) {
    constexpr double inf = std::numeric_limits<double>::infinity();
    if (!(D > 0 && D < inf))
        detail::refuse("D", D, "expected a finite number > 0");
    UncertaintyExponent result;
    std::vector<double> x, y, weight;
    for (std::size_t i = 0; i < counts.size(); ++i) {
        const auto [epsilon, uncertain, trials, unresolved] = counts[i];
        const std::string which = "counts[" + std::to_string(i) + "].";
        if (!(epsilon > 0 && epsilon < inf))
            detail::refuse(which + "epsilon", epsilon, "expected a finite number > 0");
        if (!(uncertain >= 0 && uncertain <= trials))
            detail::refuse(which + "uncertain", static_cast<long double>(uncertain),
                           "expected 0 to trials, " + std::to_string(trials));
        if (uncertain == 0 || uncertain == trials) {
            result.left_out.push_back(i);
            continue;
        }
        const double f = detail::ratio(uncertain, trials);
        x.push_back(std::log(epsilon));
        y.push_back(std::log(f));
        weight.push_back(static_cast<double>(uncertain) / (1 - f));
    }
    const detail::Line line = detail::fit_line(x, y, weight);
    if (!(line.spread > 0))
        return result;
    result.alpha = line.slope;
    result.dimension = D - line.slope;
    result.log_factor = line.intercept;
    result.chi2 = line.chi2;
    result.degrees = static_cast<int>(x.size()) - 2;
    result.error = 1 / std::sqrt(line.spread);
    if (result.degrees > 0) {
        result.error *= std::sqrt(std::max(1.0, line.chi2 / result.degrees));
        result.probability = detail::chi2_probability(line.chi2, result.degrees);
    }
    return result;
}

/// Labels many points at once: called as labeller(points, labels), both of the same length.
template <class F>
concept Labeller =
    std::invocable<F&, std::span<const std::array<double, 2>>, std::span<std::int32_t>>;

namespace detail {

inline void require_pairs(const std::array<double, 2>& low, const std::array<double, 2>& high,
                          std::span<const double> epsilons, long long n) {
    constexpr double inf = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < 2; ++i) {
        const std::string which = "[" + std::to_string(i) + "]";
        if (!(std::abs(low[i]) < inf))
            refuse("low" + which, low[i], "expected a finite number");
        if (!(high[i] > low[i] && high[i] - low[i] < inf))
            refuse("high" + which, high[i], "expected a finite number above low");
        for (const double epsilon : epsilons) {
            if (!(epsilon > 0 && epsilon < 1))
                refuse("epsilon", epsilon, "expected 0 < epsilon < 1, in sides of the rectangle");
            // Rounding changes the distance by less than a thousandth.
            if (!(epsilon * (high[i] - low[i]) >
                  1000 * ulp(std::max(std::abs(low[i]), std::abs(high[i])))))
                refuse("epsilon", epsilon, "expected 1000 units in the last place of coordinates");
        }
    }
    if (!(n > 0 && n <= 1'000'000'000))
        refuse("n", n, "expected 1 to 1e9 pairs");
}

/// Fills `points` with random points, each followed by its neighbour.
inline void draw_pairs(const std::array<double, 2>& low, const std::array<double, 2>& high,
                       double epsilon, std::mt19937_64& random,
                       std::span<std::array<double, 2>> points) {
    // fma: compilers differ in whether they would round the product
    for (std::size_t k = 0; k < points.size(); k += 2) {
        for (std::size_t i = 0; i < 2; ++i)
            points[k][i] = std::fma(uniform(random), high[i] - low[i], low[i]);
        points[k + 1] = points[k];
        const std::size_t along = random() >> 63;
        points[k + 1][along] = std::fma(epsilon, high[along] - low[along], points[k][along]);
    }
}

/// Asks for labels; whether the labeller wants to be asked again.
template <class F>
bool goes_on(F& labeller, std::span<const std::array<double, 2>> points, std::span<Label> labels) {
    if constexpr (std::is_same_v<decltype(labeller(points, labels)), bool>) {
        return labeller(points, labels);
    } else {
        labeller(points, labels);
        return true;
    }
}

inline void add_pairs(std::span<const Label> labels, PairCount& count) {
    for (std::size_t k = 0; k < labels.size(); k += 2) {
        const bool known = labels[k] != label_unresolved && labels[k + 1] != label_unresolved;
        count.trials += known;
        count.unresolved += !known;
        count.uncertain += known && labels[k] != labels[k + 1];
    }
}

} // namespace detail

/// Counts uncertain pairs: a point drawn uniformly from a rectangle, and its neighbour at distance
/// epsilon along one of the coordinates, drawn too, since a boundary parallel to a fixed one would
/// never be seen.
///
/// @param low, high  corners of the rectangle; neighbours lie up to epsilon beyond `high`
/// @param labeller   exact labels, 0 where it has none; called with 65,536 points or the rest of a
///                   distance's 2 n, in a fixed order, each followed by its neighbour. If it
///                   returns a bool, false ends the count
/// @param epsilons   distances, as shares of the side along which they lie, in (0, 1)
/// @param n          pairs a distance, 1 to 1e9
/// @param seed       of std::mt19937_64; the points are the same on every platform
/// @return           one count a distance that was finished, from points of its own: the counts are
///                   independent
/// @error            std::invalid_argument for arguments or labels that make no sense
/// @cost             2 n labels a distance
template <Labeller F>
std::vector<PairCount>
count_pairs(const std::array<double, 2>& low, const std::array<double, 2>& high, F&& labeller,
            std::span<const double> epsilons, long long n, std::uint64_t seed) {
    detail::require_callable("labeller", labeller);
    detail::require_pairs(low, high, epsilons, n);
    constexpr long long at_once = 1 << 15; // pairs
    std::mt19937_64 random(seed);
    std::vector<std::array<double, 2>> points;
    std::vector<Label> labels;
    std::vector<PairCount> counts;
    for (const double epsilon : epsilons) {
        PairCount count{.epsilon = epsilon};
        for (long long done = 0; done < n; done += at_once) {
            points.resize(2 * static_cast<std::size_t>(std::min(at_once, n - done)));
            detail::draw_pairs(low, high, epsilon, random, points);
            labels.assign(points.size(), label_unresolved);
            if (!detail::goes_on(labeller, points, labels))
                return counts;
            detail::require_labels(labels);
            detail::add_pairs(labels, count);
        }
        counts.push_back(count);
    }
    return counts;
}

} // namespace filippov
