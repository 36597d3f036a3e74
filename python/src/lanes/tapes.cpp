// SPDX-License-Identifier: BSD-3-Clause
#include "lanes.hpp"

#include <stdexcept>

namespace filippov::python {

namespace {

template <int... N> struct Sizes {
    static LanesPointer lanes(int dim, const TapesPointer& tapes, const ScalarPointer& scalar) {
        LanesPointer lanes;
        static_cast<void>(((N == dim && (lanes = tape_lanes<N>(tapes, scalar))) || ...));
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
