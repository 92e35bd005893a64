"""campaign.json and its picture: what all runs came to."""

from __future__ import annotations

import io
import math
from typing import TYPE_CHECKING, Any

from bfppc_synth.campaign.tally import BINS, failure_bound
from bfppc_synth.resources import template_environment

if TYPE_CHECKING:
    from bfppc_synth.campaign.material import Material
    from bfppc_synth.campaign.store import Settings
    from bfppc_synth.campaign.tally import Tally

CONFIDENCES = (0.95, 0.99)

#: The picture [px]: margin, axis, title, one histogram, its tallest bar.
_LEFT, _INNER, _HEAD, _PANEL, _BAR = 20.0, 600.0, 42.0, 96.0, 62.0


def quantities(material: Material) -> tuple[str, ...]:
    """Name what is compared with its bound: errors, command, funnel."""
    stages = range(1, len(material.widths) + 1)
    states = tuple(
        f"e[{state}]" if len(stages) == 1 else f"e[{state}], stage {stage}"
        for stage in stages
        for state in material.choices.spec.states
    )
    funnel = ("funnel",) if material.design.plant.funnel is not None else ()
    return (*states, "u", *funnel)


def lay_out(material: Material, settings: Settings, tally: Tally) -> dict[str, Any]:
    """Make the object of campaign.json: equal campaigns give equal objects.

    Parameters
    ----------
    material : Material
        The design.
    settings : Settings
        Seed, runs, horizon.
    tally : Tally
        All runs.

    Returns
    -------
    dict
        No word of who made the runs, of threads or time.
    """
    names = quantities(material)
    widths = [width for stage in material.widths for width in stage]
    bounds = [*widths, material.peak, 1.0][: len(names)]
    worst = [
        {
            "quantity": name,
            "bound": bound,
            "ratio": ratio,
            "margin": 1.0 - ratio,
            "run": run,
        }
        for name, bound, (ratio, run) in zip(names, bounds, tally.worst, strict=True)
    ]
    return {
        "format": "bfppc-synth/campaign/1",
        "name": material.choices.spec.name,
        "covered": material.covered,
        "seed": settings.seed,
        "horizon": settings.horizon,
        "runs": tally.runs,
        "outside": tally.outside,
        "left": tally.left,
        "worst": worst,
        "failure_probability": {
            "method": "Clopper-Pearson, one-sided upper bound, under the drawn distribution",
            **{
                f"{confidence:g}": failure_bound(tally.runs, tally.outside, confidence=confidence)
                for confidence in CONFIDENCES
            },
        },
        "adversaries": {
            kind: {"runs": runs, "outside": left, "ratio": max(ratio, 0.0), "run": run}
            for kind, (runs, left, ratio, run) in tally.adversaries.items()
        },
        "histograms": {
            "edges": [index / BINS for index in range(BINS + 1)],
            **dict(zip(names, tally.bins, strict=True)),
        },
        "plant_sha256": settings.plant_sha256,
        "controller_sha256": settings.controller_sha256,
        "tool": {"version": material.version},
    }


def draw_histograms(document: dict[str, Any]) -> bytes:
    """Draw the histograms of campaign.json as SVG; equal objects give equal bytes.

    A bar's height is the logarithm of its count: the few runs that came near are what matters.
    """
    histograms = dict(document["histograms"])
    del histograms["edges"]
    most = math.log1p(max(max(counts) for counts in histograms.values()))
    bar = _INNER / BINS
    panels = []
    for index, (name, counts) in enumerate(histograms.items()):
        top = _HEAD + index * _PANEL
        base = top + _PANEL - 20.0
        bars = [
            {
                "x": f"{_LEFT + bar * place:.1f}",
                "y": f"{base - _BAR * math.log1p(count) / most:.1f}",
                "height": f"{_BAR * math.log1p(count) / most:.1f}",
            }
            for place, count in enumerate(counts)
            if count
        ]
        note = f"most {max(counts)} runs a bar, {counts[-1]} at the bound or beyond"
        panels.append(
            {"name": name, "note": note, "bars": bars, "top": f"{top:.1f}", "base": f"{base:.1f}"}
        )
    below = _HEAD + len(panels) * _PANEL
    ticks = [
        {"x": f"{_LEFT + _INNER * k / 5:.1f}", "y": f"{below:.1f}", "label": f"{k / 5:g}"}
        for k in range(6)
    ]
    text = (
        template_environment()
        .get_template("simulation/histogram.svg.jinja")
        .render(
            title=f"{document['name']}: {document['runs']} runs, evidence and no proof",
            caption="largest value of a run, as a share of its certified bound",
            width=f"{_LEFT + _INNER + 40.0:.0f}",
            height=f"{below + 30.0:.0f}",
            left=f"{_LEFT:.1f}",
            edge=f"{_LEFT + _INNER:.1f}",
            foot=f"{below + 18.0:.1f}",
            bar=f"{bar - 1.0:.1f}",
            panels=panels,
            ticks=ticks,
        )
    )
    return text.encode()


def picture(figure: Any) -> bytes:
    """Write a figure as SVG without a date."""
    import matplotlib as mpl

    stream = io.BytesIO()
    with mpl.rc_context({"svg.hashsalt": "bfppc-synth", "svg.fonttype": "path"}):
        figure.savefig(stream, format="svg", metadata={"Date": None})
    return stream.getvalue()
