// SPDX-License-Identifier: BSD-3-Clause
#include "lanes.hpp"

#include <filippov/formulas/tape_system.hpp>

#include <stdexcept>
#include <utility>

namespace filippov::python {

namespace {

/// Wide: an instruction is read once for more of them.
constexpr int width = 2 * native_lanes;

/// Lanes of a system of N components, if it has so many.
template <int N>
LanesPointer lanes_of(int dim, const TapesPointer& tapes, const ScalarPointer& scalar) {
    if constexpr (N <= most_exact_dims)
        if (N == dim)
            return any_lanes<width>(TapeSystem<N, 1, tape_params>(tapes), scalar);
    return nullptr;
}

template <int... N>
LanesPointer lanes_of_one(std::integer_sequence<int, N...>, int dim, const TapesPointer& tapes,
                          const ScalarPointer& scalar) {
    LanesPointer lanes;
    static_cast<void>(((lanes = lanes_of<N>(dim, tapes, scalar)) || ...));
    return lanes;
}

} // namespace

LanesPointer tape_lanes(int dim, const TapesPointer& tapes, const ScalarPointer& scalar) {
    constexpr std::integer_sequence<int, FILIPPOV_TAPE_DIMS> compiled;
    LanesPointer lanes = lanes_of_one(compiled, dim, tapes, scalar);
    if (!lanes)
        throw std::invalid_argument("filippov: no lanes of so many components");
    return lanes;
}

} // namespace filippov::python
