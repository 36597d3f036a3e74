// SPDX-License-Identifier: BSD-3-Clause
#pragma once

/// Version of the library. It is written here and nowhere else: CMake and the Python package read
/// this line.
#define FILIPPOV_VERSION "0.1.0"
