"""What a command says on stdout when it is not asked for JSON."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Mapping


def summary(document: Mapping[str, Any]) -> list[str]:
    """Lay out the result of a command in the few lines that a person wants first.

    Parameters
    ----------
    document : Mapping[str, Any]
        report.json, or the object of ``simulate`` or ``verify``; ``folder`` where written.

    Returns
    -------
    list[str]
        Lines without line ends.

    References
    ----------
    SPEC section 2.
    """
    layouts = {"report": _design_lines, "verification": _verification_lines}
    kind = str(document.get("format", "")).split("/")[1]
    lines = layouts.get(kind, _other_lines)(document)
    if "folder" in document:
        lines.append(f"  report: {document['folder']}/report.html")
    return lines


def _design_lines(document: Mapping[str, Any]) -> list[str]:
    status = document["status"]
    if status != "certified":
        status = f"NOT CERTIFIED ({status})"
    words = ", ".join(f"{key} {document[key]}" for key in ("method", "form", "center"))
    bounds, run = document["bounds"], document["simulation"]
    lines = [
        f"{document['name']}: {status} ({words})",
        f"  peak input |u| <= {_number(bounds['U'])}, slope {_number(bounds['slope'])}",
    ]
    if "nominal" in document:
        parts = document["nominal"]
        feedforward, tube = _number(parts["feedforward"]), _number(parts["tube"])
        duration = _number(parts["transition"])
        lines.append(f"  of it feedforward {feedforward}, tube {tube}; transition {duration} s")
    if "chosen" in document:
        chosen = document["chosen"]
        lines.append(f"  {chosen['objective']} {_number(chosen['value'])}, chosen by the objective")
    columns = tuple(document["gains"][0])
    table = [["state", "p", *columns]]
    for state, width, gains in zip(
        document["states"], document["omega"]["p"], document["gains"], strict=True
    ):
        table.append([state, _number(width), *(_number(gains[column]) for column in columns)])
    widths = [max(len(row[i]) for row in table) for i in range(len(table[0]))]
    for row in table:
        cells = (cell.ljust(width) for cell, width in zip(row, widths, strict=True))
        lines.append("  " + "  ".join(cells).rstrip())
    lines.extend(f"  fails: {failure}" for failure in document.get("failures", ()))
    inside = "inside its bounds" if run["within_bounds"] else "OUT OF ITS BOUNDS"
    lines.append(f"  simulation: {inside}, max |u| = {_number(run['max_abs_u'])}")
    return lines


def _verification_lines(document: Mapping[str, Any]) -> list[str]:
    claims = document["claims"]
    width = max((len(claim["id"]) for claim in claims), default=0)
    lines = [
        f"{claim['verdict']:9} {claim['id']:{width}}  {claim['statement']}" for claim in claims
    ]
    lines += [f"checked   {test}" for test in document["tests"]]
    lines += [f"fails     {failure}" for failure in document["failures"]]
    # What a proof leaves open belongs beside it, every time (docs/theory.md section 6).
    lines += ["assumed, not proved:", *(f"  - {line}" for line in document["assumptions"])]
    return [*lines, f"verdict: {document.get('status', document['verdict'])}"]


def _other_lines(document: Mapping[str, Any]) -> list[str]:
    lines = []
    for key, value in document.items():
        if key in {"format", "exit_code", "folder"}:
            continue
        values = value if isinstance(value, list) else [value]
        # Tables and objects are for --json.
        if all(isinstance(entry, str | int | float) for entry in values):
            lines.append(f"{key}: {', '.join(_number(entry) for entry in values)}")
    return lines


def _number(value: object) -> str:
    if isinstance(value, list):
        return f"[{', '.join(_number(entry) for entry in value)}]"
    return f"{value:.6g}" if isinstance(value, float) else str(value)
