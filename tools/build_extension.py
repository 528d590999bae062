"""Build and validate the extension's zip with Blender's own command.

python3 dev.py build            into dist/; prints the table of sizes
python3 dev.py build --manual   and writes the table into docs/listing/review.md
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
import tomllib
import zipfile
from pathlib import Path

import bpy

ROOT = Path(__file__).resolve().parent.parent
MANUAL = ROOT / "docs" / "listing" / "review.md"
_TABLE = re.compile(r"(?<=\n)\| part \| kB in the zip .*?(?=\n\n)", re.DOTALL)


def blender_command() -> Path:
    """Return the script behind ``blender --command extension`` in the bpy module."""
    scripts = Path(bpy.utils.resource_path("LOCAL")) / "scripts"
    return scripts / "addons_core" / "bl_pkg" / "cli" / "blender_ext.py"


def locked(names: list[str]) -> str:
    """Return the lines of requirements.lock, hashes included, for these packages."""
    text = (ROOT / "requirements.lock").read_text()
    entries = {
        re.split(r"==", entry, maxsplit=1)[0]: entry
        for entry in re.split(r"\n(?=\S)", text.strip())
    }
    return "\n".join(entries[name] for name in names) + "\n"


def fetch_wheels() -> None:
    """Download the wheels that the manifest lists and that are not here yet.

    Raises
    ------
    ConnectionError
        If that fails.
    """
    manifest = tomllib.loads((ROOT / "blender_manifest.toml").read_text())
    missing = [Path(wheel) for wheel in manifest["wheels"] if not (ROOT / wheel).exists()]
    if not missing:
        return
    names = [wheel.name.split("-", maxsplit=1)[0].replace("_", "-") for wheel in missing]
    with tempfile.TemporaryDirectory(dir=ROOT, prefix=".wheels-") as folder:
        requirements = Path(folder) / "requirements.txt"
        requirements.write_text(locked(names))
        command = [sys.executable, "-m", "pip", "download", "-q", "--no-deps", "--require-hashes"]
        command += ["--only-binary=:all:", "-r", str(requirements), "-d", folder]
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode:
            said = (done.stderr or done.stdout).strip().splitlines() or ["pip says nothing"]
            raise ConnectionError(
                f"{', '.join(wheel.name for wheel in missing)}: not there, and could not be "
                f"downloaded: {said[-1]}; build once with a network, or put them into wheels/"
            )
        # Whole under their names, or not at all: another process may be building too.
        for wheel in missing:
            (ROOT / wheel).parent.mkdir(exist_ok=True)
            Path(folder, wheel.name).replace(ROOT / wheel)


def make_assets() -> None:
    """Build the asset library, unless it is younger than all that it is made of."""
    library = ROOT / "assets" / "underwater_spectral.blend"
    folders = (
        "data", "jobs", "node_groups", "presets", "quality", "scene", "settings", "ui",
        "uw_spectral",
    )  # fmt: skip
    sources = [path for name in folders for path in (ROOT / name).rglob("*") if path.is_file()]
    script = ROOT / "tools" / "build_assets.py"
    latest = max(
        path.stat().st_mtime for path in (*sources, script) if "__pycache__" not in path.parts
    )
    if not library.exists() or library.stat().st_mtime < latest:
        subprocess.run([sys.executable, str(script)], check=True)


def build(destination: Path) -> Path:
    """Build the zip into a folder and return its path."""
    make_assets()
    destination.mkdir(parents=True, exist_ok=True)
    manifest = tomllib.loads((ROOT / "blender_manifest.toml").read_text())
    built = destination / f"{manifest['id']}-{manifest['version']}.zip"
    pack(built)
    _command("validate", str(built))
    return built


def pack(path: Path) -> None:
    """Write the zip from what is here; the asset library goes along if it was built."""
    fetch_wheels()
    _command("build", "--source-dir", str(ROOT), "--output-filepath", str(path))
    _settle(path)


def _settle(path: Path) -> None:
    """Write a zip again so that the same files give the same bytes, whenever and wherever."""
    with zipfile.ZipFile(path) as archive:
        files = {name: archive.read(name) for name in sorted(archive.namelist())}
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            entry = zipfile.ZipInfo(name)  # of 1980
            entry.compress_type, entry.external_attr = zipfile.ZIP_DEFLATED, 0o644 << 16
            if not name.endswith("/"):
                archive.writestr(entry, content)


def _command(*arguments: str) -> None:
    subprocess.run([sys.executable, str(blender_command()), *arguments], check=True)


def size_table(built: Path) -> str:
    """Return the sizes in a zip by its parts, largest first, as a Markdown table."""
    packed: dict[str, list[int]] = {}
    with zipfile.ZipFile(built) as archive:
        for item in archive.infolist():
            first, _, rest = item.filename.partition("/")
            part = rest if first == "wheels" else f"{first}/" if rest else "files at the top"
            entry = packed.setdefault(part, [0, 0])
            entry[0] += item.compress_size
            entry[1] += 1
    rows = sorted(packed.items(), key=lambda row: -row[1][0])
    total = sum(size for size, _ in packed.values())
    lines = ["| part | kB in the zip | files |", "|---|---|---|"]
    lines += [f"| {part} | {size / 1e3:.0f} | {count} |" for part, (size, count) in rows]
    lines.append(f"| **all** | **{total / 1e3:.0f}** | |")
    return "\n".join(lines)


def write_manual(table: str, manual: Path = MANUAL) -> None:
    """Put a table of :func:`size_table` in the place of the manual's."""
    text, found = _TABLE.subn(lambda _: table, manual.read_text(encoding="utf-8"))
    if found != 1:
        raise ValueError(f"{manual} holds {found} tables of sizes; it should hold one")
    manual.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    try:
        sizes = size_table(build(ROOT / "dist"))
    except ConnectionError as error:
        sys.exit(str(error))
    sys.stdout.write(sizes + "\n")
    if "--manual" in sys.argv[1:]:
        write_manual(sizes)
