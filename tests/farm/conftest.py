"""What stands for Blender's executable on a worker."""

from __future__ import annotations

import shlex
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def blender(tmp_path) -> Path:
    """A script that takes ``--command underwater …`` as Blender does, with the module bpy."""
    script = tmp_path / "blender"
    batch = shlex.join([sys.executable, str(ROOT / "render_bands.py")])
    script.write_text(
        f'#!/bin/sh\n[ "$1 $2" = "--command underwater" ] || exit 64\nshift 2\nexec {batch} "$@"\n'
    )
    script.chmod(0o755)
    return script
