// SPDX-License-Identifier: BSD-3-Clause
#include "lanes.hpp"

#include <filippov/models/coulomb.hpp>

namespace filippov::python {

LanesPointer stiction_lanes(const ScalarPointer& scalar) {
    return any_lanes(models::Stiction{}, scalar);
}

} // namespace filippov::python
