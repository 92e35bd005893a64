"""The simulation's own Python text as C: the same operations in the same order.

What is translated are straight lines over floats (``simulation.statements``). Every operation
keeps its place, so that both round alike; where Python's ``math`` raises, C says so by a flag.
"""

from __future__ import annotations

import ast
from dataclasses import dataclass

from bfppc_synth.errors import ShapeError

_INFIX = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/"}
_COMPARED = {ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">="}
# Functions that raise in Python for some number: they set the flag in C.
_CHECKED = frozenset({"exp", "sin", "cos", "tan", "sinh", "cosh", "pow"})
_PLAIN = {
    "abs": "fabs",
    "asinh": "asinh",
    "atan": "atan",
    "copysign": "copysign",
    "log": "log",
    "sqrt": "sqrt",
    "tanh": "tanh",
}

#: What the translated functions call.
PRELUDE = """\
/* Python's math module raises where a finite argument has no finite value. */
static double Sim_checked(double value, double argument, int *bad)
{
    if (isfinite(argument) && !isfinite(value)) {
        *bad = 1;
    }
    return value;
}
static double Sim_exp(double a, int *bad) { return Sim_checked(exp(a), a, bad); }
static double Sim_sinh(double a, int *bad) { return Sim_checked(sinh(a), a, bad); }
static double Sim_cosh(double a, int *bad) { return Sim_checked(cosh(a), a, bad); }
static double Sim_pow(double a, double b, int *bad) { return Sim_checked(pow(a, b), a, bad); }
static double Sim_sin(double a, int *bad)
{
    *bad = *bad || isinf(a);
    return sin(a);
}
static double Sim_cos(double a, int *bad)
{
    *bad = *bad || isinf(a);
    return cos(a);
}
static double Sim_tan(double a, int *bad)
{
    *bad = *bad || isinf(a);
    return tan(a);
}
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Function:
    """A translated function: ``Sim_NAME(parameters.., double *out, int *bad)``."""

    name: str
    parameters: tuple[str, ...]
    results: int
    text: str


def translate(text: str) -> tuple[Function, ...]:
    """Translate every function of a module that the simulation wrote.

    Parameters
    ----------
    text : str
        Functions of straight lines: assignments to names, and a last ``return``.

    Returns
    -------
    tuple[Function, ...]
        In the order of the text.

    Raises
    ------
    ShapeError
        If a line is none that ``simulation.statements`` writes.
    """
    body = ast.parse(text).body
    return tuple(_function(node) for node in body if isinstance(node, ast.FunctionDef))


def _function(node: ast.FunctionDef) -> Function:
    parameters = tuple(argument.arg for argument in node.args.args)
    known, lines = set(parameters), []
    *assignments, last = node.body
    for line in assignments:
        if not isinstance(line, ast.Assign) or not isinstance(line.targets[0], ast.Name):
            raise ShapeError(f"{node.name}: {ast.unparse(line)} is no assignment to a name")
        target = line.targets[0].id
        lines.append(f"{'' if target in known else 'double '}{target} = {_text(line.value)};")
        known.add(target)
    if not isinstance(last, ast.Return) or last.value is None:
        raise ShapeError(f"{node.name}: does not end in a value")
    value = last.value
    results = value.elts if isinstance(value, ast.Tuple) else [value]
    lines += [f"out[{index}] = {_text(item)};" for index, item in enumerate(results)]
    unused = [f"(void){name};" for name in (*parameters, "bad")]
    head = ", ".join((*(f"double {name}" for name in parameters), "double *out", "int *bad"))
    inside = "\n    ".join((*unused, *lines))
    return Function(
        name=node.name,
        parameters=parameters,
        results=len(results),
        text=f"static inline void Sim_{node.name}({head})\n{{\n    {inside}\n}}\n",
    )


def _text(node: ast.expr) -> str:
    """Write an expression; parentheses keep Python's tree."""
    if isinstance(node, ast.Name):
        return "NAN" if node.id == "nan" else node.id
    if isinstance(node, ast.Constant) and isinstance(node.value, float):
        return repr(node.value)
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        return f"(-{_text(node.operand)})"
    if isinstance(node, ast.BinOp) and type(node.op) in _INFIX:
        return f"({_text(node.left)} {_INFIX[type(node.op)]} {_text(node.right)})"
    if isinstance(node, ast.IfExp):
        return f"({_condition(node.test)} ? {_text(node.body)} : {_text(node.orelse)})"
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
        name, arguments = node.func.id, ", ".join(map(_text, node.args))
        if name in _CHECKED:
            return f"Sim_{name}({arguments}, bad)"
        if name in _PLAIN:
            return f"{_PLAIN[name]}({arguments})"
    raise ShapeError(f"{ast.unparse(node)}: nothing that the simulation writes")


def _condition(node: ast.expr) -> str:
    if isinstance(node, ast.Compare) and len(node.ops) == 1 and type(node.ops[0]) in _COMPARED:
        right = _text(node.comparators[0])
        return f"({_text(node.left)} {_COMPARED[type(node.ops[0])]} {right})"
    if isinstance(node, ast.Name):
        # Python takes every number but 0 for true, NaN too.
        return f"({node.id} != 0.0)"
    raise ShapeError(f"{ast.unparse(node)}: no condition that the simulation writes")
