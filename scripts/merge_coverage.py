# SPDX-License-Identifier: BSD-3-Clause
"""Add up what C++ tests reach of the headers: lines and branches.

A template or an inline function is compiled anew in every test, and llvm-cov, given several
programs at once, drops those whose copies differ. So each test is asked alone, and the counts of
one place in the source are added.

    merge_coverage.py PROFILE FOLDER TEST...   writes FOLDER/files.txt and FOLDER/missed.txt
"""

import json
import subprocess
import sys
from collections import Counter, defaultdict
from pathlib import Path

HEADERS = "include/filippov"


def export(profile: str, test: str, kind: str, *options: str) -> bytes:
    """Ask llvm-cov about one test."""
    command = ["llvm-cov-16", "export", f"--format={kind}", f"--instr-profile={profile}", *options]
    return subprocess.run([*command, test, HEADERS], check=True, capture_output=True).stdout


def main(profile: str, folder: str, *tests: str) -> None:
    """Add the counts of all tests, write both files, and print the totals."""
    lines: dict[str, Counter[int]] = defaultdict(Counter)  # by file: how often each line ran
    branches: dict[str, dict[tuple[int, int], list[int]]] = defaultdict(
        lambda: defaultdict(lambda: [0, 0])  # how often each way was gone
    )
    for test in tests:
        for line in export(profile, test, "lcov", "--skip-branches").decode().splitlines():
            what, _, rest = line.partition(":")
            if what == "SF":
                name = rest
            elif what == "DA":
                number, count = map(int, rest.split(",")[:2])
                lines[name][number] += count
        (found,) = json.loads(export(profile, test, "text", "--skip-functions"))["data"]
        for file in found["files"]:
            for line, column, _, _, taken, passed, *_ in file["branches"]:
                both = branches[file["filename"]][line, column]
                both[0] += taken
                both[1] += passed
    total: Counter[str] = Counter()
    reports = Path(folder)
    with (reports / "files.txt").open("w") as table, (reports / "missed.txt").open("w") as missed:
        for name in sorted(lines):
            short = name[name.rindex(HEADERS) + len(HEADERS) + 1 :]
            ways = [count for both in branches[name].values() for count in both]
            here = {
                "lines": len(lines[name]),
                "lines missed": sum(count == 0 for count in lines[name].values()),
                "branches": len(ways),
                "branches missed": sum(count == 0 for count in ways),
            }
            total.update(here)
            row = "".join(f"{here[key]:>8}" for key in here)
            print(f"{short:<32}{row}", file=table)
            text = Path(name).read_text().splitlines()
            for number in sorted(number for number, count in lines[name].items() if count == 0):
                print(f"{short}:{number}: {text[number - 1].strip()}", file=missed)
            for (number, column), both in sorted(branches[name].items()):
                if min(both) == 0 < max(both):
                    way = "true" if both[0] == 0 else "false"
                    print(f"{short}:{number}:{column}: never {way}", file=missed)
    for what in ("lines", "branches"):
        share = 1 - total[f"{what} missed"] / total[what]
        print(f"{what}: {100 * share:.1f}% of {total[what]}")


if __name__ == "__main__":
    main(*sys.argv[1:])
