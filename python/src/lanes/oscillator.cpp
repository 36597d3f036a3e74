// SPDX-License-Identifier: BSD-3-Clause
#include "lanes.hpp"

#include <filippov/models/oscillator.hpp>

namespace filippov::python {

LanesPointer oscillator_lanes(const ScalarPointer& scalar) {
    return any_lanes(models::Oscillator{}, scalar);
}

} // namespace filippov::python
