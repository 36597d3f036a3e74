// SPDX-License-Identifier: BSD-3-Clause
// The compiled models in lanes. These files are compiled once for each instruction set, every time
// into a module of its own: two of them never meet in one link.
#pragma once

#include <filippov/ensemble/any_lanes.hpp>

#include <memory>

namespace filippov {
class TapeProgram;
} // namespace filippov

namespace filippov::python {

using LanesPointer = std::shared_ptr<const AnyLanes>;
using ScalarPointer = std::shared_ptr<const AnyScalar>;

/// What a capsule of lanes is called.
inline constexpr const char* lanes_capsule = "filippov.AnyLanes";
/// ... and one of the scalar engine that they need.
inline constexpr const char* scalar_capsule = "filippov.AnyScalar";
/// ... and one of the tapes of a system of formulas.
inline constexpr const char* tapes_capsule = "filippov.TapeProgram";

LanesPointer oscillator_lanes(const ScalarPointer& scalar);
LanesPointer stiction_lanes(const ScalarPointer& scalar);
using TapesPointer = std::shared_ptr<const TapeProgram>;
/// Parameters with what is derived from them, as in tape_model.hpp.
inline constexpr int tape_params = 32;

/// Of a system of formulas with N components and one surface, in a file of its own.
template <int N> LanesPointer tape_lanes(const TapesPointer& tapes, const ScalarPointer& scalar);
LanesPointer tape_lanes(int dim, const TapesPointer& tapes, const ScalarPointer& scalar);

} // namespace filippov::python
