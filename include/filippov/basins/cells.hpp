// SPDX-License-Identifier: BSD-3-Clause
// Grids of cells over two coordinates, and simple cell mapping.
#pragma once

#include <filippov/core/parallel.hpp>
#include <filippov/core/status.hpp>
#include <filippov/run/settings.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace filippov {

/// What becomes of a point.
struct CellLabel {
    std::int32_t label = 0; ///< -1 escaped, 0 unresolved, 1, 2, ... attractors
    std::int32_t time = 0;  ///< a count, such as forcing periods until the attractor
};

/// One coordinate cut into cells of equal width. Cell i holds edge(i) <= x < edge(i + 1): that is
/// i = floor((x - low) / width), where the edges as they are rounded decide.
struct CellAxis {
    int coordinate = 0;       ///< index into the state, >= 0
    double low = 0, high = 1; ///< the ends, finite, low < high, units of the coordinate
    int n = 500;              ///< cells, 1 ... 100'000

    static constexpr int most = 100'000;
    static constexpr int outside = -1;

    double width() const { return (high - low) / n; }
    /// Where cell i begins and cell i-1 ends, i = 0 ... n; the ends are met exactly.
    double edge(int i) const { return i < n ? low + (high - low) * (double(i) / n) : high; }
    double centre(int i) const { return low + (high - low) * ((i + 0.5) / n); }
    /// The cell that holds x; `outside` beyond the ends and for NaN.
    int cell_of(double x) const {
        if (!(x >= low && x < high))
            return outside;
        int i = std::min(static_cast<int>((x - low) / (high - low) * n), n - 1);
        // The quotient is right to far less than a cell, so its floor is at most one cell off.
        if (x < edge(i))
            --i;
        else if (x >= edge(i + 1))
            ++i;
        return i;
    }
    /// Distance of neighbouring numbers where they are farthest apart on this axis.
    double spacing() const {
        const double largest = std::max(std::abs(low), std::abs(high));
        return largest - std::nextafter(largest, 0.0);
    }
};

namespace detail {

inline void validate(const CellAxis& axis, const std::string& name) {
    if (!(axis.coordinate >= 0))
        refuse(name + ".coordinate", axis.coordinate, "expected an index >= 0");
    if (!std::isfinite(axis.low))
        refuse(name + ".low", axis.low, "expected a finite number");
    if (!(axis.high > axis.low && std::isfinite(axis.high - axis.low)))
        refuse(name + ".high", axis.high, "expected a finite number > low");
    if (!(axis.n >= 1 && axis.n <= CellAxis::most))
        refuse(name + ".n", axis.n, "expected an integer from 1 to 100000");
    // Then centres are inside, and floors are right to one cell.
    if (!(axis.width() >= 1024 * axis.spacing()))
        refuse(name + ".n", axis.n, "expected cells wider than 1024 units in the last place");
}

} // namespace detail

/// A rectangle of cells. They are numbered row-major over (first axis, second axis): the cell in
/// column i of the first axis and j of the second is i * second.n + j.
class CellGrid {
public:
    static constexpr std::int32_t sink = -1;       ///< everything outside, infinities too
    static constexpr std::int32_t unresolved = -2; ///< a coordinate is NaN: nobody knows where

    /// @error std::invalid_argument for axes that make no sense, of the same coordinate, of cells
    ///        too narrow to hold their centres, or for more than 2^31 - 1 cells
    CellGrid(const CellAxis& first, const CellAxis& second) : axes_{first, second} {
        detail::validate(first, "first");
        detail::validate(second, "second");
        if (first.coordinate == second.coordinate)
            detail::refuse("second.coordinate", second.coordinate,
                           "expected another coordinate than that of the first axis");
        const std::int64_t cells = std::int64_t(first.n) * second.n;
        if (!(cells <= std::numeric_limits<std::int32_t>::max()))
            detail::refuse("first.n * second.n", cells, "expected at most 2^31 - 1 cells");
    }

    /// 0: the first axis, 1: the second.
    const CellAxis& axis(int k) const { return axes_[static_cast<std::size_t>(k)]; }
    std::int32_t cells() const { return axes_[0].n * axes_[1].n; }

    /// The cell that holds a point given by its two coordinates, or `sink`, or `unresolved`.
    std::int32_t cell_of(double a, double b) const {
        if (std::isnan(a) || std::isnan(b))
            return unresolved;
        const int i = axes_[0].cell_of(a), j = axes_[1].cell_of(b);
        return i == CellAxis::outside || j == CellAxis::outside ? sink : i * axes_[1].n + j;
    }
    /// @pre 0 <= cell < cells(); cell_of(centre(cell)) is cell
    std::array<double, 2> centre(std::int32_t cell) const {
        return {axes_[0].centre(cell / axes_[1].n), axes_[1].centre(cell % axes_[1].n)};
    }
    /// The same grid half a cell further along both axes: what was a line is now between lines.
    CellGrid shifted() const {
        auto axes = axes_;
        for (CellAxis& axis : axes) {
            const double half = axis.width() / 2;
            axis.low += half;
            axis.high += half;
        }
        return {axes[0], axes[1]};
    }

private:
    std::array<CellAxis, 2> axes_;
};

// --- images --------------------------------------------------------------------------------------

/// Where the centres of all cells go.
struct CellImages {
    std::vector<std::int32_t> image; ///< shape (cells,): a cell, `sink` or `unresolved`
    Status status = Status::ok;      ///< `interrupted`: cells that were not begun are unresolved
};

/// Cells that a map is given at once: a constant, so that no number depends on the threads.
inline constexpr std::size_t cell_tile = 4096;

/// Maps the centre of each cell, and looks up the cells that hold the images.
///
/// @param map  takes (std::span<const std::array<double, 2>> centres, std::span<std::array<double,
///             2>> images), with a Worker& behind them if it wants to know when to stop early; both
///             spans hold one tile. It is called from several threads. Images are NaN beforehand:
///             one that is not written is unresolved
/// @param how  threads, progress (in cells) and cancelling
/// @error      std::invalid_argument for threads < 0; what the map throws
/// @cost       one map a cell; memory 4 bytes a cell, and a tile a thread
template <class Map>
CellImages cell_images(const CellGrid& grid, const Map& map, const Parallel& how = {}) {
    using Points = std::vector<std::array<double, 2>>;
    using From = std::span<const std::array<double, 2>>;
    using To = std::span<std::array<double, 2>>;
    constexpr double nan = std::numeric_limits<double>::quiet_NaN();
    detail::require_callable("map", map);
    const auto cells = static_cast<std::size_t>(grid.cells());
    CellImages result{std::vector<std::int32_t>(cells, CellGrid::unresolved)};
    Parallel counted = how;
    counted.total = cells;
    const auto do_tile = [&](std::size_t tile, Worker& worker) {
        const std::size_t first = tile * cell_tile, n = std::min(cell_tile, cells - first);
        Points centres(n), images(n, {nan, nan});
        for (std::size_t k = 0; k < n; ++k)
            centres[k] = grid.centre(static_cast<std::int32_t>(first + k));
        if constexpr (std::is_invocable_v<const Map&, From, To, Worker&>)
            map(From(centres), To(images), worker);
        else
            map(From(centres), To(images));
        for (std::size_t k = 0; k < n; ++k)
            result.image[first + k] = grid.cell_of(images[k][0], images[k][1]);
        worker.count(n);
    };
    if (!parallel_for((cells + cell_tile - 1) / cell_tile, counted, do_tile))
        result.status = Status::interrupted;
    return result;
}

// --- unravelling ---------------------------------------------------------------------------------

/// Cells that the map leads around.
struct CellGroup {
    std::int32_t period = 0;
    std::vector<std::int32_t> cells; ///< in the order of the map, beginning with the smallest
    std::int32_t basin = 0;          ///< cells that lead here, those of the group among them
};

/// What becomes of each cell.
struct CellMap {
    /// Shape (cells,): an index into `groups`, or `CellGrid::sink`, or `CellGrid::unresolved` where
    /// the way to the end passes a cell of unknown image.
    std::vector<std::int32_t> group;
    /// Shape (cells,): maps until the group (0 in it), the sink, or the unknown.
    std::vector<std::int32_t> steps;
    std::vector<CellGroup> groups;     ///< by period, then by smallest cell
    std::int32_t sink_basin = 0;       ///< cells that lead outside
    std::int32_t unresolved_basin = 0; ///< cells of which it is not known
};

namespace detail {

/// Follows each cell once.
class Unraveller {
public:
    explicit Unraveller(std::span<const std::int32_t> image) : image_(image) {
        map_.group.assign(image.size(), untouched);
        map_.steps.assign(image.size(), 0);
    }
    CellMap run() {
        for (std::size_t start = 0; start < image_.size(); ++start)
            if (map_.group[start] == untouched)
                walk(static_cast<std::int32_t>(start));
        number_groups();
        count_basins();
        return std::move(map_);
    }

private:
    static constexpr std::int32_t untouched = -3, under_processing = -4;

    std::int32_t& group(std::int32_t c) { return map_.group[static_cast<std::size_t>(c)]; }
    std::int32_t& steps(std::int32_t c) { return map_.steps[static_cast<std::size_t>(c)]; }
    std::int32_t image(std::int32_t c) const { return image_[static_cast<std::size_t>(c)]; }

    /// Along the path twice: once to where it ends, and once more to write down how far that was.
    void walk(std::int32_t start) {
        std::int32_t c = start, ahead = 0;
        for (; c >= 0 && group(c) == untouched; c = image(c)) {
            group(c) = under_processing;
            steps(c) = ahead++;
        }
        if (c >= 0 && group(c) == under_processing) {
            ahead = steps(c);
            close(c);
        }
        const std::int32_t label = c >= 0 ? group(c) : c, behind = c >= 0 ? steps(c) : 0;
        for (c = start; ahead > 0; c = image(c), --ahead) {
            group(c) = label;
            steps(c) = behind + ahead;
        }
    }
    /// The cells around from c are a group.
    void close(std::int32_t c) {
        CellGroup found;
        for (; group(c) == under_processing; c = image(c)) {
            found.cells.push_back(c);
            group(c) = static_cast<std::int32_t>(map_.groups.size());
            steps(c) = 0;
        }
        auto& cells = found.cells;
        std::rotate(cells.begin(), std::min_element(cells.begin(), cells.end()), cells.end());
        found.period = static_cast<std::int32_t>(cells.size());
        map_.groups.push_back(std::move(found));
    }
    void number_groups() {
        std::vector<std::int32_t> order(map_.groups.size()), number(order.size());
        std::iota(order.begin(), order.end(), 0);
        const auto key = [&](std::int32_t k) {
            const CellGroup& g = map_.groups[static_cast<std::size_t>(k)];
            return std::pair(g.period, g.cells.front());
        };
        std::sort(order.begin(), order.end(), [&](auto a, auto b) { return key(a) < key(b); });
        std::vector<CellGroup> sorted;
        sorted.reserve(order.size());
        for (const std::int32_t old : order) {
            number[static_cast<std::size_t>(old)] = static_cast<std::int32_t>(sorted.size());
            sorted.push_back(std::move(map_.groups[static_cast<std::size_t>(old)]));
        }
        map_.groups = std::move(sorted);
        for (std::int32_t& g : map_.group)
            if (g >= 0)
                g = number[static_cast<std::size_t>(g)];
    }
    void count_basins() {
        for (const std::int32_t g : map_.group)
            ++(g >= 0                ? map_.groups[static_cast<std::size_t>(g)].basin
               : g == CellGrid::sink ? map_.sink_basin
                                     : map_.unresolved_basin);
    }

    std::span<const std::int32_t> image_;
    CellMap map_;
};

} // namespace detail

/// Simple cell mapping: the periodic groups of a map from cells to cells, and what leads to them.
///
/// The numbering is canonical (by period, then by smallest cell): it does not depend on the order
/// in which cells are looked at. What a group says of the map itself is another matter: a cell
/// moves by up to half its width before it is mapped, so groups can be spurious, and attractors can
/// split.
///
/// @param image  shape (cells,): a cell, `CellGrid::sink` or `CellGrid::unresolved`
/// @error        std::invalid_argument for images that are no such thing, or of another number
/// @cost         O(cells + groups log groups); each cell is passed at most three times. Memory 8
///               bytes a cell beside the image, and 4 a cell and some 50 a group for the groups
/// @source       Hsu and Guttalu, An unravelling algorithm for global analysis of dynamical
///               systems, J. Appl. Mech. 47 (1980)
inline CellMap cell_map(const CellGrid& grid, std::span<const std::int32_t> image) {
    if (image.size() != static_cast<std::size_t>(grid.cells()))
        detail::refuse("image.size()", image.size(),
                       "expected " + std::to_string(grid.cells()) + ", one a cell");
    for (std::size_t c = 0; c < image.size(); ++c)
        if (!(image[c] >= CellGrid::unresolved && image[c] < grid.cells()))
            detail::refuse("image[" + std::to_string(c) + "]", image[c],
                           "expected a cell, -1 (sink) or -2 (unresolved)");
    return detail::Unraveller(image).run();
}

// --- the surface and the grid
// ----------------------------------------------------------------------

/// A line of a grid.
struct GridLine {
    int axis = 0;     ///< 0: the first coordinate is constant along it, 1: the second
    int index = 0;    ///< 0 ... n of that axis: where cell `index` begins
    double value = 0; ///< of that coordinate
};

/// The lines of a grid on which a switching function vanishes to rounding.
///
/// There rounding decides in which cell the image of a slide lies: `CellGrid::shifted` or another
/// number of cells keeps the surface off the lines.
///
/// @param h  called as h(a, b) with the two coordinates, at up to 32 centres along each line, and
///           half a cell aside; |h| on the line must be below 64 units in the last place of the
///           axis, in cells, of |h| aside
/// @return   by axis, then by index
/// @cost     three h a line, three times 32 on those that are found
template <class H> std::vector<GridLine> lines_on_surface(const CellGrid& grid, const H& h) {
    std::vector<GridLine> found;
    for (int k = 0; k < 2; ++k) {
        const CellAxis &axis = grid.axis(k), &along = grid.axis(1 - k);
        const double tiny = 64 * axis.spacing() / axis.width(), half = axis.width() / 2;
        const int samples = std::min(along.n, 32);
        const auto size = [&](double x, double y) {
            return std::abs(k == 0 ? double(h(x, y)) : double(h(y, x)));
        };
        const auto vanishes = [&](double x, int sample) {
            const double y =
                along.centre(static_cast<int>(std::int64_t(sample) * along.n / samples));
            const double aside = std::max(size(x - half, y), size(x + half, y));
            return aside > 0 && size(x, y) <= tiny * aside;
        };
        for (int i = 0; i <= axis.n; ++i) {
            const double x = axis.edge(i);
            int on = 0;
            while (on < samples && vanishes(x, on))
                ++on;
            if (on == samples)
                found.push_back({k, i, x});
        }
    }
    return found;
}

} // namespace filippov
