"""Python text as a module: the generated controller.py, and the plant's right-hand sides."""

from __future__ import annotations

from importlib.abc import SourceLoader
from importlib.machinery import ModuleSpec
from importlib.util import module_from_spec
from typing import TYPE_CHECKING, Protocol

from bfppc_synth.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path
    from types import ModuleType


class Controller(Protocol):
    """What the simulation uses of a generated controller (SPEC section 3).

    Only a law in stages has ``stage``.
    """

    status: int
    stage: int

    def reset(self) -> None:
        """Forget the latched start."""

    def step(
        self, t: float, x: Sequence[float], y_d: float | Sequence[float] | None = None
    ) -> float:
        """Return the command for the measured states x at time t [s]."""


class _TextLoader(SourceLoader):
    """Loads a text; having no file times, it neither reads nor writes a bytecode cache."""

    def __init__(self, text: str, origin: str) -> None:
        self._text = text
        self._origin = origin

    def get_filename(self, fullname: str) -> str:
        del fullname
        return self._origin

    def get_data(self, path: bytes | str) -> bytes:
        del path
        return self._text.encode()


def load_text(text: str, *, name: str, origin: str) -> ModuleType:
    """Run a Python text as a module that is in no list of modules and leaves no file.

    Parameters
    ----------
    text : str
        Source of the module.
    name, origin : str
        What tracebacks call the module and its file.

    Returns
    -------
    ModuleType
        The module after its text has run.
    """
    loader = _TextLoader(text, origin)
    module = module_from_spec(ModuleSpec(name, loader, origin=origin))
    loader.exec_module(module)
    return module


def load_controller(path: Path) -> type[Controller]:
    """Load class ``Controller`` of a generated controller.py.

    Parameters
    ----------
    path : Path
        The file; it is run as it stands, and no cache is written beside it.

    Returns
    -------
    type[Controller]
        The class; make one instance per run.

    Raises
    ------
    UsageError
        If the file is missing, is no Python text, or has no class Controller.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise UsageError(f"{path}: cannot be read as text: {error}") from error
    try:
        module = load_text(text, name="generated_controller", origin=str(path))
    except (SyntaxError, ImportError, NameError, TypeError, ValueError) as error:
        raise UsageError(
            f"{path}: does not run as Python: {error}\n  fix: synthesize the folder again"
        ) from error
    found = getattr(module, "Controller", None)
    if not isinstance(found, type):
        raise UsageError(
            f"{path}: there is no class Controller in it\n  fix: synthesize the folder again"
        )
    return found
