# SPDX-License-Identifier: BSD-3-Clause
import signal
import subprocess
import sys
import time

import pytest

SOON = 3.0  # seconds; idle machines take a tenth of one

# A shell starts what runs in its background with Ctrl-C ignored, and children inherit that.
LISTEN = """
import signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)
import filippov as fp
for name in fp.__all__:  # what is imported when it is first used
    getattr(fp, name)
"""


@pytest.fixture
def ctrl_c():
    """Run a program in a child, send Ctrl-C once it says "ready", expect exit status 7 soon."""
    if sys.platform == "win32":
        pytest.skip("sends POSIX signals")

    def stops(program, pause=0.3):
        with subprocess.Popen(
            [sys.executable, "-c", LISTEN + program],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        ) as child:
            assert child.stdout.readline() == "ready\n", child.stderr.read()
            time.sleep(pause)
            assert child.poll() is None, child.stderr.read()
            sent = time.perf_counter()
            child.send_signal(signal.SIGINT)
            assert child.wait(timeout=10) == 7, child.stderr.read()
            assert time.perf_counter() - sent < SOON

    return stops
