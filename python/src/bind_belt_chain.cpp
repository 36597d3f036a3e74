// SPDX-License-Identifier: BSD-3-Clause
#include "compiled_model.hpp"

#include <filippov/models/blocks.hpp>

namespace filippov::python {

std::shared_ptr<const Model> belt_chain_2() {
    return bind_model<models::BeltChain<2>>("belt_chain_2");
}
std::shared_ptr<const Model> belt_chain_3() {
    return bind_model<models::BeltChain<3>>("belt_chain_3");
}

} // namespace filippov::python
