// SPDX-License-Identifier: BSD-3-Clause
// What most headers have in common, read once when each is compiled alone: Eigen. (Which header
// includes which of its solvers is a matter of check_floors.py.)
#pragma once

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>

#include <functional>
#include <string>
#include <vector>
