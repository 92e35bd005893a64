"""campaign.json and its picture: what all runs came to."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Any

from bfppc_synth.campaign.tally import BINS, failure_bound

if TYPE_CHECKING:
    from bfppc_synth.campaign.material import Material
    from bfppc_synth.campaign.store import Settings
    from bfppc_synth.campaign.tally import Tally

CONFIDENCES = (0.95, 0.99)


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
    """Draw the histograms of campaign.json as SVG; equal objects give equal bytes."""
    import matplotlib as mpl
    from matplotlib.figure import Figure

    histograms = dict(document["histograms"])
    edges = histograms.pop("edges")
    with mpl.rc_context({"svg.hashsalt": "bfppc-synth", "svg.fonttype": "path"}):
        figure = Figure(figsize=(7.0, 1.9 * len(histograms)), layout="constrained")
        axes = figure.subplots(len(histograms), 1, sharex=True, squeeze=False)
        for row, (name, counts) in zip(axes[:, 0], histograms.items(), strict=True):
            row.bar(edges, counts, width=1.0 / BINS, align="edge", color="#3b6ea5")
            row.axvline(1.0, color="#a33", linewidth=1.0)
            row.set_yscale("symlog", linthresh=1.0)
            row.set_ylim(bottom=0.0)
            row.set_ylabel(f"runs, {name}")
        axes[-1, 0].set_xlabel("largest value of the run, as a share of its certified bound")
        axes[0, 0].set_title(f"{document['name']}: {document['runs']} runs, none of them a proof")
        return picture(figure)


def picture(figure: Any) -> bytes:
    """Write a figure as SVG without a date."""
    import matplotlib as mpl

    stream = io.BytesIO()
    with mpl.rc_context({"svg.hashsalt": "bfppc-synth", "svg.fonttype": "path"}):
        figure.savefig(stream, format="svg", metadata={"Date": None})
    return stream.getvalue()
