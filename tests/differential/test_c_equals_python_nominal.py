"""Center nominal, C against Python: every bit of every command, on random samples."""

from __future__ import annotations

import importlib.util
import re
import subprocess
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

from bfppc_synth.codegen.c import render_c
from bfppc_synth.codegen.law import build_law
from bfppc_synth.codegen.provenance import make_provenance
from bfppc_synth.codegen.python import render_controller

if TYPE_CHECKING:
    from types import ModuleType

    from numpy.typing import NDArray

ROOT = Path(__file__).parents[2]
STRICT = ["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror"]
STEP, COMPILED, RESET, ZERO = range(4)
RUN = 80
ODD = [np.nan, np.inf, -np.inf, 1e300, -1e300, 2e12, -1e9, 0.0, -0.0]

# Reads records (what, instance, t, y_d.., x..) of doubles and writes (u, status) for each.
DRIVER = """
#include <stdio.h>
#include <string.h>
#include "NAME.h"
int main(void)
{
    static NAME_state states[2];
    double r[3 + SIGNALS + NAME_ORDER];
    memset(states, 0xAA, sizeof states);
    while (fread(r, sizeof r, 1, stdin) == 1) {
        NAME_state *s = &states[(int)r[1]];
        double out[2] = {0.0, 0.0};
        switch ((int)r[0]) {
        case 0: out[1] = NAME_step(s, r[2], r + 3 + SIGNALS, PASSED, out); break;
        REFERENCE
        case 2: NAME_reset(s); break;
        default: memset(s, 0, sizeof *s); break;
        }
        fwrite(out, sizeof out, 1, stdout);
    }
    return 0;
}
"""
REFERENCE = """
        case 1:
            out[1] = NAME_step(s, r[2], r + 3 + SIGNALS,
                NAME_reference((s->started != 0) ? r[2] - s->t_0 : 0.0), out);
            break;
"""


def load(path: Path, name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


nominal = load(ROOT / "tests" / "unit" / "codegen" / "handmade_nominal.py", "nominal_designs")


class Pair:
    """The Python controller and a program around the C one."""

    def __init__(self, name: str, folder: Path, flags: tuple[str, ...] = ("-O2",)) -> None:
        law = build_law(nominal.DESIGNS[name]())
        provenance = make_provenance(nominal.DESIGNS[name]())
        files = {"controller.py": render_controller(law, provenance), **render_c(law, provenance)}
        for path, text in files.items():
            (folder / path).parent.mkdir(parents=True, exist_ok=True)
            (folder / path).write_text(text)
        self.module = load(folder / "controller.py", f"controller_{name}")
        self.limits = [getattr(self.module, test.upper) for test in law.reference_ranges]
        self.compiled = law.reference is not None
        self.program = folder / "driver"
        driver = DRIVER.replace("REFERENCE", REFERENCE if self.compiled else "")
        driver = driver.replace("PASSED", "r + 3" if law.derivatives else "r[3]")
        driver = driver.replace("SIGNALS", str(len(self.limits))).replace("NAME", name)
        (folder / "driver.c").write_text(driver)
        include = ["-I", str(folder / "c" / "include"), "-ffp-contract=off"]
        # The driver converts freely; only the controller has to be clean.
        for source, warnings in (("driver.c", []), (f"c/src/{name}.c", STRICT)):
            command = ["gcc", *flags, *warnings, *include, "-c", source]
            subprocess.run(command, cwd=folder, check=True, timeout=60)
        command = ["gcc", *flags, "driver.o", f"{name}.o", "-o", "driver", "-lm"]
        subprocess.run(command, cwd=folder, check=True, timeout=60)

    def c(self, records: NDArray[np.float64]) -> NDArray[np.float64]:
        done = subprocess.run(
            [str(self.program)],
            input=records.tobytes(),
            capture_output=True,
            check=True,
            timeout=60,
            cwd=self.program.parent,
        )
        return np.frombuffer(done.stdout).reshape(-1, 2)

    def python(self, records: NDArray[np.float64]) -> NDArray[np.float64]:
        controllers = [self.module.Controller(), self.module.Controller()]
        signals = len(self.limits)
        out: list[float] = []
        for what, instance, t, *rest in records.tolist():
            controller, y_d, x = controllers[int(instance)], rest[:signals], rest[signals:]
            if what == STEP:
                u = controller.step(t, x, y_d if signals > 1 else y_d[0])
            elif what == COMPILED:
                u = controller.step(t, x)
            else:
                controller.reset()
                out += [0.0, 0.0]
                continue
            out += [u, float(controller.status)]
        return np.array(out).reshape(-1, 2)

    def samples(self, count: int, seed: int) -> NDArray[np.float64]:
        """Runs of 40 samples each for two interleaved instances, one sample in nine spoiled."""
        random, order = np.random.default_rng(seed), self.module.Controller.ORDER
        signals = len(self.limits)
        records = np.zeros((count, 3 + signals + order))
        if self.compiled:
            records[:, 0] = np.where(random.random(count) < 0.5, COMPILED, STEP)
        records[:, 1] = np.arange(count) % 2
        run, place = np.arange(count) // RUN, np.arange(count) % RUN // 2
        # Steps from microseconds to seconds: within the transition, and far behind its end.
        pace = 10.0 ** random.uniform(-6.0, 1.0, run[-1] + 1)
        late = np.where(random.random(run[-1] + 1) < 0.5, 0.0, random.normal(size=run[-1] + 1) * 9)
        records[:, 2] = late[run] + pace[run] * place
        shape = (count, signals)
        records[:, 3 : 3 + signals] = random.uniform(-0.99, 0.99, shape) * self.limits
        limits, low, high = (
            np.array([getattr(self.module, f"{stem}_{i + 1}") for i in range(order)])
            for stem in ("x_limit", "start_lower", "start_upper")
        )
        near = random.uniform(low, high, (count, order)) * random.uniform(0.0, 1.3, (count, 1))
        far = random.uniform(-1.0, 1.0, (count, order)) * limits
        states = np.where(random.random((count, 1)) < 0.75, near, far)
        inside = (place == 0) & (random.random(count) < 0.9)
        drawn = random.uniform(low, high, (count, order))
        records[:, 3 + signals :] = np.where(inside[:, None], drawn, states)
        spoiled = np.flatnonzero(random.random(count) < 0.11)
        columns = random.integers(2, records.shape[1], len(spoiled))
        records[spoiled, columns] = random.choice(ODD, len(spoiled))
        resets = np.flatnonzero(place == 0)
        marks = np.zeros((len(resets), records.shape[1]))
        marks[:, 0] = np.where(random.random(len(resets)) < 0.5, RESET, ZERO)
        marks[:, 1] = records[resets, 1]
        return np.insert(records, resets, marks, axis=0)

    def compare(self, count: int, seed: int = 1) -> NDArray[np.float64]:
        """Fail on the first differing bit; return the steps' results."""
        records = self.samples(count, seed)
        ours, theirs = self.python(records), self.c(records)
        differing = np.flatnonzero((ours.view(np.int64) != theirs.view(np.int64)).any(axis=1))
        assert len(ours) == len(theirs) == len(records)
        assert len(differing) == 0, (len(differing), records[differing[0]], ours[differing[0]])
        assert np.isfinite(ours).all()
        assert np.abs(ours[:, 0]).max() <= self.module.U_MAX
        return ours[records[:, 0] < RESET]


@pytest.mark.parametrize("name", ["integrator", "pendulum", "supplied", "joint", "vanishing"])
def test_c_and_python_agree_in_every_bit(name: str, tmp_path: Path) -> None:
    results = Pair(name, tmp_path).compare(200_000)
    share = [float(np.mean(results[:, 1] == status)) for status in range(4)]
    assert share[0] + share[1] >= 0.7, share
    assert min(share) > 0.0005, share


def test_c_and_python_agree_in_every_bit_of_a_million_samples(tmp_path: Path) -> None:
    pair = Pair("pendulum", tmp_path)
    results = pair.compare(1_000_000, seed=2)
    accepted = results[results[:, 1] <= 1, 0]
    peak = pair.module.U_MAX
    assert len(accepted) > 700_000
    for reached in (accepted == peak, accepted == -peak, np.abs(accepted) < peak):
        assert np.mean(reached) > 0.01


def test_the_samples_reach_both_sides_of_every_branch(tmp_path: Path) -> None:
    pair = Pair("supplied", tmp_path, flags=("-O0", "--coverage"))
    pair.c(pair.samples(20_000, seed=1))
    done = subprocess.run(
        ["gcov", "-b", "supplied.c"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=True,
        timeout=60,
    )
    own = done.stdout.split("supplied.c'", 1)[1]
    taken = re.search(r"Taken at least once:([\d.]+)% of (\d+)", own)
    assert int(taken[2]) > 40
    # A command that is no number, and a spoiled state, need more than samples.
    assert float(taken[1]) >= 90.0, own


def test_a_changed_weight_of_the_transition_is_noticed(tmp_path: Path) -> None:
    pair = Pair("pendulum", tmp_path)
    path = tmp_path / "controller.py"
    text = path.read_text()
    assert "T_s = 2.0\n" in text
    path.write_text(text.replace("T_s = 2.0\n", "T_s = 2.0000000000000004\n"))
    pair.module = load(path, "changed")
    with pytest.raises(AssertionError):
        pair.compare(2_000)
