// SPDX-License-Identifier: BSD-3-Clause
//
// What a rival's loop is given of a system with one switching surface: the field of a mode, the gap
// to what ends the mode, and the decision at the surface. All of it by the model's own functions,
// so that a right-hand side costs every method the same.

#pragma once

#include <filippov/sliding/sliding.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <type_traits>

namespace filippov::rivals {

template <class Sys> struct Switched {
    static constexpr int N = dim_v<Sys>;
    using State = std::array<double, std::size_t(N)>;
    using X = Vec<double, N>;

    Sys sys{};
    Params<Sys, double> p{};

    static X vector(const double* x) { return Eigen::Map<const X>(x); }

    /// f1 where mode = -1, f2 where +1, Utkin's sliding field (4.11)-(4.12) where 0.
    template <int mode, class S>
    Vec<S, N> field(const S& t, const Vec<S, N>& x, const Params<Sys, S>& q) const {
        if constexpr (mode < 0)
            return sys.f1(t, x, q);
        else if constexpr (mode > 0)
            return sys.f2(t, x, q);
        else
            return sliding(sys, Mode<1>{}, t, x, q).f;
    }

    /// What ends a mode where it falls to zero, and its rate along a solution with slope dxdt: the
    /// distance |h|, in a slide 1 + s and 1 - s.
    struct Gaps {
        std::array<double, 2> gap, rate;
    };
    Gaps gaps(int mode, double t, const X& x, const X& dxdt) const {
        if (mode != 0)
            return {{mode * sys.h(t, x, p), 1.0},
                    {mode * normal_component(sys, 0, t, x, p, dxdt), 0.0}};
        Taylor<double, 1> time(t);
        time.c[1] = 1;
        Vec<Taylor<double, 1>, N> y = lift<1>(x);
        for (int i = 0; i < N; ++i)
            y[i].c[1] = dxdt[i];
        const auto m = sliding_margin(sys, Mode<1>{}, time, y, lift<1>(p));
        return {{m.below.c[0], m.above.c[0]}, {m.below.c[1], m.above.c[1]}};
    }

    /// Normal speeds of the two fields.
    std::array<double, 2> speeds(double t, const X& x) const {
        return {normal_component(sys, 0, t, x, p, field<-1>(t, x, p)),
                normal_component(sys, 0, t, x, p, field<+1>(t, x, p))};
    }

    bool on_surface(double t, const X& x) const { return std::abs(sys.h(t, x, p)) <= 1e-14; }

    /// The mode at a start that may lie on the surface.
    int first_mode(double t, const X& x) const {
        if (!on_surface(t, x))
            return sys.h(t, x, p) < 0 ? -1 : 1;
        const auto [l1, l2] = speeds(t, x);
        if (l1 > 0 && l2 < 0)
            return 0;
        return l2 > 0 ? 1 : -1;
    }

    /// The mode that follows when `mode` ends at (t, x).
    int next_mode(int mode, double t, const X& x) const {
        if (mode == 0) {
            const Margin<double> m = sliding_margin(sys, Mode<1>{}, t, x, p);
            return m.below < m.above ? -1 : 1;
        }
        const auto [l1, l2] = speeds(t, x);
        const double near = mode < 0 ? l1 : -l2, far = mode < 0 ? l2 : -l1;
        if (near <= 0) // touches the surface and leaves it again
            return mode;
        return far < 0 ? 0 : -mode;
    }

    /// One Newton step onto the surface: an event is located to rounding of the time, not of h.
    void project(double t, X& x) const { x = toward_surface(sys, 0, t, x, p, X(X::Ones())); }
};

/// What root finding by sign is given. With the rates of the gaps besides the gaps it stops where
/// one is least, and a solution that dips through the surface and back within a step is caught; the
/// rate of a stiff solution is noise.
enum class Roots { gaps, gaps_and_rates };

/// The field of one mode, in the forms that the integrators ask for.
template <class Sys, Roots sought = Roots::gaps_and_rates> struct SwitchedField {
    static constexpr int dim = Switched<Sys>::N;
    using State = typename Switched<Sys>::State;
    using X = typename Switched<Sys>::X;

    const Switched<Sys>* problem = nullptr;
    int mode = 1;

    /// Hands `use` the field of the mode as a function of (x, dxdt, t) without a branch.
    template <class Use> decltype(auto) visit(Use&& use) const {
        return with_mode([&](auto m) {
            return use([this](const State& x, State& dxdt, double t) {
                rates_in<decltype(m)::value>(t, x.data(), dxdt.data());
            });
        });
    }
    void operator()(const State& x, State& dxdt, double t) const {
        rates(t, x.data(), dxdt.data());
    }
    void rates(double t, const double* x, double* dxdt) const {
        with_mode([&](auto m) { rates_in<decltype(m)::value>(t, x, dxdt); });
    }

    static constexpr auto root_directions = [] {
        if constexpr (sought == Roots::gaps)
            return std::array{-1, -1};
        else
            return std::array{-1, -1, 1, 1};
    }();
    void roots(double t, const double* x, double* out) const {
        X dxdt;
        rates(t, x, dxdt.data());
        const auto g = problem->gaps(mode, t, Switched<Sys>::vector(x), dxdt);
        std::copy(g.gap.begin(), g.gap.end(), out);
        if constexpr (sought == Roots::gaps_and_rates)
            std::copy(g.rate.begin(), g.rate.end(), out + 2);
    }
    /// True if one of these roots, SUNDIALS' flags, ends the mode.
    static bool ends(const int* found) { return found[0] != 0 || found[1] != 0; }

    /// df_i/dx_j at by_x[i + dim j].
    void jacobian(double t, const double* x, double* by_x) const {
        with_mode([&](auto m) {
            const auto f = [this](const auto& time, const auto& y, const auto& q) {
                return problem->template field<decltype(m)::value>(time, y, q);
            };
            Eigen::Map<Mat<double, dim, dim>> J(by_x);
            J = filippov::jacobian(f, t, Switched<Sys>::vector(x), problem->p);
        });
    }
    /// df_i/dt.
    void time_slope(double t, const double* x, double* by_t) const {
        with_mode([&](auto m) {
            for (int i = 0; i < dim; ++i) {
                const auto f_i = [&](const auto& time, const auto& y) {
                    return problem->template field<decltype(m)::value>(time, y,
                                                                       lift<1>(problem->p))[i];
                };
                by_t[i] = directional(f_i, t, Switched<Sys>::vector(x), 1.0, X(X::Zero()));
            }
        });
    }

private:
    template <class Use> decltype(auto) with_mode(Use&& use) const {
        if (mode < 0)
            return use(std::integral_constant<int, -1>{});
        if (mode > 0)
            return use(std::integral_constant<int, 1>{});
        return use(std::integral_constant<int, 0>{});
    }
    template <int m> void rates_in(double t, const double* x, double* dxdt) const {
        Eigen::Map<X> out(dxdt);
        out = problem->template field<m>(t, Switched<Sys>::vector(x), problem->p);
    }
};

/// Where a run ended.
template <class Sys> struct SwitchedEnd {
    Vec<double, dim_v<Sys>> x = Vec<double, dim_v<Sys>>::Zero();
    bool finished = false;
    long n_events = 0, n_steps = 0, n_rejected = 0, n_field = 0;
};

} // namespace filippov::rivals
