// SPDX-License-Identifier: BSD-3-Clause
// The library filippov::compiled: what headers leave to it where FILIPPOV_COMPILED is defined.
#include <filippov/orbits/dense.hpp>
