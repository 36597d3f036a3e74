// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace filippov::python {

/// Name of the best instruction set of this processor that lanes can be compiled for.
inline const char* instruction_set() {
#if defined(__x86_64__) && defined(__GNUC__)
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
        __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512bw"))
        return "avx512";
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"))
        return "avx2";
#endif
    return "baseline";
}

} // namespace filippov::python
