"""sweep.svg: the certified peak input over one path, or as a map over two."""

from __future__ import annotations

import io
import math
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Mapping

_LINE, _CROSS = "#08519c", "#a63603"
# A curve that spans more than this is drawn over the logarithm.
_DECADE = 10.0


def draw_sweep(document: Mapping[str, Any]) -> str:
    """Draw the points of a sweep; the same document gives the same text.

    Parameters
    ----------
    document : Mapping[str, Any]
        The object of sweep.json.

    Returns
    -------
    str
        An SVG file; points without a design are crosses at the foot of the picture.
    """
    import matplotlib as mpl
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure

    with mpl.rc_context({"svg.hashsalt": "bfppc-synth", "svg.fonttype": "none"}):
        figure = Figure(figsize=(7.0, 4.3), layout="constrained")
        FigureCanvasSVG(figure)
        axes = figure.add_subplot()
        (_curve if len(document["axes"]) == 1 else _surface)(figure, axes, document)
        axes.set_title(_title(document), fontsize=10)
        text = io.StringIO()
        figure.savefig(text, format="svg", metadata={"Date": None, "Creator": None})
    return text.getvalue()


def _title(document: Mapping[str, Any]) -> str:
    title, points = f"{document['name']}: certified designs", document["points"]
    missing = sum(point["status"] != "certified" for point in points)
    return f"{title}\nnone at {missing} of {len(points)} points (crosses)" if missing else title


def _named(document: Mapping[str, Any]) -> str:
    unit = document["units"].get("u")
    return f"certified peak input U [{unit}]" if unit else "certified peak input U"


def _curve(figure: Any, axes: Any, document: Mapping[str, Any]) -> None:
    del figure
    (axis,) = document["axes"]
    path = axis["path"]
    points = document["points"]
    known = [(row["at"][path], row["U"]) for row in points if row["status"] == "certified"]
    open_at = [row["at"][path] for row in points if row["status"] != "certified"]
    # A gap in the curve is a gap in the line.
    heights = [row["U"] if row["status"] == "certified" else math.nan for row in points]
    axes.plot(axis["values"], heights, "o-", color=_LINE, markersize=4, linewidth=1.2)
    if axis["spacing"] == "log":
        axes.set_xscale("log")
    peaks = [peak for _, peak in known if peak > 0.0]
    if peaks and max(peaks) > _DECADE * min(peaks):
        axes.set_yscale("log")
    if open_at:
        foot = axes.get_xaxis_transform()
        axes.plot(open_at, [0.02] * len(open_at), "x", color=_CROSS, transform=foot)
    axes.set_xlabel(path)
    axes.set_ylabel(_named(document))
    axes.grid(visible=True, which="both", linewidth=0.3)


def _surface(figure: Any, axes: Any, document: Mapping[str, Any]) -> None:
    from matplotlib.colors import LogNorm

    first, second = document["axes"]
    points, count = document["points"], len(second["values"])
    known = [row["U"] for row in points if row["status"] == "certified" and row["U"] > 0.0]
    rows = [points[k : k + count] for k in range(0, len(points), count)]
    heights = [
        [row["U"] if row["status"] == "certified" else math.nan for row in line] for line in rows
    ]
    if known:
        wide = max(known) > _DECADE * min(known)
        drawn = axes.pcolormesh(
            second["values"],
            first["values"],
            heights,
            shading="nearest",
            norm=LogNorm(min(known), max(known)) if wide else None,
        )
        figure.colorbar(drawn, ax=axes, label=_named(document))
    open_at = [row["at"] for row in points if row["status"] != "certified"]
    crosses = [[at[axis["path"]] for at in open_at] for axis in (second, first)]
    axes.plot(*crosses, "x", color=_CROSS)
    for axis, scale, label in (
        (second, axes.set_xscale, axes.set_xlabel),
        (first, axes.set_yscale, axes.set_ylabel),
    ):
        label(axis["path"])
        if axis["spacing"] == "log":
            scale("log")
