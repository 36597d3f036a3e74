// SPDX-License-Identifier: BSD-3-Clause
// What a run can be told where the number of its components and its method are known at run time
// only: of systems whose type is forgotten, and from Python.
#pragma once

#include <filippov/run/settings.hpp>

#include <array>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace filippov {

/// A tableau by its name.
enum class Method {
    dopri5,  ///< DormandPrince5
    dop853,  ///< DormandPrince8
    rodas5p, ///< Rodas5P, for stiff systems; not in lanes
};

constexpr std::string_view name(Method method) {
    constexpr std::array<std::string_view, 3> names{"dopri5", "dop853", "rodas5p"};
    return names[static_cast<std::size_t>(method)];
}

/// Settings of a run, as `Settings`; a limit counts for each run, or each member of an ensemble.
struct RunSettings {
    double rtol = 1e-8;              ///< relative tolerance of the local error, > 0
    std::vector<double> atol{1e-10}; ///< absolute tolerance, units of x: one entry, or dim; >= 0
    double max_step = std::numeric_limits<double>::infinity(); ///< largest step, units of t, > 0
    double first_step = 0;                    ///< first step, units of t; 0: automatic
    long long max_steps = 100'000'000;        ///< attempted steps in the whole run, > 0
    long long max_events = 10'000'000;        ///< events in the whole run, > 0
    NonUnique on_nonunique = NonUnique::stop; ///< what to do where the solution is not unique
    Method method = Method::dop853;
};

namespace detail {

/// The same for N components, of which there are n.
/// @error std::invalid_argument for a number of tolerances that is neither one nor n
template <int N> Settings<double, N> sized_settings(const RunSettings& s, int n) {
    if (s.atol.size() != 1 && s.atol.size() != std::size_t(n))
        refuse("atol.size()", double(s.atol.size()), "expected one entry, or dim");
    Settings<double, N> own;
    own.rtol = s.rtol;
    for (int i = 0; i < N; ++i) // of components that there are not nothing may be divided by zero
        own.atol[i] = i >= n ? 1.0 : s.atol[s.atol.size() == 1 ? 0 : std::size_t(i)];
    own.max_step = s.max_step;
    own.first_step = s.first_step;
    own.max_steps = s.max_steps;
    own.max_events = s.max_events;
    own.on_nonunique = s.on_nonunique;
    return own;
}

} // namespace detail

} // namespace filippov
