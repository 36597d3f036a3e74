# SPDX-License-Identifier: BSD-3-Clause
import importlib.util
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).resolve().parents[2] / "scripts" / "check_snippets.py"


@pytest.fixture
def failures(tmp_path, monkeypatch):
    specification = importlib.util.spec_from_file_location("check_snippets", SCRIPT)
    module = importlib.util.module_from_spec(specification)
    monkeypatch.setitem(sys.modules, "check_snippets", module)
    specification.loader.exec_module(module)
    monkeypatch.setattr(module, "ROOT", tmp_path)

    def check(page):
        (tmp_path / "page.md").write_text(page)
        return module.check_page(tmp_path / "page.md")

    return check


def test_blocks_share_names_and_the_output_is_compared(failures):
    page = "```python\nx = 3\n```\nwords\n```python\nprint(x)\n```\n\n```text\n3\n```\n"
    assert failures(page) == (2, [])


@pytest.mark.parametrize(
    ("page", "words"),
    [
        ("```python\nprint(4)\n```\n```text\n3\n```\n", "page.md:2: printed\n4"),
        ("a\n\n```python\nundeclared\n```\n", 'File "page", line 4'),
        ("```cpp\nint main() { return undeclared; }\n```\n", "undeclared"),
        ("```cpp\nint main() { return 7; }\n```\n", "ended with 7"),
        ("```sh\nscripts/absent.sh\n```\n", "scripts/absent.sh"),
    ],
)
def test_a_failure_is_named(failures, page, words):
    checked, found = failures(page)
    assert checked == 1
    assert words in found[0]


def test_a_cpp_program_runs(failures):
    program = '#include <cstdio>\nint main() { std::puts("hello"); }\n'
    assert failures(f"```cpp\n{program}```\n```text\nhello\n```\n") == (1, [])
