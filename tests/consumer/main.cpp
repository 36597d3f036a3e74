// SPDX-License-Identifier: BSD-3-Clause
#include <filippov/version.hpp>
#if __has_include(<filippov/filippov.hpp>)
#include <filippov/filippov.hpp>
#endif

#include <Eigen/Core>

#include <cstdio>

double norm_in_second_file(const Eigen::Vector2d& x);

int main() {
    std::printf("filippov %s\n", FILIPPOV_VERSION);
    return norm_in_second_file(Eigen::Vector2d{3.0, 4.0}) == 5.0 ? 0 : 1;
}
