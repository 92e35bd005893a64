"""What a value of the plant file may be: the vocabulary of the schema."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, TypeAlias

if TYPE_CHECKING:
    from fractions import Fraction


class Rule(StrEnum):
    """The range of a number, as the sentence that an error prints."""

    ANY = "any number"
    POSITIVE = "above 0"
    NONNEGATIVE = "0 or above"
    OPEN_SHARE = "between 0 and 1, both excluded"
    SHARE = "from 0 to below 1"

    def allows(self, value: Fraction | float) -> bool:
        """Tell whether a number is in range."""
        match self:
            case Rule.ANY:
                return True
            case Rule.POSITIVE:
                return value > 0
            case Rule.NONNEGATIVE:
                return value >= 0
            case Rule.OPEN_SHARE:
                return 0 < value < 1
            case Rule.SHARE:
                return 0 <= value < 1


class Scope(StrEnum):
    """Which names an expression may contain."""

    STATES = "the states up to its own and the parameters"
    TIME = "t"


class Parity(StrEnum):
    """Which integers are meant."""

    ANY = "any"
    ODD = "odd"


class Coverage(StrEnum):
    """Whether a mapping by state must name every state."""

    ALL = "all"
    SOME = "some"


class TextForm(StrEnum):
    """What a text is for."""

    PLANT_NAME = "plant name"
    LINE = "line"


@dataclass(frozen=True, slots=True, kw_only=True)
class Number:
    """A number or constant expression."""

    rule: Rule = Rule.ANY


@dataclass(frozen=True, slots=True, kw_only=True)
class Range:
    """A number, or [lower, upper]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Integer:
    """A whole number, both ends included."""

    lowest: int
    highest: int
    parity: Parity = Parity.ANY


@dataclass(frozen=True, slots=True, kw_only=True)
class Text:
    """A text on one line."""

    form: TextForm = TextForm.LINE


@dataclass(frozen=True, slots=True, kw_only=True)
class Formula:
    """An expression."""

    scope: Scope


@dataclass(frozen=True, slots=True, kw_only=True)
class Choice:
    """One of a few words."""

    words: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class StateNames:
    """The list of states, in strict-feedback order."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Numbers:
    """A list of numbers."""

    rule: Rule
    fewest: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Field:
    """A key; ``default`` is the text that stands for an absent one, empty for none."""

    key: str
    kind: Kind
    description: str
    required: bool = False
    default: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Section:
    """A mapping with known keys."""

    fields: tuple[Field, ...]

    def field(self, key: str) -> Field | None:
        """Find a key."""
        return next((item for item in self.fields if item.key == key), None)


@dataclass(frozen=True, slots=True, kw_only=True)
class ListOf:
    """A list of mappings of one kind; ``wanted`` says what each one is."""

    item: Section
    wanted: str


@dataclass(frozen=True, slots=True, kw_only=True)
class PerState:
    """A mapping from states to values; ``besides`` are keys that are no states."""

    item: Kind
    coverage: Coverage
    besides: tuple[Field, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class OneOrPerState:
    """A value for all states, or one per state by name or in a list."""

    item: Kind


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameters:
    """A mapping from new names to ranges."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Units:
    """A mapping from states, parameters and u to texts."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Either:
    """A scalar, or one of some sections: the first that owns a key of the mapping's."""

    scalar: Kind
    sections: tuple[Section, ...]


Kind: TypeAlias = (
    Number
    | Range
    | Integer
    | Text
    | Formula
    | Choice
    | StateNames
    | Numbers
    | Section
    | ListOf
    | PerState
    | OneOrPerState
    | Parameters
    | Units
    | Either
)
