// SPDX-License-Identifier: BSD-3-Clause
// The private compiled module. Its typed face is the Python package around it.
#include "bind.hpp"
#include "lanes/seam.hpp"

#include <filippov/version.hpp>

namespace {

#if defined(__clang__)
constexpr const char* compiler = "clang " __clang_version__;
#elif defined(__GNUC__)
constexpr const char* compiler = "g++ " __VERSION__;
#else
constexpr const char* compiler = "unknown";
#endif

} // namespace

PYBIND11_MODULE(_core, m, pybind11::mod_gil_not_used()) {
    namespace fpy = filippov::python;
    m.attr("__version__") = FILIPPOV_VERSION;
    m.attr("seam") = fpy::seam();
    fpy::bind_run(m);
    fpy::bind_system(m);
    fpy::bind_trajectory(m);
    fpy::bind_diagram(m);
    fpy::bind_ensemble(m);
    fpy::bind_cells(m);
    fpy::bind_basins(m);
    fpy::bind_orbit(m);
    fpy::bind_maps(m);
    fpy::bind_geometry(m);
    fpy::bind_formulas(m);

    pybind11::dict config;
    config["compiler"] = compiler;
    config["cxx"] = static_cast<long>(__cplusplus);
    config["eigen"] = std::to_string(EIGEN_WORLD_VERSION) + "." +
                      std::to_string(EIGEN_MAJOR_VERSION) + "." +
                      std::to_string(EIGEN_MINOR_VERSION);
#ifdef NDEBUG
    config["assertions"] = false;
#else
    config["assertions"] = true;
#endif
#ifdef FILIPPOV_LEAN
    config["lean"] = true;
#else
    config["lean"] = false;
#endif
#if defined(__AVX512F__)
    config["simd"] = "avx512";
#elif defined(__AVX2__)
    config["simd"] = "avx2";
#elif defined(__SSE2__)
    config["simd"] = "sse2";
#elif defined(__ARM_NEON)
    config["simd"] = "neon";
#else
    config["simd"] = "none";
#endif
#ifdef _OPENMP
    config["threads"] = "OpenMP";
#else
    config["threads"] = "none";
#endif
    m.attr("config") = config;
}
