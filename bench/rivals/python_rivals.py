#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""What does a trajectory with events cost at which error with tools of Python?

200 periods from (0, 0), with stick at (A, omega) = (0.5, 2.94), mostly crossings at (5, 1.6); and
the problems of py_switched.py. Error of the final state; CPU time, the best of several. Runs
whatever py_<name>.py can be imported. A rival that may not return has a process of its own for each
run, and --limit seconds of CPU.
With --smoothed instead: friction smoothed by an arctangent, and scipy's stiff solvers.

Usage: python python_rivals.py [--json FILE] [--quick] [--only NAME ...] [--problems] [--smoothed]
       [--limit S]
"""

import argparse
import importlib
import json
import platform
import sys
from pathlib import Path

from apart import NO_RETURN, best_time, measure_apart
from py_oscillator import CASES
from py_switched import PROBLEMS

NAMES = ("scipy", "numba", "heyoka", "siconos", "pydiffsol", "solve_nivp")


def import_rivals(names):
    """All methods that can be run here, for the oscillator and for the other problems.

    Says which packages are missing.
    """
    rivals, problem_rivals = [], []
    for name in names:
        try:
            module = importlib.import_module(f"py_{name}")
        except ImportError as missing:
            print(f"{name}: left out, {missing}")
            continue
        print(f"{name}: {module.VERSION}")
        rivals += module.RIVALS
        problem_rivals += getattr(module, "PROBLEM_RIVALS", [])
    return rivals, problem_rivals


def row_apart(rival, case, tol, quick, limit):
    """One row of a rival that may not return; None where it has no such case."""
    found = measure_apart(rival, case, tol, quick, limit)
    if found is None:
        return None
    numbers = f"{found['error']:9.1e} {found['ms']:10.3f}" if "error" in found else " " * 20
    print(f"{rival.name:24} {tol:6.0e} {numbers} {found['outcome']}", flush=True)
    return {"case": case.name, "method": rival.name, "tol": tol, "error": None, "ms": None} | found


def measure(rival, case, tol, quick, limit):
    """One row, its answer checked before it is timed; None where there is none."""
    if rival.apart:
        return row_apart(rival, case, tol, quick, limit)
    try:
        run = rival.prepare(case, tol)
        if run is None:
            return None
        *end, events = run()
    except (RuntimeError, ArithmeticError) as failure:
        print(f"{rival.name:24} {tol:6.0e} {failure}")
        return None
    error = case.error(*end)
    ms = best_time(run, quick)
    remark = "" if events in (None, case.events) else f"  WRONG: {events} events"
    print(f"{rival.name:24} {tol:6.0e} {error:9.1e} {ms:10.3f}{remark}", flush=True)
    return {"case": case.name, "method": rival.name, "tol": tol, "error": error, "ms": ms}


def compare(rivals, cases, quick, limit):
    rows = []
    for case in cases if rivals else ():
        print(
            f"\n{case.name}, {case.events} events\n{'method':24} {'tol':>6} {'error':>9} {'ms':>10}"
        )
        for rival in rivals:
            for tol in rival.tolerances[2:5:2] if quick else rival.tolerances:
                row = measure(rival, case, tol, quick, limit)
                if row:
                    rows.append(row)
                if row and row.get("outcome", "").startswith(NO_RETURN):
                    break  # nor would it with a smaller tolerance
    return rows


def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the rows to this file")
    parser.add_argument("--quick", action="store_true", help="two tolerances, timed once")
    parser.add_argument("--only", nargs="+", choices=NAMES, default=NAMES, help="only these")
    parser.add_argument("--problems", action="store_true", help="without the oscillator")
    parser.add_argument("--smoothed", action="store_true", help="the smoothed law instead")
    parser.add_argument("--limit", type=float, default=60, help="seconds of CPU for a run apart")
    args = parser.parse_args(arguments)
    print(f"Python {platform.python_version()}")
    if args.smoothed:
        if not any(import_rivals(["scipy"])):
            return 1
        rows = importlib.import_module("py_smoothed").compare(args.quick)
    else:
        rivals, problem_rivals = import_rivals(args.only)
        rows = [] if args.problems else compare(rivals, CASES, args.quick, args.limit)
        rows += compare(problem_rivals, PROBLEMS, args.quick, args.limit)
    if args.json:
        args.json.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
