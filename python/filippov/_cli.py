# SPDX-License-Identifier: BSD-3-Clause
"""The command `filippov`: pictures and tables without a line of Python."""

from __future__ import annotations

import argparse
import importlib.util
import math
import re
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from . import _core, models
from ._system.system import System

__all__ = ["main"]

_SYSTEM = (
    "a built-in model by its name (filippov info lists them), or one of your own: model.py:name,"
    " where model.py defines it with @filippov.system"
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; 0 if all went well, 1 if a run did not end well, 2 for wrong arguments."""
    parser = _parser()
    told = parser.parse_args(_with_values(sys.argv[1:] if arguments is None else arguments))
    try:
        return int(told.run(told))
    except BrokenPipeError:  # `filippov info | head`
        sys.stderr.close()
        return 0
    except (ValueError, TypeError, OSError) as error:
        print(f"filippov {told.command}: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print(f"filippov {told.command}: interrupted", file=sys.stderr)
        return 130


def _with_values(arguments: Sequence[str]) -> list[str]:
    """Join `--start -1,0` to `--start=-1,0`: argparse takes what begins with - for an option."""
    joined: list[str] = []
    for text in arguments:
        option = joined[-1] if joined else ""
        if option.startswith("--") and "=" not in option and re.match(r"-[.\d]", text):
            joined[-1] += f"={text}"
        else:
            joined.append(text)
    return joined


# --- arguments ------------------------------------------------------------------------------------


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="filippov",
        description="Simulates systems that switch on surfaces and slide along them.",
        epilog="filippov COMMAND --help tells more.",
    )
    parser.add_argument("--version", action="version", version=_core.__version__)
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")

    def command(name: str, run: Callable[[Any], int], words: str) -> argparse.ArgumentParser:
        sub = commands.add_parser(name, help=words, description=words)
        sub.set_defaults(run=run)
        return sub

    def about(sub: argparse.ArgumentParser) -> None:
        sub.add_argument("system", metavar="SYSTEM", help=_SYSTEM)
        sub.add_argument(
            "-p", "--param", action="append", default=[], metavar="NAME=VALUE",
            help="a parameter value; may be given several times",
        )  # fmt: skip

    def files(sub: argparse.ArgumentParser, kinds: str) -> None:
        sub.add_argument("-o", "--output", type=_file, metavar="FILE", help=f"write {kinds}")
        sub.add_argument("--plot", type=_file, metavar="FILE", help="draw a picture: .png, .pdf")

    info = command("info", _info, "Tell what a system is, or which models there are.")
    info.add_argument("system", metavar="SYSTEM", nargs="?", help=_SYSTEM)
    info.add_argument("--cpp", action="store_true", help="write it as a C++ struct")

    run = command("run", _run, "Follow one solution; the table of its events.")
    about(run)
    run.add_argument("--start", required=True, metavar="X,Y,..", help="the state at the start")
    run.add_argument("--time", required=True, metavar="FROM:TO", help="the times of both ends")
    run.add_argument("--method", default="dop853", choices=("dop853", "dopri5", "rodas5p"))
    run.add_argument("--tol", type=float, default=1e-9, help="relative and absolute tolerance")
    files(run, "the steps as a table, t and the state (.csv), or the whole run (.npz)")

    diagram = command("diagram", _diagram, "A bifurcation diagram over one parameter.")
    about(diagram)
    diagram.add_argument(
        "--over", required=True, metavar="NAME=FROM:TO:N", help="the parameter and its N values"
    )
    diagram.add_argument(
        "--section",
        default="exit_sliding",
        help="where points are taken: strobe, enter_sliding, ..",
    )
    diagram.add_argument("--transient", type=float, default=200, help="periods left out")
    diagram.add_argument("--keep", type=float, default=200, help="periods kept")
    files(diagram, "the result (.npz, for filippov.load)")

    basins = command("basins", _basins, "Attractors and their basins on a grid of starts.")
    about(basins)
    basins.add_argument(
        "--grid", action="append", required=True, metavar="NAME=FROM:TO:N",
        help="an axis with N cells; two of them make a picture",
    )  # fmt: skip
    files(basins, "the result (.npz, for filippov.load)")

    command("bench", _bench, "Time the oscillator on this machine, in a few seconds.")
    return parser


def _file(text: str) -> Path:
    """Read a path that can be written to, before any work."""
    path = Path(text)
    if not path.parent.is_dir():
        raise argparse.ArgumentTypeError(f"{text}: there is no directory {path.parent}")
    return path


def _system(name: str, values: Sequence[str] = ()) -> System:
    """Find a system, and give it parameter values."""
    path, colon, attribute = name.rpartition(":")
    if colon and path.endswith(".py"):
        found = getattr(_module(Path(path)), attribute, None)
    else:
        found = getattr(models, name, None) if name in models.__all__ else None
    if not isinstance(found, System):
        raise ValueError(f"SYSTEM = {name}: expected {_SYSTEM}")
    return found.with_params(**dict(_pair("--param", value) for value in values))


def _module(path: Path) -> object:
    spec = importlib.util.spec_from_file_location(path.stem, path)
    if spec is None or spec.loader is None or not path.exists():
        raise ValueError(f"SYSTEM: there is no file {path}")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def _pair(what: str, text: str) -> tuple[str, float]:
    name, equals, value = text.partition("=")
    if not equals:
        raise ValueError(f"{what} {text}: expected NAME=VALUE")
    return name, _number(what, value)


def _number(what: str, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise ValueError(f"{what}: {text!r} is no number") from None


def _range(what: str, text: str) -> tuple[str, float, float, int]:
    """Read NAME=FROM:TO:N."""
    name, equals, rest = text.partition("=")
    parts = rest.split(":")
    if not equals or len(parts) != 3:
        raise ValueError(f"{what} {text}: expected NAME=FROM:TO:N")
    n = _number(what, parts[2])
    if not (1 <= n < 2**31 and n.is_integer()):
        raise ValueError(f"{what} {text}: expected a number of values, got {parts[2]}")
    low, high = _number(what, parts[0]), _number(what, parts[1])
    if not (math.isfinite(low) and math.isfinite(high)):
        raise ValueError(f"{what} {text}: expected finite ends")
    return name, low, high, int(n)


def _draw(result: Any, path: Path | None) -> None:  # noqa: ANN401 - whatever has a plot
    if path is None:
        return
    import matplotlib.figure

    figure = matplotlib.figure.Figure(figsize=(7, 5), layout="constrained")
    result.plot(ax=figure.add_subplot())
    figure.savefig(path, dpi=150)
    print(f"picture: {path}")


def _save(result: Any, path: Path | None) -> None:  # noqa: ANN401 - whatever can be saved
    if path is not None:
        result.save(path)
        print(f"written: {path}")


# --- commands -------------------------------------------------------------------------------------


def _info(told: Any) -> int:  # noqa: ANN401 - what argparse read
    if told.system is None:
        for name in models.__all__:
            system = getattr(models, name)
            print(f"{name:22s} {', '.join(system.state):16s} {', '.join(system.switches)}")
        return 0
    system = _system(told.system)
    print(system.to_cpp() if told.cpp else system)
    return 0


def _run(told: Any) -> int:  # noqa: ANN401
    from ._runs.simulate import simulate

    system = _system(told.system, told.param)
    start = [_number("--start", part) for part in told.start.split(",")]
    ends = [_number("--time", part) for part in told.time.split(":")]
    if len(ends) != 2:
        raise ValueError(f"--time {told.time}: expected FROM:TO")
    result = simulate(
        system, start, (ends[0], ends[1]), method=told.method, rtol=told.tol, atol=told.tol
    )
    head = "".join(f"{name:>13s}" for name in system.state)
    print(f"{'t':>14s}  {'event':20s}{head}")
    for event in result.events:
        state = "".join(f"{v:13.6f}" for v in event["x_right"])
        print(f"{event['t']:14.8f}  {event['kind']:20s}{state}")
    print(f"{result.status}: {result.message}")
    if told.output is not None:
        if told.output.suffix == ".npz":
            result.save(told.output)
        else:
            np.savetxt(
                told.output, np.vstack([result.t, result.y]).T, delimiter=",", comments="",
                header=",".join(("t", *system.state)), fmt="%.17g",
            )  # fmt: skip
        print(f"written: {told.output}")
    _draw(result, told.plot)
    return 0 if result.success else 1


def _diagram(told: Any) -> int:  # noqa: ANN401
    from ._runs.diagram import bifurcation_diagram

    system = _system(told.system, told.param)
    name, low, high, n = _range("--over", told.over)
    swept: dict[str, Any] = {name: np.linspace(low, high, n)}
    result = bifurcation_diagram(
        system, section=told.section, transient=told.transient, keep=told.keep, progress=True,
        **swept,
    )  # fmt: skip
    good = int(np.sum(result.status == "ok"))
    print(f"{n} values of {name}, {result.y.shape[1]} points; {good} runs are ok")
    _save(result, told.output)
    _draw(result, told.plot)
    return 0 if good == n else 1


def _basins(told: Any) -> int:  # noqa: ANN401
    from ._basins.basins import basins

    system = _system(told.system, told.param)
    axes = [_range("--grid", text) for text in told.grid]
    grid = {name: (low, high, n) for name, low, high, n in axes}
    result = basins(system, grid, progress=True)
    for attractor, share in sorted(result.fractions.items()):
        print(f"{attractor:4d}  {share:8.4%} of the cells")
    print(repr(result))
    _save(result, told.output)
    _draw(result, told.plot)
    return 0


def _bench(_told: Any) -> int:  # noqa: ANN401
    from ._runs.ensemble import ensemble
    from ._runs.simulate import simulate

    block = models.oscillator.with_params(A=0.5, omega=2.94)
    period = 2 * np.pi / 2.94
    for tol in (1e-6, 1e-9, 1e-12):
        spent = _least(
            lambda tol=tol: simulate(  # type: ignore[misc]
                block, [0, 0], (0, 200 * period), rtol=tol, atol=tol, dense_output=False
            )
        )
        print(f"200 periods, 100 events, tolerance {tol:.0e}: {1e3 * spent:8.3f} ms")
    starts = np.array(np.meshgrid(np.linspace(-4, 4, 200), np.linspace(-3, 4, 200)))
    spent = _least(lambda: ensemble(block, starts, (0, period), rtol=1e-8, atol=1e-8))
    print(f"a period of 40,000 starts, tolerance 1e-08: {40_000 / spent:,.0f} a second")
    return 0


def _least(work: Callable[[], object]) -> float:
    """Seconds that it takes, the least of five."""
    spent = []
    for _ in range(5):
        began = time.perf_counter()
        work()
        spent.append(time.perf_counter() - began)
    return min(spent)
