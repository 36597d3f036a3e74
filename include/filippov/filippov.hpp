// SPDX-License-Identifier: BSD-3-Clause
// What runs a system: trajectories, ensembles, brute-force diagrams, cell maps; and the models.
//
// What is found out about one behind AnySystem (orbits, branches, basins, geometry) has headers of
// its own: they take ten times as long to compile.
#pragma once

#include <filippov/basin_numbers.hpp>
#include <filippov/cells.hpp>
#include <filippov/diagram.hpp>
#include <filippov/ensemble.hpp>
#include <filippov/flow.hpp>
#include <filippov/models/belt.hpp>
#include <filippov/models/coulomb.hpp>
#include <filippov/models/dieci_lopez.hpp>
#include <filippov/models/oscillator.hpp>
#include <filippov/models/quartet.hpp>
#include <filippov/models/relay.hpp>
#include <filippov/models/stiff_relay.hpp>
#include <filippov/models/unit_circle.hpp>
#include <filippov/refine.hpp>
#include <filippov/rodas5p.hpp>
#include <filippov/smoothing.hpp>
#include <filippov/time_stepping.hpp>
#include <filippov/trajectory.hpp>
#include <filippov/version.hpp>
