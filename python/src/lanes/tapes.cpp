// SPDX-License-Identifier: BSD-3-Clause
#include "lanes.hpp"

#include <filippov/tape_system.hpp>

#include <stdexcept>

namespace filippov::python {

namespace {

/// Wide: an instruction is read once for more of them.
constexpr int width = 2 * native_lanes;

template <int N> LanesPointer lanes_of(const TapesPointer& tapes, const ScalarPointer& scalar) {
    return any_lanes<width>(TapeSystem<N, 1, tape_params>(tapes), scalar);
}

} // namespace

LanesPointer tape_lanes(int dim, const TapesPointer& tapes, const ScalarPointer& scalar) {
    switch (dim) {
    case 1:
        return lanes_of<1>(tapes, scalar);
    case 2:
        return lanes_of<2>(tapes, scalar);
    case 3:
        return lanes_of<3>(tapes, scalar);
    case 4:
        return lanes_of<4>(tapes, scalar);
    case 5:
        return lanes_of<5>(tapes, scalar);
    case 6:
        return lanes_of<6>(tapes, scalar);
    case 7:
        return lanes_of<7>(tapes, scalar);
    case 8:
        return lanes_of<8>(tapes, scalar);
    default:
        throw std::invalid_argument("filippov: no lanes of so many components");
    }
}

} // namespace filippov::python
