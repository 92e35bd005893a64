"""Run k of a campaign: drawn from the campaign's seed and k alone."""

from __future__ import annotations

import math
import random
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import TYPE_CHECKING

from bfppc_synth.simulation.drawn import Draw, Manner, Segment
from bfppc_synth.simulation.references import Sine, first_references, initial_box, sine
from bfppc_synth.simulation.scheme import Stepping

if TYPE_CHECKING:
    from collections.abc import Callable

    from bfppc_synth.model.design import Design
    from bfppc_synth.model.spec import PlantSpec
    from bfppc_synth.simulation.plant import Dynamics
    from bfppc_synth.simulation.scheme import Scheme

#: Segments of a searched plan.
SEGMENTS = 4

#: Runs that a search tries; the best of them is what counts.
BUDGET = 24


class Adversary(StrEnum):
    """Who a drawn run meets."""

    CONSTANTS = "constants"
    SWITCHING = "switching"
    GREEDY = "greedy"
    SEARCH = "search"


#: A draw in [0, 1) below this limit meets this adversary.
_SHARES = (
    (1.0 / 64.0, Adversary.SEARCH),
    (0.25, Adversary.CONSTANTS),
    (0.6, Adversary.SWITCHING),
    (1.0, Adversary.GREEDY),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Choices:
    """What a run may choose from; plain numbers, so that it can be sent to other machines.

    ``ranges`` of the parameters; ``bounded`` whether a channel declares bounds; ``waves``
    whether the reference is supplied at run time; ``sampled`` whether the controller samples.
    """

    spec: PlantSpec
    order: int
    ranges: tuple[tuple[float, float], ...]
    bounded: bool
    waves: bool
    sampled: bool
    noise: tuple[float, ...]
    error: float
    horizon: float


def choices(design: Design, dynamics: Dynamics, scheme: Scheme, horizon: float) -> Choices:
    """Collect what the runs of a design may choose from."""
    return Choices(
        spec=design.spec,
        order=design.spec.order,
        ranges=dynamics.ranges,
        bounded=dynamics.bounds is not None,
        waves=dynamics.reference is None,
        sampled=scheme.stepping is Stepping.SAMPLED,
        noise=tuple(bound.approximate for bound in design.spec.measurement.noise),
        error=design.spec.actuator.error.approximate,
        horizon=horizon,
    )


def draw_run(choices: Choices, seed: int, number: int) -> tuple[Adversary, Draw]:
    """Draw run ``number`` of the campaign with this seed.

    Parameters
    ----------
    choices : Choices
        What there is to choose from.
    seed, number : int
        The only two numbers that the draw depends on besides.

    Returns
    -------
    tuple[Adversary, Draw]
        Who is met; for a search the run that it begins with.
    """
    source = random.Random(f"campaign/{seed}/{number}")  # noqa: S311 -- reproducible, no secret
    share = source.random()
    adversary = next(name for limit, name in _SHARES if share < limit)
    corners = source.random() < 0.5
    # Of the starts, half are corners of the initial box.
    at_corner = source.random() < 0.5
    box = initial_box(choices.spec)
    start = tuple(source.choice(ends) if at_corner else source.uniform(*ends) for ends in box)
    wave = _wave(choices.spec, start[0], source) if choices.waves else None
    bounded = choices.bounded and source.random() < 0.5
    # Mean time between two decisions: from a two-thousandth to a fifth of the horizon.
    dwell = choices.horizon * 10.0 ** source.uniform(-3.3, -0.7)
    if adversary is Adversary.GREEDY:
        dwell = choices.horizon * 10.0 ** source.uniform(-3.3, -2.0)
    drawn = Draw(
        manner=_MANNERS[adversary],
        start=start,
        wave=wave,
        bounded=bounded,
        corners=corners,
        target=source.randrange(-2, choices.order),
        dwell=dwell,
        late=source.random() < 0.5,
        jitter=choices.sampled and source.random() < 0.25,
        seed=source.getrandbits(64),
    )
    if drawn.manner is Manner.PLAN:
        count = SEGMENTS if adversary is Adversary.SEARCH else 1
        place = [
            source.choice((-1.0, 1.0)) if corners else source.uniform(-1.0, 1.0)
            for _ in range(length(choices, count))
        ]
        drawn = replace(drawn, plan=plan_at(choices, place, count))
    return adversary, drawn


_MANNERS = {
    Adversary.CONSTANTS: Manner.PLAN,
    Adversary.SEARCH: Manner.PLAN,
    Adversary.SWITCHING: Manner.SWITCHING,
    Adversary.GREEDY: Manner.GREEDY,
}


def _wave(spec: PlantSpec, x_1: float, source: random.Random) -> Sine:
    """Draw a sine that keeps every bound on the reference; half of them the fastest."""
    found = sine(spec, source.uniform(*first_references(spec, x_1)), source.choice((-1.0, 1.0)))
    slower = source.uniform(0.0, 1.0) if source.random() < 0.5 else 1.0
    return replace(found, frequency=found.frequency * slower)


def length(choices: Choices, count: int) -> int:
    """Count the numbers that place a plan of ``count`` segments."""
    return count - 1 + count * (len(choices.ranges) + 4 * choices.order + 1)


def plan_at(choices: Choices, place: list[float], count: int) -> tuple[Segment, ...]:
    """Lay a plan out from a point of the cube [-1, 1]^length."""
    n, m, horizon = choices.order, len(choices.ranges), choices.horizon
    times = [0.5 * (1.0 + share) * horizon for share in place[: count - 1]]
    ends = [*sorted(times), math.inf]
    width, segments = m + 4 * n + 1, []
    for index, until in enumerate(ends):
        values = place[count - 1 + index * width : count - 1 + (index + 1) * width]
        parameters = [
            min(max(0.5 * (low + high) + 0.5 * (high - low) * value, low), high)
            for (low, high), value in zip(choices.ranges, values[:m], strict=True)
        ]
        gains = [0.5 * (1.0 + value) for value in values[m + 2 * n : m + 3 * n]]
        noise = zip(values[m + 3 * n : m + 4 * n], choices.noise, strict=True)
        segments.append(
            Segment(
                until=until,
                arguments=(*parameters, *values[m : m + 2 * n], *gains),
                noise=tuple(value * bound for value, bound in noise),
                error=values[-1] * choices.error,
            )
        )
    return tuple(segments)


def search(choices: Choices, drawn: Draw, evaluate: Callable[[Draw], float]) -> tuple[Draw, float]:
    """Look for the plan that brings an error nearest to its facet; no gradients.

    One parent, one child, and a step length that grows by success (Rechenberg's rule of one
    in five): the function jumps wherever a quantizer or the clamp does.

    Parameters
    ----------
    choices : Choices
        What there is to choose from.
    drawn : Draw
        Where to begin; its plan is replaced.
    evaluate : callable
        Largest |e_i| / p_i of a run.

    Returns
    -------
    tuple[Draw, float]
        The best run of ``BUDGET``, and what it came to.
    """
    source = random.Random(drawn.seed)  # noqa: S311 -- reproducible, no secret
    size = length(choices, SEGMENTS)
    parent = [source.uniform(-1.0, 1.0) for _ in range(size)]
    best, reach = drawn, evaluate(drawn)
    step, known = 0.5, -math.inf
    for _ in range(BUDGET - 1):
        child = parent
        if known > -math.inf:
            child = [min(max(v + step * source.gauss(0.0, 1.0), -1.0), 1.0) for v in parent]
        trial = replace(drawn, plan=plan_at(choices, child, SEGMENTS))
        found = evaluate(trial)
        better = found >= known
        step *= 1.5 if better else 0.9
        if better:
            parent, known = child, found
        if found > reach:
            best, reach = trial, found
    return best, reach
