# SPDX-License-Identifier: BSD-3-Clause
"""Reference values for systems with several surfaces and with impacts.

    python several_surfaces.py                   write the C++ header to stdout
    python several_surfaces.py FILE              write it to a file
    python several_surfaces.py --check FILE      compare it with a file; exit status 1 if it differs

Every problem is solved at two precisions, which must agree to 1e-30; 20 digits are written. Decimal
parameters are exact decimals, not the doubles next to them. Needs mpmath. Takes half a minute.
"""

from __future__ import annotations

import sys
from itertools import zip_longest
from pathlib import Path

from mpmath import mp, mpf
from piecewise_taylor import Mode, Problem, Series, Solution, solve_twice

SLOTS = 6  # states in a row of a table


class TwoBlocks(Problem):
    """Blocks on a rough ground, joined by a spring; friction depends on the place.

    Surfaces: v1, v2, and x1, x2, where coefficients switch. The equivalent control of a block at
    rest is the spring's force over the friction coefficient.
    """

    start = ("-2", "0", "3", "0")
    end = "20"
    longest_step = "0.5"

    def coefficients(self, mode: Mode) -> tuple[mpf, mpf]:
        return mpf("1" if mode[2] > 0 else "0.6"), mpf("0.2" if mode[3] > 0 else "0.5")

    def surfaces(self, x: list[Series]) -> list[Series]:
        return [x[1], x[3], x[0], x[2]]

    def may_slide(self, j: int, mode: Mode) -> bool:
        return j < 2

    def equivalent_control(self, j: int, x: list[Series], mode: Mode) -> Series | mpf:
        pull = x[2] - x[0] if j == 0 else x[0] - x[2]
        return pull / self.coefficients(mode)[j] if j < 2 else mpf(0)

    def field(self, x: list[Series], s: list[Series], mode: Mode) -> list[Series | mpf | int]:
        first, second = self.coefficients(mode)
        return [
            x[1] if mode[0] else 0,
            x[2] - x[0] - first * s[0],
            x[3] if mode[1] else 0,
            x[0] - x[2] - second * s[1],
        ]


class DieciLopez(Problem):
    """Two surfaces x2 = 0.2 and x3 = 0.4, with a term of x1' where both are passed.

    On x2 = 0.2, x2' = -x1 - s1, so that s1 = -x1; likewise s2 = -x1 on x3 = 0.4. The extra term has
    the weight (1 + s1)(1 + s2)/4.
    """

    start = ("0.04", "-0.01", "-0.02")
    end = "40"

    def surfaces(self, x: list[Series]) -> list[Series]:
        return [x[1] - mpf("0.2"), x[2] - mpf("0.4")]

    def equivalent_control(self, j: int, x: list[Series], mode: Mode) -> Series | mpf:
        return -x[0]

    def weight(self, x: list[Series], s: list[Series], mode: Mode) -> Series | int:
        return 0 if -1 in mode else (1 + s[0]) * (1 + s[1]) / 4

    def field(self, x: list[Series], s: list[Series], mode: Mode) -> list[Series | mpf | int]:
        extra = x[0] * (x[1] + mpf("0.8")) * (x[2] + mpf("0.6")) * self.weight(x, s, mode)
        second = (-x[0] + 1 / (mpf("1.2") - x[1]), 0, -x[0] - 1 / (mpf("0.8") + x[1]))
        third = (-x[0] + 1 / (mpf("1.4") - x[2]), 0, -x[0] - 1 / (mpf("0.6") + x[2]))
        return [(x[1] + x[2]) / 2 + extra, second[mode[0] + 1], third[mode[1] + 1]]


class DieciLopezMoments(DieciLopez):
    """The same with the moments selection where both surfaces are met.

    There the weights of the four regions have sum 1, s1 = s2 = -u with u = x1, and the fourth
    condition sum sigma1 sigma2 |w| weight = 0, w = (h1', h2') of the region. Over sqrt(2), |w| is
    1 + u for (+, +), 1 - u for (-, -) and r = sqrt(1 + u^2) for the others, so that the weight of
    (+, +) is (1 - u)(r - u)/(2 (1 + r)).
    """

    def weight(self, x: list[Series], s: list[Series], mode: Mode) -> Series | int:
        if mode != (0, 0):
            return super().weight(x, s, mode)
        u = x[0]
        r = (1 + u * u).sqrt()
        return (1 - u) * (r - u) / (2 * (1 + r))


class BeltChain(Problem):
    """Blocks on a belt of speed 0.1, each with a spring to the ground and to its neighbours.

    The equivalent control of a block at rest on the belt is the springs' force over F.
    """

    end = "20"

    def __init__(self, friction: tuple[str, ...], start: tuple[str, ...]) -> None:
        self.friction = friction
        self.start = start

    def pull(self, i: int, x: list[Series]) -> Series:
        """The springs' force on block i."""
        coupling = mpf("1.2")
        force = -x[2 * i]
        if i > 0:
            force = force - coupling * (x[2 * i] - x[2 * i - 2])
        if i + 1 < len(self.friction):
            force = force - coupling * (x[2 * i] - x[2 * i + 2])
        return force

    def surfaces(self, x: list[Series]) -> list[Series]:
        return [speed - mpf("0.1") for speed in x[1::2]]

    def equivalent_control(self, j: int, x: list[Series], mode: Mode) -> Series | mpf:
        return self.pull(j, x) / mpf(self.friction[j])

    def field(self, x: list[Series], s: list[Series], mode: Mode) -> list[Series | mpf | int]:
        rates: list[Series | mpf | int] = []
        for i, side in enumerate(mode):
            if side == 0:
                rates += [mpf("0.1"), 0]
                continue
            slip = x[2 * i + 1] - mpf("0.1")
            friction = side * mpf(self.friction[i]) / (1 + 3 * side * slip)
            rates += [x[2 * i + 1], self.pull(i, x) - friction]
        return rates


class GeneSwitch(Problem):
    """Two genes that inhibit each other above 4 and themselves above 8.

    Surfaces: a = 4, b = 4, a = 8, b = 8. One gene's level of 4 does not act on that gene, so it
    carries no slide alone; a and b never reach 4 together here. At 8 a slide needs production 20
    where the other gene is low, at the rate 16: (1 - s)/2 = 16/20.
    """

    end = "5"

    def __init__(self, start: tuple[str, ...]) -> None:
        self.start = start

    def surfaces(self, x: list[Series]) -> list[Series]:
        return [x[0] - 4, x[1] - 4, x[0] - 8, x[1] - 8]

    def may_slide(self, j: int, mode: Mode) -> bool:
        other = {2: 1, 3: 0}
        return j in other and mode[other[j]] == -1

    def equivalent_control(self, j: int, x: list[Series], mode: Mode) -> Series | mpf:
        return 1 - 2 * mpf(16) / 20

    def field(self, x: list[Series], s: list[Series], mode: Mode) -> list[Series | mpf | int]:
        a_low, b_low, a_high, b_high = ((1 - side) / 2 for side in s)
        return [20 * a_high * b_low - 2 * x[0], 20 * a_low * b_high - 2 * x[1]]


class ImpactBelt(Problem):
    """A block on a belt of speed 0.5 in front of a rigid wall at 1, under periodic force."""

    start = ("0", "0")
    end = "40"
    longest_step = "0.5"

    def force(self, x: list[Series]) -> Series:
        return mpf("0.6") * x[0].tape.cosine("1.2") - x[0]

    def surfaces(self, x: list[Series]) -> list[Series]:
        return [x[1] - mpf("0.5")]

    def equivalent_control(self, j: int, x: list[Series], mode: Mode) -> Series | mpf:
        return self.force(x) / mpf("0.2")

    def field(self, x: list[Series], s: list[Series], mode: Mode) -> list[Series | mpf | int]:
        if mode[0] == 0:
            return [mpf("0.5"), 0]
        return [x[1], self.force(x) - mpf("0.2") * mode[0]]

    def walls(self, x: list[Series]) -> list[Series]:
        return [1 - x[0]]

    def after_impact(self, wall: int, x: list[mpf]) -> list[mpf]:
        return [mpf(1), -mpf("0.8") * x[1]]


class PlanarRelay(Problem):
    """x1' = -x1 + x2, x2' = 3 x2 - 10 s; on x1 + x2 = 0, h' = 5 x2 - 10 s, so that s = x2/2."""

    start = ("-2.8", "2.4")
    end = "3"

    def surfaces(self, x: list[Series]) -> list[Series]:
        return [x[0] + x[1]]

    def equivalent_control(self, j: int, x: list[Series], mode: Mode) -> Series | mpf:
        return x[1] / 2

    def field(self, x: list[Series], s: list[Series], mode: Mode) -> list[Series | mpf | int]:
        return [x[1] - x[0], 3 * x[1] - 10 * s[0]]


# Name of the table, the model and its parameters, the problem.
PROBLEMS: list[tuple[str, str, Problem]] = [
    ("two_blocks", "TwoBlocks", TwoBlocks()),
    ("dieci_lopez", "DieciLopez2", DieciLopez()),
    ("dieci_lopez_moments", "DieciLopez2 with the moments selection", DieciLopezMoments()),
    (
        "belt_chain_2",
        "BeltChain<2>, F = (1, 1.3)",
        BeltChain(("1", "1.3"), ("0.5", "0", "-0.3", "0")),
    ),
    (
        "belt_chain_3",
        "BeltChain<3>, F = (1, 1.3, 0.9)",
        BeltChain(("1", "1.3", "0.9"), ("0.5", "0", "-0.3", "0", "0.2", "0")),
    ),
    ("gene_switch", "GeneSwitch", GeneSwitch(("1", "2"))),
    ("gene_switch_beside", "GeneSwitch", GeneSwitch(("3", "3.001"))),
    ("impact_belt", "ImpactBelt", ImpactBelt()),
    ("planar_relay", "PlanarRelay", PlanarRelay()),
]

HEAD = """\
// SPDX-License-Identifier: BSD-3-Clause
// Made by several_surfaces.py: do not edit.
#pragma once

#include <filippov/run/event.hpp>

#include <array>

// clang-format off
namespace reference {

/// An event strictly between start and end, and the state just after it.
struct Event {
    filippov::EventKind kind;
    int surface; ///< where several change, the lowest
    double t;
    std::array<double, 6> x; ///< 0 beyond the system's dimension
};
"""

TAIL = """
} // namespace reference
// clang-format on
"""


def number(value: mpf) -> str:
    """20 significant digits; what is below the agreement of two precisions is 0."""
    if abs(value) < mpf("1e-30"):
        return "0"
    return mp.nstr(value, 20, min_fixed=-8, max_fixed=30)


def table(name: str, model: str, problem: Problem, solution: Solution) -> str:
    """The C++ tables of one problem."""
    lines = [
        "",
        f"/// {model}, from ({', '.join(problem.start)}) to t = {problem.end}.",
        f"inline constexpr Event {name}[] = {{",
    ]
    for event in solution.events:
        head = f"filippov::EventKind::{event.kind}, {event.surface}, {number(event.t)}"
        state = [number(value) for value in event.x]
        state += ["0"] * (SLOTS - len(state))
        lines.append(f"    {{{head},")
        lines.append(f"     {{{', '.join(state[:3])},")
        lines.append(f"      {', '.join(state[3:])}}}}},")
    lines.append("};")
    lines.append(f"inline constexpr double {name}_end[] = {{")
    lines += [f"    {number(value)}," for value in solution.end]
    lines.append("};")
    return "\n".join(lines) + "\n"


def header() -> str:
    tables = [
        table(name, model, problem, solve_twice(problem)) for name, model, problem in PROBLEMS
    ]
    return HEAD + "".join(tables) + TAIL


def main(arguments: list[str]) -> int:
    check = arguments[:1] == ["--check"]
    files = arguments[1:] if check else arguments
    if len(files) > 1 or (check and not files) or any(file.startswith("-") for file in files):
        sys.stderr.write(__doc__ or "")
        return 2
    text = header()
    if check:
        present = Path(files[0]).read_text(encoding="utf-8")
        lines = zip_longest(present.splitlines(), text.splitlines(), fillvalue="(nothing)")
        for i, (old, new) in enumerate(lines, 1):
            if old != new:
                sys.stderr.write(f"{files[0]}:{i}: differs\n  there: {old}\n  here:  {new}\n")
                return 1
    elif files:
        Path(files[0]).write_text(text, encoding="utf-8")
    else:
        sys.stdout.write(text)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
