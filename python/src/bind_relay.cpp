// SPDX-License-Identifier: BSD-3-Clause
#include "compiled_model.hpp"

#include <filippov/models/relay.hpp>

namespace filippov::python {

std::shared_ptr<const Model> relay() { return bind_model<models::Relay>("relay"); }

} // namespace filippov::python
