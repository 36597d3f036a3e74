# SPDX-License-Identifier: BSD-3-Clause
"""Built-in models: their formulas are those of the headers, and they are known by their names."""

import itertools
import pickle
import shutil
import subprocess

import numpy as np
import pytest

import filippov as fp

IN_THE_HEADERS = {
    "oscillator": "Oscillator",
    "coulomb": "Coulomb",
    "stiction": "Stiction",
    "varying_belt": "VaryingBelt",
    "dieci_lopez": "DieciLopez",
    "dieci_lopez_2": "DieciLopez2",
    "dieci_lopez_2_moments": "DieciLopez2",  # which says nothing of slides
    "two_blocks": "TwoBlocks",
    "belt_chain_2": "BeltChain<2>",
    "belt_chain_3": "BeltChain<3>",
    "sign_plane": "SignPlane",
    "planar_relay": "PlanarRelay",
    "gene_switch": "GeneSwitch",
    "bouncing_ball": "BouncingBall",
    "thermostat": "Thermostat",
    "impact_belt": "ImpactBelt",
    "relay": "Relay",
    "stiff_relay": "StiffRelay",
    "unit_circle": "UnitCircle",
    "quartet": "Quartet",
}
MAIN = """
#include <filippov/filippov.hpp>
#include <filippov/models/blocks.hpp>
#include <filippov/models/impacts.hpp>
#include <filippov/models/switches.hpp>
#include <cstdio>
#include <iostream>
#include <string>

using namespace filippov;

template <class V> V read() {
    V values;
    for (double& v : values)
        std::cin >> v;
    return values;
}
void show(double v) { std::printf("%.17g ", v); }
// Names and defaults; then for each point: h, the fields on all sides, the states after jumps.
template <class Sys> void tell() {
    const Sys sys{};
    for (const auto& name : param_names(sys))
        std::printf("%s ", name.c_str());
    std::printf("\\n");
    for (const double v : default_values(sys))
        show(v);
    std::printf("\\n");
    constexpr int M = surfaces_v<Sys>;
    using X = Vec<double, dim_v<Sys>>;
    const auto p = read<Params<Sys, double>>();
    int points = 0;
    for (std::cin >> points; points > 0; --points) {
        double t = 0;
        std::cin >> t;
        const X x = read<X>();
        const auto h = switching(sys, t, x, p);
        for (int j = 0; j < M; ++j)
            show(h[j]);
        for (unsigned code = 0; code < 1U << M; ++code) {
            Mode<M> mode;
            for (int j = 0; j < M; ++j)
                mode.set(j, (code >> j & 1U) != 0 ? 1 : -1);
            for (const double v : mode_field(sys, mode, t, x, p))
                show(v);
        }
        if constexpr (has_jumps_v<Sys>)
            for (int j = 0; j < M; ++j)
                if (is_kind(sys, j, SurfaceKind::jump))
                    for (const double v : sys.jump(j, t, x, p))
                        show(v);
    }
    std::printf("\\n");
}
int main() {
"""


def points_of(system, seed=7):
    random = np.random.default_rng(seed)
    p = [value * random.uniform(0.8, 1.2) for value in system.params.values()]
    return p, [(random.uniform(0, 10), *random.standard_normal(system.dim)) for _ in range(20)]


def values_of(system, p, points):
    """What the C++ program tells of each point."""
    params = dict(zip(system.params, p, strict=True))
    for t, *x in points:
        yield from np.atleast_1d(system.h(t, x, params))
        for sides in itertools.product((-1, 1), repeat=system.surfaces):
            yield from system.field(t, x, sides[::-1], params)
        if "jump" in system.kinds:
            yield from after(system, t, x, params)


def after(system, t, x, params):
    """Return the state after a jump, which the system's C++ struct writes down."""
    yield from {
        "bouncing_ball": lambda: (x[0], -params["e"] * x[1]),
        "thermostat": lambda: (x[0], 1 - x[1]),
        "impact_belt": lambda: (x[0], -params["e"] * x[1]),
    }[system.name]()


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("g++") is None, reason="no g++")
def test_models_are_those_of_the_headers(tmp_path):
    assert sorted(IN_THE_HEADERS) == fp.models.__all__
    systems = [getattr(fp.models, name) for name in IN_THE_HEADERS]
    calls = "".join(f"    tell<models::{struct}>();\n" for struct in IN_THE_HEADERS.values())
    (tmp_path / "main.cpp").write_text(MAIN + calls + "}\n")
    command = ["g++", "-std=c++20", "-O0", "-DFILIPPOV_NO_FORCED_INLINING", "-ffp-contract=off"]
    command += [f"-I{fp.get_include()}", "-isystem", "/usr/include/eigen3"]
    subprocess.run([*command, "main.cpp", "-o", "main"], cwd=tmp_path, check=True, timeout=300)
    given = []
    for system in systems:
        p, points = points_of(system)
        given += [*p, len(points), *itertools.chain.from_iterable(points)]
    text = " ".join(repr(v if isinstance(v, int) else float(v)) for v in given)
    ran = subprocess.run(
        ["./main"], input=text, cwd=tmp_path, check=True, capture_output=True, text=True
    )
    lines = iter(ran.stdout.splitlines())
    for system in systems:
        assert next(lines).split() == list(system.params)
        assert [float(v) for v in next(lines).split()] == list(system.params.values())
        theirs = np.array([float(v) for v in next(lines).split()])
        mine = np.array(list(values_of(system, *points_of(system))))
        np.testing.assert_allclose(mine, theirs, rtol=1e-11, atol=1e-12, err_msg=system.name)


@pytest.mark.parametrize("name", ["bouncing_ball", "thermostat", "impact_belt"])
def test_jumps_of_models_are_those_that_are_run(name):
    system = getattr(fp.models, name)
    start = {"bouncing_ball": [1, 0], "thermostat": [20, 1], "impact_belt": [0.9, 1]}[name]
    jump = next(e for e in fp.simulate(system, start, (0, 20)).events if e["kind"] == "jump")
    expected = [*after(system, jump["t"], jump["x_left"], system.params)]
    assert jump["x_right"] == pytest.approx(expected, rel=1e-9, abs=1e-9)


def test_a_name_is_all_that_a_pickle_of_a_model_holds():
    relay = fp.models.relay.with_params(omega=8)
    packed = pickle.dumps(relay)
    assert len(packed) < 300
    assert pickle.loads(packed) == relay
    assert pickle.loads(packed)._model is fp.models.relay._model


def test_a_model_is_not_a_user_s_system_of_the_same_name():
    @fp.system(state="x v", params=dict(fp.models.coulomb.params), surfaces={"h": "v"})
    def coulomb(t, s, p):
        return s.v, -s.x + p.a * np.sin(p.omega * t) - 2 * p.mu * np.sign(s.v)

    assert coulomb != fp.models.coulomb
    assert pickle.loads(pickle.dumps(coulomb)) == coulomb


def test_a_smoothed_model_is_kept_with_its_formulas(tmp_path):
    smooth = fp.smoothed(fp.models.relay, c1=1e3)
    assert pickle.loads(pickle.dumps(smooth)) == smooth
    run = fp.simulate(smooth, [0.1, 0, 0], (0, 1), method="rodas5p")
    run.save(tmp_path / "run.npz")
    assert fp.load(tmp_path / "run.npz").system == smooth


@pytest.mark.parametrize("name", ["oscillator", "stiction", "impact_belt"])
def test_a_period_that_is_none_is_refused_by_name(name):
    system = getattr(fp.models, name)
    for omega in (-1.0, 0.0):
        with pytest.raises(ValueError, match=rf"params = .*expected a period > 0 of {name}, got"):
            fp.strobe_map(system, [0, 0], params={"omega": omega})
