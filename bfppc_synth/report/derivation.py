"""The chain of bounds on the page: each constant with its formula and its numbers."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

from bfppc_synth.bounds.chain import ChainRules, Coupling, Division
from bfppc_synth.bounds.formulas import chain_formulas, load_symbol
from bfppc_synth.model.spec import BoundsKind, CenterKind, Form
from bfppc_synth.report.formulas import displayed, inline, number, with_numbers
from bfppc_synth.report.meanings import CHAIN
from bfppc_synth.report.numbers import look_up
from bfppc_synth.report.theorem1 import theorem1_lines

if TYPE_CHECKING:
    from collections.abc import Mapping

    from bfppc_synth.bounds.formulas import ChainFormula
    from bfppc_synth.model.design import Design

_RESIDUAL = (
    r"bound on the residual $w_{i} = f_{i}(x) + g_{i}(x) \, {ahead} - \dot{r}_{i}$, "
    "disturbance included"
)
_BY_STEP = ("xi", "X", "A", "L", "W", "G", "g_min", "D", "F_star", "B", "eta", "Lambda")
_BY_INPUT = ("delta_v", "V", "zeta", "U")
# A number beside another factor needs a sign between them; letters do not.
_PLACE = r"\\text\{@[^@]+@\}"
_FACTOR = r"(?=\\(?:tanh|left|frac|sigma|text|max|min|sqrt|cdot\b)|[0-9])"
_AFTER = re.compile(rf"({_PLACE}(?:\^\{{\d+\}})?) {_FACTOR}")
_BEFORE = re.compile(rf"([0-9}}]) (?={_PLACE})")


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """One constant: sentence for ``prose``, place of its value, formula as MathML.

    ``numbers`` is the formula with its numbers put in, empty where that says nothing new;
    ``parts`` are its abbreviations, each as formula and numbers.
    """

    symbol: str
    keys: tuple[str | int, ...]
    meaning: str
    formula: str
    numbers: tuple[str, ...]
    parts: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Step:
    """The constants of one step, or of the input."""

    title: str
    rows: tuple[Row, ...]


def derivation(design: Design, document: Mapping[str, object]) -> tuple[Step, ...]:
    """Write out the chain that leads from gains and half-widths to F_i* and U.

    Parameters
    ----------
    design : Design
        Gains; a term that is off is left out of the formulas.
    document : Mapping[str, object]
        report.json, where the numbers come from.

    Returns
    -------
    tuple[Step, ...]
        Steps 1..n and the input, each constant in the order in which it is explained.

    References
    ----------
    docs/theory.md sections 2 and 3; the formulas are bounds/chain.py run on symbols.
    """
    if design.theorem1 is not None:
        return _of_theorem1(design, document)
    printed = design.spec.synthesis.form is Form.PRINTED
    rules = ChainRules(coupling=Coupling.SIMPLE, division=Division.PRINTED)
    center = design.spec.synthesis.center
    lines = chain_formulas(
        design.gains,
        rules if printed else ChainRules(),
        center,
        BoundsKind.TERMWISE if design.tight is None else BoundsKind.TIGHT,
    )
    values = _values(design, lines)
    found = {(line.field, line.index): line for line in lines}
    steps = []
    for index, state in enumerate(design.spec.states):
        chosen = [found[field, index] for field in _BY_STEP if (field, index) in found]
        rows = tuple(_row(line, index, values, document) for line in chosen)
        steps.append(Step(title=f"Step {index + 1}: state {state}", rows=rows))
    last = design.spec.order - 1
    chosen = [found[field, None] for field in _BY_INPUT if (field, None) in found]
    rows = tuple(_row(line, last, values, document) for line in chosen)
    return (*steps, Step(title="Input", rows=rows))


def _of_theorem1(design: Design, document: Mapping[str, object]) -> tuple[Step, ...]:
    """Write out the chain of docs/theory.md section 7 at rho = 1, where all is largest."""
    steps = [
        Step(
            title=f"Step {index + 1}: state {state}",
            rows=tuple(
                Row(
                    symbol=inline(line.symbol),
                    keys=line.keys,
                    meaning=line.meaning,
                    formula=displayed(line.definition),
                    numbers=(line.numbers,) if line.numbers else (),
                )
                for line in theorem1_lines(design, document, index)
            ),
        )
        for index, state in enumerate(design.spec.states)
    ]
    n = design.spec.order
    peak = rf"\varphi_{{{n}}}\left(p_{{{n}}} + \eta_{{{n}}}\right)"
    row = Row(
        symbol=inline("U"),
        keys=("bounds", "U"),
        meaning=CHAIN["U"],
        formula=displayed(peak),
        numbers=(),
    )
    return (*steps, Step(title="Input", rows=(row,)))


def _row(
    line: ChainFormula, index: int, values: Mapping[str, str], document: Mapping[str, object]
) -> Row:
    keys = ("bounds", line.field) if line.index is None else ("bounds", line.field, line.index)
    definition = line.definition
    numbers = _put_in(definition, values)
    bare = re.fullmatch(_PLACE, numbers) or numbers == definition
    meaning = CHAIN[line.field].replace("_{i}", f"_{{{index + 1}}}")
    if line.field == "D" and index == 0:
        meaning = r"all that pushes $e_{1}$"
    elif line.field == "D" and r"R_{" in definition:
        meaning = r"all that pushes $e_{i}$, as a supremum of the residual $R_{i}$ over the tube"
    elif line.field == "F_star" and r"\ell" in definition:
        meaning += r"; $\ell_{i}$ is the supremum of $\pm R_{i} / g_{i}$ on the walls of the tube"
    elif line.field == "W" and r"\sup\left|w_{" in definition:
        last = look_up(document, ("order",)) == index + 1
        ahead = "v" if last else f"r_{{{index + 2}}}"
        meaning = _RESIDUAL.replace("{i}", f"{{{index + 1}}}").replace("{ahead}", ahead)
    elif line.field == "G" and look_up(document, ("center",)) == str(CenterKind.NOMINAL):
        meaning = rf"largest input gain $\overline{{g}}_{{{index + 1}}}$ where the states can go"
    return Row(
        symbol=inline(line.symbol),
        keys=keys,
        meaning=meaning.replace("_{i}", f"_{{{index + 1}}}").replace("_{i-1}", f"_{{{index}}}"),
        formula=displayed(definition),
        numbers=() if bare else (with_numbers(displayed(numbers), document),),
        parts=tuple(
            (
                displayed(f"{name} = {part}"),
                with_numbers(displayed(f"{name} = {_put_in(part, values)}"), document),
            )
            for name, part in line.parts
        ),
    )


def _values(design: Design, lines: tuple[ChainFormula, ...]) -> dict[str, str]:
    """Map every symbol that stands in a formula to its place in report.json."""
    places: dict[str, str] = {}
    for line in lines:
        keys = ("bounds", line.field) if line.index is None else ("bounds", line.field, line.index)
        places[line.symbol] = number(*keys)
    for index in range(design.spec.order):
        i = index + 1
        places[f"p_{{{i}}}"] = number("omega", "p", index)
        for letter, key in (("k", "k"), ("M", "M"), (r"\varepsilon", "epsilon"), ("c", "c")):
            places[f"{letter}_{{{i}}}"] = number("gains", index, key)
        places[f"s_{{{i + 1}}}"] = number("bounds", "s", index)
        places[rf"\delta_{{0,{i}}}"] = number("measurement", "delta", index)
        places[rf"\sup\left|r_{{{i}}}\right|"] = number("bounds", "r", index)
        places[rf"\sup\left|\dot{{r}}_{{{i}}}\right|"] = number("bounds", "r_rate", index)
    places[r"\delta_{u}"] = number("actuator", "error")
    places[r"\delta_{v}"] = number("bounds", "delta_v")
    places[r"\sup\left|v\right|"] = number("bounds", "v")
    places[r"\sup\left|\dot{v}\right|"] = number("bounds", "v_rate")
    places["v_{0}"] = number("bounds", "v_start")
    if design.nominal_split is not None:
        # A supremum of the residual is known as the sum of what it consists of.
        for index, sources in enumerate(design.nominal_split.disturbance):
            sizes = [number("nominal", "sources", index, j, "size") for j in range(len(sources))]
            if sizes:
                places[rf"\sup\left|w_{{{index + 1}}}\right|"] = " + ".join(sizes)
    if design.tight is not None:
        for index in range(design.spec.order):
            places[load_symbol(index)] = number("tight", "load", index)
        places[rf"\sup\left|R_{{{design.spec.order}}}\right|"] = number("tight", "rate")
    places[r"\left(h+\tau\right)"] = number("sampling", "hold")
    return places


def _put_in(definition: str, values: Mapping[str, str]) -> str:
    if r"\overline" in definition or r"\underline" in definition:
        return definition
    longest_first = sorted(values, key=lambda symbol: (-len(symbol), symbol))
    # Not inside a longer name: the c_{1} of a \frac_{1} must stay.
    pattern = re.compile("|".join(rf"(?<![A-Za-z\\]){re.escape(s)}" for s in longest_first))
    numbers = pattern.sub(lambda match: values[match[0]], definition)
    return _BEFORE.sub(r"\1 \\cdot ", _AFTER.sub(r"\1 \\cdot ", numbers))
