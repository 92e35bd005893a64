"""FMUs of hand-made designs: their laws are of every kind, nothing is synthesized."""

from __future__ import annotations

import importlib.util
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from bfppc_synth.codegen.c import render_c
from bfppc_synth.codegen.law import build_law
from bfppc_synth.codegen.provenance import banner, heading, make_provenance
from bfppc_synth.codegen.python import render_controller
from bfppc_synth.interop.binary import Binary, build_binary
from bfppc_synth.interop.fmu import Package, Standard, Steps, archive, render_fmu
from bfppc_synth.model.arithmetic import Arithmetic, Mathematics, Real
from bfppc_synth.simulation.loading import load_text

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import ModuleType

    from bfppc_synth.model.design import Design
    from bfppc_synth.model.law import Law, Provenance

FOLDER = Path(__file__).parents[1] / "codegen"
STEPS = Steps(delayed=0.00125, event=0.0025)


@dataclass(frozen=True, slots=True, kw_only=True)
class Made:
    """A law, its Python controller, and what its files are made of."""

    law: Law
    module: ModuleType
    provenance: Provenance
    code: dict[str, str]

    def texts(self, standard: Standard, steps: Steps = STEPS) -> dict[str, str]:
        name, code = self.law.name, self.code
        package = Package(
            code={
                f"{name}.h": code[f"c/include/{name}.h"],
                f"{name}.c": code[f"c/src/{name}.c"],
            },
            banner=banner(self.provenance),
            heading=heading(name, self.law.title),
            tool_version="0",
            steps=steps,
            stop=1.0,
            period=0.001,
        )
        return render_fmu(self.law, package, standard)

    def fmu(self, standard: Standard, folder: Path) -> Path:
        texts = self.texts(standard)
        built = build_binary(texts, self.law.name, standard)
        assert isinstance(built, Binary), built
        files = {path: text.encode() for path, text in texts.items()}
        path = folder / f"{self.law.name}.fmu"
        path.write_bytes(archive({**files, built.path: built.content}))
        return path


def _load(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(f"{name}_of_interop", FOLDER / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


HANDMADE = _load("handmade")
KINDS: dict[str, Callable[[], Design]] = {
    **HANDMADE.DESIGNS,
    **_load("handmade_nominal").DESIGNS,
    "single": lambda: replace(
        HANDMADE.everyday(),
        # The libm's tanhf and a rounded tanh may differ: only their own functions agree in bits.
        arithmetic=Arithmetic(real=Real.FLOAT, mathematics=Mathematics.PORTABLE),
    ),
}


@pytest.fixture(scope="session")
def made() -> Callable[[str], Made]:
    @cache
    def make(kind: str) -> Made:
        design = KINDS[kind]()
        law, provenance = build_law(design), make_provenance(design)
        module = load_text(render_controller(law, provenance), name="law", origin="controller.py")
        code = render_c(law, provenance)
        return Made(law=law, module=module, provenance=provenance, code=code)

    return make
