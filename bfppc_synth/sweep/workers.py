"""Chunks mapped over processes, in order; what is interrupted leaves no process behind."""

from __future__ import annotations

import multiprocessing
import os
import signal
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

A = TypeVar("A")
B = TypeVar("B")

# Loaded once by the process that the workers are copies of.
_PRELOADED = ["bfppc_synth.sweep.solving", "bfppc_synth.gains.solve", "bfppc_synth.certificate"]


def processors() -> int:
    """Count the processors that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return max(1, len(os.sched_getaffinity(0)))
    return max(1, os.cpu_count() or 1)


@contextmanager
def executor_of(workers: int) -> Iterator[Executor | None]:
    """Yield an executor of processes; None where one is enough, and the caller works itself.

    On an exception, Ctrl-C among them, the processes are ended and not waited for.
    """
    if workers <= 1:
        yield None
        return
    methods = multiprocessing.get_all_start_methods()
    # Not fork: this process shows its progress in a thread.
    context = multiprocessing.get_context("forkserver" if "forkserver" in methods else "spawn")
    if context.get_start_method() == "forkserver":
        context.set_forkserver_preload(_PRELOADED)
    before = set(multiprocessing.active_children())
    executor = ProcessPoolExecutor(workers, mp_context=context, initializer=_deaf)
    try:
        yield executor
    except BaseException:
        executor.shutdown(wait=False, cancel_futures=True)
        for process in set(multiprocessing.active_children()) - before:
            process.terminate()
        raise
    executor.shutdown()


def _deaf() -> None:
    """Leave Ctrl-C to the process that was asked."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


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
    futures = [executor.submit(work, chunk) for chunk in chunks]
    for future in futures:
        results.append(future.result())
        done(len(results))
    return results
