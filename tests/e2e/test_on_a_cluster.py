"""--cluster: a real scheduler and two workers on loopback, one killed midway."""

from __future__ import annotations

import os
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from bfppc_synth import engine
from bfppc_synth.cli import main

ROOT = Path(__file__).parents[2]
WORDS = ("--runs", "48", "--horizon", "10")
#: In batches of some runs each, as a much longer campaign would be.
CLIENT = """\
import sys
from bfppc_synth.campaign import conduct
from bfppc_synth.cli import main
conduct.COMPILED_STEPS = 20000
sys.exit(main(sys.argv[1:]))
"""


def free_port():
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        return listener.getsockname()[1]


@pytest.fixture
def cluster(tmp_path):
    """Address of a scheduler, and the processes of its two workers."""
    address, processes = f"127.0.0.1:{free_port()}", []

    def start(module, *words):
        command = [sys.executable, "-m", f"distributed.cli.{module}", *words, "--no-dashboard"]
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "cwd": tmp_path}
        processes.append(subprocess.Popen(command, **quiet))
        return processes[-1]

    host, port = address.split(":")
    start("dask_scheduler", "--host", host, "--port", port)
    where = (f"tcp://{address}", "--nthreads", "1", "--no-nanny", "--local-directory")
    workers = [start("dask_worker", *where, str(tmp_path / name)) for name in ("a", "b")]
    yield f"tcp://{address}", workers
    for process in processes:
        process.kill()
    for process in processes:
        process.wait()


def campaign(place, *words):
    command = [sys.executable, "-c", CLIENT, "campaign", str(place), *WORDS, *words, "--quiet"]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=240)


def wait_for(condition):
    deadline = time.monotonic() + 120.0
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.02)


def answering(address):
    with socket.socket() as caller:
        host, port = address.removeprefix("tcp://").split(":")
        return caller.connect_ex((host, int(port))) == 0


def test_a_lost_worker_costs_only_its_batch_and_changes_nothing(cluster, tmp_path):
    address, workers = cluster
    here, there = tmp_path / "here", tmp_path / "there"
    for place in (here, there):
        shutil.copytree(ROOT / "generated" / "paper_example_1", place)
    wait_for(lambda: answering(address))
    batches = there / "campaign" / "batches"
    done = []

    def work():
        done.append(campaign(there, "--cluster", address))

    thread = threading.Thread(target=work)
    thread.start()
    wait_for(lambda: len(list(batches.glob("0*.json"))) >= 1 or done)
    assert not done
    os.kill(workers[0].pid, signal.SIGKILL)
    thread.join()
    assert (done[0].returncode, done[0].stderr) == (0, "")
    assert workers[0].wait() == -signal.SIGKILL
    assert main(["campaign", str(here), *WORDS, "--quiet"]) == 0
    for name in ("campaign.json", "histogram.svg"):
        assert (there / "campaign" / name).read_bytes() == (here / "campaign" / name).read_bytes()
    assert len(list(batches.glob("0*.json"))) == 12
    # The worker that is left sweeps, too.
    plant, over = ROOT / "examples" / "compressor_surge.yaml", "performance.accuracy=0.04:0.08:2"
    for place, words in ((here, ("--workers", "1")), (there, ("--cluster", address))):
        command = ["sweep", str(plant), "--over", over, *words, "--out", str(place / "sweep")]
        assert main([*command, "--quiet"]) == 0
    for name in ("sweep.json", "sweep.csv"):
        assert (there / "sweep" / name).read_bytes() == (here / "sweep" / name).read_bytes()


def test_a_dead_address_is_said_clearly(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(engine, "PATIENCE", 0.5)
    place = tmp_path / "out"
    shutil.copytree(ROOT / "generated" / "paper_example_1", place)
    address = f"tcp://127.0.0.1:{free_port()}"
    assert main(["campaign", str(place), "--cluster", address]) == 2
    shown = capsys.readouterr().err
    assert f"--cluster {address}: no scheduler answers there" in shown
    assert "Traceback" not in shown
    assert not (place / "campaign").exists()
