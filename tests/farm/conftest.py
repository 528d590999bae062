"""Blender's executable on a worker, and on the machine that plans."""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from underwater_spectral.jobs.farm.farm_bundle import write_extension

PLAIN = Path(__file__).with_name("plain_blender.py")


@pytest.fixture
def blender(tmp_path, monkeypatch) -> Path:
    """A Blender without extensions: that of the variable ``BLENDER``, or the module bpy.

    ``HOME`` and the profile are new and empty.
    """
    home = tmp_path / "home"
    home.mkdir()
    monkeypatch.setenv("HOME", str(home))
    monkeypatch.setenv("BLENDER_USER_RESOURCES", str(home / "blender"))
    if given := os.environ.get("BLENDER"):
        return Path(given)
    script = tmp_path / "blender"
    script.write_text(f'#!/bin/sh\nexec {shlex.join([sys.executable, str(PLAIN)])} "$@"\n')
    script.chmod(0o755)
    return script


@pytest.fixture
def artist(blender, tmp_path) -> Callable[..., None]:
    """The batch in a Blender of the same kind where the extension was installed from its zip."""
    profile, file = tmp_path / "artist", tmp_path / "underwater_spectral-built.zip"
    write_extension(file)
    environment = {**os.environ, "BLENDER_USER_RESOURCES": str(profile)}

    def run(*arguments: object) -> None:
        command = [blender, "--command", *arguments]
        subprocess.run(list(map(str, command)), check=True, env=environment)

    run("extension", "install-file", "-r", "user_default", "-e", file)
    return lambda *arguments: run("underwater", *arguments)
