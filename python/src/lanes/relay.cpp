// SPDX-License-Identifier: BSD-3-Clause
#include "lanes.hpp"

#include <filippov/models/relay.hpp>
#include <filippov/models/stiff_relay.hpp>
#include <filippov/models/switches.hpp>

namespace filippov::python {

LanesPointer relay_lanes(const std::string& name, const ScalarPointer& scalar) {
    return name == "relay"         ? any_lanes(models::Relay{}, scalar)
           : name == "stiff_relay" ? any_lanes(models::StiffRelay{}, scalar)
                                   : any_lanes(models::PlanarRelay{}, scalar);
}

} // namespace filippov::python
