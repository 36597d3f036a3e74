# SPDX-License-Identifier: BSD-3-Clause
"""Runs that may not return, each in a process of its own, ended after so many seconds of CPU."""

import importlib
import multiprocessing
import os
import time
from pathlib import Path

from py_oscillator import CASES
from py_switched import PROBLEMS

WRONG = 0.1  # an error from which an answer is none, or 1e5 tolerances; states are of size 1
NO_RETURN = "does not return"


def best_time(run, quick):
    """CPU milliseconds, the best of several runs within a fifth of a second; one at least."""
    times = []
    while not times or (not quick and sum(times) < 200 and len(times) < 200):
        start = time.process_time()
        run()
        times.append(1e3 * (time.process_time() - start))
    return min(times)


def verdict(error, tol):
    return "right" if error < min(WRONG, 1e5 * tol) else "wrong"


def timed(rival, case, tol, quick):
    """Error and milliseconds; a run of seconds is not made twice. None where there is no case."""
    run = rival.prepare(case, tol)
    if run is None:
        return None
    start = time.process_time()
    *end, _ = run()
    first = 1e3 * (time.process_time() - start)
    error = case.error(*end)
    ms = first if first > 200 else min(first, best_time(run, quick))
    return {"error": error, "ms": ms, "outcome": verdict(error, tol)}


def send(sender, module, rival_name, case_name, tol, quick):
    module = importlib.import_module(module)
    rivals = [*module.RIVALS, *module.PROBLEM_RIVALS]
    rival = next(r for r in rivals if r.name == rival_name)
    case = next(c for c in (*CASES, *PROBLEMS) if c.name == case_name)
    try:
        sender.send(timed(rival, case, tol, quick))
    except (RuntimeError, ArithmeticError) as failure:
        sender.send({"outcome": f"fails: {failure}"})


def cpu_seconds(process):
    """As Linux counts them. (With a limit of its own on them a process is told them by ticks.)"""
    after_name = Path(f"/proc/{process.pid}/stat").read_text(encoding="utf-8").rpartition(")")[2]
    user, system = map(int, after_name.split()[11:13])
    return (user + system) / os.sysconf("SC_CLK_TCK")


def measure_apart(rival, case, tol, quick, limit):
    """As timed; in `outcome` whether the answer is right, or why there is none."""
    context = multiprocessing.get_context("spawn")
    receiver, sender = context.Pipe(duplex=False)
    arguments = (sender, rival.apart, rival.name, case.name, tol, quick)
    child = context.Process(target=send, args=arguments)
    child.start()
    sender.close()
    try:
        while not receiver.poll(1):
            if cpu_seconds(child) > limit:
                return {"outcome": f"{NO_RETURN} within {limit:g} s"}
        return receiver.recv()
    except EOFError:
        return {"outcome": "ends without an answer"}
    finally:
        child.kill()
        child.join()
