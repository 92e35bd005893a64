"""What every letter of the page means, said where it first stands."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from bfppc_synth.report.formulas import dotted, inline, name_latex
from bfppc_synth.report.letters import Letter, letters
from bfppc_synth.report.meanings import MEANINGS, NOMINAL, NUMBERS, THEOREM1

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

# Where a part of the page wants its list of letters.
PLACE = "<!-- letters -->"


class Glossary:
    """Explains each letter once, in the part of the page where it first stands."""

    def __init__(self, document: Mapping[str, Any], prose: Callable[[str], str]) -> None:
        """Collect what can stand on the page of this document.

        Parameters
        ----------
        document : Mapping[str, Any]
            report.json: method, center, states and parameters.
        prose : callable
            Turns a sentence into markup.
        """
        self._prose = prose
        self._meanings = dict(MEANINGS)
        if document["center"] == "nominal":
            self._meanings |= NOMINAL
        if document["method"] == "theorem1":
            self._meanings |= THEOREM1
        self._own = _own_names(document)
        self._said: set[str] = set()

    def explain(self, part: str) -> str:
        """Put the list of new letters where ``part`` wants it.

        Parameters
        ----------
        part : str
            Markup of a section.

        Returns
        -------
        str
            The same with a definition list, or with nothing where no letter is new.
        """
        rows, waiting = [], list(letters(part))
        while waiting:
            entry = self._entry(waiting.pop(0))
            if entry is None:
                continue
            symbol, meaning = inline(entry[0]), self._prose(entry[1])
            rows.append(f"<div><dt>{symbol}</dt><dd>{meaning}</dd></div>")
            # An explanation may need letters of its own.
            waiting.extend(letters(meaning))
        if not rows:
            return part.replace(PLACE, "")
        head = '<p class="small soft">Letters used from here on:</p>'
        text = "\n".join([head, '<dl class="letters">', *rows, "</dl>"])
        return part.replace(PLACE, text, 1)

    def unknown(self, part: str) -> tuple[str, ...]:
        """Name the letters of some markup that have no explanation: none, on a page."""
        return tuple(
            letter.key
            for letter in letters(part)
            if letter not in self._own and not _is_word(letter) and letter.key not in self._known()
        )

    def _known(self) -> set[str]:
        return self._meanings.keys() | NUMBERS

    def _entry(self, letter: Letter) -> tuple[str, str] | None:
        own = self._own.get(letter)
        key = own[0] if own is not None else letter.key
        entry = own if own is not None else self._meanings.get(key)
        if entry is None or key in self._said:
            return None
        self._said.add(key)
        return entry


def _is_word(letter: Letter) -> bool:
    """Whether it is a word set upright, such as a unit."""
    return letter.stem.startswith('"') and not letter.accent


def _own_names(document: Mapping[str, Any]) -> dict[Letter, tuple[str, str]]:
    """Explain the names of the plant file; x_i for state i explains itself."""
    found: dict[Letter, tuple[str, str]] = {}
    for i, state in enumerate(document["states"], 1):
        if name_latex(state) == f"x_{{{i}}}":
            continue
        unit = document["units"].get(state)
        where = f"state $x_{{{i}}}$" + (" and output" if i == 1 else "")
        text = f"`{state}`{f' in {unit}' if unit else ''}, {where}"
        _add(found, name_latex(state), text)
        _add(found, dotted(state), f"derivative of `{state}` by time")
    for name in document["plant"]["parameters"]:
        _add(found, name_latex(name), f"`{name}`, a parameter of the plant file")
    return found


def _add(found: dict[Letter, tuple[str, str]], latex: str, text: str) -> None:
    for letter in letters(inline(latex)):
        found.setdefault(letter, (latex, text))
