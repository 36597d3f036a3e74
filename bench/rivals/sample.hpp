// SPDX-License-Identifier: BSD-3-Clause
// What the integrators of this folder hand to the loops around them.
#pragma once

namespace filippov::rivals::detail {

/// A state and its slope at one end of a step, or inside it.
template <class State> struct Sample {
    State x, dxdt;
};

} // namespace filippov::rivals::detail
