#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Looks for faults longer and in more ways than scripts/test.sh has time for. Needs what
# `scripts/setup.sh test` installs, clang 16 with it.
#
#   scripts/stress.sh              all of it, some hours on two cores
#   scripts/stress.sh sanitize     all tests with the address and undefined behaviour sanitizers
#   scripts/stress.sh thread       what uses threads, with the thread sanitizer
#   scripts/stress.sh bindings [test]  the Python package's compiled modules with the same two
#                                  sanitizers; pytest's arguments, or the tests that reach them most
#   scripts/stress.sh memory       wrong arguments and parameters that were not given, with the
#                                  memory sanitizer
#   scripts/stress.sh valgrind     the C++ examples in valgrind
#   scripts/stress.sh compilers    hard cases and accuracy with g++ and clang, -O0 to -O3, with fused
#                                  products and without, with and without assertions
#   scripts/stress.sh fuzz [600]   each fuzzer for so many seconds
#   scripts/stress.sh bench        all benchmarks' answers
#   scripts/stress.sh campaign     a million random runs against their exact solutions
set -euo pipefail
cd "$(dirname "$0")/.."

sanitize() {
    CXX=clang++-16 cmake --preset sanitize -DFILIPPOV_TESTS=all -DFILIPPOV_BUILD_EXAMPLES=ON
    cmake --build --preset sanitize
    ctest --preset sanitize
}

thread() {
    cmake --preset thread
    local tests=(test_parallel test_ensemble test_diagram test_cells test_basins)
    cmake --build --preset thread --target "${tests[@]}"
    # OpenMP's own locks are not instrumented: its tool tells the sanitizer of them
    local archer
    archer=$(find /usr/lib/llvm-16/lib -name libarcher.so | head -n 1)
    for test in "${tests[@]}"; do
        OMP_TOOL_LIBRARIES=$archer TSAN_OPTIONS=ignore_noninstrumented_modules=1:halt_on_error=1 \
            OMP_NUM_THREADS=4 "build/thread/tests/$test"
    done
}

bindings() {
    local folder=$PWD/build/bindings flags tests=("$@")
    if [ $# -eq 0 ]; then
        tests=(python/tests/test_{seam,ensemble,bad_input,wrong_calls,definitions,own_systems}.py
            python/tests/test_{system,trajectory,event,several_surfaces,diagram,lyapunov}.py
            python/tests/test_{maps,orbit,branch,basins,boundary,results,geometry}.py
            python/tests/test_hard_cases_*.py)
    fi
    # alignment too: modules that are compiled for several instruction sets differ in that first
    flags="-fsanitize=address,undefined -fno-sanitize=null,object-size,pointer-overflow"
    flags+=" -fno-sanitize-recover=all -fno-omit-frame-pointer -g1 -D_GLIBCXX_ASSERTIONS"
    # beside the package in .venv, which stays as it is
    CC=gcc CXX=g++ .venv/bin/python -m pip install --quiet --disable-pip-version-check \
        --no-build-isolation --no-deps --upgrade --target "$folder/site" \
        -C build-dir="$folder/build" -C cmake.define.FILIPPOV_LEAN=ON \
        -C cmake.define.FILIPPOV_LANES=all -C cmake.define.CMAKE_CXX_FLAGS="$flags" .
    # Python itself is not sanitized: its runtime has to come first, and it never frees all
    (
        export LD_PRELOAD="$(g++ -print-file-name=libasan.so):$(g++ -print-file-name=libubsan.so)"
        export ASAN_OPTIONS=detect_leaks=0 UBSAN_OPTIONS=print_stacktrace=1
        export PYTHONPATH=$folder/site PYTHONMALLOC=malloc MPLBACKEND=Agg
        for level in $(.venv/bin/python -c \
            'import filippov._runs.lanes as lanes; print(*lanes.instruction_sets())'); do
            echo "== lanes: $level"
            FILIPPOV_SIMD=$level .venv/bin/python -m pytest -p no:cacheprovider "${tests[@]}"
        done
    )
}

memory() {
    # one program, all of it instrumented: Catch2's library is not
    mkdir -p build/memory
    clang++-16 -std=c++20 -O0 -g1 -fsanitize=memory -fno-sanitize-recover=all \
        -DFILIPPOV_NO_FORCED_INLINING -Iinclude -isystem /usr/include/eigen3 \
        tests/memory/main.cpp -o build/memory/arguments
    build/memory/arguments
}

valgrind() {
    cmake --preset as-used
    local examples=(examples/*.cpp)
    examples=("${examples[@]#examples/}")
    examples=("${examples[@]%.cpp}")
    cmake --build --preset as-used --target "${examples[@]/#/example_}"
    for example in "${examples[@]}"; do
        (cd build/as-used/examples && OMP_NUM_THREADS=1 command valgrind --quiet \
            --error-exitcode=1 --leak-check=full --errors-for-leak-kinds=definite \
            "./$example" >/dev/null)
    done
}

compilers() {
    local tests=(test_accuracy test_hard_cases_impacts test_hard_cases_limits
        test_hard_cases_location test_hard_cases_modes test_hard_cases_scale
        test_hard_cases_surfaces)
    local folder=build/stress
    mkdir -p build
    # the library says -ffp-contract=off; what comes last holds
    printf '#!/bin/sh\nexec g++ "$@" -mavx2 -mfma -ffp-contract=fast\n' >build/g++-fused
    printf '#!/bin/sh\nexec clang++-16 "$@" -mavx2 -mfma -ffp-contract=fast\n' >build/clang++-fused
    chmod +x build/g++-fused build/clang++-fused
    for compiler in g++ clang++-16 "$PWD/build/g++-fused" "$PWD/build/clang++-fused"; do
        for flags in "-O0 -D_GLIBCXX_ASSERTIONS" "-O1" "-O2 -DNDEBUG" "-O3 -DNDEBUG"; do
            echo "== $compiler $flags"
            cmake -S . -B "$folder" --fresh -G Ninja -DCMAKE_CXX_COMPILER="$compiler" \
                -DCMAKE_BUILD_TYPE=None -DCMAKE_CXX_FLAGS="$flags" \
                -DFILIPPOV_BUILD_CHECKS=OFF -DFILIPPOV_BUILD_BENCH=OFF >/dev/null
            cmake --build "$folder" --target "${tests[@]}"
            for test in "${tests[@]}"; do
                "$folder/tests/$test"
            done
        done
    done
}

fuzz() {
    local seconds=${1:-600}
    CXX=clang++-16 cmake --preset sanitize -DFILIPPOV_FUZZERS=ON
    cmake --build --preset sanitize --target fuzzer_definition
    mkdir -p build/fuzz/definition build/fuzz/stores build/fuzz/formulas
    build/sanitize/tests/fuzzer_definition -max_total_time="$seconds" -timeout=20 -max_len=400 \
        -artifact_prefix=build/fuzz/ build/fuzz/definition
    .venv/bin/python -m pip install --quiet atheris
    for what in stores formulas; do
        .venv/bin/python tests/fuzz/python_surface.py "$what" -max_total_time="$seconds" \
            -timeout=60 -max_len=400 -artifact_prefix=build/fuzz/ "build/fuzz/$what"
    done
}

bench() {
    cmake --preset bench
    cmake --build --preset bench
    ctest --preset bench
}

campaign() {
    cmake --preset bench
    cmake --build --preset bench --target bench_stability bench_strangers
    build/bench/bench/bench_stability --problems 22000
    build/bench/bench/bench_strangers --runs 300000
    .venv/bin/python bench/strangers.py --problems 2000 --processes "$(nproc)"
}

if [ $# -gt 0 ]; then
    "$@"
else
    for stage in sanitize thread memory bindings valgrind compilers fuzz bench campaign; do
        "$stage"
    done
fi
