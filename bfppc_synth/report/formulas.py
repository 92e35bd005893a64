"""Formulas as MathML: sympy or LaTeX in, markup without a backslash out."""

from __future__ import annotations

import html
import re
from functools import cache
from typing import TYPE_CHECKING

from bfppc_synth.report.breaking import broken
from bfppc_synth.report.numbers import exact, look_up, path_text, shown

if TYPE_CHECKING:
    from collections.abc import Mapping

    import sympy as sp

    from bfppc_synth.model.plant import Plant

# Longer than this, a majorant of a large plant is no longer read but skipped: the page
# points to report.json instead, and stays below 400 kB.
LONGEST = 3000
# A fraction whose decimals end later than this stays a fraction.
MOST_DECIMALS = 20

_GREEK = frozenset(
    {"alpha", "beta", "gamma", "delta", "epsilon", "zeta", "eta", "theta", "iota", "kappa"}
    | {"lambda", "mu", "nu", "xi", "rho", "sigma", "tau", "upsilon", "phi", "chi", "psi", "omega"}
    | {"Gamma", "Delta", "Theta", "Lambda", "Xi", "Sigma", "Upsilon", "Phi", "Psi", "Omega"}
)
_NAME = re.compile(r"([A-Za-z]+)([0-9]*)(?:_(\w*))?")
# Brackets around what is no taller than a letter need not grow with it.
_LOW = re.compile(
    r"<mrow><mo>\(</mo>((?:(?!<m(?:frac|sup|subsup|sqrt|root|under|over|row|table)|<mo>[()]).)*?)"
    r"<mo>\)</mo></mrow>"
)
_ENTITY = re.compile(r"&#x([0-9A-Fa-f]+);")
_ALONE = re.compile(r"<mrow>(<(m[inot]|mtext)>[^<]*</\2>)</mrow>")
_FUNCTION = re.compile(r"<(?:mi|mo)>([a-z]{2,})</(?:mi|mo)>")
_NUMBER = re.compile(r"<mtext>@([^@<]+)@</mtext>")
_EULER = re.compile(r"(?<![A-Za-z{])e\^")
# Letters that the page uses itself: a plant file's letter of the same look stands upright.
_UPRIGHT = {
    "tau": "\N{GREEK SMALL LETTER TAU}",
    "zeta": "\N{GREEK SMALL LETTER ZETA}",
    "rho": "\N{GREEK SMALL LETTER RHO}",
    "lambda": "\N{GREEK SMALL LETTER LAMDA}",
    "mu": "\N{GREEK SMALL LETTER MU}",
    "nu": "\N{GREEK SMALL LETTER NU}",
    "eta": "\N{GREEK SMALL LETTER ETA}",
    "xi": "\N{GREEK SMALL LETTER XI}",
    "Lambda": "\N{GREEK CAPITAL LETTER LAMDA}",
    "gamma": "\N{GREEK SMALL LETTER GAMMA}",
    "delta": "\N{GREEK SMALL LETTER DELTA}",
    "alpha": "\N{GREEK SMALL LETTER ALPHA}",
}
_TAKEN_ALONE = frozenset("abehijlnqsuvyFUV") | {"tau", "zeta", "rho", "lambda", "mu", "nu"}
_TAKEN_WITH_INDEX = frozenset("pregkMcNWXALGDFBfdwHQRVs") | {
    *("rho", "eta", "xi", "Lambda", "gamma", "delta", "alpha")
}


@cache
def inline(latex: str) -> str:
    """Convert LaTeX to inline MathML."""
    from latex2mathml.converter import convert

    return _lean(str(convert(latex)))


@cache
def displayed(latex: str) -> str:
    """Convert LaTeX to MathML on lines of its own: a long formula may break at its operators."""
    from latex2mathml.converter import convert

    return broken(_lean(str(convert(latex, display="block"))))


def _lean(mathml: str) -> str:
    """Leave out what HTML assumes anyway: a third of the page."""
    text = mathml.replace(' xmlns="http://www.w3.org/1998/Math/MathML"', "")
    text = text.replace(' display="inline"', "")
    for form in ("prefix", "postfix"):
        text = text.replace(f' stretchy="true" fence="true" form="{form}"', "")
    # A function's name is an operator: it wants a little air around it.
    text = _FUNCTION.sub(r'<mo lspace=".17em" rspace=".08em">\1</mo>', text)
    text = _ENTITY.sub(lambda match: html.escape(chr(int(match[1], 16))), text)
    text = _ALONE.sub(r"\1", text)
    low = r'<mrow><mo stretchy="false">(</mo>\1<mo stretchy="false">)</mo></mrow>'
    return _LOW.sub(low, text)


def number(*keys: str | int) -> str:
    """Stand for a number of report.json inside LaTeX; ``with_numbers`` puts it in."""
    return r"\text{@" + "/".join(str(key) for key in keys) + "@}"


def with_numbers(mathml: str, document: Mapping[str, object]) -> str:
    """Replace what ``number`` left behind by the numbers of report.json.

    Parameters
    ----------
    mathml : str
        Markup made from LaTeX with ``number`` in it.
    document : Mapping[str, object]
        report.json.

    Returns
    -------
    str
        Markup in which every number carries its path and its full value; negative ones stand
        in brackets.

    Raises
    ------
    KeyError, IndexError
        If report.json has no such number.
    """

    def put(match: re.Match[str]) -> str:
        keys = [int(key) if key.isdigit() else key for key in match[1].split("/")]
        value = look_up(document, keys)
        text = (
            f'<mn data-json-path="{html.escape(path_text(keys))}" '
            f'data-value="{html.escape(exact(value))}">{html.escape(shown(value))}</mn>'
        )
        if shown(value).startswith("-") or "e" in shown(value):
            return f"<mrow><mo>(</mo>{text}<mo>)</mo></mrow>"
        return text

    return _NUMBER.sub(put, mathml)


def name_latex(name: str) -> str:
    """Write a name of the plant file in LaTeX: x1 as x with index 1, theta as the letter.

    Parameters
    ----------
    name : str
        An identifier of ASCII letters, digits and underscores.

    Returns
    -------
    str
        LaTeX; a word of several letters stands upright.
    """
    match = _NAME.fullmatch(name)
    if match is None:
        return r"\text{" + name.replace("_", " ") + "}"
    letters, digits, rest = match[1], match[2], match[3] or ""
    stem = "\\" + letters if letters in _GREEK else _word(letters)
    indexed = bool(digits or rest)
    if letters in (_TAKEN_WITH_INDEX if indexed else _TAKEN_ALONE):
        stem = r"\text{" + _UPRIGHT.get(letters, letters) + "}"
    words = [*([digits] if digits else []), *(_word(part) for part in rest.split("_") if part)]
    return f"{stem}_{{{','.join(words)}}}" if words else stem


def _word(text: str) -> str:
    return text if len(text) == 1 or text.isdigit() else r"\text{" + text + "}"


def dotted(name: str) -> str:
    """Write the derivative of a state by time: the dot stands over the letter alone."""
    stem, mark, index = name_latex(name).partition("_{")
    return rf"\dot{{{stem}}}{mark}{index}"


def expression_latex(expression: sp.Expr) -> str:
    """Write a sympy expression in LaTeX, in a fixed order of its terms.

    Parameters
    ----------
    expression : sympy.Expr
        Any expression of the plant file or a majorant made from it.

    Returns
    -------
    str
        LaTeX for ``inline``; an ellipsis where the formula is too long to be read.
    """
    import sympy as sp

    symbols = sorted(expression.free_symbols, key=lambda symbol: str(symbol.name))
    names = {symbol: name_latex(symbol.name) for symbol in symbols}
    readable = _with_decimals(expression)
    text = str(sp.latex(readable, symbol_names=names, mul_symbol=r"\,", ln_notation=True))
    # Euler's number is no letter of the plant.
    text = _EULER.sub(lambda _: r"\text{e}^", text)
    return text if len(text) <= LONGEST else r"\text{(long: see report.json)}"


def dynamics_latex(plant: Plant) -> tuple[str, ...]:
    """Write dx_i = f_i + g_i x_{i+1} of every channel, unknown parts as letters.

    Parameters
    ----------
    plant : Plant
        n channels.

    Returns
    -------
    tuple[str, ...]
        n formulas in LaTeX.

    References
    ----------
    The paper's (49).
    """
    lines = []
    inputs = [*(name_latex(state.name) for state in plant.states[1:]), "u"]
    for index, (channel, actuation) in enumerate(zip(plant.channels, inputs, strict=True), 1):
        drift = f"f_{{{index}}}" if channel.f is None else expression_latex(channel.f)
        gain = f"g_{{{index}}}" if channel.g is None else _factor(channel.g)
        terms = [] if drift == "0" else [drift]
        terms.append(actuation if gain == "1" else rf"{gain} \, {actuation}")
        if channel.disturbance != 0:
            terms.append(f"d_{{{index}}}")
        left = dotted(channel.state.name)
        lines.append(f"{left} = {' + '.join(terms)}")
    return tuple(lines)


def unknowns_latex(plant: Plant) -> tuple[str, ...]:
    """Write what is known of the unknown parts: declared bounds and disturbances."""
    lines = []
    for index, channel in enumerate(plant.channels, 1):
        f, g = f"f_{{{index}}}", f"g_{{{index}}}"
        if channel.f_bound is not None:
            lines.append(rf"\left|{f}\right| \le {expression_latex(channel.f_bound)}")
        if channel.g_min is not None and channel.g_bound is not None:
            low, high = expression_latex(channel.g_min), expression_latex(channel.g_bound)
            lines.append(rf"{low} \le {g} \le {high}")
        elif channel.g_min is not None:
            lines.append(rf"{expression_latex(channel.g_min)} \le {g}")
        elif channel.g_bound is not None:
            lines.append(rf"{g} \le {expression_latex(channel.g_bound)}")
        if channel.disturbance != 0:
            text = expression_latex(channel.disturbance)
            lines.append(rf"\left|d_{{{index}}}\right| \le {text}")
    return tuple(lines)


def _factor(expression: sp.Expr) -> str:
    text = expression_latex(expression)
    return rf"\left({text}\right)" if expression.is_Add else text


def _with_decimals(expression: sp.Expr) -> sp.Expr:
    """Turn 321/5000 back into the 0.0642 of the plant file, for the reader only."""
    if expression.is_Rational:
        return _decimal(expression)
    # Inside other powers and functions of numbers alone a decimal would be evaluated.
    if not expression.free_symbols or (expression.is_Pow and not expression.exp.is_Integer):
        return expression
    summed = expression.is_Add or expression.is_Mul
    parts = [
        _with_decimals(part) if part.free_symbols or summed else part for part in expression.args
    ]
    return expression if not parts else expression.func(*parts)


def _decimal(value: sp.Rational) -> sp.Expr:
    import sympy as sp

    rest = int(value.q)
    for prime in (2, 5):
        while rest % prime == 0:
            rest //= prime
    if rest != 1 or value.q in {1, 2, 4} or 10**MOST_DECIMALS % value.q != 0:
        return value
    # Digit by digit: no precision of a decimal context may round them.
    whole, rest = divmod(abs(int(value.p)) * (10**MOST_DECIMALS // int(value.q)), 10**MOST_DECIMALS)
    digits = f"{whole}.{rest:0{MOST_DECIMALS}d}".rstrip("0").rstrip(".")
    return sp.Float(f"-{digits}" if value.p < 0 else digits)
