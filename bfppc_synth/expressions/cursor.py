"""A walk over the tokens of one expression, and the sentences for what is out of place."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from bfppc_synth.expressions.lexer import ExpressionError, Token, TokenKind, tokenize
from bfppc_synth.expressions.names import (
    ALIASES,
    BRANCHES,
    CONSTANTS,
    FUNCTIONS,
    KEYWORDS,
    did_you_mean,
)

if TYPE_CHECKING:
    from collections.abc import Mapping

DEEPEST: Final = 60
RELATIONS: Final = ("<", "<=", ">", ">=")


class Cursor:
    """Where the parser stands, how deep it is, and how it complains."""

    def __init__(
        self, text: str, names: frozenset[str], elsewhere: Mapping[str, tuple[str, str]]
    ) -> None:
        self.text = text
        self.names = names
        self.elsewhere = elsewhere
        self._tokens = tokenize(text)
        self._next = 0
        self._depth = 0

    def peek(self) -> Token:
        """Return the next token, not consumed."""
        return self._tokens[self._next]

    def take(self) -> Token:
        """Return the next token, consumed."""
        token = self._tokens[self._next]
        self._next += 1
        return token

    def at(self, *signs: str) -> bool:
        """Tell whether the next token is one of these signs."""
        token = self.peek()
        return token.kind is TokenKind.SIGN and token.text in signs

    def descend(self) -> None:
        """Enter one level of nesting; the caller leaves it by ascend()."""
        self._depth += 1
        if self._depth > DEEPEST:
            token = self.peek()
            raise self.error(token, f"nested deeper than {DEEPEST} levels", "split it")

    def ascend(self) -> None:
        """Leave one level of nesting."""
        self._depth -= 1

    def close(self, opening: Token) -> Token:
        """Consume the parenthesis that closes an opening one."""
        token = self.take()
        if token.text == ")" and token.kind is TokenKind.SIGN:
            return token
        self._next -= 1
        if token.kind is TokenKind.END:
            raise self.error(opening, "a parenthesis that is never closed", "add `)`")
        raise self.leftover(token)

    def error(self, token: Token, message: str, fix: str) -> ExpressionError:
        """Make an error that underlines one token."""
        length = max(1, token.end - token.start)
        return ExpressionError(message, column=token.start + 1, length=length, fix=fix)

    def error_at(self, start: int, end: int, message: str, fix: str) -> ExpressionError:
        """Make an error that underlines characters start to end, counted from 0."""
        return ExpressionError(message, column=start + 1, length=end - start, fix=fix)

    def leftover(self, token: Token) -> ExpressionError:
        """Make the error for a token that cannot continue the expression."""
        before = self._tokens[self._next - 1]
        if token.text == ")":
            return self.error(token, "a closing parenthesis without an opening one", "remove it")
        if token.text == ",":
            return self.error(
                token,
                "a comma outside of a function's arguments",
                "write decimals with a point: 0.5",
            )
        if token.text in RELATIONS:
            return self.error(
                token,
                "a comparison has its place only in Piecewise",
                "write Piecewise((value, x1 < 1), (other value, True))",
            )
        if token.text in KEYWORDS:
            return self.error(
                token, f"`{token.text}` is no mathematics", "nest one Piecewise in another"
            )
        if before.kind is TokenKind.NUMBER and token.start == before.end:
            fix = f"write {before.text}*{token.text}"
        else:
            fix = f"write `{before.text} * {token.text}` if a product is meant"
        return self.error(token, f"an operator is missing before `{token.text}`", fix)

    def operand_missing(self, token: Token) -> ExpressionError:
        """Make the error for a place where a number or a name belongs."""
        before = self._tokens[self._next - 2] if self._next > 1 else None
        if token.kind is TokenKind.END and before is None:
            return self.error(token, "an empty expression", "write 0 if nothing is meant")
        after = f" after `{before.text}`" if before else ""
        if token.kind is TokenKind.END:
            what, extra = f"the expression ends{after}", before.text if before else ""
        else:
            what, extra = f"`{token.text}`{after}", token.text
        fix = f"write one here, or remove `{extra}`"
        return self.error(token, f"{what} where a number or a name belongs", fix)

    def unknown(self, token: Token, kind: str) -> ExpressionError:
        """Make the error for a name that may not be used here."""
        functions = (*FUNCTIONS, *ALIASES, BRANCHES)
        guess = "" if kind == "function" else did_you_mean(token.text, self.names)
        known = functions if kind == "function" else (*functions, *CONSTANTS)
        guess = guess or did_you_mean(token.text, known)
        if guess:
            fix = f"did you mean `{guess}`?"
        elif kind == "function":
            fix = "the functions are " + ", ".join((*FUNCTIONS, BRANCHES))
        elif self.names:
            fix = "the names here are " + ", ".join(sorted(self.names))
        else:
            fix = "only numbers, pi, E and functions of them may stand here"
        return self.error(token, f"unknown {kind} `{token.text}`", fix)
