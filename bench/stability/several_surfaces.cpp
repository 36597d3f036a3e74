// SPDX-License-Identifier: BSD-3-Clause
#include "trial.hpp"

template class filippov::stability::Trial<3, 2>;
template class filippov::stability::Trial<4, 3>;
