"""Draw README's picture from generated/paper_example_2: ``make figures``."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import matplotlib as mpl

ROOT = Path(__file__).resolve().parents[1]
SOURCE = ROOT / "generated" / "paper_example_2"
TARGET = ROOT / "docs" / "picture.svg"


def main() -> None:
    """Write docs/picture.svg; the same numbers give the same bytes."""
    mpl.use("svg")
    mpl.rcParams["svg.hashsalt"] = "bfppc-synth"
    from matplotlib import pyplot as plt

    report = json.loads((SOURCE / "report.json").read_text(encoding="utf-8"))
    with (SOURCE / "trajectory.csv").open(encoding="utf-8") as file:
        rows = [{key: float(text) for key, text in row.items()} for row in csv.DictReader(file)]
    # A quarter of the rows draws the same curve in a quarter of the bytes.
    rows = rows[:8] + rows[8::4]
    width = report["omega"]["p"][0]
    t = [row["t"] for row in rows]
    # e_1 = x_1 - r_1, so the proved tube is r_1 +- p_1.
    center = [row["x1"] - row["e1"] for row in rows]
    figure, (top, bottom) = plt.subplots(
        2, 1, sharex=True, figsize=(8.0, 4.4), height_ratios=(2, 1), layout="constrained"
    )
    top.fill_between(
        t,
        [value - width for value in center],
        [value + width for value in center],
        color="#9ecae1",
        label=f"proved tube, \u00b1{width:g}",
    )
    top.plot(t, [row["x1"] for row in rows], color="#08519c", label="output, simulated")
    top.plot(t, [row["y_d"] for row in rows], "--", color="#444444", label="reference")
    top.set_ylabel("y")
    top.legend(loc="lower left", frameon=False)
    bottom.plot(t, [row["u"] for row in rows], color="#a63603")
    bottom.set_ylabel("u")
    bottom.set_xlabel("t [s]")
    figure.savefig(TARGET, metadata={"Date": None, "Creator": None})


if __name__ == "__main__":
    main()
