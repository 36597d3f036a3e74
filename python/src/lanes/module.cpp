// SPDX-License-Identifier: BSD-3-Clause
#include "lanes.hpp"
#include "seam.hpp"

#include <pybind11/pybind11.h>

#include <stdexcept>
#include <utility>

namespace py = pybind11;

namespace {

filippov::python::LanesPointer lanes_of(const std::string& name,
                                        const filippov::python::ScalarPointer& scalar) {
    namespace fpy = filippov::python;
    if (name == "oscillator")
        return fpy::oscillator_lanes(scalar);
    if (name == "stiction")
        return fpy::stiction_lanes(scalar);
    throw std::invalid_argument("filippov: no lanes of " + name);
}

/// What a capsule holds.
template <class Pointer> const Pointer& held(const py::capsule& capsule, const char* name) {
    const auto* pointer = static_cast<const Pointer*>(PyCapsule_GetPointer(capsule.ptr(), name));
    if (pointer == nullptr)
        throw py::error_already_set();
    return *pointer;
}
py::capsule capsule_of(filippov::python::LanesPointer pointer) {
    auto lanes = std::make_unique<filippov::python::LanesPointer>(std::move(pointer));
    return py::capsule(lanes.release(), filippov::python::lanes_capsule, [](PyObject* capsule) {
        delete static_cast<filippov::python::LanesPointer*>(
            PyCapsule_GetPointer(capsule, filippov::python::lanes_capsule));
    });
}

} // namespace

PYBIND11_MODULE(FILIPPOV_LANES_MODULE, m, py::mod_gil_not_used()) {
    m.attr("width") = filippov::native_lanes;
    namespace fpy = filippov::python;
    m.attr("seam") = fpy::seam();
    m.def("lanes", [](const std::string& name, const py::capsule& scalar) {
        return capsule_of(lanes_of(name, held<fpy::ScalarPointer>(scalar, fpy::scalar_capsule)));
    });
    m.def("tape_lanes", [](int dim, const py::capsule& tapes, const py::capsule& scalar) {
        return capsule_of(fpy::tape_lanes(dim, held<fpy::TapesPointer>(tapes, fpy::tapes_capsule),
                                          held<fpy::ScalarPointer>(scalar, fpy::scalar_capsule)));
    });
}
