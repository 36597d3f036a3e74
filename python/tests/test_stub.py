# SPDX-License-Identifier: BSD-3-Clause
"""The stub of the compiled core gives its functions as many arguments as pybind11 does.

(That both have the same names is stubtest's to say, in `test_typing.py`.)
"""

import ast
import inspect
import re
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
