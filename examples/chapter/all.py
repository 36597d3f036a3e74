# SPDX-License-Identifier: BSD-3-Clause
"""Draw every figure of the chapter, or some: python all.py [--only 4.7] [--out DIR] [--quick].

Each figure is a program of its own; what it prints is kept beside its picture. The exit status is
the number of figures that failed.
"""

import argparse
import os
import subprocess
import sys
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
scripts = {f"4.{int(path.stem[-2:])}": path for path in sorted(HERE.glob("fig_*.py"))}

parser = argparse.ArgumentParser()
parser.add_argument("--only", nargs="+", choices=scripts, metavar="FIGURE", default=list(scripts))
parser.add_argument("--out", type=Path, default=Path("gallery"), metavar="DIR")
parser.add_argument("--quick", action="store_true", help="coarser grids, shorter runs")
args = parser.parse_args()
args.out.mkdir(parents=True, exist_ok=True)

failed, begun = 0, time.perf_counter()
for k, figure in enumerate(args.only, 1):
    print(f"[{k:2}/{len(args.only)}] figure {figure:5s}", end="", flush=True)
    picture = args.out.resolve() / f"{scripts[figure].stem}.png"
    start = time.perf_counter()
    ran = subprocess.run(
        [sys.executable, scripts[figure], picture, *(["--quick"] if args.quick else [])],
        env={**os.environ, "MPLBACKEND": "Agg"},
        capture_output=True,
        text=True,
        check=False,
    )
    picture.with_suffix(".txt").write_text(ran.stdout)
    failed += ran.returncode != 0
    print(f" {time.perf_counter() - start:6.1f} s  {'failed' if ran.returncode else picture.name}")
    print(ran.stderr, end="")
done, spent = len(args.only) - failed, time.perf_counter() - begun
print(f"{done} of {len(args.only)} figures in {spent:.0f} s, in {args.out}")
sys.exit(failed)
