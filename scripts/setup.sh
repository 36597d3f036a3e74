#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Sets up what is missing: system packages (on Debian and its relatives, by apt) and .venv.
#
#   scripts/setup.sh        what the package and the examples need
#   scripts/setup.sh test   also what the C++ tests and benchmarks need
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

fail() {
    echo "setup: $*" >&2
    exit 1
}

command -v python3 >/dev/null || fail "python3 was not found. Install Python 3.10 or newer."
python3 -c 'import sys; sys.exit(sys.version_info < (3, 10))' ||
    fail "$(command -v python3) is $(python3 --version 2>&1); 3.10 or newer is needed."

# What a Python needs in order to make .venv and to build against.
python_is_complete() {
    python3 -c '
import os, sys, sysconfig
try:
    import ensurepip, venv
except ImportError:
    sys.exit(1)
sys.exit(not os.path.exists(os.path.join(sysconfig.get_path("include"), "Python.h")))'
}

packages=(cmake ninja-build)
if [ "${1:-}" = test ]; then
    packages+=(catch2 libeigen3-dev libboost-dev libgsl-dev libcli11-dev nlohmann-json3-dev
        chromium chromium-driver doxygen valgrind)
    # A second compiler, where the system has one that is new enough.
    if apt-cache show clang-16 >/dev/null 2>&1; then
        packages+=(clang-16 libclang-rt-16-dev libomp-16-dev)
    fi
fi
# A compiler and a Python from elsewhere serve as well as Debian's.
command -v c++ >/dev/null || packages+=(g++)
python_is_complete || packages+=(python3-venv python3-dev)

installed() {
    [ "$(dpkg-query -W -f '${db:Status-Status}' "$1" 2>/dev/null)" = installed ]
}

if command -v apt-get >/dev/null; then
    missing=()
    for package in "${packages[@]}"; do
        installed "$package" || missing+=("$package")
    done
    if [ ${#missing[@]} -gt 0 ]; then
        echo "setup: installing ${missing[*]}"
        as_root=()
        if [ "$(id -u)" -ne 0 ]; then
            command -v sudo >/dev/null ||
                fail "run this as root, or: apt-get install ${missing[*]}"
            as_root=(sudo)
        fi
        apt() {
            "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -qq -o Dpkg::Use-Pty=0 "$@" </dev/null
        }
        apt update || echo "setup: apt-get update failed; trying the package lists at hand" >&2
        apt install -y --no-install-recommends "${missing[@]}" >/dev/null ||
            fail "apt-get install ${missing[*]} failed."
    fi
else
    command -v c++ >/dev/null || fail "no C++ compiler was found."
    for program in cmake ninja; do
        command -v "$program" >/dev/null || fail "$program was not found. Install it."
    done
fi
python_is_complete || fail "$(command -v python3) lacks venv or the header Python.h."

if ! .venv/bin/python -c 'import pip' 2>/dev/null; then
    echo "setup: making .venv with $(python3 --version)"
    rm -rf .venv
    python3 -m venv .venv
    .venv/bin/python -m pip install --quiet --disable-pip-version-check --upgrade pip ||
        echo "setup: pip could not be upgraded; going on with the one at hand" >&2
fi
# What building the package needs (pyproject.toml), so that its build folder outlives a build: what
# pip brings for one build lies elsewhere in the next, which would compile all anew.
.venv/bin/python -m pip install --quiet --disable-pip-version-check \
    "scikit-build-core>=0.10" "pybind11>=2.13" "cmeel-eigen>=3.4"
