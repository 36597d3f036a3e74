# SPDX-License-Identifier: BSD-3-Clause
"""What bytes make of the Python package: the fuzzers' entry points, a little of it in every run."""

import importlib.util
import sys
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

PATH = Path(__file__).resolve().parents[1] / "fuzz" / "python_surface.py"
BYTES = st.binary(min_size=4, max_size=120)
BUDGET = settings(max_examples=150, deadline=None, derandomize=True)


@pytest.fixture(scope="module")
def surface():
    specification = importlib.util.spec_from_file_location("python_surface", PATH)
    module = importlib.util.module_from_spec(specification)
    sys.modules[specification.name] = module
    specification.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def stores(surface, tmp_path_factory):
    return surface.Stores(tmp_path_factory.mktemp("stores"))


@BUDGET
@given(data=BYTES)
def test_a_store_that_was_edited_is_refused_or_used(stores, data):
    stores(data)


@BUDGET
@given(data=BYTES)
def test_a_definition_runs_or_is_refused(surface, data):
    surface.define(data)
