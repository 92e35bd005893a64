"""Tight against termwise for every example, written to docs/tight.md: ``make tight``.

Each plant is synthesized twice, as its file says and with ``bounds: tight``; both certificates
are checked. Nothing in the table depends on the machine.
"""

from __future__ import annotations

import json
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from bfppc_synth.errors import BfppcError
from bfppc_synth.model.spec import Form, Method
from bfppc_synth.spec.load import load_spec
from bfppc_synth.synthesis.synthesize import synthesize

if TYPE_CHECKING:
    from bfppc_synth.model.design import Design

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "tight.md"
HEAD = """\
# Tight bounds against termwise ones

Written by `make tight`. Each plant file is synthesized as it is and with `bounds: tight`
(docs/theory.md section 9); both designs are proved by the separate checker. U is the certified
peak input, feedforward included, the slope that of the last feedback; the objective is the
file's. Cells are those of the bisection trees that prove the tight claims, size is that of
certificate.json.

| plant | n | center | U termwise | U tight | of it | slope termwise | slope tight | cells | size |
|---|---|---|---|---|---|---|---|---|---|
"""


def tight_text(source: str, center: str) -> str:
    """Put ``bounds: tight`` beside the center of a plant file."""
    if "bounds: tight" in source:
        return source
    for old in (f"center: {center},", f"center: {center}}}", f"center: {center}\n"):
        if old in source:
            end = old[-1]
            indent = "\n  " if end == "\n" else ", "
            return source.replace(old, f"center: {center}{indent}bounds: tight{end}", 1)
    raise SystemExit(f"no center in\n{source}")


def cells(design: Design) -> int:
    """Count the cells of the trees that prove tight claims."""
    claims = json.loads(design.certificate.document)["claims"]
    proofs = [claim["proof"] for claim in claims if claim["id"].startswith("tight")]
    return sum(tree.count(".") for proof in proofs for tree in proof.get("trees", []))


def synthesized(text: str, name: str) -> Design:
    """Synthesize a plant file's text."""
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / name
        copy.write_text(text, encoding="utf-8")
        return synthesize(load_spec(copy))


def row(path: Path) -> str | None:
    """One line of the table; None for a file that has no tight form."""
    spec = load_spec(path)
    if spec.synthesis.method is not Method.UNIFIED or spec.synthesis.form is not Form.SOUND:
        return None
    try:
        plain = synthesized(spec.source.replace(", bounds: tight", ""), path.name)
        old = f"{plain.bounds.U:.4g}", f"{plain.bounds.slope:.3g}"
    except BfppcError:
        plain, old = None, ("none", "-")
    tight = synthesized(tight_text(spec.source, str(spec.synthesis.center)), path.name)
    tight.certificate.require()
    share = "-" if plain is None else f"{100.0 * tight.bounds.U / plain.bounds.U:.0f} %"
    size = len(tight.certificate.document) / 1000.0
    return (
        f"| {spec.name} | {spec.order} | {spec.synthesis.center} | {old[0]} |"
        f" {tight.bounds.U:.4g} | {share} | {old[1]} | {tight.bounds.slope:.3g} |"
        f" {cells(tight)} | {size:.0f} kB |"
    )


def main() -> int:
    """Write the page."""
    chosen = [Path(name) for name in sys.argv[1:]]
    plants = [
        *sorted(ROOT.glob("examples/*.yaml")),
        *sorted(ROOT.glob("tests/plants/[!i]*.yaml")),  # infeasible_*.yaml have no design
    ]
    lines = []
    for path in chosen or plants:
        line = row(path)
        if line is not None:
            print(line, flush=True)
            lines.append(line)
    if not chosen:
        PAGE.write_text(HEAD + "\n".join(lines) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
