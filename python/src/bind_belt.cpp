// SPDX-License-Identifier: BSD-3-Clause
#include "compiled_model.hpp"

#include <filippov/models/belt.hpp>

namespace filippov::python {

std::shared_ptr<const Model> varying_belt() {
    return bind_model<models::VaryingBelt>("varying_belt");
}

} // namespace filippov::python
