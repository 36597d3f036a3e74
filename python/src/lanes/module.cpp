// SPDX-License-Identifier: BSD-3-Clause
#include "lanes.hpp"

#include <pybind11/pybind11.h>

#include <stdexcept>

namespace py = pybind11;

namespace {

filippov::python::LanesPointer lanes_of(const std::string& name,
                                        const filippov::python::ScalarPointer& scalar) {
    namespace fpy = filippov::python;
    if (name == "oscillator")
        return fpy::oscillator_lanes(scalar);
    if (name == "coulomb" || name == "stiction" || name == "varying_belt")
        return fpy::friction_lanes(name, scalar);
    if (name == "relay" || name == "stiff_relay" || name == "planar_relay")
        return fpy::relay_lanes(name, scalar);
    if (name == "unit_circle" || name == "quartet" || name == "dieci_lopez")
        return fpy::plane_lanes(name, scalar);
    throw std::invalid_argument("filippov: no lanes of " + name);
}

} // namespace

PYBIND11_MODULE(FILIPPOV_LANES_MODULE, m) {
    m.attr("width") = filippov::native_lanes;
    m.def("lanes", [](const std::string& name, const py::capsule& scalar) {
        namespace fpy = filippov::python;
        const auto* engine = static_cast<const fpy::ScalarPointer*>(
            PyCapsule_GetPointer(scalar.ptr(), fpy::scalar_capsule));
        if (engine == nullptr)
            throw py::error_already_set();
        auto lanes = std::make_unique<fpy::LanesPointer>(lanes_of(name, *engine));
        return py::capsule(lanes.release(), filippov::python::lanes_capsule, [](PyObject* capsule) {
            delete static_cast<filippov::python::LanesPointer*>(
                PyCapsule_GetPointer(capsule, filippov::python::lanes_capsule));
        });
    });
}
