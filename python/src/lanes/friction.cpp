// SPDX-License-Identifier: BSD-3-Clause
#include "lanes.hpp"

#include <filippov/models/belt.hpp>
#include <filippov/models/coulomb.hpp>

namespace filippov::python {

LanesPointer friction_lanes(const std::string& name, const ScalarPointer& scalar) {
    return name == "coulomb"    ? any_lanes(models::Coulomb{}, scalar)
           : name == "stiction" ? any_lanes(models::Stiction{}, scalar)
                                : any_lanes(models::VaryingBelt{}, scalar);
}

} // namespace filippov::python
