"""Some runs of a campaign, from their numbers to a tally: what an engine is given to do."""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass
from importlib.metadata import version
from typing import TYPE_CHECKING

from bfppc_synth.campaign.material import Material, open_loop
from bfppc_synth.campaign.tally import Tally
from bfppc_synth.errors import UsageError
from bfppc_synth.model.trajectory import within
from bfppc_synth.simulation.drawing import Adversary, draw_run, search
from bfppc_synth.simulation.scheme import Coverage

if TYPE_CHECKING:
    from bfppc_synth.simulation.compiled.library import Axes, CompiledLoop, Stop
    from bfppc_synth.simulation.compiled.python import PythonLoop
    from bfppc_synth.simulation.compiled.records import Run
    from bfppc_synth.simulation.drawn import Draw

#: Runs of one call into C: enough to forget the call, few enough for Ctrl-C.
_CALL = 64


class StoppedError(Exception):
    """The batch was asked to end before it was done."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Finished:
    """A run of a campaign as it counts.

    ``draw`` and ``axes`` make it again; ``ratios`` are max |e_i| / p_i of every stage, then
    max |u| / U, and the share of the funnel where there is one.
    """

    number: int
    adversary: Adversary
    draw: Draw
    axes: Axes
    run: Run
    ratios: tuple[float, ...]
    inside: bool


def do_batch(material: Material, seed: int, first: int, count: int, stop: Stop | None) -> Tally:
    """Make the runs ``first`` .. ``first + count - 1`` and count what they came to.

    Raises
    ------
    UsageError
        If this is another version of the tool than the one that asks.
    StoppedError
        If ``stop`` was set meanwhile.
    """
    here = version("bfppc-synth")
    if material.version != here:
        raise UsageError(
            f"--cluster: a worker has bfppc-synth {here}, the campaign {material.version}; fix:"
            " install the same version everywhere"
        )
    tally = empty_tally(material)
    for begin in range(first, first + count, _CALL):
        numbers = range(begin, min(begin + _CALL, first + count))
        for finished in make_runs(material, seed, numbers, stop):
            tally.count(
                finished.number, finished.adversary, finished.ratios, inside=finished.inside
            )
    return tally


def make_runs(
    material: Material, seed: int, numbers: range, stop: Stop | None = None
) -> list[Finished]:
    """Make some runs of a campaign; each depends on its seed and number alone."""
    loop = open_loop(material)
    drawn = [(number, *draw_run(material.choices, seed, number)) for number in numbers]
    plain = [item for item in drawn if item[1] is not Adversary.SEARCH]
    runs = _called(loop, [draw for _, _, draw in plain], material.axes, stop)
    found = [
        _settled(material, loop, number, adversary, draw, run)
        for (number, adversary, draw), run in zip(plain, runs, strict=True)
    ]
    for number, adversary, draw in drawn:
        if adversary is Adversary.SEARCH:

            def reach(trial: Draw) -> float:
                (run,) = _called(loop, [trial], material.axes, stop)
                # Whatever leaves is what the search was for.
                inside = _inside(material, run)
                return max(ratios(material, run)[: _errors(material)]) if inside else math.inf

            best, _ = search(material.choices, draw, reach)
            (run,) = _called(loop, [best], material.axes, stop)
            found.append(_settled(material, loop, number, adversary, best, run))
    return sorted(found, key=lambda item: item.number)


def ratios(material: Material, run: Run) -> tuple[float, ...]:
    """Compare what a run came to with what is certified: errors of every stage, command, funnel."""
    met = dict(run.peaks)
    found = [
        _share(peak, width)
        for stage, widths in enumerate(material.widths, start=1)
        for peak, width in zip(met.get(stage, (0.0,) * len(widths)), widths, strict=True)
    ]
    found.append(_share(run.peak_u, material.peak))
    if _has_funnel(material):
        found.append(run.share or 0.0)
    return tuple(found)


def _settled(
    material: Material,
    loop: CompiledLoop | PythonLoop,
    number: int,
    adversary: Adversary,
    draw: Draw,
    run: Run,
) -> Finished:
    """Judge a run; once more with finer steps before a covered run counts as outside."""
    axes, inside = material.axes, _inside(material, run)
    if not inside and material.scheme.coverage is Coverage.COVERED:
        (again,) = loop.run([draw], material.finer)
        if _inside(material, again):
            axes, run, inside = material.finer, again, True
    return Finished(
        number=number,
        adversary=adversary,
        draw=draw,
        axes=axes,
        run=run,
        ratios=ratios(material, run),
        inside=inside,
    )


def _inside(material: Material, run: Run) -> bool:
    """Judge as ``simulation.loop`` does."""
    tube = all(within(peaks, material.widths[stage - 1]) for stage, peaks in run.peaks)
    tube = tube and within((run.share or 0.0,), (1.0,))
    return run.complete and tube and within((run.peak_u,), (material.peak,))


def _called(
    loop: CompiledLoop | PythonLoop, draws: list[Draw], axes: Axes, stop: Stop | None
) -> list[Run]:
    runs = loop.run(draws, axes, stop)
    if len(runs) < len(draws):
        raise StoppedError
    return runs


def _share(value: float, bound: float) -> float:
    """Divide; a number stands for infinity, because results are JSON."""
    share = value / bound if bound > 0.0 else (0.0 if value == 0.0 else math.inf)
    return share if math.isfinite(share) else sys.float_info.max


def empty_tally(material: Material) -> Tally:
    """Begin to count the runs of a campaign."""
    return Tally.empty(_errors(material), funnel=_has_funnel(material))


def _errors(material: Material) -> int:
    return sum(len(widths) for widths in material.widths)


def _has_funnel(material: Material) -> bool:
    return material.design.plant.funnel is not None
