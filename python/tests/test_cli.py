# SPDX-License-Identifier: BSD-3-Clause
"""The command `filippov`, as a stranger types it."""

import subprocess
import sys

import numpy as np
import pytest

import filippov as fp
from filippov._cli import main

OWN = """
import numpy as np
import filippov as fp

@fp.system(state="x v", params={"F": 0.4})
def block(t, s, p):
    return s.v, -s.x - p.F * np.sign(s.v)

other = 3
"""


@pytest.fixture
def own(tmp_path):
    path = tmp_path / "model.py"
    path.write_text(OWN)
    return f"{path}:block"


def test_it_tells_what_there_is(capsys, own):
    assert main(["info"]) == 0
    assert set(fp.models.__all__) == {
        line.split()[0] for line in capsys.readouterr().out.splitlines()
    }
    assert main(["info", own]) == 0
    assert "h = v" in capsys.readouterr().out
    assert main(["info", own, "--cpp"]) == 0
    assert "struct block {" in capsys.readouterr().out


def test_it_follows_a_solution(capsys, own, tmp_path):
    table, picture = tmp_path / "run.csv", tmp_path / "run.png"
    files = ["-o", str(table), "--plot", str(picture)]
    assert main(["run", own, "--start", "3,0", "--time", "0:20", *files]) == 0
    told = capsys.readouterr().out
    assert f"{np.pi:14.8f}  cross" in told
    assert f"{4 * np.pi:14.8f}  enter_sliding" in told
    rows = np.genfromtxt(table, delimiter=",", names=True)
    assert rows.dtype.names == ("t", "x", "v")
    assert rows["x"][-1] == pytest.approx(-0.2, abs=1e-9)
    assert picture.stat().st_size > 10_000


def test_a_run_is_saved_whole(own, tmp_path):
    path = tmp_path / "run.npz"
    assert main(["run", own, "--start", "3,0", "--time", "0:20", "-o", str(path)]) == 0
    run = fp.load(path)
    assert run.t[-1] == 20
    assert list(run.events["kind"][:3]) == ["start", "cross", "cross"]
    assert run.sol(np.pi / 2) == pytest.approx([0.4, -2.6], abs=1e-7)


def test_values_may_be_negative(capsys):
    assert main(["run", "relay", "--start", "-0.5,.5,-1", "--time", "-1:2"]) == 0
    joined = capsys.readouterr().out
    assert main(["run", "relay", "--start=-0.5,.5,-1", "--time=-1:2", "--method", "dop853"]) == 0
    assert capsys.readouterr().out == joined
    assert main(["run", "relay", "--start=-0.5,.5,-1", "--time=-1:2", "--method", "rodas5p"]) == 0


def test_a_run_that_ends_early_is_no_success(capsys):
    repelled = ["-p", "c=0", "-p", "d=0", "-p", "b=-1", "--start", "0", "--time", "0:1"]
    assert main(["run", "quartet", *repelled]) == 1
    assert "ambiguous" in capsys.readouterr().out


def test_it_makes_a_diagram(capsys, tmp_path):
    kept, picture = tmp_path / "diagram.npz", tmp_path / "diagram.png"
    over = ["--over", "omega=2.84:2.94:5", "--transient", "50", "--keep", "50"]
    assert main(["diagram", "oscillator", *over, "-o", str(kept), "--plot", str(picture)]) == 0
    assert "5 values of omega" in capsys.readouterr().out
    assert fp.load(kept).values == pytest.approx(np.linspace(2.84, 2.94, 5))
    assert picture.exists()


def test_it_makes_basins(capsys, tmp_path):
    kept = tmp_path / "basins.npz"
    at = ["-p", "A=3.6", "-p", "omega=1.067", "--grid", "y=-3:3:20", "--grid", "v=-1:3.5:20"]
    assert main(["basins", "oscillator", *at, "-o", str(kept)]) == 0
    assert "2 attractors" in capsys.readouterr().out
    assert fp.load(kept).label.shape == (20, 20)


RUN = ["run", "oscillator", "--start", "0,0", "--time", "0:1"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["info", "nothing"], "built-in model"),
        (["info", "nowhere.py:block"], "no file nowhere.py"),
        ([*RUN, "-p", "A"], "NAME=VALUE"),
        ([*RUN, "-p", "B=1"], "no parameter 'B'"),
        ([*RUN, "-p", "A=one"], "'one' is no number"),
        (["run", "oscillator", "--start", "0", "--time", "0:1"], "x0"),
        (["run", "oscillator", "--start", "0,0", "--time", "5"], "FROM:TO"),
        (["diagram", "oscillator", "--over", "omega=1:2"], "NAME=FROM:TO:N"),
        (["diagram", "oscillator", "--over", "omega=1:2:1.5"], "number of values"),
        (["diagram", "oscillator", "--over", "omega=1:2:3", "--section", "x"], "section"),
        (["basins", "oscillator", "--grid", "y=-1:1:0"], "number of values"),
        (["diagram", "oscillator", "--over", "omega=1:2:inf"], "number of values"),
        (["diagram", "oscillator", "--over", "omega=1:2:nan"], "number of values"),
        (["diagram", "oscillator", "--over", "omega=1:2:1e30"], "number of values"),
        (["diagram", "oscillator", "--over", "omega=1:inf:3"], "finite ends"),
    ],
)
def test_wrong_arguments_are_named(capsys, arguments, words):
    assert main(arguments) == 2
    assert words in capsys.readouterr().err


@pytest.mark.parametrize("option", ["-o", "--plot"])
def test_a_file_that_cannot_be_written_is_refused_before_any_work(capsys, option):
    with pytest.raises(SystemExit) as ended:
        main(["run", "oscillator", "--start", "0,0", "--time", "0:1e12", option, "nowhere/run.npz"])
    assert ended.value.code == 2
    assert "no directory nowhere" in capsys.readouterr().err


def test_a_name_that_is_no_system(capsys, own):
    assert main(["info", own.replace(":block", ":other")]) == 2
    assert "expected a built-in model" in capsys.readouterr().err


def test_it_is_a_program():
    for words in (["--help"], ["run", "--help"], ["--version"]):
        told = subprocess.run(
            [sys.executable, "-m", "filippov", *words],
            capture_output=True, text=True, check=True, timeout=60,
        )  # fmt: skip
        assert told.stdout
