// SPDX-License-Identifier: BSD-3-Clause
// Numbers of basins, from labels alone, each with its error.
#pragma once

#include <filippov/attractor_match.hpp>
#include <filippov/basin_entropy.hpp>
#include <filippov/basin_fractions.hpp>
#include <filippov/box_dimension.hpp>
#include <filippov/uncertainty_exponent.hpp>
