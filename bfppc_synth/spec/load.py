"""load_spec: a path -> PlantSpec, or all mistakes of the file at once."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from bfppc_synth.errors import PlantFileError
from bfppc_synth.model.spec import Interval, ParameterSpec, PlantSpec
from bfppc_synth.spec import build
from bfppc_synth.spec.canonical import freeze_document
from bfppc_synth.spec.document import document_of, read_document
from bfppc_synth.spec.notebook import Notebook
from bfppc_synth.spec.reading import Reader
from bfppc_synth.spec.rules import check_rules, unused_keys

if TYPE_CHECKING:
    from os import PathLike

    from bfppc_synth.spec.document import Document


def load_spec(path: str | PathLike[str]) -> PlantSpec:
    """Read a plant file.

    Parameters
    ----------
    path : path
        A YAML 1.2 file as SPEC section 1 describes it.

    Returns
    -------
    PlantSpec
        Checked for grammar, names and ranges; defaults filled in. Nothing that needs bounds
        is checked here, and sympy is not imported.

    Raises
    ------
    PlantFileError
        With all mistakes of the file, in file order.
    """
    return spec_of(read_document(Path(path)))


def load_text(source: str, path: str) -> PlantSpec:
    """Read the text of a plant file that no folder holds; ``path`` names it in sentences.

    Raises
    ------
    PlantFileError
        As ``load_spec``.
    """
    return spec_of(document_of(path, source))


def spec_of(document: Document) -> PlantSpec:
    """Turn a file's tree into records, or into all of its mistakes.

    Raises
    ------
    PlantFileError
        With all mistakes of the file, in file order.
    """
    book = Notebook(document.mistakes)
    reader = Reader(book, document.root)
    reader.read()
    check_rules(book, reader.states)
    mistakes = book.mistakes()
    if mistakes:
        raise PlantFileError(document.path, document.source, mistakes)
    return _build(document, book, reader)


def _build(document: Document, book: Notebook, reader: Reader) -> PlantSpec:
    states = reader.states
    name = book.text("name", "")
    measurement = build.build_measurement(book, states)
    labels = (*states, *reader.parameters, "u")
    return PlantSpec(
        path=document.path,
        source=document.source,
        sha256=document.sha256,
        document=freeze_document(document.root, states),
        places=book.places(),
        notes=unused_keys(book, states),
        name=name,
        title=book.text("title", name),
        units=tuple(
            (label, book.text(f"units.{label}", ""))
            for label in labels
            if book.has(f"units.{label}")
        ),
        parameters=tuple(
            ParameterSpec(name=item, range=_interval(book, f"parameters.{item}"))
            for item in reader.parameters
        ),
        states=states,
        dynamics=tuple(build.build_channel(book, state) for state in states),
        reference=build.build_reference(book),
        initial=tuple(_interval(book, f"initial.{state}") for state in states),
        offset=None if "offset" in states else book.constant("initial.offset"),
        performance=build.build_performance(book, states),
        measurement=measurement,
        sampling=build.build_sampling(book),
        actuator=build.build_actuator(book),
        synthesis=build.build_synthesis(book, states),
        simulation=build.build_simulation(book, measurement),
    )


def _interval(book: Notebook, path: str) -> Interval:
    found = book.interval(path)
    if found is None:
        # Unreachable once the file has no mistakes; an error here is ours, not the user's.
        raise LookupError(path)
    return found
