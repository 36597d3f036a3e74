// SPDX-License-Identifier: BSD-3-Clause
// Compiled for several instruction sets: the side of the seam on which lanes are.
#include "module.hpp"

#include <algorithm>
#include <utility>

namespace {

using namespace seam;

/// Notes the last event that it is told of.
template <int N> class Note final : public StretchListener<N> {
public:
    explicit Note(Came& came) : came_(came) {}
    void hear(const StretchEvent<N>& e) override {
        ++came_.n_told;
        came_.kind = e.kind;
        came_.surface = e.surface;
        came_.before = e.before;
        came_.after = e.after;
        came_.period_told = e.period;
        came_.t_told = e.t_local;
        std::copy(e.x.begin(), e.x.end(), came_.x_told);
    }

private:
    Came& came_;
};

template <int N> void run(const void* engine, const Sent& sent, Came& came) {
    Stretch<N, n_params> stretch;
    std::copy_n(sent.x, N, stretch.x.begin());
    std::copy_n(sent.p, n_params, stretch.p.begin());
    stretch.t0 = sent.t0;
    stretch.dt = sent.dt;
    stretch.max_steps = sent.max_steps;
    stretch.max_events = sent.max_events;
    stretch.before = sent.before;
    stretch.guard = sent.guard;
    stretch.ends_at_exit = sent.ends_at_exit;
    const Parallel how{.cancelled = [] { return true; }}; // what it asks comes through, too
    Worker worker(how, 1);
    came = {};
    Note<N> note(came);
    const StretchEnd<N> end =
        static_cast<const ScalarEngine<N, n_params>*>(engine)->run(stretch, worker, &note);
    came.status = end.status;
    came.period = end.clock.period;
    came.local = end.clock.local;
    came.carry = end.clock.carry;
    came.slide_time = end.slide_time;
    came.index = end.clock.index;
    came.steps = end.steps;
    came.mode = end.mode;
    came.events = end.events;
    came.slides = end.slides;
    std::copy(end.x.begin(), end.x.end(), came.x);
}

} // namespace

extern "C" {
[[gnu::visibility("default")]] std::size_t seam_alignment() { return alignof(Vec<double, 8>); }

[[gnu::visibility("default")]] bool seam_hand_over(int n, const void* engine, const Sent* sent,
                                                   Came* came) {
    return [&]<int... N>(std::integer_sequence<int, N...>) {
        return ((n == N && (run<N>(engine, *sent, *came), true)) || ...);
    }(std::integer_sequence<int, 1, 2, 3, 4, 5, 6, 7, 8, 9, 16, 32>{});
}

[[gnu::visibility("default")]] void seam_lanes(int n,
                                               const std::shared_ptr<const AnyScalar>* scalar,
                                               std::shared_ptr<const AnyLanes>* lanes) {
    *lanes = n == 4 ? any_lanes(Chain<4>{}, *scalar) : any_lanes(Chain<8>{}, *scalar);
}
}
