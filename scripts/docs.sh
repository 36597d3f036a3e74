#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Builds the documentation site in build/site: every warning, dead links and dead references among
# them, is an error. Needs Doxygen and, in .venv, filippov and the packages of filippov[docs].
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

site=build/site
rm -rf "$site" docs/reference/generated
mkdir -p "$site"
(cat docs/Doxyfile; echo "PROJECT_NUMBER = $(sed -n 's/#define FILIPPOV_VERSION "\(.*\)"/\1/p' include/filippov/version.hpp)") | doxygen -
.venv/bin/python -m sphinx --fail-on-warning --keep-going --quiet -c docs -b html . "$site"
rm -rf docs/reference/generated
echo '<meta http-equiv="refresh" content="0; url=docs/index.html">' >"$site/index.html"
echo "docs: $site/index.html"
