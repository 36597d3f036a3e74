// SPDX-License-Identifier: BSD-3-Clause
#include "trial.hpp"

template class filippov::stability::Trial<2, 1>;
template class filippov::stability::Trial<3, 1>;
