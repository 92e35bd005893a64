"""Where batches of work run: threads of this process, or a Dask cluster.

Threads suit work that releases the interpreter, as the compiled loop does. A cluster gets the
same functions with the same arguments, so the results are the same.
"""

from __future__ import annotations

import logging
import os
from concurrent.futures import FIRST_COMPLETED, Executor, ThreadPoolExecutor, wait
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeVar

from bfppc_synth.errors import BfppcError, UsageError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

T = TypeVar("T")

#: How long a scheduler may take to answer, and a first worker to be there [s].
PATIENCE = 10.0


class LostError(BfppcError):
    """The cluster went away, or a batch ended every worker that tried it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Engine:
    """An executor, and how many batches should be under way in it at once."""

    executor: Executor
    width: int
    remote: bool

    def gather(
        self, function: Callable[..., T], batches: Iterable[tuple[Any, ...]]
    ) -> Iterator[tuple[tuple[Any, ...], T]]:
        """Run ``function(*batch)`` for every batch, and yield each with its result when done.

        Batches are taken as there is room: neither they nor the results pile up. Where the
        caller stops early, what has not begun is cancelled.
        """
        source, running = iter(batches), dict[Any, tuple[Any, ...]]()
        try:
            while True:
                while len(running) < self.width:
                    batch = next(source, None)
                    if batch is None:
                        break
                    running[self.executor.submit(function, *batch)] = batch
                if not running:
                    return
                for future in self._done(running):
                    yield running.pop(future), self._result(future)
        finally:
            for future in running:
                future.cancel()

    def _done(self, running: dict[Any, tuple[Any, ...]]) -> list[Any]:
        if isinstance(self.executor, _Submitting):
            return self.executor.first(list(running))
        return list(wait(running, return_when=FIRST_COMPLETED).done)

    def _result(self, future: Any) -> Any:
        if not self.remote:
            return future.result()
        from distributed.client import FutureCancelledError
        from distributed.comm import CommClosedError
        from distributed.scheduler import KilledWorker

        try:
            return future.result()
        except KilledWorker as error:
            raise LostError(
                f"--cluster: a batch ended every worker that tried it: {error}\n"
                "  fix: see the workers' logs; what is done is kept, --resume goes on"
            ) from error
        except (CommClosedError, FutureCancelledError) as error:
            raise LostError(
                f"--cluster: the scheduler is gone: {error}\n"
                "  fix: start it again; what is done is kept, --resume goes on"
            ) from error


@contextmanager
def open_engine(*, workers: int | None, cluster: str | None) -> Iterator[Engine]:
    """Open what batches run in.

    Parameters
    ----------
    workers : int or None
        Threads; None is one per processor.
    cluster : str or None
        Address of a Dask scheduler, ``tcp://HOST:PORT``; a worker that is lost costs its batch,
        which another one does again.

    Yields
    ------
    Engine
        Usable until the block ends.

    Raises
    ------
    UsageError
        If both are given, the number is not positive, Dask is not installed, or nobody
        answers at the address.
    """
    if cluster is not None:
        if workers is not None:
            raise UsageError("--workers and --cluster exclude each other; fix: leave one out")
        with _cluster(cluster) as engine:
            yield engine
        return
    if workers is not None and workers < 1:
        raise UsageError(f"--workers {workers}: not a positive number; fix: write --workers 2")
    count = workers or processors()
    executor = ThreadPoolExecutor(max_workers=count, thread_name_prefix="batch")
    try:
        yield Engine(executor=executor, width=count + 1, remote=False)
    finally:
        executor.shutdown(wait=True, cancel_futures=True)


def processors() -> int:
    """Count the processors that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@contextmanager
def _cluster(address: str) -> Iterator[Engine]:
    if not address.startswith(("tcp://", "tls://")):
        raise UsageError(
            f"--cluster {address}: no address of a scheduler; fix: write --cluster tcp://HOST:PORT"
        )
    try:
        from distributed import Client
    except ImportError as error:
        raise UsageError(
            "--cluster needs Dask, which is not installed; fix: pip install 'bfppc-synth[cluster]'"
        ) from error
    # What a lost worker costs is done again: no reader of the results needs a word of it.
    logging.getLogger("distributed.client").setLevel(logging.ERROR)
    try:
        client = Client(address, timeout=PATIENCE, set_as_default=False)
    except (OSError, TimeoutError, ValueError) as error:
        raise UsageError(
            f"--cluster {address}: no scheduler answers there within {PATIENCE:g} s; fix: start"
            " `dask scheduler`, or name its address"
        ) from error
    try:
        try:
            client.wait_for_workers(1, timeout=PATIENCE)
        except TimeoutError as error:
            raise UsageError(
                f"--cluster {address}: the scheduler has no worker; fix: start `dask worker"
                f" {address}`"
            ) from error
        threads = sum(client.nthreads().values())
        executor = _Submitting(client)
        yield Engine(executor=executor, width=2 * threads, remote=True)
    finally:
        # A scheduler that is gone does not answer a farewell either.
        client.close(timeout=2.0)


class _Submitting(Executor):
    """Submits to a cluster and returns its own futures: they survive a lost worker."""

    def __init__(self, client: Any) -> None:
        self._client = client

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Any:
        # Not pure: equal batches are not taken for one, and results are not kept.
        return self._client.submit(fn, *args, pure=False, **kwargs)

    def first(self, futures: list[Any]) -> list[Any]:
        """Wait for any of the futures; return all that are done."""
        from distributed import wait as wait_remotely
        from distributed.client import FuturesCancelledError

        gone = LostError(
            "--cluster: the scheduler is gone\n"
            "  fix: start it again; what is done is kept, --resume goes on"
        )
        while True:
            try:
                with self._client.as_current():
                    found = wait_remotely(futures, timeout=1.0, return_when="FIRST_COMPLETED")
                return list(found.done)
            except TimeoutError:
                # Now and then, so that Ctrl-C and a scheduler that is gone are seen.
                if self._client.status not in {"running", "connecting"}:
                    raise gone from None
            except FuturesCancelledError as error:
                raise gone from error
