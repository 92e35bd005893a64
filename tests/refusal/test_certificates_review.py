"""Holes that a hostile reading found in the checker, each closed; docs/attacks.md lists them.

Every folder is sealed again after its change, as a careful forger would: no hash gives it away.
"""

from __future__ import annotations

import hashlib
import importlib.util
import json
import marshal
import shutil
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from bfppc_synth import pipeline
from bfppc_synth.certificate import checker
from bfppc_synth.certificate.produce import produce_certificate
from bfppc_synth.codegen.c import render_c
from bfppc_synth.codegen.law import build_law
from bfppc_synth.codegen.provenance import make_provenance
from bfppc_synth.codegen.python import render_controller
from bfppc_synth.model.shapes import Shape
from bfppc_synth.spec.canonical import plant_json
from bfppc_synth.spec.load import load_spec
from bfppc_synth.synthesis.synthesize import synthesize

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from types import CodeType

PLANT = """\
name: reviewed
states: [x1, x2]
dynamics: {x1: {f: x1}, x2: {f: x1*x2}}
initial: {x1: 0.5, x2: [-0.1, 0.1]}
performance: {accuracy: 0.25}
synthesis: {center: performance}
"""
PYTHON, SOURCE, HEADER = "controller.py", "c/src/reviewed.c", "c/include/reviewed.h"
GOOD_LAW, BAD_LAW = "u = 0.0 - phi_2", "u = 0.0 + phi_2"
BEGIN, END = "CERTIFIED CONSTANTS BEGIN", "CERTIFIED CONSTANTS END"


# --- folders ----------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Everything that the checker reads, as the pipeline makes it."""
    path = tmp_path_factory.mktemp("plant") / "reviewed.yaml"
    path.write_text(PLANT)
    design = synthesize(load_spec(path))
    design.certificate.require()
    law, provenance = build_law(design), make_provenance(design)
    return {
        "plant.yaml": PLANT,
        "plant.json": plant_json(design.spec),
        "certificate.json": design.certificate.document,
        PYTHON: render_controller(law, provenance),
        **render_c(law, provenance),
        "verify.py": Path(checker.__file__).read_text(),
    }


@pytest.fixture(autouse=True, scope="module")
def _remember_what_was_derived() -> Iterator[None]:
    """Plant and certificate are the same in all folders, so they are judged once."""
    with pytest.MonkeyPatch.context() as patch:
        for name in ("derive", "screening_limits", "check_claim"):
            patch.setattr(checker, name, remembering(getattr(checker, name)))
        yield


def remembering(function: Callable[..., Any]) -> Callable[..., Any]:
    known: dict[str, Any] = {}

    def remembered(*args: Any) -> Any:
        key = repr(args)
        if key not in known:
            known[key] = function(*args)
        return known[key]

    return remembered


@pytest.fixture
def seal(files: dict[str, str], tmp_path: Path) -> Callable[..., Path]:
    def seal_(changes: dict[str, str] | None = None, status: str = "certified") -> Path:
        hashes: dict[str, str] = {}
        for name, text in sorted({**files, **(changes or {})}.items()):
            (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
            (tmp_path / name).write_text(text)
            hashes[name] = hashlib.sha256(text.encode()).hexdigest()
        manifest = {"format": "bfppc-synth/manifest/1", "name": "reviewed", "status": status}
        (tmp_path / "manifest.json").write_text(json.dumps({**manifest, "files": hashes}))
        return tmp_path

    return seal_


def edited(files: dict[str, str], name: str, *pairs: tuple[str, str]) -> dict[str, str]:
    text = files[name]
    for old, new in pairs:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    return {name: text}


def refusal(folder: Path) -> str:
    """What the checker says of a folder that it must not call proved."""
    report = checker.verify_folder(folder)
    assert report.verdict == "malformed", report.failures
    assert report.exit_code == 2
    return "; ".join(report.failures)


def test_the_folder_that_every_case_spoils_is_proved(seal: Callable[..., Path]) -> None:
    report = checker.verify_folder(seal())
    assert report.verdict == "proved", report.failures
    assert any("commands, each inside its enclosure" in test for test in report.tests)


def plant_bytecode(folder: Path, code: CodeType) -> None:
    """Write a cached module that Python would run without a look at the source."""
    source = folder / PYTHON
    target = Path(importlib.util.cache_from_source(str(source)))
    target.parent.mkdir()
    # Flag 1: named by a hash that is never checked (PEP 552); then 8 bytes of that hash.
    head = importlib.util.MAGIC_NUMBER + (1).to_bytes(4, "little") + bytes(8)
    target.write_bytes(head + marshal.dumps(code))
    spec = importlib.util.spec_from_file_location("planted", source)
    assert spec is not None
    assert spec.loader is not None
    assert spec.loader.get_code("planted") == code  # the plant works on a careless reader


def test_planted_bytecode_does_not_answer_for_the_text(
    seal: Callable[..., Path], files: dict[str, str]
) -> None:
    folder = seal(edited(files, PYTHON, (GOOD_LAW, BAD_LAW)))
    plant_bytecode(folder, compile(files[PYTHON], PYTHON, "exec"))
    assert "not the certified law" in refusal(folder)


def test_planted_bytecode_is_never_run(seal: Callable[..., Path], files: dict[str, str]) -> None:
    folder = seal(edited(files, PYTHON, (GOOD_LAW, BAD_LAW)))
    hostile = "import os\nprint('verdict: proved', flush=True)\nos._exit(0)\n"
    plant_bytecode(folder, compile(hostile, PYTHON, "exec"))
    command = [sys.executable, "-I", "-S", checker.__file__, str(folder)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stdout.endswith("verdict: malformed\n")
    assert "verdict: proved" not in done.stdout


def test_constants_in_a_docstring_are_not_those_in_force(
    seal: Callable[..., Path], files: dict[str, str]
) -> None:
    text = files[PYTHON]
    start, end = text.index(f"# {BEGIN}"), text.index(f"# {END}")
    block = text[start : end + len(f"# {END}")]
    in_force = block.replace(f"# {BEGIN}", "").replace(f"# {END}", "")
    in_force = in_force.replace("p_1 = 0.25", "p_1 = 250.0")
    assert "p_1 = 250.0" in in_force
    forged = text[:start] + f'"""\n{block}\n"""\n{in_force}' + text[end + len(f"# {END}") :]
    assert "not assigned inside the block" in refusal(seal({PYTHON: forged}))


def around_constants(before: str, after: str) -> list[tuple[str, str]]:
    return [
        (f"/* {BEGIN} */\n", f"/* {BEGIN} */\n{before}\n"),
        (f"/* {END} */", f"{after}\n/* {END} */"),
    ]


def outside_constants(before: str, after: str) -> list[tuple[str, str]]:
    return [(f"/* {BEGIN} */", f"{before}\n/* {BEGIN} */"), (f"/* {END} */", f"/* {END} */{after}")]


FLOAT = "typedef double reviewed_real;"
USES = "    const bool started = (s->started != 0);\n"
C_FORGERIES = [
    # A quote in quotes: what follows looks like a comment, and is none.
    (
        SOURCE,
        [(f"/* {BEGIN} */", f"static const char q = '\"'; /* \"\n/* {BEGIN} */")],
        "no controller needs that",
    ),
    # Another declaration gives a constant's name another meaning.
    (SOURCE, [(USES, f"{USES}    enum {{ reviewed_p_1 }};\n")], "a second enum"),
    (
        SOURCE,
        [(USES, f"{USES}    const reviewed_real reviewed_p_1 = 9.0;\n")],
        "reviewed.c",
    ),
    (
        SOURCE,
        [
            (f"/* {BEGIN} */", f"static void reviewed_unused(void)\n{{\n/* {BEGIN} */"),
            (f"/* {END} */", f"/* {END} */\n}}\nstatic const reviewed_real reviewed_p_1;"),
        ],
        "is not one constant of the file",
    ),
    # file, replacements, words of the answer
    (SOURCE, outside_constants("#if 0", "\n#endif"), "'#if 0': no controller needs that"),
    (SOURCE, around_constants("#if 0", "#endif"), "'#if 0' among the certified constants"),
    (SOURCE, outside_constants("#ifdef NEVER", "\n#endif"), "'#ifdef NEVER': no controller"),
    # A guard that is allowed elsewhere hides them as well.
    (
        SOURCE,
        outside_constants("#ifdef __cplusplus", "\n#endif"),
        "for some compilers only",
    ),
    (
        SOURCE,
        outside_constants("#if defined(__FAST_MATH__)", "\n#endif"),
        "for some compilers only",
    ),
    # The marks are comments: one that is left open swallows what follows up to the next.
    (
        SOURCE,
        [(f"/* {BEGIN} */", f"/* {BEGIN}"), (f"/* {END} */", f"{END} */")],
        "is not one constant of the file",
    ),
    (SOURCE, [("#include <math.h>", "#include <math.h>\n#define tanh(v) (-(v))")], "'#define tanh"),
    (SOURCE, [("#include <math.h>", "#include <math.h>\n#define double float")], "'#define double"),
    (SOURCE, [("#include <math.h>", '#include <math.h>\n#include "other.h"')], "'#include"),
    (SOURCE, [("#include <math.h>", "#include <math.h>\n%:define x_1 x_2")], "'%:define x_1"),
    (SOURCE, [("#include <math.h>", "#include <math.h>\n??=define x_1 x_2")], "'??=define x_1"),
    (SOURCE, [("#include <math.h>", "#include <math.h>\n#\\\ndefine x_1 x_2")], "no controller"),
    (HEADER, [(FLOAT, f"#define tanh(v) (-(v))\n{FLOAT}")], "'#define tanh"),
    (HEADER, [(FLOAT, FLOAT.replace("double", "float"))], "reviewed_real is not binary64"),
    (HEADER, [(FLOAT, f"/*\n{FLOAT}\n*/\ntypedef float reviewed_real;")], "not binary64"),
    (
        HEADER,
        [(FLOAT, f"#ifdef __cplusplus\n{FLOAT}\n#endif\n#define double float")],
        "for some compilers only",
    ),
    (HEADER, [("#define reviewed_ORDER 2", "#define reviewed_ORDER 1")], "'#define reviewed_ORDER"),
]


@pytest.mark.parametrize(("name", "pairs", "words"), C_FORGERIES)
def test_what_surrounds_the_c_constants_cannot_change_their_meaning(
    seal: Callable[..., Path],
    files: dict[str, str],
    name: str,
    pairs: list[tuple[str, str]],
    words: str,
) -> None:
    assert words in refusal(seal(edited(files, name, *pairs)))


def test_a_header_that_the_manifest_does_not_seal_is_refused(
    seal: Callable[..., Path], files: dict[str, str]
) -> None:
    folder = seal()
    manifest = json.loads((folder / "manifest.json").read_text())
    del manifest["files"][HEADER]
    (folder / "manifest.json").write_text(json.dumps(manifest))
    (folder / HEADER).write_text(files[HEADER].replace("double", "float"))
    assert f"{HEADER} is not listed" in refusal(folder)


SCREENED = "and -x_limit_2 <= x_2 <= x_limit_2"
STATUS = "self.status = OUTSIDE if self._outside or not inside else OK"
TIME = "self._t_last <= t and elapsed <= elapsed_limit"
FORGERIES = [
    # replacements in controller.py, words of the answer
    ([(GOOD_LAW, "u = 0.0 - phi_2 if elapsed < 60.0 else phi_2")], "not the certified law"),
    ([(GOOD_LAW, "u = 0.0 - phi_2 if elapsed < 5e5 else phi_2")], "not the certified law"),
    # The sample is turned away, so an old command is held where a new one is certified.
    ([(SCREENED, f"{SCREENED} and t < 100.0")], "not the certified law"),
    ([(SCREENED, f"{SCREENED} and not 1e3 < t < 3e5")], "not the certified law"),
    ([(STATUS, "self.status = OK")], "a sample outside the tube is answered with OK"),
    # NaN fails every comparison: turned round, the test lets it pass.
    (
        [("-real_limit <= t <= real_limit", "not (t < -real_limit or t > real_limit)")],
        "a bad sample is not answered by holding u",
    ),
    (
        [("-x_limit_1 <= x_1 <= x_limit_1", "not (x_1 < -x_limit_1 or x_1 > x_limit_1)")],
        "a bad sample is not answered by holding u",
    ),
    ([(TIME, "elapsed <= elapsed_limit")], "a bad sample is not answered by holding u"),
    ([(TIME, "self._t_last <= t")], "a bad sample is not answered by holding u"),
]


@pytest.mark.parametrize(("pairs", "words"), FORGERIES)
def test_a_law_that_turns_late_or_answers_wrongly_is_refused(
    seal: Callable[..., Path], files: dict[str, str], pairs: list[tuple[str, str]], words: str
) -> None:
    assert words in refusal(seal(edited(files, PYTHON, *pairs)))


@pytest.mark.parametrize("status", ["printed", "refuted", "undecided", ""])
def test_a_manifest_of_another_status_is_refused(seal: Callable[..., Path], status: str) -> None:
    assert "the status is not `certified`" in refusal(seal(status=status))


# --- what the checker alone does not find ------------------------------------------------------


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("written") / "reviewed.yaml"
    path.write_text(PLANT + "simulation: {horizon: 0.1, period: 0.01}\n")
    outcome = pipeline.run(path, pipeline.Options(out=path.parent / "folder"))
    assert outcome.exit_code == 0
    return path.parent / "folder"


BEYOND = [
    # file, replacements: nothing that 200 samples or the text of the constants would show
    (PYTHON, [(GOOD_LAW, "u = 0.0 - phi_2 if not 7.0 < t < 7.000001 else phi_2")]),
    (PYTHON, [("elapsed_limit = 1000000.0", "elapsed_limit = 1000001.0")]),
    (SOURCE, [("command = 0.0 - phi_2", "command = 0.0 + phi_2")]),
]


@pytest.mark.parametrize(("name", "pairs"), BEYOND)
def test_the_package_finds_every_other_change_by_generating_the_code_again(
    written: Path, tmp_path: Path, name: str, pairs: list[tuple[str, str]]
) -> None:
    folder = tmp_path / "folder"
    shutil.copytree(written, folder)
    assert pipeline.verify(folder).exit_code == 0
    changed = edited({name: (folder / name).read_text()}, name, *pairs)[name]
    (folder / name).write_text(changed)
    manifest = json.loads((folder / "manifest.json").read_text())
    manifest["files"][name] = hashlib.sha256(changed.encode()).hexdigest()
    (folder / "manifest.json").write_text(json.dumps(manifest))
    outcome = pipeline.verify(folder)
    told = "; ".join([*outcome.messages, *outcome.document["failures"]])
    assert outcome.exit_code in (2, 4)
    assert Path(name).name in told or "the C code" in told


# --- plants -----------------------------------------------------------------------------------


def document(f: str = "0", **keys: Any) -> dict[str, Any]:
    plant: dict[str, Any] = {
        "name": "reviewed",
        "states": ["x1"],
        "dynamics": {"x1": {"f": f}},
        "reference": "0.3",
        "initial": {"x1": "0.3"},
        "performance": {"accuracy": "0.1"},
    }
    plant.update(keys)
    return {"format": checker.PLANT_FORMAT, "plant_sha256": "ab" * 32, "plant": plant}


def answer(plant: dict[str, Any], *, k: float = 100.0) -> checker.Report:
    shape = Shape(k=k, M=0.0, epsilon=1.0, c=0.0, N=3)
    try:
        certificate = produce_certificate(plant, (shape,), (0.1,), tool="test")
    except checker.MalformedError as error:
        return checker.Report("malformed", failures=(str(error),))
    return checker.check_documents(plant, certificate)


def test_the_plant_that_every_case_spoils_is_proved() -> None:
    assert answer(document()).verdict == "proved"


def test_a_sign_over_an_absolute_value_keeps_its_negative_power() -> None:
    # 5 sign(x) x/|x| = 5 for every x > 0; read as 5 |x| it was 2 on the box, which k = 30 holds.
    report = answer(document("5*sign(x1)*x1/abs(x1)"), k=30.0)
    assert report.verdict == "refuted"
    assert report.enclosures["f_star[x1]"][0] >= 5.0
    assert report.failures[0].startswith("U2[x1]")
    assert answer(document("5*sign(x1)*x1/abs(x1)"), k=60.0).verdict == "proved"


def test_a_bound_below_a_sign_over_an_absolute_value_is_refuted() -> None:
    def bounded(bound: str) -> checker.Report:
        channel = {"f": "5*sign(x1)*x1/abs(x1)", "f_bound": bound}
        return answer(document(dynamics={"x1": channel}))

    assert bounded("5").verdict == "proved"
    report = bounded("2.5")
    assert report.verdict == "refuted"
    assert report.failures[0].startswith("f_bound[x1]")


LOG, ROOT, POLE = "that are not positive", "an even root", "division by an interval that contains 0"
HIDDEN = [
    # key and value, words of the answer
    ("reference", "0.3 + 0*log(50 - t)", LOG),
    ("reference", "0.3 + log(50 - t) - log(50 - t)", LOG),
    ("reference", "0.3*sqrt(50 - t)**2/(50 - t)", ROOT),
    ("reference", "0.3*(t - 50)/(t - 50)", POLE),
    ("reference", {"value": "0.3 + 0*log(50 - t)", "bound": "1", "rate": "1"}, LOG),
    ("initial", {"x1": "0.3 + 0*log(0 - 1)"}, LOG),
    ("parameters", {"a": "0*log(0 - 1)"}, LOG),
    ("performance", {"accuracy": "0.1 + 0*sqrt(0 - 1)"}, ROOT),
]


@pytest.mark.parametrize(("key", "value", "words"), HIDDEN)
def test_a_domain_hidden_by_a_zero_is_found(key: str, value: Any, words: str) -> None:
    # At t = 50 s the controller would compute log(0): in Python an error, in C a NaN.
    report = answer(document(**{key: value}))
    assert report.verdict == "undecided"
    assert words in report.failures[0]


def test_the_same_parts_where_they_are_defined_are_proved() -> None:
    assert answer(document(reference="0.3 + 0*log(2e6 - t)")).verdict == "proved"
    assert answer(document(parameters={"a": "0*log(2)"})).verdict == "proved"


def test_a_reference_that_binary64_cannot_compute_is_undecided() -> None:
    # Bounded and slow as a real function, but its square leaves binary64 within the first hour.
    atan = "0.1*atan(sqrt((1e153 + 1e152*t)**2/{}+1)/1e4)"
    report = answer(document(reference=atan.format("1e300"), initial={"x1": "0.01"}))
    assert report.verdict == "undecided"
    assert "binary64 could overflow" in report.failures[0]


DECLARED = {"value": "5*sin(t)", "bound": "5", "rate": "5"}


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"bound": "0.1", "rate": "0.1"}, "reference.bound: 0.1 is exceeded at t = 1/10"),
        ({"bound": "4.9"}, "reference.bound: 4.9 is exceeded at t = "),
        ({"rate": "0.1"}, "reference.rate: 0.1 is exceeded at t = 0"),
        ({"rate": "4.9"}, "reference.rate: 4.9 is exceeded at t = 0"),
        ({"value": "1e-3*t**2/(1+t)"}, "reference.bound: 5 is exceeded at t = "),
    ],
)
def test_a_declared_bound_of_the_reference_that_is_exceeded_is_malformed(
    changes: dict[str, str], words: str
) -> None:
    assert answer(document(reference=DECLARED, initial={"x1": "0"})).verdict == "proved"
    report = answer(document(reference={**DECLARED, **changes}, initial={"x1": "0"}))
    assert report.verdict == "malformed"
    assert report.failures[0].startswith(words)
