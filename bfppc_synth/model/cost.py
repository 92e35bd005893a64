"""What one step of a generated controller computes, counted in its statements."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class StepCost:
    """Operations of the longest step after the first one; screening and clamp not counted.

    ``functions`` are pairs (name, calls) in alphabetical order; ``remembered`` counts the
    numbers kept from one step to the next.
    """

    additions: int
    multiplications: int
    divisions: int
    choices: int
    functions: tuple[tuple[str, int], ...]
    remembered: int

    def words(self) -> str:
        """Say it in one phrase, zeros left out."""
        counts = [
            _counted(self.additions, "addition"),
            _counted(self.multiplications, "multiplication"),
            _counted(self.divisions, "division"),
            _counted(self.choices, "comparison"),
            *(_counted(calls, "call") + f" of {name}" for name, calls in self.functions),
        ]
        said = [text for text in counts if not text.startswith("0 ")]
        if len(said) < 2:
            return "".join(said)
        return f"{', '.join(said[:-1])} and {said[-1]}"


def _counted(count: int, noun: str) -> str:
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"
