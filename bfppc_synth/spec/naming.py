"""The names that a plant file introduces: states and parameters."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bfppc_synth.spec.kinds import Scope
from bfppc_synth.spec.scalars import read_new_name
from bfppc_synth.spec.schema import MOST_STATES
from bfppc_synth.spec.tree import Mapping, Sequence

if TYPE_CHECKING:
    from bfppc_synth.spec.notebook import Notebook
    from bfppc_synth.spec.tree import Tree


def read_states(book: Notebook, tree: Tree) -> tuple[str, ...]:
    """Read the list of states; empty if any of it is wrong, so that one mistake stays one."""
    path = "states"
    if not isinstance(tree, Sequence):
        book.blame(path, tree, "a list of names belongs here", "write [x1, x2]")
        return ()
    if not 1 <= len(tree.items) <= MOST_STATES:
        book.blame(
            path,
            tree,
            f"{len(tree.items)} states where 1 to {MOST_STATES} belong",
            f"name 1 to {MOST_STATES}",
        )
        return ()
    names: list[str] = []
    complete = True
    for item in tree.items:
        name = read_new_name(book, path, item, "state")
        if name in names:
            book.blame(path, item, f"{name} is named twice", "name every state once")
            complete = False
        elif name is None:
            complete = False
        else:
            names.append(name)
    return tuple(names) if complete else ()


def read_parameter_names(book: Notebook, tree: Tree, states: tuple[str, ...]) -> tuple[str, ...]:
    """Read the keys of `parameters`; those that are refused are left out."""
    names: list[str] = []
    for entry in tree.entries if isinstance(tree, Mapping) else ():
        path = f"parameters.{entry.key.text.partition(chr(10))[0]}"
        name = read_new_name(book, path, entry.key, "parameter")
        if name in states:
            book.blame(path, entry.key, f"{name} is a state already", "rename the parameter")
        elif name is not None:
            names.append(name)
    return tuple(names)


def visible_names(
    path: str, scope: Scope, states: tuple[str, ...], parameters: tuple[str, ...]
) -> tuple[frozenset[str], dict[str, tuple[str, str]]]:
    """Say which names an expression may contain, and why not the others (message, fix)."""
    if scope is Scope.TIME:
        message = "{} in a signal: it is an expression in t alone"
        others = {
            name: (message.format(name), "write its value as a number")
            for name in (*states, *parameters, "u", "y_d")
        }
        return frozenset({"t"}), others
    state = path.split(".")[1]
    index = states.index(state)
    own, later = states[: index + 1], states[index + 1 :]
    may = f"the bounds and terms of {state} may contain " + ", ".join(own)
    elsewhere = {
        name: (
            f"{name} is a later state: {may}",
            "let it enter through g, or put the states in strict-feedback order",
        )
        for name in later
    }
    elsewhere["t"] = (
        "t has no place in the dynamics: a term in time is an unknown signal here",
        "bound it by `disturbance`",
    )
    elsewhere["u"] = ("u enters as g*u of the last state only", "leave it out")
    elsewhere["y_d"] = ("the plant does not contain its reference", "leave it out")
    return frozenset((*own, *parameters)), elsewhere
