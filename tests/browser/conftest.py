"""The browser, and the pages that it shows."""

from __future__ import annotations

import dataclasses
import importlib.util
from pathlib import Path

import pytest

from bfppc_synth.artifacts import simulate_trajectory
from bfppc_synth.codegen.cost import step_cost
from bfppc_synth.codegen.law import build_law
from bfppc_synth.model.certificate import Verdict
from bfppc_synth.report.render import render_html
from bfppc_synth.report.tables import report_document
from bfppc_synth.synthesis.synthesize import restore

ROOT = Path(__file__).parents[2]
SCREENS = ROOT / "build" / "screens"


def _load(name):
    path = Path(__file__).with_name(f"{name}.py")
    spec = importlib.util.spec_from_file_location(f"browser_{name}", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="session")
def browser():
    chromium = _load("devtools").Chromium()
    yield chromium
    chromium.close()


@pytest.fixture(scope="session")
def rendered(tmp_path_factory):
    """Write the page of a committed folder as this version lays it out."""
    base = tmp_path_factory.mktemp("pages")

    def render(folder, verdict=Verdict.CERTIFIED):
        design = restore(folder)
        if verdict is not Verdict.CERTIFIED:
            failed = dataclasses.replace(
                design.certificate, verdict=verdict, failures=("U1[x1] (65): 4 is not above 5.1",)
            )
            design = dataclasses.replace(design, certificate=failed)
        nominal = simulate_trajectory(design, horizon=0.2)
        document = report_document(design, nominal, (), cost=step_cost(build_law(design)))
        path = base / f"{folder.name}-{verdict.value}.html"
        path.write_text(render_html(document, design, nominal), encoding="utf-8")
        return path

    return render


@pytest.fixture(scope="session")
def screens():
    """Folder of the screenshots, kept for whoever wants to look."""
    SCREENS.mkdir(parents=True, exist_ok=True)
    return SCREENS


@pytest.fixture(scope="session")
def axe():
    return (Path(__file__).parent / "node_modules" / "axe-core" / "axe.min.js").read_text("utf-8")
