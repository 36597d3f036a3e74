# SPDX-License-Identifier: BSD-3-Clause
"""The C++ that a system writes: it compiles against the headers and runs the same."""

import shutil
import subprocess

import numpy as np
import pytest

import filippov as fp

EIGEN = "/usr/include/eigen3"
MAIN = """
#include "own.hpp"
#include <filippov/filippov.hpp>
#include <cstdio>

static_assert(filippov::FilippovSystem<block> && filippov::HasPeriod<block, double>);
static_assert(filippov::FilippovSystem<pair> && filippov::FilippovSystem<ball>);

template <class Sys> void run(filippov::Vec<double, Sys::dim> x0, double t_end) {
    filippov::Settings<double, Sys::dim> settings;
    settings.rtol = 1e-10;
    settings.atol = filippov::AbsoluteTolerance<double, Sys::dim>(1e-10);
    const auto p = filippov::default_params<Sys>();
    const auto run =
        filippov::simulate<filippov::DormandPrince8>(Sys{}, p, x0, 0.0, t_end, settings);
    std::printf("%zu", run.events.size());
    for (const double v : run.result.x)
        std::printf(" %.17g", v);
    std::printf("\\n");
}
int main() {
    run<block>({1, 3}, 20);
    run<pair>({-2, 3, 0, 0}, 9);
    run<ball>({10, 0}, 20);
}
"""


@fp.system(state="x v", params={"A": 0.2, "omega": 1.067}, period=lambda p: 2 * np.pi / p.omega)
def block(t, s, p):
    u = 1 - s.v
    mu = 0.3 / (1 + 1.42 * abs(u)) + 0.1 + 0.01 * u**2
    return s.v, -s.x - 0.2 * s.v + p.A * np.cos(p.omega * t) + 10 * mu * np.sign(u)


@fp.system(state="x1 x2 v1 v2", params={"e": 0.4})
def pair(t, s, p):
    f1 = np.where(s.x1 > 0, 1, 0.6)
    f2 = np.where(s.x2 > 0, 0.2, 0.5) * np.sign(p.e)
    pull = s.x1 - s.x2 + np.exp(-(s.x1**2)) * s.x1**3
    return s.v1, s.v2, -pull - f1 * np.sign(s.v1), pull - f2 * np.sign(s.v2)


@fp.system(state="x v", params={"e": 0.9}, jumps={"g": ("x", lambda t, s, p: (s.x, -p.e * s.v))})
def ball(t, s, p):
    return s.v, -9.8 - 0.01 * abs(s.v) ** 1.5


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("g++") is None, reason="no g++")
def test_the_struct_runs_as_the_system_does(tmp_path):
    own = "".join(system.to_cpp() for system in (block, pair, ball))
    (tmp_path / "own.hpp").write_text(own)
    (tmp_path / "main.cpp").write_text(MAIN)
    command = ["g++", "-std=c++20", "-O1", "-DFILIPPOV_NO_FORCED_INLINING", "-ffp-contract=off"]
    command += ["-Wall", "-Wextra", "-Werror", f"-I{fp.get_include()}", "-isystem", EIGEN]
    subprocess.run([*command, "main.cpp", "-o", "main"], cwd=tmp_path, check=True, timeout=300)
    ran = subprocess.run(["./main"], cwd=tmp_path, check=True, capture_output=True, text=True)
    starts = [([1, 3], 20), ([-2, 3, 0, 0], 9), ([10, 0], 20)]
    for system, (x0, t_end), line in zip(
        (block, pair, ball), starts, ran.stdout.splitlines(), strict=True
    ):
        mine = fp.simulate(system, x0, (0, t_end), method="dop853", rtol=1e-10, atol=1e-10)
        n, *x = line.split()
        assert int(n) == mine.events.size
        # the struct takes steps along slides that are known here in closed form
        assert np.array([float(v) for v in x]) == pytest.approx(mine.y[:, -1], abs=1e-8)


def test_a_system_without_a_surface_has_no_struct():
    smooth = fp.system("x v", name="smooth")(lambda t, s, p: (s.v, -s.x))
    with pytest.raises(ValueError, match="sys = 'smooth': expected a system with a surface"):
        smooth.to_cpp()


def test_a_name_of_the_struct():
    assert "struct Mine {" in block.to_cpp("Mine")
    with pytest.raises(ValueError, match="a name"):
        block.to_cpp("not a name")
