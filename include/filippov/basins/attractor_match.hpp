// SPDX-License-Identifier: BSD-3-Clause
// The same attractors found again at another parameter value.
#pragma once

#include <filippov/basins/detail/label_grid.hpp>
#include <filippov/core/statistics.hpp>

#include <algorithm>
#include <cstddef>
#include <limits>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace filippov {

/// Points of one attractor: an orbit's on a section, or samples of a chaotic one.
using AttractorPoints = std::vector<Vec<double, Eigen::Dynamic>>;

/// An attractor that has its number.
struct KnownAttractor {
    Label id = 1; ///< > 0
    AttractorPoints points;
};

/// Which of the attractors found are known.
struct AttractorMatch {
    std::vector<Label> ids;        ///< one for each attractor found
    std::vector<double> distances; ///< of each to the known one; NaN if it is new
    std::vector<Label> vanished;   ///< known ones that were not found
    std::vector<Label> appeared;   ///< ids that are new
    Label next_id = 1;             ///< not yet given to any
};

namespace detail {

inline double mean_distance(const AttractorPoints& from, const AttractorPoints& to,
                            const Vec<double, Eigen::Dynamic>& scale) {
    double sum = 0;
    for (const auto& a : from) {
        double nearest = std::numeric_limits<double>::infinity();
        for (const auto& b : to)
            nearest = std::min(nearest, (a - b).cwiseQuotient(scale).norm());
        sum += nearest;
    }
    return sum / static_cast<double>(from.size());
}

inline void require_scale(const Vec<double, Eigen::Dynamic>& scale) {
    for (Eigen::Index i = 0; i < scale.size(); ++i)
        if (!(scale[i] > 0 && scale[i] < std::numeric_limits<double>::infinity()))
            refuse("scale[" + std::to_string(i) + "]", scale[i], "expected a finite number > 0");
}
inline void require_attractor(const AttractorPoints& points,
                              const Vec<double, Eigen::Dynamic>& scale) {
    if (points.empty())
        refuse("points.size()", 0, "expected at least one point an attractor");
    for (const auto& x : points) {
        if (x.size() != scale.size())
            refuse("point.size()", x.size(),
                   "expected one entry a scale, " + std::to_string(scale.size()));
        if (!x.allFinite())
            refuse("point", unknown, "expected finite numbers");
    }
}

/// The column of each row in the assignment of least total cost, by shortest augmenting paths.
/// @pre     square, finite
/// @cost    O(n^3)
/// @source  Kuhn, Nav. Res. Logist. Q. 2 (1955) 83; Jonker, Volgenant, Computing 38 (1987) 325
inline std::vector<std::size_t>
least_cost(const Mat<double, Eigen::Dynamic, Eigen::Dynamic>& cost) {
    const auto n = static_cast<std::size_t>(cost.rows());
    const auto c = [&](std::size_t row, std::size_t column) {
        return cost(static_cast<Eigen::Index>(row), static_cast<Eigen::Index>(column));
    };
    // Column n is a place where the row to be assigned starts; `none` is no row.
    const std::size_t none = n;
    std::vector<std::size_t> row_of(n + 1, none), before(n + 1, n);
    std::vector<double> u(n + 1, 0.0), v(n + 1, 0.0);
    for (std::size_t row = 0; row < n; ++row) {
        std::vector<double> way(n, std::numeric_limits<double>::infinity());
        std::vector<bool> reached(n + 1, false);
        std::size_t at = n;
        row_of[n] = row;
        while (row_of[at] != none) { // reaches one more column each time
            reached[at] = true;
            double step = std::numeric_limits<double>::infinity();
            std::size_t nearest = n;
            for (std::size_t j = 0; j < n; ++j) {
                if (reached[j])
                    continue;
                const double reduced = c(row_of[at], j) - u[row_of[at]] - v[j];
                if (reduced < way[j]) {
                    way[j] = reduced;
                    before[j] = at;
                }
                if (way[j] < step) {
                    step = way[j];
                    nearest = j;
                }
            }
            for (std::size_t j = 0; j <= n; ++j)
                if (reached[j]) {
                    u[row_of[j]] += step;
                    v[j] -= step;
                } else {
                    way[j] -= step;
                }
            at = nearest;
        }
        for (; at != n; at = before[at])
            row_of[at] = row_of[before[at]];
    }
    std::vector<std::size_t> column_of(n);
    for (std::size_t j = 0; j < n; ++j)
        column_of[row_of[j]] = j;
    return column_of;
}

} // namespace detail

/// Distance of two attractors: the larger of the two means of the distances of one's points to the
/// nearest of the other's.
///
/// Zero only for equal sets, as Hausdorff's distance, which has the largest of those distances
/// instead of the mean: of a chaotic attractor that is the luck of one sample. The larger of both,
/// since an attractor near to a part of another one is not near to it.
/// @param scale  length by which each coordinate is measured, > 0, shape (dim,)
/// @error        std::invalid_argument for points or scales that make no sense
/// @cost         the product of the numbers of points
/// @source       Dubuisson, Jain, 12th Int. Conf. Pattern Recognition (1994) 566
inline double attractor_distance(const AttractorPoints& a, const AttractorPoints& b,
                                 const Vec<double, Eigen::Dynamic>& scale) {
    detail::require_scale(scale);
    detail::require_attractor(a, scale);
    detail::require_attractor(b, scale);
    return std::max(detail::mean_distance(a, b, scale), detail::mean_distance(b, a, scale));
}

/// Gives attractors found at a parameter value the ids of those known from a neighbouring one.
///
/// One to one, with the least sum of distances, a pair farther apart than the threshold counting as
/// the threshold: such a pair is none, and its members have vanished and appeared. New ids count on
/// from `next_id`; if the `next_id` of the result is handed on, none is ever used again, not even
/// for an attractor that comes back.
/// @param known      from the last parameter value; may be empty, with `next_id` = 1
/// @param found      at this one, in any order; may be empty
/// @param scale      length by which each coordinate is measured, > 0, shape (dim,)
/// @param threshold  largest distance, in these lengths, to be the same attractor, > 0
/// @param next_id    above all ids known
/// @error            std::invalid_argument for arguments that make no sense
/// @cost             a distance for each pair, and O(n^3) for n = max(known, found)
inline AttractorMatch match_attractors(std::span<const KnownAttractor> known,
                                       std::span<const AttractorPoints> found,
                                       const Vec<double, Eigen::Dynamic>& scale, double threshold,
                                       Label next_id) {
    if (!(threshold > 0 && threshold < std::numeric_limits<double>::infinity()))
        detail::refuse("threshold", threshold, "expected a finite number > 0");
    std::vector<Label> vanished;
    for (const KnownAttractor& old : known) {
        if (!(old.id > 0 && old.id < next_id))
            detail::refuse("id", old.id, "expected 0 < id < next_id");
        vanished.push_back(old.id);
    }
    std::sort(vanished.begin(), vanished.end());
    if (const auto twice = std::adjacent_find(vanished.begin(), vanished.end());
        twice != vanished.end())
        detail::refuse("id", *twice, "expected each id once");
    constexpr std::size_t most = std::numeric_limits<Label>::max();
    if (!(next_id > 0 && found.size() <= most - static_cast<std::size_t>(next_id)))
        detail::refuse("next_id", next_id, "expected a number > 0 with ids left above it");

    const auto n = static_cast<Eigen::Index>(std::max(known.size(), found.size()));
    Mat<double, Eigen::Dynamic, Eigen::Dynamic> distance =
        Mat<double, Eigen::Dynamic, Eigen::Dynamic>::Constant(
            n, n, std::numeric_limits<double>::infinity());
    for (std::size_t i = 0; i < found.size(); ++i)
        for (std::size_t j = 0; j < known.size(); ++j)
            distance(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) =
                attractor_distance(found[i], known[j].points, scale);
    const std::vector<std::size_t> partner = detail::least_cost(distance.cwiseMin(threshold));

    AttractorMatch match;
    match.next_id = next_id;
    for (std::size_t i = 0; i < found.size(); ++i) {
        const double d =
            distance(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(partner[i]));
        const bool same = d <= threshold;
        match.ids.push_back(same ? known[partner[i]].id : match.next_id++);
        match.distances.push_back(same ? d : detail::unknown);
        if (same)
            std::erase(vanished, match.ids.back());
        else
            match.appeared.push_back(match.ids.back());
    }
    match.vanished = std::move(vanished);
    return match;
}

} // namespace filippov
