# SPDX-License-Identifier: BSD-3-Clause
"""What pip installs serves C++ projects too, and leaves the process as it was."""

import importlib.metadata
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import filippov as fp

CONSUMER = Path(__file__).parents[2] / "tests" / "consumer"


def test_a_cmake_project_uses_what_pip_installed(tmp_path):
    cmake = shutil.which("cmake") or pytest.skip("no cmake")
    if not CONSUMER.is_dir():
        pytest.skip("the consumer's project is in the repository only")
    run = [cmake, "-G", "Ninja", "-S", str(CONSUMER), "-B", str(tmp_path)]
    run += ["-DCONSUMER_WAY=package"]
    run += [f"-Dfilippov_DIR={fp.get_cmake_dir()}", f"-DCONSUMER_VERSION={fp.__version__}"]
    subprocess.run(run, check=True, timeout=300, capture_output=True)
    subprocess.run([cmake, "--build", str(tmp_path)], check=True, timeout=600, capture_output=True)
    told = subprocess.run([tmp_path / "consumer"], check=True, capture_output=True, text=True)
    assert told.stdout == f"filippov {fp.__version__}\n"


def test_scripts_set_up_what_building_needs():
    root = Path(__file__).parents[2]
    setup = root / "scripts/setup.sh"
    if not setup.is_file():
        pytest.skip("scripts are in the repository only")
    (declared,) = re.findall(r"^requires = \[(.*)\]$", (root / "pyproject.toml").read_text(), re.M)
    needed = [word.strip() for word in declared.split(",")]
    assert needed
    assert all(word in setup.read_text() for word in needed)


def test_build_backends_find_the_cmake_files():
    origin = importlib.metadata.distribution("filippov").read_text("direct_url.json") or ""
    if '"editable": true' in origin:
        pytest.skip("an editable install is in two places")
    (entry,) = importlib.metadata.entry_points(group="cmake.prefix", name="filippov")
    prefix = Path(entry.load().__file__).parent
    assert Path(fp.get_cmake_dir()).is_relative_to(prefix)


STATE = """
import ctypes, ctypes.util, sys
libm = ctypes.CDLL(ctypes.util.find_library("m"))

def state():  # control words of x87 and SSE, without the flags of past exceptions
    words = (ctypes.c_uint32 * 16)()
    assert libm.fegetenv(words) == 0
    return words[0] & 0xffff, words[7] & ~0x3f if sys.platform == "linux" else 0

def subnormal():
    tiny = 5e-324
    return tiny * 1.0 == tiny and tiny / 2 == 0.0 and 2.2250738585072014e-308 / 4 > 0.0

before = state()
import numpy as np
import filippov as fp
for name in fp.__all__:
    getattr(fp, name)
assert state() == before, "importing"
fp.ensemble(fp.models.oscillator, np.zeros((2, 64)), (0, 3), threads=2)
fp.simulate(fp.models.oscillator, [0, 0], (0, 3))
fp.basins(fp.models.oscillator, {"y": (-3, 3, 8), "v": (-1.1, 3, 8)}, threads=2)
assert state() == before, "running"
assert subnormal()
with np.errstate(all="raise", under="ignore"):
    assert np.float64(5e-324) * np.float64(1.0) > 0
"""


@pytest.mark.skipif(sys.platform != "linux", reason="reads the words that glibc keeps")
def test_floating_point_is_left_as_it_was():
    subprocess.run([sys.executable, "-c", STATE], check=True, timeout=120)


def test_the_compiled_modules_stand_alone():
    ldd = shutil.which("ldd") or pytest.skip("no ldd")
    allowed = ("linux-vdso", "libstdc++", "libm", "libgcc_s", "libc", "libgomp", "libpthread")
    allowed += ("ld-linux", "libdl", "librt")
    modules = list(Path(fp._core.__file__).parent.glob("*.so"))
    assert modules
    for module in modules:
        told = subprocess.run([ldd, module], check=True, capture_output=True, text=True).stdout
        names = [Path(line.split()[0]).name for line in told.splitlines() if line.strip()]
        # what was asked for when the package was built, and is in no wheel
        asked = ("libgsl",) if module.name.startswith("_gsl") else ()
        assert all(name.startswith(allowed + asked) for name in names), (module.name, names)
