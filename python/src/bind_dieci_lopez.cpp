// SPDX-License-Identifier: BSD-3-Clause
#include "compiled_model.hpp"

#include <filippov/models/dieci_lopez.hpp>
#include <filippov/sliding/intersection.hpp>

namespace filippov::python {

std::shared_ptr<const Model> dieci_lopez_2_moments() {
    return bind_model<WithMoments<models::DieciLopez2>>("dieci_lopez_2_moments");
}

} // namespace filippov::python
