"""C against Python: every bit of every command and every status, on random samples."""

from __future__ import annotations

import importlib.util
import itertools
import re
import shutil
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

    from bfppc_synth.model.design import Design

ROOT = Path(__file__).parents[2]
STRICT = ["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Werror"]
STEP, COMPILED, RESET, ZERO, SPOIL = range(5)
RUN = 80
ODD = [np.nan, np.inf, -np.inf, 1e300, -1e300, 2e12, -2e12, -2e12, 0.0, -0.0, -1e9]

# Reads records (what, instance, t, y_d, x...) of doubles and writes (u, status) for each.
DRIVER = """
#include <math.h>
#include <stdio.h>
#include <string.h>
#include "NAME.h"
int main(void)
{
    static NAME_state states[2];
    double r[4 + NAME_ORDER];
    memset(states, 0xAA, sizeof states);
    while (fread(r, sizeof r, 1, stdin) == 1) {
        NAME_state *s = &states[(int)r[1]];
        double out[2] = {0.0, 0.0};
        switch ((int)r[0]) {
        case 0: out[1] = NAME_step(s, r[2], r + 4, r[3], out); break;
        REFERENCE
        case 2: NAME_reset(s); break;
        case 3: memset(s, 0, sizeof *s); break;
        default: s->offset = r[2]; s->command = r[3]; break;
        }
        fwrite(out, sizeof out, 1, stdout);
    }
    return 0;
}
"""
REFERENCE = """
        case 1:
            out[1] = NAME_step(
                s, r[2], r + 4, NAME_reference((s->started != 0) ? r[2] - s->t_0 : 0.0), out);
            break;
"""


def load(path: Path, name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


handmade = load(ROOT / "tests" / "unit" / "codegen" / "handmade.py", "handmade_designs")


class Pair:
    """The Python controller and a program around the C one."""

    def __init__(self, folder: Path, name: str, flags: tuple[str, ...] = ("-O2",)) -> None:
        self.module = load(folder / "controller.py", f"controller_{name}")
        header = (folder / "c" / "include" / f"{name}.h").read_text()
        self.compiled = f"{name}_reference" in header
        driver = DRIVER.replace("REFERENCE", REFERENCE if self.compiled else "")
        (folder / "driver.c").write_text(driver.replace("NAME", name))
        self.program = folder / "driver"
        # The driver converts freely; only the controller has to be clean.
        include = ["-I", str(folder / "c" / "include"), "-ffp-contract=off"]
        for source, warnings in (("driver.c", []), (f"c/src/{name}.c", STRICT)):
            subprocess.run(
                ["gcc", *flags, *warnings, *include, "-c", source],
                cwd=folder,
                check=True,
                timeout=60,
            )
        subprocess.run(
            ["gcc", *flags, "driver.o", f"{name}.o", "-o", "driver", "-lm"],
            cwd=folder,
            check=True,
            timeout=60,
        )

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
        out = []
        for what, instance, t, y_d, *x in records.tolist():
            controller = controllers[int(instance)]
            if what == STEP:
                u = controller.step(t, x, y_d)
            elif what == COMPILED:
                u = controller.step(t, x)
            else:
                controller.reset()
                out += [0.0, 0.0]
                continue
            out += [u, float(controller.status)]
        return np.array(out).reshape(-1, 2)


def write(design: Design, folder: Path) -> str:
    law, provenance = build_law(design), make_provenance(design)
    files = {"controller.py": render_controller(law, provenance), **render_c(law, provenance)}
    for path, text in files.items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_text(text)
    return law.name


def samples(module: ModuleType, count: int, *, compiled: bool, seed: int) -> NDArray[np.float64]:
    """Runs of 40 samples each for two interleaved instances, one sample in nine spoiled."""
    random = np.random.default_rng(seed)
    order = module.Controller.ORDER
    records = np.zeros((count, 4 + order))
    records[:, 0] = np.where(random.random(count) < 0.5, COMPILED, STEP) if compiled else STEP
    records[:, 1] = np.arange(count) % 2
    run, place = np.arange(count) // RUN, np.arange(count) % RUN // 2
    # Steps from microseconds to minutes: both sides of the end of rho, late overflow included.
    pace = 10.0 ** random.uniform(-6.0, 1.5, run[-1] + 1)
    first = np.where(random.random(run[-1] + 1) < 0.5, 0.0, random.normal(size=run[-1] + 1) * 100)
    records[:, 2] = first[run] + pace[run] * place
    bound = module.y_d_limit
    records[:, 3] = np.clip(random.normal(size=count) * 0.3 * bound, -0.99 * bound, 0.99 * bound)
    expected = records[:, 3].copy()
    if compiled:
        elapsed = (records[:, 2] - first[run]).tolist()
        own = np.array([module.Controller.reference(s) for s in elapsed])
        expected = np.where(records[:, 0] == COMPILED, np.nan_to_num(own), expected)
    records[:, 4:] = states(module, expected, random)
    low, high = (constants(module, f"start_{side}") for side in ("lower", "upper"))
    drawn = random.uniform(low, high, (count, order))
    inside = (place == 0) & (random.random(count) < 0.9)
    records[:, 4:] = np.where(inside[:, None], drawn, records[:, 4:])
    spoiled = np.flatnonzero(random.random(count) < 0.11)
    columns = random.integers(2, 4 + order, len(spoiled))
    records[spoiled, columns] = random.choice(ODD, len(spoiled))
    resets = np.flatnonzero(place == 0)
    marks = np.zeros((len(resets), 4 + order))
    marks[:, 0] = np.where(random.random(len(resets)) < 0.5, RESET, ZERO)
    marks[:, 1] = records[resets, 1]
    return np.insert(records, resets, marks, axis=0)


def constants(module: ModuleType, stem: str) -> NDArray[np.float64]:
    return np.array([getattr(module, f"{stem}_{i + 1}") for i in range(module.Controller.ORDER)])


def states(
    module: ModuleType, y_d: NDArray[np.float64], random: np.random.Generator
) -> NDArray[np.float64]:
    """Two thirds at errors of the size of the tube, one third anywhere up to the limits."""
    c, N, p = (constants(module, stem) for stem in ("c", "N", "p"))
    if hasattr(module, "gamma_1"):
        heights = [getattr(module, f"H_{i + 1}_0") for i in range(len(p))]
        k, M, epsilon = constants(module, "gamma") * heights, np.zeros(len(p)), np.ones(len(p))
    else:
        k, M, epsilon = (constants(module, stem) for stem in ("k", "M", "epsilon"))
    limits, shape = constants(module, "x_limit"), (len(y_d), len(p))
    e = random.uniform(-1.05, 1.05, shape) * p
    phi = k * e + M * np.tanh(M * e / epsilon) + c * e**N
    near = e - np.hstack([-y_d[:, None], phi[:, :-1]])
    reach = 10.0 ** random.uniform(-3.0, 0.0, (len(y_d), 1))
    far = reach * np.clip(random.normal(size=shape), -2.0, 2.0) / 2.0 * limits
    chosen = np.where(random.random((len(y_d), 1)) < 0.67, near, far)
    return np.clip(chosen, -limits, limits)


def compare(pair: Pair, count: int, seed: int = 1) -> tuple[NDArray[np.float64], ...]:
    """Fail on the first differing bit; return the steps' records and results."""
    records = samples(pair.module, count, compiled=pair.compiled, seed=seed)
    ours, theirs = pair.python(records), pair.c(records)
    differing = np.flatnonzero((ours.view(np.int64) != theirs.view(np.int64)).any(axis=1))
    assert len(ours) == len(theirs) == len(records)
    assert len(differing) == 0, (len(differing), records[differing[0]], ours[differing[0]])
    steps = records[:, 0] < RESET
    return records[steps], ours[steps]


def shares(results: NDArray[np.float64]) -> dict[int, float]:
    return {status: float(np.mean(results[:, 1] == status)) for status in range(4)}


@pytest.mark.parametrize("name", sorted(handmade.DESIGNS))
def test_c_and_python_agree_in_every_bit(name: str, tmp_path: Path) -> None:
    pair = Pair(tmp_path, write(handmade.DESIGNS[name](), tmp_path))
    _, results = compare(pair, 100_000)
    share = shares(results)
    assert share[0] + share[1] >= 0.8
    assert min(share.values()) > 0.0005, share


def test_every_committed_controller_agrees_with_its_c(tmp_path: Path) -> None:
    # Laws in stages and center nominal have their own samples, in the two files beside this one.
    folders = sorted(
        path.parent
        for path in ROOT.glob("generated/*/controller.py")
        if not re.search("^(stage1_|T_s = )", path.read_text(), re.MULTILINE)
    )
    assert len(folders) > 5
    for folder in folders:
        copy = tmp_path / folder.name
        shutil.copytree(folder, copy, ignore=shutil.ignore_patterns("__pycache__", "build"))
        _, results = compare(Pair(copy, folder.name), 20_000)
        share = shares(results)
        assert share[0] + share[1] >= 0.8, (folder.name, share)
        assert min(share[0], share[1]) > 0.02, (folder.name, share)


def test_c_and_python_agree_in_every_bit_of_a_million_samples(tmp_path: Path) -> None:
    pair = Pair(tmp_path, write(handmade.everyday(), tmp_path))
    records, results = compare(pair, 1_000_000, seed=2)
    share = shares(results)
    accepted = results[:, 1] <= 1
    peak = pair.module.U_MAX
    assert share[0] + share[1] >= 0.8
    assert share[0] > 0.15
    assert share[1] > 0.15
    for clamped in (results[:, 0] == peak, results[:, 0] == -peak, np.abs(results[:, 0]) < peak):
        assert np.mean(clamped & accepted) > 0.01
    assert np.mean(records[:, 0] == COMPILED) > 0.4
    assert np.mean(records[:, 0] == STEP) > 0.4


@pytest.mark.parametrize("name", sorted(handmade.DESIGNS))
def test_the_samples_reach_both_sides_of_every_branch(name: str, tmp_path: Path) -> None:
    pair = Pair(tmp_path, write(handmade.DESIGNS[name](), tmp_path), flags=("-O0", "--coverage"))
    records = samples(pair.module, 20_000, compiled=pair.compiled, seed=1)
    # What only a spoiled state reaches: an offset that makes the command NaN, a wild command.
    ordinary = records[(records[:, 0] == RESET).argmax() + 1 :]
    ordinary = ordinary[(ordinary[:, 0] == STEP) & np.isfinite(ordinary).all(axis=1)][:1]
    spoilt = []
    for offset, command in ((np.nan, 0.0), (0.0, np.nan), (0.0, 1e300), (0.0, -1e300)):
        reset, spoil = np.zeros_like(ordinary), np.zeros_like(ordinary)
        reset[:, 0], spoil[:, 0] = RESET, SPOIL
        spoil[:, 2:4] = offset, command
        ordinary[:, 1], ordinary[:, 3] = 0.0, 0.0
        spoilt += [reset, ordinary, spoil, ordinary]
    results = pair.c(np.concatenate([records, *spoilt]))
    assert np.isfinite(results).all()
    assert np.abs(results[:, 0]).max() <= pair.module.U_MAX
    done = subprocess.run(
        ["gcov", "-b", f"{handmade.DESIGNS[name]().spec.name}.c"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=True,
        timeout=60,
    )
    own = done.stdout.split(f"{handmade.DESIGNS[name]().spec.name}.c'", 1)[1]
    taken = re.search(r"Taken at least once:([\d.]+)% of (\d+)", own)
    assert int(taken[2]) > 20
    assert float(taken[1]) == 100.0, own


def test_a_changed_bit_of_a_gain_is_noticed(tmp_path: Path) -> None:
    name = write(handmade.everyday(), tmp_path)
    path = tmp_path / "controller.py"
    text = path.read_text()
    assert "k_1 = 1.5\n" in text
    path.write_text(text.replace("k_1 = 1.5\n", "k_1 = 1.5000000000000002\n"))
    pair = Pair(tmp_path, name)
    with pytest.raises(AssertionError):
        compare(pair, 2_000)


def test_zero_initialized_equals_reset(tmp_path: Path) -> None:
    pair = Pair(tmp_path, write(handmade.everyday(), tmp_path))
    records = samples(pair.module, 4_000, compiled=True, seed=3)
    results = []
    for way in (RESET, ZERO):
        marks = records[:, 0] >= RESET
        records[marks, 0] = way
        results.append(pair.c(records))
    assert results[0].tobytes() == results[1].tobytes()
    assert len(set(results[0][:, 1])) == 4


def test_two_instances_do_not_disturb_each_other(tmp_path: Path) -> None:
    pair = Pair(tmp_path, write(handmade.everyday(), tmp_path))
    records = samples(pair.module, 4_000, compiled=True, seed=4)
    together = pair.c(records)
    for instance in (0, 1):
        own = records[:, 1] == instance
        alone = pair.c(records[own])
        assert alone.tobytes() == together[own].tobytes()
        assert pair.python(records[own]).tobytes() == together[own].tobytes()


def test_the_compiled_in_reference_is_the_same_in_both(tmp_path: Path) -> None:
    pair = Pair(tmp_path, write(handmade.kinked(), tmp_path))
    random = np.random.default_rng(5)
    times = np.concatenate([random.uniform(0.0, 30.0, 2_000), 10.0 ** random.uniform(-9, 6, 500)])
    # Passing the reference's own value must give what None gives: C has no None.
    records = np.zeros((2 * len(times), 5))
    for index, t in enumerate(np.sort(times).tolist()):
        records[2 * index] = (COMPILED, 0, t, 0.0, 0.5)
        records[2 * index + 1] = (STEP, 1, t, pair.module.Controller.reference(0.0), 0.5)
    start = np.sort(times)[0]
    for index, t in enumerate(np.sort(times).tolist()):
        records[2 * index + 1, 3] = pair.module.Controller.reference(t - start)
    begin = np.zeros((2, 5))
    begin[:, 0], begin[:, 1] = RESET, (0, 1)
    both = pair.c(np.concatenate([begin, records]))[2:]
    assert both[0::2].tobytes() == both[1::2].tobytes()
    assert len(set(both[:, 0].tolist())) > 1_000


def test_the_statuses_of_both_languages_have_the_same_numbers(tmp_path: Path) -> None:
    name = write(handmade.everyday(), tmp_path)
    module = load(tmp_path / "controller.py", "controller_statuses")
    header = (tmp_path / "c" / "include" / f"{name}.h").read_text()
    numbers = dict(re.findall(rf"{name}_(\w+) = (\d)", header))
    assert {status.name: str(int(status)) for status in module.Status} == numbers
    assert list(itertools.islice(module.Status, 4)) == [0, 1, 2, 3]
