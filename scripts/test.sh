#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Sets up and passes every check: C++ tests with sanitizers by clang, those that depend on how they
# are compiled with g++ -O3 as users build them, those that compute for long, examples, campaigns of
# random problems, the Python package, format, types, instruction counts of fixed runs, the programs in
# README and docs. (Answers of the other benchmarks: `scripts/stress.sh bench`.)
#
# Time is kept by building each thing once: a test with all sanitizers, or by g++ (without fused
# products all round alike; `scripts/stress.sh sanitize` has every test with sanitizers, the preset
# release with -O3), each header alone by clang; without those checks of every pointer that the
# address sanitizer makes anyway (the preset ubsan has all), and without line numbers in what the
# sanitizers find; lanes for this machine alone; and by ccache, where it is installed.
# FILIPPOV_LEAN=ON in the environment compiles campaigns, examples and the Python package in half the
# time, for runs that take twice as long.
set -euo pipefail
cd "$(dirname "$0")/.."

step() {
    printf '\n== %s (%d s)\n' "$*" "$SECONDS"
}

export CMAKE_BUILD_PARALLEL_LEVEL=${CMAKE_BUILD_PARALLEL_LEVEL:-$(nproc)}
export CTEST_PARALLEL_LEVEL=${CTEST_PARALLEL_LEVEL:-$(nproc)}
if command -v ccache >/dev/null; then
    export CMAKE_CXX_COMPILER_LAUNCHER=${CMAKE_CXX_COMPILER_LAUNCHER-ccache}
    # Another clone of the repository may use the results too.
    export CCACHE_BASEDIR=$PWD CCACHE_NOHASHDIR=1
fi

step "setup"
scripts/setup.sh test

step "Python package"
pip=(.venv/bin/python -m pip install --quiet --disable-pip-version-check)
rm -rf build/wheel
.venv/bin/python -m pip wheel --quiet --disable-pip-version-check --no-build-isolation --no-deps \
    -w build/wheel -C build-dir=build/python -C cmake.define.FILIPPOV_GSL=ON \
    -C cmake.define.FILIPPOV_LEAN="${FILIPPOV_LEAN:-OFF}" .
wheel=$(echo build/wheel/*.whl)
"${pip[@]}" "$wheel[docs,test]"
"${pip[@]}" --force-reinstall --no-deps "$wheel" # the version does not tell it from one before

step "its wheel in an empty environment"
scripts/try_wheel.sh "$wheel" .venv/bin/python

step "format and types"
scripts/format.sh --check
if [ -f python/filippov/__init__.py ]; then
    .venv/bin/mypy
fi

step "instructions of fixed runs"
.venv/bin/python scripts/count_instructions.py

step "programs in README and docs"
.venv/bin/python scripts/check_snippets.py

step "documentation site"
scripts/docs.sh

build() {
    step "build: $1"
    cmake --preset "$@" -DFILIPPOV_LEAN="${FILIPPOV_LEAN:-OFF}"
    cmake --build --preset "$1"
}
build as-used
flags="-O0 -g0" # what a sanitizer finds names its functions; the preset as it stands names lines, too
if command -v clang++-16 >/dev/null; then
    export CXX=clang++-16
    flags+=" -mllvm -asan-instrumentation-with-call-threshold=0" # checks are calls
fi
build sanitize -DFILIPPOV_TESTS=short -DFILIPPOV_BUILD_EXAMPLES=OFF "-DCMAKE_CXX_FLAGS_DEBUG=$flags"

for preset in as-used sanitize; do
    step "C++ tests: $preset"
    ctest --preset "$preset"
done

step "Python tests"
MPLBACKEND=Agg .venv/bin/python -m pytest --numprocesses="$(nproc)" --dist=worksteal
