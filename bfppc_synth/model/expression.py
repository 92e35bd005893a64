"""A user's mathematics as a syntax tree, before sympy is imported."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, TypeAlias

if TYPE_CHECKING:
    from fractions import Fraction


@dataclass(frozen=True, slots=True, kw_only=True)
class Number:
    """An exact number, read from its decimal text."""

    value: Fraction


@dataclass(frozen=True, slots=True, kw_only=True)
class Name:
    """A state, a parameter, ``t``, ``pi`` or ``E``."""

    name: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Operation:
    """``+ - * / **`` with two operands, or ``neg`` with one."""

    operator: Literal["+", "-", "*", "/", "**", "neg"]
    operands: tuple[Node, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Call:
    """A listed function; the name is the canonical one (``abs``, ``log``, ``min``, ...)."""

    function: str
    arguments: tuple[Node, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Comparison:
    """A single comparison, allowed only as the condition of a Piecewise branch."""

    relation: Literal["<", "<=", ">", ">="]
    left: Node
    right: Node


@dataclass(frozen=True, slots=True, kw_only=True)
class Branches:
    """A Piecewise: (value, condition) pairs; condition ``None`` means True (the last branch)."""

    branches: tuple[tuple[Node, Comparison | None], ...]


Node: TypeAlias = Number | Name | Operation | Call | Branches


@dataclass(frozen=True, slots=True, kw_only=True)
class Expression:
    """An expression of the plant file: its text (as written) and its tree."""

    text: str
    tree: Node


@dataclass(frozen=True, slots=True, kw_only=True)
class Constant:
    """A number or constant expression of the plant file.

    ``exact`` is None when the value is irrational (it contains pi, E or a function);
    ``approximate`` is then correct to a few units in the last place and must not be
    used where a bound is wanted.
    """

    text: str
    tree: Node
    exact: Fraction | None
    approximate: float
