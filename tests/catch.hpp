// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Catch2, version 2 (one header) or 3 (a library), under the names that both can serve: `Approx`
// is global, matchers are in `Catch::Matchers`, and `ContainsSubstring` has its name of version 3.

#if __has_include(<catch2/catch_test_macros.hpp>)
#include <catch2/catch_approx.hpp>
#include <catch2/catch_template_test_macros.hpp>
#include <catch2/catch_test_macros.hpp>
#include <catch2/generators/catch_generators_all.hpp>
#include <catch2/matchers/catch_matchers_all.hpp>

using Catch::Approx;
#else
#include <catch2/catch.hpp>

#include <string>

namespace Catch::Matchers {

inline auto ContainsSubstring(const std::string& text) { return Contains(text); }

} // namespace Catch::Matchers
#endif
