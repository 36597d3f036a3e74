// SPDX-License-Identifier: BSD-3-Clause
#include "lanes.hpp"

#include <filippov/models/dieci_lopez.hpp>
#include <filippov/models/quartet.hpp>
#include <filippov/models/unit_circle.hpp>

namespace filippov::python {

LanesPointer plane_lanes(const std::string& name, const ScalarPointer& scalar) {
    return name == "unit_circle" ? any_lanes(models::UnitCircle{}, scalar)
           : name == "quartet"   ? any_lanes(models::Quartet{}, scalar)
                                 : any_lanes(models::DieciLopez{}, scalar);
}

} // namespace filippov::python
