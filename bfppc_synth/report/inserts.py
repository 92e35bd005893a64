"""What every template of the page can insert: numbers, sentences, formulas."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bfppc_synth.report.breaking import widest
from bfppc_synth.report.formulas import displayed, inline, name_latex
from bfppc_synth.report.sentences import number_markup, prose

if TYPE_CHECKING:
    from collections.abc import Mapping

# Letters that fit on a line of a phone, also where the formula is printed large.
NARROWEST = 28.0


def inserts(document: Mapping[str, object]) -> dict[str, object]:
    """Give the functions that templates call.

    Parameters
    ----------
    document : Mapping[str, object]
        report.json, where the numbers come from.

    Returns
    -------
    dict[str, object]
        ``number``, ``prose``, ``tex``, ``block``, ``formula``, ``markup`` and ``name``.
    """
    from markupsafe import Markup

    return {
        "holds_class": {True: "good", False: "bad"},
        "name": name_latex,
        "number": lambda *keys: Markup(number_markup(document, *keys)),  # noqa: S704
        "prose": lambda sentence: Markup(prose(sentence, document)),  # noqa: S704
        "tex": lambda latex: Markup(inline(latex)),  # noqa: S704
        "block": lambda latex: Markup(displayed(latex)),  # noqa: S704
        "formula": _formula,
        "markup": Markup,
    }


def _formula(mathml: str, kind: str = "") -> str:
    """Put a formula on lines of its own; one that a phone must scroll takes the focus."""
    from markupsafe import Markup

    kinds = f"formula {kind}".strip()
    focus = ' tabindex="0"' if widest(mathml) > NARROWEST else ""
    return Markup(f'<div class="{kinds}"{focus}>{mathml}</div>')  # noqa: S704  made here
