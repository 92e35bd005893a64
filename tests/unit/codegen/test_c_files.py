"""The C folder: compilers have nothing to say, and every symbol carries the plant's name."""

from __future__ import annotations

import re
import subprocess

import pytest

from bfppc_synth.codegen.c import render_c
from bfppc_synth.codegen.law import build_law
from bfppc_synth.codegen.provenance import make_provenance
from bfppc_synth.codegen.python import render_controller

WARNINGS = [
    "-Wall",
    "-Wextra",
    "-Wpedantic",
    "-Wconversion",
    "-Wshadow",
    "-Wundef",
    "-Wfloat-conversion",
    "-Wcast-qual",
    "-Wvla",
    "-Werror",
    "-ffp-contract=off",
    "-Iinclude",
]
C99 = ["gcc", "-std=c99", "-Wdouble-promotion", "-Wmissing-prototypes", "-Wstrict-prototypes"]
CPP = ["g++", "-x", "c++", "-std=c++11", "-Wdouble-promotion"]
NAMES = ["everyday", "kinked", "overflowing", "run_time"]


def write(design, folder):
    for path, text in render_c(build_law(design), make_provenance(design)).items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_text(text)
    return design.spec.name


def run(command, folder):
    return subprocess.run(
        command, cwd=folder, capture_output=True, text=True, check=False, timeout=60
    )


def certified(text, pattern):
    block = re.search(
        r"CERTIFIED CONSTANTS BEGIN.*?\n(.*?)\n[^\n]*CERTIFIED CONSTANTS END", text, re.DOTALL
    )
    return re.findall(pattern, block[1], re.MULTILINE), len(block[1].splitlines())


@pytest.mark.parametrize("compiler", [C99, CPP], ids=["c99", "c++11"])
@pytest.mark.parametrize("name", NAMES)
def test_the_compiler_has_nothing_to_say(handmade, tmp_path, name, compiler):
    plant = write(handmade.DESIGNS[name](), tmp_path)
    for source in (f"src/{plant}.c", "example/main.c"):
        command = [*compiler, "-O2", *WARNINGS, "-c", source, "-o", "out.o"]
        done = run(command, tmp_path / "c")
        assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize("flag", ["-ffast-math", "-ffinite-math-only"])
def test_fast_math_is_refused(handmade, tmp_path, flag):
    plant = write(handmade.everyday(), tmp_path)
    done = run(["gcc", "-std=c99", "-Iinclude", flag, "-c", f"src/{plant}.c"], tmp_path / "c")
    assert done.returncode != 0
    assert f"{plant}: compile without" in done.stderr


def test_every_symbol_carries_the_name(handmade, tmp_path):
    plant = write(handmade.everyday(), tmp_path)
    assert run([*C99, *WARNINGS, "-c", f"src/{plant}.c"], tmp_path / "c").returncode == 0
    done = run(["nm", f"{plant}.o"], tmp_path / "c")
    symbols = [line.split()[-2:] for line in done.stdout.splitlines()]
    own = {name for kind, name in symbols if kind != "U"}
    assert {f"{plant}_{f}" for f in ("reset", "step", "reference")} <= own
    assert all(name.startswith(f"{plant}_") for name in own)
    assert {name for kind, name in symbols if kind == "U"} <= {"cos", "sin", "tanh"}
    # No writable data: nothing survives between calls but the caller's state.
    assert not [name for kind, name in symbols if kind in "BbDdCc"]


def test_the_makefile_builds_and_the_example_runs(handmade, tmp_path):
    write(handmade.everyday(), tmp_path)
    done = run(["make", "--silent", "run", "shared"], tmp_path / "c")
    assert (done.returncode, done.stderr) == (0, "")
    lines = done.stdout.splitlines()
    assert len(lines) == 5
    assert all(line.endswith("  OK") for line in lines)


def test_the_example_prints_what_python_computes(handmade, tmp_path, module_of):
    design = handmade.everyday()
    write(design, tmp_path)
    run(["make", "--silent"], tmp_path / "c")
    printed = re.findall(r"t = (\S+)  u = (\S+)", run(["make", "-s", "run"], tmp_path / "c").stdout)
    controller = module_of(design).Controller()
    text = (tmp_path / "c" / "example" / "main.c").read_text()
    x = [float(v) for v in re.search(r"_ORDER\] = \{(.*?)\}", text)[1].split(",")]
    assert len(printed) == 5
    for t, u in printed:
        assert controller.step(float(t), x) == float(u)


def test_every_build_file_forbids_contraction(handmade, tmp_path):
    write(handmade.everyday(), tmp_path)
    for name in ("Makefile", "CMakeLists.txt", "README.md"):
        assert "-ffp-contract=off" in (tmp_path / "c" / name).read_text()


@pytest.mark.parametrize("name", NAMES)
def test_both_languages_carry_the_same_certified_constants(handmade, name):
    design = handmade.DESIGNS[name]()
    law, provenance = build_law(design), make_provenance(design)
    plant = design.spec.name
    python, python_lines = certified(render_controller(law, provenance), r"^(\w+) = (\S+)$")
    source = render_c(law, provenance)[f"c/src/{plant}.c"]
    c, c_lines = certified(source, rf"^static const {plant}_real {plant}_(\w+) = (\S+);$")
    assert [(n, float(v)) for n, v in python] == [(n, float(v)) for n, v in c]
    assert len(python) == python_lines == c_lines == 6 * law.order + 1
    for (text_name, text), constant in zip(python, law.certified, strict=True):
        assert (text_name, float(text)) == (constant.name, constant.value)


def test_the_source_has_no_forbidden_words(handmade):
    for make in handmade.DESIGNS.values():
        design = make()
        source = render_c(build_law(design), make_provenance(design))[f"c/src/{design.spec.name}.c"]
        code = re.sub(r"/\*.*?\*/", "", source, flags=re.DOTALL)
        forbidden = r"\b(malloc|free|printf|M_PI|NAN|INFINITY|fmin|fmax|goto|static \w+ \w+;)\b"
        assert not re.search(forbidden, code)


def test_equal_designs_give_equal_bytes(handmade):
    first, second = (
        render_c(build_law(d), make_provenance(d)) for d in (handmade.kinked(), handmade.kinked())
    )
    assert first == second
    assert sorted(first) == [
        "c/CMakeLists.txt",
        "c/Makefile",
        "c/README.md",
        "c/example/main.c",
        "c/include/kinked.h",
        "c/src/kinked.c",
        "c/target/measure.c",
        "c/target/mps2_an386.ld",
        "c/target/startup.c",
        "c/test/fuzz.c",
        "c/test/golden.c",
        "c/verify/caller.c",
        "c/verify/clang-tidy.yaml",
        "c/verify/harness.c",
        "c/verify/libm.h",
        "c/verify/run.sh",
    ]


def test_the_readme_states_the_time_limits(handmade):
    design = handmade.everyday()
    readme = render_c(build_law(design), make_provenance(design))["c/README.md"]
    assert "34359738368" in readme
    assert "1000000" in readme
    without = handmade.kinked()
    assert "sixteenth" not in render_c(build_law(without), make_provenance(without))["c/README.md"]


def test_the_readme_says_how_often_and_how_much(handmade):
    design = handmade.everyday()
    readme = render_c(build_law(design), make_provenance(design))["c/README.md"]
    assert "0.0001 s is the largest time between two samples" in readme
    assert "1 call of cos" in readme
    without = handmade.kinked()
    readme = render_c(build_law(without), make_provenance(without))["c/README.md"]
    assert "sampling.period: 0" in readme
    assert "largest time between" not in readme
