#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Measures what the tests reach, lines and branches: of the headers by the C++ tests, of the Python
# layer by its tests. Reports in build/coverage/{cpp,python}. Needs what `scripts/setup.sh test`
# installs and, in .venv, filippov with the packages of filippov[test].
#
#   scripts/coverage.sh cpp [test ...]   by these tests alone: test_roots, ...
#   scripts/coverage.sh python
#   scripts/coverage.sh                  both, an hour on two cores
#
# Where tests fail, the report is made nevertheless, and the exit status is 1.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

failed=0
pip=(.venv/bin/python -m pip install --quiet --disable-pip-version-check)

cpp() {
    local folder=build/coverage
    export OMP_NUM_THREADS=1 # counters that several threads share would take most of the time
    "${pip[@]}" gcovr
    # Counters make tests so slow that those of a minute take more than the usual bound.
    cmake -S . -B $folder -G Ninja -DCMAKE_BUILD_TYPE=Debug -DFILIPPOV_BUILD_CHECKS=OFF \
        -DFILIPPOV_TEST_TIMEOUT=3600 \
        -DFILIPPOV_CHECK_HEADERS=OFF -DFILIPPOV_BUILD_BENCH=OFF -DFILIPPOV_BUILD_EXAMPLES=OFF \
        -DCMAKE_CXX_FLAGS_DEBUG="-O0 -g1 --coverage -DFILIPPOV_NO_FORCED_INLINING"
    find $folder -name '*.gcda' -delete
    if [ $# -gt 0 ]; then
        cmake --build $folder --target "$@"
        for test in "$@"; do
            $folder/tests/"$test" || failed=1
        done
    else
        cmake --build $folder
        ctest --test-dir $folder --output-on-failure -LE long --parallel "$(nproc)" || failed=1
    fi
    mkdir -p $folder/cpp
    # Branches are those of the programs' own: not those by which exceptions might leave.
    .venv/bin/gcovr --root . --object-directory $folder --filter include/filippov \
        --exclude-throw-branches --exclude-unreachable-branches --merge-mode-functions=separate --merge-lines \
        --gcov-ignore-parse-errors=all \
        --html-details $folder/cpp/index.html --json-summary $folder/cpp/summary.json \
        --txt $folder/cpp/lines.txt --print-summary $folder/tests
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
