// SPDX-License-Identifier: BSD-3-Clause
#include "compiled_model.hpp"

#include <filippov/models/quartet.hpp>

namespace filippov::python {

std::shared_ptr<const Model> quartet() { return bind_model<models::Quartet>("quartet"); }

} // namespace filippov::python
