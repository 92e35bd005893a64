"""Generated folders with something changed: constants, law, hashes, files; docs/attacks.md."""

from __future__ import annotations

import hashlib
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from bfppc_synth.certificate import checker
from bfppc_synth.codegen.c import render_c
from bfppc_synth.codegen.law import build_law
from bfppc_synth.codegen.provenance import make_provenance
from bfppc_synth.codegen.python import render_controller
from bfppc_synth.spec.canonical import plant_json
from bfppc_synth.spec.load import load_spec
from bfppc_synth.synthesis.synthesize import synthesize

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

PLANT = """\
name: sampled
parameters: {a: 0.5}
states: [x1, x2]
dynamics:
  x1: {f: x1*exp(-a*x1), f_bound: Abs(x1)*exp(a*Abs(x1))}
  x2: {f: x1*x2, g: 2 + sin(x1)}
reference: 0.2*cos(t)
initial: {x1: [0.1, 0.3], x2: 0.1}
performance: {accuracy: 0.2, rho: {kind: exponential, rate: 1, floor: 0.1}}
measurement: {quantizer: {kind: uniform, step: 0.001}}
sampling: {period: 0.0001}
synthesis: {center: performance, gains: {x1: {M: 0, c: 0}, x2: {M: 0, c: 0}}}
"""
C_SOURCE = "c/src/sampled.c"


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """Everything that the checker reads, as the pipeline makes it."""
    path = tmp_path_factory.mktemp("plant") / "sampled.yaml"
    path.write_text(PLANT)
    design = synthesize(load_spec(path))
    design.certificate.require()
    law, provenance = build_law(design), make_provenance(design)
    texts = {
        "plant.yaml": PLANT,
        "plant.json": plant_json(design.spec),
        "certificate.json": design.certificate.document,
        "controller.py": render_controller(law, provenance),
        **render_c(law, provenance),
    }
    made = {name: text.encode() for name, text in texts.items()}
    made["verify.py"] = Path(checker.__file__).read_bytes()
    return made


@pytest.fixture(autouse=True, scope="module")
def _remember_what_was_derived() -> Iterator[None]:
    """Most of these tests change a file that nothing is derived from."""
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
def write(files: dict[str, bytes], tmp_path: Path) -> Callable[..., Path]:
    def write_(changes: dict[str, bytes] | None = None, manifest: object = None) -> Path:
        wanted = {**files, **(changes or {})}
        for name, data in wanted.items():
            (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
            (tmp_path / name).write_bytes(data)
        hashes = {name: hashlib.sha256(data).hexdigest() for name, data in sorted(wanted.items())}
        listed = manifest or {
            "format": "bfppc-synth/manifest/1",
            "name": "sampled",
            "status": "certified",
            "files": hashes,
        }
        (tmp_path / "manifest.json").write_text(json.dumps(listed))
        return tmp_path

    return write_


def edited(files: dict[str, bytes], name: str, old: str, new: str) -> dict[str, bytes]:
    """One file with one change; the manifest is made anew, as a careful forger would."""
    text = files[name].decode()
    assert text.count(old) >= 1, old
    return {name: text.replace(old, new, 1).encode()}


def gain(files: dict[str, bytes], name: str) -> str:
    lines = files["controller.py"].decode().splitlines()
    return next(line.split(" = ")[1] for line in lines if line.startswith(f"{name} = "))


def test_an_untouched_folder_is_proved(write: Callable[..., Path]) -> None:
    report = checker.verify_folder(write())
    assert report.verdict == "proved"
    assert len(report.tests) == 3
    assert report.assumptions


def test_the_shipped_file_verifies_its_own_folder_without_any_package(
    write: Callable[..., Path],
) -> None:
    folder = write()
    command = [sys.executable, "-I", "-S", "verify.py", "--json"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    answer = json.loads(done.stdout)
    assert answer["verdict"] == "proved"
    assert {claim["verdict"] for claim in answer["claims"]} == {"proved"}
    assert not list(folder.rglob("__pycache__"))


def test_exit_codes_are_4_for_refuted_and_2_for_malformed(
    write: Callable[..., Path], files: dict[str, bytes], capsys: pytest.CaptureFixture[str]
) -> None:
    certificate = json.loads(files["certificate.json"])
    certificate["claims"].pop()
    assert checker.main([str(write({"certificate.json": json.dumps(certificate).encode()}))]) == 4
    assert "no proof is given" in capsys.readouterr().out
    assert checker.main([str(write({"certificate.json": b"{"}))]) == 2
    assert "not JSON" in capsys.readouterr().out


@pytest.mark.parametrize("name", ["controller.py", C_SOURCE, "plant.json", "plant.yaml"])
def test_a_file_that_was_changed_is_refused_by_its_hash(
    write: Callable[..., Path], name: str
) -> None:
    folder = write()
    with (folder / name).open("ab") as file:
        file.write(b"\n")
    assert checker.verify_folder(folder).verdict == "malformed"


@pytest.mark.parametrize(
    "name", ["controller.py", C_SOURCE, "plant.json", "plant.yaml", "certificate.json"]
)
def test_a_file_that_is_missing_is_refused(write: Callable[..., Path], name: str) -> None:
    folder = write()
    (folder / name).unlink()
    assert checker.verify_folder(folder).verdict == "malformed"


def test_another_plant_file_beside_the_same_plant_json_is_refused(
    write: Callable[..., Path], files: dict[str, bytes]
) -> None:
    folder = write(edited(files, "plant.yaml", "accuracy: 0.2", "accuracy: 0.1"))
    report = checker.verify_folder(folder)
    assert report.verdict == "malformed"
    assert "plant.yaml" in report.failures[0]


@pytest.mark.parametrize("constant", ["k_1", "M_1", "epsilon_1", "c_1", "p_1", "k_2", "U_MAX"])
@pytest.mark.parametrize("name", ["controller.py", C_SOURCE])
def test_each_constant_in_the_code_spoiled_is_refused(
    write: Callable[..., Path], files: dict[str, bytes], name: str, constant: str
) -> None:
    value = gain(files, constant)
    other = repr(float(value) * 1.0000000001 or 1e-9)
    report = checker.verify_folder(
        write(edited(files, name, f"{constant} = {value}", f"{constant} = {other}"))
    )
    assert report.verdict == "malformed"
    assert constant in report.failures[0]


@pytest.mark.parametrize("name", ["controller.py", C_SOURCE])
def test_a_constant_left_out_or_added_is_refused(
    write: Callable[..., Path], files: dict[str, bytes], name: str
) -> None:
    lines = files[name].decode().splitlines()
    place = next(j for j, line in enumerate(lines) if "k_1 = " in line)
    fewer = "\n".join(lines[:place] + lines[place + 1 :])
    more = "\n".join([*lines[:place], lines[place].replace("k_1", "k_9"), *lines[place:]])
    for text in (fewer, more):
        assert checker.verify_folder(write({name: text.encode()})).verdict == "malformed"


def test_a_constant_defined_once_more_is_refused(
    write: Callable[..., Path], files: dict[str, bytes]
) -> None:
    python = files["controller.py"].decode() + "\nk_1 = 0.5\n"
    assert checker.verify_folder(write({"controller.py": python.encode()})).verdict == "malformed"
    c = files[C_SOURCE].decode()
    for line in ("#define sampled_k_1 0.5", "static double sampled_k_1 = 0.5;"):
        changed = c.replace(
            "/* CERTIFIED CONSTANTS END */", f"/* CERTIFIED CONSTANTS END */\n{line}"
        )
        assert checker.verify_folder(write({C_SOURCE: changed.encode()})).verdict == "malformed"


def test_a_certified_c_constant_in_a_comment_is_refused(
    write: Callable[..., Path], files: dict[str, bytes]
) -> None:
    value = gain(files, "k_1")
    line = f"static const sampled_real sampled_k_1 = {value};"
    hidden = edited(files, C_SOURCE, line, f"/* sampled_k_1 = {value}; */")
    assert checker.verify_folder(write(hidden)).verdict == "malformed"


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("phi_1 = k_1 * e_1", "phi_1 = -k_1 * e_1"),
        ("u = 0.0 - phi_2", "u = phi_2 - 0.0"),
        ("u = 0.0 - phi_2", "u = 0.0 - phi_2 * 1.0001"),
        ("u = 0.0 - phi_2", "u = 0.001 - phi_2"),
        ("e_1 = x_1 - r_1", "e_1 = x_1 + r_1"),
        ("+ phi_1", "- phi_1"),
        ("x_2 - r_2", "x_2"),
        ("offset = x_1 - y_d", "offset = x_1"),
        ("cos(t) / 5.0", "cos(t) / 5.01"),
        ("0.9 * exp", "0.8 * exp"),
        ("self._command = u", "self._command = u = 0.0"),
        ("self.status = OUTSIDE if", "self.status = OK if"),
        ('-> float:\n        """Return the command', '-> float:\n        return 0.0\n        """'),
    ],
)
def test_a_changed_law_is_refused_although_every_constant_is_right(
    write: Callable[..., Path], files: dict[str, bytes], old: str, new: str
) -> None:
    changed = edited(files, "controller.py", old, new)
    assert checker.verify_folder(write(changed)).verdict == "malformed"


@pytest.mark.parametrize("limit", ["x_limit_1", "x_limit_2", "y_d_limit", "elapsed_limit"])
@pytest.mark.parametrize("name", ["controller.py", C_SOURCE])
def test_screening_that_turns_away_needed_samples_is_refused(
    write: Callable[..., Path], files: dict[str, bytes], name: str, limit: str
) -> None:
    value = gain(files, limit)
    tight = repr(float(value) * 0.2)
    changed = edited(files, name, f"{limit} = {value}", f"{limit} = {tight}")
    report = checker.verify_folder(write(changed))
    assert report.verdict == "malformed"
    assert limit in report.failures[0]


HOSTILE = [
    "import os",
    "import sys",
    "from os import path",
    "from enum import sys",
    "from math import *",
    "import math as self",
    "from . import x",
    "print(1)",
    "open('x')",
    "exec('1')",
    "eval('1')",
    "__import__('os')",
    "x = ().__class__",
    "x = (1 .real for x in ()).gi_frame",
    "x = [].append",
    "math.isfinite = abs",
    "import math\nmath.isfinite = abs",
    "def f(self):\n    self.isfinite = abs",
    "def f(self):\n    self.gi_frame",
    "x = lambda: 1",
    "def f():\n    global k_1",
    "x = getattr",
    "x = type",
    "x = '{0.a}'.format(1)",
    "del k_1",
    "with k_1:\n    pass",
    "def f(k_1):\n    yield k_1",
    "x = globals",
    "k_1: float = 3.0",
    "for k_1 in ():\n    pass",
    "def k_1():\n    pass",
    "class k_1:\n    pass",
    "from math import sin as k_1",
    "try:\n    pass\nexcept ValueError as k_1:\n    pass",
    "match 1:\n    case k_1:\n        pass",
    "(k_1 := 3.0)",
    "import math.sin",
    "x = breakpoint",
]


@pytest.mark.parametrize("code", HOSTILE)
def test_a_controller_that_could_do_more_than_compute_is_screened_out(
    files: dict[str, bytes], code: str
) -> None:
    source = files["controller.py"].decode()
    checker.screen(source, ["k_1"])
    with pytest.raises(checker.MalformedError, match=r"controller\.py"):
        checker.screen(f"{source}\n{code}\n", ["k_1"])


def test_a_controller_that_is_screened_out_is_not_run(
    write: Callable[..., Path], files: dict[str, bytes]
) -> None:
    text = files["controller.py"].decode() + "\nraise KeyError\n"
    report = checker.verify_folder(write({"controller.py": text.encode()}))
    assert report.verdict == "malformed"
    assert "the name KeyError" in report.failures[0]


def test_a_number_that_answers_comparisons_as_it_likes_is_refused(
    write: Callable[..., Path], files: dict[str, bytes]
) -> None:
    liar = (
        "class Liar(float):\n"
        "    def as_integer_ratio(self):\n        return (0, 1)\n"
        "    def __lt__(self, other):\n        return True\n\n\nclass Controller:"
    )
    text = files["controller.py"].decode().replace("class Controller:", liar, 1)
    text = text.replace("        return u\n", "        return Liar(u)\n")
    report = checker.verify_folder(write({"controller.py": text.encode()}))
    assert report.verdict == "malformed"


def test_a_crashing_controller_is_malformed(
    write: Callable[..., Path], files: dict[str, bytes]
) -> None:
    changed = edited(files, "controller.py", "u = 0.0 - phi_2", "u = -phi_2 / 0.0")
    report = checker.verify_folder(write(changed))
    assert report.verdict == "malformed"
    assert "ZeroDivisionError" in report.failures[0]


@pytest.mark.parametrize(
    "text",
    [
        '{"a": 1, "a": 1}',
        '{"a": 1.5}',
        '{"a": NaN}',
        '{"a": Infinity}',
        "[" * 100_000,
        "{",
        "",
        "\x80",
    ],
)
def test_json_that_two_readers_may_read_differently_is_refused(
    write: Callable[..., Path], text: str
) -> None:
    for name in ("certificate.json", "plant.json"):
        folder = write({name: text.encode("latin-1")})
        assert checker.verify_folder(folder).verdict == "malformed"


@pytest.mark.parametrize("path", ["../outside", "/etc/hostname", "c/../../outside", ""])
def test_a_manifest_that_leaves_the_folder_is_refused(
    write: Callable[..., Path], path: str
) -> None:
    folder = write()
    manifest = json.loads((folder / "manifest.json").read_text())
    manifest["files"][path] = "0" * 64
    assert checker.verify_folder(write(None, manifest)).verdict == "malformed"


def test_a_manifest_that_does_not_list_the_controller_is_refused(
    write: Callable[..., Path],
) -> None:
    folder = write()
    manifest = json.loads((folder / "manifest.json").read_text())
    del manifest["files"]["controller.py"]
    assert checker.verify_folder(write(None, manifest)).verdict == "malformed"


def test_a_folder_that_is_none_is_malformed(tmp_path: Path) -> None:
    assert checker.main([os.fspath(tmp_path / "nothing")]) == 2
