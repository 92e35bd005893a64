"""report.html and README.md of the generated folder, from report.json and the design."""

from __future__ import annotations

import base64
import hashlib
from typing import TYPE_CHECKING, Any

from bfppc_synth.model.certificate import Verdict
from bfppc_synth.model.spec import CenterKind, ReferenceKind
from bfppc_synth.report.choices import choice_sentences, optimality_sentences
from bfppc_synth.report.derivation import derivation
from bfppc_synth.report.figures import draw
from bfppc_synth.report.formulas import (
    displayed,
    dynamics_latex,
    expression_latex,
    inline,
    name_latex,
    unknowns_latex,
)
from bfppc_synth.report.gains import command_sentence, errors_sentence, gain_table
from bfppc_synth.report.nominal_page import center_texts, splits
from bfppc_synth.report.numbers import look_up, shown
from bfppc_synth.report.obligations import obligation, term_sentence
from bfppc_synth.report.sentences import (
    number_markup,
    performance_sentences,
    promise,
    prose,
    reference_sentence,
    requirements,
    status_sentence,
)
from bfppc_synth.resources import template_environment

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from bfppc_synth.model.certificate import Inequality
    from bfppc_synth.model.design import Design
    from bfppc_synth.model.trajectory import Trajectory

PAGE = "report/page.html.jinja"
STYLE = "report/style.css.jinja"
README = "report/README.md.jinja"

_VERIFY = (
    "python verify.py            # proves the inequalities again; needs no package",
    "bfppc-synth verify .        # the same, with the package",
)
_PASSED = "y_d lists the reference at t and its exact derivatives, order 1 to {order}."
# (real, math): what is said of it, and how near C is to Python.
_ARITHMETIC = {
    ("double", "libm"): ((), ", the same bits"),
    ("double", "portable"): (
        (
            (
                "The code computes in binary64, with tanh, sin, cos and exp of its own, made of"
                " + - * / and comparisons: no libm is assumed."
            ),
        ),
        ", the same bits on every machine",
    ),
    ("float", "libm"): (
        (
            (
                "The C code computes in binary32, every constant and every rounding of it is in the"
                " certificate; controller.py rounds as it does."
            ),
        ),
        "; tanhf, sinf, cosf, expf may differ from Python in the last digits",
    ),
    ("float", "portable"): (
        (
            (
                "The C code computes in binary32, with tanh, sin, cos and exp of its own, made of"
                " + - * / and comparisons: no libm is assumed; controller.py rounds as it does."
            ),
        ),
        ", the same bits on every machine",
    ),
}
_SIMULATE = "bfppc-synth simulate .      # runs controller.py against the plant again"


def render_html(document: Mapping[str, object], design: Design, nominal: Trajectory) -> str:
    """Write the page: one file, no script, nothing loaded, every number from report.json.

    Parameters
    ----------
    document : Mapping[str, object]
        report.json as ``report_document`` gives it.
    design : Design
        Gives the formulas: plant, majorants, gains that are off.
    nominal : Trajectory
        The run that is plotted, arrays of N rows.

    Returns
    -------
    str
        HTML, the same text for the same arguments; each number stands in an element with
        ``data-json-path`` (its place in report.json) and ``data-value`` (all its digits).

    Raises
    ------
    ResourceError
        If the installation has no templates.

    References
    ----------
    SPEC section 3; docs/theory.md sections 1 to 3 for what is printed.
    """
    from markupsafe import Markup

    environment = template_environment()
    style = environment.get_template(STYLE).render()
    digest = base64.b64encode(hashlib.sha256(style.encode()).digest()).decode()
    certified = design.certificate.verdict is Verdict.CERTIFIED
    title, scope = "What is promised", "This holds for"
    if not certified:
        title, scope = (
            "What would be promised: NOT CERTIFIED",
            "If proved, it would hold for",
        )
    checks = design.certificate.assumption_checks
    parameters = [parameter.name for parameter in design.spec.parameters]
    return environment.get_template(PAGE).render(
        document=document,
        gains=gain_table(document),
        style=Markup(style),  # noqa: S704  a file of this package
        style_hash=digest,
        banners=() if certified else (status_sentence(design),),
        status=status_sentence(design),
        verdict_class="good" if certified else "bad",
        holds_class={True: "good", False: "bad"},
        promise_title=title,
        scope=scope,
        promise=promise(design),
        requirements=requirements(design),
        dynamics=[Markup(displayed(line)) for line in dynamics_latex(design.plant)],  # noqa: S704
        unknowns=[Markup(displayed(line)) for line in unknowns_latex(design.plant)],  # noqa: S704
        reference=reference_sentence(design),
        performance=(*choice_sentences(design), *performance_sentences(design)),
        optimum=optimality_sentences(design),
        parameter_tables=[parameters] if parameters else [],
        majorant_tables=_majorants(design),
        centers=center_texts(design, document),
        splits=splits(design),
        errors=errors_sentence(document),
        command=command_sentence(document),
        steps=derivation(design, document),
        tight_tables=[design.spec.states] if design.tight is not None else [],
        obligations=[
            obligation(design, document, entry.id) for entry in design.certificate.inequalities
        ],
        check_tables=[document["assumption_checks"]] if checks else [],
        check_texts=[obligation(design, document, entry.id) for entry in checks],
        drivers=_drivers(design.certificate.inequalities),
        plots=draw(design, nominal),
        name=name_latex,
        number=lambda *keys: Markup(number_markup(document, *keys)),  # noqa: S704
        prose=lambda sentence: Markup(prose(sentence, document)),  # noqa: S704
        tex=lambda latex: Markup(inline(latex)),  # noqa: S704
        block=lambda latex: Markup(displayed(latex)),  # noqa: S704
        markup=Markup,
        **_calls(document),
    )


def render_readme(document: Mapping[str, object]) -> str:
    """Write README.md of the generated folder.

    Parameters
    ----------
    document : Mapping[str, object]
        report.json as ``report_document`` gives it.

    Returns
    -------
    str
        Markdown, the same text for the same document; NOT CERTIFIED and the failed
        inequalities stand first where the status is not ``certified``.
    """
    certified = document["status"] == str(Verdict.CERTIFIED)
    states = look_up(document, ("states",))
    count = len(states) if isinstance(states, list) else 0
    deltas = [shown(look_up(document, ("measurement", "delta", i))) for i in range(count)]
    return (
        template_environment()
        .get_template(README)
        .render(
            document=document,
            gains=gain_table(document),
            banners=() if certified else (document["status"],),
            promise_title="Promise" if certified else "Promise, not proved",
            status_text="certified" if certified else "NOT CERTIFIED",
            deltas=", ".join(deltas),
            converters=_converters(document),
            number=lambda *keys: shown(look_up(document, keys)),
            **_calls(document),
        )
    )


def _converters(document: Mapping[str, object]) -> list[tuple[str, int]]:
    """Name and index of every state that is quantized."""
    states: Any = document["states"]
    entries: Any = look_up(document, ("measurement", "adc"))
    return [(name, i) for i, name in enumerate(states) if entries[i] is not None]


def _calls(document: Mapping[str, object]) -> dict[str, object]:
    """Lines that a user types; they depend on the reference and on the certificate."""
    supplied = look_up(document, ("reference", "kind")) == str(ReferenceKind.RUNTIME)
    nominal = document["center"] == str(CenterKind.NOMINAL)
    certificate = document["certificate"]
    return {
        "python_reference": ", y_d" if supplied else "",
        "c_reference": "y_d" if supplied else f"{document['name']}_reference(t)",
        "passed": _PASSED.format(order=document["order"]) if supplied and nominal else "",
        "certificates": [certificate] if certificate else [],
        **_arithmetic(document),
        "commands": [*(_VERIFY if certificate else ()), _SIMULATE],
    }


def _arithmetic(document: Mapping[str, object]) -> dict[str, object]:
    """Say what the code computes with, unless it is binary64 and the libm, and what is equal."""
    given: Any = document.get("arithmetic", {"real": "double", "math": "libm"})
    kind = given["real"], given["math"]
    return {"arithmetic": list(_ARITHMETIC[kind][0]), "same": _ARITHMETIC[kind][1]}


def _drivers(inequalities: Sequence[Inequality]) -> list[dict[str, object]]:
    """Bars of the binding terms; a share is drawn between 0 and 1."""
    return [
        {
            "id": entry.id,
            "index": index,
            "terms": [
                {"term": term_sentence(term), "width": f"{min(max(share, 0.0), 1.0):.4f}"}
                for term, share in entry.binding_terms
            ],
        }
        for index, entry in enumerate(inequalities)
        if entry.binding_terms
    ]


def _majorants(design: Design) -> list[list[dict[str, str]]]:
    """Give the one table; around a nominal center nothing is bounded by majorants of f and g."""
    if design.nominal is not None:
        return []
    rows = [
        {
            "f": inline(expression_latex(channel.f_text)),
            "g": inline(expression_latex(channel.g_text)),
            "g_min": inline(expression_latex(channel.g_min_text)),
        }
        for channel in design.majorants.channels
    ]
    return [rows]
