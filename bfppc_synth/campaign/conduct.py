"""A campaign from its first run to campaign.json."""

from __future__ import annotations

import math
from contextlib import nullcontext
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from bfppc_synth.campaign.batch import StoppedError, do_batch, empty_tally
from bfppc_synth.campaign.material import gather_material, open_loop
from bfppc_synth.campaign.result import draw_histograms, lay_out
from bfppc_synth.campaign.store import PICTURE, RESULT, Settings, Store
from bfppc_synth.engine import open_engine
from bfppc_synth.errors import NotCertifiedError, UsageError
from bfppc_synth.model.certificate import Verdict
from bfppc_synth.pipeline import NOT_COVERED, Outcome
from bfppc_synth.simulation.compiled.library import Stop

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from contextlib import AbstractContextManager
    from pathlib import Path

    from bfppc_synth.campaign.material import Material
    from bfppc_synth.campaign.tally import Tally

    # total -> a context that yields what is told how many runs more are done
    Bar = Callable[[int], AbstractContextManager[Callable[[int], None]]]
    Steps = Callable[[], AbstractContextManager[Callable[[str], None]]]

#: Plant steps of a batch: some seconds in C, half a second and more in Python. A batch that a
#: cluster gets is never shorter; threads share a small campaign in more.
COMPILED_STEPS, PYTHON_STEPS = 10_000_000, 100_000
_PIECES = 16

DEFAULT_RUNS = 1000


def _silent() -> AbstractContextManager[Callable[[str], None]]:
    return nullcontext(lambda _sentence: None)


def _no_bar(total: int) -> AbstractContextManager[Callable[[int], None]]:
    del total
    return nullcontext(lambda _more: None)


@dataclass(frozen=True, slots=True, kw_only=True)
class Wishes:
    """What the command line asks for; None is the default, or what is resumed."""

    runs: int | None = None
    seed: int | None = None
    horizon: float | None = None
    workers: int | None = None
    cluster: str | None = None
    resume: bool = False


def conduct(
    folder: Path, wishes: Wishes, *, progress: Steps = _silent, bar: Bar = _no_bar
) -> Outcome:
    """Make a campaign in ``folder/campaign``.

    Parameters
    ----------
    folder : Path
        A generated folder.
    wishes : Wishes
        How many runs, from what seed, by whom.
    progress : callable
        Opens what gets a sentence per step.
    bar : callable
        Opens what is told how many runs more are done.

    Returns
    -------
    Outcome
        Exit code 4 if a run left its bounds that the certificate covers, else 0.

    Raises
    ------
    UsageError
        If the folder cannot be used, the wishes contradict what is resumed, or nobody
        answers at the cluster's address.
    """
    if wishes.runs is not None and wishes.runs < 1:
        raise UsageError(f"--runs {wishes.runs}: not a positive number; fix: write --runs 1000")
    store = Store(folder)
    known = store.settings() if wishes.resume else None
    if wishes.resume and known is None:
        raise UsageError(f"{store.place.as_posix()}: nothing to resume; fix: leave --resume out")
    if not wishes.resume:
        _refuse_to_lose(store)
    horizon = wishes.horizon
    if known is not None:
        horizon = _agreed("--horizon", horizon, known.horizon)
    with progress() as step:
        step(f"reading {folder.as_posix()}")
        material = gather_material(folder, horizon=horizon)
        step("compiling the loop")
        compiled = open_loop(material).compiled
    settings = _settings(material, wishes, known, compiled=compiled)
    with open_engine(workers=wishes.workers, cluster=wishes.cluster) as engine, store.held():
        (store.go_on if known is not None else store.begin)(settings)
        stop = Stop()
        tally = empty_tally(material)
        with bar(settings.runs) as done:

            def missing() -> Iterator[tuple[Material, int, int, int, Stop | None]]:
                for first, count in batches(settings):
                    kept = store.batch(first, count, tally)
                    if kept is None:
                        watched = None if engine.remote else stop
                        yield material, settings.seed, first, count, watched
                    else:
                        tally.add(kept)
                        done(count)

            try:
                for (_, _, first, count, _), found in engine.gather(do_batch, missing()):
                    store.keep(first, count, found)
                    tally.add(found)
                    done(count)
            except StoppedError as error:
                raise KeyboardInterrupt from error
            finally:
                # Threads end after their current run, also where Ctrl-C came.
                stop.set()
        document = lay_out(material, settings, tally)
        store.write(PICTURE, draw_histograms(document))
        store.write_json(RESULT, document)
    return _outcome(material, tally, document, store, compiled=compiled)


def batches(settings: Settings) -> Iterator[tuple[int, int]]:
    """List the first run and the number of runs of every batch."""
    for first in range(0, settings.runs, settings.batch):
        yield first, min(settings.batch, settings.runs - first)


def _refuse_to_lose(store: Store) -> None:
    """Keep an unfinished campaign from being thrown away by a forgotten word."""
    if store.place.exists() and not store.finished and store.settings() is not None:
        place = store.place.as_posix()
        raise UsageError(f"{place}: holds an unfinished campaign; fix: add --resume, or remove it")


def _settings(
    material: Material, wishes: Wishes, known: Settings | None, *, compiled: bool
) -> Settings:
    if known is not None:
        here = (material.choices.spec.sha256, material.controller_sha256)
        if here != (known.plant_sha256, known.controller_sha256):
            raise UsageError(
                "--resume: the campaign is about another controller than the folder holds now;"
                " fix: start a new one without --resume, after removing DIR/campaign"
            )
        seed = _agreed("--seed", wishes.seed, known.seed)
        return replace(known, seed=seed, runs=wishes.runs or known.runs)
    runs = wishes.runs or DEFAULT_RUNS
    wanted = COMPILED_STEPS if compiled else PYTHON_STEPS
    batch = max(1, wanted // material.steps)
    if wishes.cluster is None:
        batch = max(1, min(batch, math.ceil(runs / _PIECES)))
    spec = material.choices.spec
    return Settings(
        seed=spec.simulation.seed if wishes.seed is None else wishes.seed,
        runs=runs,
        horizon=material.horizon,
        batch=batch,
        plant_sha256=spec.sha256,
        controller_sha256=material.controller_sha256,
    )


def _agreed(name: str, wished: Any, known: Any) -> Any:
    """Refuse to go on with other numbers than those that the campaign began with."""
    if wished is not None and wished != known:
        raise UsageError(
            f"{name} {wished}: the campaign began with {known}; fix: leave it out, or start anew"
        )
    return known


def _outcome(
    material: Material,
    tally: Tally,
    document: dict[str, object],
    store: Store,
    *,
    compiled: bool,
) -> Outcome:
    left = tally.outside > 0
    contradicted = left and material.covered
    messages: list[str] = []
    if contradicted:
        messages.append(
            f"{tally.outside} of {tally.runs} runs that the certificate covers left their bounds;"
            f" the first is run {tally.left[0]}: bfppc-synth simulate DIR --run {tally.left[0]}"
        )
    elif left and material.design.certificate.verdict is Verdict.CERTIFIED:
        messages.append(NOT_COVERED)
    if not compiled:
        messages.append("no C compiler was found: every run was made in Python, far slower")
    return Outcome(
        exit_code=NotCertifiedError.exit_code if contradicted else 0,
        folder=store.place,
        document=document,
        messages=tuple(messages),
        lines=tuple(_lines(document, store)),
    )


def _lines(document: dict[str, object], store: Store) -> Iterator[str]:
    """Lay the result out for a reader."""
    yield (
        f"{document['name']}: {document['runs']} runs of {document['horizon']:g} s,"
        f" seed {document['seed']}: {document['outside']} left their bounds"
    )
    worst = document["worst"]
    rows = worst if isinstance(worst, list) else []
    for row in rows:
        yield (
            f"  {row['quantity']:<8} at most {100.0 * row['ratio']:.2f} % of {row['bound']:.6g}"
            f"  (run {row['run']})"
        )
    found = document["failure_probability"]
    if isinstance(found, dict):
        yield (
            f"  probability of leaving, as drawn: at most {found['0.95']:.3g} with 95 %,"
            f" {found['0.99']:.3g} with 99 % confidence (evidence, no proof)"
        )
    yield f"  {(store.place / RESULT).as_posix()}, {PICTURE}"
