// SPDX-License-Identifier: BSD-3-Clause
// A second file with the same headers: a function that lacks `inline` fails to link here.
#include <filippov/version.hpp>
#if __has_include(<filippov/filippov.hpp>)
#include <filippov/filippov.hpp>
#endif

#include <Eigen/Core>

double norm_in_second_file(const Eigen::Vector2d& x);

double norm_in_second_file(const Eigen::Vector2d& x) { return x.norm(); }
