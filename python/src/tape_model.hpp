// SPDX-License-Identifier: BSD-3-Clause
// Systems of formulas behind the interface of model.hpp: compiled for small numbers of components,
// and for some larger ones, which systems with fewer components use, too.
#pragma once

#include "lanes/lanes.hpp"
#include "model.hpp"

#include <filippov/formulas/tape_system.hpp>

#include <memory>

namespace filippov::python {

inline constexpr int most_tape_surfaces = most_split_surfaces;

/// A system of N components at most.
template <int N>
std::shared_ptr<const Model> tape_model(const Facts& facts,
                                        std::shared_ptr<const TapeProgram> tapes);

} // namespace filippov::python
