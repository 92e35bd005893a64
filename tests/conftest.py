"""Settings that all tests share, and the seconds that every lane took."""

from __future__ import annotations

import os
from collections import defaultdict
from pathlib import Path
from typing import TYPE_CHECKING

from hypothesis import settings

if TYPE_CHECKING:
    import pytest

# One run is like the next: cases are drawn from a fixed seed and no database is kept.
settings.register_profile("sample", deadline=None, derandomize=True, database=None)
settings.register_profile("all", deadline=None, derandomize=True, database=None, max_examples=1000)
settings.load_profile("all" if os.environ.get("BFPPC_TESTS") == "all" else "sample")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave the further cases of a claim to ``make test-all``."""
    if os.environ.get("BFPPC_TESTS") == "all":
        return
    left = [item for item in items if item.get_closest_marker("full")]
    if left:
        config.hook.pytest_deselected(items=left)
        items[:] = [item for item in items if not item.get_closest_marker("full")]


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Print the seconds of every lane: the first folder below tests."""
    seconds: defaultdict[str, float] = defaultdict(float)
    for reports in terminalreporter.stats.values():
        for report in reports:
            if hasattr(report, "duration") and hasattr(report, "nodeid"):
                parts = Path(report.nodeid.partition("::")[0]).parts
                seconds[parts[1] if len(parts) > 2 else parts[0]] += report.duration
    for lane, total in sorted(seconds.items()):
        terminalreporter.write_line(f"lane {lane:<12} {total:6.1f} s")
