"""Claims as lemmas of Coq, proved by the tactic of Coq-Interval; nothing is admitted."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bfppc_synth.interop.claims import InexpressibleError, Relation, variable_name

if TYPE_CHECKING:
    from collections.abc import Sequence
    from fractions import Fraction

    from bfppc_synth.interop.claims import Claim, Provenance, Tree

_DIRECT = {
    "exp": "exp",
    "log": "ln",
    "sin": "sin",
    "cos": "cos",
    "tan": "tan",
    "atan": "atan",
    "abs": "Rabs",
    "root2": "sqrt",
}
# What Coq-Interval has no rule for, by what it has.
_DERIVED = {
    "tanh": "(1 - 2 / (exp (2 * {a}) + 1))",
    "sinh": "((exp {a} - exp (- {a})) / 2)",
    "cosh": "((exp {a} + exp (- {a})) / 2)",
    "asinh": "ln ({a} + sqrt ({a} ^ 2 + 1))",
}
_PAIR = {
    "min": "(({a} + {b} - Rabs ({a} - {b})) / 2)",
    "max": "(({a} + {b} + Rabs ({a} - {b})) / 2)",
}

# The constants are those of the checker, rounded outward at 2^-128: many claims hold with no
# more room than that, hence the precision. Subdivision is for claims over a box.
_HEAD = """\
From Coq Require Import Reals Lra.
From Interval Require Import Tactic.
Open Scope R_scope.

Ltac closed := first [ interval with (i_prec 640) | lra ].
"""


def render_coq(claims: Sequence[Claim], provenance: Provenance) -> str:
    """Write one file with a lemma for each claim.

    Parameters
    ----------
    claims : Sequence[Claim]
        Each becomes ``Lemma LABEL``, in this order.
    provenance : Provenance
        Stands in the head of the file.

    Returns
    -------
    str
        Text for coqc with Coq-Interval; it ends in ``Print Assumptions`` for
        all lemmas together.

    Raises
    ------
    InexpressibleError
        If a claim has a function without a form in Coq-Interval (see ``lemma``).

    References
    ----------
    docs/theory.md section 6.
    """
    about = (
        f"(* Claims of the certificate of {provenance.plant}; {provenance.tool}.\n"
        f"   plant.yaml: SHA-256 {provenance.plant_sha256}\n"
        f"   {_plain(provenance.theorem)}\n"
        "   Taken from the certificate, not claimed here: the extremes of the reference and its\n"
        "   rate, the bounds on quantization and on rounding, the period; and the theorem itself.\n"
        "   m_x stands for the modulus of the state x on one side of 0, v_x for x itself. *)\n"
    )
    lemmas = [lemma(claim) for claim in claims]
    # One question about all of them: each would walk through the same libraries for seconds.
    labels = ", ".join(claim.label for claim in claims)
    whole = f"Definition all_claims := ({labels})." if claims else "Definition all_claims := I."
    return "\n".join([about, _HEAD, *lemmas, whole, "Print Assumptions all_claims."]) + "\n"


def lemma(claim: Claim) -> str:
    """Write one lemma with its proof.

    Raises
    ------
    InexpressibleError
        For sign, piecewise expressions and roots other than the square root.
    """
    relation = "<" if claim.relation is Relation.LESS else "<="
    names = [variable_name(variable.name) for variable in claim.variables]
    goal = f"{_text(claim.lhs)} {relation} {_text(claim.rhs)}"
    lines = [f"(* {_plain(claim.id)}: {_plain(claim.statement)} *)"]
    if claim.note:
        lines.append(f"(* {_plain(claim.note)} *)")
    lines.append(f"Lemma {claim.label} :")
    if not names:
        return "\n".join([*lines, f"  {goal}.", "Proof. closed. Qed.", ""])
    lines.append(f"  forall {' '.join(names)} : R,")
    lines += [
        f"  {_number(variable.lower)} <= {name} <= {_number(variable.upper)} ->"
        for name, variable in zip(names, claim.variables, strict=True)
    ]
    cuts = ", ".join(f"i_bisect {name}" for name in names)
    # Subdivision alone needs too many boxes near an interior maximum; with slopes it needs few.
    refined = ("i_depth 12", f"i_autodiff {names[0]}, i_depth 50")
    lines += [
        f"  {goal}.",
        f"Proof. intros {' '.join(names)}; intros;",
        "  first [ interval with (i_prec 320)",
        *(f"        | interval with (i_prec 90, {cuts}, {rest})" for rest in refined),
        "        ].",
        "Qed.",
        "",
    ]
    return "\n".join(lines)


def _plain(text: str) -> str:
    """Text that cannot end a comment or open a string in it."""
    return text.replace("*", "x").replace('"', "'")


def _number(value: Fraction) -> str:
    size = str(abs(value.numerator))
    if value.denominator != 1:
        return f"({'- ' if value < 0 else ''}{size} / {value.denominator})"
    return f"(- {size})" if value < 0 else size


def _text(tree: Tree) -> str:
    if tree.kind == "num":
        return _number(tree.number)
    if tree.kind == "pi":
        return "PI"
    if tree.kind == "sym":
        return variable_name(tree.name)
    if tree.kind == "sum":
        pairs = zip(tree.weights, tree.args, strict=True)
        return f"({' + '.join(_weighted(weight, part) for weight, part in pairs)})"
    if tree.kind == "prod":
        factors = zip(tree.args, tree.weights, strict=True)
        return f"({' * '.join(_raised(part, exponent) for part, exponent in factors)})"
    if tree.kind == "fun":
        return _call(tree.name, [_text(part) for part in tree.args])
    raise InexpressibleError("a piecewise expression has no form in Coq-Interval")


def _weighted(weight: Fraction, part: Tree) -> str:
    if part.kind == "num":
        return _number(weight * part.number)
    if abs(weight) == 1:
        return _text(part) if weight > 0 else f"(- {_text(part)})"
    return f"{_number(weight)} * {_text(part)}"


def _raised(part: Tree, exponent: Fraction) -> str:
    if exponent.denominator != 1:
        raise InexpressibleError(f"the power {exponent} has no form in Coq-Interval")
    size = abs(exponent.numerator)
    text = _text(part) if size == 1 else f"{_text(part)} ^ {size}"
    return text if exponent > 0 else f"/ ({text})"


def _call(name: str, args: list[str]) -> str:
    if name in _PAIR:
        text = args[0]
        for other in args[1:]:
            text = _PAIR[name].format(a=text, b=other)
        return text
    if name in _DIRECT:
        return f"({_DIRECT[name]} {_bracketed(args[0])})"
    if name in _DERIVED:
        return f"({_DERIVED[name].format(a=_bracketed(args[0]))})"
    raise InexpressibleError(f"{name} has no form in Coq-Interval")


def _bracketed(text: str) -> str:
    return text if text.startswith("(") or text.isidentifier() else f"({text})"
