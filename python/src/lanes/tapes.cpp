// SPDX-License-Identifier: BSD-3-Clause
#include "lanes.hpp"

#include <filippov/formulas/tape_system.hpp>

#include <stdexcept>

namespace filippov::python {

namespace {

/// The smaller first, as scalar engines are chosen.
template <int... N> struct Sizes {
    static LanesPointer lanes(int dim, const TapesPointer& tapes, const ScalarPointer& scalar) {
        LanesPointer lanes;
        static_cast<void>(((fits_dims<N>(dim) && (lanes = tape_lanes<N>(tapes, scalar))) || ...));
        return lanes;
    }
};

} // namespace

LanesPointer tape_lanes(int dim, const TapesPointer& tapes, const ScalarPointer& scalar) {
    LanesPointer lanes = Sizes<FILIPPOV_LANES_DIMS>::lanes(dim, tapes, scalar);
    if (!lanes)
        throw std::invalid_argument("filippov: no lanes of so many components");
    return lanes;
}

} // namespace filippov::python
