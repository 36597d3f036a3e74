// SPDX-License-Identifier: BSD-3-Clause
// The first root, or the first touch of zero, of a function on a step.
#pragma once

#include <filippov/core/scalar.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <span>
#include <type_traits>

namespace filippov {

/// A function of one scalar, called through a pointer: the searches are compiled once a scalar, not
/// once a system and mode. What it refers to must outlive it.
template <class S> class Function {
public:
    template <class G>
        requires(!std::same_as<std::remove_cvref_t<G>, Function>)
    Function(G&& g)
        : object_(const_cast<void*>(static_cast<const void*>(std::addressof(g)))),
          call_([](void* object, S theta) {
              return S((*static_cast<std::remove_reference_t<G>*>(object))(theta));
          }) {}
    S operator()(S theta) const { return call_(object_, theta); }

private:
    void* object_;
    S (*call_)(void*, S);
};

/// What `first_contact` found on (0, 1].
enum class Contact : unsigned char {
    none,
    root,    ///< g goes from positive to negative
    touch,   ///< a minimum of g within the touch band
    blurred, ///< g swings too fast near zero for the smallest pieces
};

/// A value of a function that is known already.
template <class S> struct KnownValue {
    S theta, value;
};
/// Such values between 0 and 1, in order.
template <class S> struct KnownValues {
    std::span<const KnownValue<S>> at{};
    S far = std::numeric_limits<S>::infinity(); ///< between neighbours beyond it there is no zero
};

/// Where g, positive at `positive` and not positive (or NaN) at `negative`, changes sign, to about
/// six digits: a landing starts from it. Illinois' variant of regula falsi, with bisection when the
/// bracket does not shrink; at most 100 evaluations.
template <class S>
S bracketed_root(Function<std::type_identity_t<S>> g, S positive, S g_positive, S negative,
                 S g_negative) {
    using std::abs;
    int kept = 0; // which end the last step kept
    for (int k = 0; k < 100; ++k) {
        const S width = negative - positive;
        if (!(abs(width) > S(1e-6) * std::max(abs(negative), abs(positive))))
            break;
        S theta = positive + width * (g_positive / (g_positive - g_negative));
        const bool inside =
            abs(theta - positive) < abs(width) && abs(negative - theta) < abs(width);
        if (!inside || k % 4 == 3)
            theta = positive + width / S(2);
        const S value = g(theta);
        if (value > S(0)) {
            positive = theta;
            g_positive = value;
            if (kept == 1)
                g_negative /= S(2);
            kept = 1;
        } else {
            negative = theta;
            g_negative = value;
            if (value == S(0))
                break;
            if (kept == -1)
                g_positive /= S(2);
            kept = -1;
        }
    }
    return negative;
}

/// Where g has its minimum on [a, b], by golden section; precise enough to start a Newton iteration
/// on the derivative from.
template <class S> S minimum(Function<std::type_identity_t<S>> g, S a, S b) {
    const S ratio = static_cast<S>(0.381966011250105152L);
    S u = a + ratio * (b - a), v = b - ratio * (b - a);
    S gu = g(u), gv = g(v);
    for (int k = 0; k < 40; ++k) {
        if (gu < gv) {
            b = v;
            v = u;
            gv = gu;
            u = a + ratio * (b - a);
            gu = g(u);
        } else {
            a = u;
            u = v;
            gu = gv;
            v = b - ratio * (b - a);
            gv = g(v);
        }
    }
    return gu < gv ? u : v;
}

namespace detail {

/// The weights by which values at 0, 1/3, 2/3 and 1 make the value of their cubic at u.
template <class S> constexpr std::array<S, 4> cubic_weights(long double u) {
    const long double v = 3 * u - 1, w = 3 * u - 2, z = u - 1;
    return {static_cast<S>(-v * w * z / 2), static_cast<S>(4.5L * u * w * z),
            static_cast<S>(-4.5L * u * v * z), static_cast<S>(u * v * w / 2)};
}

/// A cubic through four equidistant samples of g on [a, b], with two more to judge it by, which
/// keep no beat with them.
template <class S> struct Piece {
    S a, b, ga, gb, g1, g2;
    S mismatch; ///< largest error of the cubic at the two
    S lowest, highest;

    Piece(Function<S> g, S from, S to, S g_from, S g_to) : a(from), b(to), ga(g_from), gb(g_to) {
        using std::abs;
        const S d = b - a;
        g1 = g(a + d / S(3));
        g2 = g(a + d * S(2) / S(3));
        constexpr long double u1 = 0.1583L, u2 = 0.8178L;
        constexpr std::array<S, 4> w1 = cubic_weights<S>(u1), w2 = cubic_weights<S>(u2);
        const S c1 = g(a + d * static_cast<S>(u1)), c2 = g(a + d * static_cast<S>(u2));
        const S p1 = w1[0] * ga + w1[1] * g1 + w1[2] * g2 + w1[3] * gb;
        const S p2 = w2[0] * ga + w2[1] * g1 + w2[2] * g2 + w2[3] * gb;
        mismatch = std::max(abs(c1 - p1), abs(c2 - p2));
        if (!(abs(c1 - p1) + abs(c2 - p2) < std::numeric_limits<S>::infinity()))
            mismatch = std::numeric_limits<S>::infinity();
        lowest = std::min({ga, gb, g1, g2, c1, c2});
        highest = std::max({ga, gb, g1, g2, c1, c2});
    }
    /// Bernstein coefficients of the cubic: it lies between the smallest and the largest.
    std::array<S, 4> bernstein() const {
        return {ga, (-S(5) * ga + S(18) * g1 - S(9) * g2 + S(2) * gb) / S(6),
                (S(2) * ga - S(9) * g1 + S(18) * g2 - S(5) * gb) / S(6), gb};
    }
    /// Abscissa of the cubic's interior minimum, or -1.
    S cubic_minimum() const {
        using std::abs;
        using std::sqrt;
        const auto c = bernstein();
        const S d0 = c[1] - c[0], d1 = c[2] - c[1], d2 = c[3] - c[2]; // derivative / 3, Bernstein
        const S qa = d0 - S(2) * d1 + d2, qb = d1 - d0, qc = d0;      // qa u^2 + 2 qb u + qc
        const S disc = qb * qb - qa * qc;
        if (!(disc > S(0)))
            return S(-1);
        // of the two critical points the minimum is where the derivative rises
        const S root = sqrt(disc);
        const S u = qb > S(0) ? -qc / (qb + root) : (qa != S(0) ? (root - qb) / qa : S(-1));
        return u > S(0) && u < S(1) ? a + u * (b - a) : S(-1);
    }
};

} // namespace detail

/// True where g, positive before, follows a cubic on its way to a root at u, with no other root: up
/// close, and closer. (A swing that makes three roots of one falls no less than g does in the
/// meantime.)
/// @tparam S  a number, or lanes of them
template <class S, class F> auto falls_smoothly(const S& u, const F& g) {
    using std::abs;
    using std::max;
    using std::min;
    using R = Real<S>;
    constexpr long double u1 = 0.1583L, u2 = 0.8178L;
    constexpr auto w1 = detail::cubic_weights<R>(u1), w2 = detail::cubic_weights<R>(u2);
    auto smooth = u == u;
    for (const R part : {R(1) / R(16), R(1) / R(256)}) {
        const S width = S(part) * u, from = u - width;
        const auto at = [&](long double place) {
            return S(g(S(fused(S(static_cast<R>(place)), width, from))));
        };
        const S a = g(from), b = at(1.0L / 3), c = at(2.0L / 3), d = at(u1), e = at(u2);
        const S off =
            max(S(abs(S(d - fused(S(w1[0]), a, S(fused(S(w1[1]), b, S(S(w1[2]) * c))))))),
                S(abs(S(e - fused(S(w2[0]), a, S(fused(S(w2[1]), b, S(S(w2[2]) * c))))))));
        // (as Bernstein coefficients, times 6)
        const S second = fused(S(-5), a, S(S(18) * b - S(9) * c)),
                third = fused(S(2), a, S(S(18) * c - S(9) * b));
        const S high = max(max(a, max(b, c)), max(d, e)), low = min(min(b, c), min(d, e));
        const S little = S(0.01) * (high - min(low, S(0))); // (a triple root has none)
        smooth = smooth & (a > S(0)) & (min(second, third) > S(-6) * little) & (off <= little) &
                 ((d + e) * S(0) == S(0)); // (maxima pass over NaN)
        if (!any(smooth))
            break;
    }
    return smooth;
}

/// The first point of (0, 1] where g, positive before, becomes negative, or has a minimum with
/// |g| <= band.
///
/// g is cut into pieces on which a cubic through four samples predicts two more; a piece whose
/// Bernstein coefficients are positive beyond the prediction error is passed over; elsewhere the
/// pieces between extrema are bracketed. Functions that no cubic fits (kinks, jumps) end in
/// bisection at the smallest piece, 1/1024; where many of those are left in doubt, or pieces are
/// too many, the search gives up.
///
/// @param g0      g(0), > 0 (a value of the right sign if g(0) itself was divided out)
/// @param band    minima within it count as touches; 0 for none
/// @param theta   where
/// @param known   no piece spans two gaps of these
/// @param patient  it goes on to the end, however little it sees
template <class S>
Contact first_contact(Function<std::type_identity_t<S>> g, S g0, std::type_identity_t<S> band,
                      S& theta, const KnownValues<std::type_identity_t<S>>& known = {},
                      bool patient = true) {
    using std::abs;
    constexpr int max_depth = 10, most_blurred = 16, most_pieces = 2000;
    struct Span {
        S a, b, ga, gb;
        int depth;
    };
    // the piece in hand, those that wait behind it, and the gaps between known values behind those
    std::array<Span, max_depth + 2> stack;
    std::array<S, max_depth + 1> beside{}; // mismatch of the last piece of that size
    int top = -1, blurred = 0, pieces = 0;
    std::size_t gap = 0;
    const auto end_of_gap = [&](std::size_t i) {
        return i < known.at.size() ? known.at[i] : KnownValue<S>{S(1), g(S(1))};
    };
    int depth = 0; // of the pieces between known values
    for (std::size_t n = 1; n < known.at.size() + 1; n *= 2)
        ++depth;
    KnownValue<S> from_here{S(0), g0};
    while (top >= 0 || gap <= known.at.size()) {
        if (top < 0) {
            const KnownValue<S> from = from_here, to = end_of_gap(gap++);
            from_here = to;
            if (from.value > known.far + band && to.value > known.far + band)
                continue;
            stack[std::size_t(++top)] = {from.theta, to.theta, from.value, to.value, depth};
        }
        if (++pieces > most_pieces && !patient)
            return Contact::blurred;
        const Span span = stack[std::size_t(top--)];
        detail::Piece<S> piece(g, span.a, span.b, span.ga, span.gb);
        // Both of its tests may lie on the cubic by chance: not those of its neighbour, too.
        std::swap(piece.mismatch, beside[std::size_t(span.depth)]);
        piece.mismatch = std::max(beside[std::size_t(span.depth)], piece.mismatch / S(4));
        const auto c = piece.bernstein();
        const S floor = std::min({c[0], c[1], c[2], c[3]});
        // A cubic that fits badly may be one of many swings: what it predicts counts only at a
        // distance.
        const bool trusted =
            piece.mismatch <= S(0.1) * (piece.highest - piece.lowest) || span.depth >= max_depth;
        if (floor > S(trusted ? 2 : 8) * piece.mismatch + band)
            continue;
        const bool resolved = piece.mismatch <= S(0.05) * (piece.highest - piece.lowest);
        const S slack = S(2) * piece.mismatch, range = piece.highest - piece.lowest;
        if (span.depth >= max_depth && !resolved && !(floor > S(8) * piece.mismatch) &&
            ++blurred > most_blurred && !patient)
            return Contact::blurred;
        const auto changes = [&](const S& shift) { // of sign, in the Bernstein coefficients
            const bool p1 = c[1] + shift > S(0), p2 = c[2] + shift > S(0), p3 = span.gb > S(0);
            return int(!p1) + int(p1 != p2) + int(p2 != p3);
        };
        const bool down = !(span.gb > S(0));
        if (down && piece.mismatch <= S(0.01) * range && changes(slack) == 1 &&
            changes(-slack) == 1) {
            theta = bracketed_root<S>(g, span.a, span.ga, span.b, span.gb);
            return Contact::root;
        }
        bool splits = !resolved || down || piece.mismatch > S(1e-3) * range;
        S low(-1), g_low(0);
        if (!splits || span.depth >= max_depth) {
            low = piece.cubic_minimum();
            g_low = low >= S(0) ? g(low) : std::min(span.a > S(0) ? span.ga : span.gb, span.gb);
            // What a small swing on top of the cubic hides so near to zero, smaller pieces show.
            splits = splits || (slack > band && g_low >= -slack && g_low <= S(2) * slack);
        }
        if (splits && span.depth < max_depth) {
            const S m = (span.a + span.b) / S(2);
            const S gm = g(m);
            stack[std::size_t(++top)] = {m, span.b, gm, span.gb, span.depth + 1};
            stack[std::size_t(++top)] = {span.a, m, span.ga, gm, span.depth + 1};
            continue;
        }
        // Candidates for a minimum: inside, or at the end towards the next piece.
        S from = span.a, g_from = span.ga;
        const S third = (span.b - span.a) / S(3);
        if (low < S(0) && band > S(0)) {
            if (abs(span.gb) <= band && span.b < S(1)) {
                low = span.b;
                g_low = span.gb;
            }
        }
        if (low >= S(0)) {
            // The first of several roots: between the piece's start and the cubic's minimum there
            // is one.
            if (low > span.a && g_low < -band) {
                theta = bracketed_root(g, span.a, span.ga, low, g_low);
                return Contact::root;
            }
            // worth refining only if the true minimum could reach the band or zero
            if (g_low <= S(4) * piece.mismatch + S(2) * band || g_low <= S(0)) {
                const S left = std::max(S(0), low - third), right = std::min(S(1), low + third);
                low = minimum(g, left, right);
                const S deepest = g(low);
                // an end of the interval is no minimum: g merely passes through the band there (and
                // rounding makes some beside it)
                const bool interior = low - left > S(1e-3) * third && right - low > S(1e-3) * third;
                if (interior && band > S(0) && abs(deepest) <= band) {
                    theta = low;
                    return Contact::touch;
                }
                if (!(deepest >= S(0)) && low > span.a) {
                    theta = bracketed_root(g, span.a, span.ga, low, deepest);
                    return Contact::root;
                }
                if (low > span.a && low < span.b && deepest > S(0)) {
                    from = low;
                    g_from = deepest;
                }
            }
        }
        if (!(span.gb > S(0))) {
            theta = bracketed_root(g, from, g_from, span.b, span.gb);
            return Contact::root;
        }
    }
    return Contact::none;
}

} // namespace filippov
