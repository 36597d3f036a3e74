// SPDX-License-Identifier: BSD-3-Clause
#include "bind.hpp"

#include <filippov/orbits/geometry.hpp>

#include <pybind11/complex.h>

namespace filippov::python {

namespace {

using Doubles = Array<double>;

std::vector<double> list_of(const Vector& x) { return {x.begin(), x.end()}; }

/// A system that stops at signals, and where to look.
struct Search : Analysis {
    StateBox box;
    Vector p;

    Search(const Model& model, const Doubles& low, const Doubles& high, const Doubles& params)
        : Analysis(model), box{vector_of(low), vector_of(high)}, p(vector_of(params)) {}

    /// What `find` gives, without the lock.
    template <class Find> auto operator()(Find find) const {
        const py::gil_scoped_release unlocked;
        return find();
    }
};

/// A Tangency, with what follows from it.
struct TangencyResult {
    double t = 0;
    std::vector<double> x;
    int side = 0;
    double second = 0, other = 0, drift = 0;
    bool visible = false, attracting = false;
};

TangencyResult result_of(const Tangency& point) {
    return {.t = point.t,
            .x = list_of(point.x),
            .side = point.side,
            .second = point.second,
            .other = point.other,
            .drift = point.drift,
            .visible = point.visible(),
            .attracting = point.attracting()};
}

/// An Equilibrium, with words for what it is.
struct EquilibriumResult {
    std::string kind;
    std::vector<double> x;
    int side = 0;
    double s = 0;
    bool real = false, attracting = false, stable = false;
    std::string encounter;
    std::vector<std::complex<double>> eigenvalues;
    double value = 0;
};

EquilibriumResult result_of(const Equilibrium& e) {
    constexpr std::array kinds{"regular", "pseudo", "boundary"};
    constexpr std::array encounters{"", "persistence", "nonsmooth-fold", "degenerate"};
    return {.kind = kinds[static_cast<std::size_t>(e.kind)],
            .x = list_of(e.x),
            .side = e.side,
            .s = e.s,
            .real = e.real,
            .attracting = e.attracting,
            .stable = e.stable(),
            .encounter = encounters[static_cast<std::size_t>(e.encounter)],
            .eigenvalues = e.eigenvalues,
            .value = e.value};
}

/// A SlidingBoundary: a row a point.
struct SlidingBoundaryColumns {
    int side = 0;
    py::array_t<double> t, x, second, other, drift;
    std::vector<TangencyResult> tangential;
    std::string status, message;
};

SlidingBoundaryColumns result_of(const SlidingBoundary& boundary) {
    const auto n = py::ssize_t(boundary.points.size());
    const auto column = [&](auto get) {
        std::vector<double> values;
        for (const Tangency& point : boundary.points)
            values.push_back(get(point));
        return as_array(std::move(values), {n});
    };
    std::vector<double> x;
    for (const Tangency& point : boundary.points)
        x.insert(x.end(), point.x.begin(), point.x.end());
    SlidingBoundaryColumns c;
    c.side = boundary.side;
    c.t = column([](const Tangency& point) { return point.t; });
    c.x = as_array(std::move(x), {n, 2});
    c.second = column([](const Tangency& point) { return point.second; });
    c.other = column([](const Tangency& point) { return point.other; });
    c.drift = column([](const Tangency& point) { return point.drift; });
    for (const Tangency& point : boundary.tangential)
        c.tangential.push_back(result_of(point));
    c.status = name(boundary.status);
    c.message = boundary.message;
    return c;
}

/// All results of a search.
template <class T> struct Found {
    std::vector<T> found;
    py::object raised = py::none();
};

using Tangencies = Found<TangencyResult>;
using Equilibria = Found<EquilibriumResult>;
using SlidingBoundaries = Found<SlidingBoundaryColumns>;

template <class T> auto results(const Search& search, const std::vector<T>& found) {
    Found<decltype(result_of(found[0]))> all;
    for (const T& each : found)
        all.found.push_back(result_of(each));
    all.raised = search.signals.raised();
    return all;
}

Tangencies tangent(const Model& model, const std::vector<int>& sides, double t, const Doubles& low,
                   const Doubles& high, const Doubles& p, int seeds) {
    const Search search(model, low, high, p);
    return results(search, search([&] {
                       std::vector<Tangency> all;
                       for (const int side : sides)
                           for (Tangency& each :
                                tangencies(*search.system, side, t, search.box, search.p, seeds))
                               all.push_back(std::move(each));
                       return all;
                   }));
}

/// The tangencies at points, of the side that is nearer to one at each.
std::vector<TangencyResult> describe(const Model& model, double t, const Doubles& x,
                                     const Doubles& p) {
    const auto system = model.analysis({});
    expect(system != nullptr, "the system has one surface");
    expect(std::size_t(p.size()) == model.facts().params.size(), "p has one entry a parameter");
    expect(x.ndim() == 2 && x.shape(1) == model.facts().dim, "x has shape (k, dim)");
    const Vector params = vector_of(p);
    std::vector<TangencyResult> all;
    for (py::ssize_t k = 0; k < x.shape(0); ++k) {
        const Vector at = Eigen::Map<const Vector>(x.data(k, 0), x.shape(1));
        const auto rate = [&](int side) {
            const Quantity L{Quantity::Kind::h, side, 1};
            return std::abs(system->quantity(L, t, at, params, {}).value[0]);
        };
        all.push_back(
            result_of(describe_tangency(*system, rate(-1) < rate(1) ? -1 : 1, t, at, params)));
    }
    return all;
}

SlidingBoundaries boundaries(const Model& model, const Doubles& low, const Doubles& high,
                             const Doubles& p, int samples, int seeds) {
    const Search search(model, low, high, p);
    return results(search, search([&] {
                       std::vector<SlidingBoundary> all;
                       const AnySystem& system = *search.system;
                       for (const int side : {-1, 1})
                           for (const Tangency& start :
                                tangencies(system, side, 0, search.box, search.p, seeds))
                               all.push_back(
                                   sliding_boundary(system, side, start.x, search.p, samples));
                       return all;
                   }));
}

Equilibria rests(const Model& model, const Doubles& low, const Doubles& high, const Doubles& p,
                 int seeds) {
    const Search search(model, low, high, p);
    return results(search,
                   search([&] { return equilibria(*search.system, search.box, search.p, seeds); }));
}

Equilibria rests_on_surface(const Model& model, const Doubles& low, const Doubles& high,
                            const Doubles& p, int parameter, double from, double to, int seeds) {
    const Search search(model, low, high, p);
    return results(search, search([&] {
                       return boundary_equilibria(*search.system, search.box, search.p, parameter,
                                                  from, to, seeds);
                   }));
}

bool moves(const Model& model, const Doubles& low, const Doubles& high, const Doubles& p) {
    const Search search(model, low, high, p);
    return depends_on_time(*search.system, search.box, search.p);
}

} // namespace

void bind_geometry(py::module_& m) {
    bind_struct<TangencyResult>(m, "TangencyResult")
        .field("t", &TangencyResult::t)
        .field("x", &TangencyResult::x)
        .field("side", &TangencyResult::side)
        .field("second", &TangencyResult::second)
        .field("other", &TangencyResult::other)
        .field("drift", &TangencyResult::drift)
        .field("visible", &TangencyResult::visible)
        .field("attracting", &TangencyResult::attracting);
    bind_struct<Tangencies>(m, "Tangencies")
        .field("found", &Tangencies::found)
        .field("raised", &Tangencies::raised);
    m.def("tangencies", &tangent);
    m.def("describe_tangencies", &describe);
    bind_struct<SlidingBoundaryColumns>(m, "SlidingBoundaryColumns")
        .field("side", &SlidingBoundaryColumns::side)
        .field("t", &SlidingBoundaryColumns::t)
        .field("x", &SlidingBoundaryColumns::x)
        .field("second", &SlidingBoundaryColumns::second)
        .field("other", &SlidingBoundaryColumns::other)
        .field("drift", &SlidingBoundaryColumns::drift)
        .field("tangential", &SlidingBoundaryColumns::tangential)
        .field("status", &SlidingBoundaryColumns::status)
        .field("message", &SlidingBoundaryColumns::message);
    bind_struct<SlidingBoundaries>(m, "SlidingBoundaries")
        .field("found", &SlidingBoundaries::found)
        .field("raised", &SlidingBoundaries::raised);
    m.def("sliding_boundaries", &boundaries);
    bind_struct<EquilibriumResult>(m, "EquilibriumResult")
        .field("kind", &EquilibriumResult::kind)
        .field("x", &EquilibriumResult::x)
        .field("side", &EquilibriumResult::side)
        .field("s", &EquilibriumResult::s)
        .field("real", &EquilibriumResult::real)
        .field("attracting", &EquilibriumResult::attracting)
        .field("stable", &EquilibriumResult::stable)
        .field("encounter", &EquilibriumResult::encounter)
        .field("eigenvalues", &EquilibriumResult::eigenvalues)
        .field("value", &EquilibriumResult::value);
    bind_struct<Equilibria>(m, "Equilibria")
        .field("found", &Equilibria::found)
        .field("raised", &Equilibria::raised);
    m.def("equilibria", &rests);
    m.def("boundary_equilibria", &rests_on_surface);
    m.def("depends_on_time", &moves);
}

} // namespace filippov::python
