// SPDX-License-Identifier: BSD-3-Clause
// Systems of formulas behind the interface of model.hpp: compiled for a few shapes, each in a file
// of its own. CMake says which.
#pragma once

#include "lanes/lanes.hpp"
#include "model.hpp"

#include <filippov/formulas/tape_system.hpp>

#include <memory>

namespace filippov::python {

/// N components and M surfaces, at most; with one surface, which switches, and up to
/// `most_exact_dims` components just as many.
template <int N, int M> struct TapeShape {};
template <class... Shape> struct TapeShapes {};

template <int N, int M>
std::shared_ptr<const Model> tape_model(const Facts& facts,
                                        std::shared_ptr<const TapeProgram> tapes);

} // namespace filippov::python
