// SPDX-License-Identifier: BSD-3-Clause
// The only macros of the library (besides the version).
#pragma once

#if !defined(__cpp_exceptions) && !defined(_CPPUNWIND)
#error "filippov: wrong arguments are refused by exceptions: compile without -fno-exceptions"
#endif

// Without optimisation forced inlining only makes code larger, and with sanitizers very much
// larger: such builds define FILIPPOV_NO_FORCED_INLINING.
#if (defined(__GNUC__) || defined(__clang__)) && defined(__OPTIMIZE__) &&                          \
    !defined(FILIPPOV_NO_FORCED_INLINING)
/// The step loop is written as many short functions; the ones inside a stage must not become calls.
#define FILIPPOV_INLINE [[gnu::always_inline]] inline
#define FILIPPOV_LAMBDA_INLINE __attribute__((always_inline))
/// Everything called from here, the user's field included, is inlined: the chain from stage to
/// stage must not go through memory.
#define FILIPPOV_FLATTEN [[gnu::flatten]]
#define FILIPPOV_COLD [[gnu::cold, gnu::noinline]]
/// Large and called from many places: dual arithmetic inlined everywhere compiles for minutes.
#define FILIPPOV_NOINLINE [[gnu::noinline]]
#else
#define FILIPPOV_INLINE inline
#define FILIPPOV_LAMBDA_INLINE
#define FILIPPOV_FLATTEN
#define FILIPPOV_COLD
#define FILIPPOV_NOINLINE
#endif

#if defined(__GNUC__) || defined(__clang__)
/// Never reached: a switch needs no test for it.
#define FILIPPOV_UNREACHABLE() __builtin_unreachable()
#else
#define FILIPPOV_UNREACHABLE() ((void)0)
#endif

/// Functions of the library filippov::compiled, where a program has that; else they are inline.
#ifdef FILIPPOV_COMPILED
#define FILIPPOV_IN_LIBRARY
#else
#define FILIPPOV_IN_LIBRARY inline
#endif
