#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Measures what the tests reach, lines and branches: of the headers by the C++ tests, of the Python
# layer by its tests. Reports in build/coverage/{cpp,python}. Needs what `scripts/setup.sh test`
# installs, Debian's llvm-16, and, in .venv, filippov with the packages of filippov[test].
#
#   scripts/coverage.sh cpp [test ...]   by these tests alone: test_roots, ...
#   scripts/coverage.sh python
#   scripts/coverage.sh                  both, an hour and a half on two cores
#
# Where tests fail, the report is made nevertheless, and the exit status is 1.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

failed=0
pip=(.venv/bin/python -m pip install --quiet --disable-pip-version-check)

cpp() {
    local folder=build/coverage tests=("$@")
    export OMP_NUM_THREADS=1 # counters that several threads share are not exact
    # Counters make tests so slow that those of a minute take more than the usual bound.
    CXX=clang++-16 cmake -S . -B $folder -G Ninja -DCMAKE_BUILD_TYPE=Debug \
        -DFILIPPOV_BUILD_CHECKS=OFF -DFILIPPOV_TEST_TIMEOUT=3600 -DFILIPPOV_CHECK_HEADERS=OFF \
        -DFILIPPOV_BUILD_BENCH=OFF -DFILIPPOV_BUILD_EXAMPLES=OFF -DCMAKE_CXX_FLAGS_DEBUG="-O0 \
        -fprofile-instr-generate -fcoverage-mapping -DFILIPPOV_NO_FORCED_INLINING"
    rm -rf $folder/profiles
    export LLVM_PROFILE_FILE=$PWD/$folder/profiles/%m.profraw
    if [ $# -gt 0 ]; then
        cmake --build $folder --target "$@"
        for test in "$@"; do
            $folder/tests/"$test" || failed=1
        done
    else
        cmake --build $folder
        ctest --test-dir $folder --output-on-failure -LE long --parallel "$(nproc)" || failed=1
        mapfile -t tests < <(cd $folder/tests && find . -maxdepth 1 -name "test_*" -executable)
    fi
    llvm-profdata-16 merge --sparse $folder/profiles/*.profraw -o $folder/all.profdata
    mkdir -p $folder/cpp
    python3 scripts/merge_coverage.py $folder/all.profdata $folder/cpp \
        "${tests[@]/#/$folder/tests/}"
}

python() {
    "${pip[@]}" pytest-cov
    MPLBACKEND=Agg .venv/bin/python -m pytest python/tests --cov=filippov --cov-branch \
        --cov-report=term:skip-covered --cov-report=html:build/coverage/python || failed=1
}

if [ $# -gt 0 ]; then
    "$@"
else
    cpp
    python
fi
exit $failed
