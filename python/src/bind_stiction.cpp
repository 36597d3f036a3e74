// SPDX-License-Identifier: BSD-3-Clause
#include "compiled_model.hpp"

#include <filippov/models/coulomb.hpp>

namespace filippov::python {

std::shared_ptr<const Model> stiction() { return bind_model<models::Stiction>("stiction"); }

} // namespace filippov::python
