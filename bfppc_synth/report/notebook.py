"""A design as a notebook shows it: the tables of the page, in HTML and in LaTeX."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from bfppc_synth.report.asks import requirements
from bfppc_synth.report.formulas import name_latex
from bfppc_synth.report.gains import gain_table
from bfppc_synth.report.inserts import inserts
from bfppc_synth.report.numbers import look_up, shown
from bfppc_synth.report.sentences import promise, status_sentence
from bfppc_synth.report.tables import design_document
from bfppc_synth.resources import template_environment

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from bfppc_synth.model.design import Design

TEMPLATE = "report/notebook.html.jinja"


def notebook_html(design: Design) -> str:
    """Write what a notebook shows for a design.

    Parameters
    ----------
    design : Design
        Of any method, certified or not.

    Returns
    -------
    str
        Status, promise, gains, requirements and inequalities, in tables of report.html.
    """
    document = design_document(design)
    return (
        template_environment()
        .get_template(TEMPLATE)
        .render(
            document=document,
            status=status_sentence(design),
            promise=promise(design),
            requirements=requirements(design, document),
            gains=gain_table(document),
            **inserts(document),
        )
    )


def notebook_latex(design: Design) -> str:
    """Write the same for a notebook that is printed through LaTeX.

    Parameters
    ----------
    design : Design
        Of any method, certified or not.

    Returns
    -------
    str
        One displayed formula: status, peak input, gains, inequalities.
    """
    document: Mapping[str, Any] = design_document(design)
    gains = gain_table(document)
    heads = ["", "p_i", *(_symbol(head) for head in gains.heads)]
    rows = [
        [
            name_latex(state),
            _number(document, ("omega", "p", i)),
            *(_number(document, keys) if keys else "" for keys in gains.rows[i]),
        ]
        for i, state in enumerate(document["states"])
    ]
    claims = [
        [
            _words(entry["id"]),
            _number(document, ("inequalities", i, "lhs", 0)),
            _number(document, ("inequalities", i, "rhs", 1)),
            _number(document, ("inequalities", i, "margin")),
        ]
        for i, entry in enumerate(document["inequalities"])
    ]
    sides = ["", _words("left, at least"), _words("right, at most"), _words("margin")]
    lines = (
        _words(status_sentence(design)),
        rf"\left|u\right| \le U = {_number(document, ('bounds', 'U'))}",
        _array([heads, *rows]),
        _array([sides, *claims]),
    )
    return "$$\\begin{gathered}\n" + " \\\\[1ex]\n".join(lines) + "\n\\end{gathered}$$"


def _array(rows: Sequence[Sequence[str]]) -> str:
    lines = [" & ".join(row) for row in rows]
    body = " \\\\\n".join([lines[0] + r" \\ \hline", *lines[1:]]).replace("\\hline \\\\", "\\hline")
    return rf"\begin{{array}}{{l{'r' * (len(rows[0]) - 1)}}}" + f"\n{body}\n" + r"\end{array}"


def _symbol(head: str) -> str:
    """Take the formula out of a column's head."""
    return head.partition("$")[2].rstrip("$")


def _words(text: str) -> str:
    for sign in "\\{}$&#%_^~":
        text = text.replace(sign, rf"\{sign}" if sign in "{}$&#%_" else "")
    return rf"\text{{{text}}}"


def _number(document: Mapping[str, Any], keys: Sequence[str | int]) -> str:
    mantissa, mark, power = shown(look_up(document, keys)).partition("e")
    return rf"{mantissa} \cdot 10^{{{power}}}" if mark else mantissa
