"""What the page says in words: promise, status, requirements.

A sentence is plain text with ``$LaTeX$`` for formulas and ``#path/in/report.json#`` for numbers;
``prose`` turns it into markup.
"""

from __future__ import annotations

import html
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

from bfppc_synth.model.certificate import Verdict
from bfppc_synth.model.spec import Anchor, QuantizerKind, ReferenceKind, RhoKind
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


@dataclass(frozen=True, slots=True, kw_only=True)
class Requirement:
    """A row of the table of requirements: three sentences, and the unit as the user wrote it."""

    what: str
    value: str
    unit: str
    meaning: str


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


def requirements(design: Design) -> tuple[Requirement, ...]:
    """List what the design asks of actuator, sensors and computer."""
    spec = design.spec
    limit = "no limit is declared in the plant file"
    if spec.actuator.limit is not None:
        limit = "the plant file allows #actuator/limit#"
    unit = dict(spec.units).get("u", "")
    rows = [
        Requirement(
            what="Actuator: peak input $U$",
            value="#bounds/U#",
            unit=unit,
            meaning=f"largest magnitude that the law can ask for; {limit}",
        ),
        Requirement(
            what="Actuator: error",
            value="#actuator/error#",
            unit=unit,
            meaning=r"largest difference $\delta_u$ between commanded and applied input that is "
            "covered",
        ),
        Requirement(
            what="Slope of the law",
            value="#bounds/slope#",
            unit="",
            meaning="largest derivative of the command by the last error: it multiplies what "
            "noise the last error carries",
        ),
    ]
    for index, (state, quantizer) in enumerate(
        zip(spec.states, spec.measurement.quantizers, strict=True)
    ):
        kind = "exact measurement was declared"
        if design.conditions.delta[index] > 0.0:
            kind = "quantizer and noise together"
        if quantizer.kind is not QuantizerKind.NONE:
            kind += f" ({quantizer.kind} quantizer)"
        rows.append(
            Requirement(
                what=f"Sensor of `{state}`: error $\\delta_{{0,{index + 1}}}$",
                value=f"#measurement/delta/{index}#",
                unit=dict(spec.units).get(state, ""),
                meaning=f"largest measurement error that is covered; {kind}",
            )
        )
        if quantizer.step is not None:
            rows.append(_converter(state, index))
    return (*rows, *_timing(design))


def _converter(state: str, index: int) -> Requirement:
    path = f"measurement/adc/{index}"
    return Requirement(
        what=f"Converter of `{state}`",
        value=f"#{path}/bits#",
        unit="bits",
        meaning=rf"for cells of width #{path}/step# over the range $\pm X_{{{index + 1}}}$ = "
        f"#{path}/range#, which the state never leaves; one level more where 0 is a level",
    )


def _timing(design: Design) -> tuple[Requirement, ...]:
    numbers = "binary32" if design.arithmetic.single else "binary64"
    continuous = "0 means that the certificate is about a continuous law"
    period = continuous if design.conditions.hold == 0.0 else "jitter and lost samples included"
    return (
        Requirement(
            what="Computer: sample period $h$",
            value="#sampling/period#",
            unit="s",
            meaning=f"longest time between two samples that is covered; {period}",
        ),
        Requirement(
            what=r"Computer: delay $\tau$",
            value="#sampling/delay#",
            unit="s",
            meaning="longest time from a sample to its command that is covered",
        ),
        Requirement(
            what="Computer: largest certified period",
            value="#sampling/largest_certified_period#",
            unit="s",
            meaning="with these gains the inequalities still hold up to this period "
            "(a lower bound; 0 where none is certified)",
        ),
        Requirement(
            what="Computer: longest run",
            value="#sampling/longest_run#",
            unit="s",
            meaning=f"after this time the clock is too coarse in {numbers} and the code holds its "
            "command (status BAD_TIME): call `reset` before",
        ),
    )


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
                rf"$\rho_{{{i}}}(t) = (1 - f) e^{{-\lambda t}} + f$, $\lambda$ = #{path}/rate# "
                rf"per second, $f$ = #{path}/floor#"
            )
        lines.append(
            rf"State `{state}`: {shape}; $\left|\dot{{\rho}}_{{{i}}}\right| \le$"
            f"#{path}/rate_bound#."
        )
    return tuple(lines)
