#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Installs the Python package into .venv with everything it needs, and runs the first example.
set -euo pipefail
cd "$(dirname "$0")/.."

scripts/setup.sh
echo "quickstart: building and installing filippov"
.venv/bin/python -m pip install --quiet --disable-pip-version-check ".[plot]"
.venv/bin/python examples/01_quickstart.py
