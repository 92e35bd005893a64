"""An FMU of any law: valid, self-contained, true to the standard's headers, the same each time."""

from __future__ import annotations

import os
import random
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import fmpy
import pytest
from fmpy.fmi2 import FMU2Model
from fmpy.fmi3 import FMU3Model
from fmpy.validation import validate_fmu

from bfppc_synth.codegen.c import render_c
from bfppc_synth.interop.binary import NoBinary, build_binary
from bfppc_synth.interop.fmu import Standard, Steps, archive, source_of, variables_of

HEADERS = Path(fmpy.__file__).parent / "c-code"
STRICT = ["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror"]
KINDS = ["kinked", "run_time", "supplied"]
BOTH = list(Standard)
COMPILED = [
    ("run_time", Standard.FMI2),
    ("supplied", Standard.FMI3),
    ("single", Standard.FMI2),
]
if os.environ.get("BFPPC_TESTS") == "all":
    COMPILED = [(kind, standard) for kind in [*KINDS, "single"] for standard in BOTH]


@pytest.mark.parametrize("standard", BOTH)
@pytest.mark.parametrize("kind", ["run_time", "supplied"])
def test_the_sources_agree_with_the_headers_of_the_standard(kind, standard, made, tmp_path):
    for path, text in made(kind).texts(standard).items():
        if path.startswith("sources/"):
            (tmp_path / Path(path).name).write_text(text)
    source = source_of(standard)
    header = str(HEADERS / f"fmi{standard.major}Functions.h")
    for more in ([], ["-include", header]):
        command = ["gcc", *STRICT, *more, "-fsyntax-only", source]
        subprocess.run(command, cwd=tmp_path, check=True, timeout=60)


@pytest.mark.parametrize("standard", BOTH)
def test_a_header_of_the_standard_would_notice_a_wrong_signature(standard, made, tmp_path):
    for path, text in made("everyday").texts(standard).items():
        if path.startswith("sources/"):
            (tmp_path / Path(path).name).write_text(text)
    source, major = tmp_path / source_of(standard), standard.major
    spoiled = source.read_text().replace(f"fmi{major}Error;", "0;", 1)
    spoiled = spoiled.replace(f"F(fmi{major}Terminate)(", f"F(fmi{major}Terminate)(int a, ")
    source.write_text(spoiled)
    header = str(HEADERS / f"fmi{major}Functions.h")
    command = ["gcc", "-std=c99", "-include", header, "-fsyntax-only", source.name]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, check=False, timeout=60)
    assert b"conflicting types" in done.stderr


@pytest.mark.parametrize("standard", BOTH)
@pytest.mark.parametrize("kind", KINDS)
def test_fmpy_finds_no_problem(kind, standard, made, tmp_path):
    texts = made(kind).texts(standard)
    path = tmp_path / "law.fmu"
    path.write_bytes(archive({name: text.encode() for name, text in texts.items()}))
    assert validate_fmu(str(path)) == []


def test_fmpy_finds_a_problem_in_a_spoiled_description(made, tmp_path):
    texts = made("everyday").texts(Standard.FMI2)
    name = "modelDescription.xml"
    texts[name] = texts[name].replace('causality="output"', 'causality="outside"', 1)
    path = tmp_path / "law.fmu"
    path.write_bytes(archive({name: text.encode() for name, text in texts.items()}))
    assert validate_fmu(str(path)) != []


@pytest.mark.parametrize(("kind", "standard"), COMPILED)
def test_model_exchange_gives_the_bits_of_the_python_controller(kind, standard, made, tmp_path):
    one = made(kind)
    path = one.fmu(standard, tmp_path)
    description = fmpy.read_model_description(str(path))
    folder = fmpy.extract(str(path), unzipdir=str(tmp_path / "unzipped"))
    places = {v.name: v.valueReference for v in description.modelVariables}
    inputs = [v.valueReference for v in description.modelVariables if v.causality == "input"]
    kinds = {Standard.FMI2: FMU2Model, Standard.FMI3: FMU3Model}
    model = kinds[standard](
        guid=description.guid,
        modelIdentifier=description.modelExchange.modelIdentifier,
        unzipDirectory=folder,
        instanceName="one",
    )
    second = standard is Standard.FMI2
    write = model.setReal if second else model.setFloat64
    read = model.getReal if second else model.getFloat64
    whole = model.getInteger if second else model.getInt32
    update = model.newDiscreteStates if second else model.updateDiscreteStates
    rng, order = random.Random(kind), one.law.order  # noqa: S311
    controller = one.module.Controller()
    model.instantiate()
    compared = 0
    for run in range(10):
        time = 0.25 * run
        if second:
            model.setupExperiment(startTime=time)
            model.enterInitializationMode()
        else:
            model.enterInitializationMode(startTime=time)
        controller.reset()
        middle = [getattr(one.module, f"start_upper_{i}") for i in range(1, order + 1)]
        for k in range(40):
            near = [rng.uniform(-1.0, 1.0) * end for end in middle]
            y_d = [rng.uniform(-0.3, 0.3) for _ in inputs[order:]]
            write(inputs, [*near, *y_d])
            if k == 0:
                model.exitInitializationMode()
                update()
                model.enterContinuousTimeMode()
            else:
                # A solver may look ahead and come back: nothing of that may be remembered.
                model.setTime(time + 5.0)
                read([places["u"]])
                model.setTime(time)
            passed = None if not y_d else y_d[0] if len(y_d) == 1 else y_d
            expected = controller.step(time, near, passed)
            assert read([places["u"]])[0] == expected
            model.completedIntegratorStep()
            assert read([places["u"]])[0] == expected
            assert whole([places["status"]])[0] == controller.status
            compared += controller.status <= 1
            time += rng.choice([0.0, 0.001, 0.1])
        model.reset()
    model.freeInstance()
    assert compared > 350


@pytest.mark.parametrize("standard", BOTH)
def test_equal_laws_give_equal_bytes_and_another_law_another_identity(standard, made):
    first, again, other = (made(k).texts(standard) for k in ("everyday", "everyday", "kinked"))
    assert first == again
    assert archive({k: v.encode() for k, v in first.items()}) == archive(
        {k: v.encode() for k, v in reversed(again.items())}
    )
    name = "modelDescription.xml"
    guids = {t[name].split("{", 1)[1][:36] for t in (first, other)}
    assert len(guids) == 2


@pytest.mark.parametrize("standard", BOTH)
def test_a_state_may_have_the_name_of_an_output(standard, made):
    law = made("everyday").law
    law = replace(law, states=("status", "stage"), units=(("status", "<&"),))
    names = [v.name for v in variables_of(law, Steps(delayed=None, event=None), standard)]
    assert len(set(names)) == len(names)
    assert names[:2] == ["state_status", "state_stage"]


@pytest.mark.parametrize("standard", BOTH)
def test_text_of_a_plant_file_does_not_break_the_xml(standard, made, tmp_path):
    one = made("everyday")
    law = replace(one.law, title='<b> & "x"', units=(("x1", '"<&>'), ("u", "é°")))
    texts = replace(one, law=law).texts(standard)
    path = tmp_path / "law.fmu"
    path.write_bytes(archive({name: text.encode() for name, text in texts.items()}))
    assert validate_fmu(str(path)) == []


def test_the_description_says_which_step_the_certificate_covers_or_that_it_covers_none(made):
    one = made("everyday")
    some = one.texts(Standard.FMI3)["modelDescription.xml"]
    assert "at most 0.00125 s" in some
    assert "at most 0.0025 s" in some
    both = one.texts(Standard.FMI2, Steps(delayed=0.5, event=None, alone=0.75))
    assert "none of its own" in both["modelDescription.xml"]
    assert "none of its own" not in some
    none = one.texts(Standard.FMI3, Steps(delayed=None, event=None))["modelDescription.xml"]
    assert "is not certified" in none
    assert "at most" not in none


def test_without_a_compiler_there_is_a_reason_and_no_binary(made, monkeypatch):
    texts = made("everyday").texts(Standard.FMI2)
    monkeypatch.setattr(shutil, "which", lambda _name: None)
    built = build_binary(texts, "hand_made", Standard.FMI2)
    assert isinstance(built, NoBinary)
    assert "no compiler" in built.reason


def test_a_compiler_that_fails_gives_its_reason_and_no_binary(made):
    texts = made("everyday").texts(Standard.FMI2)
    spoiled = {**texts, "sources/fmi2-interface.c": "#error broken\n"}
    built = build_binary(spoiled, "hand_made", Standard.FMI2)
    assert isinstance(built, NoBinary)
    assert "broken" in built.reason


@pytest.mark.parametrize("name", ["fmi2", "fmu_memory", "instance"])
def test_a_plant_may_have_the_name_of_a_part_of_its_fmu(name, made, tmp_path):
    one = made("everyday")
    law = replace(one.law, name=name)
    texts = replace(one, law=law, code=render_c(law, one.provenance)).texts(Standard.FMI2)
    for path, text in texts.items():
        if path.startswith("sources/"):
            (tmp_path / Path(path).name).write_text(text)
    command = ["gcc", *STRICT, "-fsyntax-only", source_of(Standard.FMI2)]
    subprocess.run(command, cwd=tmp_path, check=True, timeout=60)
