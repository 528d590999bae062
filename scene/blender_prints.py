"""What Blender prints itself, without the line for each file that it reads or saves."""

from __future__ import annotations

import contextlib
import os
import sys
import tempfile
from collections.abc import Iterator

import bpy

_STDOUT = 1
_NOISE = (b" | Saved: ", b" | Read blend: ")


@contextlib.contextmanager
def without_file_lines() -> Iterator[None]:
    """Leave those lines out of what is printed while the block runs; all others come after it.

    A window's terminal is left alone.
    """
    if not bpy.app.background:
        yield
        return
    sys.stdout.flush()
    try:
        terminal = os.dup(_STDOUT)
    except OSError:  # closed
        yield
        return
    with tempfile.TemporaryFile() as printed:
        os.dup2(printed.fileno(), _STDOUT)
        try:
            yield
        finally:
            sys.stdout.flush()
            os.dup2(terminal, _STDOUT)
            printed.seek(0)
            for line in printed:
                if not any(word in line for word in _NOISE):
                    os.write(terminal, line)
            os.close(terminal)
