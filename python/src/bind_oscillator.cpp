// SPDX-License-Identifier: BSD-3-Clause
#include "compiled_model.hpp"

#include <filippov/models/oscillator.hpp>

namespace filippov::python {

std::shared_ptr<const Model> oscillator() { return bind_model<models::Oscillator>("oscillator"); }

} // namespace filippov::python
