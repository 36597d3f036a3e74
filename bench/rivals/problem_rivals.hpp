// SPDX-License-Identifier: BSD-3-Clause
// Loops of other people's integrators on the problems besides the oscillator.
#pragma once

#include "../method_cases.hpp"

#include <filippov/models/coulomb.hpp>
#include <filippov/models/relay.hpp>
#include <filippov/models/stiff_relay.hpp>
#include <filippov/models/unit_circle.hpp>
#include <filippov/system/smoothing.hpp>

namespace filippov::bench {

/// Adds the runs of whatever libraries there are, under the names that they have at the oscillator.
/// Solvers are made here and serve every run: what is timed is a run.
void add_rivals(Cases& cases, const Problem<Blended<models::Coulomb>>& problem);
void add_rivals(Cases& cases, const Problem<Blended<models::UnitCircle>>& problem);
void add_rivals(Cases& cases, const Problem<DieciLopezField>& problem);
void add_rivals(Cases& cases, const Problem<Blended<models::Relay>>& problem);
/// With methods for stiff fields.
void add_rivals(Cases& cases, const Problem<Blended<models::StiffRelay>>& problem);

} // namespace filippov::bench
