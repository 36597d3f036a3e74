# SPDX-License-Identifier: BSD-3-Clause
import numpy as np
import pytest

import filippov as fp
from filippov import _core

COULOMB = fp.models.coulomb


def watch(function, **attributes):
    for name, value in attributes.items():
        setattr(function, name, value)
    return function


def test_event_kinds_and_statuses_are_those_of_the_core():
    assert [kind.value for kind in fp.EventKind] == _core.event_kind_names()
    assert [status.value for status in fp.Status] == _core.status_names()


def test_a_kind_compares_with_the_log_and_with_its_name():
    run = fp.simulate(COULOMB, [3, 0], (0, 20))
    same = run.events["kind"] == fp.EventKind.cross
    assert same.sum() == 3
    assert (same == (run.events["kind"] == "cross")).all()
    assert f"{fp.EventKind.cross}" == str(fp.EventKind.cross) == "cross"
    assert f"{run.status}" == "ok"


def test_the_log_has_the_documented_fields():
    run = fp.simulate(fp.models.oscillator, [0, 0], (0, 50))
    log = run.events
    assert log.dtype.names == (
        "t", "kind", "surface", "mode_before", "mode_after", "x_left", "x_right", "s",
        "period", "t_local", "contacts", "alternatives",
    )  # fmt: skip
    assert log["kind"][0] == "start"
    assert log["kind"][-1] == "end"
    assert log["x_left"].shape == (log.size, 2)
    assert (np.diff(log["t"]) >= 0).all()
    T = run.system.period()
    np.testing.assert_allclose(log["period"] * T + log["t_local"], log["t"], rtol=1e-15)
    assert ((log["t_local"] >= 0) & (log["t_local"] < T)).all()


def test_log_of_two_surfaces_has_a_mode_for_each():
    run = fp.simulate(fp.models.dieci_lopez_2, [0.04, -0.01, -0.02], (0, 0.4))
    assert run.events["mode_before"].shape == (run.events.size, 2)
    enter = run.events[1]
    assert enter["surface"] == 0
    assert enter["mode_before"].tolist() == [-1, -1]
    assert enter["mode_after"].tolist() == [0, -1]


def test_zeros_of_an_event_function_are_found_where_they_are():
    run = fp.simulate(COULOMB, [3, 0], (0, 5), events=lambda t, y: y[0], rtol=1e-11, atol=1e-13)
    # first half swing: x = 2.6 cos t + 0.4, zero at acos(-0.4/2.6)
    assert run.t_events[0][0] == pytest.approx(np.arccos(-0.4 / 2.6), abs=1e-10)
    assert run.y_events[0].shape == (run.t_events[0].size, 2)
    np.testing.assert_allclose(run.y_events[0][:, 0], 0, atol=1e-12)
    section = run.events[run.events["kind"] == "section"]
    np.testing.assert_array_equal(section["t"], run.t_events[0])


def test_without_event_functions_there_are_no_lists():
    run = fp.simulate(COULOMB, [3, 0], (0, 5))
    assert run.t_events is None
    assert run.y_events is None
    assert fp.simulate(COULOMB, [3, 0], (0, 5), events=[]).t_events == ()


def test_an_event_function_that_never_fires_has_an_empty_array():
    run = fp.simulate(COULOMB, [3, 0], (0, 5), events=[lambda t, y: 1.0, lambda t, y: t - 1])
    assert run.t_events[0].shape == (0,)
    assert run.y_events[0].shape == (0, 2)
    assert run.t_events[1] == pytest.approx([1], abs=1e-15)


@pytest.mark.parametrize(("direction", "first"), [(0, 1), (1, 3), (-1, 1), (2.5, 3)])
def test_direction_is_the_sign_of_the_slope(direction, first):
    g = watch(lambda t, y: np.cos(t), direction=direction, terminal=True)
    run = fp.simulate(COULOMB, [3, 0], (0, 10), events=g)
    assert run.status == "event"
    assert run.success
    assert run.t[-1] == pytest.approx(first * np.pi / 2, abs=1e-12)
    assert run.t[-1] == run.t_events[0][-1] == run.events["t"][-1]


def test_direction_is_along_the_run():
    g = watch(lambda t, y: np.cos(t), direction=-1)
    run = fp.simulate(COULOMB, [-0.2, 0], (6, 0), on_nonunique="stay", events=g)
    # cos falls towards smaller t at 3 pi / 2
    assert run.t_events[0] == pytest.approx([1.5 * np.pi], abs=1e-12)


@pytest.mark.parametrize("count", [1, 2, 3])
def test_terminal_may_count(count):
    g = watch(lambda t, y: np.sin(10 * t + 1), terminal=count)
    run = fp.simulate(COULOMB, [3, 0], (0, 10), events=g)
    assert run.t_events[0].size == count
    assert run.status == "event"


def test_a_function_of_three_arguments_gets_the_parameters():
    seen = []

    def g(t, y, p):
        seen.append(p)
        return t - p.mu - p["mu"]

    run = fp.simulate(COULOMB, [3, 0], (0, 5), params={"mu": 0.75}, events=g)
    assert run.t_events[0] == pytest.approx([1.5], abs=1e-14)
    assert all(p is run.params for p in seen)


def test_a_default_argument_is_not_the_parameters():
    run = fp.simulate(COULOMB, [3, 0], (0, 5), events=lambda t, y, level=2.0: t - level)
    assert run.t_events[0] == pytest.approx([2], abs=1e-14)


def test_an_event_function_may_be_an_object_and_keep_its_states():
    class Kept:
        def __init__(self):
            self.states = []

        def __call__(self, t, y):
            self.states.append(y)
            return t - 1

    g = Kept()
    fp.simulate(COULOMB, [3, 0], (0, 2), events=g)
    assert len({id(y) for y in g.states}) == len(g.states)
    assert g.states[0].tolist() == [3, 0]


def test_an_exception_in_an_event_function_passes_through():
    class Mine(Exception):
        pass

    def g(t, y):
        if t > 1:
            raise Mine("here")
        return 1.0

    with pytest.raises(Mine, match="here"):
        fp.simulate(COULOMB, [3, 0], (0, 5), events=g)


@pytest.mark.parametrize(
    ("value", "error"),
    [(np.nan, ValueError), (np.inf, ValueError), ("a", TypeError), (None, TypeError)],
)
def test_what_an_event_function_must_not_return(value, error):
    with pytest.raises(error, match=r"events\[1\] returned"):
        fp.simulate(COULOMB, [3, 0], (0, 5), events=[lambda t, y: 1.0, lambda t, y: value])


class TestH28:
    """An event at the start, at the end, or at an output time is there exactly once."""

    def test_section_at_the_start(self):
        run = fp.simulate(COULOMB, [3, 0], (0, 5), events=lambda t, y: t)
        assert run.t_events[0].tolist() == [0]

    def test_section_at_the_end(self):
        run = fp.simulate(COULOMB, [3, 0], (0, 5), events=lambda t, y: t - 5)
        assert run.t_events[0] == pytest.approx([5], abs=1e-14)
        assert run.t[-1] == 5

    def test_surface_met_at_the_end(self):
        run = fp.simulate(fp.models.quartet, [-1], (0, 1), params={"b": 1})
        met = run.events[run.events["kind"] == "enter_sliding"]
        # met within rounding of the end, once: the slide after it may last one last digit
        assert met["t"] == pytest.approx([1], abs=1e-15)
        assert run.t[-1] == 1

    def test_start_on_the_surface_is_no_event_of_its_own(self):
        run = fp.simulate(COULOMB, [3, 0], (0, 1))
        assert list(run.events["kind"]) == ["start", "end"]
        assert run.events["surface"][0] == 0

    @pytest.mark.parametrize("dense", [False, True])
    def test_event_at_an_output_time(self, dense):
        system, params = fp.models.quartet, {"b": 1}
        free = fp.simulate(system, [-1], (0, 2), params=params)
        (met,) = free.events[free.events["kind"] == "enter_sliding"]
        run = fp.simulate(
            system, [-1], (0, 2), params=params, t_eval=[0, met["t"], 2], dense_output=dense
        )
        assert (run.events["kind"] == "enter_sliding").sum() == 1
        assert run.t.tolist() == [0, met["t"], 2]
        assert run.y[0, 1] == met["x_left"][0] == met["x_right"][0]
        assert abs(run.y[0, 1]) < 1e-15
        assert run.mode.tolist() == [-1, -1, 0]  # the value from before the event
