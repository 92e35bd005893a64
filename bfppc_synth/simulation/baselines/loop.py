"""One closed loop for many gains and many runs at once: sample, hold, RK4 between samples."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from bfppc_synth.simulation.baselines.cases import EPOCHS
from bfppc_synth.simulation.baselines.plant import advance
from bfppc_synth.simulation.recorder import DIVERGED

if TYPE_CHECKING:
    from bfppc_synth.simulation.baselines.arrays import Array
    from bfppc_synth.simulation.baselines.cases import Cases
    from bfppc_synth.simulation.baselines.method import Law


@dataclass(frozen=True, slots=True, kw_only=True)
class Result:
    """What R runs under C sets of gains came to, arrays of shape (R, C).

    ``inside``: the whole horizon in the envelope; ``undefined``: the law had no value for a
    finite measurement; ``diverged``: a state passed 1e12; ``worst`` is the largest share of
    the envelope; ``energy`` sums u^2 over ``samples`` commands; ``changes`` counts level
    changes of all quantizers. ``output`` is y of run 0 with the first ``kept`` sets of gains,
    (K+1, kept), NaN after its end.
    """

    inside: Array
    undefined: Array
    diverged: Array
    worst: Array
    peak: Array
    energy: Array
    samples: Array
    changes: Array
    output: Array

    @property
    def share(self) -> Array:
        """Share of the runs inside, per set of gains, shape (C,)."""
        share: Array = self.inside.mean(axis=0)
        return share

    def column(self, j: int) -> Result:
        """Return what one set of gains came to; only its own output, if it was kept."""
        one = slice(j, j + 1)
        arrays = ("inside", "undefined", "diverged", "worst", "peak", "energy", "samples")
        cut = {name: getattr(self, name)[:, one] for name in (*arrays, "changes")}
        return replace(self, **cut, output=self.output[:, one])


def close_loop(cases: Cases, law: Law, *, candidates: int, kept: int = 0) -> Result:
    """Run every set of gains against every case.

    Parameters
    ----------
    cases : Cases
        R runs.
    law : Law
        Its gains broadcast to (R, candidates).
    candidates : int
        Number C of sets of gains.
    kept : int
        Of how many of them the output of run 0 is recorded.

    Returns
    -------
    Result
        A loop without a command, or with a state beyond every bound, ends there.

    References
    ----------
    docs/theory.md section 3, Timing: a command acts after the whole delay and is held.
    """
    with np.errstate(all="ignore"):
        return _close(cases, law, (cases.runs, candidates), kept)


def _close(cases: Cases, law: Law, shape: tuple[int, int], kept: int) -> Result:
    clock, design = cases.clock, cases.design
    # A delay is whole samples, and a part of one in which the command before is still held.
    held = math.floor(clock.delay / clock.period + 1e-9)
    late = max(0.0, clock.delay - held * clock.period)
    waiting = deque([np.zeros(shape)] * (held + 1))
    limit = design.spec.actuator.limit
    reach = math.inf if limit is None else limit.approximate
    x = [np.broadcast_to(column, shape).copy() for column in cases.start]
    alive = np.ones(shape, dtype=bool)
    undefined, diverged = np.zeros(shape, dtype=bool), np.zeros(shape, dtype=bool)
    worst, peak, energy = np.zeros(shape), np.zeros(shape), np.zeros(shape)
    samples, changes = np.zeros(shape), np.zeros(shape)
    output = np.full((clock.count + 1, kept), math.nan)
    measures, before = cases.measures(), [np.zeros(shape)] * len(x)
    for k in range(clock.count + 1):
        gone = np.abs(x[0] - cases.path.y_d[k][:, None]) / cases.path.edge[k][:, None]
        np.maximum(worst, gone, out=worst, where=alive)
        output[k] = np.where(alive[0, :kept], x[0][0, :kept], math.nan)
        levels = [measure(state) for measure, state in zip(measures, x, strict=True)]
        if k:
            moved = sum(a != b for a, b in zip(levels, before, strict=True))
            changes += np.where(alive, moved, 0.0)
        before = levels
        noise = cases.noise[min(k, len(cases.noise) - 1)][:, :, None]
        u = law.command(k, [a + b for a, b in zip(levels, noise, strict=True)])
        u = np.clip(u, -reach, reach) if limit is not None else u
        good = np.isfinite(u)
        undefined |= alive & ~good
        alive &= good
        u = np.where(alive, u, 0.0)
        np.maximum(peak, np.abs(u), out=peak)
        energy += u * u
        samples += alive
        if k == clock.count or not alive.any():
            break
        waiting.append(u)
        x = _hold(cases, k, x, (waiting.popleft(), waiting[0]), late)
        fine = np.abs(x[0]) <= DIVERGED
        for state in x[1:]:
            fine &= np.abs(state) <= DIVERGED
        diverged |= alive & ~fine
        alive &= fine
        # A loop that has ended rests where it cannot disturb the others.
        x = [np.where(alive, state, 0.0) for state in x]
    ended = undefined | diverged
    return Result(
        inside=(~ended & (worst <= 1.0 + 1e-9)).astype(float),
        undefined=undefined.astype(float),
        diverged=diverged.astype(float),
        worst=worst,
        peak=peak,
        energy=energy,
        samples=samples,
        changes=changes,
        output=output,
    )


def _hold(
    cases: Cases, k: int, x: list[Array], commands: tuple[Array, Array], late: float
) -> list[Array]:
    """Move the plant from sample k to the next: first under the old command, then the new."""
    clock = cases.clock
    table = cases.arguments[min(k * EPOCHS // (clock.count + 1), EPOCHS - 1)]
    *arguments, error = [row[:, None] for row in table]
    t, longest = k * clock.period, clock.period / clock.substeps
    for length, u in zip((late, clock.period - late), commands, strict=True):
        parts = math.ceil(length / longest - 1e-9)
        for _ in range(parts):
            x = advance(cases.rates, t, length / parts, x, u + error, arguments, cases.free)
            t += length / parts
    return x
