"""report.pdf: the page set by typst, an optional package."""

from __future__ import annotations

from importlib.util import find_spec

from bfppc_synth.errors import UsageError
from bfppc_synth.report.typst_page import typst_source


def require_typst() -> None:
    """Refuse ``--pdf`` where typst is not installed.

    Raises
    ------
    UsageError
        With the way to install it.
    """
    if find_spec("typst") is None:
        raise UsageError(
            "--pdf: the package typst is not installed; fix: pip install 'bfppc-synth[pdf]'"
        )


def render_pdf(page: str) -> bytes:
    """Set the page as a PDF.

    Parameters
    ----------
    page : str
        report.html as ``render_html`` gives it.

    Returns
    -------
    bytes
        The same for the same page: no date, no font of the machine.

    Raises
    ------
    UsageError
        If typst is not installed.
    """
    require_typst()
    import typst

    made = typst.compile(typst_source(page).encode(), format="pdf", ignore_system_fonts=True)
    return bytes(made)
