"""Cost of one C step against CasADi's generated C for the same law, in one run: ``make bench``.

The law is that of a plant of order n made by hand, every stage with its tanh, center
performance. Ours screens its inputs and says a status, CasADi's does neither. Both are compiled
alike and called in turns on the same samples; the smallest time of each counts.
"""

from __future__ import annotations

import argparse
import importlib.util
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from types import ModuleType

    from bfppc_synth.model.design import Design

ROOT = Path(__file__).resolve().parents[1]
FLAGS = ("-std=c99", "-O2", "-ffp-contract=off")
#: Gains of every stage: k, M, epsilon, c, N. The second law lacks the power, CasADi's worst.
GAINS = {"every term": (1.5, 1.25, 0.5, 0.5, 3), "k and tanh": (1.5, 1.25, 0.5, 0.0, 3)}
#: Without a power the arithmetic is the same, and screening and status come on top.
LARGEST = {"every term": 1.0, "k and tanh": 1.1}
DRIVER = """\
#define _POSIX_C_SOURCE 199309L
#include <math.h>
#include <stdio.h>
#include <time.h>
#include "law.h"
#define N law_ORDER
#define COUNT 2048
int casadi_law(const double **arg, double **res, long long *iw, double *w, int mem);
static double t[COUNT], x[COUNT][N], y_d[COUNT], ours[COUNT], theirs[COUNT], latched[N];
static double now(void)
{
    struct timespec at;
    clock_gettime(CLOCK_MONOTONIC, &at);
    return 1e9 * (double)at.tv_sec + (double)at.tv_nsec;
}
static void run_ours(law_state *s)
{
    for (int k = 0; k < COUNT; ++k) {
        (void)law_step(s, t[k], x[k], y_d[k], &ours[k]);
    }
}
static void run_theirs(void)
{
    static double w[4096];
    static long long iw[64];
    for (int k = 0; k < COUNT; ++k) {
        const double *arg[] = {&t[k], x[k], &y_d[k], latched};
        double *res[] = {&theirs[k]};
        (void)casadi_law(arg, res, iw, w, 0);
    }
}
int main(void)
{
    double best[2] = {1e300, 1e300}, apart = 0.0;
    unsigned seed = 1;
    law_state s;
    law_reset(&s);
    for (int k = 0; k < COUNT; ++k) {
        double phi = 0.0;
        t[k] = 10.0 * k / COUNT;
        y_d[k] = sin(t[k]);
        for (int i = 0; i < N; ++i) {
            seed = 1664525U * seed + 1013904223U;
            const double e = (k > 0) * 0.04 * ((double)(seed >> 8) / 8388608.0 - 1.0);
            x[k][i] = (i == 0 ? y_d[k] : 0.0) - phi + e;
            phi = KK * e + MM * tanh(MM * e / EE) + CC * e * e * e;
        }
    }
    latched[0] = x[0][0] - y_d[0];
    for (int i = 1; i < N; ++i) {
        latched[i] = x[0][i];
    }
    for (int round = 0; round < ROUNDS; ++round) {
        double start = now();
        law_reset(&s);
        run_ours(&s);
        double middle = now();
        run_theirs();
        double end = now();
        best[0] = fmin(best[0], middle - start);
        best[1] = fmin(best[1], end - middle);
    }
    for (int k = 0; k < COUNT; ++k) {
        apart = fmax(apart, fabs(ours[k] - theirs[k]) / (1.0 + fabs(theirs[k])));
    }
    printf("%.17g %.17g %.17g\\n", best[0] / COUNT, best[1] / COUNT, apart);
    return 0;
}
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Pair:
    """Nanoseconds a step of both, and how far their commands are apart at most."""

    law: str
    order: int
    ours: float
    casadi: float
    apart: float


def handmade() -> ModuleType:
    """Load the designs that the unit tests make by hand."""
    place = ROOT / "tests" / "unit" / "codegen" / "handmade.py"
    found = importlib.util.spec_from_file_location("handmade_for_bench", place)
    if found is None or found.loader is None:
        raise SystemExit(f"{place} is missing")
    module = importlib.util.module_from_spec(found)
    found.loader.exec_module(module)
    return module


def chain(kind: str, order: int) -> Design:
    """Make a law of any order by hand."""
    made = handmade()
    k, bend, epsilon, c, power = GAINS[kind]
    design: Design = made.make_design(
        name="law",
        gains=(made.shape(k=k, M=bend, epsilon=epsilon, c=c, N=power),) * order,
        p=(0.05,) * order,
        initial=(("-1", "1"),) * order,
        X=(100.0,) * order,
    )
    return design


def write_casadi(kind: str, order: int, limit: float, folder: Path) -> None:
    """Generate the same law by CasADi, clamp included."""
    import casadi as ca

    t, x, y_d, latched = (
        ca.SX.sym(name, size)
        for name, size in zip(("t", "x", "y", "a"), (1, order, 1, order), strict=True)
    )
    k, bend, epsilon, c, power = GAINS[kind]
    rho = ca.if_else(t < ca.pi, 0.5 * (1 + ca.cos(t)), 0)
    phi = ca.SX(0)
    for i in range(order):
        r = rho * latched[i] + (y_d if i == 0 else 0)
        e = (x[i] - r) + phi
        phi = k * e + bend * ca.tanh(bend * e / epsilon) + c * e**power
    u = ca.fmin(ca.fmax(-phi, -limit), limit)
    law = ca.Function("casadi_law", [t, x, y_d, latched], [u])
    generator = ca.CodeGenerator("casadi_law.c")
    generator.add(law)
    generator.generate(f"{folder}/")


def measure(kind: str, order: int, *, rounds: int = 200) -> Pair:
    """Time both laws of one order in turns.

    Parameters
    ----------
    kind : str
        A key of ``GAINS``.
    order : int
        n, at most 50.
    rounds : int
        How often each is timed over 2048 samples.

    Returns
    -------
    Pair
        The smallest time of each [ns a step].
    """
    from bfppc_synth.codegen.c import render_c
    from bfppc_synth.codegen.law import build_law
    from bfppc_synth.codegen.provenance import make_provenance

    design = chain(kind, order)
    law = build_law(design)
    files = render_c(law, make_provenance(design))
    k, bend, epsilon, c, _ = GAINS[kind]
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        for path in ("c/include/law.h", "c/src/law.c"):
            (folder / Path(path).name).write_text(files[path])
        write_casadi(kind, order, law.u_max, folder)
        (folder / "driver.c").write_text(DRIVER)
        constants = [
            f"-DKK={k}",
            f"-DMM={bend}",
            f"-DEE={epsilon}",
            f"-DCC={c}",
            f"-DROUNDS={rounds}",
        ]
        sources = ["driver.c", "law.c", "casadi_law.c"]
        command = ["gcc", *FLAGS, *constants, *sources, "-o", "driver", "-lm"]
        subprocess.run(command, cwd=folder, check=True)
        done = subprocess.run(["./driver"], cwd=folder, check=True, capture_output=True, text=True)
    ours, theirs, apart = map(float, done.stdout.split())
    return Pair(law=kind, order=order, ours=ours, casadi=theirs, apart=apart)


def main() -> int:
    """Print the table; 1 if ours costs more than CasADi's, or the laws are not the same."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=400)
    rounds = parser.parse_args().rounds
    print("| law | n | ours, ns a step | CasADi's C, ns a step | ratio |\n|---|---|---|---|---|")
    failed = False
    for kind in GAINS:
        for order in (2, 10, 25, 50):
            pair = measure(kind, order, rounds=rounds)
            ratio = pair.ours / pair.casadi
            print(f"| {kind} | {order} | {pair.ours:.0f} | {pair.casadi:.0f} | {ratio:.2f} |")
            failed |= pair.apart > 1e-9 or (order <= 10 and ratio > LARGEST[kind])
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
