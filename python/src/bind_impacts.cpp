// SPDX-License-Identifier: BSD-3-Clause
#include "compiled_model.hpp"

#include <filippov/models/impacts.hpp>

namespace filippov::python {

std::shared_ptr<const Model> bouncing_ball() {
    return bind_model<models::BouncingBall>("bouncing_ball");
}
std::shared_ptr<const Model> thermostat() { return bind_model<models::Thermostat>("thermostat"); }
std::shared_ptr<const Model> impact_belt() { return bind_model<models::ImpactBelt>("impact_belt"); }

} // namespace filippov::python
