"""Write docs/baselines.md, other control methods on the same plants: ``make baselines``.

Every number comes from the same loops as ``bfppc-synth compare``; rows are made again by
tests/golden/test_baselines_page.py.
"""

from __future__ import annotations

import sys
import tempfile
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bfppc_synth.codegen.law import build_law
from bfppc_synth.codegen.provenance import make_provenance
from bfppc_synth.codegen.python import render_controller
from bfppc_synth.compare.run import CompareOptions, compare_design
from bfppc_synth.expressions.parse import parse_constant
from bfppc_synth.model.spec import QuantizerKind, QuantizerSpec
from bfppc_synth.simulation.baselines.barrier import BarrierLaw, LinearLaw
from bfppc_synth.simulation.baselines.cases import Clock, make_cases
from bfppc_synth.simulation.baselines.loop import close_loop
from bfppc_synth.simulation.baselines.operations import family_costs
from bfppc_synth.simulation.loading import load_controller
from bfppc_synth.spec.load import load_spec
from bfppc_synth.synthesis.synthesize import restore, synthesize

if TYPE_CHECKING:
    from bfppc_synth.model.design import Design
    from bfppc_synth.simulation.baselines.cases import Cases

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "baselines.md"
PAIRS, PERIOD, HORIZON, SEED = 400, 0.001, 5.0, 1
# Compared with default runs and budget, over a shorter horizon where samples are many.
EXAMPLES = {
    "cart_pendulum": 10.0,
    "compressor_surge": 10.0,
    "motor_arm_nominal": 2.0,
    "paper_example_1": 10.0,
    "van_der_pol": 4.0,
}
QUANTIZED = "paper_example_1, l_0 = 0.1, every 0.1 ms"
HEAD = f"""\
# Other methods on the same plants

Written by `make baselines`; `bfppc-synth compare DIR` makes such a table for any generated folder.

## Random gains under a quantizer

Plant (84) of `examples/paper_example_1.yaml` from (1, 0), measured in steps of l_0, sampled every
{PERIOD:g} s for {HORIZON:g} s. {PAIRS} pairs (k_1, k_2) are drawn from the range, uniformly in
their logarithms (seed {SEED}). The ln-barrier law is the paper's (80)-(81) with the errors
(50)-(51) and widths (0.15, w_2); the linear law alpha_i = -2 k_i e_i / w_i has the same slope at 0
and no barrier. NaN counts the pairs for which a command has no value because a measured error has
reached its width; diverged those for which a state passes 1e12; inside those that keep |y - y_d|
within 0.15 + rho_1(t) throughout.

The first four rows are the claim: under l_0 = 0.1 the barrier fails for most pairs, without a
quantizer for few, and the linear law has a value for all. The others say where that ends: a second
width of 10 is crossed less often, and gains below 0.5 are too weak for the barrier even without a
quantizer.

| gains | l_0 | w_2 | step [s] | ln-barrier: NaN | inside | linear: NaN | diverged | inside |
|---|---|---|---|---|---|---|---|---|
"""
TUNED = """
A tuned barrier is another matter, as the next tables show: with the gains that a search finds for
one plant, one start and one quantizer, it often survives. What it lacks is the proof.

## Every method, tuned

Each baseline is tuned by the same search on runs of its own: {budget} sets of gains, half anywhere
in the ranges, half within a factor of 2 of the best; most runs inside the envelope count first,
then most that reach the horizon, then the least peak |u|. The generated controller is not tuned:
its gains come from the synthesis, which knows bounds and no simulation, and its peak input is that
of a law that is proved for every plant within its bounds. What that costs is to be seen in the
first table: under a coarse quantizer the steep certified law works hardest of all. Dynamic surface
control and backstepping are given f and g of the nominal plant; the two kinds of prescribed
performance control are given nothing. Two of three runs take anything within the declared bounds
for the truth, where the file declares any. Wide funnels promise their own widths and not the
envelope: what they do inside it is what came out.
"""
COSTS = """
## Operations of one step against n

For dx_i = x_1 x_i^2 + x_{i+1}, the path and its derivatives given; equal subexpressions count once,
but in the last column, which is backstepping as it comes from the differentiation. The barrier-free
law is (54)-(55) with all of its terms.

| n | barrier-free | ln-barrier | Bechl.-Rov. | dynamic surface | backstepping | expanded |
|---|---|---|---|---|---|---|
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Pairs:
    """One row of the first table."""

    low: float
    high: float
    step: float
    width: float
    period: float = PERIOD

    def line(self) -> str:
        """Run both laws for all pairs."""
        cases = quantized_cases(self.step, self.period)
        draw = np.random.default_rng(SEED).uniform(np.log(self.low), np.log(self.high), (PAIRS, 2))
        gains = [np.exp(draw[:, i])[np.newaxis, :] for i in range(2)]
        widths = (0.15, self.width)
        barrier, linear = (
            close_loop(cases, law(cases.path, gains, widths), candidates=PAIRS)
            for law in (BarrierLaw, LinearLaw)
        )
        counts = (
            barrier.undefined.sum(),
            barrier.inside.sum(),
            linear.undefined.sum(),
            linear.diverged.sum(),
            linear.inside.sum(),
        )
        cells = (
            f"{self.low:g} to {self.high:g}",
            f"{self.step:g}",
            f"{self.width:g}",
            f"{self.period:g}",
            *(f"{count:.0f}" for count in counts),
        )
        return line(cells)


ROWS = (
    Pairs(low=0.5, high=20.0, step=0.1, width=3.1),
    Pairs(low=0.5, high=20.0, step=0.0, width=3.1),
    Pairs(low=1.0, high=100.0, step=0.1, width=3.1),
    Pairs(low=1.0, high=100.0, step=0.0, width=3.1),
    Pairs(low=0.5, high=20.0, step=0.05, width=3.1),
    Pairs(low=0.5, high=20.0, step=0.01, width=3.1),
    Pairs(low=0.5, high=20.0, step=0.1, width=1.0),
    Pairs(low=0.5, high=20.0, step=0.1, width=10.0),
    Pairs(low=0.1, high=10.0, step=0.1, width=3.1),
    Pairs(low=0.1, high=10.0, step=0.0, width=3.1),
    Pairs(low=0.5, high=20.0, step=0.1, width=3.1, period=0.0002),
)


@cache
def plant_84() -> Design:
    """Return the committed design of the first example: its plant and path are used."""
    return restore(ROOT / "generated" / "paper_example_1")


def quantized_cases(step: float, period: float) -> Cases:
    """Return the nominal run under a uniform quantizer of this step."""
    design = plant_84()
    item = QuantizerSpec(kind=QuantizerKind.NONE)
    if step:
        item = QuantizerSpec(kind=QuantizerKind.UNIFORM, step=parse_constant(repr(step)))
    measurement = replace(design.spec.measurement, quantizers=(item, item))
    design = replace(design, spec=replace(design.spec, measurement=measurement))
    clock = Clock(
        period=period,
        substeps=1,
        delay=0.0,
        count=round(HORIZON / period),
        source="the experiment",
        covered=False,
    )
    return make_cases(design, clock, seed=SEED, stream=0, runs=1)


def quantized_design() -> Design:
    """Synthesize the first example for l_0 = 0.1, sampled every 0.1 ms."""
    text = (ROOT / "examples" / "paper_example_1.yaml").read_text(encoding="utf-8")
    added = (
        "measurement: {quantizer: {kind: uniform, step: 0.1}}\n"
        "sampling: {period: 0.0001}\nsynthesis:"
    )
    text = text.replace("synthesis:", added).replace("period: 0.002", "period: 0.0001")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "plant.yaml"
        path.write_text(text, encoding="utf-8")
        design = synthesize(load_spec(path))
    design.certificate.require()
    return design


def table(document: dict[str, Any]) -> str:
    """Lay out one comparison, the gains below it."""
    sampling = document["sampling"]
    out = (
        f"\nSampled every {sampling['period']:g} s for {document['horizon']:g} s, accuracy"
        f" {document['accuracy']:g}, runs: {document['runs']}, seed {document['seed']}.\n\n"
        "| method | inside | NaN | diverged | peak of u | rms of u | level changes per s |"
        " operations |\n|---|---|---|---|---|---|---|---|\n"
    )
    notes = []
    for row in document["methods"]:
        if row["missing"]:
            out += line((row["title"], "not applicable", *[""] * 6))
            notes.append(f"{row['title']}: {row['missing']}")
            continue
        changes = row["level_changes_per_second"]
        cells = (
            row["title"],
            f"{row['inside']} of {row['runs']}",
            str(row["nan"]),
            str(row["diverged"]),
            f"{row['peak_u']:.3g}",
            f"{row['rms_u']:.3g}",
            "-" if changes is None else f"{changes:.3g}",
            str(row["operations"]),
        )
        out += line(cells)
        if row["gains"]:
            gains = ", ".join(f"{name} = {value:.3g}" for name, value in row["gains"].items())
            where = ", ".join(
                f"{name} in [{low:.3g}, {high:.3g}]" for name, (low, high) in row["ranges"].items()
            )
            notes.append(f"{row['title']}: {gains} ({where}; {row['fixed']})")
    return (
        out
        + "\nBest gains found, and the ranges searched:\n\n"
        + "".join(f"- {note}\n" for note in notes)
    )


def compared(design: Design, horizon: float) -> dict[str, Any]:
    """Compare with the default runs and budget."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "controller.py"
        path.write_text(render_controller(build_law(design), make_provenance(design)), "utf-8")
        options = CompareOptions(horizon=horizon)
        return compare_design(design, load_controller(path), options).document


def operations() -> str:
    """Lay out what a step costs against n."""
    return "".join(
        line((str(cost.order), *map(str, cost.operations.values()), str(cost.expanded)))
        for cost in family_costs(plant_84().plant)
    )


def line(cells: tuple[str, ...]) -> str:
    """Lay out one row."""
    return f"| {' | '.join(cells)} |\n"


def main() -> None:
    """Write the page."""
    text = HEAD
    for pairs in ROWS:
        text += pairs.line()
        print(text.splitlines()[-1], flush=True)
    text += TUNED.format(budget=CompareOptions().budget)
    tuned = {QUANTIZED: (quantized_design(), 5.0)}
    for name, horizon in EXAMPLES.items():
        tuned[name] = (restore(ROOT / "generated" / name), horizon)
    for title, (design, horizon) in tuned.items():
        found = f"\n### {title}\n" + table(compared(design, horizon))
        print(found, flush=True)
        text += found
    text += COSTS + operations()
    PAGE.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())
