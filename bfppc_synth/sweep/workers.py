"""Chunks mapped over processes or a cluster, in order; what is interrupted leaves none behind."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from functools import partial
from multiprocessing import forkserver
from typing import TYPE_CHECKING, Any, TypeVar

from bfppc_synth.engine import open_engine, processors

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from multiprocessing.context import BaseContext

    from bfppc_synth.engine import Engine

A = TypeVar("A")
B = TypeVar("B")

# Loaded once by the process that the workers are copies of.
_PRELOADED = ["bfppc_synth.sweep.solving", "bfppc_synth.gains.solve", "bfppc_synth.certificate"]


@contextmanager
def mapping(workers: int | None, cluster: str | None, most: int) -> Iterator[Callable[..., Any]]:
    """Yield ``mapped`` on processes of this machine, at most ``most``, or on a Dask cluster.

    Raises
    ------
    UsageError
        As ``engine.open_engine``.
    """
    if cluster is not None:
        with open_engine(workers=workers, cluster=cluster) as engine:
            yield partial(_gathered, engine)
        return
    with executor_of(min(workers or processors(), most)) as executor:
        yield partial(mapped, executor)


@contextmanager
def executor_of(workers: int) -> Iterator[Executor | None]:
    """Yield an executor of processes; None where one is enough, and the caller works itself.

    On an exception, Ctrl-C among them, the processes are ended and not waited for.
    """
    if workers <= 1:
        yield None
        return
    context = _warm_context()
    before = set(multiprocessing.active_children())
    executor = ProcessPoolExecutor(workers, mp_context=context, initializer=_begin)
    try:
        yield executor
    except BaseException:
        executor.shutdown(wait=False, cancel_futures=True)
        for process in set(multiprocessing.active_children()) - before:
            process.terminate()
        raise
    executor.shutdown()


def _warm_context() -> BaseContext:
    """Start the process that workers are copies of, with everything that they need imported."""
    if "forkserver" not in multiprocessing.get_all_start_methods():
        return multiprocessing.get_context("spawn")
    # Not fork: this process shows its progress in a thread.
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(_PRELOADED)
    with _undisturbed():
        forkserver.ensure_running()
    # Ctrl-C may come while it imports; the workers after this start within milliseconds.
    first = context.Process(target=_nothing)
    first.start()
    first.join()
    return context


@contextmanager
def _undisturbed() -> Iterator[None]:
    """Ignore Ctrl-C for a moment: a process that is started now ignores it from its first line."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    handler = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, handler)


def _nothing() -> None:
    """Be a process."""


def _begin() -> None:
    """Leave Ctrl-C to the process that was asked, and end with it however it ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def mapped(
    executor: Executor | None,
    work: Callable[[A], B],
    chunks: Sequence[A],
    done: Callable[[int], None],
) -> list[B]:
    """Apply ``work`` to every chunk, in any order; the results are in the chunks' order.

    Parameters
    ----------
    executor : Executor or None
        Anything with ``submit``; None works here, one chunk after the other.
    work : callable
        A function of a module, with a record as its argument and its result.
    chunks : sequence
        Independent of each other.
    done : callable
        Receives how many results there are so far.
    """
    results: list[B] = []
    if executor is None:
        for chunk in chunks:
            results.append(work(chunk))
            done(len(results))
        return results
    with _undisturbed():
        futures = [executor.submit(work, chunk) for chunk in chunks]
    for future in futures:
        results.append(future.result())
        done(len(results))
    return results


def _gathered(
    engine: Engine, work: Callable[[A], B], chunks: Sequence[A], done: Callable[[int], None]
) -> list[B]:
    """Do on an engine what ``mapped`` does; results come in any order."""
    numbers = {id(chunk): number for number, chunk in enumerate(chunks)}
    results: dict[int, B] = {}
    for (chunk,), result in engine.gather(work, [(chunk,) for chunk in chunks]):
        results[numbers[id(chunk)]] = result
        done(len(results))
    return [results[number] for number in range(len(chunks))]
