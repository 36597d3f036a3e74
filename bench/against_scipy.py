#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""What does the same work cost with scipy: lines of user code, and time at equal error?

The friction oscillator by ``scipy_jobs/by_filippov.py``, typed as one formula and as the built-in
model, and by ``scipy_jobs/by_scipy.py``, a careful loop around ``solve_ivp``. Each tries all its
methods and tolerances; what reaches an error fastest is timed in turns, in CPU time of one thread.
The exit status is 1 if results disagree or a program does not reach an error.

Usage: python against_scipy.py [--quick] [--write docs/benchmarks.md]
"""

import argparse
import ast
import io
import math
import platform
import statistics
import sys
import time
import tokenize
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

import filippov as fp

try:
    import scipy
except ImportError:
    sys.exit("This comparison needs scipy, which filippov itself does not: pip install scipy")

from scipy_jobs import by_filippov, by_scipy

BEGIN, END = "<!-- scipy tables: bench/against_scipy.py -->", "<!-- end -->"
TOLERANCES = [float(f"1e-{k}") for k in range(5, 14)]
TIGHT = 1e-13  # of the references
# state after 200 periods at (A, omega) = (0.5, 2.94): rivals/reference_oscillator.hpp
QUADRUPLE = np.array([5.573365854277107760665082166e-02, 7.397537135751244343793252866e-01])


@dataclass(frozen=True)
class Job:
    """What is done, by a function of that name in both modules."""

    name: str
    title: str
    arguments: tuple[Any, ...]
    distance: Callable[[Any, Any], float]  #: of two results
    errors: tuple[float, ...]  #: to be reached, the smallest last
    exact: Any = None  #: result that is known from elsewhere


@dataclass(frozen=True)
class Program:
    """One way to do the jobs."""

    name: str
    module: ModuleType
    methods: tuple[str, ...]  #: that are tried
    options: dict[str, Any] = field(default_factory=dict)

    def run(self, job, method, tolerance):
        how = {"method": method, "rtol": tolerance, "atol": tolerance}
        return getattr(self.module, job.name)(*job.arguments, **how, **self.options)


def between_states(a, b):
    return np.abs(a - b).max()


def between_diagrams(a, b):
    """Largest distance of a point from the other diagram, at the same value of the parameter."""
    distances = []
    for value in np.union1d(a[0], b[0]):
        gap = np.abs(np.subtract.outer(a[1][a[0] == value], b[1][b[0] == value]))
        if not gap.size:
            return math.inf
        gap = np.minimum(gap, 2 * np.pi - gap)
        distances += [gap.min(axis=0).max(), gap.min(axis=1).max()]
    return max(distances)


def between_labels(a, b):
    """Cells with another attractor; attractors are matched by where most of their cells are."""
    pairs, cells = np.unique([a.ravel(), b.ravel()], axis=1, return_counts=True)
    matched = {}
    for k in np.argsort(-cells):
        if pairs[0, k] not in matched and pairs[1, k] not in matched.values():
            matched[pairs[0, k]] = pairs[1, k]
    return cells[[matched.get(one) != other for one, other in pairs.T]].sum()


def centres(low, high, n):
    return low + (high - low) * (np.arange(n) + 0.5) / n


def make_jobs(quick):
    periods, values, settle, keep = (20, 4, 20, 10) if quick else (200, 40, 100, 50)
    n, m = (6, 5) if quick else (40, 20)
    home = (0.5, 2.94, periods)
    sweep = (0.5, np.linspace(2.84, 2.94, values), settle, keep)
    cells = (3.6, 1.067, centres(-4, 4, n), centres(-3, 4, n))
    grid = (3.6, 1.067, {"y": (-4, 4, m), "v": (-3, 4, m)})
    titles = (
        f"trajectory of {periods} periods",
        f"diagram of {values} values, {settle} + {keep} periods each",
        f"images of {n} x {n} cells after one period",
        f"basins of {m} x {m} cells",
    )
    exact = None if quick else QUADRUPLE
    return [
        Job("trajectory", titles[0], home, between_states, (1e-6, 1e-9), exact),
        Job("diagram", titles[1], sweep, between_diagrams, (1e-6, 1e-8)),
        Job("cell_images", titles[2], cells, between_states, (1e-6, 1e-9)),
        Job("basins", titles[3], grid, between_labels, (0.0,)),
    ]


def make_programs(quick):
    n = 1 if quick else None
    ours, theirs = ("dop853", "dopri5")[:n], ("DOP853", "LSODA", "RK45")[:n]
    return [
        Program("filippov, typed", by_filippov, ours),
        Program("filippov, model", by_filippov, ours, {"system": fp.models.oscillator}),
        Program("scipy", by_scipy, theirs),
    ]


def timed(work):
    """Median CPU time of a call, repeated for a twentieth of a second, and its result."""
    times = []
    while sum(times) < 0.05:
        start = time.process_time()
        result = work()
        times.append(time.process_time() - start)
    return statistics.median(times), result


def reference_of(job, programs):
    """Result at the tightest tolerance, and its largest distance from independent ones."""
    typed, model, by_hand = programs
    reference = model.run(job, "dop853", TIGHT)
    others = {
        "typed, dopri5": typed.run(job, "dopri5", TIGHT),
        "scipy, DOP853": by_hand.run(job, "DOP853", TIGHT),
    }
    if job.exact is not None:
        others["quadruple precision"] = job.exact
    apart = {name: job.distance(other, reference) for name, other in others.items()}
    for name, distance in apart.items():
        print(f"{job.name}, reference and {name}: {distance:.1e} apart", file=sys.stderr)
    return reference, max(apart.values())


def fastest(program, job, reference, tolerances):
    """For each error to be reached the seconds, method and tolerance that reach it fastest."""
    best = {}
    for method in program.methods:
        before = math.inf
        for tolerance in tolerances:
            what = f"{job.name}, {program.name}, {method} {tolerance:.0e}"
            try:
                seconds, result = timed(lambda m=method, tol=tolerance: program.run(job, m, tol))
            except RuntimeError as failure:
                print(f"{what}: {failure}", file=sys.stderr)
                continue
            reached = job.distance(result, reference)
            print(f"{what}: {1e3 * seconds:.3g} ms, error {reached:.1e}", file=sys.stderr)
            for error in job.errors:
                if reached <= error:
                    best[error] = min(best.get(error, (math.inf,)), (seconds, method, tolerance))
            enough = best.get(job.errors[-1], (math.inf,))[0]
            if seconds >= max(enough, before):
                break  # from here it only takes longer
            before = seconds
    return best


def in_turns(job, programs, choices, turns):
    """CPU times in seconds, shape (programs, turns)."""
    pairs = list(zip(programs, choices, strict=True))
    times = [
        [timed(lambda p=program, c=choice: p.run(job, *c[1:]))[0] for program, choice in pairs]
        for _ in range(turns)
    ]
    return np.transpose(times)


def lines_of(module, names):
    """Lines of code of some functions of a module, and of the rest of it together."""
    source = Path(module.__file__).read_text(encoding="utf-8")
    code = set()
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type != tokenize.COMMENT and token.string.strip():
            code |= set(range(token.start[0], token.end[0] + 1))
    tree = ast.parse(source)
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.FunctionDef) and ast.get_docstring(node):
            code -= set(range(node.body[0].lineno, node.body[0].end_lineno + 1))
    lines = {
        node.name: len(code & set(range(node.lineno, node.end_lineno + 1)))
        for node in tree.body
        if isinstance(node, ast.FunctionDef) and node.name in names
    }
    return [len(code) - sum(lines.values()), *(lines[name] for name in names), len(code)]


def table(*rows):
    head, *rest = [f"| {' | '.join(row)} |" for row in rows]
    return "\n".join([head, "| --- |" + " ---: |" * (len(rows[0]) - 1), *rest])


def two_digits(number):
    return f"{float(f'{number:.2g}'):g}"


def in_words(seconds):
    return f"{two_digits(seconds)} s" if seconds >= 1 else f"{two_digits(1e3 * seconds)} ms"


def compare(quick):
    """Return the tables, and what is wrong."""
    jobs, programs = make_jobs(quick), make_programs(quick)
    tolerances = TOLERANCES[2:4] if quick else TOLERANCES
    rows, apart, wrong = [], {}, []
    for job in jobs:
        reference, apart[job.name] = reference_of(job, programs)
        if apart[job.name] > 0.2 * job.errors[-1]:
            wrong.append(f"{job.name}: the references are {apart[job.name]:.0e} apart")
        best = [fastest(program, job, reference, tolerances) for program in programs]
        for error in job.errors[:1] if quick else job.errors:
            late = [p.name for p, its in zip(programs, best, strict=True) if error not in its]
            wrong += [f"{job.name}: {name} does not reach {error:.0e}" for name in late]
            if late:
                continue
            choices = [its[error] for its in best]
            times = in_turns(job, programs, choices, 1 if quick else 3)
            cells = [
                f"{in_words(np.median(its))}, {method} {tolerance:.0e}"
                for its, (_, method, tolerance) in zip(times, choices, strict=True)
            ]
            ratios = np.median(times[2] / times[:2], axis=1)
            words = f"{error:.0e}" if error else "none wrong"
            rows.append([job.title, words, *cells, *map(two_digits, ratios)])

    names = [job.name for job in jobs]
    parts = ["the block, and runs of it", *(f"`{name}`" for name in names), "all"]
    lines = zip(parts, lines_of(by_filippov, names), lines_of(by_scipy, names), strict=True)
    tables = [
        table(["lines of code", "filippov", "scipy"], *([p, f"{a}", f"{b}"] for p, a, b in lines)),
        table(
            ["time", "error", *(p.name for p in programs), "scipy / typed", "scipy / model"], *rows
        ),
        "References apart: " + ", ".join(f"{name} {d:.0e}" for name, d in apart.items()) + ".",
        f"Python {platform.python_version()}, numpy {np.__version__}, scipy {scipy.__version__}.",
    ]
    return "\n\n".join(tables), wrong


def put_into(page, tables):
    """Text of a page with other tables between its markers."""
    before, begin, rest = page.read_text(encoding="utf-8").partition(BEGIN)
    _, end, after = rest.partition(END)
    if not (begin and end):
        sys.exit(f"{page}: expected {BEGIN} and after it {END}")
    return f"{before}{BEGIN}\n\n{tables}\n\n{END}{after}"


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--quick", action="store_true", help="small jobs, once")
    parser.add_argument("--write", type=Path, metavar="PAGE", help="put the tables into a page")
    args = parser.parse_args()
    if args.write:
        put_into(args.write, "")  # a page without markers is refused before all the work
    tables, wrong = compare(args.quick)
    print(tables)
    if wrong:
        print(*wrong, sep="\n", file=sys.stderr)
    elif args.write:
        args.write.write_text(put_into(args.write, tables), encoding="utf-8")
    return bool(wrong)


if __name__ == "__main__":
    sys.exit(main())
