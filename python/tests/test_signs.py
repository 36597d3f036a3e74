# SPDX-License-Identifier: BSD-3-Clause
"""h has the sign of what was written, at random formulas: numpy evaluates them a second time."""

import numpy as np
import pytest

import filippov as fp
from filippov._system.trace import Numbers

#: Functions of which none is a multiple of another.
BASES = [
    lambda t, s, p: s.v - p.V,
    lambda t, s, p: s.x,
    lambda t, s, p: s.x + 0.5 * s.v - 1,
    lambda t, s, p: s.x * s.x + s.v - np.cos(t),
    lambda t, s, p: np.sin(s.v) - 0.3 * s.x,
]
#: What one may be multiplied with.
FACTORS = [
    lambda t, s, p: 1.0,
    lambda t, s, p: -1,
    lambda t, s, p: 3,
    lambda t, s, p: -2.5,
    lambda t, s, p: p.k,
    lambda t, s, p: -p.k,
    lambda t, s, p: -2 / p.k,
    lambda t, s, p: p.k**3 * (p.V - 7),
    lambda t, s, p: np.exp(-s.x),
    lambda t, s, p: -(2 + np.sin(5 * s.x)),
    lambda t, s, p: -(1 + s.v**2) * p.k,
    lambda t, s, p: np.cbrt(2 + np.sin(t)),
    lambda t, s, p: 1 / (-1 - abs(s.x * s.x)),
    lambda t, s, p: np.sqrt(1.5 + np.cos(s.v)) * (-0.1),
]
#: Switches of an argument u, and the number whose sign h has to have.
SWITCHES = [
    (lambda u: np.sign(u), 1),
    (lambda u: abs(u), 1),
    (lambda u: np.where(u > 0, 2.0, 0.5), 1),
    (lambda u: np.where(u >= 0, 2.0, 0.5), 1),
    (lambda u: np.where(u < 0, 2.0, 0.5), -1),
    (lambda u: np.where(np.less_equal(0, u), 2.0, 0.5), 1),
    (lambda u: np.where(~(u > 0), 2.0, 0.5), 1),
    (lambda u: np.maximum(u, 0), 1),
    (lambda u: np.minimum(u, 0), -1),
    (lambda u: np.maximum(0, u), -1),
    (lambda u: np.clip(u, 0, None), 1),
    (lambda u: np.heaviside(u, 0.5), 1),
    (lambda u: np.tanh(np.sign(u**3)), 1),
    (lambda u: np.sign(np.arctan(u)), 1),
    (lambda u: np.cbrt(u), 1),
]


def written(random):
    """Draw terms: a base, its factor and its switch; later ones may repeat a base."""
    bases = random.permutation(len(BASES))[: random.integers(1, 4)].tolist()
    again = random.choice(bases, random.integers(0, 4)).tolist()
    return [
        (base, int(random.integers(len(FACTORS))), int(random.integers(len(SWITCHES))))
        for base in (*bases, *again)
    ]


def system_of(terms):
    @fp.system(state="x v", params={"V": 0.7, "k": 1.5})
    def drawn(t, s, p):
        total = 0
        for k, (base, factor, switch) in enumerate(terms):
            u = FACTORS[factor](t, s, p) * BASES[base](t, s, p)
            total = total + (1 + 0.1 * k) * SWITCHES[switch][0](u)
        return s.v, total - s.x

    return drawn


@pytest.mark.parametrize("seed", range(60))
def test_h_has_the_sign_of_what_was_written_first(seed):
    random = np.random.default_rng(seed)
    terms = written(random)
    system = system_of(terms)
    first = list(dict.fromkeys(base for base, _, _ in terms))
    at = {base: next(term for term in terms if term[0] == base) for base in first}
    assert system.surfaces == len(first)
    for params in ({}, {"k": -0.8}, {"V": -1.2, "k": -2.0}):
        here = system.with_params(**params)
        for _ in range(8):
            t, x = 3 * random.random(), 2 * random.standard_normal(2)
            h = np.atleast_1d(here.h(t, x))
            for j, base in enumerate(first):
                _, factor, switch = at[base]
                names = Numbers(("x", "v"), x)
                u = FACTORS[factor](t, names, here.params) * BASES[base](t, names, here.params)
                assert np.sign(h[j]) == SWITCHES[switch][1] * np.sign(u), (seed, terms, params, j)


@pytest.mark.parametrize("seed", range(12))
def test_the_field_is_that_of_numpy_on_every_side_and_for_every_parameter(seed):
    random = np.random.default_rng(1000 + seed)
    terms = written(random)
    system = system_of(terms)
    for params in ({}, {"k": -0.8}, {"V": -1.2, "k": -2.0}):
        here = system.with_params(**params)
        t, x = 3 * random.random(), 2 * random.standard_normal(2)
        side = np.sign(np.atleast_1d(here.h(t, x))).astype(int).tolist()
        names = Numbers(("x", "v"), x)
        wanted = -x[0]
        for k, (base, factor, switch) in enumerate(terms):
            u = FACTORS[factor](t, names, here.params) * BASES[base](t, names, here.params)
            wanted += (1 + 0.1 * k) * SWITCHES[switch][0](u)
        assert here.field(t, x, side)[1] == pytest.approx(float(wanted), rel=1e-9)


def test_modes_words_and_directions_are_those_that_were_written():
    def friction(c):
        @fp.system(state="x v")
        def block(t, s, p):
            return s.v, -s.x - 0.4 * np.sign(c) * np.sign(c * s.v)

        return block

    plain = fp.simulate(friction(1), [3, 0.5], (0, 20))
    for c in (-1, -2, -0.1):
        run = fp.simulate(friction(c), [3, 0.5], (0, 20))
        assert run.events["t"] == pytest.approx(plain.events["t"], abs=1e-6)
        for name in ("mode_before", "mode_after"):
            assert (run.events[name] == -plain.events[name]).all()


def test_a_parameter_that_is_zero_leaves_no_switch():
    @fp.system(state="x v", params={"k": 1.0})
    def block(t, s, p):
        return s.v, -s.x - 0.4 * np.sign(-p.k * (s.v - 0.3)) - 0.2 * s.v

    off = block.with_params(k=0)
    run = fp.simulate(off, [1, 0], (0, 10), rtol=1e-10, atol=1e-10)
    w = np.sqrt(0.99)
    exact = np.exp(-1.0) * (np.cos(10 * w) + 0.1 / w * np.sin(10 * w))
    assert run.success
    assert run.y[0, -1] == pytest.approx(exact, abs=1e-8)


def test_a_factor_without_a_zero_is_no_surface():
    @fp.system(state="x v")
    def wavy(t, s, p):
        drive = np.cbrt(2 + np.sin(t))
        return s.v, drive - 3 * np.sign((2 + np.sin(5 * s.x)) * (s.v - 0.2))

    assert wavy.switches == ("v - 0.2",)
    assert wavy.kinds == ("switching",)
