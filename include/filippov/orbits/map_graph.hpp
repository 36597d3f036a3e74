// SPDX-License-Identifier: BSD-3-Clause
// The graph of a transition map's iterate: where it breaks, and its fixed points.
#pragma once

#include <filippov/orbits/maps.hpp>

namespace filippov {

namespace detail {

/// A difference of phases, the shorter way round.
inline double around(double phase) { return std::remainder(phase, TransitionMap::turn); }
inline std::size_t circle(int boundary) { return boundary < 0 ? 0 : 1; }
inline bool before(const Transition& a, const Transition& b) {
    return a.boundary != b.boundary ? a.boundary < b.boundary : a.phase < b.phase;
}

} // namespace detail

/// A point of the graph.
struct MapSample {
    Transition at;
    Image image;

    /// How far the phase moves, in turns and all: continuous wherever the map is, and a multiple
    /// of 2 pi at a fixed point.
    double advance() const {
        return image.to.phase + TransitionMap::turn * double(image.turns) - at.phase;
    }
    bool closes() const { return image.ok() && image.to.boundary == at.boundary; }
};

/// Neighbours between which the map is not smooth.
struct MapBreak {
    MapSample left, right; ///< as near to each other as `GraphSettings::resolution`
    /// Between the values of both sides, at most pi; infinite where one is not defined or they lie
    /// on different boundaries; about 0 where only the slope jumps.
    double gap() const {
        if (!left.image.ok() || !right.image.ok() ||
            left.image.to.boundary != right.image.to.boundary)
            return std::numeric_limits<double>::infinity();
        const double d = left.image.to.phase - right.image.to.phase;
        return std::abs(detail::around(d));
    }
    /// Above what a root's singularity makes over the resolution.
    bool jump() const { return gap() > 1e-5; }
};

/// A point of a periodic orbit: P^iterate leads back to it.
struct FixedPoint {
    Transition at;
    double slope = 0; ///< of P^iterate: the multiplier of the orbit that is not 0
    int iterate = 1;
    int prime = 1;        ///< the least number of iterates that leads back
    long long turns = 0;  ///< forcing periods of P^iterate
    bool tangent = false; ///< a double root: a fold, to rounding
    bool stable() const { return std::abs(slope) < 1; }
};

/// The graph of P_trans^iterate on both circles.
struct MapGraph {
    int iterate = 1;
    std::vector<MapSample> samples; ///< by boundary, then by phase
    std::vector<MapBreak> breaks;
    std::vector<FixedPoint> fixed_points;
    Status status = Status::ok;
    std::string message = "The graph is complete.";
    long long evaluations = 0; ///< of the iterate
};

/// How closely a graph is looked at.
struct GraphSettings {
    int samples = 512;         ///< at first, on either circle; what is finer can be missed
    double tolerance = 1e-6;   ///< between the graph and the cubics through its samples
    double resolution = 1e-13; ///< of breaks, in phase
    /// One that passes more than a few modes counts as several: a solution that does not stick
    /// again is followed for `max_periods`.
    long long max_evaluations = 500'000;
    /// May be empty. Called after each of the first intervals, of which there are 2 `samples`.
    std::function<void(std::size_t done, std::size_t total)> progress{};
};

/// Samples the iterate of a map until cubics describe it.
class MapSampler {
public:
    MapSampler(const TransitionMap& map, int iterate, const GraphSettings& settings = {})
        : map_(&map), settings_(settings) {
        detail::require_positive("iterate", iterate);
        if (!(settings.samples >= 8))
            detail::refuse("samples", settings.samples, "expected an integer >= 8");
        if (!(settings.tolerance > 0))
            detail::refuse("tolerance", settings.tolerance, "expected a number > 0");
        if (!(settings.resolution >= 1e-15))
            detail::refuse("resolution", settings.resolution, "expected a number >= 1e-15");
        detail::require_positive("max_evaluations", settings.max_evaluations);
        graph_.iterate = iterate;
    }

    MapGraph run() {
        for (const int boundary : {-1, 1})
            if (graph_.status == Status::ok)
                sample_circle(boundary);
        if (graph_.status == Status::ok)
            explain_if_nowhere_defined();
        return std::move(graph_);
    }

private:
    struct Piece {
        MapSample a, b;
        double width() const { return b.at.phase - a.at.phase; }
    };
    /// The cubic of `advance` over a piece, u in [0, 1].
    struct Cubic {
        double a, b, sa, sb; ///< values, and slopes times width

        double operator()(double u) const {
            const double v = 1 - u;
            return v * v * ((1 + 2 * u) * a + u * sa) + u * u * ((1 + 2 * v) * b - v * sb);
        }
        double slope(double u) const {
            const double v = 1 - u;
            return 6 * u * v * (b - a) + v * (1 - 3 * u) * sa + u * (1 - 3 * v) * sb;
        }
        /// Where the slope vanishes, also a little outside the piece.
        std::vector<double> extrema() const {
            const double c0 = sa, c1 = 6 * (b - a) - 4 * sa - 2 * sb,
                         c2 = 3 * (sa + sb + 2 * a - 2 * b);
            const double discriminant = c1 * c1 - 4 * c0 * c2;
            std::vector<double> found;
            if (!(discriminant >= 0))
                return found;
            const double q = -(c1 + std::copysign(std::sqrt(discriminant), c1)) / 2;
            for (const double u : {q / c2, c0 / q})
                if (u > -outside && u < 1 + outside)
                    found.push_back(u);
            std::sort(found.begin(), found.end());
            return found;
        }
        static constexpr double outside = 0.1;
    };
    static Cubic cubic(const Piece& piece) {
        const double a = piece.a.advance(), b = piece.b.advance(), w = piece.width();
        // Without a slope (at a tangency) that of the chord.
        const auto rise = [&](const MapSample& s) {
            return s.image.singular ? b - a : w * (s.image.slope - 1);
        };
        return {a, b, rise(piece.a), rise(piece.b)};
    }

    MapSample sample(int boundary, double phase) {
        ++graph_.evaluations;
        MapSample s{{boundary, phase}, (*map_)({boundary, phase}, graph_.iterate)};
        const auto modes = static_cast<long long>(s.image.word.size());
        spent_ += std::max(1LL, modes / (ordinary * graph_.iterate));
        if (s.image.status == Status::interrupted)
            fail(Status::interrupted, std::string(message(Status::interrupted)));
        else if (spent_ > settings_.max_evaluations)
            fail(Status::max_steps, "max_evaluations was used up; breaks and fixed points may be "
                                    "missing.");
        return s;
    }
    void fail(Status status, std::string why) {
        if (graph_.status != Status::ok) // the first failure wins
            return;
        graph_.status = status;
        graph_.message = std::move(why);
    }
    /// The same solution continued: neighbours with different words have a break between them.
    static bool alike(const MapSample& a, const MapSample& b) {
        if (!a.image.ok() || !b.image.ok())
            return a.image.status == b.image.status;
        return a.image.to.boundary == b.image.to.boundary && a.image.word == b.image.word;
    }

    void sample_circle(int boundary) {
        const int n = settings_.samples;
        const MapSample first = sample(boundary, 0);
        MapSample last = first;
        for (int k = 1; k <= n && graph_.status == Status::ok; ++k) {
            MapSample next = first;
            if (k < n)
                next = sample(boundary, TransitionMap::turn * k / n);
            else
                close(next);
            refine({last, next});
            last = next;
            if (settings_.progress)
                settings_.progress(std::size_t(boundary < 0 ? k : n + k), 2 * std::size_t(n));
        }
    }
    /// The first point of a circle as its last: a turn on, so a turn less to go.
    static void close(MapSample& s) {
        s.at.phase = TransitionMap::turn;
        ++s.image.turns;
    }

    void refine(const Piece& whole) {
        std::vector<Piece> left{whole}; // of a depth bounded by the resolution
        while (!left.empty() && graph_.status == Status::ok) {
            const Piece piece = left.back();
            left.pop_back();
            const double phase = piece.a.at.phase + piece.width() / 2;
            if (!(piece.width() > settings_.resolution) || phase <= piece.a.at.phase ||
                phase >= piece.b.at.phase) {
                broken(piece);
                continue;
            }
            const MapSample middle = sample(piece.a.at.boundary, phase);
            if (resolved(piece, middle)) {
                accept({piece.a, middle});
                accept({middle, piece.b});
            } else {
                left.push_back({middle, piece.b});
                left.push_back({piece.a, middle});
            }
        }
    }
    bool resolved(const Piece& piece, const MapSample& middle) const {
        if (!alike(piece.a, middle) || !alike(middle, piece.b))
            return false;
        if (!middle.image.ok())
            return true;
        const Cubic c = cubic(piece);
        const double w = piece.width();
        return std::abs(middle.advance() - c(0.5)) <= settings_.tolerance &&
               (middle.image.singular ||
                std::abs(w * (middle.image.slope - 1) - c.slope(0.5)) <= 16 * settings_.tolerance);
    }
    void broken(const Piece& piece) {
        graph_.samples.push_back(piece.a);
        const MapBreak b{piece.a, piece.b};
        // Two intervals side by side are one break.
        if (!graph_.breaks.empty() && meet(graph_.breaks.back().right, piece.a))
            graph_.breaks.back().right = piece.b;
        else
            graph_.breaks.push_back(b);
        if (!piece.a.closes() || !piece.b.closes() || b.jump())
            return;
        // A root within the resolution of a corner.
        const double f0 = detail::around(piece.a.advance()), f1 = detail::around(piece.b.advance());
        if (f0 * f1 < 0 && std::abs(f0 - f1) < std::numbers::pi) // else it passes half a turn
            keep(std::abs(f0) < std::abs(f1) ? piece.a : piece.b, false);
    }
    static bool meet(const MapSample& a, const MapSample& b) {
        return a.at.boundary == b.at.boundary && a.at.phase == b.at.phase;
    }
    void accept(const Piece& piece) {
        graph_.samples.push_back(piece.a);
        if (piece.a.closes())
            find_roots(piece);
    }

    // --- fixed points: advance = 2 pi n --------------------------------------------------------

    void find_roots(const Piece& piece) {
        const Cubic c = cubic(piece);
        const std::vector<double> extrema = c.extrema();
        double low = std::min(c.a, c.b), high = std::max(c.a, c.b);
        for (const double u : extrema) {
            low = std::min(low, c(u));
            high = std::max(high, c(u));
        }
        const double margin = 8 * settings_.tolerance, turn = TransitionMap::turn;
        // slopes beyond all bounds: no graph of a map; or whole turns that cannot be counted
        if (!(high - low < 1000 * turn && std::abs(low) < 1e12))
            return;
        const double first = std::ceil((low - margin) / turn);
        const double last = std::floor((high + margin) / turn);
        for (double n = first; n <= last && graph_.status == Status::ok; ++n)
            find_roots(piece, c, extrema, n * turn, margin);
    }
    void find_roots(const Piece& piece, const Cubic& c, const std::vector<double>& extrema,
                    double target, double margin) {
        std::vector<MapSample> ends{piece.a};
        for (const double u : extrema) {
            const bool near = std::abs(c(u) - target) <= margin;
            if (near)
                ends.push_back(extremum(piece, u, target));
            else if (u > 0 && u < 1)
                ends.push_back(sample(piece.a.at.boundary, piece.a.at.phase + u * piece.width()));
        }
        ends.push_back(piece.b);
        for (std::size_t k = 0; k + 1 < ends.size(); ++k) {
            const double f0 = ends[k].advance() - target, f1 = ends[k + 1].advance() - target;
            if (f0 == 0)
                keep(ends[k], false);
            else if (f0 * f1 < 0)
                solve(ends[k], ends[k + 1], target);
        }
    }
    /// The extremum of `advance` near u, by bisection of slope - 1; a double root if it is on the
    /// target to rounding.
    MapSample extremum(const Piece& piece, double u, double target) {
        const auto at = [&](double v) {
            return sample(piece.a.at.boundary, piece.a.at.phase + v * piece.width());
        };
        const double reach = 2 * Cubic::outside;
        MapSample a = at(u - reach), b = at(u + reach), middle = at(u);
        const bool rises = a.image.slope < 1;
        for (int k = 0; k < 60 && graph_.status == Status::ok; ++k) {
            ((middle.image.slope < 1) == rises ? a : b) = middle;
            const double phase = (a.at.phase + b.at.phase) / 2;
            if (!(phase > a.at.phase && phase < b.at.phase))
                break;
            middle = sample(a.at.boundary, phase);
        }
        if (std::abs(middle.image.slope - 1) < 1e-3 && std::abs(middle.advance() - target) <= 1e-11)
            keep(middle, true);
        return middle;
    }
    /// Newton, safeguarded by bisection.
    void solve(MapSample a, MapSample b, double target) {
        const bool falls = a.advance() > target;
        MapSample best = std::abs(a.advance() - target) < std::abs(b.advance() - target) ? a : b;
        for (int k = 0; k < 100 && graph_.status == Status::ok; ++k) {
            const double f = best.advance() - target;
            if (std::abs(f) <= 1e-14)
                break;
            double phase = best.at.phase - f / (best.image.slope - 1);
            const double low = std::min(a.at.phase, b.at.phase);
            const double high = std::max(a.at.phase, b.at.phase);
            if (!(phase > low && phase < high) || k % 8 == 7)
                phase = low + (high - low) / 2;
            if (phase == best.at.phase || !(phase > low && phase < high))
                break;
            const MapSample next = sample(a.at.boundary, phase);
            if (!alike(next, a))
                return; // a break in a piece that looked smooth
            ((next.advance() > target) == falls ? a : b) = next;
            const bool stalled = std::abs(next.advance() - target) >= std::abs(f);
            if (!stalled || k % 8 == 7)
                best = next;
            else if (std::abs(f) <= 1e-12)
                break;
            else
                best = next;
        }
        if (std::abs(best.advance() - target) <= 1e-9)
            keep(best, false);
    }
    static constexpr std::size_t most_fixed_points = 1000;
    /// A phase from which the map starts with a slide is no image: no orbit passes it.
    void keep(const MapSample& s, bool tangent) {
        if (!s.image.true_exit || !s.closes())
            return;
        if (map_->interrupted())
            return fail(Status::interrupted, std::string(message(Status::interrupted)));
        FixedPoint point;
        point.at = {s.at.boundary, TransitionMap::wrapped(s.at.phase)};
        point.slope = s.image.slope;
        point.iterate = graph_.iterate;
        point.tangent = tangent;
        point.turns = std::llround(s.advance() / TransitionMap::turn);
        for (const FixedPoint& other : graph_.fixed_points)
            if (same(point.at, other.at, 1e-9) && (point.slope < 1) == (other.slope < 1))
                return;
        if (graph_.fixed_points.size() == most_fixed_points)
            return fail(Status::ambiguous, "every phase of a stretch is a fixed point, it seems: "
                                           "more than a thousand were found.");
        point.prime = prime(point.at);
        graph_.fixed_points.push_back(point);
    }
    static bool same(const Transition& a, const Transition& b, double within) {
        return a.boundary == b.boundary && std::abs(detail::around(a.phase - b.phase)) <= within;
    }
    int prime(const Transition& at) const {
        for (int k = 1; k < graph_.iterate; ++k)
            if (graph_.iterate % k == 0 && same((*map_)(at, k).to, at, 1e-7))
                return k;
        return graph_.iterate;
    }

    /// A slide that starts the map ends somewhere even where no slip is ever followed by a stick.
    void explain_if_nowhere_defined() {
        const MapSample* undefined = nullptr;
        for (const MapSample& s : graph_.samples) {
            if (s.image.ok() && s.image.true_exit)
                return;
            if (!s.image.ok())
                undefined = &s;
        }
        if (undefined != nullptr)
            fail(undefined->image.status,
                 "The map is defined nowhere that a slide ends. " + undefined->image.message);
    }

    static constexpr long long ordinary = 5; ///< modes and a bar of an evaluation that counts once

    const TransitionMap* map_;
    GraphSettings settings_;
    MapGraph graph_;
    long long spent_ = 0; ///< of max_evaluations
};

/// The graph of P_trans^iterate with its breaks and fixed points.
///
/// Samples both circles, halves the intervals whose ends have different words down to the break
/// between them and those that a cubic through values and slopes does not describe, and solves for
/// the fixed points on each piece, double roots included.
inline MapGraph map_graph(const TransitionMap& map, int iterate = 1,
                          const GraphSettings& settings = {}) {
    return MapSampler(map, iterate, settings).run();
}

} // namespace filippov
