// SPDX-License-Identifier: BSD-3-Clause
// Which mode goes on from a point where several surfaces meet.
#pragma once

#include <filippov/sliding/intersection.hpp>
#include <filippov/sliding/mode.hpp>

#include <utility>

namespace filippov {

/// A mode free of all surfaces with jumps; it may slide on others.
template <class Sys>
Mode<surfaces_v<Sys>> free_of_jumps(const Sys& sys, Mode<surfaces_v<Sys>> mode) {
    for (int k = 0; k < surfaces_v<Sys>; ++k)
        if (is_kind(sys, k, SurfaceKind::jump))
            mode.set(k, +1);
    return mode;
}
/// h_j' and h_j'' of a surface with jumps where the solution is free of all such surfaces; `mode`
/// may slide on others.
template <class Sys, class S>
std::array<S, 2> free_rates(const Sys& sys, const Mode<surfaces_v<Sys>>& mode, int j, const S& t,
                            const State<Sys, S>& x, const Params<Sys, S>& p) {
    const Mode<surfaces_v<Sys>> free = free_of_jumps(sys, mode);
    const auto field = [&](const auto& time, const auto& y, const auto& q) {
        return mode_field(sys, free, time, y, q);
    };
    const auto h = [&](const auto& time, const auto& y, const auto& q) {
        return switching(sys, time, y, q)[j];
    };
    return lie_derivatives<2>(field, h, t, x, p);
}

/// Where the solution goes from h_j = 0 of a surface with jumps, in the direction of time: +1 away,
/// -1 against it, 0 at rest. At rest is what would fly or fall no higher than rounding of h, or no
/// longer than some units of the last place of t, or moves no faster than the rounding of h_j':
/// where contact ends h_j'' vanishes, and says nothing of either.
template <class Sys, class S>
int normal_motion(const Sys& sys, const Mode<surfaces_v<Sys>>& mode, int j, const S& t,
                  const State<Sys, S>& x, const Params<Sys, S>& p, int direction) {
    using std::abs;
    const auto rate = free_rates(sys, mode, j, t, x, p);
    const S band = rounding_band(sys, j, t, x, p);
    if (rate[0] * rate[0] <= S(2) * abs(rate[1]) * band ||
        S(2) * abs(rate[0]) <= S(64) * ulp(t) * abs(rate[1]) ||
        abs(rate[0]) <=
            rate_rounding(sys, j, t, x, p, mode_field(sys, free_of_jumps(sys, mode), t, x, p)))
        return 0;
    return S(direction) * rate[0] > S(0) ? 1 : -1;
}

/// True if the jump at surface j throws away what is at rest there: then there is no contact.
template <class Sys, class S>
bool throws_from_rest(const Sys& sys, const Mode<surfaces_v<Sys>>& mode, int j, const S& t,
                      const State<Sys, S>& x, const Params<Sys, S>& p) {
    const State<Sys, S> y = sys.jump(j, t, x, p);
    return !(y == x) && (switching(sys, t, y, p)[j] > rounding_band(sys, j, t, y, p) ||
                         normal_motion(sys, mode, j, t, y, p, 1) > 0);
}
/// True if surface j throws the state: it moves against it, or is at rest, does not start to leave,
/// and would be thrown away. (A counter that a jump puts on its limit is at rest there for ever.)
template <class Sys, class S>
bool is_thrown(const Sys& sys, const Mode<surfaces_v<Sys>>& mode, int j, const S& t,
               const State<Sys, S>& x, const Params<Sys, S>& p, int direction) {
    const int motion = normal_motion(sys, mode, j, t, x, p, direction);
    return motion < 0 ||
           (motion == 0 && direction > 0 && !(free_rates(sys, mode, j, t, x, p)[1] > S(0)) &&
            throws_from_rest(sys, mode, j, t, x, p));
}

namespace detail {

/// One mode as a way to go on from a point of several surfaces.
template <class Sys, class S> class Candidate {
    static constexpr int M = surfaces_v<Sys>;

public:
    /// @param before   the mode that came here
    /// @param regions  around the surfaces in contact
    /// @param layers   of those that are looked at from beside; null: of none
    Candidate(const Sys& sys, const Mode<M>& mode, const Mode<M>& before,
              const Regions<Sys, S>& regions, const S& t, const State<Sys, S>& x,
              const Params<Sys, S>& p, const Arrival<S>& arrival, const Layers<Sys, S>* layers)
        : sys_(sys), mode_(mode), before_(before), regions_(regions), t_(t),
          x_(layers != nullptr ? beside(sys, *layers, mode, regions.on, t, x, p) : x), p_(p),
          arrival_(arrival), layers_(layers) {}

    /// True if the mode's own field keeps it; `starts` then holds the roots that its guards start
    /// on.
    /// @param exit  the slide that ended here by s_j = side, if one did
    bool admissible(const SlideEnd<M>& exit, Starts<M>& starts) {
        face();
        auto blend = blend_of<Sys, S>(flow_);
        const auto& on = regions_.on;
        if constexpr (M > 1)
            if (flow_.n > 1 && may_be_set_valued(blend)) {
                set_ = set_valued_slide(sys_, mode_, t_, x_, p_, layers_);
                if (set_.found) {
                    blend = set_.blend;
                    if (!keeps_set(exit, starts))
                        return false;
                }
            }
        for (int i = 0, z = 0; i < on.n; ++i) {
            const int j = on[i];
            if (mode_[j] == 0 && !may_slide(j))
                return false;
            if (mode_[j] == 0 && is_directed(sys_, j) && !set_.found) {
                if (is_kind(sys_, j, SurfaceKind::direction) &&
                    !keeps_sliding(j, -1, margin_of_direction(blend, z, i), exit,
                                   starts.below[std::size_t(j)]))
                    return false;
                ++z;
            } else if (mode_[j] == 0) {
                if (set_.found)
                    continue;
                // (a contact may push as hard as it has to)
                if (!is_kind(sys_, j, SurfaceKind::jump) &&
                    !keeps_sliding(j, -1, blend.below[z], exit, starts.below[std::size_t(j)]))
                    return false;
                if (!keeps_sliding(j, +1, blend.above[z], exit, starts.above[std::size_t(j)]))
                    return false;
                ++z;
            } else if (!keeps_side(i, blend, exit, starts.side[std::size_t(j)])) {
                return false;
            }
        }
        return true;
    }
    /// True if it slides on nothing, or on what is shown to attract. From a slide that rests, or
    /// begins or stays at an end of s, or within a layer, what has no speed does not lead away,
    /// either.
    bool attracts() const {
        if constexpr (M > 1)
            if (set_.found)
                return arrival_.direction > 0 && set_.w > S(0);
        const auto field = [&](const auto& t, const auto& x, const auto& p) {
            return mode_field(sys_, mode_, t, x, p, layers_);
        };
        if constexpr (has_jumps_v<Sys>)
            if (flow_.n > 1 && arrival_.direction > 0 &&
                contacts_hold(sys_,
                              regions_at(sys_, mode_, slid_surfaces(mode_), t_, x_, p_, layers_)))
                return true;
        const auto attracts = [&](const NormalField<S, M>& flow) {
            return attraction(sys_, slid(), flow) > S(0);
        };
        return flow_.n == 0 || attracts(flow_in_time()) ||
               ((at_end_ || layers_ != nullptr || stays(field)) &&
                attracts(detail::tangent_leads_in(flow_in_time())));
    }

private:
    /// The regions between which this mode slides: a face of the cube of those in contact.
    void face() {
        const auto& on = regions_.on;
        flow_.n = 0;
        corner_ = 0;
        std::array<int, std::size_t(M)> free{};
        for (int i = 0; i < on.n; ++i)
            if (mode_[on[i]] == 0)
                free[std::size_t(flow_.n++)] = i;
            else if (mode_[on[i]] > 0)
                corner_ |= 1u << i;
        for (unsigned v = 0; v < flow_.regions(); ++v) {
            unsigned region = corner_;
            for (int z = 0; z < flow_.n; ++z)
                region |= (v >> z & 1u) << free[std::size_t(z)];
            region_[v] = region;
            for (int z = 0; z < flow_.n; ++z)
                flow_.normal[v][z] = regions_.flow(region, free[std::size_t(z)]);
        }
    }

    bool has_layer(int j) const { return layers_ != nullptr && layers_->has(j); }

    /// Those in contact that this mode slides on.
    SurfaceSet<M> slid() const {
        SurfaceSet<M> some;
        for (const int j : regions_.on)
            if (mode_[j] == 0)
                some.add(j);
        return some;
    }
    /// 1 - |s|^2 of the direction that begins with the i-th surface in contact, the z-th slid on.
    S margin_of_direction(const Blend<S, M>& blend, int z, int i) const {
        Vec<S, M> s;
        const int n = direction_end(sys_, regions_.on[i]) - regions_.on[i];
        for (int k = z; k < z + n; ++k)
            s[k] = blend.below[k] - S(1);
        return disc_margin(s, z, z + n);
    }

    NormalField<S, M> flow_in_time() const {
        auto flow = flow_;
        for (unsigned v = 0; v < flow.regions(); ++v)
            for (int i = 0; i < flow.n; ++i)
                flow.normal[v][i] = S(arrival_.direction) * flow(v, i);
        return flow;
    }

    /// Where the solution goes from surface j, which has jumps. What was in contact with it is at
    /// rest, whatever the rounding of its speed.
    int motion(int j) const {
        return before_[j] == 0 ? 0 : normal_motion(sys_, mode_, j, t_, x_, p_, arrival_.direction);
    }

    /// A kink is always crossed, unless it has a layer, and contact is for what does not leave.
    bool may_slide(int j) const {
        if (is_kind(sys_, j, SurfaceKind::kink))
            return has_layer(j);
        if constexpr (has_jumps_v<Sys>)
            if (is_kind(sys_, j, SurfaceKind::jump))
                return motion(j) == 0 &&
                       !(arrival_.direction > 0 && throws_from_rest(sys_, mode_, j, t_, x_, p_));
        return true;
    }

    /// 1 +- s_j positive, or zero and growing: 1, 2 derivatives of it are looked at. Zero for ever,
    /// where the slide rests, will do.
    bool keeps_sliding(int j, int end, const S& margin, const SlideEnd<M>& exit, int& order) {
        using std::abs;
        const bool at_end = exit.side[j] == end && mode_ == exit.mode;
        if (has_layer(j))
            return !at_end && margin >= -layer_slack<S>;
        // A force has no scale.
        const S band = is_kind(sys_, j, SurfaceKind::jump) ? S(0) : noise;
        if (!at_end && !(abs(margin) <= band))
            return margin > S(0);
        const auto field = [&](const auto& t, const auto& x, const auto& p) {
            return mode_field(sys_, mode_, t, x, p, layers_);
        };
        const auto distance = [&](const auto& t, const auto& x, const auto& p) {
            const auto m = sliding_margin(sys_, mode_, j, t, x, p, layers_);
            return end < 0 ? m.below : m.above;
        };
        const auto rate = lie_derivatives<2>(field, distance, t_, x_, p_);
        const S unit = arrival_.tau * S(arrival_.direction);
        const std::array<S, 2> change{rate[0] * unit, rate[1] * unit * unit};
        // Shares are of order one; a force is what its own changes make it.
        const S least = is_kind(sys_, j, SurfaceKind::jump)
                            ? noise * std::max(S(abs(change[0])), S(abs(change[1])))
                            : noise;
        at_end_ = true;
        for (order = 1; order <= 2; ++order)
            if (const S c = change[std::size_t(order - 1)]; abs(c) > least)
                return c > S(0);
        if (is_directed(sys_, j)) // on the edge of its disc a direction sticks as within it
            return true;
        order = 2;
        return !leads_away(sign_ahead(least, [&](const Mode<M>& mode, const S& t, const auto& x) {
            const auto m = sliding_margin(sys_, mode, j, t, x, p_, layers_);
            return !(m.w > S(0)) ? std::numeric_limits<S>::quiet_NaN()
                   : end < 0     ? m.below
                                 : m.above;
        }));
    }
    static constexpr int no_field = 2;
    static bool leads_away(int ahead) { return ahead < 0 || ahead == no_field; }
    /// The sign of a quantity that is zero here with all its derivatives, a while later on the way
    /// of this mode; 0 if a hundredth of tau shows no more than `least`, `no_field` if the mode has
    /// no field there.
    template <class Quantity>
    FILIPPOV_COLD int sign_ahead(const S& least, const Quantity& quantity) const {
        using std::abs;
        const State<Sys, S> f = mode_field(sys_, mode_, t_, x_, p_, layers_);
        const Constraints<Sys> held(sys_, mode_);
        for (S ahead = S(1e-6); ahead <= S(1e-2); ahead *= S(10)) {
            const S dt = ahead * S(arrival_.direction) * arrival_.tau, t = t_ + dt;
            const State<Sys, S> x = project(sys_, held, t, State<Sys, S>(x_ + dt * f), p_,
                                            State<Sys, S>(State<Sys, S>::Ones()));
            const S then = quantity(mode_beside(sys_, mode_, regions_.on, t, x, p_), t, x);
            if (!(abs(then) <= std::numeric_limits<S>::max()))
                return no_field;
            if (abs(then) > least)
                return sign(then);
        }
        return 0;
    }
    /// The same of a slide whose s is not unique: its set is not empty, or hardly and grows. How it
    /// grows is asked of the set a while later along the slide, since it bends where what bounds it
    /// changes.
    bool keeps_set(const SlideEnd<M>& exit, Starts<M>& starts) {
        using std::abs;
        if (!set_.consistent || (set_.twists && !(set_.w > S(0) && set_.pull > S(0) && twists())))
            return false;
        const bool ended = exit.any() && mode_ == exit.mode;
        const auto [j, side] = margin_of_all(sys_, slid_surfaces(mode_));
        const S band = side < 0 ? noise : S(0); // a force has no scale
        if (!ended && !(abs(set_.margin) <= band))
            return set_.margin > S(0);
        const auto i = std::size_t(j);
        (side < 0 ? starts.below[i] : starts.above[i]) = 1;
        const State<Sys, S> f = mode_field(sys_, mode_, t_, x_, p_);
        const S tau = S(arrival_.direction) * arrival_.tau;
        for (S dt = S(1e-6) * tau; abs(dt) <= S(1e-2) * abs(tau); dt *= S(10)) {
            const auto later =
                set_valued_slide(sys_, mode_, S(t_ + dt), State<Sys, S>(x_ + dt * f), p_, layers_);
            if (!later.found)
                return false;
            if (const S change = later.margin - set_.margin;
                abs(change) > std::max(band, S(noise * abs(later.margin))))
                return change > S(0);
        }
        return stays([&](const auto& t, const auto& x, const auto& p) {
            return mode_field(sys_, mode_, t, x, p);
        });
    }
    /// True of z1' = c z2 in all regions, with the same c, and z2' = b - q s1 - r s2, where c q > 0
    /// and r > 0: energy falls where z2 is not zero, so that what is at z = 0 stays there for as
    /// long as |b| <= q + r.
    bool twists() const {
        using std::abs;
        const auto slid = slid_surfaces(mode_);
        for (int i = 0; i < 2; ++i) {
            const int j1 = slid[i], j2 = slid[1 - i];
            const S q = flow_(1u << (1 - i), 1 - i) - flow_(3u, 1 - i); // of z1, beyond z2
            const S here = flow_(0, i);
            bool same = true;
            for (unsigned v = 0; v < 4; ++v)
                same = same && abs(flow_(v, i) - here) <= noise * abs(here);
            if (!same)
                continue;
            const State<Sys, S> g = grad_h(sys_, j2, t_, x_, p_);
            const S g_t = h_t(sys_, j2, t_, x_, p_);
            const auto lifted = lift<1>(p_);
            S c(0);
            bool known = false;
            for (unsigned v = 0; v < 4; ++v) {
                Mode<M> region = mode_;
                region.set(slid[0], (v & 1u) != 0 ? 1 : -1);
                region.set(slid[1], (v & 2u) != 0 ? 1 : -1);
                const auto rate = [&](const auto& time, const auto& y) {
                    return normal_component(sys_, j1, time, y, lifted,
                                            side_field(sys_, region, time, y, lifted));
                };
                for (int k = 0; k <= dim_v<Sys>; ++k) {
                    const bool of_time = k == dim_v<Sys>;
                    const State<Sys, S> along =
                        of_time ? State<Sys, S>(State<Sys, S>::Zero())
                                : State<Sys, S>(State<Sys, S>::Unit(of_time ? 0 : k));
                    const S a = directional(rate, t_, x_, S(of_time ? 1 : 0), along);
                    const S b = of_time ? g_t : g[k];
                    if (!known && b != S(0)) {
                        c = a / b;
                        known = true;
                    }
                    if (!(abs(a - c * b) <= S(1e-9) * (abs(a) + abs(c * b))))
                        return false;
                }
            }
            return c * q > S(0) && abs(here) <= S(4) * abs(c) * rounding_band(sys_, j2, t_, x_, p_);
        }
        return false;
    }
    /// True if the mode's field rests here, beside those of the regions.
    template <class F> bool stays(const F& mode_field) const {
        State<Sys, S> largest = State<Sys, S>::Zero();
        for (unsigned r = 0; r < regions_.flow.regions(); ++r)
            largest = largest.cwiseMax(regions_.field[r].cwiseAbs());
        const auto field = [&](const S& t, const State<Sys, S>& x) { return mode_field(t, x, p_); };
        return rests(field, t_, S(S(arrival_.direction) * arrival_.tau), x_, largest);
    }

    /// The first non-zero derivative of h_j, j the i-th surface in contact, leads to its side.
    bool keeps_side(int i, const Blend<S, M>& blend, const SlideEnd<M>& exit, int& order) {
        using std::abs;
        const int j = regions_.on[i];
        const bool jumps = is_kind(sys_, j, SurfaceKind::jump);
        if (jumps && mode_[j] < 0)
            return false;
        order = 1;
        if constexpr (has_jumps_v<Sys>)
            if (jumps) {
                if (const int to = motion(j); to != 0)
                    return to > 0;
                order = 2; // at rest: what follows is about the acceleration
            }
        S slope(0), size(0);
        for (unsigned v = 0; v < flow_.regions(); ++v)
            slope += (flow_.n == 0 ? S(1) : blend.share[v]) * regions_.flow(region_[v], i);
        for (unsigned v = 0; v < regions_.flow.regions(); ++v)
            if (!jumps || (v >> i & 1u) != 0) // not of the push
                size = std::max(size, S(abs(regions_.flow(v, i))));
        if (!(abs(slope) <= std::numeric_limits<S>::max()))
            return false; // no such blend
        const S forward = S(arrival_.direction);
        // Where a slide ended by s_j = side the mode without it starts along the surface.
        const bool tangent =
            exit.ends_on(j) && mode_[j] != 0 && exit.leads_to(beside_kinks(exit.mode));
        if (!tangent && abs(slope) > noise * size)
            return sign(jumps ? slope : S(forward * slope)) == mode_[j];
        if (has_layer(j))
            return tangent;
        const auto field = [&](const auto& t, const auto& x, const auto& p) {
            return mode_field(sys_, mode_, t, x, p, layers_);
        };
        const auto h = [&](const auto& t, const auto& x, const auto& p) {
            return switching(sys_, t, x, p)[j];
        };
        if (is_held_anyway(j)) // then all of them are rounding
            return false;
        const auto rate = lie_derivatives<4>(field, h, t_, x_, p_);
        // all in units of the first derivative that could be zero, of order `first`
        const int first = order;
        S unit(1);
        if (tangent && is_moved_by_others(i)) { // then h'' is zero, too
            ++order;
            unit = unit * forward * arrival_.tau;
        }
        for (++order; order <= 4; ++order) {
            unit = unit * forward * arrival_.tau;
            const S change = rate[std::size_t(order - 1)] * unit;
            if (abs(change) > noise * size)
                return sign(first == 2 ? change : S(forward * change)) == mode_[j];
        }
        if (!jumps)
            if (const int to = sign_ahead(
                    S(noise * size),
                    [&](const Mode<M>& mode, const S& t, const State<Sys, S>& x) {
                        return S(forward * normal_component(sys_, j, t, x, p_,
                                                            mode_field(sys_, mode, t, x, p_)));
                    });
                to != 0)
                return to == mode_[j];
        // The solution goes on along h_j = 0. Beside a kink, or where all rests that could cross,
        // it is the same on either side: one of them will do.
        return !jumps && mode_[j] == side_of(before_[j]) &&
               (is_kind(sys_, j, SurfaceKind::kink) || (size == S(0) && stays(field)));
    }
    /// This mode, but for the sides of kinks, which change no field: they are those of `before`.
    Mode<M> beside_kinks(const Mode<M>& before) const {
        Mode<M> mode = mode_;
        for (int k = 0; k < M; ++k)
            if (is_kind(sys_, k, SurfaceKind::kink))
                mode.set(k, before[k]);
        return mode;
    }
    /// True if all regions move the i-th surface alike, as where a position twists with its speed.
    bool is_moved_by_others(int i) const {
        using std::abs;
        for (unsigned v = 1; v < regions_.flow.regions(); ++v)
            if (!(abs(regions_.flow(v, i) - regions_.flow(0, i)) <=
                  noise * abs(regions_.flow(0, i))))
                return false;
        return true;
    }
    /// What each component of the state is measured in: itself, or its change over tau.
    State<Sys, S> units() const {
        using std::abs;
        State<Sys, S> units;
        for (int i = 0; i < dim_v<Sys>; ++i) {
            units[i] = abs(x_[i]);
            for (unsigned v = 0; v < regions_.flow.regions(); ++v)
                units[i] = std::max(units[i], S(abs(arrival_.tau * regions_.field[v][i])));
            if (!(units[i] > S(0) && units[i] <= std::numeric_limits<S>::max()))
                units[i] = S(1);
        }
        return units;
    }
    /// True of a surface beside the slide that the surfaces slid on hold already: it would have to
    /// be slid on, too.
    bool is_held_anyway(int j) const {
        if (flow_.n == 0 || is_kind(sys_, j, SurfaceKind::kink))
            return false;
        const State<Sys, S> unit = units();
        const auto held = independent_part(sys_, Constraints<Sys>(sys_, mode_), t_, x_, p_, unit);
        Constraints<Sys> one;
        one.add(j, is_kind(sys_, j, SurfaceKind::jump));
        for (int i = 0; i < one.size(); ++i) {
            Constraints<Sys> more = held;
            more.add(one.only(i));
            if (!independent(sys_, more, t_, x_, p_, unit))
                return true;
        }
        return false;
    }
    /// The side that is given to what lies on a surface.
    static int side_of(int before) { return before < 0 ? -1 : +1; }

    /// Rounding of a margin, or of a normal component in units of the largest.
    static constexpr S noise = share_rounding<S>;

    const Sys& sys_;
    const Mode<M> mode_, before_;
    const Regions<Sys, S>& regions_;
    const S t_;
    const State<Sys, S> x_;
    const Params<Sys, S>& p_;
    const Arrival<S>& arrival_;
    const Layers<Sys, S>* layers_;
    NormalField<S, M> flow_;
    SetValued<S, M> set_;
    std::array<unsigned, std::size_t(1) << M> region_{};
    unsigned corner_ = 0;
    bool at_end_ = false; ///< an s_j is at an end of its range, or a contact without force
};

/// Calls `visit` with all 3^n modes of these surfaces, the others as they are.
template <int M, class Visit>
void in_each_mode(Mode<M> mode, const SurfaceSet<M>& on, const Visit& visit) {
    int modes = 1;
    for (int i = 0; i < on.n; ++i)
        modes *= 3;
    for (int code = 0; code < modes; ++code) {
        for (int i = 0, rest = code; i < on.n; ++i, rest /= 3)
            mode.set(on[i], rest % 3 - 1);
        visit(std::as_const(mode));
    }
}

/// True if these modes differ by the sides of kinks alone, where fields are continuous: the
/// solution is the same in all of them.
template <class Sys> bool differ_by_kinks(const Sys& sys, const Verdict<surfaces_v<Sys>>& v) {
    if (v.n_options > v.kept())
        return false;
    for (int k = 1; k < v.n_options; ++k)
        for (int j = 0; j < surfaces_v<Sys>; ++j)
            if (!is_kind(sys, j, SurfaceKind::kink) &&
                v.option[std::size_t(k)][j] != v.option[0][j])
                return false;
    return true;
}

} // namespace detail

/// Admissible modes at a point of several surfaces, the others as before: of all 3^n modes those
/// whose own field keeps them.
///
/// A side is kept if the first non-zero derivative of its h_j along the mode's field leads there; a
/// slide if all |s_j| < 1, or at |s_j| = 1 the derivative of s_j points inward. The verdict is
/// unique if one mode is admissible, but for the sides of kinks, and it slides on nothing or on
/// what is shown to attract.
///
/// @param on    the surfaces in contact, two or more: hit here or slid on
/// @param exit  the slide that ended here, if one did
/// @param layers  of surfaces that are looked at from beside; null: of none
/// @cost  2^n fields, 3^n small linear systems
template <class Sys, class S>
Verdict<surfaces_v<Sys>> admissible(const Sys& sys, const Mode<surfaces_v<Sys>>& before,
                                    const SurfaceSet<surfaces_v<Sys>>& on, const S& t,
                                    const State<Sys, S>& x, const Params<Sys, S>& p,
                                    const Arrival<S>& arrival,
                                    const SlideEnd<surfaces_v<Sys>>& exit, NonUnique policy,
                                    const Layers<Sys, S>* layers = nullptr) {
    constexpr int M = surfaces_v<Sys>;
    Verdict<M> v;
    v.mode = before;
    const auto regions = regions_at(sys, before, on, t, x, p, layers);
    v.finite = are_finite(regions);
    if (!v.finite)
        return v;
    bool attracting = true;
    detail::in_each_mode(before, on, [&](const Mode<M>& mode) {
        detail::Candidate<Sys, S> candidate(sys, mode, before, regions, t, x, p, arrival, layers);
        Starts<M> starts;
        if (!candidate.admissible(exit, starts))
            return;
        attracting = attracting && candidate.attracts();
        v.add(mode, starts, policy);
    });
    v.unique = v.n_options > 0 && detail::differ_by_kinks(sys, v) && attracting;
    if (v.n_options == 0)
        v.reason = "no mode is admissible where these surfaces meet";
    else if (!detail::differ_by_kinks(sys, v))
        v.reason = "several modes are admissible where these surfaces meet";
    else if (!attracting)
        v.reason = "sliding where these surfaces meet is not shown to attract";
    return v;
}

} // namespace filippov
