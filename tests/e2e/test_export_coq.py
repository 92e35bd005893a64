"""Coq-Interval proves every claim of the paper's examples once more."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from bfppc_synth.certificate.checker import verify_folder
from bfppc_synth.cli import main

ROOT = Path(__file__).parents[2]
NAMES = ("paper_example_1", "paper_example_2")
# The reals of the standard library, and the machine integers that Coq-Interval computes with.
AXIOM = re.compile(
    r"(ClassicalDedekindReals\.sig_(not_dec|forall_dec)|Classical_Prop\.classic"
    r"|FunctionalExtensionality\.functional_extensionality_dep"
    r"|PrimInt63\.\w+|Uint63\.\w+)"
)


@pytest.fixture(scope="module")
def folders(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    made = {}
    for name in NAMES:
        made[name] = tmp_path_factory.mktemp("export") / name
        words = [str(ROOT / "examples" / f"{name}.yaml"), "--out", str(made[name]), "--quiet"]
        assert main(words) == 0
    return made


@pytest.mark.parametrize("name", [pytest.param(NAMES[0], marks=pytest.mark.full), *NAMES[1:]])
def test_coq_proves_all_claims_on_the_axioms_of_the_reals_alone(
    name: str, folders: dict[str, Path]
) -> None:
    coqc = shutil.which("coqc")
    assert coqc, "coqc is missing: apt-get install coq libcoq-interval"
    assert main(["export", str(folders[name]), "--to", "coq", "--quiet"]) == 0
    place = folders[name] / "interop" / "coq"
    text = (place / f"{name}.v").read_text(encoding="utf-8")
    assert "Admitted" not in text
    labels = re.findall(r"^Lemma (\w+) :", text, re.MULTILINE)
    assert {"U0_x1", "U1_x1", "U2_x2", "B_x1", "f_star_x2"} <= set(labels)
    listed = re.findall(r"all_claims := \((.*)\)\.", text)
    assert listed == [", ".join(labels)]
    done = subprocess.run(
        [coqc, f"{name}.v"], cwd=place, capture_output=True, text=True, check=False, timeout=60
    )
    assert done.returncode == 0, done.stderr
    axioms = re.findall(r"^([\w.]+)\s*:", done.stdout, re.MULTILINE)
    used = [axiom for axiom in axioms if axiom != "Axioms"]
    assert used
    assert [axiom for axiom in used if not AXIOM.fullmatch(axiom)] == []


@pytest.mark.parametrize("target", ["smt2", "coq"])
def test_an_export_is_deterministic_and_the_folder_still_verifies(
    target: str, folders: dict[str, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    folder = folders["paper_example_2"]
    seen = []
    for _ in range(2):
        capsys.readouterr()
        assert main(["export", str(folder), "--to", target, "--json"]) == 0
        document = json.loads(capsys.readouterr().out)
        assert document["left_out"] == []
        seen.append([(folder / path).read_bytes() for path in document["files"]])
    assert seen[0] == seen[1]
    assert len(seen[0]) == (1 if target == "coq" else len(document["claims"]))
    assert verify_folder(folder).verdict == "proved"


def test_a_folder_without_a_certificate_is_refused(tmp_path: Path) -> None:
    assert main(["export", str(tmp_path), "--to", "coq"]) == 2
    assert not (tmp_path / "interop").exists()


def test_a_format_that_there_is_not_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["export", str(tmp_path), "--to", "lean"]) == 2
    assert "fix: use smt2 or coq or fmu2" in capsys.readouterr().err


def test_weakened_gains_are_not_exported(tmp_path: Path, folders: dict[str, Path]) -> None:
    folder = tmp_path / "weak"
    shutil.copytree(folders["paper_example_1"], folder)
    path = folder / "certificate.json"
    document = json.loads(path.read_text(encoding="utf-8"))
    gain = document["design"]["gains"][1]
    gain["k"] = (float.fromhex(gain["k"]) / 2).hex()
    path.write_text(json.dumps(document), encoding="utf-8")
    assert main(["export", str(folder), "--to", "coq"]) != 0
