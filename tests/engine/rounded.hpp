// SPDX-License-Identifier: BSD-3-Clause
// Systems with directions without any switch: another route to the same solution.
#pragma once

#include "catch.hpp"
#include "run.hpp"

#include <filippov/methods/rodas5p.hpp>

#include <cmath>
#include <string>

using namespace filippov;

/// Without any switch: a / sqrt(|a|^2 + eps^2) in place of the directions of `Sys`.
template <class Sys> struct Rounded {
    static constexpr int dim = dim_v<Sys>;
    static constexpr std::array kinds{SurfaceKind::kink};
    static constexpr std::array<std::string_view, std::size_t(params_v<Sys>)> params{};
    double eps = 0;

    template <Scalar S>
    Vec<S, dim> f(const S& t, const Vec<S, dim>& x, const Vec<S, params_v<Sys>>& p) const {
        using std::sqrt;
        const Sys sys;
        Vec<S, surfaces_v<Sys>> s = sys.h(t, x, p);
        for (int j = 0; j < surfaces_v<Sys>; j = direction_end(sys, j)) {
            S square(eps * eps);
            for (int k = j; k < direction_end(sys, j); ++k)
                square += s[k] * s[k];
            const S length = sqrt(square);
            for (int k = j; k < direction_end(sys, j); ++k)
                s[k] = s[k] / length;
        }
        return sys.field(t, x, s, p);
    }
    template <Scalar S> S h(const S&, const Vec<S, dim>&, const Vec<S, params_v<Sys>>&) const {
        return S(1);
    }
};
/// The state at the end of a run of that, with a width that is next to nothing: as a direction
/// leaves rest the width moves the speed by its power 0.8.
template <class Sys>
Vec<double, dim_v<Sys>> rounded(const Params<Sys, double>& p, const Vec<double, dim_v<Sys>>& x0,
                                double t_end, double size = 1) {
    auto settings = tolerance<dim_v<Sys>>(1e-10);
    settings.atol = AbsoluteTolerance<double, dim_v<Sys>>(1e-13);
    const auto r = run<Rodas5P>(Rounded<Sys>{1e-10 * size}, p, x0, 0.0, t_end, settings);
    REQUIRE(r.result.status == Status::ok);
    return r.result.x;
}

template <class V, class W> void check_near(const V& x, const W& y, double margin) {
    for (int i = 0; i < x.size(); ++i) {
        INFO("component " << i);
        CHECK(x[i] == Approx(y[i]).epsilon(0).margin(margin));
    }
}
template <class Run> std::string words(const Run& r) {
    std::string all;
    for (const auto& e : r.events)
        if (e.kind != EventKind::start && e.kind != EventKind::end)
            all += std::string(all.empty() ? "" : " ") + std::string(name(e.kind));
    return all;
}
