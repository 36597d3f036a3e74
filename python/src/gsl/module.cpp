// SPDX-License-Identifier: BSD-3-Clause
// GSL's integrators for smoothed systems of formulas. Built from source on demand, in no wheel: a
// process that loads this module links GSL, which is GPL.
#include "../lanes/lanes.hpp"
#include "../lanes/seam.hpp"

#include <filippov/formulas/tape_system.hpp>
#include <filippov/gsl/ode.hpp>

#include <pybind11/eigen.h>
#include <pybind11/stl.h>

#include <stdexcept>
#include <utility>

namespace py = pybind11;

namespace filippov::python {

namespace {

/// A system of formulas none of whose surfaces switches, as one field.
template <int N> class OneField {
public:
    using Tapes = TapeSystem<N, most_split_surfaces, tape_params>;
    static constexpr int dim = N, surfaces = most_split_surfaces;
    static constexpr auto kinds = [] {
        std::array<SurfaceKind, std::size_t(surfaces)> all{};
        all.fill(SurfaceKind::kink);
        return all;
    }();
    static constexpr auto params = Tapes::params;

    explicit OneField(const TapesPointer& tapes) : tapes_(tapes) {}

    template <class S>
    Vec<S, N> f(const S& t, const Vec<S, N>& x, const Vec<S, tape_params>& p) const {
        const Vec<S, surfaces> value = h(t, x, p);
        Mode<surfaces> side;
        for (int j = 0; j < surfaces; ++j)
            side.set(j, value[j] < S(0) ? -1 : 1);
        return tapes_.region(t, x, side, p);
    }
    template <class S>
    Vec<S, surfaces> h(const S& t, const Vec<S, N>& x, const Vec<S, tape_params>& p) const {
        return tapes_.h(t, x, p);
    }
    const Tapes& tapes() const { return tapes_; }

private:
    Tapes tapes_;
};

const std::vector<std::pair<std::string, gsl::Method>> methods{
    {"msbdf", gsl::Method::msbdf},   {"msadams", gsl::Method::msadams},
    {"bsimp", gsl::Method::bsimp},   {"rk4imp", gsl::Method::rk4imp},
    {"rk2imp", gsl::Method::rk2imp}, {"rk1imp", gsl::Method::rk1imp},
    {"rk8pd", gsl::Method::rk8pd},
};
gsl::Method method_of(const std::string& wanted) {
    for (const auto& [name, method] : methods)
        if (name == wanted)
            return method;
    throw std::invalid_argument("filippov: no method of GSL: " + wanted);
}

using Numbers = std::vector<double>;

/// The end of a run.
struct GslEnd {
    std::string status, message;
    double t = 0;
    Numbers y;
    long long n_steps = 0, nfev = 0, njev = 0;
};

template <int N>
GslEnd run_of(const TapesPointer& tapes, gsl::Method method, const Numbers& given,
              const Numbers& start, double t0, double t_end, const gsl::Settings& settings) {
    const OneField<N> system(tapes);
    const auto p = all_params<double>(system.tapes(), given);
    const Vec<double, N> x0 = Eigen::Map<const Vec<double, N>>(start.data());
    gsl::Result<N> r;
    {
        const py::gil_scoped_release unlocked;
        r = gsl::run(method, system, p, x0, t0, t_end, settings);
    }
    return {.status = std::string(name(r.status)),
            .message = r.message(),
            .t = r.t,
            .y = Numbers(r.x.begin(), r.x.end()),
            .n_steps = r.steps,
            .nfev = r.field,
            .njev = r.jacobians};
}

GslEnd run(const py::capsule& capsule, const std::string& method, const Numbers& given,
           const Numbers& start, double t0, double t_end, double rtol, double atol,
           double first_step, long long max_steps) {
    const auto* tapes =
        static_cast<const TapesPointer*>(PyCapsule_GetPointer(capsule.ptr(), tapes_capsule));
    if (tapes == nullptr)
        throw py::error_already_set();
    static constexpr std::array run_with{&run_of<1>, &run_of<2>, &run_of<3>, &run_of<4>,
                                         &run_of<5>, &run_of<6>, &run_of<7>, &run_of<8>};
    if (start.empty() || start.size() > run_with.size())
        throw std::invalid_argument("filippov: GSL takes systems of 1 to 8 components");
    if (int(start.size()) != (*tapes)->dim || int(given.size()) != (*tapes)->given())
        throw std::invalid_argument("filippov: sizes do not fit");
    return run_with[start.size() - 1](*tapes, method_of(method), given, start, t0, t_end,
                                      {rtol, atol, first_step, max_steps});
}

} // namespace

PYBIND11_MODULE(_gsl, m, py::mod_gil_not_used()) {
    std::vector<std::string> names;
    for (const auto& [name, method] : methods)
        names.push_back(name);
    m.attr("methods") = py::tuple(py::cast(names));
    m.attr("seam") = seam();
    py::class_<GslEnd>(m, "GslEnd")
        .def_readonly("status", &GslEnd::status)
        .def_readonly("message", &GslEnd::message)
        .def_readonly("t", &GslEnd::t)
        .def_readonly("y", &GslEnd::y)
        .def_readonly("n_steps", &GslEnd::n_steps)
        .def_readonly("nfev", &GslEnd::nfev)
        .def_readonly("njev", &GslEnd::njev);
    m.def("run", &run);
}

} // namespace filippov::python
