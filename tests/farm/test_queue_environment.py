"""The queue environment is valid, fetches Blender once, and gives it to a bundle's sessions."""

from __future__ import annotations

import hashlib
import json
import subprocess
import sys
import tarfile
from pathlib import Path

import pytest
from underwater_spectral.jobs.farm import openjd_template
from underwater_spectral.jobs.farm.openjd_template import RENDER, FarmJob

ENVIRONMENT = Path(__file__).resolve().parents[2] / "deadline" / "blender_environment.yaml"
SAYS = '#!/bin/sh\necho "Blender $BLENDER_USER_RESOURCES: $*"\n'


def _openjd(*arguments: object) -> subprocess.CompletedProcess:
    command = [sys.executable, "-m", "openjd", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True)


@pytest.fixture
def archive(tmp_path, monkeypatch) -> Path:
    """A Blender that says what it is asked, packed as blender.org does."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    program = tmp_path / "blender-5.2.2-linux-x64" / "blender"
    program.parent.mkdir()
    program.write_text(SAYS)
    program.chmod(0o755)
    packed = tmp_path / "blender-5.2.2-linux-x64.tar.xz"
    with tarfile.open(packed, "w:xz") as file:
        file.add(program.parent, program.parent.name)
    return packed


def _run(archive: Path, sha256: str) -> subprocess.CompletedProcess:
    """Render one pass of a bundle whose files are names."""
    folder = archive.parent
    for name in ("reef.blend", openjd_template.MANIFEST, openjd_template.EXTENSION):
        (folder / name).touch()
    job = FarmJob(folder / "reef.blend", folder / "out", (1, 2), passes=3)
    template = folder / openjd_template.TEMPLATE
    template.write_text(json.dumps(openjd_template.template(job)))
    values = {"Scene": job.scene, "OutputDir": job.out}
    values |= {"BlenderArchive": archive.as_uri(), "BlenderSHA256": sha256}
    given = [part for name, value in values.items() for part in ("-p", f"{name}={value}")]
    work = ("--step", RENDER, "--maximum-tasks", 1)
    return _openjd("run", template, *given, *work, "--environment", ENVIRONMENT)


def test_the_environment_is_valid():
    checked = _openjd("check", ENVIRONMENT)
    assert checked.returncode == 0, checked.stdout
    assert "passes validation" in checked.stdout


def test_a_bundle_runs_with_the_blender_that_was_fetched(archive):
    right = hashlib.sha256(archive.read_bytes()).hexdigest()
    first = _run(archive, right)
    assert first.returncode == 0, first.stdout + first.stderr
    said = [
        line.split("Blender ", 1)[1] for line in first.stdout.splitlines() if "Blender /" in line
    ]
    profiles, asked = zip(*(line.split(": ", 1) for line in said), strict=True)
    assert len(set(profiles)) == 1
    install, render = asked
    assert install.startswith("--command extension install-file -r user_default -e ")
    assert install.endswith("underwater_spectral.zip")
    assert render.startswith("--command underwater ")
    assert not Path(profiles[0]).exists()  # gone with the session
    archive.unlink()  # it is not fetched again
    again = _run(archive, right)
    assert again.returncode == 0, again.stdout + again.stderr


def test_another_archive_is_refused(archive):
    refused = _run(archive, 64 * "0")
    assert refused.returncode != 0
    assert "has another SHA-256" in refused.stdout
    assert not list((archive.parent / "cache").rglob("blender"))
