// SPDX-License-Identifier: BSD-3-Clause
#pragma once

/// Version of the library. CMake and the Python package read this line; where else it is written,
/// a test compares.
#define FILIPPOV_VERSION "0.1.0"
