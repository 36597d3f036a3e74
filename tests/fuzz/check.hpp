// SPDX-License-Identifier: BSD-3-Clause
// What a fuzzer's entry points need.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>

/// Ends the program where a fuzzer sees it.
#define CHECK_THAT(...)                                                                            \
    do {                                                                                           \
        if (!(__VA_ARGS__)) {                                                                      \
            std::fprintf(stderr, "%s:%d: not so: %s\n", __FILE__, __LINE__, #__VA_ARGS__);         \
            std::abort();                                                                          \
        }                                                                                          \
    } while (false)

/// The entry point, by the name that libFuzzer gives it.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);
