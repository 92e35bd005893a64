"""report.html and README.md of the generated folder, from report.json and the design."""

from __future__ import annotations

import base64
import hashlib
from typing import TYPE_CHECKING, Any

from bfppc_synth.model.certificate import Verdict
from bfppc_synth.report.asks import requirements
from bfppc_synth.report.calls import call_lines
from bfppc_synth.report.choices import choice_sentences, optimality_sentences
from bfppc_synth.report.derivation import derivation
from bfppc_synth.report.figures import draw
from bfppc_synth.report.formulas import (
    displayed,
    dynamics_latex,
    expression_latex,
    inline,
    unknowns_latex,
)
from bfppc_synth.report.gains import (
    command_sentence,
    errors_sentence,
    gain_table,
    pushes_sentence,
)
from bfppc_synth.report.glossary import Glossary
from bfppc_synth.report.inserts import inserts
from bfppc_synth.report.nominal_page import center_texts, splits
from bfppc_synth.report.numbers import look_up, shown
from bfppc_synth.report.obligations import obligation, term_sentence
from bfppc_synth.report.sentences import (
    performance_sentences,
    promise,
    prose,
    reference_sentence,
    status_sentence,
)
from bfppc_synth.resources import template_environment, template_folder

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from bfppc_synth.model.certificate import Inequality
    from bfppc_synth.model.design import Design
    from bfppc_synth.model.trajectory import Trajectory

PAGE = "report/page.html.jinja"
STYLE = "report/style.css.jinja"
README = "report/README.md.jinja"
FONT = "report/fonts/stix-two-math.woff2"
# An engineer's questions in their order: key of the heading, its link, its template.
SECTIONS = (
    ("promise", "Promise", "promise"),
    ("requirements", "Requirements", "requirements"),
    ("gains", "Gains", "gains"),
    ("plant", "Plant", "plant"),
    ("center", "Center", "center"),
    ("chain", "Derivation", "chain"),
    ("drivers", "What dominates", "drivers"),
    ("inequalities", "Inequalities", "inequalities"),
    ("sensitivities", "What asking less would buy", "sensitivities"),
    ("simulation", "Simulation", "simulation"),
    ("code", "Calling the code", "code"),
    ("check", "Checking again", "check"),
)


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
    font = base64.b64encode((template_folder() / FONT).read_bytes()).decode()
    style = environment.get_template(STYLE).render(font=font)
    digest = base64.b64encode(hashlib.sha256(style.encode()).digest()).decode()
    glossary = Glossary(document, lambda sentence: prose(sentence, document))
    texts = _texts(document, design, nominal)
    parts = []
    for key, title, template in SECTIONS:
        part = environment.get_template(f"report/{template}.html.jinja").render(texts).strip()
        if part:
            parts.append((key, title, glossary.explain(part)))
    return environment.get_template(PAGE).render(
        texts,
        style=Markup(style),  # noqa: S704  a file of this package
        style_hash=digest,
        links=[{"key": key, "title": title} for key, title, _ in parts],
        sections=[Markup(part) for _, _, part in parts],  # noqa: S704  rendered above
    )


def _texts(
    document: Mapping[str, object], design: Design, nominal: Trajectory
) -> dict[str, object]:
    """Give what the templates of all sections print."""
    from markupsafe import Markup

    certified = design.certificate.verdict is Verdict.CERTIFIED
    title, scope = "What is promised", "This holds for"
    if not certified:
        title, scope = (
            "What would be promised: NOT CERTIFIED",
            "If proved, it would hold for",
        )
    checks = design.certificate.assumption_checks
    parameters = [parameter.name for parameter in design.spec.parameters]
    return {
        "document": document,
        "gains": gain_table(document),
        "banners": () if certified else (status_sentence(design),),
        "status": status_sentence(design),
        "verdict_class": "good" if certified else "bad",
        "promise_title": title,
        "scope": scope,
        "promise": promise(design),
        "requirements": requirements(design, document),
        "dynamics": [Markup(displayed(line)) for line in dynamics_latex(design.plant)],  # noqa: S704
        "unknowns": [Markup(displayed(line)) for line in unknowns_latex(design.plant)],  # noqa: S704
        "reference": reference_sentence(design),
        "performance": (*choice_sentences(design), *performance_sentences(design)),
        "optimum": optimality_sentences(design),
        "parameter_tables": [parameters] if parameters else [],
        "majorant_tables": _majorants(design),
        "centers": center_texts(design, document),
        "splits": splits(design),
        "errors": errors_sentence(document),
        "command": command_sentence(document),
        "pushes": pushes_sentence(document),
        "steps": derivation(design, document),
        "tight_tables": [design.spec.states] if design.tight is not None else [],
        "obligations": [
            obligation(design, document, entry.id) for entry in design.certificate.inequalities
        ],
        "check_tables": [document["assumption_checks"]] if checks else [],
        "check_texts": [obligation(design, document, entry.id) for entry in checks],
        "drivers": _drivers(design.certificate.inequalities),
        "sensitivities": [document["sensitivities"]] if document.get("sensitivities") else [],
        "plots": draw(design, nominal),
        **inserts(document),
        **call_lines(document),
    }


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
            **call_lines(document),
        )
    )


def _converters(document: Mapping[str, object]) -> list[tuple[str, int]]:
    """Name and index of every state that is quantized."""
    states: Any = document["states"]
    entries: Any = look_up(document, ("measurement", "adc"))
    return [(name, i) for i, name in enumerate(states) if entries[i] is not None]


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
