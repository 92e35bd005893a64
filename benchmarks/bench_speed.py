"""Whole-process times and peak memory, as README's table has them: ``make bench``.

Each row alternates with the yardstick ``import sympy, casadi, matplotlib.pyplot`` in the same
run. The ratio of the medians is what a relative limit is compared with, and the processor time
what a limit in seconds is: the load of a machine stretches the clock, these hardly.
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
YARDSTICK = ("-c", "import sympy, casadi, matplotlib.pyplot")
EXAMPLE = ROOT / "examples" / "paper_example_2.yaml"
FOURTH_ORDER = """\
name: chain_4
states: [x1, x2, x3, x4]
dynamics:
  x1: {f: 0.2*sin(x1)}
  x2: {f: 0.1*x1*x2, g: 1.5 + 0.5*cos(x1)}
  x3: {f: 0.1*x3}
  x4: {f: x1 - 0.2*x4}
initial: {x1: 0.1, x2: 0, x3: 0, x4: 0}
performance: {accuracy: 0.2}
"""
SWEPT = "performance.accuracy=0.02:0.5:20"
ORDERS = (2, 3, 4, 6, 8, 10)
# Times the gain solve alone: imports, bounds of the signals and majorants are done before.
SOLVE = """\
import sys, time
from pathlib import Path
from bfppc_synth.gains.search import search
from bfppc_synth.spec.load import load_spec
from bfppc_synth.synthesis.prepare import prepare
import bfppc_synth.gains.solve
problem, _ = prepare(load_spec(Path(sys.argv[1])))
start = time.perf_counter()
found = search(problem, lambda message: None)
print(time.perf_counter() - start if found else "nothing found")
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Cost:
    """What one process took."""

    seconds: float
    processor: float
    megabytes: float
    exit_code: int
    output: str


def run(*words: str) -> Cost:
    """Run Python with ``words`` and measure the whole process."""
    start = time.perf_counter()
    with tempfile.TemporaryFile("w+") as output:
        process = subprocess.Popen(
            [sys.executable, *words], cwd=ROOT, stdout=output, stderr=subprocess.DEVNULL
        )
        _, status, usage = os.wait4(process.pid, 0)
        seconds = time.perf_counter() - start
        process.returncode = os.waitstatus_to_exitcode(status)
        output.seek(0)
        text = output.read()
    return Cost(
        seconds=seconds,
        processor=usage.ru_utime + usage.ru_stime,
        megabytes=usage.ru_maxrss / 1024,
        exit_code=process.returncode,
        output=text,
    )


def compare(words: tuple[str, ...], repeats: int, expected: int) -> tuple[Cost, float]:
    """Alternate ``words`` with the yardstick; median cost and ratio of medians."""
    mine, yard = [], []
    for _ in range(repeats):
        yard.append(run(*YARDSTICK).seconds)
        mine.append(run(*words))
        if mine[-1].exit_code != expected:
            raise SystemExit(f"{' '.join(words)}: exit {mine[-1].exit_code}, not {expected}")
    seconds = statistics.median(cost.seconds for cost in mine)
    cost = Cost(
        seconds=seconds,
        processor=statistics.median(cost.processor for cost in mine),
        megabytes=max(cost.megabytes for cost in mine),
        exit_code=expected,
        output=mine[-1].output,
    )
    return cost, seconds / statistics.median(yard)


def chain(order: int) -> str:
    """Write a plant of any order whose terms couple every state to the first one."""
    names = [f"x{i + 1}" for i in range(order)]
    lines = [f"name: chain_{order}", f"states: [{', '.join(names)}]", "dynamics:"]
    for name in names:
        product = "" if name == "x1" else f" + 0.1*x1*{name}"
        lines.append(f"  {name}: {{f: 0.2*sin({name}){product}, g: 1.5 + 0.5*cos(x1)}}")
    starts = ", ".join(f"{name}: {0.1 if name == 'x1' else 0}" for name in names)
    lines.append(f"initial: {{{starts}}}")
    lines += ["performance: {accuracy: 0.2}", "synthesis: {center: performance}"]
    return "\n".join(lines) + "\n"


def compare_orders(work: Path, repeats: int) -> bool:
    """Print the seconds of the gain solve by order; whether they grow slower than n^3."""
    first, grown = 0.0, True
    for order in ORDERS:
        plant = work / f"chain_{order}.yaml"
        plant.write_text(chain(order))
        found = [run("-c", SOLVE, str(plant)).output for _ in range(repeats)]
        seconds = min(float(text) for text in found)
        first = first or seconds
        most = first * (order / ORDERS[0]) ** 3
        grown &= seconds <= most
        word = "" if seconds <= most else "  OVER"
        print(
            f"{f'gain solve of a chain, n = {order}':28} {seconds:8.2f} {'':21}  {most:.2f} s{word}"
        )
    return grown


def main() -> int:
    """Print the table; 1 if a limit is passed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=5)
    repeats = parser.parse_args().repeats
    cli = ("-m", "bfppc_synth")
    with tempfile.TemporaryDirectory() as folder:
        work = Path(folder)
        grammar = work / "grammar.yaml"
        grammar.write_text(EXAMPLE.read_text().replace("accuracy:", "acuracy:"))
        bounds = work / "bounds.yaml"
        bounds.write_text(EXAMPLE.read_text().replace("Abs(x1)*x2**2", "1/x1"))
        fourth = work / "chain_4.yaml"
        fourth.write_text(FOURTH_ORDER)
        whole = (*cli, str(EXAMPLE), "--out", str(work / "out"), "--quiet")
        rows = [
            ("paper_example_2, end to end", whole, 0, 4.0, None),
            ("--help", (*cli, "--help"), 0, None, 0.5),
            ("a mistake of grammar", (*cli, str(grammar)), 2, None, 0.5),
            ("a mistake that needs bounds", (*cli, str(bounds)), 2, None, 2.0),
        ]
        print(f"{'what':28} {'clock s':>8} {'CPU s':>6} {'x import':>9} {'MB':>4}  limit")
        late = False
        for name, words, expected, most_ratio, most_seconds in rows:
            cost, ratio = compare(words, repeats, expected)
            kept = (most_ratio is None or ratio <= most_ratio) and (
                most_seconds is None or cost.processor <= most_seconds
            )
            kept = kept and cost.megabytes < 500
            limit = f"{most_ratio} x import" if most_ratio else f"{most_seconds} s"
            print(
                f"{name:28} {cost.seconds:8.2f} {cost.processor:6.2f} {ratio:9.2f}"
                f" {cost.megabytes:4.0f}  {limit}{'' if kept else '  OVER'}"
            )
            late |= not kept
        cost = run("-c", SOLVE, str(fourth))
        seconds = float(cost.output)
        late |= seconds > 5.0
        word = "" if seconds <= 5.0 else "  OVER"
        print(f"{'gain solve, n = 4':28} {seconds:8.2f} {'':16} {cost.megabytes:4.0f}  5.0 s{word}")
        late |= not compare_orders(work, repeats)
        # In one process, as the yardstick is: the processor time of workers is not counted.
        swept = (*cli, "sweep", str(EXAMPLE), "--over", SWEPT, "--workers", "1", "--quiet")
        cost, alone = run(*swept), run(*whole).processor
        late |= cost.exit_code != 0 or cost.processor > 10.0 * alone
        print(
            f"{'sweep of 20 points, n = 2':28} {cost.seconds:8.2f} {cost.processor:6.2f} {'':9}"
            f" {cost.megabytes:4.0f}  10 x one synthesis (now {cost.processor / alone:.1f} x)"
        )
    return int(late)


if __name__ == "__main__":
    sys.exit(main())
