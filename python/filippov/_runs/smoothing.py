# SPDX-License-Identifier: BSD-3-Clause
"""Smoothing: the rival method, as a system of its own."""

from __future__ import annotations

from dataclasses import replace

from filippov._support.check import number, refuse, word
from filippov._system.define import LAWS
from filippov._system.system import System, require_no_directions, switches_of

__all__ = ["smoothed"]

_POSITIVE = "expected a number > 0"


def smoothed(
    sys: System, *, c1: float = 1e8, law: str = "arctan", band: float | None = None
) -> System:
    """Replace every switch `sign(h)` by a smooth `s(c1 h)`.

    The system has no surface, and a layer of width `1/c1` where the switched one slides. It is
    stiff, and needs `method="rodas5p"` in `simulate` and `bifurcation_diagram`, whose steps are
    kept small enough to see the layer. (Explicit methods, which ensembles and maps have, take a
    step for every width of the layer: that goes up to a c1 of some thousand.) The solution is off
    by about `c1**(-2/3)` with the arctan, whose slides end late, and by about `1/c1` with the other
    laws.

    Parameters
    ----------
    sys : System
        A system of formulas. In `|u|` the magnitude stays as it is. Where the sides were given one
        by one they are blended, and have to exist on both sides.
    c1 : float
        Steepness, in 1/units of h, > 0; a parameter of the result, by this name.
    law : {"arctan", "tanh", "saturation"}
        `s(u)`: `2/pi arctan(u)` of (4.30), `tanh(u)`, or u between -1 and 1.
    band : float, optional
        Half width of the layer `|h| < band` that counts as sticking, in units of h, > 0; a
        parameter of the result, by this name. Each function `h` that is switched on then has two
        surfaces, the ends of its band, `-h - band` and `h - band`, in the order in which the
        switches are named and written (`repr` lists them): a "cross" to side +1 leaves the band, to
        -1 enters it. The law "saturation" has corners at `1/c1`, which are its band. (There are 8
        surfaces at most; a switch inside another's argument counts for every side of it.)

    Returns
    -------
    System
        With the current parameter values of `sys`, and "c1" and "band".

    Raises
    ------
    TypeError
        For a system without formulas, or whose functions are not recorded.
    ValueError
        For a steepness or a band that makes no sense.
    DefinitionError
        If nothing switches.

    Notes
    -----
    Chapter, (4.30) and section 4.5.

    Examples
    --------
    >>> import filippov as fp
    >>> smooth = fp.smoothed(fp.models.oscillator, c1=1e8)
    >>> run = fp.simulate(smooth, [0, 0], (0, 20), method="rodas5p", rtol=1e-9)
    >>> exact = fp.simulate(fp.models.oscillator, [0, 0], (0, 20), rtol=1e-10)
    >>> bool(1e-6 < abs(run.y[:, -1] - exact.y[:, -1]).max() < 1e-3)
    True
    """
    if not isinstance(sys, System):
        refuse("sys", sys, "expected a System, for instance filippov.models.oscillator", TypeError)
    c1 = number("c1", c1, _POSITIVE, above=0.0)
    law = word("law", law, LAWS)
    require_no_directions(sys, "laws for switches say nothing")
    definition = sys._formulas()
    definition.require_formulas("be smoothed")
    if definition.smoothing is not None:
        refuse("sys", sys.name, "expected a system that is not smoothed yet")
    if definition.jumps:
        refuse("sys", sys.name, "expected a system whose state does not jump")
    added = {"c1": c1}
    if band is not None:
        if law == "saturation":
            refuse("band", band, "expected none with the law 'saturation', whose band is 1/c1")
        added["band"] = number("band", band, _POSITIVE, above=0.0)
    for name in set(added) & set(sys.params) | set(added) & set(sys.state):
        refuse("sys", sys.name, f"expected a system without a name {name!r} of its own")
    smooth = replace(
        definition,
        name=f"{sys.name}_smoothed",
        params=dict(sys.params) | added,
        smoothing=(law, band is not None),
        built_in=False,
    )
    model, made = smooth.made()
    return System._of(model, switches_of(made), None, made)
