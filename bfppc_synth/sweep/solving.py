"""The work of one process: chunks of points, searched and then proved.

Nothing here depends on which process it runs in, or on what ran there before: a sweep has the
same result whatever the number of workers.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from bfppc_synth.errors import BfppcError, NoDesignError, PlantFileError
from bfppc_synth.model.certificate import Verdict
from bfppc_synth.spec.load import load_text
from bfppc_synth.sweep.records import Answer, Status
from bfppc_synth.sweep.roads import road_of
from bfppc_synth.synthesis.prepare import MARGINS

if TYPE_CHECKING:
    from collections.abc import Callable

    from bfppc_synth.sweep.records import Chunk, Found, Point, ProofChunk
    from bfppc_synth.sweep.roads import Road

# Designs of other points with another T_s: each needs its own bounds of the center.
_FOREIGN_TRANSITIONS = 3


def search_chunk(chunk: Chunk) -> tuple[Answer, ...]:
    """Search every point of a chunk, from its neighbour's design; then once backwards.

    Returns
    -------
    tuple[Answer, ...]
        In the chunk's order; what is found is not proved yet, and called undecided.
    """
    answers: list[Answer] = []
    roads: list[Road | None] = []
    near: Found | None = None
    for point in chunk.points:
        road, answer = _searched(point, near)
        roads.append(road)
        answers.append(answer)
        near = answer.found or near
    for place in range(len(answers) - 2, -1, -1):
        road, near = roads[place], answers[place + 1].found
        if road is None or near is None or not road.free:
            continue
        answers[place] = _again(chunk.points[place], road, near, answers[place])
    return tuple(
        _with_reason(point, road, answer)
        for point, road, answer in zip(chunk.points, roads, answers, strict=True)
    )


def _searched(point: Point, near: Found | None) -> tuple[Road | None, Answer]:
    made: list[Road] = []

    def work() -> Answer:
        road = road_of(load_text(point.source, point.path))
        made.append(road)
        found = road.searched(point.index, near, MARGINS[0])
        if found is None:
            return Answer(index=point.index, status=Status.INFEASIBLE)
        return Answer(index=point.index, status=Status.UNDECIDED, found=found)

    answer = _guarded(point, work)
    return (made[0] if made else None), answer


def _again(point: Point, road: Road, near: Found, known: Answer) -> Answer:
    """Try the next point's design as the start; the better of both is kept."""

    def work() -> Answer:
        found = road.searched(point.index, near, MARGINS[0])
        if found is None or (known.found and known.found.measure <= found.measure):
            return known
        return Answer(index=point.index, status=Status.UNDECIDED, found=found)

    answer = _guarded(point, work)
    return answer if answer.found is not None else known


def _with_reason(point: Point, road: Road | None, answer: Answer) -> Answer:
    if road is None or answer.found is not None or answer.reason:
        return answer
    return _guarded(point, lambda: replace(answer, reason=road.reason()))


def prove_chunk(chunk: ProofChunk) -> tuple[Answer, ...]:
    """Choose the best design of every point, its own or another's, and prove it.

    Returns
    -------
    tuple[Answer, ...]
        In the chunk's order, each with the checker's verdict.
    """
    return tuple(
        _proved(point, answer, chunk.others)
        for point, answer in zip(chunk.points, chunk.answers, strict=True)
    )


def _proved(point: Point, known: Answer, others: tuple[Found, ...]) -> Answer:
    if known.status in (Status.REFUSED, Status.FAILED):
        return known

    def work() -> Answer:
        spec = load_text(point.source, point.path)
        roads: dict[float | None, Road] = {}

        def road(transition: float | None) -> Road:
            if transition not in roads:
                roads[transition] = road_of(spec, transition)
            return roads[transition]

        best = known.found
        own = None if best is None else best.transition
        foreign: set[float | None] = set()
        for other in others:
            # The others come best first: one that costs more has nothing to give.
            if best is not None and other.measure >= best.measure:
                break
            if other.transition not in roads and other.transition != own:
                if spec.performance.transition is not None or len(foreign) >= _FOREIGN_TRANSITIONS:
                    continue
                foreign.add(other.transition)
            taken = road(other.transition).judged(other)
            if taken is not None and (best is None or taken.measure < best.measure):
                best = taken
        if best is None:
            return known
        answer = _certified(point, road(best.transition), best)
        if answer.status is Status.CERTIFIED or known.found in (None, best):
            return answer
        return _certified(point, road(own), known.found)

    return _guarded(point, work)


def _certified(point: Point, road: Road, best: Found) -> Answer:
    found: Found | None = best
    for margin in (*MARGINS[1:], None):
        certificate = road.proved(best)
        if certificate.verdict is Verdict.CERTIFIED:
            return Answer(
                index=point.index,
                status=Status.CERTIFIED,
                found=best,
                certificate=certificate.document,
            )
        refuted = any(not entry.holds for entry in certificate.assumption_checks)
        if margin is None or refuted or not road.free:
            break
        found = road.searched(point.index, best, margin)
        if found is None:
            break
        best = found
    reason = next(iter(certificate.failures), "the checker proves less than what is needed")
    return Answer(index=point.index, status=Status.UNDECIDED, found=best, reason=reason)


def _guarded(point: Point, work: Callable[[], Answer]) -> Answer:
    """Turn what a single point cannot do into its answer: the others go on."""
    try:
        return work()
    except NoDesignError as error:
        return Answer(index=point.index, status=Status.INFEASIBLE, reason=_line(error))
    except PlantFileError as error:
        first = error.mistakes[0]
        said = f"{first.path}: {first.message}" if first.path else first.message
        return Answer(index=point.index, status=Status.REFUSED, reason=said)
    except BfppcError as error:
        return Answer(index=point.index, status=Status.REFUSED, reason=_line(error))
    except (ArithmeticError, ValueError, RuntimeError, LookupError) as error:
        said = f"unexpected {type(error).__name__}: {_line(error)}"
        return Answer(index=point.index, status=Status.FAILED, reason=said)


def _line(error: Exception) -> str:
    return str(error).partition("\n")[0]
