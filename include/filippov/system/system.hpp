// SPDX-License-Identifier: BSD-3-Clause
// What a user's system is: the concepts, and the free functions through which everything else
// reaches it. A system is written once; optional members are found, never required.
#pragma once

#include <filippov/core/taylor.hpp>

#include <array>
#include <cmath>
#include <iterator>
#include <string>
#include <string_view>
#include <vector>

namespace filippov {

// --- sizes -------------------------------------------------------------------------------------

/// Number of state components.
template <class Sys> inline constexpr int dim_v = Sys::dim;

/// How many components there are. A system that is made at run time may have fewer than it is
/// compiled for, and says so itself, by `components()`: the others come last, and stay zero.
template <class Sys> int component_count([[maybe_unused]] const Sys& sys) {
    if constexpr (requires { sys.components(); })
        return sys.components();
    else
        return dim_v<Sys>;
}

/// What weights are multiplied by, so that a mean square over all components that a system is
/// compiled for is one over those that it has.
template <class Sys, class S> S mean_weight([[maybe_unused]] const Sys& sys) {
    using std::sqrt;
    if constexpr (requires { sys.components(); })
        return sqrt(S(dim_v<Sys>) / S(sys.components()));
    else
        return S(1);
}

/// Number M of switching surfaces: `static constexpr int surfaces`, 1 if absent.
template <class Sys>
inline constexpr int surfaces_v = [] {
    if constexpr (requires { Sys::surfaces; })
        return int(Sys::surfaces);
    else
        return 1;
}();

/// How many surfaces there are. A system that is made at run time may have fewer than it is
/// compiled for, and says so itself, by `count()`: the others come last, and are never met.
template <class Sys> int surface_count([[maybe_unused]] const Sys& sys) {
    if constexpr (requires { sys.count(); })
        return sys.count();
    else
        return surfaces_v<Sys>;
}

/// Number of parameters: the length of `params`, 0 if absent.
template <class Sys>
inline constexpr int params_v = [] {
    if constexpr (requires { Sys::params.size(); })
        return int(Sys::params.size());
    else
        return 0;
}();

/// What a surface is.
enum class SurfaceKind : unsigned char {
    switching, ///< the field jumps there: crossed, or slid on
    kink,      ///< the field is continuous there and only a derivative jumps: always crossed
    /// The solution stays where h >= 0: where h falls to zero the state jumps by `jump`. A jump
    /// that leaves it on the surface and turns its normal speed is an impact; at rest, and pushed
    /// against the surface, the solution stays in contact (mode 0).
    jump,
    /// The first component of a vector a(t, x). In place of the blend variables of all its
    /// components the field has the direction a/|a|; at rest (a = 0) it may be any vector in the
    /// unit disc, and the solution sticks for as long as one of these holds a = 0.
    direction,
    component, ///< a further component of the vector before it
};

/// The kinds of the surfaces: `static constexpr std::array<SurfaceKind, M> kinds`, all switching if
/// absent.
template <class Sys>
inline constexpr std::array<SurfaceKind, std::size_t(surfaces_v<Sys>)> kinds_v = [] {
    std::array<SurfaceKind, std::size_t(surfaces_v<Sys>)> kinds{};
    if constexpr (requires { Sys::kinds[0]; }) {
        static_assert(std::size(Sys::kinds) == kinds.size(),
                      "filippov: `kinds` needs one entry for each of the system's `surfaces`");
        for (std::size_t j = 0; j < kinds.size(); ++j)
            kinds[j] = Sys::kinds[j];
    }
    return kinds;
}();
/// The kind of surface j; a system that is made at run time says so itself, by `kind(j)`.
template <class Sys> constexpr SurfaceKind kind_of_surface([[maybe_unused]] const Sys& sys, int j) {
    if constexpr (requires { sys.kind(j); })
        return sys.kind(j);
    else
        return kinds_v<Sys>[std::size_t(j)];
}
template <class Sys> constexpr bool is_kind(const Sys& sys, int j, SurfaceKind kind) {
    return kind_of_surface(sys, j) == kind;
}
/// True if the state jumps at some surface.
template <class Sys>
inline constexpr bool has_jumps_v = [] {
    for (const SurfaceKind kind : kinds_v<Sys>)
        if (kind == SurfaceKind::jump)
            return true;
    return false;
}();
/// True if a surface may be a component of a direction: a system that is made at run time says so
/// by `static constexpr bool may_have_directions = true`, and by `has_directions()` if one is.
template <class Sys>
inline constexpr bool has_directions_v = [] {
    if constexpr (requires { Sys::may_have_directions; })
        return bool(Sys::may_have_directions);
    for (const SurfaceKind kind : kinds_v<Sys>)
        if (kind == SurfaceKind::direction)
            return true;
    return false;
}();
template <class Sys> constexpr bool has_directions([[maybe_unused]] const Sys& sys) {
    if constexpr (requires { sys.has_directions(); })
        return sys.has_directions();
    else
        return has_directions_v<Sys>;
}
/// True if surface j is a component of a direction.
template <class Sys>
constexpr bool is_directed([[maybe_unused]] const Sys& sys, [[maybe_unused]] int j) {
    if constexpr (has_directions_v<Sys>)
        return is_kind(sys, j, SurfaceKind::direction) || is_kind(sys, j, SurfaceKind::component);
    else
        return false;
}
/// The first component of the direction that surface j is one of,
template <class Sys> constexpr int direction_begin(const Sys& sys, int j) {
    while (is_kind(sys, j, SurfaceKind::component))
        --j;
    return j;
}
/// and the surface behind its last one.
template <class Sys> constexpr int direction_end(const Sys& sys, int j) {
    do
        ++j;
    while (j < surfaces_v<Sys> && is_kind(sys, j, SurfaceKind::component));
    return j;
}
/// True if the kinds name whole directions, of two or three components each.
template <class Sys>
inline constexpr bool directions_fit_v = [] {
    int components = 3; // as behind one that is whole
    for (const SurfaceKind kind : kinds_v<Sys>) {
        const bool further = kind == SurfaceKind::component;
        if (further ? components == 0 || components == 3 : components == 1)
            return false;
        components = further ? components + 1 : kind == SurfaceKind::direction ? 1 : 0;
    }
    return components != 1;
}();

/// True of one surface at which only the field jumps: what everything in closed form is for.
template <class Sys>
inline constexpr bool single_v = surfaces_v<Sys> == 1 && kinds_v<Sys>[0] == SurfaceKind::switching;

/// True of a system whose sides are data, as those of formulas: nothing need be compiled for each.
template <class Sys>
inline constexpr bool sides_are_data_v = requires { requires Sys::sides_are_data; };

template <class Sys, class S> using State = Vec<S, dim_v<Sys>>;
template <class Sys, class S> using Params = Vec<S, params_v<Sys>>;

/// A vector of n entries with what is given, and the rest of them.
template <int N, class Given> Vec<double, N> padded(const Given& given, int n, double rest = 0) {
    Vec<double, N> x;
    for (int i = 0; i < N; ++i)
        x[i] = i < n ? given[decltype(given.size())(i)] : rest;
    return x;
}

// --- modes -------------------------------------------------------------------------------------

/// For each surface -1 (h < 0), +1 (h > 0) or 0 (sliding); for all components of a direction +1
/// (moving) or 0 (sticking).
template <int M> struct Mode {
    std::array<signed char, std::size_t(M)> side{};
    /// Bit j: the slide on surface j is of second order, which holds h_j' at zero as well.
    unsigned char second_order = 0;

    int operator[](int j) const { return side[std::size_t(j)]; }
    void set(int j, int value) {
        side[std::size_t(j)] = static_cast<signed char>(value);
        second_order = static_cast<unsigned char>(second_order & ~(1u << j));
    }
    /// Slides on surface j to second order.
    void hold_rate(int j) {
        set(j, 0);
        second_order = static_cast<unsigned char>(second_order | 1u << j);
    }
    bool holds_rate(int j) const { return (second_order >> j & 1u) != 0; }
    /// How many surfaces are slid on.
    int sliding() const {
        int n = 0;
        for (signed char v : side)
            n += v == 0;
        return n;
    }
    /// One number for all, or for the first n: the sum of mode[j] 3^j, for one surface its mode.
    int code(int n = M) const {
        int sum = 0;
        for (int j = n - 1; j >= 0; --j)
            sum = 3 * sum + (*this)[j];
        return sum;
    }
    bool operator==(const Mode&) const = default;
};

// --- the required members ----------------------------------------------------------------------

// Exact return types: an Eigen expression returned by value would dangle.

/// h(t, x, p): S for one surface, Vec<S, M> for M.
template <class Sys, class S>
concept HasSwitch =
    requires(const Sys& sys, const S& t, const State<Sys, S>& x, const Params<Sys, S>& p) {
        requires(surfaces_v<Sys> == 1 && requires {
                    { sys.h(t, x, p) } -> std::same_as<S>;
                }) || requires {
            { sys.h(t, x, p) } -> std::same_as<Vec<S, surfaces_v<Sys>>>;
        };
    };

/// f1(t, x, p) where h < 0 and f2(t, x, p) where h > 0, each smooth across the surface (one
/// surface).
template <class Sys, class S>
concept HasSides =
    surfaces_v<Sys> == 1 &&
    requires(const Sys& sys, const S& t, const State<Sys, S>& x, const Params<Sys, S>& p) {
        { sys.f1(t, x, p) } -> std::same_as<State<Sys, S>>;
        { sys.f2(t, x, p) } -> std::same_as<State<Sys, S>>;
    };

/// field(t, x, s, p): the blend in one evaluation, affine in each s_j. s is S for one surface,
/// Vec<S, M> for M.
template <class Sys, class S>
concept HasField =
    requires(const Sys& sys, const S& t, const State<Sys, S>& x, const Params<Sys, S>& p,
             const S& s1, const Vec<S, surfaces_v<Sys>>& sm) {
        requires(surfaces_v<Sys> == 1 && requires {
                    { sys.field(t, x, s1, p) } -> std::same_as<State<Sys, S>>;
                }) || requires {
            { sys.field(t, x, sm, p) } -> std::same_as<State<Sys, S>>;
        };
    };

/// region(t, x, side, p): the field of the region where the h_j have these signs, each smooth
/// across its surfaces.
template <class Sys, class S>
concept HasRegions = requires(const Sys& sys, const S& t, const State<Sys, S>& x,
                              const Mode<surfaces_v<Sys>>& side, const Params<Sys, S>& p) {
    { sys.region(t, x, side, p) } -> std::same_as<State<Sys, S>>;
};

/// f(t, x, p): one field for all regions, where all surfaces are kinks or jumps of the state.
template <class Sys, class S>
concept HasOneField =
    requires(const Sys& sys, const S& t, const State<Sys, S>& x, const Params<Sys, S>& p) {
        { sys.f(t, x, p) } -> std::same_as<State<Sys, S>>;
    };

/// Its fields, in any of these forms.
template <class Sys, class S>
concept HasFields =
    HasSides<Sys, S> || HasRegions<Sys, S> || HasField<Sys, S> || HasOneField<Sys, S>;

/// jump(j, t, x, p): the state after the jump at surface j.
template <class Sys, class S>
concept HasJump =
    requires(const Sys& sys, const S& t, const State<Sys, S>& x, const Params<Sys, S>& p) {
        { sys.jump(0, t, x, p) } -> std::same_as<State<Sys, S>>;
    };

/// A Filippov system: `dim`, a switching function `h`, and its fields as two sides, as a field a
/// region or as one blend, each a template over the scalar (checked with double and with the
/// differentiating scalar).
template <class Sys>
concept FilippovSystem =
    requires {
        requires Sys::dim >= 1;
        requires surfaces_v<Sys> >= 1;
    } && HasSwitch<Sys, double> && HasSwitch<Sys, Taylor<double, 1>> && HasFields<Sys, double> &&
    HasFields<Sys, Taylor<double, 1>> &&
    (!has_jumps_v<Sys> || (HasJump<Sys, double> && HasJump<Sys, Taylor<double, 1>>));

// --- optional members --------------------------------------------------------------------------

/// slide_components(t, x, p): L1 and L2 for x on the surface (one surface).
template <class Sys, class S>
concept HasSlideComponents =
    single_v<Sys> &&
    requires(const Sys& sys, const S& t, const State<Sys, S>& x, const Params<Sys, S>& p) {
        { sys.slide_components(t, x, p) } -> std::same_as<Vec<S, 2>>;
    };
/// slide_field(t, x, p): F_s of (4.11) for x on the surface, besides slide_components.
template <class Sys, class S>
concept HasSlideField =
    HasSlideComponents<Sys, S> &&
    requires(const Sys& sys, const S& t, const State<Sys, S>& x, const Params<Sys, S>& p) {
        { sys.slide_field(t, x, p) } -> std::same_as<State<Sys, S>>;
    };
/// grad_h(t, x, p): dh/dx, a vector of length dim (one surface).
template <class Sys, class S>
concept HasGradH =
    requires(const Sys& sys, const S& t, const State<Sys, S>& x, const Params<Sys, S>& p) {
        { sys.grad_h(t, x, p) } -> std::same_as<State<Sys, S>>;
    };
/// h_t(t, x, p): dh/dt at fixed x (one surface).
template <class Sys, class S>
concept HasHt =
    requires(const Sys& sys, const S& t, const State<Sys, S>& x, const Params<Sys, S>& p) {
        { sys.h_t(t, x, p) } -> std::same_as<S>;
    };
/// grad_h(j, t, x, p) and h_t(j, t, x, p): the same of surface j.
template <class Sys, class S>
concept HasGradients =
    requires(const Sys& sys, const S& t, const State<Sys, S>& x, const Params<Sys, S>& p) {
        { sys.grad_h(0, t, x, p) } -> std::same_as<State<Sys, S>>;
        { sys.h_t(0, t, x, p) } -> std::same_as<S>;
    };
/// sliding_flow(t, x, p, dt): the sliding motion in closed form, x(t + dt) from x on the surface.
template <class Sys, class S>
concept HasSlidingFlow =
    single_v<Sys> && requires(const Sys& sys, const S& t, const State<Sys, S>& x,
                              const Params<Sys, S>& p, const S& dt) {
        { sys.sliding_flow(t, x, p, dt) } -> std::same_as<State<Sys, S>>;
    };
/// slide_swing(p): s turns no sooner than this along a slide in closed form, as after half a period
/// of its only forcing. Windows of that length show all it does, with six values of s.
template <class Sys, class S>
concept HasSlideSwing =
    HasSlidingFlow<Sys, S> && requires(const Sys& sys, const Params<Sys, S>& p) {
        { sys.slide_swing(p) } -> std::same_as<S>;
    };
/// equivalent_control(t, x, p): s of (4.12) in closed form.
template <class Sys, class S>
concept HasEquivalentControl =
    single_v<Sys> &&
    requires(const Sys& sys, const S& t, const State<Sys, S>& x, const Params<Sys, S>& p) {
        { sys.equivalent_control(t, x, p) } -> std::same_as<S>;
    };
/// period(p): the fields and h repeat after this time.
template <class Sys, class S>
concept HasPeriod = requires(const Sys& sys, const Params<Sys, S>& p) {
    { sys.period(p) } -> std::same_as<S>;
};
/// s_max(p) >= 1: sliding is kept while |s| <= s_max (static friction above kinetic).
template <class Sys, class S>
concept HasSMax = single_v<Sys> && requires(const Sys& sys, const Params<Sys, S>& p) {
    { sys.s_max(p) } -> std::same_as<S>;
};

/// largest_error(t0, x0, t1, x1, p): how much a step from (t0, x0) to (t1, x1) may err in each
/// component, whatever the tolerance: where a field changes over a distance that the system knows
/// and no tolerance does. A system that is made at run time says by `limits_errors()` if it has
/// something to say.
template <class Sys, class S>
concept HasLargestError =
    requires(const Sys& sys, const S& t, const State<Sys, S>& x, const Params<Sys, S>& p) {
        { sys.largest_error(t, x, t, x, p) } -> std::same_as<State<Sys, S>>;
    };

// --- optional members that are there and would be passed over ----------------------------------

namespace detail {

/// Converts to anything: stands for arguments whatever their types.
struct Anything {
    template <class T> operator T() const;
};
using Series = Taylor<double, 1>;

// Whether a type has a function of this name and this many arguments, be it of the right types or
// not, const or not.
template <class Sys>
concept MeansPeriod = requires(Sys& sys, Anything any) { sys.period(any); } ||
                      requires(Sys& sys, Anything any) { sys.template period<double>(any); };
template <class Sys>
concept MeansSMax = requires(Sys& sys, Anything any) { sys.s_max(any); } ||
                    requires(Sys& sys, Anything any) { sys.template s_max<double>(any); };
template <class Sys>
concept MeansSlidingFlow = requires(Sys& sys, Anything any) {
    sys.sliding_flow(any, any, any, any);
} || requires(Sys& sys, Anything any) { sys.template sliding_flow<double>(any, any, any, any); };
template <class Sys>
concept MeansEquivalentControl = requires(Sys& sys, Anything any) {
    sys.equivalent_control(any, any, any);
} || requires(Sys& sys, Anything any) { sys.template equivalent_control<double>(any, any, any); };
template <class Sys>
concept MeansSlideComponents = requires(Sys& sys, Anything any) {
    sys.slide_components(any, any, any);
} || requires(Sys& sys, Anything any) { sys.template slide_components<double>(any, any, any); };
template <class Sys>
concept MeansSlideField = requires(Sys& sys, Anything any) {
    sys.slide_field(any, any, any);
} || requires(Sys& sys, Anything any) { sys.template slide_field<double>(any, any, any); };
template <class Sys>
concept MeansGradH =
    requires(Sys& sys, Anything any) { sys.grad_h(any, any, any); } ||
    requires(Sys& sys, Anything any) { sys.template grad_h<double>(any, any, any); } ||
    requires(Sys& sys, Anything any) { sys.grad_h(any, any, any, any); } ||
    requires(Sys& sys, Anything any) { sys.template grad_h<double>(any, any, any, any); };
template <class Sys>
concept MeansHt =
    requires(Sys& sys, Anything any) { sys.h_t(any, any, any); } ||
    requires(Sys& sys, Anything any) { sys.template h_t<double>(any, any, any); } ||
    requires(Sys& sys, Anything any) { sys.h_t(any, any, any, any); } ||
    requires(Sys& sys, Anything any) { sys.template h_t<double>(any, any, any, any); };
// `field` and `jump` are also what people call functions of their own: these take the right types.
template <class Sys>
concept MeansField =
    requires(Sys& sys, const double& t, const State<Sys, double>& x, const Params<Sys, double>& p) {
        sys.field(t, x, t, p);
    } ||
    requires(Sys& sys, const double& t, const State<Sys, double>& x, const Params<Sys, double>& p,
             const Vec<double, surfaces_v<Sys>>& s) { sys.field(t, x, s, p); };
template <class Sys>
concept MeansLargestError = requires(Sys& sys, Anything any) {
    sys.largest_error(any, any, any, any, any);
} || requires(Sys& sys, Anything any) {
    sys.template largest_error<double>(any, any, any, any, any);
};
template <class Sys>
concept MeansJump = requires(Sys& sys, const double& t, const State<Sys, double>& x,
                             const Params<Sys, double>& p) { sys.jump(0, t, x, p); };

// Whether an optional member is absent, or is found both with double and with the differentiating
// scalar: what is found with double only would be left out of every derivative in silence. (In
// this order: nothing is asked of a member that is as it should be.)
template <class Sys>
concept PeriodFits = (HasPeriod<Sys, double> && HasPeriod<Sys, Series>) || !MeansPeriod<Sys>;
template <class Sys>
concept SMaxFits = (HasSMax<Sys, double> && HasSMax<Sys, Series>) || !MeansSMax<Sys>;
template <class Sys>
concept SlidingFlowFits =
    !single_v<Sys> || (HasSlidingFlow<Sys, double> && HasSlidingFlow<Sys, Series>) ||
    !MeansSlidingFlow<Sys>;
template <class Sys>
concept EquivalentControlFits =
    !single_v<Sys> || (HasEquivalentControl<Sys, double> && HasEquivalentControl<Sys, Series>) ||
    !MeansEquivalentControl<Sys>;
template <class Sys>
concept SlideComponentsFit =
    !single_v<Sys> || (HasSlideComponents<Sys, double> && HasSlideComponents<Sys, Series>) ||
    !MeansSlideComponents<Sys>;
template <class Sys>
concept SlideFieldFits =
    !single_v<Sys> || (HasSlideField<Sys, double> && HasSlideField<Sys, Series>) ||
    !MeansSlideField<Sys>;
template <class Sys>
concept GradHFits = (HasGradH<Sys, double> && HasGradH<Sys, Series>) ||
                    (HasGradients<Sys, double> && HasGradients<Sys, Series>) || !MeansGradH<Sys>;
template <class Sys>
concept HtFits = (HasHt<Sys, double> && HasHt<Sys, Series>) ||
                 (HasGradients<Sys, double> && HasGradients<Sys, Series>) || !MeansHt<Sys>;
template <class Sys>
concept FieldFits = (HasField<Sys, double> && HasField<Sys, Series>) || !MeansField<Sys>;
template <class Sys>
concept LargestErrorFits =
    (HasLargestError<Sys, double> && HasLargestError<Sys, Series>) || !MeansLargestError<Sys>;
template <class Sys>
concept JumpFits = has_jumps_v<Sys> || !MeansJump<Sys>;
template <class Sys>
concept DirectionsFit = directions_fit_v<Sys> && (!has_directions_v<Sys> || HasField<Sys, double> ||
                                                  requires { Sys::may_have_directions; });

/// Refuses optional members that are there and cannot be used, one static_assert a member.
template <class Sys> constexpr void require_optional_members() {
    static_assert(
        HasSides<Sys, double> == HasSides<Sys, Series> &&
            HasRegions<Sys, double> == HasRegions<Sys, Series> &&
            HasOneField<Sys, double> == HasOneField<Sys, Series>,
        "filippov: `f1` and `f2`, `region` or `f` must be templates over the scalar S, so "
        "that they can be differentiated, also beside other forms of the fields");
    static_assert(JumpFits<Sys>,
                  "filippov: `jump` is there and no surface is of kind `jump`: name it in `static "
                  "constexpr std::array<SurfaceKind, surfaces> kinds`");
    static_assert(DirectionsFit<Sys>,
                  "filippov: the components of a direction are a surface of kind `direction` and "
                  "one or two of kind `component` behind it; the field is `field(t, x, s, p)`, "
                  "where s has the direction in place of these components");
    static_assert(PeriodFits<Sys>,
                  "filippov: `period` is there and cannot be used: expected `template <class S> S "
                  "period(const Vec<S, n_params>& p) const` returning exactly S");
    static_assert(SMaxFits<Sys>,
                  "filippov: `s_max` is there and cannot be used: expected one switching surface "
                  "and `template <class S> S s_max(const Vec<S, n_params>& p) const` returning "
                  "exactly S");
    static_assert(SlidingFlowFits<Sys>,
                  "filippov: `sliding_flow` is there and cannot be used: expected `template <class "
                  "S> Vec<S, dim> sliding_flow(const S& t, const Vec<S, dim>& x, const Vec<S, "
                  "n_params>& p, const S& dt) const` returning exactly Vec<S, dim>");
    static_assert(EquivalentControlFits<Sys>,
                  "filippov: `equivalent_control` is there and cannot be used: expected `template "
                  "<class S> S equivalent_control(const S& t, const Vec<S, dim>& x, const Vec<S, "
                  "n_params>& p) const` returning exactly S");
    static_assert(SlideComponentsFit<Sys>,
                  "filippov: `slide_components` is there and cannot be used: expected `template "
                  "<class S> Vec<S, 2> slide_components(const S& t, const Vec<S, dim>& x, const "
                  "Vec<S, n_params>& p) const` returning exactly Vec<S, 2>");
    static_assert(SlideFieldFits<Sys>,
                  "filippov: `slide_field` is there and cannot be used: expected, besides "
                  "`slide_components`, `template <class S> Vec<S, dim> slide_field(const S& t, "
                  "const Vec<S, dim>& x, const Vec<S, n_params>& p) const` returning exactly "
                  "Vec<S, dim>");
    static_assert(GradHFits<Sys>,
                  "filippov: `grad_h` is there and cannot be used: expected `template <class S> "
                  "Vec<S, dim> grad_h(const S& t, const Vec<S, dim>& x, const Vec<S, n_params>& p) "
                  "const` returning exactly Vec<S, dim>; of several surfaces `grad_h(int j, t, x, "
                  "p)` and `h_t(int j, t, x, p)`, both");
    static_assert(HtFits<Sys>,
                  "filippov: `h_t` is there and cannot be used: expected `template <class S> S "
                  "h_t(const S& t, const Vec<S, dim>& x, const Vec<S, n_params>& p) const` "
                  "returning exactly S; of several surfaces `grad_h(int j, t, x, p)` and `h_t(int "
                  "j, t, x, p)`, both");
    static_assert(FieldFits<Sys>,
                  "filippov: `field` is there and cannot be used: expected `template <class S> "
                  "Vec<S, dim> field(const S& t, const Vec<S, dim>& x, const S& s, const Vec<S, "
                  "n_params>& p) const` returning exactly Vec<S, dim>; s is Vec<S, surfaces> for "
                  "several surfaces");
    static_assert(LargestErrorFits<Sys>,
                  "filippov: `largest_error` is there and cannot be used: expected `template "
                  "<class S> Vec<S, dim> largest_error(const S& t0, const Vec<S, dim>& x0, const "
                  "S& t1, const Vec<S, dim>& x1, const Vec<S, n_params>& p) const` returning "
                  "exactly Vec<S, dim>");
}

} // namespace detail

/// Explains what a type lacks to be a FilippovSystem, or what is wrong with one of its optional
/// members, one static_assert a reason.
template <class Sys> constexpr void require_system() {
    if constexpr (FilippovSystem<Sys>) {
        detail::require_optional_members<Sys>();
    } else {
        constexpr bool has_dim = requires { requires Sys::dim >= 1; };
        static_assert(has_dim, "filippov: a system needs `static constexpr int dim` >= 1");
        if constexpr (has_dim) {
            static_assert(HasSwitch<Sys, double>,
                          "filippov: a system needs `template <class S> S h(const S& t, const "
                          "Vec<S, dim>& x, const Vec<S, n_params>& p) const` "
                          "returning exactly S (Vec<S, surfaces> for several surfaces)");
            static_assert(HasFields<Sys, double>,
                          "filippov: a system needs `f1` and `f2` (or `region` with the sides of "
                          "its surfaces, or `field` with the blend variable s), templates over the "
                          "scalar S that return exactly Vec<S, dim>, not an Eigen expression");
            static_assert(!HasSwitch<Sys, double> || HasSwitch<Sys, Taylor<double, 1>>,
                          "filippov: `h` must be a template over the scalar S, so that it can be "
                          "differentiated");
            static_assert(!HasFields<Sys, double> || HasFields<Sys, Taylor<double, 1>>,
                          "filippov: `f1` and `f2` (or `region`, or `field`) must be templates "
                          "over the scalar S, so that they can be differentiated");
            static_assert(
                !has_jumps_v<Sys> || HasJump<Sys, double>,
                "filippov: a surface of kind `jump` needs `template <class S> Vec<S, dim> "
                "jump(int j, const S& t, const Vec<S, dim>& x, const Vec<S, n_params>& p) "
                "const`");
            static_assert(!has_jumps_v<Sys> || !HasJump<Sys, double> ||
                              HasJump<Sys, Taylor<double, 1>>,
                          "filippov: `jump` must be a template over the scalar S, so that it can "
                          "be differentiated");
        }
    }
}

// --- using a system ----------------------------------------------------------------------------

/// h as a vector of length M whatever the system calls it.
template <class Sys, class S>
FILIPPOV_INLINE Vec<S, surfaces_v<Sys>> switching(const Sys& sys, const S& t,
                                                  const State<Sys, S>& x, const Params<Sys, S>& p) {
    if constexpr (std::same_as<decltype(sys.h(t, x, p)), S>)
        return Vec<S, 1>(sys.h(t, x, p));
    else
        return sys.h(t, x, p);
}

/// The field with given blend variables s_j, for `field` systems.
template <class Sys, class S>
FILIPPOV_INLINE State<Sys, S> blended_field(const Sys& sys, const S& t, const State<Sys, S>& x,
                                            const Vec<S, surfaces_v<Sys>>& s,
                                            const Params<Sys, S>& p) {
    if constexpr (requires {
                      { sys.field(t, x, s[0], p) } -> std::same_as<State<Sys, S>>;
                  })
        return sys.field(t, x, s[0], p);
    else
        return sys.field(t, x, s, p);
}

/// The blend variables of a mode without sliding: its sides, and the directions a/|a|; zero at
/// rest.
template <class Sys, class S>
Vec<S, surfaces_v<Sys>> sides_and_directions(const Sys& sys, const Mode<surfaces_v<Sys>>& mode,
                                             const S& t, const State<Sys, S>& x,
                                             const Params<Sys, S>& p) {
    using std::abs;
    using std::sqrt;
    constexpr int M = surfaces_v<Sys>;
    const Vec<S, M> a = switching(sys, t, x, p);
    Vec<S, M> s;
    for (int j = 0; j < M; ++j)
        s[j] = S(mode[j]);
    for (int j = 0; j < M; ++j) {
        if (!is_kind(sys, j, SurfaceKind::direction))
            continue;
        const int end = direction_end(sys, j);
        Real<S> largest(0);
        for (int k = j; k < end; ++k)
            largest = std::max(largest, Real<S>(abs(value_of(a[k]))));
        S square(0);
        for (int k = j; k < end; ++k)
            square += (a[k] / S(largest)) * (a[k] / S(largest));
        for (int k = j; k < end; ++k)
            s[k] = largest == Real<S>(0) ? S(0) : S(a[k] / S(largest) / sqrt(square));
    }
    if constexpr (requires { sys.set_directions(s, t); })
        sys.set_directions(s, t);
    return s;
}
/// The field with given sides and directions.
template <class Sys, class S>
State<Sys, S> directed_field(const Sys& sys, const S& t, const State<Sys, S>& x,
                             const Vec<S, surfaces_v<Sys>>& s, const Params<Sys, S>& p) {
    if constexpr (requires {
                      { sys.directed(t, x, s, p) } -> std::same_as<State<Sys, S>>;
                  })
        return sys.directed(t, x, s, p);
    else
        return blended_field(sys, t, x, s, p);
}

/// The field of a mode without sliding, the one-sided F1 or F2 of (4.8) for one surface.
template <class Sys, class S>
FILIPPOV_INLINE State<Sys, S> side_field(const Sys& sys, const Mode<surfaces_v<Sys>>& mode,
                                         const S& t, const State<Sys, S>& x,
                                         const Params<Sys, S>& p) {
    if constexpr (has_directions_v<Sys>)
        if (has_directions(sys))
            return directed_field(sys, t, x, sides_and_directions(sys, mode, t, x, p), p);
    if constexpr (HasOneField<Sys, S>) {
        return sys.f(t, x, p);
    } else if constexpr (HasSides<Sys, S>) {
        return mode[0] < 0 ? sys.f1(t, x, p) : sys.f2(t, x, p);
    } else if constexpr (HasRegions<Sys, S>) {
        return sys.region(t, x, mode, p);
    } else {
        Vec<S, surfaces_v<Sys>> s;
        for (int j = 0; j < surfaces_v<Sys>; ++j)
            s[j] = S(mode[j]);
        return blended_field(sys, t, x, s, p);
    }
}

/// has_sliding_flow(): a system that is made at run time says itself if it slides in closed form.
template <class Sys>
concept ChoosesSlides = requires(const Sys& sys) {
    { sys.has_sliding_flow() } -> std::same_as<bool>;
};
/// True if the system slides in closed form.
template <class S, class Sys> bool slides_in_closed_form([[maybe_unused]] const Sys& sys) {
    if constexpr (!HasSlidingFlow<Sys, S>)
        return false;
    else if constexpr (ChoosesSlides<Sys>)
        return sys.has_sliding_flow();
    else
        return true;
}

/// True if the system vouches for s: it slides in closed form, and says how soon s may turn. Then a
/// slide begins with any step, and nothing is looked for between the probes of its windows. A
/// system that is made at run time says by `has_slide_swing()` if it knows.
template <class S, class Sys> bool vouches_for_slides([[maybe_unused]] const Sys& sys) {
    if constexpr (!HasSlideSwing<Sys, S>)
        return false;
    else if constexpr (requires { sys.has_slide_swing(); })
        return slides_in_closed_form<S>(sys) && sys.has_slide_swing();
    else
        return slides_in_closed_form<S>(sys);
}

/// True if the system repeats with a period: one that is made at run time says so itself, by
/// `is_forced()`.
template <class S, class Sys> bool is_forced([[maybe_unused]] const Sys& sys) {
    if constexpr (requires { sys.is_forced(); })
        return sys.is_forced();
    else
        return HasPeriod<Sys, S>;
}

/// True if every h is linear in t and x: declared by `static constexpr bool linear_h = true`, or
/// said by `has_linear_h()` of a system that is made at run time. Then a step that resolves the
/// state resolves h.
template <class Sys> bool has_linear_h([[maybe_unused]] const Sys& sys) {
    if constexpr (requires { sys.has_linear_h(); })
        return sys.has_linear_h();
    else if constexpr (requires { Sys::linear_h; })
        return Sys::linear_h;
    else
        return false;
}

/// How exact the derivatives of the fields are, relative to the fields: to rounding, unless the
/// system says otherwise, by `derivative_error()`.
template <class R, class Sys> R derivative_error([[maybe_unused]] const Sys& sys) {
    if constexpr (requires { sys.derivative_error(); })
        return std::max(R(sys.derivative_error()), R(100) * epsilon<R>);
    else
        return R(100) * epsilon<R>;
}

/// How many parameters are given: all, unless the system computes the last ones from the others.
template <class Sys> int given_params([[maybe_unused]] const Sys& sys) {
    if constexpr (requires { sys.given(); })
        return sys.given();
    else
        return params_v<Sys>;
}
/// All parameters, from those given: an array of at least that many.
template <class S, class Sys, class Given>
Params<Sys, S> all_params([[maybe_unused]] const Sys& sys, const Given& given) {
    Params<Sys, S> p;
    for (int i = 0; i < params_v<Sys>; ++i)
        p[i] = i < given_params(sys) ? S(given[std::size_t(i)]) : S(0);
    if constexpr (requires { sys.complete(p); })
        sys.complete(p);
    return p;
}

/// The period of the forcing, 0 if the system has none: also where its own is not a finite number
/// > 0, as 2 pi / omega at omega = 0.
template <class Sys, class S> S period(const Sys& sys, const Params<Sys, S>& p) {
    if constexpr (HasPeriod<Sys, S>) {
        const S T = sys.period(p);
        if (T > S(0) && T - T == S(0))
            return T;
    }
    return S(0);
}

/// The largest |s| for which sliding is kept, 1 unless the system says more.
template <class Sys, class S> S s_max(const Sys& sys, const Params<Sys, S>& p) {
    if constexpr (HasSMax<Sys, S>)
        return sys.s_max(p);
    else
        return S(1);
}

/// True of systems that say what their parameters are if nobody does, or have none.
template <class Sys>
inline constexpr bool has_defaults_v = params_v<Sys> == 0 || requires { Sys::defaults; } ||
                                       requires(const Sys& sys) { sys.default_values(); };

/// The system's default parameters: `defaults` if it has them, else zeros.
template <class Sys, class S = double> Params<Sys, S> default_params() {
    static_assert(
        !requires(const Sys& sys) { sys.default_values(); },
        "filippov: the defaults of a system that is made at run time are its own: "
        "all_params<S>(sys, default_values(sys))");
    Params<Sys, S> p;
    for (int i = 0; i < params_v<Sys>; ++i) {
        if constexpr (requires { Sys::defaults; }) {
            static_assert(std::size(Sys::defaults) == std::size_t(params_v<Sys>),
                          "filippov: `defaults` needs one value for each of `params`");
            p[i] = S(Sys::defaults[std::size_t(i)]);
        } else {
            p[i] = S(0);
        }
    }
    return p;
}
/// Names of the parameters that are given.
template <class Sys> std::vector<std::string> param_names([[maybe_unused]] const Sys& sys) {
    if constexpr (requires { sys.param_names(); })
        return sys.param_names();
    else if constexpr (params_v<Sys> > 0)
        return {Sys::params.begin(), Sys::params.end()};
    else
        return {};
}
/// Default values of the parameters that are given.
template <class Sys> std::vector<double> default_values([[maybe_unused]] const Sys& sys) {
    if constexpr (requires { sys.default_values(); }) {
        return sys.default_values();
    } else {
        const Params<Sys, double> p = default_params<Sys>();
        return {p.data(), p.data() + params_v<Sys>};
    }
}

} // namespace filippov
