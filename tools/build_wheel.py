"""Build the wheel of optics and data sets, and try it as its users get it.

python3 dev.py build --wheel                      into dist/, and again to compare the bytes; then
                                                  installs it by pip in a new environment
python3 dev.py build --wheel --python python3.11  in an environment of that Python, or of several
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
TRIAL = ROOT / "tools" / "try_wheel.py"


def build(destination: Path) -> Path:
    """Build the wheel into a folder and return its path."""
    command = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(destination)]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    return max(destination.glob("*.whl"), key=lambda path: path.stat().st_mtime)


def build_twice(destination: Path) -> Path:
    """Build the wheel, and again; return its path.

    Raises
    ------
    ValueError
        If the two differ.
    """
    wheel = build(destination)
    with tempfile.TemporaryDirectory() as folder:
        if build(Path(folder)).read_bytes() != wheel.read_bytes():
            raise ValueError(f"{wheel.name} has other bytes when it is built again")
    return wheel


def try_in_new_environment(wheel: Path, python: str) -> str:
    """Install a wheel by pip into an environment of its own, and try it there.

    Parameters
    ----------
    wheel : Path
    python : str
        The Python that makes the environment.

    Returns
    -------
    str
        What was tried, and how long it took.
    """
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([python, "-m", "venv", folder], check=True)
        inside = str(Path(folder, "bin", "python"))
        start = time.perf_counter()
        subprocess.run([inside, "-m", "pip", "install", "-q", str(wheel)], check=True)
        took = time.perf_counter() - start
        # -I: neither the checkout nor anything of the user's.
        command = [inside, "-I", str(TRIAL)]
        found = subprocess.run(command, cwd=folder, check=True, stdout=subprocess.PIPE, text=True)
        return f"installed in {took:.1f} s\n{found.stdout}"


def main(arguments: Sequence[str]) -> None:
    """Build, and try in each Python."""
    parser = argparse.ArgumentParser(prog="dev.py build")
    parser.add_argument("--wheel", action="store_true", required=True)
    parser.add_argument("--python", action="append", metavar="EXE")
    pythons = parser.parse_args(arguments).python or [sys.executable]
    wheel = build_twice(ROOT / "dist")
    size = wheel.stat().st_size / 1e3
    sys.stdout.write(f"{wheel.relative_to(ROOT)}: {size:.0f} kB, the same bytes twice\n")
    for python in pythons:
        sys.stdout.write(try_in_new_environment(wheel, python))


if __name__ == "__main__":
    main(sys.argv[1:])
