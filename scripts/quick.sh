#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# The quick checks, in less than ten minutes on two cores, once scripts/develop.sh has run.
#
#   scripts/quick.sh              format, floors, types, and the Python tests that are not slow
#   scripts/quick.sh test_guards  one C++ test, or several, built and run (the preset dev)
set -euo pipefail
cd "$(dirname "$0")/.."

if [ $# -gt 0 ]; then
    [ -f build/dev/build.ninja ] || cmake --preset dev -DFILIPPOV_CHECK_HEADERS=OFF >/dev/null
    cmake --build --preset dev --target "$@"
    for test in "$@"; do
        "build/dev/tests/$test"
    done
    exit
fi
scripts/format.sh --check
python3 scripts/check_floors.py
.venv/bin/mypy
MPLBACKEND=Agg .venv/bin/python -m pytest --quiet --numprocesses="$(nproc)" --dist=worksteal \
    -m "not slow"
