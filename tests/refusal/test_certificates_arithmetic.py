"""Folders whose code does not compute as its certificate says: each is refused by verify.py."""

from __future__ import annotations

import hashlib
import json
import shutil
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from bfppc_synth import pipeline
from bfppc_synth.artifacts import generated_code
from bfppc_synth.certificate import checker
from bfppc_synth.model.arithmetic import DEFAULT, Arithmetic, Mathematics, Real
from bfppc_synth.synthesis.synthesize import restore

if TYPE_CHECKING:
    from collections.abc import Callable

PLANT = Path(__file__).parents[1] / "plants" / "small_exponential.yaml"
HEADER, SOURCE, PYTHON = "c/include/small.h", "c/src/small.c", "controller.py"
LIMIT = "time_limit = 1024.0F;"
PORTABLE_FLOAT = Arithmetic(real=Real.FLOAT, mathematics=Mathematics.PORTABLE)
PORTABLE_DOUBLE = Arithmetic(real=Real.DOUBLE, mathematics=Mathematics.PORTABLE)


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> dict[Arithmetic, Path]:
    found = {}
    for arithmetic in (PORTABLE_FLOAT, PORTABLE_DOUBLE, DEFAULT):
        out = tmp_path_factory.mktemp("made") / "small"
        outcome = pipeline.run(PLANT, pipeline.Options(out=out, arithmetic=arithmetic))
        assert outcome.exit_code == 0
        found[arithmetic] = out
    return found


def changed(folder: Path, tmp_path: Path, texts: dict[str, str]) -> checker.Report:
    """Verify a copy with other texts, its manifest made to fit."""
    copy = tmp_path / "copy"
    shutil.rmtree(copy, ignore_errors=True)
    shutil.copytree(folder, copy, ignore=shutil.ignore_patterns("__pycache__"))
    manifest = json.loads((copy / "manifest.json").read_text())
    for path, text in texts.items():
        (copy / path).write_text(text)
        manifest["files"][path] = hashlib.sha256(text.encode()).hexdigest()
    (copy / "manifest.json").write_text(json.dumps(manifest))
    return checker.verify_folder(copy)


def edited(folder: Path, path: str, old: str, new: str) -> dict[str, str]:
    text = (folder / path).read_text()
    assert old in text, (path, old)
    return {path: text.replace(old, new, 1)}


def design_with(folder: Path, change: Callable[[dict], object]) -> dict[str, str]:
    document = json.loads((folder / "certificate.json").read_text())
    change(document["design"])
    return {"certificate.json": json.dumps(document, indent=1) + "\n"}


def refused(report: checker.Report, words: str) -> None:
    assert report.verdict == "malformed"
    assert words in report.failures[0], report.failures


@pytest.mark.parametrize("arithmetic", [PORTABLE_FLOAT, PORTABLE_DOUBLE], ids=str)
def test_a_folder_as_it_was_made_is_proved_and_assumes_no_libm(
    arithmetic: Arithmetic, made: dict[Arithmetic, Path], tmp_path: Path
) -> None:
    report = changed(made[arithmetic], tmp_path, {})
    assert report.verdict == "proved"
    assert not any("libm" in line or "tanh" in line for line in report.assumptions)
    wanted = "binary32" if arithmetic.single else "binary64"
    assert any(line.startswith(wanted) for line in report.assumptions)


@pytest.mark.parametrize("arithmetic", [PORTABLE_FLOAT, PORTABLE_DOUBLE], ids=str)
def test_libm_code_under_a_portable_certificate_is_refused(
    arithmetic: Arithmetic, made: dict[Arithmetic, Path], tmp_path: Path
) -> None:
    folder = made[arithmetic]
    libm = replace(restore(folder), arithmetic=replace(arithmetic, mathematics=Mathematics.LIBM))
    code = generated_code(libm)
    refused(changed(folder, tmp_path, {SOURCE: code[SOURCE]}), "not what the certificate is about")
    refused(changed(folder, tmp_path, {PYTHON: code[PYTHON]}), "not portable")


def test_portable_code_under_a_certificate_for_the_libm_is_refused(
    made: dict[Arithmetic, Path], tmp_path: Path
) -> None:
    folder = made[DEFAULT]
    assert changed(folder, tmp_path, {}).verdict == "proved"
    code = generated_code(replace(restore(folder), arithmetic=PORTABLE_DOUBLE))
    for path in (SOURCE, PYTHON):
        refused(changed(folder, tmp_path, {path: code[path]}), "functions of its own")


@pytest.mark.parametrize(
    ("path", "old", "new", "words"),
    [
        (SOURCE, "0.25F * inner", "0.25 * inner", "literal"),
        (SOURCE, "0.25F * inner", "0.25f * inner", "literal"),
        (SOURCE, "0.25F * inner", "0.25L * inner", "literal"),
        (SOURCE, "0.25F * inner", "25e-2 * inner", "literal"),
        (SOURCE, "0.25F * inner", "0x1p-2 * inner", "literal"),
        (SOURCE, "0.25F * inner", "0.125F * inner", "portable tanh is not the function"),
        (SOURCE, "945.0F + (z * above_1)", "945.0F - (z * above_1)", "portable tanh is not"),
        (SOURCE, "(t_0 + t_0)", "(float)tanh((double)t_0)", "double where everything"),
        (SOURCE, "(t_0 + t_0)", "tanhf(t_0)", "tanhf is not what the certificate"),
        (SOURCE, "static small_real small_tanh(", "small_real small_tanh(", "cannot be read"),
        (SOURCE, LIMIT, f"{LIMIT}\nstatic double_t small_wide;", "double_t is not what"),
        (SOURCE, LIMIT, f"{LIMIT}\nextern small_real other(small_real v);", "other is not what"),
        (SOURCE, LIMIT, f"{LIMIT}\nextern small_real __builtin_tanhf(small_real v);", "__builtin"),
        (HEADER, "typedef float", "typedef double", "not binary32"),
        (PYTHON, "single(0.25 * inner)", "single(0.125 * inner)", "portable tanh is not"),
        (PYTHON, "single(z * above_1)", "z - above_1", "portable tanh is not the function"),
        (PYTHON, "from struct import pack, unpack", "import math as struct", "import"),
        (PYTHON, "\n\ndef reference(", "\n\nportable_tanh = abs\n\n\ndef reference(", "portable"),
        (PYTHON, "elapsed_limit = 1024.0", "elapsed_limit = 2048.0", "later than the rounding"),
        (SOURCE, "elapsed_limit = 1024.0F", "elapsed_limit = 2048.0F", "later than the rounding"),
        (SOURCE, "time_limit = 1024.0F", "time_limit = 2048.0F", "later than the rounding"),
    ],
)
def test_a_float_controller_that_computes_in_another_way_is_refused(
    path: str, old: str, new: str, words: str, made: dict[Arithmetic, Path], tmp_path: Path
) -> None:
    folder = made[PORTABLE_FLOAT]
    refused(changed(folder, tmp_path, edited(folder, path, old, new)), words)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda design: design.update(real="half"), "real is double or float"),
        (lambda design: design.update(math="newlib"), "math is libm or portable"),
        (lambda design: design["gains"][0].update(M=(0.1).hex()), "no number of the type float"),
        (lambda design: design.update(U_MAX=(100.1).hex()), "no number of the type float"),
        (lambda design: design.update(U_MAX=(1e39).hex()), "OverflowError"),
    ],
)
def test_a_design_with_numbers_of_another_type_is_refused(
    change: Callable[[dict], object], words: str, made: dict[Arithmetic, Path], tmp_path: Path
) -> None:
    folder = made[PORTABLE_FLOAT]
    refused(changed(folder, tmp_path, design_with(folder, change)), words)


def test_rounding_of_binary32_is_in_the_bounds(made: dict[Arithmetic, Path]) -> None:
    tables = {}
    for arithmetic, folder in made.items():
        document = json.loads((folder / "certificate.json").read_text())
        plant = json.loads((folder / "plant.json").read_text())
        rounding = checker.read_design(document["design"]).obligations(plant).rounding
        tables[arithmetic] = [error / checker.ONE for error in rounding]
    for small, large in zip(tables[PORTABLE_DOUBLE], tables[PORTABLE_FLOAT], strict=True):
        # Its clock is 1e6 s where that of binary32 ends at 1024 s: less than 2^31 apart.
        assert 1e5 < large / small < 2.0**31
    # At least one rounding of a number that is as large as the tube.
    assert min(tables[PORTABLE_FLOAT]) > 0.2 * 2.0**-24
