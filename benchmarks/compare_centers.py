"""Write docs/centers.md, what each center asks of the same plants: ``make centers``.

The plants are those of examples/ and tests/plants/, with the changes that this file states. Every
number comes from a design that is certified; tests/golden/test_centers_page.py makes it again.
"""

from __future__ import annotations

import json
import re
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from bfppc_synth.certificate.checker import check_documents
from bfppc_synth.certificate.produce import produce_certificate
from bfppc_synth.model.certificate import Verdict
from bfppc_synth.spec.canonical import plant_json
from bfppc_synth.spec.load import load_spec
from bfppc_synth.synthesis.synthesize import synthesize

if TYPE_CHECKING:
    from collections.abc import Iterator

    from bfppc_synth.model.design import Design

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "centers.md"
EXACT, UNCERTAIN = "exact", "10 %"
# Every force coefficient of an example, as its file has it and with a factor e of its own.
COEFFICIENTS: dict[str, tuple[tuple[str, str], ...]] = {
    "paper_example_1": (
        ("f: x1**2 - sin(x1)", "f: e1*x1**2 - e2*sin(x1)"),
        ("f: x1*x2**2", "f: e3*x1*x2**2"),
    ),
    "paper_example_2": (
        ("f: x1 + x1*exp(-a*x1)", "f: e1*x1 + e2*x1*exp(-a*x1)"),
        ("f: x1*sin(x2) + x1*x2**2", "f: e3*x1*sin(x2) + e4*x1*x2**2"),
    ),
    "van_der_pol": (("f: -2*(x1**2 - 1)*x2 - x1 + 1", "f: -2*e1*(x1**2 - 1)*x2 - e2*x1 + e3"),),
    "cart_pendulum": (("(gravity*sin(x1) - m*l*x2**2", "(e1*gravity*sin(x1) - e2*m*l*x2**2"),),
    "motor_arm": (
        ("f: -(N/M)*sin(x1) - (B/M)*x2", "f: -e1*(N/M)*sin(x1) - e2*(B/M)*x2"),
        ("f: -(Kb/L)*x2 - (R/L)*x3", "f: -e3*(Kb/L)*x2 - e4*(R/L)*x3"),
    ),
    "compressor_surge": (("f: -1.5*x1**2 - 0.5*x1**3", "f: -1.5*e1*x1**2 - 0.5*e2*x1**3"),),
}
NOISE = "measurement: {noise: {x1: 0.0001, x2: 0.001, x3: 0.001}}\n"
DELAYED = "sampling: {period: 0.0001, delay: 0.0001}\n"
BOX = "initial: {x1: [0.1, 0.3], x2: [-0.2, 0.2], x3: [-0.1, 0.1]}"
ARM, JERK, CHAIN = "nominal_motor_arm", "nominal_jerk", "nominal_chain_of_four"
# What is measured, when and from where: text added before `synthesis`, text replaced.
CONDITIONS: dict[str, tuple[str, str, tuple[str, str] | None]] = {
    "exact, continuous": (ARM, "", None),
    "resolution (1e-4, 1e-3, 1e-3), every 0.1 ms": (
        ARM,
        NOISE + "sampling: {period: 0.0001}\n",
        None,
    ),
    "resolution (1e-4, 1e-3, 1e-3), every 0.5 ms": (
        ARM,
        NOISE + "sampling: {period: 0.0005}\n",
        None,
    ),
    "the same, every 0.1 ms, commands up to 0.1 ms late": (ARM, NOISE + DELAYED, None),
    "exact, every 0.1 ms, commands up to 0.1 ms late": (JERK, DELAYED, None),
    "exact, every 1 ms, commands up to 1 ms late": (
        CHAIN,
        "sampling: {period: 0.001, delay: 0.001}\n",
        None,
    ),
    "exact, continuous, a box of starts": (
        ARM,
        "",
        ("initial: {x1: 0.2, x2: 0, x3: 0}", BOX),
    ),
    "a box of starts, resolution and 0.1 ms as above": (
        ARM,
        NOISE + "sampling: {period: 0.0001}\n",
        ("initial: {x1: 0.2, x2: 0, x3: 0}", BOX),
    ),
}
SHARES = (1.0, 0.97, 0.94, 0.91, 0.88, 0.8)
HEAD = """\
# Center nominal beside center performance

Written by `make centers`; `tests/golden/test_centers_page.py` makes every number again. All designs
are certified, with `objective: peak-input`: U is the peak input that is proved, in the unit of u.
The feedforward is sup |v|, what following the center takes with no error at all; the tube is what
the feedback may add to it.

## The examples

For center performance the files of `examples/` as they are, sampling included. For center nominal
they lose their `f_bound`, `g_bound` and `g_min`, since f and g are then the model, and T_s is left
open, up to the time that is simulated. The rows with 10 % give every force coefficient a factor of
its own in [0.9, 1.1], which may change at any time. Declared bounds are then left out for both
centers, and what is derived in their place may be tighter: the paper's examples get cheaper for
center performance.

| plant | model | U, performance | U, nominal | feedforward | tube | T_s [s] |
|---|---|---|---|---|---|---|
"""
MIDDLE = """
## Measured, sampled, late

`tests/plants/` with center nominal: the motor arm and the jerk system of [theory.md](theory.md)
section 4 with 10 % error on every force coefficient, the chain of four integrators with its input
disturbance. The largest period is the longest time between samples, of those tried, for which the
checker proves the same gains.

| plant | conditions | U | feedforward | tube | largest period [s] |
|---|---|---|---|---|---|
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Example:
    """One row of the first table."""

    name: str
    model: str

    def text(self, center: str) -> str:
        """Return the plant file, its requirement that of the example."""
        text = (ROOT / "examples" / f"{self.name}.yaml").read_text(encoding="utf-8")
        if self.model == UNCERTAIN:
            changes = COEFFICIENTS[self.name]
            for old, new in changes:
                text = replaced(text, old, new)
            errors = sorted(set(re.findall(r"\be\d\b", "".join(new for _, new in changes))))
            text = with_parameters(text, [f"  {error}: [0.9, 1.1]\n" for error in errors])
        if center == "nominal" or self.model == UNCERTAIN:
            text = re.sub(r"^ +(f_bound|g_bound|g_min):.*\n", "", text, flags=re.MULTILINE)
        chosen = f"  center: {center}\n  objective: peak-input\n"
        return replaced(text, "  center: performance\n", chosen)

    def cells(self) -> tuple[str, ...]:
        """Synthesize with both centers."""
        performance = certified(self.text("performance"))
        nominal = certified(self.text("nominal"))
        _, *sizes = split(nominal)
        numbers = (performance.bounds.U, nominal.bounds.U, *sizes, transition(nominal))
        return (self.name, self.model, *map(shown, numbers))


@dataclass(frozen=True, slots=True, kw_only=True)
class Condition:
    """One row of the second table."""

    conditions: str

    def text(self) -> str:
        """Return the plant file."""
        name, added, change = CONDITIONS[self.conditions]
        text = (ROOT / "tests" / "plants" / f"{name}.yaml").read_text(encoding="utf-8")
        text = replaced(text, "synthesis:", f"{added}synthesis:")
        return text if change is None else replaced(text, *change)

    def cells(self) -> tuple[str, ...]:
        """Synthesize."""
        design = certified(self.text())
        period = longest_proved(design)
        plant = design.spec.name.removeprefix("nominal_")
        return (plant, self.conditions, *map(shown, (*split(design), period)))


Row = Example | Condition
ROWS: tuple[Row, ...] = (
    *(Example(name=name, model=model) for name in COEFFICIENTS for model in (EXACT, UNCERTAIN)),
    *(Condition(conditions=conditions) for conditions in CONDITIONS),
)


def replaced(text: str, old: str, new: str) -> str:
    """Replace what must be there exactly once."""
    if text.count(old) != 1:
        raise SystemExit(f"{old!r} is there {text.count(old)} times")
    return text.replace(old, new)


def with_parameters(text: str, lines: list[str]) -> str:
    """Add parameters to those of a plant file."""
    if "\nparameters:\n" in text:
        return replaced(text, "\nparameters:\n", "\nparameters:\n" + "".join(lines))
    return replaced(text, "\nstates:", "\nparameters:\n" + "".join(lines) + "states:")


def certified(text: str) -> Design:
    """Synthesize, and accept nothing that is not proved."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "plant.yaml"
        path.write_text(text, encoding="utf-8")
        design = synthesize(load_spec(path))
    if design.certificate.verdict is not Verdict.CERTIFIED:
        raise SystemExit(f"{design.spec.name}: {design.certificate.failures}")
    return design


def proved(design: Design, period: float) -> bool:
    """Whether the checker proves the same gains for another time between samples [s]."""
    document = json.loads(plant_json(design.spec))
    sampling = {"delay": "0", **document["plant"].get("sampling", {})}
    document["plant"]["sampling"] = {**sampling, "period": repr(period)}
    produced = produce_certificate(
        document, design.gains, design.omega, tool="make centers", transition=transition(design)
    )
    return check_documents(document, produced).verdict == "proved"


def longest_proved(design: Design) -> float:
    """Step down from what binary64 numbers allow: the checker's bounds are a little wider."""
    return next(
        period
        for share in SHARES
        if proved(design, period := share * design.largest_certified_period)
    )


def split(design: Design) -> tuple[float, float, float]:
    """U, sup |v|, and what the feedback may add."""
    parts = design.nominal_split
    if parts is None:
        raise SystemExit(f"{design.spec.name}: center performance has no feedforward")
    return design.bounds.U, parts.feedforward, parts.tube


def transition(design: Design) -> float:
    """T_s [s], as chosen."""
    if design.nominal is None:
        raise SystemExit(f"{design.spec.name}: center performance has no transition")
    return design.nominal.transition


def shown(value: float) -> str:
    """Three digits."""
    return "any" if value == float("inf") else f"{value:.3g}"


def line(cells: tuple[str, ...]) -> str:
    """Lay out one row."""
    return f"| {' | '.join(cells)} |\n"


def rows(kind: type[Row]) -> Iterator[str]:
    """Make the rows of one table."""
    return (line(row.cells()) for row in ROWS if isinstance(row, kind))


def main() -> None:
    """Write the page."""
    PAGE.write_text(HEAD + "".join(rows(Example)) + MIDDLE + "".join(rows(Condition)), "utf-8")


if __name__ == "__main__":
    main()
