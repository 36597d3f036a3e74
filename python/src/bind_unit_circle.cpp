// SPDX-License-Identifier: BSD-3-Clause
#include "compiled_model.hpp"

#include <filippov/models/unit_circle.hpp>

namespace filippov::python {

std::shared_ptr<const Model> unit_circle() { return bind_model<models::UnitCircle>("unit_circle"); }

} // namespace filippov::python
