#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Installs the Python package into .venv with everything it needs, and runs the first example. Run
# again, it compiles what is missing or has changed.
set -euo pipefail
cd "$(dirname "$0")/.."

scripts/setup.sh
echo "quickstart: building and installing filippov; the log is build/quickstart.log"
mkdir -p build
# of all that pip says, which file of how many is compiled
if ! .venv/bin/python -m pip install --verbose --disable-pip-version-check \
    --no-build-isolation -C build-dir=build/package ".[plot]" 2>&1 |
    tee build/quickstart.log |
    sed -nu 's|^ *\(\[[0-9]*/[0-9]*\]\) Building CXX object .*/\([^/]*\)\.cpp\.o$|quickstart: \1 \2|p'; then
    tail -n 40 build/quickstart.log
    exit 1
fi
.venv/bin/python examples/01_quickstart.py
