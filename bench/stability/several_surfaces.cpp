// SPDX-License-Identifier: BSD-3-Clause
#include "trial.hpp"

namespace filippov::stability {

template void try_problem<3, 2>(std::uint64_t, Report&, bool);
template void try_problem<4, 3>(std::uint64_t, Report&, bool);

} // namespace filippov::stability
