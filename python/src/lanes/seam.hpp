// SPDX-License-Identifier: BSD-3-Clause
// What a module says of the layout of what crosses to others: Python compares it as it loads them.
#pragma once

#include <filippov/ensemble/seam.hpp>

#include <pybind11/pybind11.h>

namespace filippov::python {

inline pybind11::dict seam() {
    pybind11::dict facts;
    for (const auto& [what, value] : seam_facts())
        facts[pybind11::str(what)] = value;
    return facts;
}

} // namespace filippov::python
