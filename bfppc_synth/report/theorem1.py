"""Theorem 1 on the page: its inequalities, and its chain of bounds with numbers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from bfppc_synth.model.shapes import Theorem1Gain
from bfppc_synth.model.spec import Form
from bfppc_synth.report.formulas import displayed, number, with_numbers

if TYPE_CHECKING:
    from collections.abc import Mapping

    from bfppc_synth.model.design import Design


@dataclass(frozen=True, slots=True, kw_only=True)
class Line:
    """One constant at rho = 1: LaTeX of its symbol, its place, its sentence, its formula.

    ``numbers`` is the formula as MathML with its numbers put in.
    """

    symbol: str
    keys: tuple[str | int, ...]
    meaning: str
    definition: str
    numbers: str


def theorem1_formula(design: Design, family: str, index: int) -> str:
    """Write one inequality of Theorem 1 in letters.

    Parameters
    ----------
    design : Design
        Order, and the form that was evaluated.
    family : str
        ``T1.p``, ``T1.H``, ``T1.c``, ``T1.gamma`` or ``T1'.gamma``.
    index : int
        0-based step.

    Returns
    -------
    str
        LaTeX, empty for another family.

    References
    ----------
    docs/theory.md section 7; the paper's (39) for the printed form.
    """
    i, last = index + 1, index + 1 == design.spec.order
    printed = design.spec.synthesis.form is Form.PRINTED
    p, D, N = f"p_{{{i}}}", rf"\eta_{{{i}}}", design.gains[index].N
    ahead = "c_0" if last else rf"c_0 + \delta_M + \varepsilon_{{{i + 1}}}"
    gamma, c, room = rf"\gamma_{{{i}}}", f"c_{{{i}}}", rf"\varepsilon_{{{i}}}"
    if family == "T1.p":
        return f"{p} > {D}"
    if family == "T1.H":
        return rf"H_{{{i}}}(\rho) \ge H_{{{i}}}^{{0}}(\rho)"
    if family == "T1.c":
        if printed:
            sums = rf"{p}^{{{N - 1}}} + \left({p} + {D}\right)^{{{N - 1}}}"
            return rf"c_0 \ge {N} \, {c} \, {D} \left({sums}\right)"
        return rf"c_0 \ge {c} \left(\left({p} + {D}\right)^{{{N}}} - {p}^{{{N}}}\right)"
    if family == "T1.gamma" and printed:
        least = f"H_{{{i}}}^{{*}}"
        return rf"{gamma} > \frac{{{least} + {ahead} - {c} \, {p}^{{{N}}}}}{{{room} \, {least}}}"
    if family in ("T1.gamma", "T1'.gamma"):
        scheduled = _is_scheduled(design, index)
        rho = "0" if family == "T1.gamma" and scheduled else "1"
        # The narrowest tube counts in the power term, whatever rho the height is taken at.
        wall = f"{p}(0)" if scheduled else p
        height = rf"H_{{{i}}}({rho})"
        return rf"{gamma} \, {height} \, {room} + {c} \, {wall}^{{{N}}} > {height} + {ahead}"
    return ""


def theorem1_lines(design: Design, document: Mapping[str, object], index: int) -> tuple[Line, ...]:
    """List the constants of one step at rho = 1, in the order of the chain.

    References
    ----------
    docs/theory.md section 7.
    """
    i, j = index + 1, index
    place = {
        "p": number("omega", "p", j),
        "k": number("gains", j, "k"),
        "D": number("bounds", "eta", j),
        "W": number("bounds", "W", j),
        "A": number("bounds", "A", j),
    }
    held, held_numbers = rf"\delta_{{M,{i}}}", number("theorem1", "delta_M", j)
    ahead, ahead_numbers = "", ""
    if index > 0:
        held += rf" + \delta_{{{index}}}"
        held_numbers += f" + {number('bounds', 'Lambda', index - 1)}"
        ahead = rf" + \left|\dot{{\alpha}}_{{{index}}}\right|"
        ahead_numbers = f" + {number('bounds', 'B', index - 1)}"
    push, push_numbers = f"W_{{{i}}}{ahead}", f"{place['W']}{ahead_numbers}"
    if i < design.spec.order:
        push += f" + s_{{{i + 1}}}"
        push_numbers += f" + {number('bounds', 's', j)}"
    if index > 0 and _is_scheduled(design, index - 1):
        push += rf" + \rho_M \, \frac{{dp_{{{i}}}}}{{d\rho}}"
        push_numbers = ""
    drift = rf"\overline{{f}}_{{{i}}} + \overline{{d}}_{{{i}}}"
    rows = (
        (
            rf"\eta_{{{i}}}",
            ("bounds", "eta", j),
            r"bound on the measurement error $\left|\hat{e}_{i} - e_{i}\right|$",
            held,
            held_numbers,
        ),
        (
            rf"\varepsilon_{{{i}}}",
            ("theorem1", "epsilon", j),
            "room that the tube leaves beside it",
            rf"p_{{{i}}} - \eta_{{{i}}}",
            f"{place['p']} - {place['D']}",
        ),
        (
            f"W_{{{i}}}",
            ("bounds", "W", j),
            r"what pushes $e_{i}$ from outside: drift, disturbance, motion of $r_{i}$",
            rf"{drift} + \sup\left|\dot{{r}}_{{{i}}}\right|",
            "",
        ),
        (
            f"H_{{{i}}}^{{0}}(1)",
            ("theorem1", "H_needed", j),
            "what $H_{i}$ must dominate",
            push,
            push_numbers,
        ),
        (
            rf"A_{{{i}}}",
            ("bounds", "A", j),
            r"bound on the feedback $\left|\varphi_{i}(e_{i})\right|$ in the tube",
            rf"\varphi_{{{i}}}(p_{{{i}}})",
            "",
        ),
        (
            rf"\delta_{{{i}}}",
            ("bounds", "Lambda", j),
            r"how far measurement moves $\varphi_{i}$",
            rf"\gamma_{{{i}}} \, H_{{{i}}}(1) \, \eta_{{{i}}} + c_0",
            rf"{place['k']} \cdot {place['D']} + {number('theorem1', 'c_0')}",
        ),
    )
    return tuple(
        Line(
            symbol=symbol,
            keys=keys,
            meaning=meaning.replace("_{i}", f"_{{{i}}}"),
            definition=definition,
            numbers=with_numbers(displayed(numbers), document) if numbers else "",
        )
        for symbol, keys, meaning, definition, numbers in rows
    )


def _is_scheduled(design: Design, index: int) -> bool:
    gain = design.gains[index]
    return isinstance(gain, Theorem1Gain) and len(gain.H) > 1
