# SPDX-License-Identifier: BSD-3-Clause
"""Defaults of what runs are told: those of the compiled core, and those that docs state."""

import inspect
import math
from pathlib import Path

import pytest

import filippov as fp
from filippov import _core
from filippov._results.settings import analysis_settings, run_settings

PAGE = Path(__file__).resolve().parents[2] / "docs" / "methods.md"
COLUMNS = (
    "method",
    "rtol",
    "atol",
    "max_step",
    "first_step",
    "max_steps",
    "max_events",
    "on_nonunique",
)
VALUES = {"`None`": None, "inf": math.inf, '`"stop"`': "stop", '`"dop853"`': "dop853"}


def _table() -> dict[str, dict[str, object]]:
    """Rows of the page: for each call its arguments with their defaults."""
    text = PAGE.read_text().split("## Defaults of all calls")[1].split("\n\n")[1]
    lines = [line.removeprefix("|").removesuffix("|") for line in text.splitlines()]
    head, _, *rows = [[cell.strip() for cell in line.split("|")] for line in lines]
    assert tuple(cell.strip("`") for cell in head[1:]) == COLUMNS
    table: dict[str, dict[str, object]] = {}
    for calls, *cells in rows:
        told = {
            name: VALUES[cell] if cell in VALUES else float(cell)
            for name, cell in zip(COLUMNS, cells, strict=True)
            if cell
        }
        for call in calls.split(", "):
            table[call.strip("`")] = told
    return table


def _runs() -> dict[str, dict[str, object]]:
    """All public calls that take a tolerance, with those of these arguments that are a run's."""
    calls = {}
    for name in fp.__all__:
        function = getattr(fp, name)
        if not inspect.isfunction(function) or name == "gsl_run":  # which has methods of its own
            continue
        given = inspect.signature(function).parameters
        if "rtol" not in given:
            continue
        along = "max_points" in given  # a branch has steps of its own
        calls[name] = {
            argument: given[argument].default
            for argument in COLUMNS
            if argument in given and not (along and argument in ("max_step", "first_step"))
        }
    return calls


def test_the_page_states_the_defaults_of_all_calls() -> None:
    assert _table() == _runs()


def test_the_core_has_the_same_tolerances() -> None:
    core, here = _core.RunSettings(), _runs()
    for call in ("simulate", "ensemble", "cell_map", "basins"):
        assert here[call]["rtol"] == core.rtol
        assert [here[call]["atol"]] == core.atol
        assert here[call]["max_step"] == core.max_step
        assert here[call]["on_nonunique"] == core.on_nonunique
    assert here["ensemble"]["method"] == core.method
    assert (here["basins"]["max_steps"], here["basins"]["max_events"]) == (
        core.max_steps,
        core.max_events,
    )
    assert core.first_step == 0


def test_settings_of_the_core_have_names() -> None:
    told = run_settings(2, "RK45", 1e-6, [1e-7, 1e-8], 0.5, 10, 20, "stay", 0.25)._told()
    assert (told.method, told.rtol, told.atol) == ("dopri5", 1e-6, [1e-7, 1e-8])
    assert (told.max_step, told.first_step) == (0.5, 0.25)
    assert (told.max_steps, told.max_events, told.on_nonunique) == (10, 20, "stay")
    told = analysis_settings(1e-9, 1e-11, 7)
    assert (told.rtol, told.atol, told.max_steps) == (1e-9, [1e-11], 7)
    with pytest.raises(AttributeError):
        _core.RunSettings(rtoll=1e-3)  # type: ignore[call-arg]
    with pytest.raises(ValueError, match="method = euler: no such name"):
        _core.RunSettings(method="euler")
