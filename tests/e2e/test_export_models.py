"""export --to fmu2, fmu3, control, casadi on certified folders, in the tools they are for."""

from __future__ import annotations

import copy
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import casadi as ca
import control as ct
import fmpy
import numpy as np
import pytest
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave
from fmpy.validation import validate_fmu

from bfppc_synth.certificate import checker
from bfppc_synth.certificate.period import OtherDelay, proved_step
from bfppc_synth.certificate.produce import alternatives, holds
from bfppc_synth.cli import main
from bfppc_synth.simulation.loading import load_controller, load_text

if TYPE_CHECKING:
    from types import ModuleType

ROOT = Path(__file__).parents[2]
ALL = os.environ.get("BFPPC_TESTS") == "all"
NAMES = ["paper_example_1", "switching_example_2"]
TARGETS = ("fmu2", "fmu3", "control", "casadi")
STAGED = ("fmu2", "control", "casadi")
if ALL:
    NAMES = sorted(path.name for path in (ROOT / "generated").iterdir() if path.is_dir())
PAIRS = [(n, t) for n in NAMES for t in ("fmu2", "fmu3") if ALL or n == NAMES[0] or t in STAGED]


@pytest.fixture(scope="module")
def folders(tmp_path_factory: pytest.TempPathFactory):
    """Copies of generated folders, everything exported."""
    place, known = tmp_path_factory.mktemp("models"), {}

    def folder(name: str) -> Path:
        if name not in known:
            known[name] = place / name
            shutil.copytree(ROOT / "generated" / name, known[name])
            for target in TARGETS if ALL or name == NAMES[0] else STAGED:
                assert main(["export", str(known[name]), "--to", target, "--quiet"]) == 0
        return known[name]

    return folder


def script(folder: Path, which: str) -> ModuleType:
    path = folder / "interop" / f"{folder.name}_{which}.py"
    return load_text(path.read_text(encoding="utf-8"), name=f"{folder.name}_{which}", origin=which)


def middle(folder: Path) -> list[float]:
    text = (folder / "controller.py").read_text(encoding="utf-8")
    numbers = vars(load_text(text, name="numbers", origin="controller.py"))
    return [
        0.5 * (numbers[f"start_lower_{i}"] + numbers[f"start_upper_{i}"])
        for i in range(1, numbers["Controller"].ORDER + 1)
    ]


def signals(folder: Path, names: list[str], times: np.ndarray) -> np.ndarray:
    table = np.zeros(len(times), dtype=[("time", float), *((name, float) for name in names)])
    table["time"] = times
    for place, (name, start) in enumerate(zip(names, middle(folder), strict=True)):
        table[name] = start * np.cos(3.0 * times) + 0.02 * np.sin((50.0 + 9.0 * place) * times)
    return table


@pytest.mark.parametrize(("name", "target"), PAIRS)
@pytest.mark.parametrize("kind", ["ModelExchange", "CoSimulation"])
def test_fmpy_finds_no_problem_and_simulates_the_bits_of_python(name, target, kind, folders):
    folder = folders(name)
    path = folder / "interop" / target / f"{name}.fmu"
    assert validate_fmu(str(path)) == []
    controller = load_controller(folder / "controller.py")()
    states = [
        v.name
        for v in fmpy.read_model_description(str(path)).modelVariables
        if v.causality == "input"
    ]
    outputs = ["u", "status", *(["stage"] if hasattr(controller, "stage") else [])]
    table = signals(folder, states, np.arange(301) * 0.001)
    options = {"step_size": 0.001, "solver": "Euler"} if kind == "ModelExchange" else {}
    rows = fmpy.simulate_fmu(
        str(path),
        fmi_type=kind,
        input=table,
        output=[*states, *outputs],
        start_time=0.0,
        stop_time=0.3,
        output_interval=0.001,
        **options,
    )
    times = rows["time"]
    if kind == "CoSimulation":
        # One communication step late: a row shows what its step began with, and what came of it.
        rows, times = rows[1:], times[:-1]
    assert len(rows) >= 300
    for time, row in zip(times, rows, strict=True):
        u = controller.step(float(time), [float(row[state]) for state in states])
        assert row["u"] == u
        assert row["status"] == controller.status
        if "stage" in outputs:
            assert row["stage"] == controller.stage
    if "stage" in outputs:
        assert controller.stage > 1


@pytest.mark.parametrize("target", ["fmu2", "fmu3"] if ALL else ["fmu3"])
def test_fmpy_builds_the_sources_again(target, folders, tmp_path):
    folder = folders("paper_example_1")
    path = tmp_path / "again.fmu"
    shutil.copy(folder / "interop" / target / "paper_example_1.fmu", path)
    before = fmpy.extract(str(path), unzipdir=str(tmp_path / "before"))
    library = next(Path(before).glob("binaries/*/*.so"))
    subprocess.run(
        [sys.executable, "-m", "fmpy", "compile", str(path)],
        check=True,
        capture_output=True,
        timeout=120,
        env={**os.environ, "PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}"},
    )
    after = fmpy.extract(str(path), unzipdir=str(tmp_path / "after"))
    assert (Path(after) / library.relative_to(before)).read_bytes() != library.read_bytes()
    table = signals(folder, ["x1", "x2"], np.arange(51) * 0.001)
    rows = [
        fmpy.simulate_fmu(str(place), fmi_type="CoSimulation", input=table, output=["u"])
        for place in (before, after)
    ]
    assert np.array_equal(rows[0]["u"], rows[1]["u"])


def test_event_mode_of_fmi3_has_no_delay(folders, tmp_path):
    folder = folders("paper_example_1")
    path = str(folder / "interop" / "fmu3" / "paper_example_1.fmu")
    description = fmpy.read_model_description(path)
    places = {v.name: v.valueReference for v in description.modelVariables}
    fmu = FMU3Slave(
        guid=description.guid,
        modelIdentifier="paper_example_1",
        unzipDirectory=fmpy.extract(path, unzipdir=str(tmp_path / "one")),
        instanceName="one",
    )
    fmu.instantiate(eventModeUsed=True)
    fmu.enterInitializationMode(startTime=0.0)
    controller, table = (
        load_controller(folder / "controller.py")(),
        signals(folder, ["x1", "x2"], np.arange(100) * 0.001),
    )
    for k, (time, *x) in enumerate(table.tolist()):
        fmu.setFloat64([places["x1"], places["x2"]], x)
        if k == 0:
            fmu.exitInitializationMode()
        fmu.updateDiscreteStates()
        assert fmu.getFloat64([places["u"]])[0] == controller.step(time, x)
        fmu.enterStepMode()
        needed, *_ = fmu.doStep(time, 0.001)
        assert needed
        fmu.enterEventMode()
    fmu.terminate()
    fmu.freeInstance()


def test_an_fmu_takes_back_steps_and_refuses_what_it_does_not_have(folders, tmp_path):
    folder = folders("paper_example_1")
    path = str(folder / "interop" / "fmu2" / "paper_example_1.fmu")
    description = fmpy.read_model_description(path)
    places = {v.name: v.valueReference for v in description.modelVariables}
    start, unzipped = middle(folder), fmpy.extract(path, unzipdir=str(tmp_path / "one"))

    def made(guid: str) -> FMU2Slave:
        return FMU2Slave(
            guid=guid,
            modelIdentifier="paper_example_1",
            unzipDirectory=unzipped,
            instanceName="one",
        )

    with pytest.raises(Exception, match="instantiate"):
        made("{another}").instantiate()
    fmu = made(description.guid)
    fmu.instantiate()
    fmu.setupExperiment(startTime=0.0)
    fmu.enterInitializationMode()
    fmu.exitInitializationMode()

    def stepped(time: float, x: list[float]) -> tuple[float, int]:
        fmu.setReal([places["x1"], places["x2"]], x)
        fmu.doStep(time, 0.001)
        return fmu.getReal([places["u"]])[0], fmu.getInteger([places["status"]])[0]

    first = stepped(0.0, start)
    assert first[1] == 0
    kept = fmu.getFMUState()
    bytes_kept = fmu.serializeFMUstate(kept)
    second = stepped(0.001, [start[0] + 0.01, start[1]])
    assert second[0] != first[0]
    assert stepped(0.002, [float("nan"), 0.0]) == (second[0], 2)
    assert stepped(0.0015, start) != stepped(0.0005, start)
    assert fmu.getInteger([places["status"]])[0] == 3
    fmu.setFMUState(kept)
    assert stepped(0.001, [start[0] + 0.01, start[1]]) == second
    again = fmu.deSerializeFMUstate(bytes_kept)
    fmu.setFMUState(again)
    assert stepped(0.001, [start[0] + 0.01, start[1]]) == second
    for wrong in (
        lambda: fmu.getReal([99]),
        lambda: fmu.setReal([places["u"]], [1.0]),
        lambda: fmu.getInteger([places["u"]]),
        lambda: fmu.doStep(0.002, -1.0),
        lambda: fmu.doStep(float("nan"), 0.001),
    ):
        with pytest.raises(Exception, match="fmi2"):
            wrong()
    fmu.freeFMUState(kept)
    fmu.freeFMUState(again)
    fmu.freeInstance()


@pytest.mark.parametrize("factor", [1.0, 3000.0])
def test_a_closed_co_simulation_keeps_its_tube_at_the_certified_step_and_not_far_beyond(
    factor, folders, tmp_path
):
    folder = folders("paper_example_1")
    path = folder / "interop" / "fmu2" / "paper_example_1.fmu"
    description, plant = described(folder, "fmu2"), script(folder, "control")
    places = {v.name: v.valueReference for v in description.modelVariables}
    states = [places[name] for name in plant.STATES]
    step = factor * constant(folder, "fmu2", "largest_communication_step")
    fmu = FMU2Slave(
        guid=description.guid,
        modelIdentifier="paper_example_1",
        unzipDirectory=fmpy.extract(str(path), unzipdir=str(tmp_path / "one")),
        instanceName="one",
    )
    x = tuple(middle(folder))
    fmu.instantiate()
    fmu.setupExperiment(startTime=0.0)
    fmu.enterInitializationMode()
    fmu.setReal(states, list(x))
    fmu.exitInitializationMode()
    u, seen = fmu.getReal([places["u"]])[0], set()
    for k in range(3000):
        fmu.setReal(states, list(x))
        fmu.doStep(k * step, step)
        x = plant.advance_model(k * step, step, *x, u, *plant.NOMINAL)
        if not all(abs(value) < 10.0 for value in x):
            seen.add("left")
            break
        u = fmu.getReal([places["u"]])[0]
        seen.add(fmu.getInteger([places["status"]])[0])
    fmu.freeInstance()
    assert (seen == {0}) == (factor == 1.0)


@pytest.mark.parametrize("name", NAMES)
def test_the_casadi_function_has_the_bits_of_python_and_is_usable_in_symbols(name, folders):
    folder = folders(name)
    module, pure = script(folder, "casadi"), script(folder, "control")
    begin, law = getattr(module, f"{name}_start"), getattr(module, name)
    controller = load_controller(folder / "controller.py")()
    staged = hasattr(controller, "stage")
    assert ca.GlobalOptions.getSimplificationOnTheFly()
    memory = known = None
    for time, *x in signals(folder, pure.STATES, np.arange(400) * 0.01).tolist():
        u = controller.step(time, x)
        if memory is None:
            memory, known = begin(x), pure.first_sample(tuple(x))
        answers = law(time, x, memory), pure.law(time, tuple(x), known)
        if staged:
            (answer, memory), (other, known) = answers
            assert float(memory[0]) == known[0] == controller.stage
        else:
            answer, other = answers
        assert controller.status <= 1
        assert float(answer) == u == other
    x = ca.MX.sym("x", len(pure.STATES))
    results = law(1.0, x, memory)
    u = results[0] if staged else results
    slope = ca.Function("slope", [x], [ca.jacobian(u, x)])(middle(folder))
    assert np.isfinite(slope.full()).all()
    assert slope.shape == (1, len(pure.STATES))


@pytest.mark.parametrize("name", NAMES)
def test_python_control_closes_the_loop_with_the_bits_of_python(name, folders):
    folder = folders(name)
    module, period, x = script(folder, "control"), 1e-4, tuple(middle(folder))
    _, controller, loop = module.sampled(period, substeps=2)
    times = np.arange(501) * period
    result = ct.input_output_response(loop, times, 0, [*x, *[0.0] * controller.nstates])
    python = load_controller(folder / "controller.py")()
    for k, time in enumerate(times.tolist()):
        u = python.step(time, x)
        assert tuple(result.outputs[:, k]) == (*x, u)
        for part in range(2):
            x = module.advance_model(time + part * period / 2, period / 2, *x, u, *module.NOMINAL)
    assert np.isfinite(result.outputs).all()
    if hasattr(python, "stage"):
        assert not hasattr(module, "continuous")
        return
    _, _, loop = module.continuous(middle(folder))
    options = {"rtol": 1e-8, "atol": 1e-10}
    smooth = ct.input_output_response(
        loop, times, 0, middle(folder), solve_ivp_method="LSODA", solve_ivp_kwargs=options
    )
    assert np.abs(smooth.outputs[0] - result.outputs[0]).max() < 1e-4


def read(folder: Path):
    plant = checker.read_json(folder / "plant.json")
    written = checker.read_json(folder / "certificate.json")["design"]
    return plant, written


def proves(plant, written, period: float, delay: float) -> bool:
    document = copy.deepcopy(plant)
    document["plant"]["sampling"] = {"period": repr(period), "delay": repr(delay)}
    try:
        found = checker.read_design(dict(written)).obligations(document)
    except checker.Refusal:
        return False
    return all(map(holds, alternatives(found)))


def described(folder: Path, target: str):
    path = folder / "interop" / target / f"{folder.name}.fmu"
    return fmpy.read_model_description(str(path))


def constant(folder: Path, target: str, name: str) -> float:
    rows = described(folder, target).modelVariables
    return float(next(v.start for v in rows if v.name == name))


def test_the_largest_communication_step_is_proved_with_its_own_delay(folders):
    folder = folders("paper_example_1")
    plant, written = read(folder)
    step = constant(folder, "fmu2", "largest_communication_step")
    assert step > 0.0
    assert proves(plant, written, step, step)
    assert not proves(plant, written, 1.1 * step, 1.1 * step)
    event = constant(folder, "fmu3", "largest_communication_step_event_mode")
    assert event > 1.9 * step
    assert proves(plant, written, event, 0.0)
    assert not proves(plant, written, 1.1 * event, 0.0)
    assert f"at most {step!r} s" in described(folder, "fmu2").description


def test_a_declared_delay_comes_on_top_of_the_one_step(tmp_path):
    plant, written = read(ROOT / "generated" / "van_der_pol")
    whole = proved_step(plant, written, 5e-4, late=1)
    late = copy.deepcopy(plant)
    late["plant"]["sampling"] = {"period": "1e-4", "delay": "2e-4"}
    step = proved_step(late, written, 3e-4, late=1)
    assert 0.0 < step < whole
    assert proves(plant, written, step, step + 2e-4)
    alone = proved_step(late, written, 3e-4, late=1, other=OtherDelay.NONE)
    assert alone == whole
    assert proves(plant, written, alone, alone)


def test_no_step_is_certified_for_a_law_with_stages(folders):
    folder = folders("switching_example_2")
    assert constant(folder, "fmu2", "largest_communication_step") == 0.0
    assert "is not certified" in described(folder, "fmu2").description


@pytest.mark.parametrize("target", ["fmu2", "control", "casadi"])
def test_a_folder_that_does_not_verify_is_refused(target, tmp_path, capsys):
    folder = tmp_path / "arm"
    shutil.copytree(ROOT / "generated" / "paper_example_1", folder)
    path = folder / "certificate.json"
    text = path.read_text()
    document = json.loads(text)
    document["design"]["p"][0] = (2 * float.fromhex(document["design"]["p"][0])).hex()
    path.write_text(json.dumps(document))
    assert main(["export", str(folder), "--to", target, "--json"]) in (2, 4)
    assert json.loads(capsys.readouterr().out)["format"] == "bfppc-synth/error/1"
    path.write_text(text)
    code = folder / "controller.py"
    code.write_text(code.read_text() + "\n# edited\n")
    assert main(["export", str(folder), "--to", target]) in (2, 4)
    assert not (folder / "interop").exists()
    path.unlink()
    assert main(["export", str(folder), "--to", target]) == 2
    assert "nothing proved to export" in capsys.readouterr().err


def test_the_same_design_gives_the_same_file_and_without_a_compiler_the_sources(
    folders, tmp_path, capsys, monkeypatch
):
    folder = tmp_path / "elsewhere"
    shutil.copytree(ROOT / "generated" / "paper_example_1", folder)
    path = folder / "interop" / "fmu2" / "paper_example_1.fmu"
    words = ["export", str(folder), "--to", "fmu2", "--json"]
    assert main(words) == 0
    step = json.loads(capsys.readouterr().out)["largest_communication_step"]
    first = folders("paper_example_1")
    assert step == constant(first, "fmu2", "largest_communication_step")
    assert path.read_bytes() == (first / "interop" / "fmu2" / path.name).read_bytes()
    monkeypatch.setenv("PATH", str(tmp_path))
    assert main(words) == 0
    told = capsys.readouterr()
    assert json.loads(told.out)["left_out"][0].startswith("binary: no compiler")
    assert "sources are complete" in told.err
    assert validate_fmu(str(path)) == []
    assert [item.name for item in path.parent.iterdir()] == [path.name]


def test_an_unknown_format_names_the_known_ones(capsys):
    assert main(["export", str(ROOT / "generated" / "motor_arm"), "--to", "fmu1"]) == 2
    assert "smt2 or coq or fmu2 or fmu3 or control or casadi" in capsys.readouterr().err
