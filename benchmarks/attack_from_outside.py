"""Attack every generated controller from outside, and find how far its gains may be weakened.

``make conservatism`` writes docs/conservatism.md. Nothing of the package is imported: a loop of
its own reads report.json for the plant and the promise, and controller.py for the law, whose
constants it scales. Plants are pushed by numpy, all runs of an example at once.
"""

from __future__ import annotations

import json
import math
import re
import sys
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import sympy as sp

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "conservatism.md"
FACTORS = (
    *(0.95, 0.9, 0.85, 0.8, 0.75, 0.7, 0.65, 0.6, 0.55, 0.5, 0.45, 0.4, 0.35, 0.3, 0.25, 0.2),
    *(0.15, 0.1, 0.07, 0.05, 0.03, 0.02, 0.01, 0.005, 0.002, 0.001),
)
STRATEGIES = ("last", "first", "nearest", "swing", "constant", "random")
HORIZON = 3.2
# A law without a sample period is held for this share of its own time constant.
HELD = 0.2
# Parameters are chosen at every so many samples.
CHOSEN = 10
HEAD = """\
# How conservative the certificates are

Written by `make conservatism` (`benchmarks/attack_from_outside.py`), which shares no code with the
package: it reads `report.json` for the plant and the promise and `controller.py` for the law. Every
feedback phi_i (of the last stage) is multiplied by a factor, the half-widths p_i stay, and
adversaries push the plant: f anywhere within its declared bound, g at either end, every parameter
at either end of its range, noise against what is pushed, commands as late and held as long as
`sampling` allows. They push e_n, e_1 or the error
nearest to its bound outward, turn when e_1 stops moving, keep one direction, or turn at random
times. A factor is found when one run leaves: some |e_i| > p_i (first column), or |e_1| > p_1, the
promise about the output (second column). The largest factor of those tried is printed; with
certified gains (factor 1) no run leaves. A low factor means that the bounds of the certificate are
far from what these adversaries can do to this plant: the certificate is conservative there, or its
promise is about more plants than the file's. The factors are estimates, found by simulation.

Where the file declares no bound and no range, nothing is left to push with, and the disturbance is
the plant itself, or with center nominal nothing but the hold: no factor may be low enough then.
Runs last 3.2 s, with center nominal 1.6 times the transition. Laws without a sample period are held
for one fifth of the time constant 1/(g phi_n') of their last step.

| example | what may be pushed | step [s] | runs | an error leaves at | the output leaves at |
|---|---|---|---|---|---|
"""


@dataclass(frozen=True, kw_only=True)
class Found:
    """What the adversaries came to: for each factor the largest |e_i|/p_i, shape (n,)."""

    name: str
    pushed: str
    step: float
    runs: int
    shares: dict[float, np.ndarray]

    def largest(self, errors: slice) -> float | None:
        """Largest factor at which one of the errors left."""
        left = [factor for factor, share in self.shares.items() if share[errors].max() > 1.0]
        return max(left, default=None)


class Folder:
    """A generated folder as an outsider reads it."""

    def __init__(self, path: Path) -> None:
        self.report: dict[str, Any] = json.loads((path / "report.json").read_text("utf-8"))
        self.source = (path / "controller.py").read_text(encoding="utf-8")
        self.name = self.report["name"]
        self.n = self.report["order"]
        self.p = np.array(self.report["omega"]["p"], dtype=float)
        plant = self.report["plant"]
        self.ranges = [tuple(map(float, ends)) for ends in plant["parameters"].values()]
        self.names = [*self.report["states"], *plant["parameters"], "t"]
        self.symbols = {name: sp.Symbol(name, real=True) for name in self.names}
        self.nominal = self.report["center"] == "nominal"
        self.channels = [self._channel(row) for row in plant["dynamics"]]
        self.start = np.array([self.report["initial"][x] for x in self.report["states"]])
        quantizers = self.report["measurement"]["quantizer"]
        if any(set(item) - {"kind", "step"} for item in quantizers):
            raise SystemExit(f"{self.name}: only plain rounding is attacked here")
        self.steps = [item.get("step", 0.0) for item in quantizers]
        sampling = self.report["sampling"]
        self.period = float(sampling["period"])
        self.late = float(sampling["delay"])
        self.noise = np.array(self.report["measurement"]["noise"], dtype=float)[:, None]
        actuator = self.report.get("actuator") or {}
        self.error = float(actuator.get("error") or 0.0)
        if self.late > self.period:
            raise SystemExit(f"{self.name}: delays beyond a sample are not attacked here")
        # What moves the center is over by then: rho after pi t_s, a transition after T_s.
        transition = self.report["performance"].get("transition")
        self.horizon = HORIZON if transition is None else 1.6 * float(transition)
        if self.period == 0.0:
            slope = self.report["bounds"]["slope"] * self.report["bounds"]["G"][-1]
            self.period = HELD / slope

    def expression(self, text: str) -> sp.Expr:
        """Read an expression of the plant file."""
        return sp.sympify(text, locals=self.symbols)

    def function(self, expression: sp.Expr) -> Any:
        """Make a numpy function of the states, the parameters and t."""
        return sp.lambdify([self.symbols[name] for name in self.names], expression, "numpy")

    def _channel(self, row: dict[str, Any]) -> tuple[Any, ...]:
        """Return f or None, its bound or None, lower and upper g, disturbance; all functions."""
        texts = {key: row[key] for key in ("f", "f_bound", "g", "g_min", "g_bound", "disturbance")}
        read = {key: None if text is None else self.expression(text) for key, text in texts.items()}
        gain = read["g"]
        if gain is None and read["g_min"] is None:
            gain = sp.Integer(1)
        low = gain if read["g_min"] is None or self.nominal else read["g_min"]
        high = gain if read["g_bound"] is None or self.nominal else read["g_bound"]
        bound = None if self.nominal and read["f"] is not None else read["f_bound"]
        found = (read["f"], bound, low, high, read["disturbance"])
        return tuple(None if item is None else self.function(item) for item in found)

    def pushed(self) -> str:
        """Say what the file leaves open."""
        words = []
        if any(row[1] is not None for row in self.channels):
            words.append("f within f_bound")
        if any(row["g_min"] or row["g_bound"] for row in self.report["plant"]["dynamics"]):
            words.append("g between its bounds")
        if any(low < high for low, high in self.ranges):
            words.append("parameters in their ranges")
        if any(row[4] is not None for row in self.channels):
            words.append("disturbances")
        if self.noise.any():
            words.append("noise")
        if self.error:
            words.append("actuator error")
        if (self.start[:, 0] < self.start[:, 1]).any():
            words.append("the start")
        return ", ".join(words) or "nothing"

    def law(self, factor: float) -> tuple[type, list[dict[str, float]]]:
        """Load the controller with weakened gains; its class, and the shapes that it applies."""
        begin, end = "# CERTIFIED CONSTANTS BEGIN\n", "# CERTIFIED CONSTANTS END"
        head, _, rest = self.source.partition(begin)
        block, _, tail = rest.partition(end)
        # phi_i times the factor: M tanh(M e / epsilon) keeps its width where epsilon goes along.
        block = re.sub(
            r"^((?:k|M|epsilon|c|gamma)_\d+) = (.*)$",
            lambda found: f"{found[1]} = {float(found[2]) * factor!r}",
            block,
            flags=re.MULTILINE,
        )
        module = ModuleType(f"weakened_{self.name}")
        exec(head + begin + block + end + tail, module.__dict__)  # noqa: S102 -- the folder's own
        shapes = []
        for i in range(1, self.n + 1):
            value = {name: getattr(module, f"{name}_{i}", 0.0) for name in ("k", "M", "c", "N")}
            value["epsilon"] = getattr(module, f"epsilon_{i}", 1.0)
            if hasattr(module, f"gamma_{i}"):
                value["k"] = getattr(module, f"gamma_{i}") * getattr(module, f"H_{i}_0")
            shapes.append(value)
        return module.Controller, shapes


class Center:
    """r_1..r_n of every run; shape (n, L) at a time."""

    def __init__(self, folder: Folder, measured: np.ndarray) -> None:
        self.folder, self.measured = folder, measured
        report = folder.report
        if report["reference"]["kind"] != "expression":
            raise SystemExit(f"{folder.name}: a reference given at run time is not attacked here")
        t = folder.symbols["t"]
        y_d = folder.expression(report["reference"]["expression"])
        count = folder.n + 1 if folder.nominal else 1
        self.jets = [sp.lambdify([t], sp.diff(y_d, t, j), "numpy") for j in range(count)]
        self.offset = measured[0] - self.y_d(0.0)
        runs = measured.shape[1]
        self.switched = np.zeros(runs)
        self.anchor = np.zeros(runs)
        self.fading = measured.copy()
        if folder.nominal:
            self._prepare_nominal()

    def y_d(self, t: float, j: int = 0) -> float:
        """Return derivative j of the reference."""
        return float(self.jets[j](t))

    def switch(self, run: int, t: float, error: float, measured: np.ndarray) -> None:
        """Begin the last stage of a law in stages: its center starts where the state is."""
        self.switched[run], self.anchor[run] = t, error
        self.fading[:, run] = measured

    def at(self, t: float) -> np.ndarray:
        """Return r_1..r_n."""
        if self.folder.nominal:
            return self._nominal(t)
        rho = self.folder.report["performance"]["rho"]
        since = t - self.switched
        rows = [self.y_d(t) + self._fade(rho[0], t) * self.offset]
        rows[0] = rows[0] + self._fade(rho[0], since) * self.anchor
        rows += [self._fade(rho[i], since) * self.fading[i] for i in range(1, self.folder.n)]
        return np.array(rows)

    @staticmethod
    def _fade(rho: dict[str, Any], t: Any) -> Any:
        if rho["kind"] != "cosine":
            raise SystemExit("only the performance function (52) is attacked here")
        scaled = np.minimum(np.asarray(t) / rho["t_s"], math.pi)
        return 0.5 * (1.0 + np.cos(scaled))

    def _prepare_nominal(self) -> None:
        """Find b of docs/theory.md section 4 by its 2n + 2 conditions, r by differentiation."""
        folder = self.folder
        n, rows = folder.n, folder.report["plant"]["dynamics"]
        parameters = list(folder.report["plant"]["parameters"])
        middle = {
            folder.symbols[name]: (sp.Rational(repr(low)) + sp.Rational(repr(high))) / 2
            for name, (low, high) in zip(parameters, folder.ranges, strict=True)
        }
        f = [
            (folder.expression(row["f"] or "0") - sum(map(folder.expression, terms))).subs(middle)
            for row, terms in zip(rows, folder.report["nominal"]["left_out"], strict=True)
        ]
        g = [folder.expression(row["g"] or "1").subs(middle) for row in rows]
        x = [folder.symbols[name] for name in folder.report["states"]]
        # x_1 and its derivatives along the nominal plant, as functions of the state.
        course = [x[0]]
        for _ in range(n - 1):
            motion = [a + b * c for a, b, c in zip(f, g, [*x[1:], sp.Integer(0)], strict=True)]
            pairs = zip(x, motion, strict=True)
            course.append(sum(sp.diff(course[-1], y) * rate for y, rate in pairs))
        begun = [sp.lambdify(x, item, "numpy")(*self.measured) for item in course]
        self.T = T = float(folder.report["performance"]["transition"])
        size = 2 * n + 2
        table, given = np.zeros((size, size)), np.zeros((size, self.measured.shape[1]))
        for j in range(n):
            table[j, j] = math.factorial(j)
            given[j] = (begun[j] - self.y_d(0.0, j)) * T**j
        for j in range(n + 2):
            table[n + j] = [math.perm(m, j) if m >= j else 0.0 for m in range(size)]
        self.b = np.linalg.solve(table, given)
        z = sp.symbols(f"z0:{n + 1}", real=True)
        r = [z[0]]
        for i in range(n - 1):
            at = dict(zip(x, r, strict=False))
            rate = sum(sp.diff(r[-1], z[j]) * z[j + 1] for j in range(n))
            r.append((rate - f[i].subs(at)) / g[i].subs(at))
        self.follow = sp.lambdify(z, r, "numpy")

    def _nominal(self, t: float) -> np.ndarray:
        n, s = self.folder.n, min(t / self.T, 1.0)
        jets = []
        for j in range(n + 1):
            row = [math.perm(m, j) * s ** (m - j) if m >= j else 0.0 for m in range(2 * n + 2)]
            jets.append(self.y_d(t, j) + np.array(row) @ self.b / self.T**j)
        rows = self.follow(*jets)
        return np.array([np.broadcast_to(row, jets[0].shape) for row in rows])


class Attack:
    """All runs of an example: factors times strategies times repeats."""

    def __init__(self, folder: Folder, factors: tuple[float, ...], repeats: int) -> None:
        self.folder = folder
        lanes = [
            (factor, strategy, turn)
            for factor in factors
            for strategy in STRATEGIES
            for turn in range(repeats)
        ]
        if folder.pushed() == "nothing":
            lanes = [(factor, "constant", 0) for factor in factors]
        self.factors = np.array([lane[0] for lane in lanes])
        self.strategies = np.array([lane[1] for lane in lanes])
        self.runs = len(lanes)
        laws = {factor: folder.law(factor) for factor in factors}
        self.laws = [laws[lane[0]][0]() for lane in lanes]
        shapes = [laws[lane[0]][1] for lane in lanes]
        self.shapes = [
            {name: np.array([shape[i][name] for shape in shapes]) for name in shapes[0][i]}
            for i in range(folder.n)
        ]
        self.random = np.random.default_rng(1)
        pick = self.random.random((folder.n, self.runs)) < 0.5
        self.x = np.where(pick, folder.start[:, :1], folder.start[:, 1:])
        self.sign = np.array([1.0 if lane[2] % 2 == 0 else -1.0 for lane in lanes])
        draws = self.random.random(self.runs)
        self.dwell = 10.0 ** (-3.0 + 2.7 * draws) * HORIZON
        ends = [sorted(set(pair)) for pair in folder.ranges]
        self.corners = [()]
        for pair in ends:
            self.corners = [(*corner, end) for corner in self.corners for end in pair]

    def errors(self, r: np.ndarray) -> np.ndarray:
        """e_1..e_n with the law as it was weakened."""
        rows, carried = [], 0.0
        for i, shape in enumerate(self.shapes):
            e = self.x[i] - r[i] + carried
            carried = shape["k"] * e + shape["M"] * np.tanh(shape["M"] * e / shape["epsilon"])
            carried = carried + shape["c"] * np.sign(e) * np.abs(e) ** shape["N"]
            rows.append(e)
        return np.array(rows)

    def rates(self, t: float, x: np.ndarray, u: np.ndarray, parameters: list[Any]) -> np.ndarray:
        """dx_i under the present push."""
        rows = []
        for i, (f, bound, low, high, disturbance) in enumerate(self.folder.channels):
            above = x[i + 1] if i + 1 < len(x) else u
            values = (*x, *parameters, t)
            force = f(*values) if bound is None else self.sign * bound(*values)
            outward = self.sign * above > 0.0
            gain = np.where(outward, high(*values), low(*values))
            if disturbance is not None:
                force = force + self.sign * disturbance(*values)
            rows.append(force + gain * above)
        return np.array(rows)

    def decide(self, t: float, e: np.ndarray, before: np.ndarray) -> None:
        """Choose the direction of every run."""
        share = e / self.folder.p[:, None]
        nearest = share[np.abs(share).argmax(axis=0), np.arange(self.runs)]
        for name, watched in (("last", e[-1]), ("first", e[0]), ("nearest", nearest)):
            self.sign = np.where(
                self.strategies == name, np.where(watched < 0.0, -1.0, 1.0), self.sign
            )
        stopped = self.sign * (e[0] - before[0]) <= 0.0
        swing = (self.strategies == "swing") & stopped & (t - self.turned > self.dwell)
        chance = self.random.random(self.runs) < self.folder.period / self.dwell
        turn = swing | ((self.strategies == "random") & chance)
        self.sign = np.where(turn, -self.sign, self.sign)
        self.turned = np.where(turn, t, self.turned)

    def measured(self) -> np.ndarray:
        """Quantize, and add the noise that hides the push."""
        rows = [
            x if step == 0.0 else step * np.floor(x / step + 0.5)
            for x, step in zip(self.x, self.folder.steps, strict=True)
        ]
        return np.array(rows) - self.sign * self.folder.noise

    def run(self, horizon: float) -> np.ndarray:
        """Largest |e_i| / p_i of every run over the time in which they are promised, (n, L)."""
        folder, h = self.folder, self.folder.period
        q = self.measured()
        center = Center(folder, q)
        self.turned = np.zeros(self.runs)
        worst = np.zeros((folder.n, self.runs))
        last = len(folder.report["stages"]) if folder.report.get("stages") else 1
        staged = np.full(self.runs, last == 1)
        alive = np.ones(self.runs, dtype=bool)
        before = np.zeros((folder.n, self.runs))
        u, held = np.zeros(self.runs), np.zeros(self.runs)
        parameters: list[np.ndarray] = []
        for k in range(round(horizon / h) + 1):
            t = k * h
            q = self.measured()
            rows = q.T.tolist()
            for run in np.flatnonzero(alive).tolist():
                u[run] = self.laws[run].step(t, rows[run])
                if not staged[run] and self.laws[run].stage == last:
                    staged[run] = True
                    r_1 = center.at(t)[0, run]
                    center.switch(run, t, q[0, run] - r_1, q[:, run])
            e = self.errors(center.at(t))
            # No number is outside of every tube.
            now = np.nan_to_num(np.abs(e) / folder.p[:, None], nan=math.inf)
            worst = np.where(staged & alive, np.maximum(worst, now), worst)
            alive &= (now[0] <= 1.0) | ~staged
            alive &= (np.abs(self.x) < 1e6).all(axis=0)
            # A factor at which the output has left is known: its other runs add nothing.
            alive &= ~np.isin(self.factors, self.factors[worst[0] > 1.0])
            if not alive.any():
                break
            self.decide(t, e, before)
            before = e
            if k % CHOSEN == 0:
                parameters = self.choose(t, u)
            error = self.sign * folder.error
            with np.errstate(all="ignore"):
                if folder.late:
                    self.advance(t, folder.late, held + error, parameters)
                if folder.late < h:
                    self.advance(t + folder.late, h - folder.late, u + error, parameters)
            held = u.copy()
            self.x = np.where(alive, self.x, folder.start[:, :1])
        return worst

    def choose(self, t: float, u: np.ndarray) -> list[np.ndarray]:
        """Take the corner of the parameters that pushes hardest, each rate by its own size."""
        if not self.corners[0]:
            return []
        sizes = np.array(self.folder.report["bounds"]["D"])[:, None]
        scale = np.where(sizes > 0.0, sizes, 1.0)
        best = np.full(self.runs, -math.inf)
        chosen = [np.zeros(self.runs) for _ in self.corners[0]]
        for corner in self.corners:
            with np.errstate(all="ignore"):
                rates = self.rates(t, self.x, u, list(corner))
            gain = self.sign * (rates / scale).sum(axis=0)
            better = gain > best
            best = np.where(better, gain, best)
            chosen = [np.where(better, new, old) for new, old in zip(corner, chosen, strict=True)]
        return chosen

    def advance(self, t: float, h: float, u: np.ndarray, parameters: list[np.ndarray]) -> None:
        """One classical Runge-Kutta step."""
        k1 = self.rates(t, self.x, u, parameters)
        k2 = self.rates(t + 0.5 * h, self.x + 0.5 * h * k1, u, parameters)
        k3 = self.rates(t + 0.5 * h, self.x + 0.5 * h * k2, u, parameters)
        k4 = self.rates(t + h, self.x + h * k3, u, parameters)
        self.x = self.x + h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)


def attack(
    path: Path,
    *,
    factors: tuple[float, ...] = (1.0, *FACTORS),
    repeats: int = 2,
    steps: int | None = None,
) -> Found:
    """Attack one folder with its gains times every factor; ``steps`` end it early."""
    folder = Folder(path)
    horizon = folder.horizon if steps is None else min(folder.horizon, steps * folder.period)
    runs = Attack(folder, factors, repeats)
    worst = runs.run(horizon)
    shares = {factor: worst[:, runs.factors == factor].max(axis=1) for factor in factors}
    return Found(
        name=folder.name,
        pushed=folder.pushed(),
        step=folder.period,
        runs=runs.runs // len(factors),
        shares=shares,
    )


def line(found: Found) -> str:
    """One row of the table; certified gains must not be in it."""
    if found.shares[1.0].max() > 1.0:
        raise SystemExit(f"{found.name}: the certified gains lost the tube: {found.shares[1.0]}")

    def shown(factor: float | None) -> str:
        return f"none down to {min(FACTORS):g}" if factor is None else f"{factor:g}"

    any_error, output = found.largest(slice(None)), found.largest(slice(0, 1))
    cells = (found.name, found.pushed, f"{found.step:.2g}", str(found.runs))
    return f"| {' | '.join(cells)} | {shown(any_error)} | {shown(output)} |\n"


def main() -> None:
    """Write the page, or print the rows of the folders that are named."""
    named = [Path(word) for word in sys.argv[1:]]
    rows = []
    for path in named or sorted((ROOT / "generated").iterdir()):
        rows.append(line(attack(path)))
        print(rows[-1], end="", flush=True)
    if not named:
        PAGE.write_text(HEAD + "".join(rows), encoding="utf-8")


if __name__ == "__main__":
    main()
