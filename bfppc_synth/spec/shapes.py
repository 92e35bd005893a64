"""Which keys belong to which kind of quantizer and performance function, and their limits."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from bfppc_synth.expressions.resolution import lower_bound, upper_bound
from bfppc_synth.model.spec import QuantizerKind, RhoKind
from bfppc_synth.spec.sections import QUANTIZER, RHO

if TYPE_CHECKING:
    from bfppc_synth.spec.kinds import Section
    from bfppc_synth.spec.notebook import Notebook

NEEDED: Final[dict[str, tuple[str, ...]]] = {
    QuantizerKind.NONE: (),
    QuantizerKind.UNIFORM: ("step",),
    QuantizerKind.HYSTERESIS_UNIFORM: ("step", "hysteresis"),
    QuantizerKind.LOGARITHMIC_UNIFORM: ("minimum", "density", "threshold", "step"),
    RhoKind.COSINE: ("t_s",),
    RhoKind.EXPONENTIAL: ("rate",),
}
OPTIONAL: Final[dict[str, tuple[str, ...]]] = {
    QuantizerKind.UNIFORM: ("dead_zone",),
    RhoKind.COSINE: ("rate_bound",),
    RhoKind.EXPONENTIAL: ("floor", "rate_bound"),
}


def _check_keys(book: Notebook, path: str, section: Section) -> str:
    """Note missing and foreign keys; return the kind, empty where it is unreadable."""
    kind = book.text(f"{path}.kind", "")
    if kind not in NEEDED:
        return ""
    needed, optional = NEEDED[kind], OPTIONAL.get(kind, ())
    for key in needed:
        if not book.has(f"{path}.{key}"):
            book.blame_path(path, f"the key {key} is missing: kind {kind} needs it", f"add {key}")
    for field in section.fields:
        where = f"{path}.{field.key}"
        if field.key not in {"kind", *needed, *optional} and book.has(where):
            book.blame_path(
                where, f"the key {field.key} does not belong to kind {kind}", "remove it"
            )
    return kind


def check_quantizer(book: Notebook, path: str) -> None:
    """Check one quantizer against its kind."""
    kind = _check_keys(book, path, QUANTIZER)
    step, hysteresis = book.constant(f"{path}.step"), book.constant(f"{path}.hysteresis")
    if kind == QuantizerKind.HYSTERESIS_UNIFORM and step is not None and hysteresis is not None:
        half = upper_bound(step) / 2
        if lower_bound(hysteresis) > half:
            book.blame_path(
                f"{path}.hysteresis",
                f"{hysteresis.text} is above half the step, {float(half):.6g}: the thresholds of "
                "neighbours would cross",
                f"choose at most {float(half):.6g}",
            )
    minimum, threshold = book.constant(f"{path}.minimum"), book.constant(f"{path}.threshold")
    if kind != QuantizerKind.LOGARITHMIC_UNIFORM or minimum is None or threshold is None:
        return
    if lower_bound(minimum) > upper_bound(threshold):
        book.blame_path(
            f"{path}.minimum",
            f"{minimum.text} is above the threshold {threshold.text}: no logarithmic cell is left",
            f"choose at most {threshold.text}",
        )


def check_rho(book: Notebook, path: str) -> None:
    """Check one performance function against its kind; a declared rate must cover the true one."""
    kind = _check_keys(book, path, RHO)
    declared = book.constant(f"{path}.rate_bound")
    t_s, rate = book.constant(f"{path}.t_s"), book.constant(f"{path}.rate")
    if declared is None:
        return
    if kind == RhoKind.COSINE and t_s is not None:
        true, formula = 1 / (2 * upper_bound(t_s)), "1/(2 t_s)"
    elif kind == RhoKind.EXPONENTIAL and rate is not None:
        floor = book.constant(f"{path}.floor")
        true, formula = (1 - upper_bound(floor)) * lower_bound(rate), "(1 - floor) rate"
    else:
        return
    if upper_bound(declared) < true:
        book.blame_path(
            f"{path}.rate_bound",
            f"{declared.text} is below the true rate {formula} = {float(true):.6g}",
            f"choose at least {float(true):.6g}",
        )
