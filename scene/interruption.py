"""Ctrl+C while something is rendered: it is finished, so that nothing is lost."""

from __future__ import annotations

import contextlib
import os
import signal
import sys
from collections.abc import Iterator
from types import FrameType


@contextlib.contextmanager
def interrupted_afterwards() -> Iterator[None]:
    """Let Ctrl+C wait for the end of the block, and raise there; a second one ends the process.

    Within a render the exception would end in the engine's own Python, which goes on with what it
    has. Where the signal is Blender's, it stops the render itself.
    """
    if signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield
        return
    asked = False

    def wait(number: int, _: FrameType | None) -> None:
        nonlocal asked
        if asked:
            signal.signal(signal.SIGINT, signal.SIG_DFL)
            os.kill(os.getpid(), number)
        asked = True
        sys.stderr.write("stopping after this render; Ctrl+C again stops at once\n")

    signal.signal(signal.SIGINT, wait)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    if asked:
        raise KeyboardInterrupt
