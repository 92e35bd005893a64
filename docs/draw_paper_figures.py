"""Draw the paper's Figs. 1-8 from generated controllers into docs/figures: ``make figures``.

Every panel is a run of a controller.py that was generated into build/figures: the paper's printed
gains, never certified, beside designs that are.
"""

from __future__ import annotations

import itertools
import math
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np
from paper_runs import case, example

from bfppc_synth.simulation.quantizers import Uniform

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray
    from paper_runs import Case

    Array = NDArray[np.float64]

FIGURES = Path(__file__).resolve().parent / "figures"

# Extremes of this many pieces of a run are drawn: a chatter keeps its width in a small file.
PIECES = 110
BAND, CURVE, SECOND, INPUT, LIMIT = "#c6dbef", "#08519c", "#d94801", "#a63603", "#cb181d"
# What a figure of Example 1, of Example 2, and of the moment of a switch shows [s].
HORIZON_1, HORIZON_2, SWITCH, SWITCH_STEP = 4.0, 7.0, 0.03, 1e-5


def thin(t: Array, values: Array) -> tuple[Array, Array]:
    """Keep the ends and the extremes of every piece, in their order."""
    edges = np.linspace(0, len(t), PIECES + 1).astype(int)
    kept = {0, len(t) - 1}
    for begin, end in itertools.pairwise(edges):
        if end > begin:
            piece = values[begin:end]
            kept |= {begin + int(piece.argmin()), begin + int(piece.argmax())}
    rows = sorted(kept)
    return t[rows], values[rows]


def curve(axes: Axes, t: Array, values: Array, color: str, label: str, **style: Any) -> None:
    """Draw one signal."""
    axes.plot(*thin(t, values), color=color, label=label, **style)


def band(axes: Axes, t: Array, middle: Array, width: Array, label: str) -> None:
    """Draw middle +- width."""
    rows = np.unique(np.linspace(0, len(t) - 1, PIECES).astype(int))
    # The rows beside a jump of the tube belong to it.
    jumps = np.flatnonzero(np.diff(width))
    rows = np.unique(np.concatenate([rows, jumps, jumps + 1]))
    low, high = (middle - width)[rows], (middle + width)[rows]
    axes.fill_between(t[rows], low, high, color=BAND, linewidth=0.0, label=label)


def draw_output(axes: Axes, item: Case) -> None:
    """Fig. 2: the output and its prescribed bounds."""
    t, run = item.run.t, item.run
    band(axes, t, run.r[:, 0], item.widths[:, 0], "bounds r\u2081 \u00b1 p\u2081")
    curve(axes, t, run.x[:, 0], CURVE, "output y")


def draw_state(index: int) -> Callable[[Axes, Case], None]:
    """Figs. 3 and 4: a state and what is measured of it."""

    def draw(axes: Axes, item: Case) -> None:
        name = "x\u2081" if index == 0 else "x\u2082"
        t, run = item.run.t, item.run
        curve(axes, t, run.q[:, index], SECOND, f"q({name})", linewidth=0.8)
        curve(axes, t, run.x[:, index], CURVE, name)

    return draw


def draw_input(axes: Axes, item: Case) -> None:
    """Figs. 5 and 8: the input, with its largest value and its bound in words."""
    label = f"input u: max |u| {item.run.max_abs_u:.4g}, bound U {item.design.bounds.U:.4g}"
    curve(axes, item.run.t, item.run.u, INPUT, label, linewidth=0.8)


def draw_error(axes: Axes, item: Case) -> None:
    """Fig. 6: the tracking error and its prescribed bounds."""
    t, run = item.run.t, item.run
    center = run.r[:, 0] - run.y_d
    band(axes, t, center, item.widths[:, 0], "bounds r\u2081 \u2212 y_d \u00b1 p\u2081")
    curve(axes, t, run.x[:, 0] - run.y_d, CURVE, "tracking error y \u2212 y_d")


def draw_tracking(axes: Axes, item: Case) -> None:
    """Fig. 7: the output and the desired signal."""
    curve(axes, item.run.t, item.run.x[:, 0], CURVE, "output y")
    curve(axes, item.run.t, item.run.y_d, "#444444", "desired y_d", linestyle="--")


def draw_switch(axes: Axes, item: Case) -> None:
    """Draw e_2 around the switch: with its tube, and where it is left."""
    t, run = item.run.t, item.run
    band(axes, t, 0.0 * t, item.widths[:, 1], "tube \u00b1 p\u2082 of the stage in force")
    for stage, color in ((1, "#6a51a3"), (2, CURVE)):
        rows = np.flatnonzero(run.stage == stage)
        curve(axes, t[rows], run.e[rows, 1], color, f"e\u2082 in stage {stage}")
    peak = run.stages[-1]
    inside = "inside" if peak.within_bounds else "OUTSIDE"
    label = f"largest |e\u2082| {peak.max_abs_e[1]:.3g}, {inside} {peak.half_widths[1]:g}"
    axes.plot([], [], " ", label=label)


def save(name: str, draw: Callable[[Axes, Case], None], cases: tuple[Case, ...], unit: str) -> None:
    """Draw one panel a case, two a row."""
    from matplotlib import pyplot as plt

    rows = math.ceil(len(cases) / 2)
    figure, grid = plt.subplots(
        rows, 2, figsize=(9.0, 0.4 + 2.7 * rows), layout="constrained", squeeze=False
    )
    for axes, item in zip(grid.flat, cases, strict=True):
        draw(axes, item)
        finish(axes, item.title, "time t [s]", unit)
        if draw is draw_switch:
            axes.legend(fontsize=8, loc="lower right", framealpha=0.85)
    write(figure, name)


def finish(axes: Axes, title: str, across: str, upward: str) -> None:
    """Label a panel."""
    axes.set_title(title, fontsize=10)
    axes.set_xlabel(across)
    axes.set_ylabel(upward)
    axes.margins(x=0.0)
    axes.locator_params(nbins=5)
    axes.grid(color="#dddddd", linewidth=0.5)
    axes.legend(fontsize=8, loc="best", framealpha=0.85)


def write(figure: Figure, name: str) -> None:
    """Write docs/figures/NAME.svg; the same numbers give the same bytes."""
    FIGURES.mkdir(parents=True, exist_ok=True)
    target = FIGURES / f"{name}.svg"
    figure.savefig(target, metadata={"Date": None, "Creator": None})
    text = target.read_text(encoding="utf-8")
    # A tenth of a point is finer than a screen's dots, and the same on every processor.
    short = re.sub(r"-?\d+\.\d{3,}", lambda found: f"{round(float(found[0]), 1) + 0.0:g}", text)
    lines = (line.strip() for line in short.splitlines())
    target.write_text("\n".join(lines) + "\n", encoding="utf-8")


def draw_quantizer() -> None:
    """Fig. 1: the map of the uniform quantizer, as it must be and as (3) prints it."""
    from matplotlib import pyplot as plt

    figure, (left, right) = plt.subplots(1, 2, figsize=(9.0, 3.4), layout="constrained")
    step = 0.1
    quantizer = Uniform(step)
    for number in range(-3, 4):
        low = (number - 0.5) * step
        cell = [low, low + 0.999 * step]
        heights = [quantizer(low + 0.01 * step), quantizer(low + 0.99 * step)]
        left.plot(cell, heights, color=CURVE, label=None if number else "q(x)")
    # As printed: l_{i+1} = l_i + l_0 / 2 from l_0 on, each with a cell of width l_0.
    levels = [step * (1.0 + 0.5 * i) for i in range(1, 5)]
    right.plot([-0.5 * step, 0.5 * step], [0.0, 0.0], color=CURVE, label="q(x)")
    for level, side in itertools.product(levels, (-1.0, 1.0)):
        cell = [side * (level - 0.5 * step), side * (level + 0.5 * step)]
        right.plot(cell, [side * level] * 2, color=CURVE)
    for side in (-1.0, 1.0):
        label = "no level at all" if side < 0.0 else None
        right.axvspan(*sorted((side * 0.5 * step, side * step)), color="#fcbba1", label=label)
    for axes in (left, right):
        axes.plot([-0.35, 0.35], [-0.35, 0.35], ":", color="#888888", label="x")
        axes.set_xlim(-0.35, 0.35)
    finish(
        left, "l\u1d62\u208a\u2081 = l\u1d62 + l\u2080, l\u2080 = 0.1", "state x [1]", "q(x) [1]"
    )
    finish(right, "(3) as printed: + l\u2080/2, cells overlap", "state x [1]", "q(x) [1]")
    write(figure, "fig1")


def prepare() -> None:
    """Set what makes the files small and the same every time."""
    mpl.use("svg")
    mpl.rcParams.update({"svg.hashsalt": "bfppc-synth", "svg.fonttype": "none"})
    mpl.rcParams.update({"lines.linewidth": 1.2, "path.simplify": False})
    mpl.rcParams["font.sans-serif"] = ["DejaVu Sans", "Arial"]


def main() -> None:
    """Write docs/figures/fig1.svg to fig8.svg and switch.svg."""
    prepare()
    draw_quantizer()
    printed_1 = example("paper_example_1_printed")
    theorem1 = example("theorem1_example_1")
    # The same requirement by Theorem U; its balanced design may be run in these steps.
    quantized = example(
        "theorem1_example_1",
        ("name: theorem1_example_1", "name: unified_example_1"),
        ("method: theorem1\n  objective: peak-input", "method: unified"),
    )
    exact = example("paper_example_1")
    first = (
        case("printed gains: NOT CERTIFIED", printed_1, horizon=HORIZON_1),
        case("Theorem 1 corrected: certified", theorem1, horizon=HORIZON_1),
        case("Theorem U, same quantizer: certified", quantized, horizon=HORIZON_1),
        case("Theorem U, exact measurement: certified", exact, horizon=HORIZON_1),
    )
    save("fig2", draw_output, first, "output y [1]")
    save("fig3", draw_state(0), first, "state x\u2081 [1]")
    save("fig4", draw_state(1), first, "state x\u2082 [1]")
    save("fig5", draw_input, first, "input u [1]")
    printed_2 = example("paper_example_2_printed")
    unified = example("paper_example_2")
    switching = example("switching_example_2")
    begin = (0.5, 2.0)
    from_there = "printed gains from (0.5, 2): NOT CERTIFIED"
    second = (
        case("printed gains: NOT CERTIFIED", printed_2, horizon=HORIZON_2),
        case("Theorem U: certified", unified, horizon=HORIZON_2),
        case(from_there, printed_2, horizon=HORIZON_2, start=begin),
        case("Theorem 3 reanchored, (0.5, 2): certified", switching, horizon=HORIZON_2),
    )
    save("fig6", draw_error, second, "tracking error [1]")
    save("fig7", draw_tracking, second, "output y [1]")
    save("fig8", draw_input, second, "input u [1]")
    moment = (
        case(from_there, printed_2, horizon=SWITCH, start=begin, step=SWITCH_STEP),
        case(second[3].title, switching, horizon=SWITCH, step=SWITCH_STEP),
    )
    save("switch", draw_switch, moment, "error e\u2082 [1]")


if __name__ == "__main__":
    main()
