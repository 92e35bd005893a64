"""Center nominal on the page: its formulas, and what U and W_i consist of."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from bfppc_synth.bounds.nominal.model import sided_arguments
from bfppc_synth.report.formulas import (
    displayed,
    expression_latex,
    name_latex,
    number,
    with_numbers,
)
from bfppc_synth.report.nominal import source_sentence

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from bfppc_synth.model.design import Design
    from bfppc_synth.model.nominal import NominalModel, NominalSplit


@dataclass(frozen=True, slots=True, kw_only=True)
class CenterText:
    """The center on the page: formulas as MathML, sentences for ``prose``."""

    path: tuple[str, ...]
    transition: tuple[str, ...]
    model: tuple[str, ...]
    remarks: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Bar:
    """A share: sentence for ``prose``, path of its size, and its length between 0 and 1."""

    label: str
    keys: tuple[str | int, ...]
    width: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Split:
    """What one number consists of; ``title`` and ``text`` are sentences for ``prose``."""

    title: str
    text: str
    bars: tuple[Bar, ...]


def center_texts(design: Design, document: Mapping[str, object]) -> tuple[CenterText, ...]:
    """Write the center, its transition and its model; empty for center performance.

    Parameters
    ----------
    design : Design
        Order n.
    document : Mapping[str, object]
        report.json, where T_s comes from.

    Returns
    -------
    tuple[CenterText, ...]
        One for center nominal.

    References
    ----------
    docs/theory.md section 4.
    """
    model = design.nominal
    if model is None:
        return ()
    n = design.spec.order
    path = [r"r_{1} = y_d + b"]
    for i in range(1, n + 1):
        known = {1: "r_{1}", 2: "r_{1}, r_{2}"}.get(i, rf"r_{{1}}, \dots, r_{{{i}}}")
        ahead = f"r_{{{i + 1}}}" if i < n else "v"
        followed = rf"\hat{{f}}_{{{i}}}({known})"
        strength = rf"\hat{{g}}_{{{i}}}({known})"
        path.append(rf"{ahead} = \frac{{\dot{{r}}_{{{i}}} - {followed}}}{{{strength}}}")
    start = r"T_s^{\mu} \, \frac{b^{(\mu)}(0)}{\mu!}"
    transition = (
        (
            rf"b(t) = \left(1 - s\right)^{{{n + 2}}} \sum_{{\nu=0}}^{{{n - 1}}} "
            r"Q_{\nu} \, s^{\nu}"
            r"\text{, }s = \frac{t}{T_s}\text{, }t \le T_s"
        ),
        (
            r"Q_{\nu} = \sum_{\mu=0}^{\nu} "
            rf"\binom{{{n + 1} + \nu - \mu}}{{\nu - \mu}} \, {start}"
        ),
        rf"b(t) = 0\text{{, }}t \ge T_s = {number('nominal', 'transition')} \, \text{{s}}",
    )
    return (
        CenterText(
            path=tuple(displayed(line) for line in path),
            transition=tuple(with_numbers(displayed(line), document) for line in transition),
            model=tuple(displayed(line) for line in _model_latex(model)),
            remarks=_remarks(design, model),
        ),
    )


def _model_latex(model: NominalModel) -> tuple[str, ...]:
    """f^_i and g^_i with the nominal parameters put in."""
    lines = []
    for i, (f, g) in enumerate(zip(model.f, model.g, strict=True), 1):
        lines.append(rf"\hat{{f}}_{{{i}}} = {expression_latex(f)}")
        lines.append(rf"\hat{{g}}_{{{i}}} = {expression_latex(g)}")
    return tuple(lines)


def _remarks(design: Design, model: NominalModel) -> tuple[str, ...]:
    """Say what the model does not contain, and why."""
    found = []
    for i, (channel, terms) in enumerate(zip(design.plant.channels, model.left_out, strict=True)):
        f, g = rf"\hat{{f}}_{{{i + 1}}}", rf"\hat{{g}}_{{{i + 1}}}"
        if terms:
            listed = ", ".join(f"${expression_latex(term)}$" for term in terms)
            found.append(
                f"${f}$ leaves out {listed}: the center needs derivatives that a term with abs, "
                "sign, min, max, cases or an odd root does not have. It stays in "
                f"$W_{{{i + 1}}}$ in full."
            )
        if channel.f is None:
            found.append(f"${f} = 0$: this drift is known by a bound only, counted in full.")
        if channel.g is None:
            found.append(f"${g}$ is the mean of the declared bounds of this input gain.")
        for side in sided_arguments(design.plant, i):
            branch, kinked = expression_latex(side), expression_latex(abs(side))
            found.append(
                f"${g}$ has ${branch}$ in place of ${kinked}$, whose kink is at 0: the center "
                f"keeps ${branch} > 0$ from every start that may be latched, which is proved. "
                f"The residual counts ${kinked}$ as the plant has it."
            )
    if not any(model.left_out):
        found.append("No known term of the plant was left out of the model.")
    return tuple(found)


def splits(design: Design) -> tuple[Split, ...]:
    """Split U into feedforward and tube, each W_i by source, and the model error by parameter.

    Parameters
    ----------
    design : Design
        With center nominal; nothing is split for the other.

    Returns
    -------
    tuple[Split, ...]
        Bars from the largest down; a length is the share of U or of W_i.

    References
    ----------
    docs/theory.md sections 3 (U) and 4 (W_i).
    """
    split = design.nominal_split
    if split is None:
        return ()
    return (_command(design, split), *_residuals(design, split))


def _command(design: Design, split: NominalSplit) -> Split:
    n = design.spec.order
    parts = (
        (r"feedforward, $\sup\left|v\right|$", "feedforward", split.feedforward),
        (
            rf"tube, $\varphi_{{{n}}}\left(p_{{{n}}} + \eta_{{{n}}}\right)$",
            "tube",
            split.tube,
        ),
        (r"actuator error, $\delta_u$", "actuator_error", split.actuator_error),
    )
    rows = [(label, ("nominal", key), size) for label, key, size in parts if size > 0.0]
    return Split(
        title="Peak input $U$ = #bounds/U#",
        text="What following the reference takes if the model were exact, and what the feedback "
        "adds at the wall of the last tube.",
        bars=_bars(rows, design.bounds.U),
    )


def _residuals(design: Design, split: NominalSplit) -> tuple[Split, ...]:
    found = []
    for index, (sources, alone) in enumerate(zip(split.disturbance, split.parameters, strict=True)):
        total = design.bounds.W[index]
        rows = [
            (source_sentence(name), ("nominal", "sources", index, j, "size"), size)
            for j, (name, size) in enumerate(sources)
        ]
        if sources:
            found.append(
                Split(
                    title=rf"$W_{{{index + 1}}}$ = #bounds/W/{index}# by source",
                    text="What pushes this error from outside: where the plant differs from its "
                    "model along the center, and where the state differs from the center.",
                    bars=_bars(rows, total),
                )
            )
        costs = [
            (
                f"${name_latex(name)}$ `{name}`",
                ("nominal", "parameter_errors", index, j, "size"),
                size,
            )
            for j, (name, size) in enumerate(alone)
        ]
        if costs:
            found.append(
                Split(
                    title=rf"$W_{{{index + 1}}}$: what each uncertain parameter costs",
                    text="The model error along the center if this parameter alone were "
                    "uncertain; together they count at most their sum.",
                    bars=_bars(costs, total),
                )
            )
    return tuple(found)


def _bars(
    rows: Sequence[tuple[str, tuple[str | int, ...], float]], whole: float
) -> tuple[Bar, ...]:
    ordered = sorted(rows, key=lambda row: -row[2])
    return tuple(
        Bar(label=label, keys=keys, width=f"{min(max(size / whole, 0.0), 1.0):.4f}")
        for label, keys, size in ordered
    )
