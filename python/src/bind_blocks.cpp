// SPDX-License-Identifier: BSD-3-Clause
#include "compiled_model.hpp"

#include <filippov/models/blocks.hpp>

namespace filippov::python {

std::shared_ptr<const Model> two_blocks() { return bind_model<models::TwoBlocks>("two_blocks"); }

} // namespace filippov::python
