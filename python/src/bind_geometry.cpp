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

py::dict to_dict(const Tangency& point) {
    py::dict d;
    d["t"] = point.t;
    d["x"] = list_of(point.x);
    d["side"] = point.side;
    d["second"] = point.second;
    d["other"] = point.other;
    d["drift"] = point.drift;
    d["visible"] = point.visible();
    d["attracting"] = point.attracting();
    return d;
}

py::dict to_dict(const Equilibrium& e) {
    constexpr std::array kinds{"regular", "pseudo", "boundary"};
    constexpr std::array encounters{"", "persistence", "nonsmooth-fold", "degenerate"};
    py::dict d;
    d["kind"] = kinds[static_cast<std::size_t>(e.kind)];
    d["x"] = list_of(e.x);
    d["side"] = e.side;
    d["s"] = e.s;
    d["real"] = e.real;
    d["attracting"] = e.attracting;
    d["stable"] = e.stable();
    d["encounter"] = encounters[static_cast<std::size_t>(e.encounter)];
    d["eigenvalues"] = e.eigenvalues;
    d["value"] = e.value;
    return d;
}

/// One column a field.
py::dict to_dict(const SlidingBoundary& boundary) {
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
    py::list tangential;
    for (const Tangency& point : boundary.tangential)
        tangential.append(to_dict(point));
    py::dict d;
    d["side"] = boundary.side;
    d["t"] = column([](const Tangency& point) { return point.t; });
    d["x"] = as_array(std::move(x), {n, 2});
    d["second"] = column([](const Tangency& point) { return point.second; });
    d["other"] = column([](const Tangency& point) { return point.other; });
    d["drift"] = column([](const Tangency& point) { return point.drift; });
    d["tangential"] = tangential;
    d["status"] = std::string(name(boundary.status));
    d["message"] = boundary.message;
    return d;
}

template <class Found> py::dict results(const Search& search, const std::vector<Found>& found) {
    py::list all;
    for (const Found& each : found)
        all.append(to_dict(each));
    py::dict d;
    d["found"] = all;
    d["raised"] = search.signals.raised();
    return d;
}

py::dict tangent(const Model& model, const std::vector<int>& sides, double t, const Doubles& low,
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
py::list describe(const Model& model, double t, const Doubles& x, const Doubles& p) {
    const auto system = model.analysis({});
    expect(system != nullptr, "the system has one surface");
    expect(std::size_t(p.size()) == model.facts().params.size(), "p has one entry a parameter");
    expect(x.ndim() == 2 && x.shape(1) == model.facts().dim, "x has shape (k, dim)");
    const Vector params = vector_of(p);
    py::list all;
    for (py::ssize_t k = 0; k < x.shape(0); ++k) {
        const Vector at = Eigen::Map<const Vector>(x.data(k, 0), x.shape(1));
        const auto rate = [&](int side) {
            const Quantity L{Quantity::Kind::h, side, 1};
            return std::abs(system->quantity(L, t, at, params, {}).value[0]);
        };
        all.append(to_dict(describe_tangency(*system, rate(-1) < rate(1) ? -1 : 1, t, at, params)));
    }
    return all;
}

py::dict boundaries(const Model& model, const Doubles& low, const Doubles& high, const Doubles& p,
                    int samples, int seeds) {
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

py::dict rests(const Model& model, const Doubles& low, const Doubles& high, const Doubles& p,
               int seeds) {
    const Search search(model, low, high, p);
    return results(search,
                   search([&] { return equilibria(*search.system, search.box, search.p, seeds); }));
}

py::dict rests_on_surface(const Model& model, const Doubles& low, const Doubles& high,
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
    m.def("tangencies", &tangent);
    m.def("describe_tangencies", &describe);
    m.def("sliding_boundaries", &boundaries);
    m.def("equilibria", &rests);
    m.def("boundary_equilibria", &rests_on_surface);
    m.def("depends_on_time", &moves);
}

} // namespace filippov::python
