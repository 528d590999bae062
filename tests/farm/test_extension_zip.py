"""What a bundle brings along is the extension that planned it, from a checkout or installed."""

from __future__ import annotations

import shutil
import zipfile
from pathlib import Path

import pytest
from underwater_spectral.jobs import job_files
from underwater_spectral.jobs.farm import farm_bundle
from underwater_spectral.scene import sources
from underwater_spectral.uw_spectral.errors import InputError


def _contents(path: Path) -> dict[str, bytes]:
    archive = zipfile.ZipFile(path)
    return {name: archive.read(name) for name in archive.namelist() if name[-1] != "/"}


def test_an_installed_extension_is_packed_as_it_was_built(tmp_path, monkeypatch):
    built, packed, installed = (tmp_path / name for name in ("built.zip", "packed.zip", "user"))
    farm_bundle.write_extension(built)
    zipfile.ZipFile(built).extractall(installed)
    caches = installed / "jobs" / "__pycache__"
    caches.mkdir()
    (caches / "job.pyc").touch()
    monkeypatch.setattr(farm_bundle, "_ROOT", installed)
    monkeypatch.setattr(farm_bundle, "_BUILDER", installed / "tools" / "build_extension.py")
    farm_bundle.write_extension(packed)
    assert _contents(packed) == _contents(built)
    # Workers compare it with that of the plan.
    ours = job_files.versions()
    monkeypatch.setattr(sources, "_ROOT", installed)
    sources.source_digest.cache_clear()
    try:
        assert job_files.versions() == ours
    finally:
        sources.source_digest.cache_clear()


def test_a_fresh_checkout_without_a_network_says_what_is_missing(tmp_path, monkeypatch, capfd):
    root = Path(farm_bundle.__file__).resolve().parents[2]
    for name in ("blender_manifest.toml", "requirements.lock", "tools/build_extension.py"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        shutil.copy(root / name, tmp_path / name)
    builder = tmp_path / "tools" / "build_extension.py"
    monkeypatch.setattr(farm_bundle, "_BUILDER", builder)
    monkeypatch.setenv("PIP_NO_INDEX", "1")
    with pytest.raises(InputError, match=r"jerlov.*\.whl: not there.*wheels/"):
        farm_bundle.write_extension(tmp_path / "bundle.zip")
    assert capfd.readouterr() == ("", "")
    assert not (tmp_path / "bundle.zip").exists()
