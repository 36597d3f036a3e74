// SPDX-License-Identifier: BSD-3-Clause
// When a run does nothing new any more: returns to a section that repeat themselves to rounding.
#pragma once

#include <filippov/core/scalar.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace filippov {

/// A return to a section.
template <class S, int N> struct Return {
    long long period = 0; ///< period index
    S t_local{};          ///< time since that period began
    Vec<S, N> x{};
    int tag = 0; ///< what must be equal as well: kind of event, surface, boundary
};

/// Watches returns for a cycle of up to `Longest` of them.
///
/// A cycle of q returns is one in which each of the last max(3 q, 16) returns agrees with the one q
/// before it: same tag, phase within `band` ulp of the period, each component of x within `band`
/// ulp of the largest value it had. What comes after differs then from a repetition by no more than
/// `band` ulp a return, however slowly the run still moves, as long as it contracts. That it does,
/// the run must have shown: the same distance was a thousand times larger before. (A start on an
/// unstable orbit stays there for a while, by rounding's leave, and then departs.)
///
/// @cost  no allocation; `Longest` comparisons a return
template <class S, int N, int Longest = 32> class Repeats {
public:
    static constexpr S band = S(16);  ///< ulp within which returns agree
    static constexpr S far = S(1000); ///< bands from which they must have come together
    static constexpr int least = 16;  ///< returns that must agree

    explicit Repeats(const S& period) : period_(period) {}

    /// Takes the next return.
    /// @return  the length of the cycle in returns, 0 if there is none (yet)
    int add(const Return<S, N>& now) {
        using std::abs;
        largest_ = largest_.cwiseMax(now.x.cwiseAbs());
        int cycle = 0;
        for (int q = 1; q <= Longest && q <= n_; ++q) {
            const bool agrees = compare(now, back(q - 1), q);
            agreed_[at(q)] = agrees ? agreed_[at(q)] + 1 : 0;
            if (cycle == 0 && agreed_[at(q)] >= std::max(3 * q, least) && was_far_[at(q)])
                cycle = q;
        }
        ring_[at(head_ = (head_ + 1) % Longest)] = now;
        n_ = std::min(n_ + 1, Longest);
        return cycle;
    }
    /// The k-th return before the last one, k < Longest.
    const Return<S, N>& back(int k) const { return ring_[at((head_ + Longest - k) % Longest)]; }
    /// Periods that the last q returns took, once they are a cycle.
    long long periods(int q) const { return took_[at(q)]; }

private:
    static std::size_t at(int i) { return static_cast<std::size_t>(i); }

    /// True if two returns, q apart, agree and are as many periods apart as those before them.
    bool compare(const Return<S, N>& now, const Return<S, N>& before, int q) {
        using std::abs;
        const long long took = now.period - before.period;
        const bool comparable = now.tag == before.tag && took > 0;
        const bool same_time = took == took_[at(q)];
        took_[at(q)] = took;
        if (!comparable) {
            was_far_[at(q)] = true;
            return false;
        }
        S distance = abs(now.t_local - before.t_local) / period_;
        for (int i = 0; i < N; ++i)
            if (largest_[i] > S(0))
                distance = std::max(distance, S(abs(now.x[i] - before.x[i]) / largest_[i]));
        if (!(distance <= far * band * epsilon<S>))
            was_far_[at(q)] = true;
        return same_time && distance <= band * epsilon<S>;
    }

    S period_;
    Vec<S, N> largest_ = Vec<S, N>::Zero();
    std::array<Return<S, N>, std::size_t(Longest)> ring_{};
    std::array<int, std::size_t(Longest) + 1> agreed_{};
    std::array<bool, std::size_t(Longest) + 1> was_far_{};
    std::array<long long, std::size_t(Longest) + 1> took_{};
    int n_ = 0, head_ = 0;
};

} // namespace filippov
