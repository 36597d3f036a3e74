# SPDX-License-Identifier: BSD-3-Clause
"""The stub of the compiled core gives its functions as many arguments as pybind11 does.

(That both have the same names is stubtest's to say, in `test_typing.py`.)
"""

import ast
import gc
import inspect
import re
import weakref
from pathlib import Path

import pytest

from filippov import _core

STUB = ast.parse((Path(_core.__file__).parent / "_core.pyi").read_text())
FUNCTIONS = {node.name: node for node in STUB.body if isinstance(node, ast.FunctionDef)}
METHODS = {
    f"{owner.name}.{node.name}": node
    for owner in STUB.body
    if isinstance(owner, ast.ClassDef)
    for node in owner.body
    if isinstance(node, ast.FunctionDef)
    and node.name != "__init__"
    and not any(isinstance(d, ast.Name) and d.id == "property" for d in node.decorator_list)
    and hasattr(_core, owner.name)  # others are names of the stub's own
}


def compiled_arguments(function):
    """How many arguments pybind11's signature has, `self` included."""
    return len(re.findall(r"\b(?:arg\d+|self):", inspect.getdoc(function).splitlines()[0]))


def stated_arguments(node):
    return len(node.args.posonlyargs) + len(node.args.args)


@pytest.mark.parametrize("name", sorted(FUNCTIONS))
def test_functions_take_as_many_arguments(name):
    assert compiled_arguments(getattr(_core, name)) == stated_arguments(FUNCTIONS[name])


@pytest.mark.parametrize("name", sorted(METHODS))
def test_methods_take_as_many_arguments(name):
    owner, method = name.split(".")
    compiled = getattr(getattr(_core, owner), method)
    assert compiled_arguments(compiled) == stated_arguments(METHODS[name])


def test_what_is_taken_out_of_a_result_stands_alone():
    sets = _core.LimitSetsResult(attractors=[_core.AttractorColumns(radius=2.0)])
    taken = sets.attractors
    sets.attractors = []
    del sets
    gc.collect()
    assert [a.radius for a in taken] == [2.0]


@pytest.mark.parametrize("name", ["Run", "LimitSetsResult", "MapGraphResult", "SectionImages"])
def test_a_result_is_collected_with_the_exception_whose_frames_hold_it(name):
    class Signal(KeyboardInterrupt):
        """One that can be weakly referred to."""

    def interrupted():
        result = getattr(_core, name)()
        try:
            raise Signal
        except Signal as error:
            result.raised = error
            return weakref.ref(error)

    left = interrupted()
    gc.collect()
    assert left() is None
