"""What is wished of the output, and single numbers of the file."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bfppc_synth.model.spec import Method, RhoKind
from bfppc_synth.reasons.requirement import BOUGHT, FAR, NEAR, WISH, Requirement, number
from bfppc_synth.spec.edits import Edit

if TYPE_CHECKING:
    from bfppc_synth.model.expression import Constant
    from bfppc_synth.model.spec import PlantSpec


def _constant(spec: PlantSpec, path: str) -> Constant | None:
    section, _, key = path.partition(".")
    found: Constant | None = getattr(getattr(spec, section), key)
    return found


def plain(spec: PlantSpec, path: str, easier: str) -> Requirement | None:
    """Relax one number of the file: ``easier`` is larger or smaller; None where it is 0."""
    constant = _constant(spec, path)
    if constant is None or constant.approximate == 0.0:
        return None
    larger = easier == "larger"

    def change(factor: float) -> tuple[Edit, ...]:
        text = number(constant.approximate * factor, 1 if larger else -1)
        return (Edit(path=path, text=text),)

    factors, extreme = (FAR, None) if larger else (NEAR, 0.0)
    weight = WISH if path.startswith("performance.") else BOUGHT
    return Requirement(
        path=path,
        given=constant.text,
        change=change,
        factors=factors,
        extreme=extreme,
        weight=weight,
    )


def transition(spec: PlantSpec) -> Requirement | None:
    """Take longer for the transition of center nominal."""
    return plain(spec, "performance.transition", "larger")


def quicker_transition(spec: PlantSpec) -> Requirement | None:
    """Try the other way too: a short transition costs feedforward, a long one is late."""
    found = plain(spec, "performance.transition", "smaller")
    if found is None:
        return None
    return Requirement(path=found.path, given=found.given, change=found.change, factors=NEAR)


def rho(spec: PlantSpec) -> Requirement | None:
    """Slower performance functions: one factor for all of them."""
    if spec.synthesis.method is Method.THEOREM3:
        # Its stages are fixed gains for one rho.
        return None
    spread = [state for state in spec.states if spec.gives(f"performance.rho.{state}")]
    written: list[tuple[str, str, float, int]] = []
    for state, rho in zip(spec.states, spec.performance.rho, strict=True):
        root = f"performance.rho.{state}" if spread else "performance.rho"
        cosine = rho.kind is RhoKind.COSINE
        constant = rho.t_s if cosine else rho.rate
        if constant is not None:
            key, side = ("t_s", 1) if cosine else ("rate", -1)
            written.append((f"{root}.{key}", constant.text, constant.approximate, side))
        if not spread:
            break
    if not written:
        return None
    if not spec.gives("performance.rho"):

        def fresh(factor: float) -> tuple[Edit, ...]:
            text = f"{{kind: cosine, t_s: {number(factor, 1)}}}"
            return (Edit(path="performance.rho", text=text),)

        return Requirement(
            path="performance.rho", given="{kind: cosine, t_s: 1}", change=fresh, factors=FAR
        )

    def change(factor: float) -> tuple[Edit, ...]:
        return tuple(
            Edit(path=path, text=number(value * factor**side, side))
            for path, _, value, side in written
        )

    path = written[0][0] if len(written) == 1 else "performance.rho"
    return Requirement(
        path=path, given=", ".join(text for _, text, _, _ in written), change=change, factors=FAR
    )


def funnel(spec: PlantSpec) -> Requirement | None:
    """Widen the funnel by a factor."""
    asked = spec.performance.funnel
    if asked is None:
        return None

    def change(factor: float) -> tuple[Edit, ...]:
        return (Edit(path="performance.funnel", text=f'"{number(factor, 1)}*({asked.text})"'),)

    return Requirement(path="performance.funnel", given=asked.text, change=change, factors=FAR[:3])
