# SPDX-License-Identifier: BSD-3-Clause
import numpy as np
import pytest

import filippov as fp
from filippov._runs.gsl_run import has_gsl

block = fp.models.oscillator.with_params(A=0.5, omega=2.94)
smooth = fp.smoothed(block, c1=1e3)

with_gsl = pytest.mark.skipif(not has_gsl(), reason="this package was built without GSL")


@with_gsl
@pytest.mark.parametrize("method", ["msbdf", "bsimp", "rk4imp"])
def test_it_agrees_with_rodas5p(method):
    theirs = fp.gsl_run(smooth, [0, 0], (0, 20), method=method, rtol=1e-9, atol=1e-9)
    ours = fp.simulate(smooth, [0, 0], (0, 20), method="rodas5p", rtol=1e-10, atol=1e-10)
    assert theirs.success
    assert theirs.t == 20
    # backward differences control the local error only: thousands of steps add up
    np.testing.assert_allclose(theirs.y, ours.y[:, -1], atol=1e-4)
    assert theirs.njev > 0
    assert "ok" in repr(theirs)


@with_gsl
def test_a_band_changes_nothing():
    banded = fp.smoothed(block, c1=1e3, band=1e-2)
    a, b = (fp.gsl_run(sys, [0, 0], (0, 20), rtol=1e-9, atol=1e-9) for sys in (smooth, banded))
    np.testing.assert_allclose(a.y, b.y, atol=1e-12)


@with_gsl
def test_parameters_and_failure():
    run = fp.gsl_run(smooth, [0, 0], (0, 20), method="rk8pd", max_steps=100, params={"c1": 1e8})
    assert run.status == "max_steps"
    assert 0 < run.t < 20
    assert "GSL says" in run.message


@with_gsl
def test_what_makes_no_sense_is_refused():
    with pytest.raises(ValueError, match=r"expected what filippov\.smoothed gives"):
        fp.gsl_run(block, [0, 0], (0, 20))
    with pytest.raises(TypeError, match="expected a System"):
        fp.gsl_run("block", [0, 0], (0, 20))
    with pytest.raises(ValueError, match="method"):
        fp.gsl_run(smooth, [0, 0], (0, 20), method="rk45")
    with pytest.raises(ValueError, match="rtol"):
        fp.gsl_run(smooth, [0, 0], (0, 20), rtol=0)
    with pytest.raises(ValueError, match="x0"):
        fp.gsl_run(smooth, [np.nan, 0], (0, 20))


def test_without_it_the_reason_is_given(monkeypatch):
    monkeypatch.setattr("filippov._runs.gsl_run._module", lambda: None)
    with pytest.raises(ImportError, match="FILIPPOV_GSL=ON"):
        fp.gsl_run(smooth, [0, 0], (0, 20))
