// SPDX-License-Identifier: BSD-3-Clause
// The sliding bifurcations of a periodic orbit: where a word ends, why, and which word follows.
#pragma once

#include <filippov/orbits/arclength.hpp>
#include <filippov/orbits/dense.hpp>
#include <filippov/orbits/floquet.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace filippov {

enum class Kind : unsigned char {
    crossing_sliding,
    grazing_sliding,
    switching_sliding,
    adding_sliding,
    fold,
    flip,
    neimark_sacker,
    cusp,
    degenerate_switching_sliding,
    grazing, ///< with no slide: the surface is touched where both sides' fields cross it alike
};

constexpr std::string_view name(Kind kind) {
    constexpr std::array<std::string_view, 10> names{"crossing-sliding",
                                                     "grazing-sliding",
                                                     "switching-sliding",
                                                     "adding-sliding",
                                                     "fold",
                                                     "flip",
                                                     "neimark-sacker",
                                                     "cusp",
                                                     "degenerate-switching-sliding",
                                                     "grazing"};
    return names[static_cast<std::size_t>(kind)];
}

/// True of the four bifurcations in which a slide appears, disappears or is cut.
constexpr bool is_sliding(Kind kind) { return kind <= Kind::adding_sliding; }
/// True of the bifurcations in which a word changes, at one of its nodes.
constexpr bool changes_word(Kind kind) { return is_sliding(kind) || kind == Kind::grazing; }
/// True of those in which a segment touches the surface from its own side.
constexpr bool grazes(Kind kind) { return kind == Kind::grazing_sliding || kind == Kind::grazing; }

/// What may end a word. The value is positive while the word is right, and in units of the orbit:
/// its period, its fastest approach to the surface, and their product.
struct Test {
    enum class What : unsigned char {
        duration, ///< of segment i: negative where a segment would run backwards
        nearest,  ///< interior minimum of segment i: of |h|, or of 1 + s, 1 - s
        far_side, ///< at node i on the surface: the far side's field leads on (crossing) or back
                  ///< (entry)
        arrival,  ///< at node i on the surface: the own side's field leads to it
    };
    What what = What::duration;
    std::size_t i = 0;
    double value = 0;
    Least least{}; ///< of `nearest`
};

namespace detail {

/// A quantity at a node of a cycle.
inline double value_at(const AnySystem& system, const Cycle& c, std::size_t node,
                       const Quantity& q) {
    return system.quantity(q, c.t[node], c.x[node], c.p, {}).value[0];
}
/// The fastest rate of h at the nodes of a cycle. Where a segment ends by a touch it is zero, and
/// what h'' makes of it in a while counts.
inline double fastest_rate(const AnySystem& system, const Cycle& c) {
    const std::size_t n = c.size();
    double fastest = std::numeric_limits<double>::min();
    const auto see = [&](std::size_t i, int side, int order, double unit) {
        const double rate = value_at(system, c, i, {Quantity::Kind::h, side, order}) * unit;
        fastest = std::max(fastest, std::abs(rate));
    };
    for (std::size_t i = 0; i < n; ++i) {
        for (const int side : {-1, 1})
            see(i, side, 1, 1);
        const Letter& ended = c.word[i + n - 1];
        if (ended.until == Until::graze)
            see(i, ended.mode, 2, 0.1 * c.period / c.turns);
    }
    return fastest;
}
/// An interior minimum to full accuracy: Newton on the time at which it is. (What a run shows is
/// the vertex of a parabola.)
inline Least polished(const AnySystem& system, const Cycle& c, std::size_t i, Least least) {
    const int mode = c.word[i].mode;
    const Quantity::Kind kind = mode == 0 ? Quantity::Kind::margin : Quantity::Kind::h;
    Least better = least;
    const auto at = [&](int order) {
        return system.quantity({kind, least.side, order}, better.t, better.x, c.p, {}).value[0];
    };
    for (int k = 0; k < 20; ++k) {
        const Jet arc = system.arc(mode, c.t[i], c.x[i], better.t, c.p, {});
        if (arc.status != Status::ok)
            return least;
        better.x = arc.value;
        const double dt = -at(1) / at(2);
        if (!(std::abs(dt) < c.duration(i)))
            return least;
        better.t += dt;
        if (std::abs(dt) <= 1e-14 * c.period)
            break;
    }
    better.value = (mode == 0 ? 1 : mode) * at(0);
    return better;
}

} // namespace detail

/// All tests of a cycle.
inline std::vector<Test> tests_of(const AnySystem& system, const Cycle& c) {
    std::vector<Test> all;
    const std::size_t n = c.size();
    const double fastest = detail::fastest_rate(system, c);
    for (std::size_t i = 0; i < n; ++i) {
        const Letter& letter = c.word[i];
        const double duration = c.duration(i);
        if (n > 1 || letter.until != Until::phase)
            all.push_back({Test::What::duration, i, duration / c.period, {}});
        if (duration > 0)
            for (Least least : system.minima(letter.mode, c.t[i], c.x[i], c.end(i), c.p)) {
                const double unit = letter.mode == 0 ? 1.0 : fastest * c.period / c.turns;
                if (least.value < 1e-3 * unit)
                    least = detail::polished(system, c, i, least);
                all.push_back({Test::What::nearest, i, least.value / unit, least});
            }
        if (letter.mode == 0 || letter.until != Until::surface)
            continue;
        const std::size_t node = (i + 1) % n;
        const int own = letter.mode, after = c.word[node].mode;
        const auto rate = [&](int side) {
            return detail::value_at(system, c, node, {Quantity::Kind::h, side, 1}) / fastest;
        };
        all.push_back({Test::What::arrival, node, -own * rate(own), {}});
        const double far = rate(-own);
        all.push_back({Test::What::far_side, node, after == 0 ? own * far : -own * far, {}});
    }
    return all;
}

/// The tests behind the others: a segment that vanishes fails those at its ends and makes minima
/// beside them, and a contact where the far side turns round fails the next segment's. Several if
/// they have nothing to do with each other, as in the halves of a symmetric orbit.
inline std::vector<Test> causes_of(std::vector<Test> failed, const Cycle& c) {
    const auto rank = [](const Test& test) {
        return test.what == Test::What::duration   ? 0
               : test.what == Test::What::far_side ? 1
               : test.what == Test::What::arrival  ? 2
                                                   : 3;
    };
    // what is no number has failed worst
    const auto value = [](const Test& test) {
        return std::isnan(test.value) ? -std::numeric_limits<double>::infinity() : test.value;
    };
    std::stable_sort(failed.begin(), failed.end(), [&](const Test& a, const Test& b) {
        return rank(a) != rank(b) ? rank(a) < rank(b) : value(a) < value(b);
    });
    // by node: where a segment starts, or the node itself
    const std::size_t n = c.size();
    const auto apart = [&](const Test& test, const Test& cause) {
        if (test.what == Test::What::nearest && cause.what == Test::What::duration) {
            const auto from = [&](double t) {
                return std::abs(std::remainder(test.least.t - t, c.period));
            };
            return std::min(from(c.t[cause.i]), from(c.end(cause.i))) >
                   5 * std::abs(c.duration(cause.i));
        }
        const std::size_t d = (test.i + n - cause.i) % n;
        return std::min(d, n - d) > 1;
    };
    std::vector<Test> causes;
    for (const Test& test : failed)
        if (std::all_of(causes.begin(), causes.end(),
                        [&](const Test& cause) { return apart(test, cause); }))
            causes.push_back(test);
    return causes;
}

/// A bifurcation in which the word changes as equations: a cycle of the word with fewer segments,
/// one node of which satisfies one condition more.
struct SlidingCondition {
    /// Crossing and switching are told apart at the solution, and whether a grazing has a slide.
    Kind kind = Kind::grazing_sliding;
    Cycle cycle; ///< with the node where it happens
    std::size_t node = 0;
    int side = 0; ///< the boundary of the sliding region that is met: s = side

    /// What vanishes at the node besides the condition that ends its segment.
    Quantity vanishes() const {
        using Q = Quantity::Kind;
        if (kind == Kind::adding_sliding)
            return {Q::margin, side, 0};
        return {Q::h, side, grazes(kind) ? 0 : 1};
    }
};

/// The shooting equations and the condition. The shooting has to outlive them.
inline Equations equations_with(const Shooting& shooting, const SlidingCondition& s) {
    return
        [&shooting, node = s.node, vanishes = s.vanishes()](const Vector& z, Vector& F, Matrix& J) {
            const auto e = shooting.evaluate(z);
            if (e.status != Status::ok)
                return false;
            const auto [value, gradient] = shooting.at_node(z, node, vanishes);
            F.resize(e.F.size() + 1);
            J.resize(e.J.rows() + 1, e.J.cols());
            F << e.F, value;
            J << e.J, gradient.transpose();
            return true;
        };
}

namespace detail {

/// Times such that the first node lies in the first period (forced) or at 0 (autonomous).
inline void normalize(const AnySystem& system, Cycle& c) {
    const double T = c.period / c.turns;
    const double shift = system.forced() ? T * std::floor(c.t[0] / T) : c.t[0];
    for (double& t : c.t)
        t -= shift;
}
inline void insert(Cycle& c, std::size_t i, const Letter& letter, double t, const Vector& x) {
    // segment i becomes (mode of `letter` until its end) and the rest
    c.word.letters.insert(c.word.letters.begin() + std::ptrdiff_t(i), letter);
    c.t.insert(c.t.begin() + std::ptrdiff_t(i) + 1, t);
    c.x.insert(c.x.begin() + std::ptrdiff_t(i) + 1, x);
}
/// Erases the first letter and the node that ends it.
inline void erase_first(Cycle& c) {
    const std::size_t next = 1 % c.size();
    c.word.letters.erase(c.word.letters.begin());
    c.t.erase(c.t.begin() + std::ptrdiff_t(next));
    c.x.erase(c.x.begin() + std::ptrdiff_t(next));
}
inline Until extremum(int side) { return side < 0 ? Until::extremum_below : Until::extremum_above; }

} // namespace detail

/// The condition behind a failed test; none if the word cannot change into another there.
inline std::optional<SlidingCondition> condition_of(const Cycle& c, const Test& test) {
    SlidingCondition s;
    const std::size_t n = c.size();
    if (test.what == Test::What::nearest) {
        const int mode = c.word[test.i].mode;
        s.cycle = c;
        s.side = test.least.side;
        const Letter letter{mode, mode == 0 ? detail::extremum(s.side) : Until::graze};
        if (c.word[test.i].until == Until::phase) {
            // the only node of an orbit without events: this is one
            s.cycle.word.letters = {letter};
            s.cycle.t = {test.least.t};
            s.cycle.x = {test.least.x};
        } else {
            s.node = (test.i + 1) % (n + 1);
            detail::insert(s.cycle, test.i, letter, test.least.t, test.least.x);
        }
        s.kind = mode == 0 ? Kind::adding_sliding : Kind::grazing_sliding;
        return s;
    }
    if (test.what == Test::What::far_side) {
        s.cycle = c;
        s.node = test.i;
        s.side = -c.word[test.i + n - 1].mode;
        s.kind = c.word[test.i].mode == 0 ? Kind::switching_sliding : Kind::crossing_sliding;
        return s;
    }
    if (test.what == Test::What::duration && n > 1) {
        // The word without the vanishing segment, whose ends become one node, the first.
        s.cycle = detail::rotated(c, test.i);
        const int before = c.word[test.i + n - 1].mode, mode = c.word[test.i].mode,
                  after = c.word[test.i + 1].mode;
        const double middle = (s.cycle.t[0] + s.cycle.t[1]) / 2;
        const Vector x = (s.cycle.x[0] + s.cycle.x[1]) / 2;
        detail::erase_first(s.cycle);
        s.cycle.t[0] = middle;
        s.cycle.x[0] = x;
        s.node = 0;
        Letter& last = s.cycle.word.letters.back();
        if (mode == 0 && before == after) {
            s.kind = Kind::grazing_sliding;
            s.side = before;
            last.until = Until::graze;
        } else if (mode == 0) {
            s.kind = Kind::crossing_sliding;
            s.side = after;
        } else if (before == -mode && after == -mode) {
            s.kind = Kind::grazing;
            s.side = before;
            last.until = Until::graze;
        } else if (before == 0 && after == 0) {
            s.kind = Kind::adding_sliding;
            s.side = mode;
            last.until = detail::extremum(mode);
        } else if (before == -mode && after == 0) {
            s.kind = Kind::switching_sliding;
            s.side = mode;
        } else {
            return std::nullopt;
        }
        return s;
    }
    return std::nullopt;
}

/// The cycle with the bifurcating node taken out where it is no event: the word with fewer
/// segments.
inline Cycle parent_of(const SlidingCondition& s) {
    Cycle c = s.cycle;
    const std::size_t n = c.size();
    const std::size_t i = (s.node + n - 1) % n; // the segment that ends at the node
    const Until end = c.word[i].until;
    if (end != Until::graze && end != Until::extremum_below && end != Until::extremum_above)
        return c;
    if (n == 1) {
        c.word.letters[0].until = Until::phase;
        return c;
    }
    c = detail::rotated(c, i);
    detail::erase_first(c);
    return c;
}

/// The cycle with the segment that is born, of no length and the first: the word with more
/// segments.
inline Cycle child_of(const SlidingCondition& s) {
    Cycle c = detail::rotated(s.cycle, s.node); // the node is the first now
    Letter& last = c.word.letters.back();
    Letter segment;
    switch (s.kind) {
    case Kind::grazing_sliding:
    case Kind::crossing_sliding:
        last.until = Until::surface;
        segment = {0, s.side < 0 ? Until::exit_below : Until::exit_above};
        break;
    case Kind::grazing:
        last.until = Until::surface;
        segment = {-s.side, Until::surface};
        break;
    case Kind::adding_sliding:
        last.until = s.side < 0 ? Until::exit_below : Until::exit_above;
        segment = {s.side, Until::surface};
        break;
    default:
        segment = {s.side, Until::surface};
        break;
    }
    detail::insert(c, 0, segment, c.t[0], c.x[0]);
    return c;
}

/// The same bifurcation on another cycle that passes through the same points in the same modes, but
/// for segments of no length.
inline SlidingCondition moved_to(const Cycle& c, const SlidingCondition& s) {
    const bool touches = grazes(s.kind) || s.kind == Kind::adding_sliding;
    const std::size_t n = c.size();
    const int mode = s.cycle.word[s.node + s.cycle.size() - 1].mode;
    Test test{touches ? Test::What::nearest : Test::What::far_side, 0, 0, {}};
    test.least.t = c.t[0] + std::remainder(s.cycle.t[s.node] - c.t[0], c.period);
    if (test.least.t < c.t[0])
        test.least.t += c.period;
    test.least.x = s.cycle.x[s.node];
    test.least.side = s.side;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < n; ++i) {
        // how far from the segment (a touch), or from the node where one of this mode ends
        const double before = c.t[i] - test.least.t, after = test.least.t - c.end(i);
        const double apart = touches ? std::max({0.0, before, after}) : std::abs(after);
        if (c.word[i].mode == mode && apart < least) {
            least = apart;
            test.i = touches ? i : (i + 1) % n;
        }
    }
    return condition_of(c, test).value_or(s);
}

/// Multipliers at a grazing-sliding bifurcation on the side where the orbit slides.
///
/// What is cut off by a slide of vanishing length is, to first order, the height of the neighbour
/// above the surface: its deviation falls onto the surface along f2 - f1.
/// @source di Bernardo, Kowalczyk, Nordmark (2002), Physica D 170, 175-205 (the correction of
///         grazing-sliding is linear)
inline Multipliers floquet_of_grazing_child(const AnySystem& system, const SlidingCondition& s) {
    const Cycle c = detail::rotated(s.cycle, s.node);
    const int d = system.dim(), m = system.forced() ? d + 1 : d;
    const Matrix fall = detail::fall(system, c.t[0], c.x[0], c.p);
    // the node varies in h = 0 and L = 0
    Matrix normals(2, m);
    for (int order = 0; order < 2; ++order)
        normals.row(order) =
            system.quantity({Quantity::Kind::h, s.side, order}, c.t[0], c.x[0], c.p, {})
                .slope.row(0)
                .head(m);
    normals.rowwise().normalize();
    const Matrix all = dense::orthogonal(normals.transpose());
    const Matrix Q = all.rightCols(m - 2);
    Matrix M = Q;
    for (std::size_t i = 0; i < c.size(); ++i) {
        const Jet arc = system.arc(c.word[i].mode, c.t[i], c.x[i], c.end(i), c.p, {});
        M = detail::node_map(system, c, i, arc).topLeftCorner(m, m) * M;
    }
    M.topRows(d) = fall * M.topRows(d);
    // ... and slides to where the slide ends, L = 0
    Vector flow(m);
    flow.head(d) = system.field(s.side, c.t[0], c.x[0], c.p);
    if (system.forced())
        flow[d] = 1;
    const Eigen::RowVectorXd exit = normals.row(1);
    M -= flow * (exit * M / exit.dot(flow));
    return detail::sorted_multipliers(system, Matrix(Q.transpose() * M));
}

/// Multipliers of the orbit with more segments, at the bifurcation: only at a grazing do they
/// differ from those of the other.
inline Multipliers floquet_of_child(const AnySystem& system, const SlidingCondition& s) {
    return s.kind == Kind::grazing_sliding ? floquet_of_grazing_child(system, s)
                                           : floquet(system, parent_of(s));
}

/// What happens to an orbit at a border collision, from its multipliers on either side: by the
/// numbers of real multipliers above 1 (p) and below -1 (n).
///
///   p1 + p2 odd:  "fold": two orbits meet and disappear
///   else "persistence", and if n1 + n2 is odd "persistence and flip"
///
/// and "chaos" where slopes of both sides stretch, and a one-dimensional skew tent map with them
/// has a chaotic attractor. (One side that contracts may have chaos, too; that is not told.)
/// @source Feigin's classification, di Bernardo, Feigin, Hogan, Homer (1999), Chaos, Solitons &
///         Fractals 10, 1881-1908; skew tent map: Nusse & Yorke (1995), Int. J. Bifurcation and
///         Chaos 5, 189-207
inline std::string border_collision(const Multipliers& a, const Multipliers& b) {
    const auto count = [](const auto& multipliers, auto beyond) {
        return std::count_if(multipliers.begin(), multipliers.end(),
                             [&](const auto& m) { return m.imag() == 0 && beyond(m.real()); });
    };
    const auto above = [](double v) { return v > 1; };
    const auto below = [](double v) { return v < -1; };
    std::string text = (count(a, above) + count(b, above)) % 2 == 1 ? "fold" : "persistence";
    if ((count(a, below) + count(b, below)) % 2 == 1)
        text += " and flip";
    // one direction that counts: slopes of the map to both sides of the border
    const double left = std::max(a[0].real(), b[0].real()),
                 right = std::min(a[0].real(), b[0].real());
    const bool one_dimensional = a.size() > 1 && std::abs(a[1]) < 1e-8 && std::abs(b[1]) < 1e-8;
    if (one_dimensional && left > 1 && right < -1 && right > -left / (left - 1))
        text += ", chaos";
    return text;
}

} // namespace filippov
