#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Formats and lints everything: clang-format, ruff, and clang-tidy if asked.
#
#   scripts/format.sh            rewrite the files
#   scripts/format.sh --check    change nothing, fail where something would change
#   scripts/format.sh --tidy     also clang-tidy, over build/dev (slow); may be given with --check
set -euo pipefail
cd "$(dirname "$0")/.."

check=no
tidy=no
for option in "$@"; do
    case $option in
    --check) check=yes ;;
    --tidy) tidy=yes ;;
    *)
        echo "format: unknown option $option" >&2
        exit 2
        ;;
    esac
done

# The versions of .venv are the ones that count: they are pinned by pyproject.toml.
PATH=$PWD/.venv/bin:$PATH
for program in clang-format ruff; do
    command -v "$program" >/dev/null || {
        echo "format: $program was not found; pip install '.[test]' brings it" >&2
        exit 1
    }
done

mapfile -t files < <(find include python tests bench examples -name '*.hpp' -o -name '*.cpp' | sort)
if [ $check = yes ]; then
    clang-format --dry-run -Werror "${files[@]}"
    ruff format --quiet --check
    ruff check --quiet
else
    clang-format -i "${files[@]}"
    ruff format --quiet
    ruff check --quiet --fix
fi

if [ $tidy = yes ]; then
    cmake --preset dev >/dev/null
    # Every header is a file of its own below alone/; tests and benchmarks follow.
    mapfile -t units < <(find build/dev/tests/alone tests bench examples -name '*.cpp' \
        -not -path 'tests/refuse/*' -not -path 'tests/consumer/*' | sort)
    printf '%s\n' "${units[@]}" |
        xargs -P "$(nproc)" -n 1 clang-tidy -p build/dev --quiet 2> >(grep -v ' generated\.$' >&2)
fi
echo "format: ${#files[@]} C++ files and all Python files are in form"
