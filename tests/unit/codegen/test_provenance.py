"""What the files say about themselves, and that no user's text can end a comment."""

from __future__ import annotations

import ast
import math
import re
import subprocess
from dataclasses import replace
from importlib.metadata import version

import pytest

from bfppc_synth.certificate import checker
from bfppc_synth.certificate.checker import MalformedError, screen
from bfppc_synth.codegen.c import render_c
from bfppc_synth.codegen.law import build_law
from bfppc_synth.codegen.provenance import banner, make_provenance, plain
from bfppc_synth.codegen.python import render_controller
from bfppc_synth.model.certificate import Certificate, Verdict
from bfppc_synth.model.spec import Method

NASTY = 'a */ b /* c """ d \\ e \n f \t ?? g ` h \u202e i \x00 j // k \\'


def files(design):
    law, provenance = build_law(design), make_provenance(design)
    return {"controller.py": render_controller(law, provenance), **render_c(law, provenance)}


def test_every_file_names_tool_plant_and_theorem(handmade):
    for name, text in files(handmade.everyday()).items():
        assert f"bfppc-synth {version('bfppc-synth')}" in text, name
        assert "0123456789abcdef" * 4 in text, name
        assert "Theorem U" in text, name
        assert "NOT CERTIFIED" not in text, name


def test_every_file_of_a_refuted_design_says_so_and_why(handmade):
    for name, text in files(handmade.refuted(handmade.everyday())).items():
        assert "NOT CERTIFIED (status: refuted)" in text, name
        assert "U1[x1]" in text, name
        assert text.index("NOT CERTIFIED") < 200, name


@pytest.mark.parametrize("verdict", [v for v in Verdict if v is not Verdict.CERTIFIED])
def test_only_certified_goes_without_the_banner(handmade, verdict):
    certificate = Certificate(
        verdict=verdict, inequalities=(), assumptions=(), failures=("U0[x2]: undecided",)
    )
    provenance = make_provenance(handmade.make_design(certificate=certificate))
    assert not provenance.certified
    assert banner(provenance)[0] == f"NOT CERTIFIED (status: {verdict})"
    assert banner(provenance)[1] == "  failed: U0[x2]: undecided"


def test_the_theorem_follows_the_method(handmade):
    unified = make_provenance(handmade.make_design())
    second = make_provenance(handmade.make_design(method=Method.THEOREM2))
    assert "Theorem U" in unified.theorem
    assert "Theorem 2" in second.theorem


def test_no_text_of_the_user_breaks_a_file(handmade, tmp_path):
    certificate = Certificate(
        verdict=Verdict.UNDECIDED, inequalities=(), assumptions=(), failures=(NASTY,)
    )
    design = handmade.make_design(
        title=NASTY, units=(("x1", NASTY), ("u", NASTY)), certificate=certificate
    )
    written = files(design)
    ast.parse(written["controller.py"])
    for path, text in written.items():
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / path).write_text(text)
    done = subprocess.run(
        ["make", "-C", str(tmp_path / "c"), "--silent", "CFLAGS=-Werror", "run"],
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    assert (done.returncode, done.stderr) == (0, "")


def test_plain_text_stays_as_it_is():
    assert plain("Uncertain plant, tracking sin t [rad/s]") == (
        "Uncertain plant, tracking sin t [rad/s]"
    )
    assert plain("Äpfel √2") == "Äpfel √2"
    assert not re.search(r'\*/|/\*|\\|"""|\n|`', plain(NASTY))


def test_neither_date_nor_place_stands_in_a_file(handmade):
    design = handmade.everyday()
    text = "".join(
        files(replace(design, spec=replace(design.spec, path="/some/place/x.yaml"))).values()
    )
    assert "/some" not in text
    assert not re.search(r"\b20\d\d-\d\d|\b\d\d:\d\d\b", text)


def test_the_checker_lets_every_controller_run(handmade):
    for make in handmade.DESIGNS.values():
        law = build_law(make())
        source = render_controller(law, make_provenance(make()))
        screen(source, [constant.name for constant in law.certified])
        with pytest.raises(MalformedError):
            screen(source + "import os\n", [])


def test_the_checker_reads_the_constants_of_both_languages_back(handmade):
    for make in handmade.DESIGNS.values():
        law, written = build_law(make()), files(make())
        gains = tuple((s.k, s.M, s.epsilon, s.c, s.N) for s in make().gains)
        certified = checker.Design(gains, make().omega, law.u_max)
        for path in ("controller.py", f"c/src/{law.name}.c"):
            checker._check_constants(path, written[path], law.name, certified)
            spoiled = replace(certified, u_max=math.nextafter(law.u_max, 0.0))
            with pytest.raises(MalformedError, match="U_MAX"):
                checker._check_constants(path, written[path], law.name, spoiled)
