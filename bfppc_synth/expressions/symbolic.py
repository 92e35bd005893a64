"""The syntax tree in sympy: real symbols, exact rationals, odd roots as docs/theory.md has them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import sympy as sp

from bfppc_synth.errors import EnvelopeError, Mistake, PlantFileError
from bfppc_synth.expressions.real import protected, real_abs, real_power, real_sign, real_tan
from bfppc_synth.model.expression import Branches, Call, Comparison, Name, Number, Operation
from bfppc_synth.model.plant import Channel, Plant
from bfppc_synth.model.spec import ReferenceKind

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from bfppc_synth.model.expression import Expression, Node
    from bfppc_synth.model.spec import ChannelSpec, PlantSpec

TIME: Final = sp.Symbol("t", real=True)

_LARGEST_RATIONAL: Final = 10**300
_NO_VALUE: Final = (
    "it has no finite real value: a division by zero, or an even root or log of something negative"
)
_NO_VALUE_FIX: Final = "rewrite the part that has no value"

_FUNCTIONS: Final[dict[str, Callable[..., sp.Expr]]] = {
    "exp": sp.exp,
    "sinh": sp.sinh,
    "cosh": sp.cosh,
    "tanh": sp.tanh,
    "atan": sp.atan,
    "asinh": sp.asinh,
    "sign": real_sign,
    "log": sp.log,
    "abs": real_abs,
    "sin": sp.sin,
    "cos": sp.cos,
    "tan": real_tan,
    "min": sp.Min,
    "max": sp.Max,
}
_RELATIONS: Final[dict[str, Callable[[sp.Expr, sp.Expr], sp.Basic]]] = {
    "<": sp.StrictLessThan,
    "<=": sp.LessThan,
    ">": sp.StrictGreaterThan,
    ">=": sp.GreaterThan,
}


def to_sympy(tree: Node, symbols: Mapping[str, sp.Symbol]) -> sp.Expr:
    """Translate a syntax tree.

    Parameters
    ----------
    tree : Node
        As ``expressions.parse`` makes it.
    symbols : mapping of str to sympy.Symbol
        One real symbol per name that the tree contains.

    Returns
    -------
    sympy.Expr
        Real wherever it is defined; a rational exponent p/q with even p and odd q stands
        only on a base known to be nonnegative.

    Raises
    ------
    EnvelopeError
        If a part has no finite real value (a pole that only sympy finds), or a coefficient
        that binary64 cannot hold.

    References
    ----------
    docs/theory.md section 1 (traps).
    """
    try:
        expression = _translate(tree, symbols)
    except (TypeError, ValueError) as error:
        # sympy refuses to compare what it knows to be complex, as in min(sqrt(-1 - x**2), x).
        raise EnvelopeError(
            _NO_VALUE, subexpression=str(error).partition("\n")[0], fix=_NO_VALUE_FIX
        ) from None
    _require_finite(expression)
    return expression


def _translate(tree: Node, symbols: Mapping[str, sp.Symbol]) -> sp.Expr:
    match tree:
        case Number(value=value):
            return sp.Rational(value.numerator, value.denominator)
        case Name(name="pi"):
            return sp.pi
        case Name(name="E"):
            return sp.E
        case Name(name=name):
            return symbols[name]
        case Call(function="sqrt", arguments=arguments):
            return real_power(_translate(arguments[0], symbols), sp.Rational(1, 2))
        case Call(function=function, arguments=arguments):
            operands = (_translate(part, symbols) for part in arguments)
            return protected(_FUNCTIONS[function](*operands))
        case Branches(branches=branches):
            return _branches(branches, symbols)
        case Operation(operator="**", operands=(base, exponent)):
            return real_power(_translate(base, symbols), _translate(exponent, symbols))
        case Operation(operator="neg", operands=operands):
            return -_translate(operands[0], symbols)
        case Operation(operator="+" | "-"):
            return sp.Add(*_terms(tree, symbols))
        case Operation():
            return protected(sp.Mul(*_factors(tree, symbols)))


def _branches(
    branches: tuple[tuple[Node, Comparison | None], ...], symbols: Mapping[str, sp.Symbol]
) -> sp.Expr:
    # Two branches at a time, one inside the other: in a longer list sympy merges neighbours of
    # equal value under an Or, and single comparisons are all that the rules know.
    *conditional, (last, _) = branches
    result = _translate(last, symbols)
    for value, when in reversed(conditional):
        if when is not None:
            left, right = _translate(when.left, symbols), _translate(when.right, symbols)
            pair = (_translate(value, symbols), _RELATIONS[when.relation](left, right))
            result = sp.Piecewise(pair, (result, sp.true))
    return result


def _terms(tree: Node, symbols: Mapping[str, sp.Symbol]) -> list[sp.Expr]:
    # Down the left spine in a loop: a sum of two hundred terms is no two hundred calls deep.
    terms = []
    while isinstance(tree, Operation) and tree.operator in {"+", "-"}:
        left, right = tree.operands
        term = _translate(right, symbols)
        terms.append(term if tree.operator == "+" else -term)
        tree = left
    return [_translate(tree, symbols), *reversed(terms)]


def _factors(tree: Node, symbols: Mapping[str, sp.Symbol]) -> list[sp.Expr]:
    factors = []
    while isinstance(tree, Operation) and tree.operator in {"*", "/"}:
        left, right = tree.operands
        factor = _translate(right, symbols)
        factors.append(factor if tree.operator == "*" else real_power(factor, sp.Integer(-1)))
        tree = left
    return [_translate(tree, symbols), *reversed(factors)]


def _require_finite(expression: sp.Expr) -> None:
    if expression.has(sp.zoo, sp.nan, sp.oo, sp.S.NegativeInfinity, sp.I):
        raise EnvelopeError(_NO_VALUE, subexpression=str(expression), fix=_NO_VALUE_FIX)
    for number in expression.atoms(sp.Rational):
        if max(abs(number.p), number.q) > _LARGEST_RATIONAL:
            raise EnvelopeError(
                f"a coefficient of about {sp.Float(number, 3)} lies outside 1e-300 to 1e300",
                subexpression=str(sp.Float(number, 3)),
                fix="choose other units",
            )


def build_plant(spec: PlantSpec) -> Plant:
    """Translate every expression of a plant file.

    Returns
    -------
    Plant
        Real symbols; g = 1 and disturbance = 0 where the file is silent.

    Raises
    ------
    PlantFileError
        If an expression has no finite real value: all of them, with their places.

    References
    ----------
    docs/theory.md section 0.
    """
    names = (*spec.states, *(parameter.name for parameter in spec.parameters))
    symbols = {name: sp.Symbol(name, real=True) for name in names}
    mistakes: list[Mistake] = []

    def read(expression: Expression | None, path: str) -> sp.Expr | None:
        if expression is None:
            return None
        try:
            return to_sympy(expression.tree, {**symbols, TIME.name: TIME})
        except EnvelopeError as error:
            place = spec.place(path)
            mistakes.append(
                Mistake(
                    path=path,
                    line=place.line,
                    column=place.column,
                    length=len(expression.text.partition("\n")[0]),
                    message=f"`{error.subexpression}`: {error}",
                    fix=error.fix,
                )
            )
            return None

    channels = tuple(_channel(channel, symbols, read) for channel in spec.dynamics)
    reference = None
    if spec.reference.kind is not ReferenceKind.RUNTIME:
        path = "reference.value" if spec.reference.kind is ReferenceKind.DECLARED else "reference"
        reference = read(spec.reference.expression, path)
    funnel = read(spec.performance.funnel, "performance.funnel")
    if mistakes:
        raise PlantFileError(spec.path, spec.source, tuple(mistakes))
    return Plant(
        spec=spec,
        time=TIME,
        states=tuple(symbols[name] for name in spec.states),
        parameters=tuple(symbols[parameter.name] for parameter in spec.parameters),
        ranges=tuple(
            (to_sympy(item.range.lower.tree, {}), to_sympy(item.range.upper.tree, {}))
            for item in spec.parameters
        ),
        channels=channels,
        reference=reference,
        funnel=funnel,
    )


def _channel(
    channel: ChannelSpec,
    symbols: Mapping[str, sp.Symbol],
    read: Callable[[Expression | None, str], sp.Expr | None],
) -> Channel:
    path = f"dynamics.{channel.state}"
    g = read(channel.g, f"{path}.g")
    g_bound, g_min = read(channel.g_bound, f"{path}.g_bound"), read(channel.g_min, f"{path}.g_min")
    if channel.g is None and channel.g_bound is None and channel.g_min is None:
        g = sp.Integer(1)
    disturbance = read(channel.disturbance, f"{path}.disturbance")
    return Channel(
        state=symbols[channel.state],
        f=read(channel.f, f"{path}.f"),
        g=g,
        f_bound=read(channel.f_bound, f"{path}.f_bound"),
        g_bound=g_bound,
        g_min=g_min,
        disturbance=sp.Integer(0) if disturbance is None else disturbance,
    )
