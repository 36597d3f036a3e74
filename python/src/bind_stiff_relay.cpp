// SPDX-License-Identifier: BSD-3-Clause
#include "compiled_model.hpp"

#include <filippov/models/stiff_relay.hpp>

namespace filippov::python {

std::shared_ptr<const Model> stiff_relay() { return bind_model<models::StiffRelay>("stiff_relay"); }

} // namespace filippov::python
