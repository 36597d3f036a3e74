# SPDX-License-Identifier: BSD-3-Clause
"""Formulas in words: as Python would write them, in C++ and in LaTeX."""

from __future__ import annotations

import itertools
import re
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

from filippov import _core

if TYPE_CHECKING:
    from .definition import Definition

__all__ = [
    "Language",
    "clipped",
    "cpp",
    "cpp_struct",
    "entry_names",
    "latex",
    "latex_name",
    "python",
    "text",
    "write",
    "write_all",
]

_Node: TypeAlias = tuple[str, int, int, int, int, float]

# How tightly an operation binds.
_SUM, _PRODUCT, _SIGN, _POWER, _ATOM = 1, 2, 3, 4, 5


@dataclass(frozen=True)
class Language:
    """How a language writes what differs between languages."""

    constant: Callable[[float], str]
    name: Callable[[str], str]
    functions: dict[str, str]
    call: Callable[[str, str], str]
    product: str
    quotient: Callable[[str, str], str] | None  #: None: with a slash
    power: Callable[[str, str], str]
    where: Callable[[str, str, str], str]
    unit: Callable[[Sequence[str], int], str]  #: an entry of a vector over its length


def _number(value: float) -> str:
    return repr(int(value)) if value == int(value) and abs(value) < 1e15 else repr(value)


_PYTHON_NAMES = {"asin": "arcsin", "atan": "arctan", "magnitude": "abs"}
python = Language(
    constant=_number,
    name=str,
    functions=_PYTHON_NAMES,
    call=lambda f, x: f"{f}({x})",
    product="*",
    quotient=None,
    power=lambda a, b: f"{a}**{b}",
    where=lambda c, a, b: f"where({c} > 0.5, {a}, {b})",
    unit=lambda v, k: f"unit({', '.join(v)})[{k}]",
)
cpp = Language(
    constant=lambda value: f"S({value!r})",
    name=str,
    functions={"magnitude": "abs"},
    call=lambda f, x: f"{f}(S({x}))",
    product=" * ",
    quotient=None,
    power=lambda a, b: f"pow(S({a}), {b})",
    where=lambda c, a, b: f"select({c} > S(0.5), S({a}), S({b}))",
    unit=lambda v, k: f"({v[k]} / sqrt(S({' + '.join(f'{e} * {e}' for e in v)})))",
)
_GREEK = {
    letter
    for line in (
        "alpha beta gamma delta epsilon zeta eta theta kappa lambda mu nu xi pi rho sigma tau phi",
        "chi psi omega Gamma Delta Theta Lambda Xi Pi Sigma Phi Psi Omega",
    )
    for letter in line.split()
}


def latex_name(name: str) -> str:
    """Write a name: Greek letters, and what follows them as an index.

    Raises
    ------
    ValueError
        For what is no name: it could be anything in LaTeX.
    """
    _require_name(name)
    found = re.fullmatch(r"([A-Za-z]+?)_?(\d*|_\w+)", name)
    stem, index = (found[1], found[2].lstrip("_")) if found else (name, "")
    letter = rf"\{stem}" if stem in _GREEK else stem if len(stem) == 1 else rf"\mathrm{{{stem}}}"
    # an index of an index, or two of them, are an error of LaTeX
    letter, index = letter.replace("_", r"\_"), index.replace("_", r"\_")
    return f"{letter}_{{{index}}}" if index else letter


def _require_name(name: str) -> None:
    """Refuse to write what is no identifier, wherever it comes from: it would be code."""
    if not name.isidentifier():
        raise ValueError(f"{clipped(repr(name))} is no name, and is not written")


def _latex_call(f: str, x: str) -> str:
    if f == "sqrt":
        return rf"\sqrt{{{x}}}"
    return rf"\left|{x}\right|" if f == "magnitude" else rf"{f}\left({x}\right)"


latex = Language(
    constant=_number,
    name=latex_name,
    functions={name: rf"\{name}" for name in ("sin", "cos", "tan", "exp", "sinh", "cosh", "tanh")}
    | {"log": r"\ln", "asin": r"\arcsin", "atan": r"\arctan", "sign": r"\operatorname{sign}"},
    call=_latex_call,
    product=r"\,",
    quotient=lambda a, b: rf"\frac{{{a}}}{{{b}}}",
    power=lambda a, b: f"{a}^{{{b}}}",
    where=lambda c, a, b: rf"\left[{c}\,?\,{a}:{b}\right]",
    unit=lambda v, k: rf"\operatorname{{unit}}\left({', '.join(v)}\right)_{{{k + 1}}}",
)


#: Characters of a formula that is written in one piece, and how deep its parts may be nested then.
MOST_CHARACTERS = 4_000
_DEEPEST = 40
_BEYOND = 10**9  #: a length that is counted no further: a square of squares has 2^n factors


def write(
    graph: _core.Graph,
    e: int,
    state: Sequence[str],
    params: Sequence[str],
    language: Language = python,
) -> str:
    """Write an expression, with the fewest parentheses.

    A long one is written with what it shares written once: `v1*v1 - 1, where v0 = x*x, where ...`.
    """
    named, (text,) = write_all(graph, [e], state, params, language)
    return ", ".join([text, *(f"where {name} = {words}" for name, words in named)])


def write_all(
    graph: _core.Graph,
    outputs: Sequence[int],
    state: Sequence[str],
    params: Sequence[str],
    language: Language = python,
    *,
    share: bool = False,
) -> tuple[list[tuple[str, str]], list[str]]:
    """Write expressions, and before them what they share.

    Parameters
    ----------
    share : bool
        Whether to name what is used twice in every case, and not only where it is long.

    Returns
    -------
    list of (name, formula), list of str
        Each formula uses names before its own.
    """
    nodes = graph.nodes()
    functions = [called for called, _ in graph.functions()]
    below = _below(nodes, outputs)
    length = _lengths(nodes, below)
    share = share or any(length[e] > MOST_CHARACTERS for e in outputs)
    stem = next(v for v in _stems() if not any(_is_numbered(v, n) for n in (*state, *params)))
    uses = Counter(a for i in below for a in nodes[i][1:4] if a >= 0)
    known: dict[int, tuple[str, int]] = {}
    depth: dict[int, int] = {}
    named: list[tuple[str, str]] = []

    def part(i: int, least: int) -> str:
        words, binds = known[i]
        return words if binds >= least else f"({words})"

    for i in below:
        op, *operands, output, function = nodes[i]
        known[i] = (
            (f"{functions[int(function)]}(t, s, p)[{output}]", _ATOM)
            if op == "call"
            else _one(nodes[i], part, state, params, language)
        )
        depth[i] = 1 + max((depth[a] for a in operands if a >= 0), default=0)
        is_leaf = op in ("constant", "time", "state", "param")
        if share and not is_leaf and (uses[i] > 1 or (uses[i] and depth[i] > _DEEPEST)):
            name = language.name(f"{stem}{len(named)}")
            named.append((name, known[i][0]))
            known[i], depth[i] = (name, _ATOM), 0
    return named, [known[e][0] for e in outputs]


def _stems() -> Iterator[str]:
    """Give letters, then words that nobody has taken."""
    yield from "vwuqz"
    yield from (f"part{'_' * n}" for n in itertools.count(1))


def _is_numbered(stem: str, name: str) -> bool:
    return name.startswith(stem) and name[len(stem) :].lstrip("_").isdigit()


def _lengths(nodes: Sequence[_Node], below: Sequence[int]) -> dict[int, int]:
    """About how many characters each would have in one piece."""
    found: dict[int, int] = {}
    for i in below:
        inside = sum(found[a] for a in nodes[i][1:4] if a >= 0)
        found[i] = min(inside + 3, _BEYOND)
    return found


def _below(nodes: Sequence[_Node], roots: Sequence[int]) -> list[int]:
    """Everything that expressions are made of, operands first."""
    needed = set(roots)
    for i in range(max(roots), -1, -1):
        if i in needed:
            needed.update(a for a in nodes[i][1:4] if a >= 0)
    return sorted(needed)


def _one(
    node: _Node,
    part: Callable[[int, int], str],
    state: Sequence[str],
    params: Sequence[str],
    language: Language,
) -> tuple[str, int]:
    op, a, b, c, index, value = node
    match op:
        case "constant":
            return language.constant(value), _ATOM if value >= 0 else _SUM
        case "time":
            return "t", _ATOM
        case "state":
            return language.name(state[index]), _ATOM
        case "param":
            return language.name(params[index]), _ATOM
        case "add":
            return _sum(part(a, _SUM), "+", part(b, _SUM)), _SUM
        case "sub":
            return _sum(part(a, _SUM), "-", part(b, _PRODUCT)), _SUM
        case "mul":
            return f"{part(a, _PRODUCT)}{language.product}{part(b, _PRODUCT)}", _PRODUCT
        case "div" if language.quotient is not None:
            return language.quotient(part(a, 0), part(b, 0)), _ATOM
        case "div":
            return f"{part(a, _PRODUCT)}/{part(b, _SIGN)}", _PRODUCT
        case "neg":
            return f"-{part(a, _PRODUCT)}", _SUM
        case "pow":
            return language.power(part(a, _ATOM), part(b, _ATOM)), _POWER
        case "powi":
            return language.power(part(a, _ATOM), str(index)), _POWER
        case "where":
            return language.where(part(a, _SUM), part(b, 0), part(c, 0)), _ATOM
        case "unit2" | "unit3":
            vector = [part(v, _ATOM) for v in ((a, b) if op == "unit2" else (a, b, c))]
            return language.unit(vector, index), _ATOM
        case _:
            return language.call(language.functions.get(op, op), part(a, 0)), _ATOM


def _sum(left: str, sign: str, right: str) -> str:
    """Write a sum or a difference; what is added less a number is taken away."""
    if number := re.fullmatch(r"\(?-(\d+(\.\d+)?)\)?", right):
        sign, right = "-" if sign == "+" else "+", number[1]
    return f"{left} {sign} {right}"


def entry_names(names: Sequence[str], n: int) -> list[str]:
    """Name the entries of directions, otherwise than anything else."""
    each = itertools.chain("ne", (f"unit{'_' * n}" for n in itertools.count()))
    stem = next(v for v in each if not any(_is_numbered(v, name) for name in names))
    return [f"{stem}{k}" for k in range(n)]


def text(graph: _core.Graph, e: int) -> str:
    """Write an expression whose names are not known."""
    nodes = graph.nodes()
    state = [f"x{k}" for k in range(1 + max((n[4] for n in nodes if n[0] == "state"), default=0))]
    params = [f"p{k}" for k in range(1 + max((n[4] for n in nodes if n[0] == "param"), default=0))]
    return clipped(write(graph, e, state, params))


def clipped(words: str, most: int = 400) -> str:
    """Give a text for people, without the end of one that nobody reads."""
    return words if len(words) <= most else words[: most - 3] + "..."


# --- C++ ------------------------------------------------------------------------------------------

_CPP_HEAD = """\
// {name}: written by filippov {version}.
#pragma once

#include <filippov/core/elementary.hpp>
#include <filippov/system/system.hpp>

#include <array>
#include <cmath>
#include <string_view>

struct {name} {{
    static constexpr int dim = {dim};
    static constexpr std::array<std::string_view, dim> state{{{state}}};
    static constexpr std::array<std::string_view, {n}> params{{{params}}};
    static constexpr std::array<double, {n}> defaults{{{defaults}}};
{surfaces}
    template <class S> using X = filippov::Vec<S, dim>;
    template <class S> using P = filippov::Vec<S, {n}>;
"""
_MOST_CPP = 64 * 10**6  #: characters
_CPP_SURFACES = """\
    static constexpr int surfaces = {m};
    static constexpr std::array<filippov::SurfaceKind, surfaces> kinds{{{kinds}}};
"""
_CPP_DIRECTED = """\
        return directed(t, x, filippov::sides_and_directions(*this, side, t, x, p), p);
"""
_CPP_SIGN = """\
        const auto sign = [](const S& v) {
            return filippov::select(v > S(0), S(1), filippov::select(v < S(0), S(-1), S(0)));
        };
"""
#: Names that mean something else in C++, or in the struct.
_CPP_TAKEN = frozenset(
    word
    for line in (
        "alignas alignof and and_eq asm auto bitand bitor bool break case catch char char8_t",
        "char16_t char32_t class compl concept const consteval constexpr constinit const_cast",
        "continue co_await co_return co_yield decltype default delete do double dynamic_cast else",
        "enum explicit export extern false float for friend goto if inline int long mutable",
        "namespace new noexcept not not_eq nullptr operator or or_eq private protected public",
        "register reinterpret_cast requires return short signed sizeof static static_assert",
        "static_cast struct switch template this thread_local throw true try typedef typeid",
        "typename union unsigned using virtual void volatile wchar_t while xor xor_eq main std",
        "filippov unix linux NULL EOF NAN INFINITY S X P dim state params defaults surfaces kinds",
        "f1 f2 h region jump period side directed may_have_directions",
    )
    for word in line.split()
)
_CPP_OWN = ("cos", "sin")  #: those of filippov::elementary, which inline
_CPP_STD = ("abs", "asin", "atan", "cosh", "exp", "log", "pow", "sinh", "sqrt", "tan", "tanh")


def _cpp_using(body: str) -> str:
    """Declare the functions that a body calls."""
    called = set(re.findall(r"\b([a-z]+)\(", body))
    lines = [f"        using filippov::elementary::{f};\n" for f in _CPP_OWN if f in called]
    lines += [f"        using std::{f};\n" for f in _CPP_STD if f in called]
    if "select" in called:
        lines.append("        using filippov::select;\n")
    return "".join(lines) + (_CPP_SIGN if "sign" in called else "")


def cpp_struct(
    definition: Definition, name: str, params: Mapping[str, float], kinds: Sequence[str]
) -> str:
    """Write a system as a C++ struct that meets the concept of the headers."""
    if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", name) or "__" in name or name in _CPP_TAKEN:
        raise ValueError(f"name = {clipped(repr(name))}: expected a name of C++")
    for each in (*definition.state, *params):
        _require_name(each)
    m = len(definition.h)
    single = m == 1 and kinds[0] == "switching"
    parts = [
        _CPP_HEAD.format(
            name=name,
            version=_core.__version__,
            dim=len(definition.state),
            n=len(params),
            state=", ".join(f'"{v}"' for v in definition.state),
            params=", ".join(f'"{v}"' for v in params),
            defaults=", ".join(repr(v) for v in params.values()),
            surfaces=""
            if single
            else _CPP_SURFACES.format(
                m=m, kinds=", ".join(f"filippov::SurfaceKind::{kind}" for kind in kinds)
            ),
        )
    ]
    unused = "[[maybe_unused]] "
    p = f"{unused}const P<S>& p"
    t, x = f"{unused}const S& t", f"{unused}const X<S>& x"

    def function(returned: str, called: str, arguments: str, body: str) -> None:
        if sum(map(len, parts)) + len(body) > _MOST_CPP:
            raise ValueError(
                f"{name} has more than {_MOST_CPP // 10**6} million characters in C++: expected"
                " formulas of fewer operations, or of fewer surfaces"
            )
        parts.append(
            f"    template <class S>\n    {returned} {called}({arguments}) const {{\n"
            f"{_cpp_using(body)}{body}    }}\n"
        )

    def vector(nodes: Sequence[int], type_: str = "X<S>") -> str:
        return _cpp_body(definition, nodes, type_)

    if single:
        function("X<S>", "f1", f"{t}, {x}, {p}", vector(definition.region[0]))
        function("X<S>", "f2", f"{t}, {x}, {p}", vector(definition.region[1]))
        function("S", "h", f"{t}, {x}, {p}", _cpp_body(definition, definition.h, "S"))
    else:
        splits = [j for j in range(m) if kinds[j] in ("switching", "kink")]
        directed = "direction" in kinds
        side, zero = ("s", "S(0)") if directed else ("side", "0")
        code = " + ".join(f"{1 << j} * ({side}[{j}] > {zero})" for j in splits) or "0"
        cases = "".join(
            f"        case {k}: {{\n{vector(region)}        }}\n"
            for k, region in enumerate(definition.region[1:], 1)
        )
        body = f"        switch ({code}) {{\n{cases}        default: {{\n"
        body += vector(definition.region[0]) + "        }\n        }\n"
        sides = f"{unused}const filippov::Mode<surfaces>& side"
        if directed:
            entries = f"{unused}const filippov::Vec<S, surfaces>& s"
            parts.append("    static constexpr bool may_have_directions = true;\n")
            function("X<S>", "directed", f"{t}, {x}, {entries}, {p}", body)
            body = _CPP_DIRECTED
        function("X<S>", "region", f"{t}, {x}, {sides}, {p}", body)
        returned = "S" if m == 1 else f"filippov::Vec<S, {m}>"
        function(returned, "h", f"{t}, {x}, {p}", _cpp_body(definition, definition.h, returned))
        if "jump" in kinds:
            jumps = dict(enumerate(definition.jumps.values(), kinds.index("jump")))
            cases = "".join(
                f"        case {j}: {{\n{vector(after)}        }}\n"
                for j, (_, after) in jumps.items()
            )
            rest = "        default:\n            return x;\n        }\n"
            body = f"        switch (j) {{\n{cases}{rest}"
            function("X<S>", "jump", f"{unused}int j, {t}, {x}, {p}", body)
    if definition.period is not None:
        function("S", "period", p, _cpp_body(definition, [definition.period], "S"))
    return "\n".join(parts) + "};\n"


def _cpp_body(definition: Definition, outputs: Sequence[int], returned: str) -> str:
    """Statements that compute nodes and return them; what is used twice has a name."""
    dim, m = len(definition.state), len(definition.h)
    first = m - len(definition.jumps) - definition.entries
    state = [f"x[{i}]" for i in range(dim)] + [f"s[{first + k}]" for k in range(definition.entries)]
    params = [f"p[{k}]" for k in range(len(definition.params))]
    named, values = write_all(definition.graph, outputs, state, params, cpp, share=True)
    lines = [f"        const S {name} = {formula};\n" for name, formula in named]
    if returned == "S":
        return "".join(lines) + f"        return S({values[0]});\n"
    lines.append(f"        {returned} f;\n")
    lines += [f"        f[{i}] = S({value});\n" for i, value in enumerate(values)]
    return "".join(lines) + "        return f;\n"
