// SPDX-License-Identifier: BSD-3-Clause
// z' = a(t) - b sign(z - g(t)), where everything is known: on the surface z = g(t) and
// s = (a - g')/b, off it z is an antiderivative. Events are roots of functions of time.
#pragma once

#include "problem.hpp"
#include "scan.hpp"

namespace filippov::strangers {

/// The relay, and a component y' = c0 + c1 s that looks on.
struct Relay {
    Wave a, g;
    double b = 1, c0 = 0, c1 = 0;

    double pace() const { return std::min(a.pace(), g.pace()); }
};

/// The exact path of a relay.
class RelayPath {
public:
    struct Piece {
        Long t;
        int mode;
        Long z, y;
    };

    /// @param nudge  an error a step, of this pace
    RelayPath(const Relay& relay, Long z, Long y, bool on_surface, Long t, Long t_end, Long nudge,
              Long pace)
        : relay_(relay), way_(t_end < t ? -1 : 1), rate_(nudge / pace), nudge_(nudge) {
        t *= way_;
        t_end *= way_;
        const Long span = t_end - t;
        z = on_surface ? g(t, 0) : z + nudge;
        int mode = on_surface ? next(t, 0) : z > g(t, 0) ? 1 : -1;
        pieces.push_back({t, mode, z, y});
        const Long step = std::min(span / 64, pace);
        while (known && pieces.size() < 2000) {
            const Piece p = pieces.back();
            const Long root = first_root([&](Long at) { return margin(p, at); }, p.t, t_end, step);
            if (!(root <= t_end))
                return;
            // Of a slip that hardly leaves its surface, by a few tolerances, nothing is known; nor
            // of a slide where a slip hardly comes down and leaves again.
            if (pieces.size() > 1)
                known = known && std::abs(p.mode != 0 ? margin(p, p.t + (root - p.t) / 2)
                                                      : margin(pieces[pieces.size() - 2], root)) >=
                                     100 * std::abs(nudge_);
            mode = next(root, p.mode);
            pieces.push_back({root, mode, height(p, root), other(p, root)});
        }
        known = known && pieces.size() < 2000;
    }

    std::vector<Piece> pieces; ///< times as this path counts them: see `time`
    bool known = true;

    Long time(Long t) const { return way_ * t; } ///< both ways
    Long z(Long t) const { return height(piece(t), t); }
    Long y(Long t) const { return other(piece(t), t); }

private:
    // backwards everything is mirrored
    Long a(Long t, int n) const {
        return way_ > 0 ? relay_.a.exact(t, n) : -(n % 2 ? -1 : 1) * relay_.a.exact(-t, n);
    }
    Long g(Long t, int n) const {
        return way_ > 0 ? relay_.g.exact(t, n) : (n % 2 ? -1 : 1) * relay_.g.exact(-t, n);
    }
    Long b() const { return way_ * Long(relay_.b); }

    const Piece& piece(Long t) const {
        std::size_t k = pieces.size();
        while (k > 1 && pieces[k - 1].t > t)
            --k;
        return pieces[k - 1];
    }
    Long height(const Piece& p, Long t) const {
        return p.mode == 0 ? g(t, 0)
                           : p.z + a(t, -1) - a(p.t, -1) + (rate_ - p.mode * b()) * (t - p.t);
    }
    Long other(const Piece& p, Long t) const {
        const Long d = t - p.t;
        const Long s = p.mode != 0
                           ? p.mode * d
                           : (a(t, -1) - a(p.t, -1) - g(t, 0) + g(p.t, 0) + rate_ * d) / b();
        return p.y + way_ * (Long(relay_.c0) * d + Long(relay_.c1) * s) + rate_ * d;
    }
    /// What is positive as long as a piece lasts.
    Long margin(const Piece& p, Long t) const {
        if (p.mode != 0)
            return p.mode * (height(p, t) - g(t, 0));
        // (a dip of s beyond its end that is lower than the tolerance may be a touch)
        return 1 + 20 * nudge_ - std::abs((a(t, 0) + rate_ - g(t, 1)) / b());
    }
    /// The mode after the surface was met, or left.
    int next(Long t, int before) {
        const Long drift = a(t, 0) + rate_ - g(t, 1);
        if (before == 0 && !pieces.empty())
            return drift / b() > 0 ? 1 : -1;
        const Long s = std::abs(drift / b());
        known = known && std::abs(s - 1) > 1e-12L && (b() > 0 || s > 1);
        return s < 1 && b() > 0 ? 0 : drift > 0 ? 1 : -1;
    }

    const Relay& relay_;
    int way_;
    Long rate_, nudge_;
};

} // namespace filippov::strangers
