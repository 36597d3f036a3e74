#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Installs the package into .venv so that the files of python/filippov are used where they lie: a
# change in Python counts at once. After a change in C++ run it again: it compiles what has changed.
set -euo pipefail
cd "$(dirname "$0")/.."

scripts/setup.sh
pip=(.venv/bin/python -m pip install --quiet --disable-pip-version-check)
if command -v ccache >/dev/null; then
    export CMAKE_CXX_COMPILER_LAUNCHER=${CMAKE_CXX_COMPILER_LAUNCHER-ccache}
fi
echo "develop: compiling what has changed (the first time for some ten minutes)"
"${pip[@]}" --no-build-isolation --editable ".[docs,plot,test]" \
    -C build-dir=build/develop -C cmake.define.FILIPPOV_LEAN=ON
