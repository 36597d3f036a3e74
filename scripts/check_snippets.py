#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Run the programs printed in README.md and in the pages of docs.

In each page the ``python`` blocks run from top to bottom as one program. A ``cpp`` block with a
``main`` is compiled and run; one without is compiled after ``#include <filippov/filippov.hpp>``. A
``text`` block that directly follows a block is its expected output. Scripts named in ``sh`` blocks
must exist. Everything runs in an empty folder, with the headers of this repository and the
``filippov`` that is installed beside this Python; as many pages at once as there are processors.
"""

from __future__ import annotations

import contextlib
import io
import multiprocessing
import os
import re
import subprocess
import sys
import tempfile
import traceback
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
BLOCK = re.compile(r"^```(\w+)[^\n]*\n(.*?)^```[ \t]*$", re.MULTILINE | re.DOTALL)


@dataclass
class Snippet:
    """One block of a page: its language, text, first line, and the output it promises."""

    language: str
    text: str
    line: int
    expected: str | None = None


def snippets_of(page: str) -> list[Snippet]:
    """Return the blocks of a page; a ``text`` block becomes the output of the one before it."""
    snippets: list[Snippet] = []
    end = 0
    for match in BLOCK.finditer(page):
        language, text = match.groups()
        directly = page[end : match.start()].strip() == ""
        end = match.end()
        if language != "text":
            line = page.count("\n", 0, match.start()) + 2
            snippets.append(Snippet(language, text, line))
        elif snippets and directly:
            snippets[-1].expected = text
    return snippets


def stripped(text: str) -> str:
    """Return the text without white space at the ends of its lines."""
    return "\n".join(line.rstrip() for line in text.strip().splitlines())


def run_python(snippet: Snippet, names: dict[str, object]) -> tuple[str, str]:
    """Run a block in the page's name space; return its output and its error."""
    output = io.StringIO()
    # Blank lines before the block make the line numbers of a traceback those of the page.
    program = "\n" * (snippet.line - 1) + snippet.text
    try:
        with contextlib.redirect_stdout(output):
            exec(compile(program, "page", "exec"), names)
    except Exception:
        return output.getvalue(), traceback.format_exc()
    return output.getvalue(), ""


def run_cpp(snippet: Snippet, folder: Path) -> tuple[str, str]:
    """Compile a block, and run it if it has a ``main``; return its output and its error."""
    source = folder / "snippet.cpp"
    program = folder / "snippet"
    has_main = re.search(r"\bint\s+main\s*\(", snippet.text) is not None
    prelude = "" if has_main else "#include <filippov/filippov.hpp>\n"
    source.write_text(f'{prelude}#line {snippet.line} "page"\n{snippet.text}', encoding="utf-8")
    eigen = os.environ.get("EIGEN_INCLUDE", "/usr/include/eigen3")
    command = [os.environ.get("CXX", "c++"), "-std=c++20", "-O1", "-Wall", "-Wextra"]
    command += ["-DFILIPPOV_NO_FORCED_INLINING"]  # it would take most of the time
    command += [f"-I{ROOT / 'include'}", f"-isystem{eigen}", str(source)]
    command += ["-o", str(program)] if has_main else ["-fsyntax-only"]
    built = subprocess.run(command, capture_output=True, text=True, check=False)
    if built.returncode != 0 or not has_main:
        return "", built.stderr if built.returncode != 0 else ""
    ran = subprocess.run([program], capture_output=True, text=True, check=False, timeout=120)
    return ran.stdout, f"ended with {ran.returncode}\n{ran.stderr}" if ran.returncode else ""


def check_shell(snippet: Snippet) -> tuple[str, str]:
    """Check that the scripts which a block names exist."""
    missing = [
        name
        for name in re.findall(r"\b(?:scripts|examples|bench)/[\w./-]+", snippet.text)
        if not (ROOT / name).exists()
    ]
    return "", f"names what does not exist: {', '.join(missing)}" if missing else ""


def check_page(path: Path) -> tuple[int, list[str]]:
    """Return how many blocks of a page were checked, and what is wrong with them."""
    failures: list[str] = []
    names: dict[str, object] = {"__name__": "__main__"}
    checked = 0
    for snippet in snippets_of(path.read_text(encoding="utf-8")):
        with tempfile.TemporaryDirectory() as folder:
            before = Path.cwd()
            os.chdir(folder)
            try:
                if snippet.language == "python":
                    output, error = run_python(snippet, names)
                elif snippet.language == "cpp":
                    output, error = run_cpp(snippet, Path(folder))
                elif snippet.language == "sh":
                    output, error = check_shell(snippet)
                else:
                    continue
            finally:
                os.chdir(before)
        checked += 1
        where = f"{path.relative_to(ROOT)}:{snippet.line}"
        if error:
            failures.append(f"{where}: {error}")
        elif snippet.language == "sh":
            continue
        elif snippet.expected is not None and stripped(output) != stripped(snippet.expected):
            failures.append(f"{where}: printed\n{output}\nexpected\n{snippet.expected}")
    return checked, failures


def main() -> int:
    """Check every page, print what is wrong, return 0 if nothing is."""
    os.environ.setdefault("MPLBACKEND", "Agg")
    pages = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
    # those with programs to compile take longest, and start first
    pages.sort(key=lambda page: "int main(" not in page.read_text(encoding="utf-8"))
    checked = 0
    failures: list[str] = []
    with ProcessPoolExecutor(mp_context=multiprocessing.get_context("spawn")) as pool:
        for number, wrong in pool.map(check_page, pages):
            checked += number
            failures += wrong
    print(*failures, sep="\n", end="\n" if failures else "")
    print(f"snippets: {checked - len(failures)} passed, {len(failures)} failed")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
