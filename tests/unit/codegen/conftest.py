"""Hand-made designs and the controllers made of them."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from bfppc_synth.codegen.law import build_law
from bfppc_synth.codegen.provenance import make_provenance
from bfppc_synth.codegen.python import render_controller

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import ModuleType

    from bfppc_synth.model.design import Design


def load(path: Path, name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="session")
def handmade() -> ModuleType:
    return load(Path(__file__).with_name("handmade.py"), "handmade")


@pytest.fixture
def module_of(tmp_path: Path) -> Callable[[Design], ModuleType]:
    def make(design: Design) -> ModuleType:
        path = tmp_path / "controller.py"
        path.write_text(render_controller(build_law(design), make_provenance(design)))
        return load(path, "generated_controller")

    return make
