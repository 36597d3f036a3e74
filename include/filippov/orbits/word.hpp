// SPDX-License-Identifier: BSD-3-Clause
// The word of an orbit: its modes, and what ends each of them.
#pragma once

#include <filippov/orbits/system_interface.hpp>

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
    int mode = 0; ///< its code: -1, 0 or +1 for one surface
    Until until = Until::surface;
    int surface = 0; ///< which h, or s
    bool operator==(const Letter&) const = default;
};

/// The condition that ends a segment, as a quantity that vanishes. (Not for `phase`.)
inline Quantity condition(const Letter& letter) {
    using Kind = Quantity::Kind;
    const auto of = [&](Kind kind, int side, int order) {
        return Quantity{kind, side, order, letter.surface, letter.mode};
    };
    switch (letter.until) {
    case Until::exit_below:
        return of(Kind::margin, -1, 0);
    case Until::exit_above:
        return of(Kind::margin, +1, 0);
    case Until::graze:
        return of(Kind::h, letter.mode, 1);
    case Until::extremum_below:
        return of(Kind::margin, -1, 1);
    case Until::extremum_above:
        return of(Kind::margin, +1, 1);
    default:
        return of(Kind::h, letter.mode, 0);
    }
}

/// What ends a segment of this mode where the next one begins.
inline Until until(int mode, int next, int surface = 0) {
    if (mode_entry(mode, surface) != 0)
        return Until::surface;
    return mode_entry(next, surface) < 0 ? Until::exit_below : Until::exit_above;
}

/// A cycle of letters; letter i is the segment from node i to node i + 1.
struct Word {
    std::vector<Letter> letters;
    int surfaces = 1;

    std::size_t size() const { return letters.size(); }
    const Letter& operator[](std::size_t i) const { return letters[i % letters.size()]; }
    bool operator==(const Word&) const = default;

    /// The word of a cycle of modes.
    /// @param at  surface of the event that begins each of them; empty: the only one
    static Word of(const std::vector<int>& modes, const std::vector<int>& at = {},
                   int surfaces = 1) {
        Word word;
        word.surfaces = surfaces;
        for (std::size_t i = 0; i < modes.size(); ++i) {
            const std::size_t next = (i + 1) % modes.size();
            const int surface = at.empty() ? 0 : at[next];
            word.letters.push_back({modes[i], until(modes[i], modes[next], surface), surface});
        }
        return word;
    }
    /// The modes as characters `-`, `0`, `+`, of several surfaces with a space between them, from
    /// the given node on. A node at which the mode does not change does not show.
    std::string modes(std::size_t from = 0) const {
        std::string text;
        for (std::size_t i = 0; i < size(); ++i) {
            const Letter& letter = (*this)[from + i];
            const bool changes =
                letter.until <= Until::exit_above || (text.empty() && i + 1 == size());
            if (!changes)
                continue;
            if (surfaces > 1 && !text.empty())
                text += ' ';
            text += mode_text(letter.mode, surfaces);
        }
        return text;
    }
    /// Where the canonical reading starts: the smallest of all rotations in the order 0, -, +.
    std::size_t first() const {
        const auto rank = [](char c) { return c == ' ' ? -1 : c == '0' ? 0 : c == '-' ? 1 : 2; };
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
