// SPDX-License-Identifier: BSD-3-Clause
// The word of an orbit: its modes, and what ends each of them.
#pragma once

#include <filippov/any_system.hpp>

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

namespace filippov {

/// What ends a segment.
enum class Until : unsigned char {
    // a change of mode:
    surface,    ///< h = 0
    exit_below, ///< s = -1
    exit_above, ///< s = +1
    // none:
    graze,          ///< h' = 0: nearest to the surface; no change of mode
    extremum_below, ///< (1 + s)' = 0; no change of mode
    extremum_above, ///< (1 - s)' = 0; no change of mode
    phase,          ///< a time: the cut of an orbit that has no event
};

struct Letter {
    int mode = 0; ///< -1, 0 or +1
    Until until = Until::surface;
    bool operator==(const Letter&) const = default;
};

/// The condition that ends a segment, as a quantity that vanishes. (Not for `phase`.)
inline Quantity condition(const Letter& letter) {
    using Kind = Quantity::Kind;
    switch (letter.until) {
    case Until::exit_below:
        return {Kind::margin, -1, 0};
    case Until::exit_above:
        return {Kind::margin, +1, 0};
    case Until::graze:
        return {Kind::h, letter.mode, 1};
    case Until::extremum_below:
        return {Kind::margin, -1, 1};
    case Until::extremum_above:
        return {Kind::margin, +1, 1};
    default:
        return {Kind::h, letter.mode, 0};
    }
}

/// What ends a segment of this mode where the next one begins.
inline Until until(int mode, int next) {
    if (mode != 0)
        return Until::surface;
    return next < 0 ? Until::exit_below : Until::exit_above;
}

/// A cycle of letters; letter i is the segment from node i to node i + 1.
struct Word {
    std::vector<Letter> letters;

    std::size_t size() const { return letters.size(); }
    const Letter& operator[](std::size_t i) const { return letters[i % letters.size()]; }
    bool operator==(const Word&) const = default;

    /// The word of a cycle of modes.
    static Word of(const std::vector<int>& modes) {
        Word word;
        for (std::size_t i = 0; i < modes.size(); ++i)
            word.letters.push_back({modes[i], until(modes[i], modes[(i + 1) % modes.size()])});
        return word;
    }
    /// The modes as characters `-`, `0`, `+`, from the given node on. A node at which the mode does
    /// not change does not show.
    std::string modes(std::size_t from = 0) const {
        std::string text;
        for (std::size_t i = 0; i < size(); ++i) {
            const Letter& letter = (*this)[from + i];
            const bool changes =
                letter.until <= Until::exit_above || (text.empty() && i + 1 == size());
            if (changes)
                text += letter.mode < 0 ? '-' : letter.mode > 0 ? '+' : '0';
        }
        return text;
    }
    /// Where the canonical reading starts: the smallest of all rotations in the order 0, -, +.
    std::size_t first() const {
        const auto rank = [](char c) { return c == '0' ? 0 : c == '-' ? 1 : 2; };
        std::size_t best = 0;
        for (std::size_t i = 1; i < size(); ++i) {
            const std::string a = modes(i), b = modes(best);
            if (std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end(),
                                             [&](char x, char y) { return rank(x) < rank(y); }))
                best = i;
        }
        return best;
    }
    /// The canonical reading, the same for all cuts of a cycle.
    std::string string() const { return modes(first()); }
};

} // namespace filippov
