"""--real and --math from the command line: what is written, what is said, what is refused."""

from __future__ import annotations

import json
import re
import struct
from pathlib import Path

import pytest

from bfppc_synth.cli import main

SMALL = Path(__file__).parents[1] / "plants" / "small_exponential.yaml"
EXAMPLES = Path(__file__).parents[2] / "examples"


def plant(tmp_path: Path, *changes: tuple[str, str]) -> str:
    text = SMALL.read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = tmp_path / "small.yaml"
    path.write_text(text)
    return str(path)


def test_float_and_portable_are_written_told_and_verified_and_the_bytes_are_the_same_again(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    outs = [tmp_path / "first", tmp_path / "second"]
    for out in outs:
        words = [str(SMALL), "--real", "float", "--math", "portable", "--out", str(out), "--quiet"]
        assert main(words) == 0
    first, second = ({p: p.read_bytes() for p in out.rglob("*") if p.is_file()} for out in outs)
    assert {p.relative_to(outs[0]): data for p, data in first.items()} == {
        p.relative_to(outs[1]): data for p, data in second.items()
    }
    report = json.loads((outs[0] / "report.json").read_text())
    assert report["arithmetic"] == {"real": "float", "math": "portable"}
    # One ulp of t is a sixteenth of a millisecond's at most until 1024 s.
    assert report["sampling"]["longest_run"] == 1024.0
    design = json.loads((outs[0] / "certificate.json").read_text())["design"]
    assert (design["real"], design["math"]) == ("float", "portable")
    numbers = [*design["p"], *(v for gain in design["gains"] for v in gain.values() if v != 3)]
    for number in (float.fromhex(text) for text in numbers):
        assert struct.unpack("f", struct.pack("f", number))[0] == number
    assert float.fromhex(design["p"][0]) <= 0.2
    said = "--real float --math portable"
    for path in ("controller.py", "c/src/small.c", "c/include/small.h"):
        assert said in (outs[0] / path).read_text()
    assert "binary32" in (outs[0] / "README.md").read_text()
    assert "binary32" in (outs[0] / "report.html").read_text()
    assert "typedef float small_real;" in (outs[0] / "c/include/small.h").read_text()
    capsys.readouterr()
    assert main(["verify", str(outs[0])]) == 0
    assert "libm" not in capsys.readouterr().out
    assert main(["simulate", str(outs[0]), "--horizon", "2000"]) == 2
    assert "is not below 1024 s" in capsys.readouterr().err


def test_the_default_says_nothing_of_it_and_has_the_certificate_of_before(tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert main([plant(tmp_path), "--out", str(out), "--quiet"]) == 0
    assert "arithmetic" not in json.loads((out / "report.json").read_text())
    assert "real" not in json.loads((out / "certificate.json").read_text())["design"]
    assert "--real" not in (out / "controller.py").read_text()


@pytest.mark.parametrize(
    ("changes", "words", "told"),
    [
        (
            [("0.3*sin(t)", "0.3*atan(t)/(1 + 0*t)")],
            ["--math", "portable"],
            "atan in reference has no portable form",
        ),
        (
            [("center: performance", "method: theorem2"), ("period: 0.001}\nsy", "period: 0}\nsy")],
            ["--real", "float"],
            "method theorem2 neglects the rounding",
        ),
        ([("horizon: 0.05", "horizon: 1024")], ["--real", "float"], "is not below 1024 s"),
        (
            [
                ("0.5*sin(x1)", "0.5*atan(x1)"),
                ("center: performance", "center: nominal"),
                ("  rho: {kind: exponential, rate: 1, floor: 0}\n", "  transition: 2\n"),
            ],
            ["--math", "portable"],
            "atan in dynamics.x1.f has no portable form",
        ),
    ],
    ids=["reference", "theorem2", "horizon", "nominal"],
)
def test_what_cannot_be_is_refused_before_anything_is_searched(
    changes: list[tuple[str, str]],
    words: list[str],
    told: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    out = tmp_path / "out"
    assert main([plant(tmp_path, *changes), *words, "--out", str(out)]) == 2
    error = capsys.readouterr().err
    assert told in error
    assert "fix:" in error
    assert not out.exists()


def test_a_function_of_the_plant_that_the_code_never_computes_may_be_any(tmp_path: Path) -> None:
    path = plant(tmp_path, ("0.5*sin(x1)", "0.5*atan(x1)"))
    out = tmp_path / "out"
    assert main([path, "--math", "portable", "--out", str(out), "--quiet"]) == 0
    assert "from math" not in (out / "controller.py").read_text()


TIGHT = [
    ("accuracy: 0.2", "accuracy: 0.000002"),
    ("period: 0.001", "period: 0.0000001"),
    ("horizon: 0.05", "horizon: 0.00002"),
]
GAINS = "{x1: {k: 1e-9, M: 1.132, epsilon: 3.101e-06, c: 0}, x2: {k: 2371000, M: 0, c: 0}}"
FIXED = ("center: performance", f"center: performance, gains: {GAINS}, p: {{x2: 0.2098}}")


@pytest.mark.parametrize(("more", "code"), [([], 3), ([FIXED], 4)], ids=["free", "fixed"])
def test_float_is_refused_where_an_inequality_loses_too_much(
    more: list[tuple[str, str]], code: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = plant(tmp_path, *TIGHT, *more)
    out = tmp_path / "out"
    assert main([path, "--real", "float", "--out", str(out)]) == code
    error = capsys.readouterr().err
    assert "--real float is not admissible" in error
    found = re.search(
        r"rounds e of x1 (\S+), e of x2 (\S+), u (\S+); U2'?\[x2\] needs (\S+) > (\S+), "
        r"(\S+) > (\S+) without rounding",
        error,
    )
    assert found, error
    numbers = [float(text.rstrip(",")) for text in found.groups()]
    assert numbers[0] > 1e-8
    assert numbers[3] < numbers[4]
    assert numbers[5] > numbers[6]
    assert "fix: --real double" in error
    assert not out.exists()
    if more:
        assert main([path, "--out", str(out), "--quiet"]) == 0


def test_a_refuted_plant_file_is_not_blamed_on_float(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = plant(tmp_path, ("{f: 0.5*sin(x1)}", "{f: 0.5*sin(x1), f_bound: 0.1}"))
    assert main([path, "--real", "float", "--out", str(tmp_path / "out")]) == 4
    error = capsys.readouterr().err
    assert "f_bound[x1]: refuted" in error
    assert "not admissible" not in error
