"""The engine runs every batch once, keeps few under way, and says what is wrong."""

from __future__ import annotations

import sys
import threading

import pytest

from bfppc_synth import engine as module
from bfppc_synth.engine import open_engine
from bfppc_synth.errors import UsageError


@pytest.mark.parametrize("workers", [1, 3])
def test_every_batch_is_done_once_and_comes_with_its_result(workers):
    with open_engine(workers=workers, cluster=None) as engine:
        found = dict(engine.gather(pow, ((base, 2) for base in range(50))))
    assert found == {(base, 2): base**2 for base in range(50)}


def test_batches_are_taken_only_as_there_is_room():
    taken, release = [], threading.Event()

    def batches():
        for number in range(100):
            taken.append(number)
            yield (number,)

    def work(number):
        release.wait(10.0)
        return number

    with open_engine(workers=2, cluster=None) as engine:
        results = engine.gather(work, batches())
        threading.Timer(0.05, release.set).start()
        next(results)
        assert len(taken) <= engine.width
        assert len(list(results)) == 99


def test_what_fails_in_a_batch_reaches_the_caller_and_ends_the_rest():
    with (
        open_engine(workers=1, cluster=None) as engine,
        pytest.raises(ZeroDivisionError),
    ):
        list(engine.gather(divmod, [(1, 0), (1, 1)]))


@pytest.mark.parametrize(
    ("wishes", "sentence"),
    [
        ({"workers": 0, "cluster": None}, "--workers 0: not a positive number"),
        ({"workers": 1, "cluster": "tcp://h:1"}, "exclude each other"),
        ({"workers": None, "cluster": "h:1"}, "no address of a scheduler"),
        ({"workers": None, "cluster": "tcp://127.0.0.1"}, "no scheduler answers there"),
    ],
)
def test_what_cannot_be_opened_is_said(wishes, sentence, monkeypatch):
    monkeypatch.setattr(module, "PATIENCE", 0.5)
    with pytest.raises(UsageError, match=sentence), open_engine(**wishes):
        pass


def test_without_dask_a_cluster_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with (
        pytest.raises(UsageError, match="pip install"),
        open_engine(workers=None, cluster="tcp://127.0.0.1:1"),
    ):
        pass
