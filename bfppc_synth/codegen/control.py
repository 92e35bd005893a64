"""Law and nominal plant as systems of python-control."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from bfppc_synth.codegen.pure import pure_context, render_script
from bfppc_synth.codegen.python_syntax import IMPORTED, PythonSyntax

if TYPE_CHECKING:
    from bfppc_synth.model.law import Law, Provenance


@dataclass(frozen=True, slots=True, kw_only=True)
class PlantText:
    """The plant as Python text.

    ``functions`` defines coefficients_model and advance_model, which call what ``imports``
    imports; their last ``arguments`` are open, and ``nominal`` are the middle ones.
    """

    imports: str
    functions: str
    arguments: tuple[str, ...]
    nominal: tuple[float, ...]


def render_control(law: Law, provenance: Provenance, plant: PlantText) -> str:
    """Print a Python file that makes plant, controller and loop of python-control.

    Parameters
    ----------
    law : Law
        Any center, any method, any arithmetic. One with stages is sampled only: its memory
        jumps, and a system of python-control has none in continuous time.
    provenance : Provenance
        What the head of the file says.
    plant : PlantText
        The plant that is simulated.

    Returns
    -------
    str
        Functions continuous and sampled.
    """
    syntax = PythonSyntax(law)
    context = pure_context(law, syntax)
    return render_script(
        "control",
        law,
        provenance,
        {
            **context,
            # Printing the law has collected what it calls.
            "functions": [IMPORTED[name] for name in sorted(syntax.functions & set(IMPORTED))],
            "helpers": sorted(syntax.helpers),
            "needs_math": law.arithmetic.single or bool(syntax.helpers),
            "imports": plant.imports,
            "plant": plant.functions,
            "nominal": [repr(value) for value in plant.nominal],
            "arguments": plant.arguments,
            "inputs": law.states,
            "driven": () if law.reference is not None else law.derivatives or ("y_d",),
        },
    )
