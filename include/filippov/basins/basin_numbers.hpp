// SPDX-License-Identifier: BSD-3-Clause
// Numbers of basins, from labels alone, each with its error.
#pragma once

#include <filippov/basins/attractor_match.hpp>
#include <filippov/basins/basin_entropy.hpp>
#include <filippov/basins/basin_fractions.hpp>
#include <filippov/basins/box_dimension.hpp>
#include <filippov/basins/uncertainty_exponent.hpp>
