#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Count the instructions of fixed runs, and compare them with those that are kept.

The programs of ``bench/instructions`` are compiled with fixed flags, and each of their runs is
taken alone in valgrind's callgrind, which counts the instructions of the run and of nothing else.
The counts are compared with ``bench/instructions/counts.json``, and the table in
``docs/benchmarks.md`` with that file. A run that takes more than 2% more instructions fails, as
does one that is in the file or in the programs alone. Counts by another compiler, C library or
Eigen do not compare: they are printed and judge nothing (``--strict``: that fails, too).

    scripts/count_instructions.py                                       compare
    scripts/count_instructions.py --update --write docs/benchmarks.md   keep what was found
    scripts/count_instructions.py --repeat 10                           are counts reproducible?

What could differ between two machines is fixed: the instruction set, the functions that the C
library chooses by the processor, and the environment, which moves the stack. Nothing has threads.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import re
import shutil
import subprocess
import sys
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
SOURCES = ROOT / "bench" / "instructions"
KEPT = SOURCES / "counts.json"
PAGE = ROOT / "docs" / "benchmarks.md"
BEGIN, END = "<!-- instructions: scripts/count_instructions.py -->", "<!-- end of instructions -->"

LIMIT = 0.02  # of a change that is no matter
PROGRAMS = ["oscillator", "formulas", "systems"]  # compiled from the last, in the longest time
# As the preset release, whose flags are a user's. Valgrind knows no AVX-512 and not all of AVX2.
FLAGS = ["-std=c++20", "-O3", "-DNDEBUG", "-ffp-contract=off"]
if platform.machine() in ("x86_64", "AMD64"):
    FLAGS += ["-march=x86-64", "-mtune=generic"]
# The C library's functions for any processor, and all symbols bound before the run.
FIXED = {
    "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX,-AVX2,-FMA,-FMA4,-ERMS,-AVX_Fast_Unaligned_Load",
    "LD_BIND_NOW": "1",
    "LC_ALL": "C",
}


@dataclass(frozen=True)
class Run:
    """A run, and the run of the hand-written loop that does the same; empty if there is none."""

    instructions: int
    beside: str


@dataclass(frozen=True)
class Counts:
    """Runs by name, and what they depend on: compiler, libraries and flags."""

    build: dict[str, str]
    runs: dict[str, Run]

    def ratio(self, name: str) -> float | None:
        """Return the instructions of a run in units of those of the hand-written loop."""
        run = self.runs[name]
        if run.beside not in self.runs:
            return None
        return run.instructions / self.runs[run.beside].instructions


@dataclass(frozen=True)
class Judgement:
    """What fails, and what is only said."""

    failures: list[str]
    remarks: list[str]


def load(path: Path) -> Counts:
    """Read a file of counts; without a file there are none."""
    if not path.exists():
        return Counts({}, {})
    data = json.loads(path.read_text(encoding="utf-8"))
    return Counts(data["build"], {name: Run(**run) for name, run in data["runs"].items()})


def save(counts: Counts, path: Path) -> None:
    """Write a file of counts."""
    path.write_text(json.dumps(asdict(counts), indent=2) + "\n", encoding="utf-8")


def change(kept: Counts, found: Counts, name: str) -> float | None:
    """Return by which part of the kept count a run has changed, None if that cannot be said."""
    if kept.build != found.build or name not in kept.runs or name not in found.runs:
        return None
    return found.runs[name].instructions / kept.runs[name].instructions - 1


def judge(kept: Counts, found: Counts, strict: bool = False) -> Judgement:
    """Compare counts with those that are kept."""
    failures = [f"{name}: not in {KEPT.name}" for name in found.runs if name not in kept.runs]
    failures += [f"{name}: is run no more" for name in kept.runs if name not in found.runs]
    remarks = []
    for name in found.runs:
        part = change(kept, found, name)
        if part is not None and part > LIMIT:
            failures.append(f"{name}: {100 * part:.1f}% more instructions")
        elif part is not None and part < -LIMIT:
            remarks.append(f"{name}: {-100 * part:.1f}% fewer instructions; --update keeps them")
    if kept.build != found.build:
        other = [
            f"{key} {found.build.get(key)}, kept {kept.build.get(key)}"
            for key in sorted(kept.build.keys() | found.build.keys())
            if kept.build.get(key) != found.build.get(key)
        ]
        words = f"counts are not comparable: {'; '.join(other)}"
        (failures if strict else remarks).append(words)
    return Judgement(failures, remarks)


def updated(kept: Counts, found: Counts) -> Counts:
    """Return what is kept from now on.

    A count that is up by less than the limit stays as it was: many small losses shall add up.
    """
    runs = dict(found.runs)
    for name, run in found.runs.items():
        part = change(kept, found, name)
        if part is not None and 0 <= part <= LIMIT:
            runs[name] = Run(kept.runs[name].instructions, run.beside)
    return Counts(found.build, runs)


def in_words(ratio: float | None) -> str:
    """Return a ratio as it stands in tables."""
    return "" if ratio is None else f"{ratio:.2f}"


def report(kept: Counts, found: Counts) -> str:
    """Return the table that is printed."""
    width = max(map(len, found.runs))
    lines = [f"{'run':{width}}  {'instructions':>12}  {'to hand':>7}  {'kept':>7}  {'change':>7}"]
    for name, run in found.runs.items():
        before = in_words(kept.ratio(name)) if name in kept.runs else ""
        part = change(kept, found, name)
        moved = "" if part is None else f"{100 * part:+.2f}%"
        ratio = in_words(found.ratio(name))
        lines.append(
            f"{name:{width}}  {run.instructions:>12,}  {ratio:>7}  {before:>7}  {moved:>7}"
        )
    return "\n".join(lines)


def page_table(counts: Counts) -> str:
    """Return what stands between the markers of the page."""
    rows = ["| run | million instructions | to the hand-written loop |", "| --- | ---: | ---: |"]
    for name, run in counts.runs.items():
        rows.append(f"| {name} | {run.instructions / 1e6:.2f} | {in_words(counts.ratio(name))} |")
    build = counts.build
    words = f"{build['compiler']}, {build['libc']}, Eigen {build['eigen']}, `{build['flags']}`."
    return "\n".join(rows) + f"\n\n{words}"


def put_into(page: str, table: str) -> str:
    """Return the text of a page with another table between its markers."""
    before, begin, rest = page.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not (begin and end):
        sys.exit(f"count_instructions: the page lacks {BEGIN} and after it {END}")
    return f"{before}{BEGIN}\n\n{table}\n\n{END}{after}"


def page_agrees(counts: Counts, page: str) -> bool:
    """Return whether the table of a page is that of these counts."""
    return put_into(page, page_table(counts)) == page


def output_of(command: list[str], folder: Path, **environment: str) -> str:
    """Run a command in a folder and return what it prints; end the program if it fails."""
    ran = subprocess.run(
        command, cwd=folder, env=environment or None, capture_output=True, text=True, check=False
    )
    if ran.returncode != 0:
        sys.exit(f"count_instructions: {' '.join(command)} failed\n{ran.stdout}{ran.stderr}")
    return ran.stdout


def compile_program(cxx: str, name: str, folder: Path) -> None:
    """Compile and link one program; in two steps, the first of which a cache may know."""
    eigen = os.environ.get("EIGEN_INCLUDE", "/usr/include/eigen3")
    launcher = os.environ.get("CMAKE_CXX_COMPILER_LAUNCHER", "").split()
    includes = [f"-I{ROOT / 'include'}", "-isystem", eigen]
    source = [str(SOURCES / f"{name}.cpp"), "-c", "-o", f"{name}.o"]
    output_of([*launcher, cxx, *FLAGS, *includes, *source], folder)
    output_of([cxx, f"{name}.o", "-o", name], folder)


def count(program: str, run: str, folder: Path) -> int:
    """Return the instructions of one run.

    Environment and command line lie at the bottom of the stack: they are the same everywhere.
    """
    file = folder / f"{re.sub(r'[^a-z0-9]+', '_', run)}.out"
    command = ["valgrind", "--tool=callgrind", "--vgdb=no", "--toggle-collect=counted_run"]
    command += [f"--callgrind-out-file={file}", f"./{program}", run]
    kept = {key: os.environ[key] for key in ("PATH", "VALGRIND_LIB") if key in os.environ}
    output_of(command, folder, **FIXED, **kept)
    total = re.search(r"^totals: (\d+)$", file.read_text(encoding="utf-8"), re.MULTILINE)
    number = int(total.group(1)) if total else 0
    if number == 0:
        sys.exit(f"count_instructions: valgrind counted nothing of {run}")
    return number


def count_all(cxx: str, folder: Path, repeat: int) -> Counts:
    """Compile all programs, and count all their runs, as many at once as there are processors."""
    folder.mkdir(parents=True, exist_ok=True)
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        list(pool.map(lambda name: compile_program(cxx, name, folder), PROGRAMS[::-1]))
        listed = [
            (program, *line.split("\t"))
            for program in PROGRAMS
            for line in output_of([f"./{program}", "--list"], folder).splitlines()
        ]
        numbers = list(
            pool.map(lambda job: [count(job[0], job[1], folder) for _ in range(repeat)], listed)
        )
    if repeat > 1:
        tell_spread((job[1] for job in listed), numbers)
    about = output_of([f"./{PROGRAMS[0]}", "--build"], folder)
    build = dict(line.split("\t") for line in about.splitlines()) | {"flags": " ".join(FLAGS)}
    runs = {
        name: Run(all_counts[0], beside)
        for (_, name, beside), all_counts in zip(listed, numbers, strict=True)
    }
    return Counts(build, runs)


def tell_spread(names: Iterable[str], numbers: list[list[int]]) -> None:
    """Print how far repeated counts of a run are apart."""
    for name, its in zip(names, numbers, strict=True):
        print(f"{name}: {len(its)} counts, {max(its) - min(its)} apart")


def main() -> int:
    """Count, print, compare; return 0 if nothing fails."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--cxx", default=os.environ.get("CXX", "c++"), help="the compiler")
    parser.add_argument("--strict", action="store_true", help="fail if counts do not compare")
    parser.add_argument("--update", action="store_true", help="keep what was found")
    parser.add_argument("--write", type=Path, metavar="PAGE", help="put the table into a page")
    parser.add_argument("--repeat", type=int, default=1, metavar="N", help="count each N times")
    parser.add_argument("--folder", type=Path, default=ROOT / "build" / "instructions")
    args = parser.parse_args()
    if shutil.which("valgrind") is None:
        sys.exit("count_instructions: valgrind was not found; scripts/setup.sh test brings it")

    kept, found = load(KEPT), count_all(args.cxx, args.folder.resolve(), args.repeat)
    print(report(kept, found))
    judgement = judge(kept, found, args.strict)
    if args.update:
        kept = updated(kept, found)
        save(kept, KEPT)
        judgement = judge(kept, found, args.strict)
    if args.write:
        page = args.write.read_text(encoding="utf-8")
        args.write.write_text(put_into(page, page_table(kept)), encoding="utf-8")
    failures = judgement.failures
    if not page_agrees(kept, PAGE.read_text(encoding="utf-8")):
        failures.append(f"{PAGE.relative_to(ROOT)} has another table; --write renews it")
    for words in [*judgement.remarks, *(f"FAILED  {words}" for words in failures)]:
        print(words)
    if failures:
        print("What is meant to be so is kept by --update --write docs/benchmarks.md.")
    print(f"instructions: {len(found.runs)} runs, {len(failures)} failures")
    return bool(failures)


if __name__ == "__main__":
    sys.exit(main())
