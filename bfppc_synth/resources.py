"""Where templates and examples are, in a wheel and in a working tree, and how they are read."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from bfppc_synth.errors import BfppcError

if TYPE_CHECKING:
    import jinja2

_PACKAGE = Path(__file__).resolve().parent


class ResourceError(BfppcError):
    """The installation lacks its templates or examples."""


def template_folder(package: Path = _PACKAGE) -> Path:
    """Find the folder of the templates.

    Parameters
    ----------
    package : Path
        Folder of the installed package; the default is this one.

    Returns
    -------
    Path
        ``templates`` inside the package (a wheel), else beside pyproject.toml (a working tree).

    Raises
    ------
    ResourceError
        If neither is there.
    """
    return _folder(package, "templates", "nothing can be generated")


def example_folder(package: Path = _PACKAGE) -> Path:
    """Find the folder of the example plant files, as ``template_folder`` does.

    Raises
    ------
    ResourceError
        If it is not there.
    """
    return _folder(package, "examples", "no plant file can begin as one of them")


def _folder(package: Path, name: str, loss: str) -> Path:
    inside, beside = package / name, package.parent / name
    if inside.is_dir():
        return inside
    # A folder called templates in site-packages would be someone else's.
    if beside.is_dir() and (package.parent / "pyproject.toml").is_file():
        return beside
    raise ResourceError(
        f"the {name} are neither in {name}/ of the package nor beside pyproject.toml: "
        f"{loss}\n  fix: install the package again"
    )


def template_environment() -> jinja2.Environment:
    """Make the Jinja2 environment of every generated file.

    Returns
    -------
    jinja2.Environment
        StrictUndefined: a name that a template asks for and does not get is an error. Only
        ``*.html.jinja`` escapes what is inserted.

    Raises
    ------
    ResourceError
        If the installation has no templates.
    """
    import jinja2

    return jinja2.Environment(
        loader=jinja2.FileSystemLoader(template_folder()),
        undefined=jinja2.StrictUndefined,
        autoescape=jinja2.select_autoescape(enabled_extensions=("html.jinja",)),
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
