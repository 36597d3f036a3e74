#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Sets up and passes every check: C++ tests (-O3), the same with sanitizers, examples, benchmarks'
# answers, the Python package, format, types, the programs in README and docs.
#
# Time is kept by building each thing once: one sanitizer build for all three sanitizers, without the
# benchmarks and without the checks of headers and consumers, which the first build has, and without
# those checks of every pointer that the address sanitizer makes anyway (the preset ubsan has all);
# and by ccache, where it is installed.
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
"${pip[@]}" "scikit-build-core>=0.10" "pybind11>=2.13"
"${pip[@]}" --no-build-isolation -C build-dir=build/python ".[test]"

step "format and types"
scripts/format.sh --check
if [ -f python/filippov/__init__.py ]; then
    .venv/bin/mypy
fi

step "programs in README and docs"
.venv/bin/python scripts/check_snippets.py

for preset in release sanitize; do
    step "build: $preset"
    cmake --preset "$preset"
    cmake --build --preset "$preset"
done

for preset in release sanitize; do
    step "C++ tests: $preset"
    ctest --preset "$preset"
done

step "Python tests"
MPLBACKEND=Agg .venv/bin/python -m pytest
