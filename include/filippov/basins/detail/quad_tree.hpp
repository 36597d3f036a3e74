// SPDX-License-Identifier: BSD-3-Clause
// Squares that are split in four.
#pragma once

#include <filippov/basins/cells.hpp>

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

namespace filippov {

/// A square of the picture that is not split: of level `level`, in column i and row j of the
/// coarse * 2^level along either side.
struct Leaf {
    std::int32_t level = 0, i = 0, j = 0;
    CellLabel label;
};

/// Squares that are split in four, from a coarse grid of them; 24 bytes a square.
class QuadTree {
public:
    explicit QuadTree(int coarse = 1, int levels = 0) : coarse_(coarse), levels_(levels) {
        nodes_.reserve(static_cast<std::size_t>(coarse) * static_cast<std::size_t>(coarse));
        for (std::int32_t i = 0; i < coarse; ++i)
            for (std::int32_t j = 0; j < coarse; ++j)
                nodes_.push_back({{0, i, j, {}}});
    }

    int levels() const { return levels_; }
    /// Squares along either side on a level.
    std::int32_t side(int level) const { return coarse_ << level; }
    /// Squares of all levels, split ones too; those of a split are next to each other.
    std::int32_t size() const { return static_cast<std::int32_t>(nodes_.size()); }
    bool is_leaf(std::int32_t k) const { return node(k).child < 0; }
    const Leaf& operator[](std::int32_t k) const { return node(k).square; }
    void set_label(std::int32_t k, const CellLabel& label) { node(k).square.label = label; }

    void split(std::int32_t k) {
        const Leaf parent = node(k).square;
        node(k).child = size();
        for (std::int32_t i = 0; i < 2; ++i)
            for (std::int32_t j = 0; j < 2; ++j)
                nodes_.push_back({{parent.level + 1, 2 * parent.i + i, 2 * parent.j + j, {}}});
    }
    /// The square (i, j) of a level, or the larger leaf that covers it.
    std::int32_t find(int level, std::int32_t i, std::int32_t j) const {
        std::int32_t k = root(i >> level, j >> level);
        for (int below = level - 1; below >= 0 && node(k).child >= 0; --below)
            k = node(k).child + 2 * ((i >> below) & 1) + ((j >> below) & 1);
        return k;
    }
    /// The leaf that covers the square (i, j) of the finest level.
    const Leaf& at(std::int32_t i, std::int32_t j) const {
        return node(find(levels_, i, j)).square;
    }
    /// Calls visit(index) for each leaf that has a side or a corner in common with leaf k.
    template <class Visit> void visit_touching(std::int32_t k, Visit&& visit) const {
        const std::int32_t last = side(levels_) - 1;
        Square around = finest(node(k).square);
        around = {{std::max(around.low[0] - 1, 0), std::max(around.low[1] - 1, 0)},
                  {std::min(around.high[0] + 1, last), std::min(around.high[1] + 1, last)}};
        for (std::int32_t i = around.low[0] >> levels_; i <= around.high[0] >> levels_; ++i)
            for (std::int32_t j = around.low[1] >> levels_; j <= around.high[1] >> levels_; ++j)
                descend(root(i, j), around, k, visit);
    }

private:
    struct Node {
        Leaf square;
        std::int32_t child = -1; ///< the first of four, -1: a leaf
    };
    /// Squares of the finest level, from low to high, both included.
    struct Square {
        std::array<std::int32_t, 2> low{}, high{};
    };

    const Node& node(std::int32_t k) const { return nodes_[static_cast<std::size_t>(k)]; }
    Node& node(std::int32_t k) { return nodes_[static_cast<std::size_t>(k)]; }
    std::int32_t root(std::int32_t i, std::int32_t j) const { return i * coarse_ + j; }
    Square finest(const Leaf& s) const {
        const int up = levels_ - s.level;
        return {{s.i << up, s.j << up}, {((s.i + 1) << up) - 1, ((s.j + 1) << up) - 1}};
    }
    /// As deep as there are levels.
    template <class Visit>
    void descend(std::int32_t k, const Square& around, std::int32_t self, Visit& visit) const {
        const Square s = finest(node(k).square);
        for (std::size_t d = 0; d < 2; ++d)
            if (s.low[d] > around.high[d] || s.high[d] < around.low[d])
                return;
        if (node(k).child >= 0)
            for (std::int32_t c = 0; c < 4; ++c)
                descend(node(k).child + c, around, self, visit);
        else if (k != self)
            visit(k);
    }

    int coarse_, levels_;
    std::vector<Node> nodes_;
};

} // namespace filippov
