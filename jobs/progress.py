"""What a batch prints while it renders."""

from __future__ import annotations

import shutil
import sys
import time
from dataclasses import dataclass, field

from .render_job import Step

_OPENJD = "openjd"
_LOG_SECONDS = 10.0
"""Between two lines of a log."""
_CLEAR = "\r\x1b[K"


def time_left(seconds: float, done: int, left: int) -> str:
    """Say how long a render will still take, by the mean time of its passes."""
    minutes, rest = divmod(round(seconds / max(done, 1) * left), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours:d}:{minutes:02d}:{rest:02d} left"


@dataclass
class Progress:
    """Prints how far a batch is, and the time that is left; if ``quiet``, notes only.

    A terminal has one line that is written anew for each pass; a log gets the first pass, the last,
    and one each ten seconds. With the format ``openjd``, every pass has the lines of Open Job
    Description.
    """

    format: str = "text"
    quiet: bool = False
    rendered: int = 0
    seconds: float = 0.0
    _printed: float = float("-inf")
    _noted: set[str] = field(default_factory=set)

    def report(self, step: Step) -> None:
        """Count a pass and print where the batch stands."""
        item, took = step.rendered, "kept"
        if item.seconds is not None:
            self.rendered += 1
            self.seconds += item.seconds
            took = f"{item.seconds:.1f} s"
        text = f"frame {step.frame}: {item.path.name} {took}, pass {step.number} of {step.total}"
        if self.rendered:
            text += f", {time_left(self.seconds, self.rendered, step.total - step.number)}"
        self.tell(text, step.number, step.total)

    def tell(self, text: str, number: int, total: int) -> None:
        """Print where it stands, the ``number``-th of ``total`` steps being done."""
        if self.format == _OPENJD:
            print(f"openjd_progress: {100 * number / max(total, 1):.1f}", flush=True)
            self._print_openjd("status", text)
        elif self.quiet:
            return
        elif sys.stdout.isatty():
            width = shutil.get_terminal_size().columns - 1
            end = "\n" if number >= total else ""
            print(f"{_CLEAR}{text[:width]}", end=end, flush=True)
        elif number >= total or time.monotonic() - self._printed >= _LOG_SECONDS:
            print(text, flush=True)
            self._printed = time.monotonic()

    def note(self, text: str) -> None:
        """Print what could not be treated, once."""
        if text not in self._noted:
            self._noted.add(text)
            self._print(f"note: {text}")

    def say(self, text: str) -> None:
        """Print what was done."""
        if not self.quiet:
            self._print(text)

    def fail(self, text: str) -> None:
        """Say that it ended badly, where a format has words for it."""
        if self.format == _OPENJD:
            self._print_openjd("fail", text)

    @staticmethod
    def _print(text: str) -> None:
        print(f"{_CLEAR}{text}" if sys.stdout.isatty() else text, flush=True)

    @staticmethod
    def _print_openjd(word: str, text: str) -> None:
        print(f"openjd_{word}: {' '.join(text.split())}", flush=True)
