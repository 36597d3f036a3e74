// SPDX-License-Identifier: BSD-3-Clause
#include "lanes.hpp"

#include <filippov/formulas/tape_system.hpp>

#include <array>
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
    static constexpr std::array make{&lanes_of<1>, &lanes_of<2>, &lanes_of<3>, &lanes_of<4>,
                                     &lanes_of<5>, &lanes_of<6>, &lanes_of<7>, &lanes_of<8>};
    if (dim < 1 || std::size_t(dim) > make.size())
        throw std::invalid_argument("filippov: no lanes of so many components");
    return make[std::size_t(dim - 1)](tapes, scalar);
}

} // namespace filippov::python
