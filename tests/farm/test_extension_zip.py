"""What a bundle brings along is the extension that planned it, from a checkout or installed."""

from __future__ import annotations

import zipfile
from pathlib import Path

from underwater_spectral.jobs import job_files
from underwater_spectral.jobs.farm import extension_zip


def _contents(path: Path) -> dict[str, bytes]:
    archive = zipfile.ZipFile(path)
    return {name: archive.read(name) for name in archive.namelist() if name[-1] != "/"}


def test_an_installed_extension_is_packed_as_it_was_built(tmp_path, monkeypatch):
    built, packed, installed = (tmp_path / name for name in ("built.zip", "packed.zip", "user"))
    extension_zip.write_extension(built)
    zipfile.ZipFile(built).extractall(installed)
    caches = installed / "jobs" / "__pycache__"
    caches.mkdir()
    (caches / "job.pyc").touch()
    monkeypatch.setattr(extension_zip, "_ROOT", installed)
    monkeypatch.setattr(extension_zip, "_BUILDER", installed / "tools" / "build_extension.py")
    extension_zip.write_extension(packed)
    assert _contents(packed) == _contents(built)
    # Workers compare it with that of the plan.
    ours = job_files.versions()
    monkeypatch.setattr(job_files, "_ROOT", installed)
    job_files._source_digest.cache_clear()
    try:
        assert job_files.versions() == ours
    finally:
        job_files._source_digest.cache_clear()
