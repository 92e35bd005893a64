"""What the page says in words: promise, status, reference.

A sentence is plain text with ``$LaTeX$`` for formulas and ``#path/in/report.json#`` for numbers;
``prose`` turns it into markup.
"""

from __future__ import annotations

import html
import re
from typing import TYPE_CHECKING

from bfppc_synth.model.certificate import Verdict
from bfppc_synth.model.spec import Anchor, ReferenceKind, RhoKind
from bfppc_synth.report.formulas import expression_latex, inline
from bfppc_synth.report.funnel import funnel_promise
from bfppc_synth.report.nominal import (
    derivatives_sentence,
    nominal_promise,
    transition_sentences,
)
from bfppc_synth.report.numbers import exact, look_up, path_text, shown
from bfppc_synth.report.stages import handover_sentences, reanchors

if TYPE_CHECKING:
    from collections.abc import Mapping

    from bfppc_synth.model.design import Design

_MARKS = re.compile(r"(?:\$([^$]+)\$|#([A-Za-z0-9_/]+)#|`([^`]+)`)([.,;:)]?)")

_STATUS = {
    Verdict.CERTIFIED: "Certified: every inequality below was proved for these gains.",
    Verdict.REFUTED: "NOT CERTIFIED: an inequality or an assumption does not hold.",
    Verdict.UNDECIDED: "NOT CERTIFIED: an inequality could not be decided.",
    Verdict.PRINTED: "NOT CERTIFIED: these are the paper's inequalities as printed, "
    "which do not prove the promise.",
}


def prose(sentence: str, document: Mapping[str, object]) -> str:
    """Turn a sentence into markup.

    Parameters
    ----------
    sentence : str
        Text; ``$LaTeX$``, ``#path/in/report.json#`` and code in backquotes are replaced.
    document : Mapping[str, object]
        report.json.

    Returns
    -------
    str
        HTML; everything else is escaped.

    Raises
    ------
    KeyError, IndexError
        If report.json has no such number.
    """
    parts, end = [], 0
    for match in _MARKS.finditer(sentence):
        parts.append(html.escape(sentence[end : match.start()]))
        latex, path, code, stop = match.groups()
        if latex is not None:
            # A full stop must not start a line of its own.
            formula = inline(latex)
            parts.append(f'<span class="whole">{formula}{stop}</span>' if stop else formula)
        elif path is not None:
            keys = [int(key) if key.isdigit() else key for key in path.split("/")]
            parts.append(number_markup(document, *keys) + stop)
        else:
            parts.append(f"<code>{html.escape(code)}</code>{stop}")
        end = match.end()
    return "".join([*parts, html.escape(sentence[end:])])


def number_markup(document: Mapping[str, object], *keys: str | int) -> str:
    """Write one number of report.json with its path and its full value.

    Raises
    ------
    KeyError, IndexError
        If report.json has no such number.
    """
    value = look_up(document, keys)
    return (
        f'<span class="number" data-json-path="{html.escape(path_text(keys))}" '
        f'data-value="{html.escape(exact(value))}">{html.escape(shown(value))}</span>'
    )


def status_sentence(design: Design) -> str:
    """Say in one sentence what the certificate says."""
    return _STATUS[design.certificate.verdict]


def promise(design: Design) -> tuple[str, ...]:
    """Say what the closed loop keeps, for every plant and start that the file declares.

    Parameters
    ----------
    design : Design
        Of either center.

    Returns
    -------
    tuple[str, ...]
        Sentences for ``prose``: output, decay of the start, input.

    References
    ----------
    docs/theory.md sections 3, 4 and 10.
    """
    lines = _performance_promise(design) if design.nominal is None else nominal_promise()
    return (
        *lines,
        *funnel_promise(design),
        (
            r"Input. $\left|u\right| \le U$ = #bounds/U# at every time; the code clamps there, and "
            "within the assumptions the clamp is never reached."
        ),
    )


def _performance_promise(design: Design) -> tuple[str, ...]:
    spec = design.spec
    state = spec.states[0]
    measured = spec.synthesis.anchor is Anchor.LATCHED and design.conditions.delta[0] > 0.0
    start = "the first measured output" if measured else "the first output"
    center = r"r_1(t) = y_d(t) + \rho_1(t) a"
    output = (
        rf"Output. At every time $t \ge 0$ the output $y$ (state `{state}`) stays within "
        rf"$p_1$ = #omega/p/0# of the known curve ${center}$, where $y_d$ is the reference, "
        rf"$a$ is {start} minus $y_d(0)$ (at most #performance/offset# in magnitude) and $\rho_1$ "
        "falls from one towards its floor."
    )
    lines = [output]
    rho = spec.performance.rho[0]
    if reanchors(design):
        lines = list(handover_sentences())
    elif rho.kind is RhoKind.COSINE:
        lines.append(
            r"Tracking. The start is forgotten when $\rho_1$ reaches zero, at "
            r"$t$ = #performance/rho/0/ends_at# s: from then on "
            r"$\left|y - y_d\right| \le$#performance/final_error#."
        )
    else:
        lines.append(
            r"Tracking. As $\rho_1$ approaches its floor #performance/rho/0/floor# (rate "
            r"#performance/rho/0/rate# per second), $\left|y - y_d\right|$ is bounded by "
            "#performance/final_error# plus a remainder that vanishes."
        )
    return tuple(lines)


def reference_sentence(design: Design) -> str:
    """Say where the reference comes from and what bounds it."""
    reference = design.spec.reference
    bounds = r"$\left|y_d\right| \le$#reference/Y0#, $\left|\dot{y}_d\right| \le$#reference/Y1#"
    if reference.kind is ReferenceKind.RUNTIME or design.plant.reference is None:
        more = derivatives_sentence(design)
        return f"Reference: supplied at run time, {bounds} (assumed).{more and ' ' + more}"
    formula = expression_latex(design.plant.reference)
    if reference.kind is ReferenceKind.DECLARED:
        return f"Reference: $y_d = {formula}$, {bounds} (declared, hence assumed)."
    return f"Reference: $y_d = {formula}$, {bounds}."


def performance_sentences(design: Design) -> tuple[str, ...]:
    """Say which performance function every state has, (52) or (53), or what stands for it."""
    if design.nominal is not None:
        return transition_sentences()
    lines = []
    for index, (state, rho) in enumerate(
        zip(design.spec.states, design.spec.performance.rho, strict=True)
    ):
        i, path = index + 1, f"performance/rho/{index}"
        if rho.kind is RhoKind.COSINE:
            shape = (
                rf"$\rho_{{{i}}}(t) = \frac{{1}}{{2}}\left(1 + \cos\frac{{t}}{{t_s}}\right)$ until "
                rf"it is zero, $t_s$ = #{path}/t_s# s"
            )
        else:
            shape = (
                rf"$\rho_{{{i}}}(t) = (1 - \rho_{{\infty}}) \text{{e}}^{{-\lambda t}} "
                r"+ \rho_{\infty}$, "
                rf"$\lambda$ = #{path}/rate# per second, $\rho_{{\infty}}$ = #{path}/floor#"
            )
        lines.append(
            rf"State `{state}`: {shape}; $\left|\dot{{\rho}}_{{{i}}}\right| \le$"
            f"#{path}/rate_bound#."
        )
    return tuple(lines)
