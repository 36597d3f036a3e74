# SPDX-License-Identifier: BSD-3-Clause
import importlib.util
import re
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
SPECIFICATION = importlib.util.spec_from_file_location(
    "count_instructions", ROOT / "scripts" / "count_instructions.py"
)
tool = importlib.util.module_from_spec(SPECIFICATION)
sys.modules["count_instructions"] = tool  # where dataclasses look for names
SPECIFICATION.loader.exec_module(tool)

BUILD = {"compiler": "gcc 12.2.0", "libc": "glibc 2.36", "eigen": "3.4.0", "flags": "-O3"}


def counts(hand=1000, run=2000, build=BUILD, **more):
    runs = {"hand loop": tool.Run(hand, ""), "run": tool.Run(run, "hand loop")}
    return tool.Counts(build, runs | {name: tool.Run(n, "") for name, n in more.items()})


def judge(kept, found, strict=False):
    judgement = tool.judge(kept, found, strict)
    return judgement.failures, judgement.remarks


@pytest.mark.parametrize("run", [1961, 2000, 2039])
def test_a_change_within_the_limit_is_no_matter(run):
    assert judge(counts(), counts(run=run)) == ([], [])


def test_a_slower_run_fails():
    failures, remarks = judge(counts(), counts(run=2050))
    assert failures == ["run: 2.5% more instructions"]
    assert remarks == []


def test_a_slower_hand_loop_fails_too():
    assert judge(counts(), counts(hand=1021))[0] == ["hand loop: 2.1% more instructions"]


def test_a_faster_run_is_to_be_kept():
    failures, remarks = judge(counts(), counts(run=1900))
    assert failures == []
    assert remarks == ["run: 5.0% fewer instructions; --update keeps them"]


def test_an_unknown_run_fails():
    assert judge(counts(), counts(other=5))[0] == ["other: not in counts.json"]


def test_a_missing_run_fails():
    assert judge(counts(other=5), counts())[0] == ["other: is run no more"]


@pytest.mark.parametrize("key", list(BUILD))
def test_counts_of_another_build_judge_nothing_unless_they_have_to(key):
    other = counts(run=9000, build=BUILD | {key: "another"})
    words = f"counts are not comparable: {key} another, kept {BUILD[key]}"
    assert judge(counts(), other) == ([], [words])
    assert judge(counts(), other, strict=True) == ([words], [])


def test_ratios_of_another_build_are_printed_beside_those_kept():
    other = counts(hand=3000, run=9000, build=BUILD | {"compiler": "clang 16.0.6"})
    line = tool.report(counts(), other).splitlines()[-1]
    assert line.split() == ["run", "9,000", "3.00", "2.00"]
    assert tool.report(counts(), counts(run=2020)).splitlines()[-1].split()[-1] == "+1.00%"


@pytest.mark.parametrize(("found", "kept"), [(1999, 1999), (2039, 2000), (2050, 2050)])
def test_an_update_forgives_no_small_loss(found, kept):
    assert tool.updated(counts(), counts(run=found)).runs["run"].instructions == kept


def test_small_losses_add_up_until_they_fail():
    kept = tool.updated(counts(), counts(run=2030))
    assert judge(kept, counts(run=2060))[0] == ["run: 3.0% more instructions"]


def test_an_update_by_another_compiler_keeps_all_that_it_counts():
    other = counts(run=2010, build=BUILD | {"compiler": "gcc 14.2.0"}, more=7)
    assert tool.updated(counts(gone=3), other) == other


def test_a_file_is_read_as_it_was_written(tmp_path):
    tool.save(counts(), tmp_path / "counts.json")
    assert tool.load(tmp_path / "counts.json") == counts()
    assert tool.load(tmp_path / "none.json").runs == {}


def test_a_page_with_other_numbers_does_not_agree():
    page = tool.put_into(f"a\n{tool.BEGIN}\n{tool.END}\nb\n", tool.page_table(counts()))
    assert "| run | 0.00 | 2.00 |" in page
    assert tool.page_agrees(counts(), page)
    assert not tool.page_agrees(counts(run=2100), page)
    with pytest.raises(SystemExit, match="the page lacks"):
        tool.put_into("a page", "")


def test_the_page_has_the_kept_counts():
    assert tool.page_agrees(tool.load(tool.KEPT), tool.PAGE.read_text(encoding="utf-8"))


def test_every_kept_run_stands_beside_one_of_the_hand_loop():
    kept = tool.load(tool.KEPT)
    beside = {run.beside for run in kept.runs.values()} - {""}
    assert beside <= kept.runs.keys()
    assert all("hand loop" in name for name in beside)
    assert {name for name in kept.runs if re.search("hand loop", name)} == beside
