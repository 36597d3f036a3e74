// SPDX-License-Identifier: BSD-3-Clause
// What runs a system: trajectories, ensembles, brute-force diagrams, cell maps; and the models.
//
// What is found out about one behind AnySystem (orbits, branches, basins, geometry) has headers of
// its own: they take ten times as long to compile.
#pragma once

#include <filippov/basins/basin_numbers.hpp>
#include <filippov/basins/cells.hpp>
#include <filippov/basins/refine.hpp>
#include <filippov/engine/flow.hpp>
#include <filippov/engine/time_stepping.hpp>
#include <filippov/engine/trajectory.hpp>
#include <filippov/ensemble/ensemble.hpp>
#include <filippov/methods/rodas5p.hpp>
#include <filippov/models/belt.hpp>
#include <filippov/models/coulomb.hpp>
#include <filippov/models/dieci_lopez.hpp>
#include <filippov/models/oscillator.hpp>
#include <filippov/models/quartet.hpp>
#include <filippov/models/relay.hpp>
#include <filippov/models/stiff_relay.hpp>
#include <filippov/models/unit_circle.hpp>
#include <filippov/orbits/diagram.hpp>
#include <filippov/system/smoothing.hpp>
#include <filippov/version.hpp>
