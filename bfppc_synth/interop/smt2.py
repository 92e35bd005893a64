"""A claim as a question for an SMT solver: unsat means that the claim is proved."""

from __future__ import annotations

from fractions import Fraction
from functools import reduce
from typing import TYPE_CHECKING

from bfppc_synth.interop.claims import Relation, variable_name

if TYPE_CHECKING:
    from collections.abc import Callable

    from bfppc_synth.interop.claims import Claim, Provenance, Tree

# pi to 40 digits: solvers differ in their name for it, not in what two numbers enclose.
_PI = (
    Fraction("3.1415926535897932384626433832795028841971"),
    Fraction("3.1415926535897932384626433832795028841972"),
)


def render_smt2(claim: Claim, provenance: Provenance) -> str:
    """Write the negation of one claim in SMT-LIB 2.6.

    Parameters
    ----------
    claim : Claim
        What is to be proved.
    provenance : Provenance
        Stands in the head of the file.

    Returns
    -------
    str
        Declarations, the box, definitions of auxiliary variables, and as the last assertion
        the negated inequality; logic QF_NRA, with exp, sin, cos or tan QF_NRAT.

    References
    ----------
    docs/theory.md section 6.
    """
    printer = _Printer()
    lhs, rhs = printer.text(claim.lhs), printer.text(claim.rhs)
    relation = "<" if claim.relation is Relation.LESS else "<="
    logic = "QF_NRAT" if printer.transcendental else "QF_NRA"
    lines = [
        "(set-info :smt-lib-version 2.6)",
        f"(set-logic {logic})",
        f"(set-info :source |{_plain(claim.id)} of {provenance.plant}: {_plain(claim.statement)}",
        f"  {provenance.tool}; plant.yaml SHA-256 {provenance.plant_sha256}",
        f"  {_plain(provenance.theorem)}|)",
        "(set-info :status unsat)",
        "; unsat: the claim is proved; sat (delta-sat): not proved.",
    ]
    if printer.transcendental:
        lines.append("; QF_NRAT is cvc5's name of the logic; for dReal write QF_NRA.")
    if claim.note:
        lines.append(f"; {claim.note}")
    for variable in claim.variables:
        name = variable_name(variable.name)
        lines.append(f"(declare-fun {name} () Real)")
        lines.append(f"(assert (<= {_number(variable.lower)} {name}))")
        lines.append(f"(assert (<= {name} {_number(variable.upper)}))")
    lines += printer.definitions
    lines += [f"(assert (not ({relation} {lhs} {rhs})))", "(check-sat)", "(exit)"]
    return "\n".join(lines) + "\n"


def _plain(text: str) -> str:
    """Text without what would end a quoted symbol."""
    return text.replace("|f|", "abs(f)").replace("|", " ").replace("\\", " ")


def _number(value: Fraction) -> str:
    size = f"{abs(value.numerator)}.0"
    if value.denominator != 1:
        size = f"(/ {size} {value.denominator}.0)"
    return f"(- {size})" if value < 0 else size


class _Printer:
    """Text of trees; what has no symbol of its own becomes an auxiliary variable."""

    def __init__(self) -> None:
        self.definitions: list[str] = []
        self.transcendental = False
        self._known: dict[str, str] = {}

    def text(self, tree: Tree) -> str:
        if tree.kind == "num":
            return _number(tree.number)
        if tree.kind == "pi":
            bounds = (f"(<= {_number(_PI[0])} {{w}})", f"(<= {{w}} {_number(_PI[1])})")
            return self._auxiliary("pi", *bounds)
        if tree.kind == "sym":
            return variable_name(tree.name)
        if tree.kind == "sum":
            pairs = zip(tree.weights, tree.args, strict=True)
            return _joined("+", [self._weighted(weight, part) for weight, part in pairs])
        if tree.kind == "prod":
            factors = zip(tree.args, tree.weights, strict=True)
            return _joined("*", [self._raised(part, exponent) for part, exponent in factors])
        if tree.kind == "piece":
            return self._piecewise(tree)
        return self._call(tree.name, [self.text(part) for part in tree.args])

    def _weighted(self, weight: Fraction, part: Tree) -> str:
        if part.kind == "num":
            return _number(weight * part.number)
        return self.text(part) if weight == 1 else f"(* {_number(weight)} {self.text(part)})"

    def _raised(self, part: Tree, exponent: Fraction) -> str:
        # An odd root of a negative number is negative, as in the plant file.
        text = self._root(self.text(part), exponent.denominator)
        text = _repeated(text, abs(exponent.numerator))
        return text if exponent > 0 else f"(/ 1.0 {text})"

    def _piecewise(self, tree: Tree) -> str:
        text = self.text(tree.args[-1])
        branches = list(zip(tree.args[:-1:2], tree.relations, tree.args[1::2], strict=True))
        for value, relation, compared in reversed(branches):
            text = f"(ite ({relation} {self.text(compared)} 0.0) {self.text(value)} {text})"
        return text

    def _call(self, name: str, args: list[str]) -> str:
        a = args[0]
        if name in ("min", "max"):
            relation = "<=" if name == "min" else ">="
            return reduce(lambda x, y: f"(ite ({relation} {x} {y}) {x} {y})", args)
        if name.startswith("root"):
            return self._root(a, int(name[4:]))
        if name.startswith("signed"):
            exponent = Fraction(name[6:])
            root = self._root(a, exponent.denominator)
            size = _repeated(_absolute(root), exponent.numerator)
            return f"(ite (>= {root} 0.0) {size} (- {size}))"
        if name == "abs":
            return _absolute(a)
        if name == "sign":
            return f"(ite (> {a} 0.0) 1.0 (ite (< {a} 0.0) (- 1.0) 0.0))"
        self.transcendental = True
        if name in ("exp", "sin", "cos", "tan"):
            return f"({name} {a})"
        forms: dict[str, Callable[[], str]] = {
            "tanh": lambda: f"(- 1.0 (/ 2.0 (+ (exp (* 2.0 {a})) 1.0)))",
            "sinh": lambda: f"(/ (- (exp {a}) (exp (- {a}))) 2.0)",
            "cosh": lambda: f"(/ (+ (exp {a}) (exp (- {a}))) 2.0)",
            "log": lambda: self._auxiliary(f"log {a}", f"(= (exp {{w}}) {a})"),
            "asinh": lambda: self._auxiliary(
                f"asinh {a}", f"(= (- (exp {{w}}) (exp (- {{w}}))) (* 2.0 {a}))"
            ),
            "atan": lambda: self._arctangent(a),
        }
        return forms[name]()

    def _arctangent(self, a: str) -> str:
        half = _number(_PI[1] / 2)
        # cos w > 0 keeps w inside the principal branch, where tan is one to one.
        inside = (f"(< (- {half}) {{w}})", f"(< {{w}} {half})", "(> (cos {w}) 0.0)")
        return self._auxiliary(f"atan {a}", *inside, f"(= (sin {{w}}) (* {a} (cos {{w}})))")

    def _root(self, a: str, q: int) -> str:
        if q == 1:
            return a
        sign = ("(>= {w} 0.0)",) if q % 2 == 0 else ()
        return self._auxiliary(f"root{q} {a}", *sign, f"(= {_repeated('{w}', q)} {a})")

    def _auxiliary(self, key: str, *conditions: str) -> str:
        """Declare a variable that the conditions on {w} determine, once for each key."""
        if key not in self._known:
            name = self._known[key] = f"w_{len(self._known) + 1}"
            self.definitions.append(f"(declare-fun {name} () Real)")
            self.definitions += [f"(assert {text.format(w=name)})" for text in conditions]
        return self._known[key]


def _absolute(a: str) -> str:
    return f"(ite (>= {a} 0.0) {a} (- {a}))"


def _repeated(text: str, times: int) -> str:
    return _joined("*", [text] * times)


def _joined(operator: str, parts: list[str]) -> str:
    return parts[0] if len(parts) == 1 else f"({operator} {' '.join(parts)})"
