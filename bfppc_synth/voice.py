"""What the command line says: results on stdout, everything else on stderr; exit codes."""

from __future__ import annotations

import json
import os
import sys
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from bfppc_synth.errors import BfppcError, NoDesignError, PlantFileError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from bfppc_synth.pipeline import Outcome


@dataclass(frozen=True, slots=True, kw_only=True)
class Voice:
    """How to speak: results on stdout, everything else on stderr."""

    as_json: bool
    quiet: bool

    def tell(self, outcome: Outcome) -> int:
        """Print what came of a command; its exit code."""
        from bfppc_synth.report.summary import summary

        for message in outcome.messages:
            if outcome.exit_code:
                print(message, file=sys.stderr)
            elif not self.quiet:
                print(f"note: {message}", file=sys.stderr)
        document: dict[str, Any] = {**outcome.document, "exit_code": outcome.exit_code}
        if outcome.folder is not None:
            document["folder"] = outcome.folder.as_posix()
        if self.as_json:
            print(json.dumps(document, indent=2))
        elif not self.quiet:
            print("\n".join(outcome.lines or summary(document)))
        return outcome.exit_code

    def complain(self, error: Exception, exit_code: int, sentence: str) -> int:
        """Print why nothing came of it; with --json also as the object on stdout."""
        print(sentence, file=sys.stderr)
        if self.as_json:
            mistakes = error.mistakes if isinstance(error, PlantFileError) else ()
            rows = [{key: getattr(row, key) for key in row.__slots__} for row in mistakes]
            document: dict[str, Any] = {"format": "bfppc-synth/error/1", "exit_code": exit_code}
            document |= {"kind": type(error).__name__, "message": sentence, "mistakes": rows}
            if isinstance(error, NoDesignError):
                document |= error.details
            print(json.dumps(document, indent=2))
        return exit_code

    @contextmanager
    def progress(self) -> Iterator[Callable[[str], None]]:
        """Yield what shows the current step; silent unless stderr is a terminal."""
        if self.quiet or not sys.stderr.isatty():
            yield lambda _message: None
            return
        from rich.console import Console
        from rich.markup import escape

        with Console(stderr=True).status("reading") as status:
            yield lambda message: status.update(escape(message))

    @contextmanager
    def bar(self, total: int) -> Iterator[Callable[[int], None]]:
        """Yield what is told how many runs more are done; shows rate and time left."""
        if self.quiet or not sys.stderr.isatty():
            yield lambda _more: None
            return
        from rich.console import Console
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn
        from rich.progress import TimeRemainingColumn as TimeLeft

        rate = TextColumn("{task.fields[rate]}")
        columns = (BarColumn(), MofNCompleteColumn(), rate, TimeLeft(), TextColumn("left"))
        # A minute and more between two batches still counts for the estimate.
        with Progress(
            *columns, console=Console(stderr=True), speed_estimate_period=600.0, transient=True
        ) as progress:
            task = progress.add_task("runs", total=total, rate="")

            def done(more: int) -> None:
                progress.advance(task, more)
                speed = progress.tasks[0].speed
                progress.update(task, rate=f"{speed:.0f} runs/s" if speed else "")

            yield done

    def settle(self, work: Callable[[], int]) -> int:
        """Run ``work``; whatever happens becomes an exit code, nobody sees a traceback unasked."""
        try:
            return work()
        except BfppcError as error:
            prefix = "" if isinstance(error, PlantFileError) else "error: "
            return self.complain(error, error.exit_code, f"{prefix}{error}")
        except KeyboardInterrupt:
            print("interrupted", file=sys.stderr)
            return 130
        except BrokenPipeError:
            # Who read along (head, less) has seen enough; Python's own flush must not complain.
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            return 141
        except Exception as error:
            if os.environ.get("BFPPC_TRACEBACK") == "1":
                raise
            what = f"unexpected {type(error).__name__}: {error} (BFPPC_TRACEBACK=1 shows where)"
            return self.complain(error, 1, what)
