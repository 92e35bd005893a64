"""What a sweep says: sweep.json, sweep.csv, the table, and the files of its folder."""

from __future__ import annotations

import csv
import io
import json
import math
from typing import TYPE_CHECKING, Any

from bfppc_synth.model.shapes import Shape
from bfppc_synth.model.spec import Objective
from bfppc_synth.sweep.picture import draw_sweep
from bfppc_synth.sweep.records import Status

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from bfppc_synth.model.shapes import Gain
    from bfppc_synth.model.spec import PlantSpec
    from bfppc_synth.sweep.axes import Axis
    from bfppc_synth.sweep.records import Answer, Point

FORMAT = "bfppc-synth/sweep/1"
_MOST_REASON = 76


def sweep_document(
    spec: PlantSpec,
    axes: Sequence[Axis],
    points: Sequence[Point],
    answers: Sequence[Answer],
) -> dict[str, object]:
    """Collect the object of sweep.json.

    Returns
    -------
    dict[str, object]
        ``axes`` with their values; ``points`` in the grid's order, the last axis running fastest.
        A point has ``at``, ``status`` and ``reason`` (null where certified); U, slope, p and gains
        where a design was found, and ``design_of``, the index of the point whose search found it:
        gains found for a stricter point are certified again here where they cost less.
    """
    from importlib.metadata import version

    given = spec.gives("synthesis.objective")
    words = dict(spec.synthesis.objective) if given else {Objective.PEAK_INPUT: 1.0}
    rows = [
        _point(spec, axes, point, answer) for point, answer in zip(points, answers, strict=True)
    ]
    counts = {str(status): sum(row["status"] == status for row in rows) for status in Status}
    return {
        "format": FORMAT,
        "name": spec.name,
        "plant_sha256": spec.sha256,
        "tool": {"version": version("bfppc-synth")},
        "objective": {str(word): weight for word, weight in words.items()},
        "units": dict(spec.units),
        "states": list(spec.states),
        "axes": [
            {
                "path": axis.path,
                "spacing": str(axis.spacing),
                "values": list(axis.values),
                "texts": list(axis.texts),
            }
            for axis in axes
        ],
        "counts": counts,
        "points": rows,
    }


def _point(spec: PlantSpec, axes: Sequence[Axis], point: Point, answer: Answer) -> dict[str, Any]:
    at = {
        axis.path: axis.values[axis.texts.index(text)]
        for axis, text in zip(axes, point.at, strict=True)
    }
    row: dict[str, Any] = {"index": point.index, "at": at, "status": str(answer.status)}
    row["reason"] = answer.reason or None
    found = answer.found if answer.status in (Status.CERTIFIED, Status.UNDECIDED) else None
    if found is None or not math.isfinite(found.U):
        return row
    row |= {"U": found.U, "slope": found.slope, "p": list(found.half_widths)}
    row["gains"] = [
        {"state": state} | _gain(gain) for state, gain in zip(spec.states, found.gains, strict=True)
    ]
    row["design_of"] = found.origin
    if found.transition is not None:
        row["transition"] = found.transition
    if found.c_0 is not None:
        row["c_0"] = found.c_0
    return row


def _gain(gain: Gain) -> dict[str, Any]:
    if isinstance(gain, Shape):
        return {"k": gain.k, "M": gain.M, "epsilon": gain.epsilon, "c": gain.c, "N": gain.N}
    return {
        "gamma": gain.gamma,
        "H": list(gain.H),
        "H_star": gain.H_star,
        "c": gain.c,
        "N": gain.N,
    }


def sweep_csv(document: Mapping[str, Any]) -> str:
    """Print one line per point: the swept numbers, status, U, slope, p, reason."""
    paths = [axis["path"] for axis in document["axes"]]
    widths = [f"p.{state}" for state in document["states"]]
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([*paths, "status", "U", "slope", *widths, "design_of", "reason"])
    for row in document["points"]:
        found = "U" in row
        numbers = [row["U"], row["slope"], *row["p"], row["design_of"]] if found else []
        cells = [repr(value) for value in numbers] or [""] * (3 + len(widths))
        values = [repr(row["at"][path]) for path in paths]
        writer.writerow([*values, row["status"], *cells, row["reason"] or ""])
    return text.getvalue()


def sweep_lines(document: Mapping[str, Any]) -> tuple[str, ...]:
    """Lay the points out as a table."""
    paths = [axis["path"] for axis in document["axes"]]
    counts, points = document["counts"], document["points"]
    table = [[*paths, "U", "slope", *(f"p.{state}" for state in document["states"][1:])]]
    remarks = [""]
    for row in points:
        numbers = [row["U"], row["slope"], *row["p"][1:]] if "U" in row else []
        values = [row["at"][path] for path in paths]
        cells = [f"{value:.4g}" for value in [*values, *numbers]]
        table.append(cells + [""] * (len(table[0]) - len(cells)))
        remarks.append(_remark(row, points, paths))
    widths = [max(len(row[i]) for row in table) for i in range(len(table[0]))]
    head = f"{document['name']}: {counts['certified']} of {len(points)} points certified"
    lines = [f"{head} (objective {', '.join(document['objective'])})"]
    for cells, remark in zip(table, remarks, strict=True):
        padded = "  ".join(cell.rjust(width) for cell, width in zip(cells, widths, strict=True))
        lines.append(f"  {padded}  {remark}".rstrip())
    return tuple(lines)


def _remark(row: Mapping[str, Any], points: Sequence[Mapping[str, Any]], paths: list[str]) -> str:
    if row["status"] != "certified":
        reason = row["reason"] or ""
        said = reason if len(reason) <= _MOST_REASON else f"{reason[: _MOST_REASON - 3]}..."
        return f"{row['status']}: {said}"
    if row["design_of"] == row["index"]:
        return ""
    origin = points[row["design_of"]]["at"]
    return f"the gains of {', '.join(f'{origin[path]:.4g}' for path in paths)}"


def sweep_files(
    document: Mapping[str, Any],
    spec: PlantSpec,
    points: Iterable[Point],
    answers: Iterable[Answer],
) -> dict[str, bytes]:
    """Lay out the files of a sweep's folder: path -> bytes.

    Returns
    -------
    dict[str, bytes]
        sweep.json, sweep.csv, sweep.svg, plant.yaml; of every point its plant file and, where it
        is certified, the certificate: points/007.yaml, points/007.certificate.json.
    """
    from bfppc_synth.spec.canonical import plant_json
    from bfppc_synth.spec.load import load_text

    texts = {
        "sweep.json": json.dumps(document, indent=1, allow_nan=False, ensure_ascii=False) + "\n",
        "sweep.csv": sweep_csv(document),
        "sweep.svg": draw_sweep(document),
    }
    for point, answer in zip(points, answers, strict=True):
        stem = f"points/{point.index:03d}"
        texts[f"{stem}.yaml"] = point.source
        if answer.status is Status.CERTIFIED:
            texts[f"{stem}.plant.json"] = plant_json(load_text(point.source, point.path))
            texts[f"{stem}.certificate.json"] = answer.certificate
    files = {path: text.encode() for path, text in texts.items()}
    return {**files, "plant.yaml": spec.source_bytes}
