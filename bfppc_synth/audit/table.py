"""An audit as text of at most 100 columns."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING

from bfppc_synth.audit.document import audit_gain
from bfppc_synth.audit.records import Answer, Origin, Standing
from bfppc_synth.gains.rounding import to_digits

if TYPE_CHECKING:
    from bfppc_synth.audit.records import (
        Assumption,
        Audit,
        Escape,
        FormReport,
        Remedy,
        Row,
        RunReport,
        Side,
    )
    from bfppc_synth.model.spec import PlantSpec

WIDTH = 100
_NAME = 22
_COLUMN = 38
_INNER = " " * 6
_VERDICT = {True: "holds", False: "FAILS"}
_STANDING = {Standing.FAILS: "FAILS", Standing.UNDECIDED: "undecided"}
_ANSWERS = {
    Answer.PROVED: "PROVED",
    Answer.HELD: "NOT PROVED BUT HELD IN SIMULATION",
    Answer.BROKEN: "BROKEN",
    Answer.NOT_PROVED: "NOT PROVED, and nothing could be simulated",
}


def audit_lines(audit: Audit) -> tuple[str, ...]:
    """Write an audit for a person.

    Parameters
    ----------
    audit : Audit
        From ``audit_plant``.

    Returns
    -------
    tuple[str, ...]
        Lines without line ends, none longer than 100 columns.
    """
    spec = audit.spec
    words = f"method {spec.synthesis.method}, form {spec.synthesis.form}"
    lines = [f"{spec.name}: {_ANSWERS[audit.answer]} ({words})", *_candidate(audit), ""]
    lines += [_cells("inequality", "printed form", "sound form"), "-" * WIDTH]
    for row in audit.rows:
        lines += _row(audit, row)
    for name, form in (("printed", audit.printed), ("sound", audit.sound)):
        if form is not None:
            lines += _form(name, form)
    lines += ["", "assumptions"]
    for entry in audit.assumptions:
        lines += _assumption(spec, entry)
    lines += ["", *_proof(audit.sound), ""]
    for run in audit.runs:
        lines += _run(spec, run, _ANSWERS[run.answer(audit.sound.certificate)])
    lines += [line for note in audit.notes for line in _wrapped(f"note: {note}", "")]
    return (*lines, *_verdict(audit))


def _verdict(audit: Audit) -> list[str]:
    """Answer; a user who gave half of the gains must not take it for an answer about those."""
    text = f"verdict: {_ANSWERS[audit.answer]}"
    if audit.completion.origin is Origin.SOLVED:
        text += ", for what the file fixes together with what was solved for"
    return _wrapped(text, "")


def _candidate(audit: Audit) -> list[str]:
    candidate = audit.completion.candidate
    out = []
    for state, gain, p in zip(
        audit.spec.states, candidate.gains, candidate.half_widths, strict=True
    ):
        cells = [f"{name} {_show(value)}" for name, value in audit_gain(gain).items()]
        out += _wrapped(f"{state}: p {_number(p)}, {', '.join(cells)}", "  ")
    if candidate.c_0 is not None:
        out.append(f"  c_0 {_number(candidate.c_0)}")
    return out


def _row(audit: Audit, row: Row) -> list[str]:
    first, *others = row.id.split(" / ")
    name = f"{first} {row.equation.partition(',')[0]}"
    cells = [_side(row.printed), _side(row.sound)]
    lines = [_cells(name, *cells)]
    if len(name) > _NAME:
        lines = [name, _cells("", *cells)]
    lines += [f"/ {other}" for other in others]
    lines += _remedies(audit, row)
    lines += [line for note in row.notes for line in _wrapped(note, _INNER)]
    return lines


def _side(side: Side | None) -> str:
    if side is None:
        return "-"
    # Sides that are close are told apart by their digits.
    digits = next((d for d in (6, 8) if f"{side.lhs:.{d}g}" != f"{side.rhs:.{d}g}"), 6)
    both = f"{side.lhs:.{digits}g} {side.relation} {side.rhs:.{digits}g}"
    return f"{both:<27} {_VERDICT[side.holds]}"


def _cells(name: str, printed: str, sound: str) -> str:
    return f"{name:<{_NAME}} {printed:<{_COLUMN}} {sound}".rstrip()


def _remedies(audit: Audit, row: Row) -> list[str]:
    """Say what would satisfy it, and where that number stands; one line a number."""
    told: dict[str, list[str]] = {}
    for form, side in (("printed", row.printed), ("sound", row.sound)):
        if side is None:
            continue
        for remedy in side.remedies:
            place = audit.spec.place(remedy.path)
            what = f"{place.line}:{place.column} {remedy.symbol} = {_exact(remedy.have)}"
            if remedy.path in audit.completion.filled:
                what += f" ({audit.completion.origin})"
            told.setdefault(what, []).append(f"{form} {_remedy(remedy, _VERDICT[side.holds])}")
    if not told:
        place = audit.spec.place(row.path)
        return _wrapped(f"{place.line}:{place.column} {row.path}", _INNER)
    return [
        line
        for what, needs in told.items()
        for line in _wrapped(f"{what}: {'; '.join(needs)}", _INNER)
    ]


def _remedy(remedy: Remedy, verdict: str) -> str:
    if remedy.need is None:
        return "is met by no value of it alone"
    if verdict == _VERDICT[False]:
        upward = 1 if remedy.need > remedy.have else -1
        return f"needs {_number(to_digits(remedy.need, 4, upward=upward))}"
    return f"needs {_exact(remedy.need)}" if remedy.need else "any value does"


def _form(name: str, form: FormReport) -> list[str]:
    bounds = form.bounds
    if bounds is None:
        return _wrapped(f"{name} form: {'; '.join(form.failures)}", "")
    loads = ", ".join(f"F_{i}* = {_exact(F)}" for i, F in enumerate(bounds.F_star, start=1))
    return _wrapped(f"{name} form: {loads}; |u| <= U = {_number(bounds.U)}", "")


def _assumption(spec: PlantSpec, entry: Assumption) -> list[str]:
    place = spec.place(entry.path)
    standing = _STANDING.get(entry.standing, str(entry.standing))
    text = f"{entry.id}: {entry.statement}: {standing} ({entry.detail})"
    return _wrapped(f"{place.line}:{place.column} {text}", "  ")


def _proof(form: FormReport) -> list[str]:
    certificate = form.certificate
    if certificate is not None and certificate.verdict == "certified":
        lines = ["proof: PROVED by the separate checker, sound form; assumed, not proved:"]
        return [
            *lines,
            *(line for entry in certificate.assumptions for line in _wrapped(entry, "  - ")),
        ]
    lines = ["proof: NOT PROVED"]
    return [*lines, *(line for text in form.failures for line in _wrapped(text, "  "))]


def _run(spec: PlantSpec, run: RunReport, verdict: str) -> list[str]:
    start = ", ".join(f"{n}={_number(x)}" for n, x in zip(spec.states, run.start, strict=True))
    kind = "" if run.declared else " (not a start that the file declares)"
    lines = _wrapped(f"from {start}{kind}, {_number(run.horizon)} s: {verdict}", "")
    if run.escape is not None:
        lines += _wrapped(_escape(run.escape), "  ")
    if run.diverged:
        lines.append("  the run diverged before its horizon")
    rows = [(f"stage {s.stage}: ", s.max_abs_e, s.half_widths) for s in run.stages]
    for label, reached, widths in rows or [("", run.max_abs_e, run.half_widths)]:
        errors = ", ".join(
            f"max |e_{i}| {_number(e)} of {_number(p)}"
            for i, (e, p) in enumerate(zip(reached, widths, strict=True), start=1)
        )
        lines += _wrapped(f"{label}{errors}", "  ")
    return [*lines, f"  max |u| {_number(run.max_abs_u)} of {_number(run.peak_input)}"]


def _escape(escape: Escape) -> str:
    what = f"|e_{escape.error}|" if escape.error else "|u|"
    when = "between two rows" if escape.time is None else f"at t = {_number(escape.time)} s"
    passes = "passes"
    if escape.jump:
        passes, when = "jumps past", f"{when}, at the switch into stage {escape.stage},"
    elif escape.stage is not None:
        when += f", in stage {escape.stage},"
    ratio = escape.reached / escape.bound
    return (
        f"{what} {passes} {_number(escape.bound)} {when} and reaches {_number(escape.reached)},"
        f" {ratio:.4g} times the bound"
    )


def _wrapped(text: str, indent: str) -> list[str]:
    blank = " " * (len(indent) + 2)
    return [
        line
        for part in text.splitlines() or [""]
        for line in textwrap.wrap(
            part,
            WIDTH,
            initial_indent=indent,
            subsequent_indent=blank,
            break_on_hyphens=False,
        )
    ]


def _show(value: object) -> str:
    if isinstance(value, list):
        return f"[{', '.join(map(_show, value))}]"
    return _exact(value) if isinstance(value, float) else str(value)


def _number(value: float) -> str:
    return f"{value:.6g}" if abs(value) < 1e300 else "any"


def _exact(value: float) -> str:
    return f"{value:.7g}"
