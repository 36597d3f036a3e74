// SPDX-License-Identifier: BSD-3-Clause
// What the binding files share.
#pragma once

#include "model.hpp"

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <cstddef>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace filippov::python {

namespace py = pybind11;

template <class T> using Array = py::array_t<T, py::array::c_style | py::array::forcecast>;

template <class T> std::span<const T> view(const Array<T>& a) {
    return {a.data(), static_cast<std::size_t>(a.size())};
}
template <class T> std::vector<T> copy(const Array<T>& a) {
    return {a.data(), a.data() + a.size()};
}

/// Hands a vector over to numpy without a copy.
template <class T>
py::array_t<T> as_array(std::vector<T>&& values, std::vector<py::ssize_t> shape) {
    auto owned = std::make_unique<std::vector<T>>(std::move(values));
    T* data = owned->data();
    py::capsule owner(owned.get(), [](void* p) { delete static_cast<std::vector<T>*>(p); });
    owned.release();
    return py::array_t<T>(std::move(shape), data, owner);
}

/// The typed layer passes what fits; this keeps a wrong caller from reading out of bounds.
inline void expect(bool fits, const char* what) {
    if (!fits)
        throw std::invalid_argument(std::string("filippov._core: ") + what);
}

void bind_status(py::module_& m);
void bind_system(py::module_& m);
void bind_trajectory(py::module_& m);

} // namespace filippov::python
