// SPDX-License-Identifier: BSD-3-Clause
// How many instructions do fixed runs take? Programs whose runs scripts/count_instructions.py
// counts one by one, each in a process of its own: what a run allocates is then not for the next to
// find.
#pragma once

#include <Eigen/Core>

#include <cstdio>
#include <cstring>
#include <functional>
#include <string>
#include <vector>

#if __has_include(<gnu/libc-version.h>)
#include <gnu/libc-version.h>
#endif

namespace filippov::bench {

/// One run, the same each time.
struct Run {
    std::string name;
    std::string beside;         ///< the hand-written loop's run of the same, empty if there is none
    std::function<bool()> done; ///< runs it; false if what came of it is wrong
};

/// `9` as it stands in names: 1e-9.
inline std::string at(int digits) { return ", 1e-" + std::to_string(digits); }

/// What counts depend on, other than the sources and the flags.
inline void tell_build() {
#ifdef __clang__
    std::printf("compiler\tclang %d.%d.%d\n", __clang_major__, __clang_minor__,
                __clang_patchlevel__);
#elif defined(__GNUC__)
    std::printf("compiler\tgcc %d.%d.%d\n", __GNUC__, __GNUC_MINOR__, __GNUC_PATCHLEVEL__);
#endif
#ifdef __GLIBC__
    std::printf("libc\tglibc %s\n", gnu_get_libc_version());
#endif
    std::printf("eigen\t%d.%d.%d\n", EIGEN_WORLD_VERSION, EIGEN_MAJOR_VERSION, EIGEN_MINOR_VERSION);
}

} // namespace filippov::bench

/// What is counted: the instructions between its first and its last, and in what it calls.
extern "C" [[gnu::noinline]] bool counted_run(const std::function<bool()>& done);
extern "C" bool counted_run(const std::function<bool()>& done) { return done(); }

namespace filippov::bench {

/// The main of a program with these runs.
///
///   program --build    what it was built by
///   program --list     names of runs, and beside which one they stand
///   program NAME       takes that run twice, the second time to be counted
inline int main_of(const std::vector<Run>& runs, int argc, char** argv) {
    const std::string what = argc == 2 ? argv[1] : "";
    if (what == "--build") {
        tell_build();
        return 0;
    }
    for (const Run& run : runs) {
        if (what == "--list")
            std::printf("%s\t%s\n", run.name.c_str(), run.beside.c_str());
        else if (what == run.name) {
            // the first fills what stays: tables, and the lists of the allocator
            const bool right = run.done() && counted_run(run.done);
            if (!right)
                std::fprintf(stderr, "%s: wrong\n", run.name.c_str());
            return right ? 0 : 1;
        }
    }
    if (what != "--list")
        std::fprintf(stderr, "expected --build, --list or the name of a run\n");
    return what == "--list" ? 0 : 2;
}

} // namespace filippov::bench
