# SPDX-License-Identifier: BSD-3-Clause
"""What every result can: be drawn, saved, pickled, and given as a dataset."""

import contextlib
import dataclasses
import json
import pickle
import re
import shutil
from collections.abc import Mapping

import numpy as np
import pytest

import filippov as fp

matplotlib = pytest.importorskip("matplotlib")
matplotlib.use("Agg")

import matplotlib.pyplot as plt  # noqa: E402
from matplotlib.colors import to_hex  # noqa: E402
from matplotlib.lines import Line2D  # noqa: E402

BLOCK = fp.models.oscillator
BOX = {"y": (-3.0, 3.0), "v": (-1.1, 3.0)}
GRID = {name: (*ends, 12) for name, ends in BOX.items()}
DRIVEN = {"A": 5.0, "omega": 2.5}


@fp.system(state="x v", params={"F": 0.4, "w": 0.7}, period=lambda p: 2 * np.pi / p.w)
def typed(t, s, p):
    return s.v, -s.x + np.cos(p.w * t) - p.F * np.sign(s.v - 0.5)


def orbit():
    return fp.periodic_orbit(BLOCK, params=DRIVEN)


def branch():
    return fp.continuation(orbit(), "omega", (2.2, 2.6))


def picture():
    return fp.basins(BLOCK, GRID)


def coexisting():
    return fp.basins(
        BLOCK, {"y": (-4, 4, 16), "v": (-3, 4, 16)}, params={"A": 3.6, "omega": 1.067},
        audit=0, seeds=32, saddle_starts=36,
    )  # fmt: skip


MADE = {
    "trajectory": lambda: fp.simulate(BLOCK, [0, 0], (0, 30)),
    "trajectory of 8th order": lambda: fp.simulate(BLOCK, [0, 0], (0, 30), method="dop853"),
    "trajectory without dense output": lambda: fp.simulate(
        BLOCK, [0, 0], (0, 5), dense_output=False, t_eval=[1, 2]
    ),
    "trajectory of one's own system": lambda: fp.simulate(
        typed.with_params(F=0.3), [1, 0], (0, 30), events=lambda t, y: y[0]
    ),
    "trajectory with jumps": lambda: fp.simulate(fp.models.bouncing_ball, [1, 0], (0, 1.2)),
    "trajectory on several surfaces": lambda: fp.simulate(
        fp.models.two_blocks, [1, 0.5, 0, 0], (0, 10)
    ),
    "trajectory that stopped": lambda: fp.simulate(BLOCK, [0, 0], (0, 30), max_steps=20),
    "solutions": lambda: fp.simulate(
        fp.models.sign_plane, [0, 0], (0, 1), on_nonunique="all"
    ),
    "ensemble": lambda: fp.ensemble(
        typed, np.zeros((2, 3)), (0, 5), params={"F": np.array([0.1, 0.2, 0.3])}
    ),
    "ensemble of one": lambda: fp.ensemble(typed, [0, 0], (0, 5)),
    "ensemble of starts and parameters": lambda: fp.ensemble(
        typed, np.zeros((2, 3, 2)), (0, 5), params={"F": np.array([0.1, 0.2, 0.3])[:, None]}
    ),
    "event map": lambda: fp.event_map(BLOCK, params=DRIVEN, samples=64),
    "diagram": lambda: fp.bifurcation_diagram(typed, w=[0.6, 0.7], transient=5, keep=10),
    "orbit": orbit,
    "orbit that is none": lambda: fp.periodic_orbit(fp.models.relay, [1, 1, 1], window=1.0),
    "branch": branch,
    "cell map": lambda: fp.cell_map(BLOCK, GRID),
    "basins": picture,
    "refined basins": lambda: coexisting().refine(coarse=8, levels=2, audit=0),
    "boundary of basins": lambda: fp.basin_boundary(coexisting()),
    "unstable set": lambda: fp.unstable_set(coexisting()),
    "basins over a parameter": lambda: fp.follow_basins(
        BLOCK, {"y": (-4, 4, 10), "v": (-3, 4, 10)}, "A", [3.5, 3.6], params={"omega": 1.067}
    ),
    "curves in two parameters": lambda: fp.bifurcation_set(
        BLOCK, {"omega": (2.4, 2.7), "A": (4.7, 4.9)}, lines=1, starts=2
    ),
    "time steps": lambda: fp.time_stepping(BLOCK, [0, 0], (0, 10), n_steps=200),
    "region": lambda: fp.sliding_region(BLOCK, 0.3, bounds=BOX),
    "boundary of the region": lambda: fp.sliding_boundaries(
        BLOCK, bounds={"y": (-9, 9), "v": (0, 2)}
    )[0],
    "exponents": lambda: fp.lyapunov(BLOCK, transient=5, window=20),
    "images": lambda: fp.strobe_map(BLOCK, np.zeros((2, 3)), wrt="A"),
    "image": lambda: fp.section_map(BLOCK, [0, 0]),
}  # fmt: skip


@pytest.fixture(scope="module")
def made():
    known = {}

    def make(name):
        if name not in known:
            known[name] = MADE[name]()
        return known[name]

    return make


def assert_equal(a, b, where="result"):
    """Equal in every field, to the bit."""
    assert type(a) is type(b), where
    if isinstance(a, np.ndarray):
        assert a.dtype == b.dtype, where
        for name in a.dtype.names or ():
            assert_equal(a[name], b[name], f"{where}[{name!r}]")
        if a.dtype.names is None:
            np.testing.assert_array_equal(a, b, err_msg=where)
    elif isinstance(a, fp.System):
        assert a.name == b.name
        assert dict(a.params) == dict(b.params)
        assert repr(a) == repr(b)
    elif isinstance(a, fp.Solution):
        t = np.linspace(a.t_min, a.t_max, 301)
        assert_equal(a.ts, b.ts, f"{where}.ts")
        assert_equal(a(t), b(t), f"{where}(t)")
        assert_equal(a.mode(t), b.mode(t), f"{where}.mode")
        assert_equal(a.s(t), b.s(t), f"{where}.s")
    elif dataclasses.is_dataclass(a):
        for field in dataclasses.fields(a):
            name = field.name
            assert_equal(getattr(a, name), getattr(b, name), f"{where}.{name}")
    elif isinstance(a, (tuple, list)):
        assert len(a) == len(b), where
        for k, (v, w) in enumerate(zip(a, b, strict=True)):
            assert_equal(v, w, f"{where}[{k}]")
    elif isinstance(a, Mapping):
        assert list(a) == list(b), where
        for key in a:
            assert_equal(a[key], b[key], f"{where}[{key!r}]")
    else:
        assert a == b or (a != a and b != b), where


def test_a_run_of_no_length_is_saved(tmp_path):
    run = fp.simulate(BLOCK, [0, 0], (1.0, 1.0))
    run.save(tmp_path / "run.npz")
    assert_equal(run, fp.load(tmp_path / "run.npz"))


@pytest.mark.parametrize("name", MADE)
@pytest.mark.parametrize("suffix", [".npz", ".zarr"])
def test_saved_and_loaded(made, tmp_path, name, suffix):
    if suffix == ".zarr":
        pytest.importorskip("zarr")
    result = made(name)
    result.save(tmp_path / f"result{suffix}")
    assert_equal(result, fp.load(tmp_path / f"result{suffix}"))
    assert [path.name for path in tmp_path.iterdir()] == [f"result{suffix}"]
    result.save(tmp_path / f"result{suffix}")  # in its place


@pytest.mark.parametrize("name", MADE)
def test_pickled(made, name):
    assert_equal(made(name), pickle.loads(pickle.dumps(made(name))))


@pytest.mark.parametrize("name", MADE)
def test_as_a_dataset(made, name):
    xarray = pytest.importorskip("xarray")
    result = made(name)
    for each in result if isinstance(result, fp.Branches) else [result]:
        data = each.to_xarray()
        assert isinstance(data, xarray.Dataset)
        assert data.attrs["filippov"] == fp.__version__
        assert data.attrs["system"] == each.system.name
        for parameter, value in each.params.items():
            assert np.ndim(value) or data.attrs[parameter] == value
        # what a NetCDF file can hold
        for value in data.attrs.values():
            assert isinstance(value, (int, float, str, list, np.generic)), value
        for variable in data.variables.values():
            assert variable.dtype.kind in "fiubU", variable


def as_read(value):
    """An attribute as NetCDF gives it back, which does not tell one number from a list of one."""
    return value if isinstance(value, str) else np.squeeze(np.asarray(value, dtype=np.float64))


@pytest.mark.parametrize("name", MADE)
@pytest.mark.parametrize("engine", ["netcdf4", "scipy"])  # formats 4 and 3
def test_netcdf_gives_the_dataset_back(made, tmp_path, name, engine):
    xarray = pytest.importorskip("xarray")
    pytest.importorskip({"netcdf4": "netCDF4"}.get(engine, engine))
    result = made(name)
    for each in result if isinstance(result, fp.Branches) else [result]:
        data = each.to_xarray()
        data.to_netcdf(tmp_path / "result.nc", engine=engine)
        with xarray.open_dataset(tmp_path / "result.nc", engine=engine) as read:
            xarray.testing.assert_equal(read, data)
            assert set(read.attrs) == set(data.attrs)
            for key, value in data.attrs.items():
                np.testing.assert_array_equal(as_read(read.attrs[key]), as_read(value), key)


def test_multipliers_of_a_dataset_are_in_two_parts(made):
    pytest.importorskip("xarray")
    for result in (made("orbit"), made("branch")):
        data = result.to_xarray()
        both = data["multipliers_real"].values + 1j * data["multipliers_imag"].values
        np.testing.assert_array_equal(both, result.multipliers)


def test_words_of_samples_are_variables(made):
    pytest.importorskip("xarray")
    graph, diagram, images = (made(name) for name in ("event map", "diagram", "images"))
    assert graph.to_xarray()["word"].values.tolist() == list(graph.word)
    assert graph.to_xarray()["reason"].values.tolist() == [str(each) for each in graph.reason]
    assert diagram.to_xarray()["message"].values.tolist() == list(diagram.message)
    assert images.to_xarray()["message"].values.tolist() == list(images.message)
    assert made("branch").to_xarray().attrs["ends"] == "; ".join(made("branch").ends)


@pytest.mark.parametrize("engine", ["netcdf4", "scipy"])
def test_netcdf_takes_what_is_empty_or_large(tmp_path, engine):
    xarray = pytest.importorskip("xarray")
    pytest.importorskip({"netcdf4": "netCDF4"}.get(engine, engine))
    high = {"y": (-3.0, 3.0), "v": (1.5, 3.0)}
    for result in (
        fp.sliding_region(BLOCK, 0.3, bounds=high),  # no pieces
        fp.simulate(BLOCK, [0, 0], (0, 1), max_steps=2**40),  # no 32 bits
        fp.bifurcation_diagram(BLOCK, A=[0.0], transient=1, keep=1),  # no points
    ):
        data = result.to_xarray()
        data.to_netcdf(tmp_path / "result.nc", engine=engine)
        with xarray.open_dataset(tmp_path / "result.nc", engine=engine) as read:
            xarray.testing.assert_equal(read, data)
            assert read.attrs.get("max_steps", 2**40) == data.attrs.get("max_steps", 2**40)


@pytest.mark.parametrize("name", [name for name in MADE if "image" not in name])
def test_drawn_on_axes_that_are_given(made, name):
    result = made(name)
    if isinstance(result, fp.Orbit) and not result.success:
        pytest.skip("there is nothing to draw")
    before = dict(matplotlib.rcParams)
    figure, (ax, other) = plt.subplots(1, 2)
    try:
        artists = result.plot(ax)
        assert artists
        for artist in artists:
            assert artist.axes is ax
        assert not other.has_data()
        assert ax.get_xlabel()
        assert dict(matplotlib.rcParams) == before
    finally:
        plt.close(figure)


@pytest.mark.parametrize("name", ["trajectory", "ensemble", "diagram", "orbit", "branch"])
def test_short_names_of_keywords_are_those_of_matplotlib(made, name):
    figure, ax = plt.subplots()
    try:
        drawn = made(name).plot(ax, c="#123456", ls=":", zorder=7.5)
        lines = [a for a in drawn if isinstance(a, Line2D) and a.get_zorder() == 7.5]
        assert lines
        assert {to_hex(line.get_color()) for line in lines} == {"#123456"}
    finally:
        plt.close(figure)


def test_a_file_tells_what_it_holds(made, tmp_path):
    fp.simulate(typed.with_params(F=0.3), [1, 0], (0, 30)).save(tmp_path / "run.npz")
    with np.load(tmp_path / "run.npz") as file:
        meta = json.loads(str(file["__filippov__"]))
        assert file["y"].shape[0] == 2
    assert meta["filippov"] == fp.__version__
    (system,) = meta["systems"]
    assert system["params"]["F"] == 0.3
    assert system["formulas"]["state"] == ["x", "v"]
    assert meta["content"]["fields"]["settings"]["fields"]["rtol"] == 1e-8
    # and runs on from there
    run = fp.load(tmp_path / "run.npz")
    again = fp.simulate(run.system, run.y[:, 0], (0, 30))
    np.testing.assert_array_equal(again.y, run.y)


def test_zarr_is_read_by_zarr(made, tmp_path):
    zarr = pytest.importorskip("zarr")
    run = made("trajectory")
    run.save(tmp_path / "run.zarr")
    root = zarr.open_group(tmp_path / "run.zarr", mode="r")
    group = root[root.attrs["arrays"]]
    np.testing.assert_array_equal(group["y"][...], run.y)
    np.testing.assert_array_equal(group["events.t"][...], run.events["t"])
    words = group["events.kind"].attrs["words"]
    assert [words[k] for k in group["events.kind"][...]] == run.events["kind"].tolist()


def test_multipliers_are_drawn_with_the_unit_circle(made):
    for result in (made("orbit"), made("branch")):
        figure, ax = plt.subplots()
        circle, *points = result.plot_multipliers(ax)
        x, y = circle.get_data()
        np.testing.assert_allclose(np.hypot(x, y), 1.0)
        drawn = sum(p.get_xdata().size for p in points)
        assert drawn == result.multipliers.size
        plt.close(figure)


def test_the_cobweb_is_the_iterates(made):
    graph = made("event map")
    figure, ax = plt.subplots()
    artists = graph.plot(ax, cobweb=1.0, iterations=5)
    (web,) = [a for a in artists if a.get_label() == "iterates"]
    x, y = web.get_data()
    np.testing.assert_array_equal(x[2::2], y[2::2])  # on the diagonal
    np.testing.assert_array_equal(x[1::2], x[0:-1:2])
    # the slides of a run from there end at the same phases
    once = fp.section_map(BLOCK, [0, 0], params=DRIVEN)
    start = float(once.t * DRIVEN["omega"] % (2 * np.pi))
    run = fp.simulate(BLOCK, once.x, (once.t, once.t + 20), params=DRIVEN, rtol=1e-11)
    exits = run.events[run.events["kind"] == "exit_sliding"]
    phases = exits["t"][exits["t"] > once.t + 1e-6] * DRIVEN["omega"] % (2 * np.pi)
    boundary = int(np.sign(BLOCK.equivalent_control(once.t, once.x, DRIVEN)))
    (web,) = [
        a
        for a in graph.plot(ax, boundary=boundary, cobweb=start, iterations=5)
        if a.get_label() == "iterates"
    ]
    assert web.get_ydata()[1::2] == pytest.approx(phases[:5], abs=1e-6)
    plt.close(figure)


# --- what is damaged, and what is somebody else's -------------------------------------------------


def test_a_file_that_is_damaged_is_refused(made, tmp_path):
    made("trajectory").save(tmp_path / "run.npz")
    whole = (tmp_path / "run.npz").read_bytes()
    random = np.random.default_rng(1)
    for k in range(60):
        damaged = bytearray(whole)
        if k % 3 == 0:
            damaged = damaged[: random.integers(len(whole))]
        else:
            for place in random.integers(len(whole), size=20):
                damaged[place] = random.integers(256)
        (tmp_path / "damaged.npz").write_bytes(bytes(damaged))
        with contextlib.suppress(ValueError, OSError):  # and nothing else
            fp.load(tmp_path / "damaged.npz")


def edited(path, out, edit):
    """Copy a file with other metadata or arrays."""
    with np.load(path) as file:
        arrays = dict(file)
    meta = json.loads(str(arrays.pop("__filippov__")))
    edit(meta, arrays)
    with out.open("wb") as file:
        np.savez(file, __filippov__=np.array(json.dumps(meta)), **arrays)


def other_param(meta, arrays):
    meta["systems"][0]["formulas"]["nodes"] = [
        [op, a, b, c, 60_000 if op == "param" else index, value]
        for op, a, b, c, index, value in meta["systems"][0]["formulas"]["nodes"]
    ]


def no_params(meta, arrays):
    meta["systems"][0]["formulas"]["params"] = meta["systems"][0]["params"] = {}


def other_modes(meta, arrays):
    arrays["sol.mode"] = arrays["sol.mode"] + 100


def other_times(meta, arrays):
    arrays["sol.t"] = np.random.default_rng(1).permutation(arrays["sol.t"])


def object_number(meta, arrays):
    meta["content"]["fields"]["y"] = {"number": 1, "dtype": "|O"}


@pytest.mark.parametrize("edit", [other_param, no_params, other_modes, other_times, object_number])
def test_a_file_that_makes_no_sense_is_refused(made, tmp_path, edit):
    made("trajectory of one's own system").save(tmp_path / "run.npz")
    edited(tmp_path / "run.npz", tmp_path / "edited.npz", edit)
    with pytest.raises(ValueError, match="path = "):
        fp.load(tmp_path / "edited.npz")


# Lists of which nothing else says how long they are.
FREE = ("breaks", "breakpoints", "branches.0.points", "branches.1.points", "pieces.0", "pieces.1")


def entries(content):
    """All dictionaries of fields in the metadata of a file."""
    if isinstance(content, dict):
        if "class" in content:
            yield content["fields"]
        for inner in content.values():
            yield from entries(inner)
    elif isinstance(content, list):
        for inner in content:
            yield from entries(inner)


def refused(path):
    """Whether a file is refused as it should be, by a ValueError that names it."""
    try:
        fp.load(path)
    except ValueError as error:
        return str(error).startswith("path = ")
    return False


@pytest.mark.parametrize("name", MADE)
def test_no_array_may_be_missing_cut_or_of_another_kind(made, tmp_path, name):
    made(name).save(tmp_path / "whole.npz")
    with np.load(tmp_path / "whole.npz") as file:
        sizes = {key: file[key].size * bool(file[key].ndim) for key in file.files}
    changes = {
        "missing": None,
        "of words": lambda a: np.full(a.shape, "?"),
        "with one more axis": lambda a: a[np.newaxis],
        "cut": lambda a: a[..., :-1],
    }
    # of several parts of one kind the first
    patterns = {re.sub(r"\d+", "#", key): key for key in reversed(sizes)}
    for key in set(patterns.values()) - {"__filippov__"}:
        for what, change in changes.items():

            def edit(meta, arrays, key=key, change=change):
                old = arrays.pop(key)
                if change is not None:
                    arrays[key] = change(old)

            if what == "cut" and (sizes[key] == 0 or key.endswith(FREE)):
                continue
            edited(tmp_path / "whole.npz", tmp_path / "edited.npz", edit)
            assert refused(tmp_path / "edited.npz"), f"{key} {what} was loaded"


@pytest.mark.parametrize("name", MADE)
def test_no_field_may_be_missing_or_of_another_kind(made, tmp_path, name):
    made(name).save(tmp_path / "whole.npz")
    with np.load(tmp_path / "whole.npz") as file:
        meta = json.loads(str(file["__filippov__"]))
    seen = set()
    for k, fields in enumerate(entries(meta["content"])):
        for field in fields:
            if (kind := (tuple(fields), field)) in seen:
                continue  # of each class once
            seen.add(kind)
            for value in (None, [], {"system": 99}, {"mapping": {"?": "?"}}):

                def edit(meta, arrays, k=k, field=field, value=value):
                    fields = list(entries(meta["content"]))[k]
                    if value is None:
                        del fields[field]
                    else:
                        fields[field] = value

                edited(tmp_path / "whole.npz", tmp_path / "edited.npz", edit)
                assert refused(tmp_path / "edited.npz"), f"{field} = {value} was loaded"


def set_to(column, value, at=slice(None)):
    """Change an array, or a column of records."""

    def edit(meta, arrays):
        name, _, inner = column.partition("/")
        array = arrays[name]
        (array[inner] if inner else array)[at] = value

    return edit


def turned(column):
    """Put an array in reverse."""

    def edit(meta, arrays):
        name, _, inner = column.partition("/")
        array = arrays[name]
        if inner:
            array[inner] = array[inner][::-1].copy()
        else:
            arrays[name] = array[::-1]

    return edit


def field(path, value):
    """Change a field of the metadata."""

    def edit(meta, arrays):
        *outer, last = path.split(".")
        fields = meta["content"]["fields"]
        for name in outer:
            fields = fields[name]["fields"]
        fields[last] = value

    return edit


@pytest.mark.parametrize(
    ("name", "edit", "reason"),
    [
        ("trajectory", turned("t"), "t and events.t go opposite ways"),
        ("trajectory", set_to("t", np.nan, 3), "t has values that are not finite"),
        ("trajectory", set_to("t", 99.0, -1), "t is not within events.t"),
        ("trajectory", set_to("mode", 7, 3), "mode has 7, expected -1 to 1"),
        ("trajectory", set_to("events/t", 29.0, 1), "events.t is out of order"),
        ("trajectory", set_to("events/surface", 3, 1), "surface has 3, expected -1 to 0"),
        ("trajectory", set_to("events/mode_after", 5, 1), "mode_before is not the mode after"),
        ("trajectory", set_to("events/kind", "leap", 1), "kind has 'leap', expected one of"),
        ("trajectory", field("settings.method", "euler"), "Settings: method = 'euler'"),
        ("trajectory", field("settings.rtol", 0), "Settings: rtol = 0"),
        ("trajectory", field("stats.steps", -1), "expected counts"),
        ("trajectory", field("params", {"params": {}}), "params are none, expected A, omega"),
        ("trajectory", field("status", {"tuple": []}), "status is (), expected Status"),
        ("trajectory of one's own system", field("t_events", None), "surface has 0, expected 0"),
        ("ensemble", set_to("status", "so", 0), "status has 'so', expected one of"),
        ("orbit", set_to("events/surface", 1, 0), "surface has 1, expected 0 to 0"),
        ("orbit", field("word", "0-"), "word is '0-', which is not that of its events"),
        ("orbit", field("turns", 2), "period is"),
        ("branch", set_to("events/point", 10_000, -1), "point has 10000, expected 0 to"),
        ("branch", set_to("turns", 0, 0), "period or turns is not > 0"),
        ("event map", set_to("boundary", 0, 0), "boundary has 0, expected -1 or +1"),
        ("diagram", set_to("value", 9, 0), "value has 9, expected 0 to 1"),
        ("diagram", set_to("surface", 4, 0), "surface has 4, expected -1 to 0"),
        ("cell map", set_to("group", 99, 0), "group has 99, expected -2 to"),
        ("basins", set_to("label", 99, 0), "label has 99, expected -1 to"),
        ("refined basins", set_to("squares", 30, 0), "level has 30, expected 0 to 2"),
        ("boundary of basins", set_to("curves.0.kind", "coast", 0), "kind has 'coast'"),
        ("basins over a parameter", set_to("labels.0", 99, 0), "labels are [99"),
        ("time steps", set_to("t", -1.0, -1), "t is out of order"),
        ("boundary of the region", set_to("t", np.nan, 3), "t has values that are not finite"),
    ],
)
def test_the_reason_is_told_why_a_file_is_refused(made, tmp_path, name, edit, reason):
    made(name).save(tmp_path / "whole.npz")
    edited(tmp_path / "whole.npz", tmp_path / "edited.npz", edit)
    with pytest.raises(ValueError, match=re.escape(reason)) as caught:
        fp.load(tmp_path / "edited.npz")
    assert "makes no sense" in str(caught.value)


def test_a_file_with_objects_in_it_runs_nothing(tmp_path):
    class Trap:
        def __reduce__(self):
            return pytest.fail, ("it was executed",)

    content = {"class": "Trajectory", "fields": {"t": {"array": "t"}}}
    meta = {"format": "filippov", "version": 2, "systems": [], "content": content}
    with (tmp_path / "trap.npz").open("wb") as file:
        trap = np.array([Trap()], dtype=object)
        np.savez(file, __filippov__=np.array(json.dumps(meta)), t=trap)
    with pytest.raises(ValueError, match="path = "):
        fp.load(tmp_path / "trap.npz")


def test_a_chunk_that_is_missing_is_seen(made, tmp_path):
    pytest.importorskip("zarr")
    made("trajectory").save(tmp_path / "run.zarr")
    (data,) = (tmp_path / "run.zarr").glob("data-*")
    shutil.rmtree(data / "y" / "c")
    with pytest.raises(ValueError, match="expected a file written by"):
        fp.load(tmp_path / "run.zarr")


@pytest.mark.parametrize("name", ["data.zarr", "data"])
def test_what_is_not_a_result_is_not_replaced(made, tmp_path, name):
    pytest.importorskip("zarr")
    (tmp_path / name).mkdir()
    (tmp_path / name / "thesis.tex").write_text("all of it")
    with pytest.raises(FileExistsError, match="path = "):
        made("trajectory").save(tmp_path / name)
    assert (tmp_path / name / "thesis.tex").read_text() == "all of it"
    assert [path.name for path in tmp_path.iterdir()] == [name]


@pytest.mark.parametrize("name", ["basins", "cell map"])
@pytest.mark.parametrize(
    "change", [{"method": "rodas5p"}, {"on_nonunique": "all"}, {"first_step": 0.1}]
)
def test_pictures_with_settings_that_they_cannot_have_are_not_loaded(made, tmp_path, name, change):
    picture = made(name)
    other = dataclasses.replace(picture, settings=dataclasses.replace(picture.settings, **change))
    other.save(tmp_path / "picture.npz")
    with pytest.raises(ValueError, match=next(iter(change))):
        fp.load(tmp_path / "picture.npz")
