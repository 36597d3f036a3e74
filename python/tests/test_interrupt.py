# SPDX-License-Identifier: BSD-3-Clause
"""Ctrl-C stops the compiled loop, threads go on beside it."""

import signal
import subprocess
import sys
import threading
import time

import pytest

import filippov as fp

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="sends POSIX signals")

SOON = 3.0  # seconds; idle machines take a hundredth of one

PROGRAM = """
print("ready", flush=True)
try:
    fp.simulate(fp.models.{model}, {x0}, (0, 1e9), t_eval=[0.0], dense_output=False,
                max_steps=10**15, max_events=10**12 // 10**6, method="{method}", events={events})
except KeyboardInterrupt as stop:
    run = stop.trajectory
    assert run.status == "interrupted", run.status
    assert run.t[-1] > 0 and run.events["t"][-1] == run.t[-1]
    sys.exit(7)
"""


@pytest.mark.parametrize(
    ("model", "x0", "method", "events"),
    [
        ("varying_belt", [3, 0], "dopri5", None),
        ("varying_belt", [3, 0], "dop853", None),
        ("stiction", [0, 0], "dopri5", None),  # rests for ever, in closed form
    ],
)
def test_ctrl_c_stops_at_once_and_keeps_the_run(ctrl_c, model, x0, method, events):
    if model == "stiction":
        model += ".with_params(V=0, A=0.1)"
    ctrl_c(PROGRAM.format(model=model, x0=x0, method=method, events=events))


def test_ctrl_c_in_an_event_function_keeps_the_run(ctrl_c):
    ctrl_c("""
print("ready", flush=True)
try:
    fp.simulate(fp.models.varying_belt, [3, 0], (0, 1e9), t_eval=[0.0], dense_output=False,
                max_steps=10**15, events=lambda t, y: 1.0)
except KeyboardInterrupt as stop:
    run = stop.trajectory
    assert run.status == "interrupted", run.status
    assert run.t[-1] > 0 and run.events["t"][-1] == run.t[-1]
    sys.exit(7)
""")


def test_what_a_function_raises_on_its_own_comes_out_as_it_is():
    def stops(t, y):
        if t > 1:
            raise KeyboardInterrupt("of its own")
        return 1.0

    # Ctrl-C is what a function that raises it stands for
    previous = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt) as caught:
            fp.simulate(fp.models.varying_belt, [3, 0], (0, 1e3), events=stops)
        assert caught.value.trajectory.status == "interrupted"
        # but where nobody listens to it, it is an exception like others
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        with pytest.raises(KeyboardInterrupt, match="of its own"):
            fp.simulate(fp.models.varying_belt, [3, 0], (0, 1e3), events=stops)
    finally:
        signal.signal(signal.SIGINT, previous)

    def fails(t, y):
        raise ZeroDivisionError("of its own")

    with pytest.raises(ZeroDivisionError, match="of its own"):
        fp.simulate(fp.models.varying_belt, [3, 0], (0, 1e3), events=fails)


def test_whatever_a_signal_handler_raises_comes_out():
    class Alarm(Exception):
        pass

    def handler(signum, frame):
        raise Alarm

    previous = signal.signal(signal.SIGALRM, handler)
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.2)
        begun = time.perf_counter()
        with pytest.raises(Alarm) as caught:
            fp.simulate(
                fp.models.varying_belt, [3, 0], (0, 1e9), t_eval=[0.0], dense_output=False,
                max_steps=10**15,
            )  # fmt: skip
        assert time.perf_counter() - begun < 0.2 + SOON
        assert caught.value.trajectory.status == "interrupted"
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, previous)


def test_other_threads_run_meanwhile():
    done = threading.Event()

    def work():
        fp.simulate(
            fp.models.varying_belt, [3, 0], (0, 1e9), t_eval=[0.0], dense_output=False,
            max_steps=1_000_000,
        )  # fmt: skip
        done.set()

    thread = threading.Thread(target=work)
    thread.start()
    ticks = 0
    while not done.wait(0.002):
        ticks += 1
    thread.join()
    # a million steps take a tenth of a second at least; holding the lock would allow a tick or two
    assert ticks > 10


def test_threads_get_the_same_answer():
    results = {}

    def work(k):
        results[k] = fp.simulate(fp.models.oscillator, [0, 0], (0, 200)).y[:, -1].tolist()

    threads = [threading.Thread(target=work, args=(k,)) for k in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len({tuple(y) for y in results.values()}) == 1


OWN = """
import numpy as np

@fp.system(state="y v", params={"A": 3.6, "omega": 1.067}, period=lambda p: 2 * np.pi / p.omega)
def block(t, s, p):
    u = 1 - s.v
    mu = 0.3 / (1 + 1.42 * abs(u)) + 0.1 + 0.01 * u**2
    return s.v, -s.y + p.A * np.cos(p.omega * t) + 10 * mu * np.sign(u)

"""
KEPT = """
print("ready", flush=True)
try:
    {call}
except KeyboardInterrupt as stop:
    assert {kept}, stop.args
    sys.exit(7)
"""
GRID = "{'y': (-4, 4, 1000), 'v': (-3, 4, 999)}"
LONG = {
    "simulate": (
        "fp.simulate(block, [0, 0], (0, 1e9), t_eval=[0.0], dense_output=False, max_steps=10**15,"
        " max_events=10**9)",
        "stop.trajectory.t[-1] > 0",
    ),
    "ensemble": (
        "fp.ensemble(block, np.zeros((2, 4000)), (0, 1e5))",
        "(stop.ensemble.status == 'interrupted').any()",
    ),
    "cell_map": (f"fp.cell_map(block, {GRID})", "stop.cell_map.unresolved_basin > 0"),
    "basins": (f"fp.basins(block, {GRID})", "(stop.basins.label == 0).any()"),
    "lyapunov": (
        "fp.lyapunov(block, transient=0, window=1e8)",
        "stop.lyapunov.status == 'interrupted'",
    ),
    "bifurcation_diagram": (
        "fp.bifurcation_diagram(block, A=np.linspace(3, 5, 10**4), keep=10**4, skip_repeats=False)",
        "not stop.diagram.success",
    ),
}


@pytest.mark.parametrize("call", LONG)
def test_ctrl_c_stops_a_system_of_ones_own(ctrl_c, call):
    line, kept = LONG[call]
    ctrl_c(OWN + KEPT.format(call=line, kept=kept), pause=0.5)


@pytest.mark.parametrize("call", ["simulate", "ensemble", "lyapunov", "bifurcation_diagram"])
def test_ctrl_c_stops_python_functions(ctrl_c, call):
    side = "lambda t, s, p: (s.v, -s.y + p.A * np.cos(t) {sign} 0.4)"
    fields = ", ".join(
        f"{key!r}: {side.format(sign=sign)}" for key, sign in zip("-+", "+-", strict=True)
    )
    slow = (
        "import warnings; warnings.simplefilter('ignore'); import numpy as np\n"
        f"block = fp.System.from_callables('y v', {{'A': 1.0}}, fields={{{fields}}},"
        " switch='v', period=2 * np.pi)\n"
    )
    line, kept = LONG[call]
    ctrl_c(slow + KEPT.format(call=line, kept=kept), pause=0.5)


def test_ctrl_c_stops_the_command_line(tmp_path):
    with subprocess.Popen(
        [sys.executable, "-c", LISTEN_CLI, "diagram", "oscillator", "--over", "omega=2:3:100000"],
        cwd=tmp_path,
        stderr=subprocess.PIPE,
        text=True,
    ) as child:
        time.sleep(2.5)
        assert child.poll() is None, child.stderr.read()
        sent = time.perf_counter()
        child.send_signal(signal.SIGINT)
        assert child.wait(timeout=10) != 0
        assert time.perf_counter() - sent < SOON
        assert "Traceback" not in child.stderr.read()


# A shell starts what runs in its background with Ctrl-C ignored, and children inherit that.
LISTEN_CLI = """
import signal
import subprocess
signal.signal(signal.SIGINT, signal.default_int_handler)
from filippov._cli import main
raise SystemExit(main())
"""
