"""What a batch prints while it renders."""

from __future__ import annotations

from dataclasses import dataclass

from .render_job import Step

_OPENJD = "openjd"


@dataclass
class Progress:
    """Prints one line per pass with the time that is left.

    With the format ``openjd``, the lines of Open Job Description follow.
    """

    format: str = "text"
    rendered: int = 0
    seconds: float = 0.0

    def report(self, step: Step) -> None:
        """Count a pass and print where the batch stands."""
        item, took = step.rendered, "kept"
        if item.seconds is not None:
            self.rendered += 1
            self.seconds += item.seconds
            took = f"{item.seconds:.1f} s"
        left = (step.total - step.number) * self.seconds / max(self.rendered, 1)
        self.tell(
            f"frame {step.frame}: {item.path.name} {took}, pass {step.number} of {step.total}, "
            f"{left:.0f} s left",
            step.number,
            step.total,
        )

    def tell(self, text: str, number: int, total: int) -> None:
        """Print a line, the ``number``-th of ``total`` steps being done."""
        print(text, flush=True)
        if self.format == _OPENJD:
            print(f"openjd_progress: {100 * number / max(total, 1):.1f}", flush=True)
            self._print_openjd("status", text)

    def fail(self, text: str) -> None:
        """Say that it ended badly, where a format has words for it."""
        if self.format == _OPENJD:
            self._print_openjd("fail", text)

    @staticmethod
    def _print_openjd(word: str, text: str) -> None:
        print(f"openjd_{word}: {' '.join(text.split())}", flush=True)


def print_note(note: str) -> None:
    """Print what could not be treated."""
    print(f"note: {note}")
