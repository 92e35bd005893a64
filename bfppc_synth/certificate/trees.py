"""Search for the bisection trees that a certificate hints at; nothing here is believed."""

from __future__ import annotations

import heapq
from typing import TYPE_CHECKING

from bfppc_synth.certificate import checker

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bfppc_synth.certificate.checker import Goal

# Boxes that may be looked at for one goal; what needs more would also be slow to check.
BUDGET = 1500


def find_trees(goals: Sequence[Goal], budget: int = BUDGET) -> list[list[int] | str] | None:
    """Search a tree for each goal; None where one is not found.

    Returns
    -------
    list or None
        Trees as the checker reads them: a list for a pointwise goal, a text for a facet.
    """
    trees: list[list[int] | str] = []
    for goal in goals:
        tree = find_tree(goal, budget)
        if tree is None:
            return None
        trees.append(as_text(tree) if isinstance(goal, checker.Facet) else tree)
    return trees


def as_text(tree: Sequence[int]) -> str:
    """Write a tree with one letter for each entry."""
    return "".join(checker.LETTERS[entry + 1] for entry in tree)


def find_tree(goal: Goal, budget: int = BUDGET) -> list[int] | None:
    """Search a bisection tree that proves ``goal.node <= 0``; None where none is found.

    The worst part is cut first, so that a false claim is found out early.

    Returns
    -------
    list[int] or None
        Pre-order: the dimension that is cut at its middle, or -1 for a leaf.
    """
    tape, box = goal.tape(goal.node)
    first = tape.bound(box)
    parts, bounds = [box], [first]
    cuts: dict[int, tuple[int, int]] = {}
    heap = [(-first.upper, 0)]
    while heap[0][0] < 0:
        _, number = heapq.heappop(heap)
        bound = bounds[number]
        if len(parts) > budget or bound.sample > 0 or not bound.cuts:
            return None
        cuts[number] = (bound.cuts[0], len(parts))
        for part in checker.halves(parts[number], bound.cuts[0]):
            found = tape.bound(part)
            heapq.heappush(heap, (-found.upper, len(parts)))
            parts.append(part)
            bounds.append(found)
    tree: list[int] = []
    stack = [0]
    while stack:
        dimension, child = cuts.get(stack.pop(), (-1, 0))
        tree.append(dimension)
        if dimension >= 0:
            stack += [child + 1, child]
    return tree
