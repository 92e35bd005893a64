"""What each inequality means, as a sentence and as a formula with its numbers put in."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

from bfppc_synth.bounds.formulas import load_symbol
from bfppc_synth.model.spec import CenterKind, Form
from bfppc_synth.report.breaking import broken
from bfppc_synth.report.formulas import displayed, inline, number, with_numbers
from bfppc_synth.report.nominal import source_sentence
from bfppc_synth.report.theorem1 import theorem1_formula

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from bfppc_synth.model.design import Design
    from bfppc_synth.model.shapes import Gain

_IDENTIFIER = re.compile(r"([A-Za-z0-9_]+'?(?:\.\w+)?)(?:\[(\w+)\])?")
_MEANINGS = {
    "U0": "What is measured of this error is finer than its tube.",
    "U1": "At the wall of its tube the feedback beats everything that pushes outward.",
    "U2": "At the wall of the last tube the feedback beats everything that pushes outward, "
    "also with what is lost to measurement, hold and delay.",
    "U2.room": "The last tube is wider than the total error of what the law sees.",
    "U2'.room": "The last tube is wider than what measurement and two holds can hide.",
    "U2'": "At the wall of the last tube the feedback beats everything that pushes outward, "
    "counting what a held command can lose since its sample.",
    "T2": "The gain condition of the paper for this tube.",
    "T1.p": "The tube is wider than what measurement can make of its error.",
    "T1.H": "The height H dominates everything that pushes outward, at every rho.",
    "T1.c": "What measurement changes in the power term stays below c_0.",
    "T1.gamma": "At the wall of its tube the feedback beats everything that pushes outward.",
    "T1'.gamma": "The same where rho is 1, with the narrowest tube in the power term.",
    "T3.stage": "Between two samples no error leaves the widened tube of this free stage.",
    "T3.handover": "The last tube contains every jump out of this stage.",
    "f_bound": "The declared f_bound covers the drift wherever the states can go.",
    "g_min": "The least input gain is positive wherever the states can go.",
    "g_bound": "The declared g_bound covers the input gain wherever the states can go.",
    "tight": "On both walls of this tube nothing pushes outward by more, whatever the time, the "
    "start, the parameters and the other errors: proved cell by cell, so no two sides are printed.",
    "tight.rate": "Nothing moves the last error faster without the input, anywhere in the tubes: "
    "proved cell by cell, so no two sides are printed.",
    "limit": "The peak input is within what the actuator can do.",
    "funnel": "The envelope of the output stays inside the funnel.",
}
_TERMS = (
    (r"f_(\d+)\* and disturbance", "drift $f_{i}$ and disturbance"),
    (r"sup\|dr_(\d+)\|", r"motion of the center, $\dot{r}_{i}$"),
    (r"\|d alpha_(\d+)\|", r"motion of the feedback $\varphi_{i}$"),
    (r"residual, tight", "residual at its worst on the wall"),
    (r"p_(\d+)", "next tube, $p_{i}$"),
    (r"sup\|r_(\d+)\|", "next center, $r_{i}$"),
)
_OTHER = "An obligation of the certificate."


@dataclass(frozen=True, slots=True, kw_only=True)
class Side:
    """One side of an inequality as MathML: in letters, and with the numbers put in."""

    name: str
    letters: str
    numbers: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Obligation:
    """An inequality as the page prints it; ``formula`` is "" where it has no closed form."""

    meaning: str
    formula: str
    sides: tuple[Side, ...]


def obligation(design: Design, document: Mapping[str, object], identifier: str) -> Obligation:
    """Explain one inequality of the certificate.

    Parameters
    ----------
    design : Design
        Gains (a term that is exactly 0 is left out) and order.
    document : Mapping[str, object]
        report.json, where the numbers come from.
    identifier : str
        ``U1[x1]``, ``U2'[x2]``, ``T2[x1]``, ``limit``, ...

    Returns
    -------
    Obligation
        Sentence and MathML; an unknown identifier has a sentence only.

    References
    ----------
    docs/theory.md sections 2 and 3.
    """
    match = _IDENTIFIER.fullmatch(identifier)
    family, state = (match[1], match[2]) if match else (identifier, None)
    if family.startswith("T3."):
        # T3.stage2 is the same claim as T3.stage1, of another stage.
        family = family.rstrip("0123456789")
    meaning = _MEANINGS.get(family, _OTHER)
    states = design.spec.states
    if state is not None and state not in states:
        return Obligation(meaning=meaning, formula="", sides=())
    index = states.index(state) if state is not None else 0
    formula, pairs = _formula(design, family, index)
    return Obligation(
        meaning=meaning,
        formula=broken(inline(formula)) if formula else "",
        sides=tuple(
            Side(
                name=name,
                letters=displayed(letters),
                numbers=with_numbers(displayed(numbers), document),
            )
            for name, (letters, numbers) in zip(("left", "right"), pairs, strict=False)
        ),
    )


def _formula(design: Design, family: str, index: int) -> tuple[str, tuple[tuple[str, str], ...]]:
    i = index + 1
    held = (
        (r"\delta_u", number("actuator", "error")),
        (r"\delta_v", number("bounds", "delta_v")),
    )
    shape = design.gains[index]
    p, eta, demand = f"p_{{{i}}}", rf"\eta_{{{i}}}", rf"F_{{{i}}}^{{*}}"
    p_value = number("omega", "p", index)
    if family == "U0":
        return rf"{p} > {eta}", ()
    if family == "U1":
        left = _feedback(shape, index, p, p_value)
        return rf"\varphi_{{{i}}}\left({p}\right) > {demand}", (left, _demand(design, index, ()))
    if family == "U2":
        zeta = number("bounds", "zeta")
        left = _feedback(
            shape, index, rf"\left({p} - \zeta\right)", rf"\left({p_value} - {zeta}\right)"
        )
        formula = rf"\varphi_{{{i}}}\left({p} - \zeta\right) > {demand} + \delta_u + \delta_v"
        return formula, (left, _demand(design, index, held))
    if family == "U2.room":
        return rf"{p} > \zeta", ()
    if family == "U2'.room":
        room = rf"{eta} + 2 \left(h + \tau\right) V_{{{i}}}"
        hold, speed = number("sampling", "hold"), number("bounds", "V")
        numbers = rf"{number('bounds', 'eta', index)} + 2 \cdot {hold} \cdot {speed}"
        return f"{p} > {room}", ((p, p_value), (room, numbers))
    if family == "U2'":
        pushed = rf"\left(D_{{{i}}} + G_{{{i}}} \left(\delta_u + \delta_v\right)\right)"
        e = rf"\left({p} - {eta} - \left(h + \tau\right) {pushed}\right)"
        load, gain = number("bounds", "D", index), number("bounds", "G", index)
        error, change = number("actuator", "error"), number("bounds", "delta_v")
        pushed = rf"\left({load} + {gain} \cdot \left({error} + {change}\right)\right)"
        lost = rf"{number('bounds', 'eta', index)} - {number('sampling', 'hold')} \cdot {pushed}"
        left = _feedback(shape, index, e, rf"\left({p_value} - {lost}\right)")
        formula = rf"\varphi_{{{i}}}{e} > {demand} + \delta_u + \delta_v"
        return formula, (left, _demand(design, index, held))
    if family == "T2":
        return _paper(design, index)
    if family.startswith("T1"):
        return theorem1_formula(design, family, index), ()
    return _assumption(family, i), ()


def _assumption(family: str, i: int) -> str:
    return {
        "f_bound": rf"f_{{{i}}}^{{*}} \ge \left|f_{{{i}}}\right|",
        "tight": rf"{load_symbol(i - 1)} \ge \sup \frac{{\pm R_{{{i}}}}}{{g_{{{i}}}}}",
        "tight.rate": rf"D_{{{i}}} \ge \sup\left|R_{{{i}}}\right|",
        "g_min": rf"g_{{{i}}} \ge g_{{m,{i}}} > 0",
        "g_bound": rf"g_{{{i}}}^{{*}} \ge g_{{{i}}}",
        "limit": r"u_{\text{limit}} \ge U",
        "funnel": r"\inf_t \left(F(t) - \sup \left|r_1 - y_d\right|\right) \ge p_1",
    }.get(family, "")


def _feedback(shape: Gain, index: int, e: str, e_value: str) -> tuple[str, str]:
    """phi_i at an argument, without the terms that are off."""
    i = index + 1
    k, M, epsilon, c = (number("gains", index, key) for key in ("k", "M", "epsilon", "c"))
    letters, numbers = [], []
    if shape.k:
        letters.append(f"k_{{{i}}} {e}")
        numbers.append(rf"{k} \cdot {e_value}")
    if shape.M:
        inner = rf"\frac{{M_{{{i}}} {e}}}{{\varepsilon_{{{i}}}}}"
        letters.append(rf"M_{{{i}}} \tanh\left({inner}\right)")
        inner = rf"\frac{{{M} \cdot {e_value}}}{{{epsilon}}}"
        numbers.append(rf"{M} \cdot \tanh\left({inner}\right)")
    if shape.c:
        letters.append(f"c_{{{i}}} {e}^{{{shape.N}}}")
        numbers.append(rf"{c} \cdot {e_value}^{{{shape.N}}}")
    return _sum(letters), _sum(numbers)


def _paper(design: Design, index: int) -> tuple[str, tuple[tuple[str, str], ...]]:
    """Write the gain condition (65)/(71), sound or as printed."""
    i, shape = index + 1, design.gains[index]
    p, p_value = f"p_{{{i}}}", number("omega", "p", index)
    k, M, epsilon, c = (number("gains", index, key) for key in ("k", "M", "epsilon", "c"))
    terms = (
        (shape.k, f"k_{{{i}}} {p}", rf"{k} \cdot {p_value}"),
        (shape.M, f"M_{{{i}}}", M),
        (shape.c, f"c_{{{i}}} {p}^{{{shape.N}}}", rf"{c} \cdot {p_value}^{{{shape.N}}}"),
    )
    present = [(letters, numbers) for gain, letters, numbers in terms if gain]
    left = (_sum([letters for letters, _ in present]), _sum([text for _, text in present]))
    printed = design.spec.synthesis.form is Form.PRINTED
    factor, relation = ("0.3", r"\ge") if printed else ("0.2785", ">")
    letters, numbers = [f"F_{{{i}}}^{{*}}"], [number("bounds", "F_star", index)]
    if shape.M:
        letters.append(rf"\frac{{{factor} \, \varepsilon_{{{i}}}}}{{{p}}}")
        numbers.append(rf"\frac{{{factor} \cdot {epsilon}}}{{{p_value}}}")
    right = (_sum(letters), _sum(numbers))
    return f"{left[0]} {relation} {right[0]}", (left, right)


def _demand(design: Design, index: int, extra: Sequence[tuple[str, str]]) -> tuple[str, str]:
    """F_i* in the divided form of section 2, and what an inequality adds to it."""
    i = index + 1
    g_min = number("bounds", "g_min", index)
    letters = [rf"\frac{{D_{{{i}}}}}{{g_{{m,{i}}}}}"]
    numbers = [rf"\frac{{{number('bounds', 'D', index)}}}{{{g_min}}}"]
    if design.tight is not None:
        letters, numbers = [load_symbol(index)], [number("tight", "load", index)]
        if i < design.spec.order:
            letters.append(f"p_{{{i + 1}}}")
            numbers.append(number("omega", "p", index + 1))
    elif i < design.spec.order:
        letters.append(f"p_{{{i + 1}}}")
        numbers.append(number("omega", "p", index + 1))
        if design.spec.synthesis.center is CenterKind.PERFORMANCE:
            letters.append(f"s_{{{i + 1}}}")
            numbers.append(number("bounds", "s", index))
    letters += [text for text, _ in extra]
    numbers += [text for _, text in extra]
    return _sum(letters), _sum(numbers)


def _sum(terms: Sequence[str]) -> str:
    return " + ".join(terms) if terms else "0"


def term_sentence(term: str) -> str:
    """Put a term of F_i* into words for ``prose``; an unknown one stays as it is."""
    for pattern, words in _TERMS:
        match = re.fullmatch(pattern, term)
        if match:
            return words.replace("{i}", f"{{{match[1]}}}") if match.groups() else words
    return source_sentence(re.sub(r"[$#`]", "", term))
