"""Write docs/gallery.md and its pictures from examples/ and generated/: ``make gallery``.

A folder other than generated/ may be named as the only argument.
"""

from __future__ import annotations

import csv
import json
import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PICTURES = ROOT / "docs" / "gallery"
PAGE = ROOT / "docs" / "gallery.md"
# So many points draw a curve of this size; the converter's steps stay visible in the first ones.
POINTS = 150
HEAD = """# Gallery

Written by `make gallery` from `examples/` and what they generate. Every design below is certified,
and its folder stands in `generated/`: open the report in it. U is the proved peak input, a worst
case over everything that the plant file allows; what the simulated runs need is beside it. The
paper's own printed gains, which are never certified, are in [paper.md](paper.md). Two notebooks,
`examples/notebooks/first_design.ipynb` and `trade_off.ipynb`, do the same from Python.

"""


def examples() -> list[Path]:
    """Plant files whose design is certified, by name."""
    found = sorted((ROOT / "examples").glob("*.yaml"))
    return [path for path in found if not path.stem.endswith("_printed")]


def comment(path: Path) -> tuple[str, str]:
    """Return what stands above and behind ``What it teaches:`` in a plant file's first comment."""
    lines: list[str] = []
    for line in path.read_text(encoding="utf-8").splitlines():
        if not line.startswith("#"):
            break
        lines.append(line.removeprefix("#").strip())
    source, _, lesson = " ".join(lines).partition("What it teaches:")
    return source.strip(), lesson.strip()


def number(value: float) -> str:
    """Three digits, as in docs/centers.md."""
    return f"{value:.3g}"


def entry(path: Path, folder: Path) -> str:
    """Return one plant's part of the page."""
    report = json.loads((folder / "report.json").read_text(encoding="utf-8"))
    source, lesson = comment(path)
    title = re.search(r"^title: (.*)$", path.read_text(encoding="utf-8"), re.MULTILINE)
    sampling, bounds = report["sampling"], report["bounds"]
    period = number(sampling["period"]) + " s" if sampling["period"] else "continuous"
    facts = {
        "order": str(report["order"]),
        "method, center": f"{report['method']}, {report['center']}",
        "accuracy": number(report["performance"]["accuracy"]),
        "sampled every": period,
        "U": number(bounds["U"]),
        "U in simulations": number(report["simulation"]["max_abs_u"]),
        "slope": number(bounds["slope"]),
    }
    lesson = lesson[:1].upper() + lesson[1:]
    name = path.stem
    heading = title[1] if title else name
    return "\n".join(
        [
            f"## {heading}",
            "",
            f"`examples/{name}.yaml`. {source}".replace("*", r"\*"),
            "",
            f"*What it teaches.* {lesson}",
            "",
            f"![{heading}: output in its proved tube, and input](gallery/{name}.svg)",
            "",
            "| " + " | ".join(facts) + " |",
            "|" + "---|" * len(facts),
            "| " + " | ".join(facts.values()) + " |",
            "",
        ]
    )


def thin(rows: list[dict[str, float]]) -> list[dict[str, float]]:
    """Keep about POINTS rows."""
    step = max(1, len(rows) // POINTS)
    return rows[::step]


def draw(folder: Path, target: Path) -> None:
    """Draw output, tube, reference and input of the nominal run."""
    import matplotlib as mpl

    mpl.use("svg")
    from matplotlib import pyplot as plt

    report = json.loads((folder / "report.json").read_text(encoding="utf-8"))
    with (folder / "trajectory.csv").open(encoding="utf-8") as file:
        table = csv.DictReader(file)
        rows = thin([{key: float(text) for key, text in row.items()} for row in table])
    width = report["performance"]["accuracy"]
    t = [row["t"] for row in rows]
    # e_1 = x_1 - r_1, so the proved tube is r_1 +- p_1.
    center = [row["x1"] - row["e1"] for row in rows]
    style = {"svg.hashsalt": "bfppc-synth", "font.size": 8.0, "svg.fonttype": "none"}
    with mpl.rc_context(style):
        figure, (left, right) = plt.subplots(1, 2, figsize=(7.2, 2.0), layout="constrained")
        low, high = [r - width for r in center], [r + width for r in center]
        left.fill_between(t, low, high, color="#9ecae1", label="proved tube")
        left.plot(t, [row["x1"] for row in rows], color="#08519c", lw=1.0, label="output")
        left.plot(t, [row["y_d"] for row in rows], "--", color="#666666", lw=0.8, label="reference")
        left.legend(frameon=False, loc="best")
        left.set(xlabel="t [s]", ylabel=report["states"][0])
        right.plot(t, [row["u"] for row in rows], color="#a63603", lw=1.0)
        right.set(xlabel="t [s]", ylabel="u")
        figure.patch.set_facecolor("white")
        figure.savefig(target, metadata={"Date": None, "Creator": None})
        plt.close(figure)


def main() -> None:
    """Write the page; the same folders give the same bytes."""
    home = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "generated"
    parts = []
    PICTURES.mkdir(exist_ok=True)
    for path in examples():
        folder = home / path.stem
        parts.append(entry(path, folder))
        draw(folder, PICTURES / f"{path.stem}.svg")
    PAGE.write_text(HEAD + "\n".join(parts), encoding="utf-8")


if __name__ == "__main__":
    main()
