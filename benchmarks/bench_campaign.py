"""Closed loops per second: compiled, hand-written, Python, threads, a whole campaign.

``make bench``. Every comparison alternates its sides in one process and takes the processor
time of each side's best turn: the load of a machine stretches the clock, this hardly. Two
threads are compared by the clock, so that row wants an idle machine.
"""

from __future__ import annotations

import argparse
import ctypes
import resource
import shutil
import sys
import tempfile
import threading
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

    from bfppc_synth.campaign.material import Material
    from bfppc_synth.model.trajectory import Trajectory

ROOT = Path(__file__).resolve().parents[1]
FOLDER = ROOT / "generated" / "paper_example_1"
# What a person writes who knows this plant and this law: nothing is screened, drawn or traced.
BY_HAND = """\
#include <math.h>
#include <string.h>
static const double M1 = @M1@, epsilon = @EPSILON@, k2 = @K2@, U = @U@;
static double law(double t, double a, double x1, double x2)
{
    const double rho = t < 3.141592653589793 ? 0.5 * (1.0 + cos(t)) : 0.0;
    const double u = -k2 * (x2 + M1 * tanh(M1 / epsilon * (x1 - rho * a)));
    return u > U ? U : u < -U ? -U : u;
}
__attribute__((visibility("default")))
double by_hand(double h, long steps, double tolerance, double close, double *peaks)
{
    double x1 = 1.0, x2 = 0.0, a = x1, u = law(0.0, a, x1, x2), slope = 1.0;
    memset(peaks, 0, 3 * sizeof *peaks);
    for (long k = 0; k < steps; ++k) {
        const double t = (double)(k + 1) * h, f1 = x1 * x1 - sin(x1), f2 = x1 * x2 * x2;
        const double offset = x2 + h * f2, base = x1 + h * f1, reach = h * U;
        double lower = offset - reach, upper = offset + reach, z = offset + h * u;
        double last = 0.0, at = 0.0;
        for (int attempt = 0; attempt < 400; ++attempt) {
            double residual, next;
            u = law(t, a, base + h * z, z);
            residual = z - offset - h * u;
            if (fabs(residual) <= tolerance) break;
            if (attempt > 0) {
                slope = fmax(1.0, (residual - last) / (z - at));
                if (fabs(residual) <= close * slope) break;
            }
            next = z - residual / slope;
            if (attempt > 0) {
                const double limit = 8.0 * fabs(z - at);
                next = z - fmin(fmax(residual / slope, -limit), limit);
            }
            if (residual > 0.0) upper = fmin(upper, z); else lower = fmax(lower, z);
            if ((attempt > 3 && attempt % 2) || !(lower < next && next < upper)) {
                next = 0.5 * (lower + upper);
                if (upper - lower <= close) break;
            }
            at = z, last = residual, z = next;
        }
        x1 = base + h * z, x2 = z;
        {
            const double rho = t < 3.141592653589793 ? 0.5 * (1.0 + cos(t)) : 0.0;
            const double e1 = x1 - rho * a, e2 = x2 + M1 * tanh(M1 * e1 / epsilon);
            peaks[0] = fmax(peaks[0], fabs(e1));
            peaks[1] = fmax(peaks[1], fabs(e2));
            peaks[2] = fmax(peaks[2], fabs(u));
        }
    }
    return x1;
}
"""
#: What the issue asks of each ratio.
AT_LEAST_PYTHON, AT_MOST_HAND, AT_LEAST_THREADS = 15.0, 1.3, 1.8


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """A line of the table."""

    what: str
    value: str
    wanted: str


def best(work: Callable[[], object], turns: int) -> float:
    """Return the smallest processor time of some turns [s]."""
    times = []
    for _ in range(turns):
        start = time.process_time()
        work()
        times.append(time.process_time() - start)
    return min(times)


def material_of(step: float, horizon: float) -> Material:
    """Gather the campaign of paper_example_1 in steps of its own."""
    from bfppc_synth.campaign.material import gather_material

    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch) / "out"
        shutil.copytree(FOLDER, folder)
        material = gather_material(folder, horizon=horizon)
    return at_step(material, step)


def at_step(material: Material, step: float) -> Material:
    """Take other plant steps."""
    from bfppc_synth.simulation.compiled.library import Axes
    from bfppc_synth.simulation.compiled.records import make_axis
    from bfppc_synth.simulation.scheme import choose_scheme

    design, spec = material.design, material.design.spec
    spec = replace(spec, simulation=replace(spec.simulation, period=step))
    design = replace(design, spec=spec, plant=replace(design.plant, spec=spec))
    scheme = choose_scheme(design)
    axis = make_axis(design, scheme, material.horizon)
    axes = Axes(regular=axis, jittered=axis)
    return replace(material, design=design, scheme=scheme, axes=axes)


def loops(steps: int, turns: int) -> list[Row]:
    """Time one nominal loop of h = 0.1 ms: compiled, by hand, in Python."""
    from bfppc_synth.campaign.material import open_loop
    from bfppc_synth.simulation.compiled.build import build
    from bfppc_synth.simulation.compiled.python import PythonLoop
    from bfppc_synth.simulation.drawing import draw_run
    from bfppc_synth.simulation.drawn import Manner, Segment
    from bfppc_synth.simulation.loop import simulate_nominal
    from bfppc_synth.simulation.plant import compile_plant

    material = material_of(1e-4, steps * 1e-4)
    design = material.design
    python = PythonLoop(design, material.controller, material.scheme)
    loop = open_loop(material)
    _, drawn = draw_run(material.choices, 1, 0)
    quiet = Segment(
        until=1e9,
        arguments=compile_plant(design.plant).nominal,
        noise=(0.0, 0.0),
        error=0.0,
    )
    draw = replace(drawn, manner=Manner.PLAN, bounded=False, plan=(quiet,))
    axis = material.axes.regular
    words = {
        "M1": design.gains[0].M,
        "EPSILON": design.gains[0].epsilon,
        "K2": design.gains[1].k,
        "U": design.bounds.U,
    }
    text = BY_HAND
    for word, value in words.items():
        text = text.replace(f"@{word}@", repr(value))
    by_hand = build((("hand.c", text),), "hand.c").by_hand
    by_hand.restype = ctypes.c_double
    peaks = (ctypes.c_double * 3)()
    arguments = (
        *(ctypes.c_double(1e-4), ctypes.c_long(steps)),
        *(ctypes.c_double(axis.enough), ctypes.c_double(axis.close), peaks),
    )
    count = max(1, 200_000 // steps)

    def compiled() -> object:
        return loop.run([draw] * count, material.axes)

    def hand() -> None:
        for _ in range(count):
            by_hand(*arguments)

    def nominal() -> Trajectory:
        # As long as the others: the plant file's horizon is another one.
        return simulate_nominal(design, python._controller, horizon=steps * 1e-4)  # noqa: SLF001

    made = len(nominal().t) - 1
    if made != steps:
        raise SystemExit(f"the Python loop made {made} steps, not {steps}")
    (run,) = loop.run([draw], material.axes)
    hand()
    apart = max(abs(a - b) for a, b in zip(run.peaks[0][1], list(peaks)[:2], strict=True))
    if apart > 1e-6:
        raise SystemExit(f"the hand-written loop is another loop: apart by {apart}")
    times = {"compiled": 1e300, "hand": 1e300, "python": 1e300, "exact": 1e300}
    for _ in range(turns):
        times["compiled"] = min(times["compiled"], best(compiled, 3) / count)
        times["hand"] = min(times["hand"], best(hand, 3) / count)
        plain = best(nominal, 1)
        times["python"] = min(times["python"], plain)
        times["exact"] = min(times["exact"], best(lambda: python.run([draw], material.axes), 1))
    each = {name: f"{1e9 * value / steps:.0f} ns a step" for name, value in times.items()}
    factor = times["python"] / times["compiled"]
    return [
        Row(what="compiled loop, h = 0.1 ms", value=each["compiled"], wanted=""),
        Row(what="hand-written C loop", value=each["hand"], wanted=""),
        Row(what="Python loop", value=each["python"], wanted=""),
        Row(what="Python loop, judged row by row", value=each["exact"], wanted=""),
        Row(what="Python / compiled", value=f"{factor:.1f}", wanted=f">= {AT_LEAST_PYTHON:g}"),
        Row(
            what="compiled / hand-written",
            value=f"{times['compiled'] / times['hand']:.2f}",
            wanted=f"<= {AT_MOST_HAND:g}",
        ),
    ]


def threads(runs: int, turns: int) -> list[Row]:
    """Time the same runs by one thread and by two."""
    from bfppc_synth.campaign.batch import do_batch
    from bfppc_synth.engine import open_engine

    material = material_of(1e-3, 4.0)
    clock, processor = {1: 1e300, 2: 1e300}, {1: 1e300, 2: 1e300}
    piece = runs // 16
    for _ in range(turns):
        for workers in (1, 2):
            with open_engine(workers=workers, cluster=None) as engine:
                batches = [(material, 1, piece * k, piece, None) for k in range(16)]
                start, begin = time.perf_counter(), time.process_time()
                for _ in engine.gather(do_batch, batches):
                    pass
                clock[workers] = min(clock[workers], time.perf_counter() - start)
                processor[workers] = min(processor[workers], time.process_time() - begin)
    return [
        Row(
            what="two threads / one, by the clock",
            value=f"{clock[1] / clock[2]:.2f}",
            wanted=f">= {AT_LEAST_THREADS:g} on an idle machine",
        ),
        Row(
            what="processor time of two threads / one",
            value=f"{processor[2] / processor[1]:.2f}",
            wanted="",
        ),
    ]


def whole(runs: int) -> list[Row]:
    """Make a campaign of T = 4 s, h = 1 ms by two threads; memory at a tenth and at the end."""
    from bfppc_synth.campaign.batch import do_batch
    from bfppc_synth.campaign.tally import Tally
    from bfppc_synth.engine import open_engine

    material = material_of(1e-3, 4.0)
    tally = Tally.empty(2, funnel=False)
    piece = max(1, runs // 40)
    sizes: list[float] = []
    start, begin = time.perf_counter(), time.process_time()
    with open_engine(workers=2, cluster=None) as engine:
        batches = ((material, 1, first, piece, None) for first in range(0, runs, piece))
        for _, found in engine.gather(do_batch, batches):
            tally.add(found)
            sizes.append(resident())
    seconds, processor = time.perf_counter() - start, time.process_time() - begin
    tenth = sizes[len(sizes) // 10]
    return [
        Row(
            what=f"campaign of {tally.runs} runs, T = 4 s, h = 1 ms, 2 threads",
            value=f"{seconds / 60:.1f} min by the clock, {processor / 60:.1f} min of processor",
            wanted="minutes",
        ),
        Row(what="runs that left", value=str(tally.outside), wanted="0"),
        Row(
            what="memory at a tenth, at the end",
            value=f"{tenth:.0f} MB, {sizes[-1]:.0f} MB",
            wanted="flat",
        ),
    ]


def resident() -> float:
    """Memory of this process now [MB]."""
    try:
        pages = int(Path("/proc/self/statm").read_text("ascii").split()[1])
    except OSError:
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    return pages * resource.getpagesize() / 1e6


def main() -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=100_000, help="of the whole campaign")
    parser.add_argument("--turns", type=int, default=3)
    words = parser.parse_args()
    rows = [*loops(20_000, words.turns), *threads(1600, words.turns), *whole(words.runs)]
    width = max(len(row.what) for row in rows)
    for row in rows:
        print(f"{row.what:<{width}}  {row.value}{f'  (wanted {row.wanted})' if row.wanted else ''}")
    return 0 if threading.active_count() == 1 else 1


if __name__ == "__main__":
    sys.exit(main())
