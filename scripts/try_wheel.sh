#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Installs a wheel into an empty environment and uses it there.
#
#   scripts/try_wheel.sh dist/filippov-....whl [python3.10]
set -euo pipefail

wheel=$(realpath "$1")
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
"${2:-python3}" -m venv "$scratch/user"
"$scratch/user/bin/python" -m pip install --quiet --disable-pip-version-check "$wheel"
cd "$scratch"
user/bin/python - <<'END'
import filippov as fp

run = fp.simulate(fp.models.oscillator, [0, 0], (0, 50), params={"A": 0.5})
ends = fp.ensemble(fp.models.oscillator, [[0, 1], [0, 0]], (0, 50))
assert run.success and (ends.status == "ok").all()
print(run)
END
