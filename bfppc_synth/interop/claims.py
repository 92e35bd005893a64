"""Claims of a certificate as data: a real inequality, closed or over a box."""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import StrEnum
from fractions import Fraction
from typing import Protocol

from bfppc_synth.errors import BfppcError


class InexpressibleError(BfppcError):
    """A function that the target language has no form for."""


class Tree(Protocol):
    """An expression; the checker's nodes and the terms below both have this form.

    kind: num (number) | sym (name) | pi | sum (weights times args) | prod (args to the powers
    weights) | fun (name of args) | piece (relations[i] compares args[2i+1] with 0 for args[2i];
    the last arg is the default).
    """

    @property
    def kind(self) -> str:
        """Which of the seven forms it is."""

    @property
    def args(self) -> tuple[Tree, ...]:
        """Parts of it."""

    @property
    def weights(self) -> tuple[Fraction, ...]:
        """Weights of a sum, exponents of a product."""

    @property
    def number(self) -> Fraction:
        """Value of a number."""

    @property
    def name(self) -> str:
        """Name of a symbol or of a function."""

    @property
    def relations(self) -> tuple[str, ...]:
        """Relations of a piecewise expression."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Term:
    """A ``Tree`` that keeps the form it was written in: nothing is folded or sorted."""

    kind: str
    args: tuple[Tree, ...] = ()
    weights: tuple[Fraction, ...] = ()
    number: Fraction = Fraction(0)
    name: str = ""
    relations: tuple[str, ...] = ()


class Relation(StrEnum):
    """How the two sides of a claim compare."""

    LESS = "<"
    AT_MOST = "<="


@dataclass(frozen=True, slots=True, kw_only=True)
class Variable:
    """A real variable with the closed interval that it runs through.

    A name that begins with + is the modulus of a state on one side of 0.
    """

    name: str
    lower: Fraction
    upper: Fraction


@dataclass(frozen=True, slots=True, kw_only=True)
class Claim:
    """lhs < rhs or lhs <= rhs for all values of the variables; closed without variables.

    ``id`` is the checker's (``U1[x1]``), with a number where an obligation falls into several
    claims; ``statement`` says in words what it is, ``note`` how it relates to the obligation.
    """

    id: str
    statement: str
    lhs: Tree
    relation: Relation
    rhs: Tree
    variables: tuple[Variable, ...] = ()
    note: str = ""

    @property
    def label(self) -> str:
        """The id as an identifier: ``U2'[x2]`` is ``U2_prime_x2``."""
        return re.sub(r"\W+", "_", self.id.replace("'", "_prime")).strip("_")


@dataclass(frozen=True, slots=True, kw_only=True)
class Provenance:
    """Where the claims come from."""

    plant: str
    tool: str
    plant_sha256: str
    theorem: str


def number(value: Fraction | int) -> Term:
    """Rational number."""
    return Term(kind="num", number=Fraction(value))


def symbol(name: str) -> Term:
    """Variable of a claim."""
    return Term(kind="sym", name=name)


def total(*parts: Tree) -> Term:
    """Sum."""
    return Term(kind="sum", args=parts, weights=(Fraction(1),) * len(parts))


def difference(a: Tree, b: Tree) -> Term:
    """Return a - b."""
    return Term(kind="sum", args=(a, b), weights=(Fraction(1), Fraction(-1)))


def product(*parts: Tree) -> Term:
    """Product."""
    return Term(kind="prod", args=parts, weights=(Fraction(1),) * len(parts))


def quotient(a: Tree, b: Tree) -> Term:
    """Return a / b."""
    return Term(kind="prod", args=(a, b), weights=(Fraction(1), Fraction(-1)))


def power(base: Tree, exponent: int) -> Term:
    """Integer power."""
    return Term(kind="prod", args=(base,), weights=(Fraction(exponent),))


def apply(name: str, argument: Tree) -> Term:
    """Value of a function by its name in the plant file's grammar."""
    return Term(kind="fun", name=name, args=(argument,))


def variable_name(name: str) -> str:
    """Return the identifier of a variable, one that no keyword of a target language can be."""
    return f"m_{name[1:]}" if name.startswith("+") else f"v_{name}"
