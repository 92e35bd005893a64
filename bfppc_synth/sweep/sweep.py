"""``sweep PLANT --over PATH=a:b:n``: a certified design at every point of a grid."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from bfppc_synth.codegen.package import Overwrite, may_write, write_folder
from bfppc_synth.errors import UsageError
from bfppc_synth.model.spec import Form, Objective
from bfppc_synth.pipeline import Outcome
from bfppc_synth.spec.changed import changed, plant_text
from bfppc_synth.spec.document import read_document
from bfppc_synth.spec.load import load_spec, load_text
from bfppc_synth.sweep.axes import grid, read_axes
from bfppc_synth.sweep.records import Chunk, Point, ProofChunk, Status
from bfppc_synth.sweep.workers import mapping

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from bfppc_synth.model.spec import PlantSpec
    from bfppc_synth.sweep.axes import Axis
    from bfppc_synth.sweep.records import Answer, Found

# Points solved one from another by one worker. Small enough for four workers on twenty points;
# fixed, as where a chain of starts begins must not depend on the machine.
CHUNK = 5
# Designs that are offered to every point; of more points the nearest.
_MOST_OFFERED = 400
_ORDINARY = frozenset({Objective.PEAK_INPUT, Objective.SLOPE, Objective.BALANCED})


def _silent(message: str) -> None:
    del message


@dataclass(frozen=True, slots=True, kw_only=True)
class SweepOptions:
    """``workers`` None takes every processor; ``out`` None writes nothing.

    ``cluster`` is the address of a Dask scheduler, whose workers have this package.
    """

    over: tuple[str, ...]
    out: Path | None = None
    workers: int | None = None
    cluster: str | None = None
    overwrite: Overwrite = Overwrite.REFUSE
    progress: Callable[[str], None] = _silent


def sweep(path: Path, options: SweepOptions) -> Outcome:
    """Solve a plant file at every point of a grid of its numbers.

    Parameters
    ----------
    path : Path
        The plant file; where it names no objective, the peak input is made small.
    options : SweepOptions
        The swept paths, workers, output folder, progress.

    Returns
    -------
    Outcome
        Exit code 0 with a table, also where points have no design; the object of sweep.json.

    Raises
    ------
    BfppcError
        Exit code 2: the plant file, the command line, the folder, or a value of the grid that
        makes every point a mistake.

    References
    ----------
    docs/theory.md section 5.
    """
    spec = load_spec(path)
    _require_certifiable(spec)
    axes = read_axes(options.over, spec)
    workers = options.workers
    if workers is not None and not 1 <= workers <= 1024:
        raise UsageError(f"--workers {workers}: not a number from 1 to 1024; fix: --workers 2")
    if options.out is not None:
        may_write_sweep(options.out, spec, options.overwrite)
    points = _points(path, spec, axes)
    options.progress("importing")
    answers = solve(points, axes, options)
    _require_one(points, answers)
    from bfppc_synth.sweep.document import sweep_document, sweep_files, sweep_lines

    document = sweep_document(spec, axes, points, answers)
    lines = sweep_lines(document)
    if options.out is not None:
        options.progress(f"writing {options.out.as_posix()}")
        write_folder(
            sweep_files(document, spec, points, answers),
            options.out,
            name=spec.name,
            status="sweep",
            overwrite=options.overwrite,
        )
        lines = (*lines, f"written: {options.out.as_posix()}/sweep.svg, sweep.csv, sweep.json")
    return Outcome(
        exit_code=0, folder=options.out, document=document, messages=spec.notes, lines=lines
    )


def may_write_sweep(folder: Path, spec: PlantSpec, overwrite: Overwrite) -> None:
    """Refuse a folder that must not be replaced, also the plant's own generated one.

    Raises
    ------
    UsageError
        As ``may_write``; or a controller stands there, which writing would remove.
    """
    may_write(folder, name=spec.name, overwrite=overwrite)
    if (folder / "controller.py").exists():
        raise UsageError(
            f"{folder.as_posix()}: holds a generated controller, which a sweep would replace\n"
            "  fix: name another folder with --out"
        )


def _require_certifiable(spec: PlantSpec) -> None:
    if spec.synthesis.form is Form.PRINTED:
        raise UsageError(
            f"{spec.path}: form printed is never certified, so no point of a sweep would be\n"
            "  fix: use `form: sound`"
        )
    others = [str(word) for word, _ in spec.synthesis.objective if word not in _ORDINARY]
    if others:
        raise UsageError(
            f"{spec.path}: objective {others[0]} looks for one value of what a sweep goes through\n"
            "  fix: use `objective: peak-input`"
        )


def _points(path: Path, spec: PlantSpec, axes: tuple[Axis, ...]) -> tuple[Point, ...]:
    root = read_document(path).root
    if not spec.gives("synthesis.objective"):
        root = changed(root, "synthesis.objective", str(Objective.PEAK_INPUT), spec.states)
    points = []
    for index, texts in enumerate(grid(axes)):
        tree = root
        for axis, text in zip(axes, texts, strict=True):
            tree = changed(tree, axis.path, text, spec.states)
        points.append(Point(index=index, at=texts, source=plant_text(tree), path=spec.path))
    return tuple(points)


def _require_one(points: Sequence[Point], answers: Sequence[Answer]) -> None:
    """Raise what is wrong where no point at all is a plant file without mistakes."""
    if any(answer.status is not Status.REFUSED for answer in answers):
        return
    first = points[0]
    load_text(first.source, first.path)
    values = ", ".join(first.at)
    raise UsageError(f"every point of the sweep is refused; at {values}: {answers[0].reason}")


def solve(
    points: tuple[Point, ...],
    axes: tuple[Axis, ...],
    options: SweepOptions,
) -> tuple[Answer, ...]:
    """Search all points, offer every design to all of them, and prove the best.

    Returns
    -------
    tuple[Answer, ...]
        In the points' order, the same whoever works.
    """
    from bfppc_synth.sweep.solving import prove_chunk, search_chunk

    parts = _parts(points, len(axes[-1].texts))
    chunks = [Chunk(points=part) for part in parts]

    def told(what: str) -> Callable[[int], None]:
        whole = f"of {len(chunks)} parts of the sweep"
        return lambda count: options.progress(f"{what}: {count} {whole}")

    with mapping(options.workers, options.cluster, len(chunks)) as mapped:
        options.progress(f"searching: {len(points)} points in {len(chunks)} parts")
        searched = mapped(search_chunk, chunks, told("searched"))
        known = [answer for part in searched for answer in part]
        proofs = [
            ProofChunk(points=part, answers=answers, others=_offered(part, known, axes))
            for part, answers in zip(parts, searched, strict=True)
        ]
        proved = mapped(prove_chunk, proofs, told("proved"))
        answers = [answer for part in proved for answer in part]
        left = _left_over(points, answers, axes)
        for part in mapped(prove_chunk, left, lambda _count: None):
            for answer in part:
                if answer.status is Status.CERTIFIED:
                    answers[answer.index] = answer
    return tuple(answers)


def _left_over(
    points: tuple[Point, ...], answers: Sequence[Answer], axes: tuple[Axis, ...]
) -> list[ProofChunk]:
    """Offer what is certified elsewhere to each point whose own design was not proved.

    A cheap design may reach where a declared bound is false; a stricter point's may not.
    """
    certified = [answer for answer in answers if answer.status is Status.CERTIFIED]
    return [
        ProofChunk(
            points=(points[answer.index],),
            answers=(replace(answer, found=None),),
            others=_offered((points[answer.index],), certified, axes),
        )
        for answer in answers
        if answer.status is Status.UNDECIDED
    ]


def _parts(points: tuple[Point, ...], row: int) -> list[tuple[Point, ...]]:
    """Cut every row of the grid into parts of about equal length."""
    parts = []
    for start in range(0, len(points), row):
        line = points[start : start + row]
        count = math.ceil(len(line) / CHUNK)
        ends = [len(line) * k // count for k in range(count + 1)]
        parts += [line[a:b] for a, b in itertools.pairwise(ends)]
    return parts


def _offered(
    part: tuple[Point, ...], known: Sequence[Answer], axes: tuple[Axis, ...]
) -> tuple[Found, ...]:
    """List the designs of all points, best first; none where what is fixed differs."""
    if any(axis.path.startswith("synthesis.") for axis in axes):
        return ()
    middle = part[len(part) // 2].index
    row = len(axes[-1].texts)

    def distance(found: Found) -> tuple[int, int]:
        across = abs(found.origin // row - middle // row)
        along = abs(found.origin % row - middle % row)
        return across + along, found.origin

    found = [answer.found for answer in known if answer.found is not None]
    nearest = sorted(found, key=distance)[:_MOST_OFFERED]
    return tuple(sorted(nearest, key=lambda item: (item.measure, item.origin)))
