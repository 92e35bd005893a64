"""The tables and the picture of ``compare``; nothing is computed here."""

from __future__ import annotations

import csv
import io
from typing import TYPE_CHECKING, Any

import numpy as np

from bfppc_synth.report.plots import plot
from bfppc_synth.resources import template_environment

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

COLUMNS = (
    "method",
    "certified",
    "runs",
    "inside",
    "share_inside",
    "nominal_inside",
    "nan",
    "diverged",
    "worst_share_of_envelope",
    "peak_u",
    "rms_u",
    "level_changes_per_second",
    "operations",
)
_HEADINGS = ("inside", "NaN", "diverged", "peak |u|", "rms u", "levels/s", "operations")

#: Pixels between the lines of the legend.
_LINE = 18.0


def comparison_csv(document: Mapping[str, Any]) -> str:
    """Write one line a method; a method that cannot be used has empty cells."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(COLUMNS)
    for row in document["methods"]:
        writer.writerow(["" if row[key] is None else row[key] for key in COLUMNS])
    return out.getvalue()


def comparison_lines(document: Mapping[str, Any]) -> list[str]:
    """Lay the result out for a terminal."""
    sampling = document["sampling"]
    head = (
        f"{document['name']}: every method sampled every {sampling['period']:g} s"
        f" ({sampling['source']}) for {document['horizon']:g} s, {document['runs']} runs,"
        f" budget {document['budget']}, seed {document['seed']}"
    )
    table = [["method", *_HEADINGS]]
    notes = []
    for row in document["methods"]:
        if row["missing"]:
            notes.append(f"  {row['title']}: not applicable: {row['missing']}")
            continue
        values = [
            f"{row['inside']}/{row['runs']}",
            row["nan"],
            row["diverged"],
            _number(row["peak_u"]),
            _number(row["rms_u"]),
            _number(row["level_changes_per_second"]),
            row["operations"],
        ]
        table.append([row["title"], *map(str, values)])
        if row["gains"]:
            gains = ", ".join(f"{name} {value:.4g}" for name, value in row["gains"].items())
            notes.append(f"  best gains of {row['title']}: {gains}")
    widths = [max(len(line[j]) for line in table) for j in range(len(table[0]))]
    lines = [head]
    for line in table:
        cells = (cell.ljust(width) for cell, width in zip(line, widths, strict=True))
        lines.append("  " + "  ".join(cells).rstrip())
    return lines + notes


def comparison_svg(
    document: Mapping[str, Any],
    t: NDArray[np.float64],
    edge: NDArray[np.float64],
    curves: Sequence[tuple[str, NDArray[np.float64]]],
) -> str:
    """Draw y - y_d of the nominal run under every method in the envelope.

    Parameters
    ----------
    document : mapping
        Its name is the title.
    t, edge : arrays (N,)
        Time [s] and the bound on abs(y - y_d).
    curves : sequence
        (title, array (N,)); NaN where a run has ended, which is drawn as leaving the plot.

    Returns
    -------
    str
        The same text for the same numbers.
    """
    reach = 2.0 * float(edge.max())
    series, legend = [], []
    for j, (title, values) in enumerate(curves):
        gone = np.flatnonzero(~np.isfinite(values))
        ends = f" (ends at {t[gone[0]]:.3g} s)" if len(gone) else ""
        drawn = np.clip(np.where(np.isfinite(values), values, reach), -reach, reach)
        series.append((f"curve-{j}", title, drawn))
        legend.append((f"{title}{ends}", f"curve-{j}"))
    picture = plot(
        key="compare",
        title=f"Tracking error of the nominal run of {document['name']}",
        description="The output minus the reference under every method, and the envelope.",
        caption="",
        y_label="y - y_d, the envelope shaded",
        t=t,
        series=tuple(series),
        band=(-edge, edge, "envelope"),
    )
    below = float(picture.height) + 10.0
    rows = [
        {"label": label, "style": style, "height": f"{below + _LINE * j:g}"}
        for j, (label, style) in enumerate(legend)
    ]
    template = template_environment().get_template("compare/compare.svg.jinja")
    return template.render(plot=picture, legend=rows, height=f"{below + _LINE * len(rows):g}")


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.3g}"
