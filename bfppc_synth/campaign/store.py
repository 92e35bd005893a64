"""DIR/campaign: settings, one file per batch, the result; nothing half written.

Every file is staged beside its place and renamed into it, so that a campaign that was killed
holds whole batches only, and goes on from them.
"""

from __future__ import annotations

import json
import math
import os
import secrets
import shutil
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from bfppc_synth.campaign.tally import Tally
from bfppc_synth.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

SETTINGS = "settings.json"
RESULT = "campaign.json"
PICTURE = "histogram.svg"
_BATCHES = "batches"
_LOCK = ".lock"
_FORMAT = "bfppc-synth/campaign-settings/1"


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """What a campaign is about; a run depends on ``seed``, ``horizon`` and the two hashes."""

    seed: int
    runs: int
    horizon: float
    batch: int
    plant_sha256: str
    controller_sha256: str


class Store:
    """The folder of one campaign.

    Parameters
    ----------
    folder : Path
        The generated folder; the campaign is below it.
    """

    def __init__(self, folder: Path) -> None:
        self.place = folder / "campaign"

    @contextmanager
    def held(self) -> Iterator[None]:
        """Keep other campaigns out of the folder; the system lets go of it with the process.

        Raises
        ------
        UsageError
            If another process holds it, or the system refuses to write.
        """
        try:
            self.place.mkdir(exist_ok=True)
            file = (self.place / _LOCK).open("a", encoding="utf-8")
        except OSError as error:
            raise UsageError(
                f"{self.place.as_posix()}: {error.strerror or error}; fix: make the folder writable"
            ) from error
        with file:
            self._lock(file.fileno())
            yield

    def _lock(self, descriptor: int) -> None:
        try:
            import fcntl
        except ImportError:
            # No such locks on this system: two campaigns at once would write equal files.
            return
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise UsageError(
                f"{self.place.as_posix()}: another campaign is running there; fix: wait for it"
            ) from error

    def settings(self) -> Settings | None:
        """Read what the campaign is about; None where there is none.

        Raises
        ------
        UsageError
            If the file is none of this version's.
        """
        path = self.place / SETTINGS
        if not path.is_file():
            return None
        try:
            found = _settings(json.loads(path.read_text(encoding="utf-8")))
        except (OSError, ValueError, KeyError, TypeError, AttributeError):
            found = None
        if found is None:
            raise UsageError(
                f"{path.as_posix()}: is not the settings of a campaign; fix: remove"
                f" {self.place.as_posix()}"
            )
        return found

    @property
    def finished(self) -> bool:
        """Whether the result is there."""
        return (self.place / RESULT).is_file()

    def begin(self, settings: Settings) -> None:
        """Forget an earlier campaign and write what this one is about."""
        shutil.rmtree(self.place / _BATCHES, ignore_errors=True)
        self.go_on(settings)

    def go_on(self, settings: Settings) -> None:
        """Keep the batches that are there; an old result goes, and what was half written."""
        for name in (RESULT, PICTURE):
            (self.place / name).unlink(missing_ok=True)
        (self.place / _BATCHES).mkdir(parents=True, exist_ok=True)
        for path in sorted(self.place.rglob(".*.new")):
            path.unlink(missing_ok=True)
        self.write_json(SETTINGS, {"format": _FORMAT, **asdict(settings)})

    def batch(self, first: int, count: int, like: Tally) -> Tally | None:
        """Read a batch; None where it has to be made."""
        try:
            text = (self.place / self._name(first, count)).read_text(encoding="utf-8")
            found = Tally.read(json.loads(text), like)
        except (OSError, ValueError, UsageError):
            return None
        return found if found.runs == count else None

    def has(self, first: int, count: int) -> bool:
        """Say whether a batch was written."""
        return (self.place / self._name(first, count)).is_file()

    def keep(self, first: int, count: int, tally: Tally) -> None:
        """Write a batch."""
        self.write_json(self._name(first, count), tally.document())

    def _name(self, first: int, count: int) -> str:
        return f"{_BATCHES}/{first:012d}-{count}.json"

    def write_json(self, name: str, document: dict[str, Any]) -> None:
        """Write an object in whole."""
        text = json.dumps(document, indent=1, allow_nan=False, sort_keys=True)
        self.write(name, (text + "\n").encode())

    def write(self, name: str, content: bytes) -> None:
        """Write a file in whole: staged beside its place, then renamed."""
        write_whole(self.place / name, content)


def _settings(document: dict[str, Any]) -> Settings | None:
    """Take the settings out of their JSON object; None where they make no sense."""
    known = document.pop("format") == _FORMAT
    found = Settings(**document)
    sound = isinstance(found.seed, int) and min(found.runs, found.batch) >= 1
    return found if known and sound and 0.0 < found.horizon < math.inf else None


def write_whole(path: Path, content: bytes) -> None:
    """Write a file staged beside its place and renamed into it.

    Raises
    ------
    UsageError
        If the system refuses.
    """
    staged = path.with_name(f".{path.name}.{secrets.token_hex(4)}.new")
    try:
        try:
            staged.write_bytes(content)
            os.replace(staged, path)  # noqa: PTH105 -- the atomic one, by name
        finally:
            staged.unlink(missing_ok=True)
    except OSError as error:
        raise UsageError(
            f"{path.as_posix()}: {error.strerror or error}; fix: make the folder writable"
        ) from error
