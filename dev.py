#!/usr/bin/env python3
"""Set up this checkout and run its jobs. Needs only python3 (3.9 or later) and git.

    python3 dev.py example          render the example reef to out/example/
    python3 dev.py test [ARGS]      run the tests; ARGS go to pytest
    python3 dev.py check            lint, format, unused code, words and types
    python3 dev.py build            build and validate dist/underwater_spectral-*.zip;
                                    --manual writes its sizes into docs/listing/review.md
    python3 dev.py build --wheel    build the wheel of optics and data sets into dist/, and try it
                                    in a new environment; --python python3.11: in one of that
    python3 dev.py run FILE [ARGS]  run a script in the project's environment
    python3 dev.py measure [PAGE]   measure pages of docs/measured again, by default all; --stale
                                    lists those whose code or data changed
    python3 dev.py site             build the documentation site into out/site/; --check only
                                    reads it, and ends with what is wrong
    python3 dev.py lock [-U]        write requirements.lock and docs.lock from pyproject.toml;
                                    -U: with the latest versions, else with those that are there

Each does all set-up itself: uv, Python 3.13, the packages of requirements.lock
with their hashes, and the system libraries that Blender needs.
"""

from __future__ import annotations

import ctypes.util
import hashlib
import os
import shutil
import subprocess
import sys
from contextlib import ExitStack
from pathlib import Path

ROOT = Path(__file__).resolve().parent
VENV = ROOT / ".venv"
BOOTSTRAP = ROOT / ".venv-bootstrap"
LOCK = ROOT / "requirements.lock"
DOCS_VENV, DOCS_LOCK = ROOT / ".venv-docs", ROOT / "docs.lock"

# Shared library → Debian package. EGL and GL are opened at run time, so ldd cannot see them.
DEBIAN_PACKAGES = {
    "libEGL.so.1": "libegl1",
    "libGL.so.1": "libgl1",
    "libICE.so.6": "libice6",
    "libSM.so.6": "libsm6",
    "libX11.so.6": "libx11-6",
    "libXfixes.so.3": "libxfixes3",
    "libXi.so.6": "libxi6",
    "libXrender.so.1": "libxrender1",
    "libXxf86vm.so.1": "libxxf86vm1",
    "libxkbcommon.so.0": "libxkbcommon0",
}
OPENED_AT_RUN_TIME = {"libEGL.so.1": "EGL", "libGL.so.1": "GL"}
SOFTWARE_RASTERISER = "libgl1-mesa-dri"

EXAMPLE_OPTIONS = [
    *("--water", "jerlov:IB", "--bands", "9", "--sensor", "ARRI D21"),
    *("--illuminant", "clear-sky", "--irradiance", "above"),
    *("--sun-zenith", "30", "--sun-azimuth", "60"),
    *("--surface", "flat", "--floor-depth", "7", "--floor-reflectance", "0.3"),
    *("--white-balance", "depth", "--resolution", "480", "270", "--samples", "32"),
]


def stop(message: str) -> None:
    """End with a message."""
    sys.exit(f"dev.py: {message}")


def run(*command: str | Path, env: dict[str, str] | None = None) -> None:
    """Run a command in the checkout; end with its status if it fails."""
    status = subprocess.call([str(part) for part in command], cwd=ROOT, env=env)
    if status:
        sys.exit(status)


def apt_install(packages: list[str]) -> None:
    """Install Debian packages as root or through sudo, or say how."""
    advice = f"apt-get install -y {' '.join(packages)}"
    if not shutil.which("apt-get"):
        stop(f"system packages are missing; on Debian: {advice} (elsewhere: their like)")
    if os.geteuid() == 0:
        prefix = []
    elif shutil.which("sudo") and subprocess.call(["sudo", "-n", "true"]) == 0:
        prefix = ["sudo", "-n"]
    else:
        stop(f"system packages are missing; run as root: {advice}")
    run(*prefix, "apt-get", "update", "-q")
    run(*prefix, "apt-get", "install", "-y", "-q", "--no-install-recommends", *packages)


def find_uv() -> Path:
    """Return uv: the one on the path that works, else one installed here."""
    found = shutil.which("uv")
    if found and subprocess.run([found, "--version"], capture_output=True).returncode == 0:
        return Path(found)
    own = BOOTSTRAP / "bin" / "uv"
    if not own.exists():
        command = [sys.executable, "-m", "venv", str(BOOTSTRAP)]
        if subprocess.run(command, capture_output=True).returncode != 0:
            shutil.rmtree(BOOTSTRAP, ignore_errors=True)
            apt_install(["python3-venv"])
            run(*command)
        run(BOOTSTRAP / "bin" / "python", "-m", "pip", "install", "-q", "uv")
    return own


def missing_libraries() -> list[str]:
    """Return the shared libraries that the bpy module needs and the system lacks."""
    module = next(VENV.glob("lib/python*/site-packages/bpy/__init__*.so"), None)
    if module is None or not shutil.which("ldd"):
        return []
    listing = subprocess.run(["ldd", str(module)], capture_output=True, text=True).stdout
    missing = [line.split()[0] for line in listing.splitlines() if "not found" in line]
    missing += [
        name
        for name, short in OPENED_AT_RUN_TIME.items()
        if name not in missing and ctypes.util.find_library(short) is None
    ]
    return missing


def environment(folder: Path, lock: Path) -> Path:
    """Make an environment match a lock file; return its Python."""
    python = folder / "bin" / "python"
    stamp = folder / "requirements.sha256"
    wanted = hashlib.sha256(lock.read_bytes()).hexdigest()
    if not (python.exists() and stamp.exists() and stamp.read_text() == wanted):
        uv = find_uv()
        if not python.exists():
            known = VENV / "bin" / "python"  # of the other environment, if that is there
            base = str(known) if known.exists() else "3.13"
            command = [str(uv), "venv", "-q", "--python", base, str(folder)]
            if subprocess.call(command, cwd=ROOT):
                stop("Python 3.13 is needed and uv could not get it; install it and try again")
        sync = (uv, "pip", "sync", "-q", "--require-hashes", "--compile-bytecode")
        run(*sync, "--python", python, lock)
        stamp.write_text(wanted)
    return python


def set_up() -> Path:
    """Ready the environment of the tests and the libraries of Blender; return its Python."""
    python = environment(VENV, LOCK)
    missing = missing_libraries()
    if missing:
        unknown = [name for name in missing if name not in DEBIAN_PACKAGES]
        if unknown:
            stop(f"Blender needs system libraries that are missing: {', '.join(unknown)}")
        apt_install(sorted({DEBIAN_PACKAGES[name] for name in missing} | {SOFTWARE_RASTERISER}))
    return python


def example(python: Path) -> None:
    """Build the reef and render it."""
    scene = ROOT / "out" / "reef.blend"
    if not scene.exists():
        run(python, "examples/build_scene.py", "reef", scene)
    folder = ROOT / "out" / "example"
    run(python, "render_bands.py", scene, *EXAMPLE_OPTIONS, "--resume", "--out", folder)
    print(f"picture: {(folder / '0001.png').relative_to(ROOT)}")


def check(python: Path) -> None:
    """Check types in two processes, and the rest beside them; end with what fails."""
    types = [python, "-m", "basedpyright", "--level", "error"]
    with ExitStack() as ended:
        running = []
        # All of it, whose warnings are modules that only Blender has; and what the wheel holds, as
        # its oldest Python has it.
        for part in ([], ["--pythonversion", "3.11", "uw_spectral", "datasets"]):
            command = list(map(str, [*types, *part]))
            running.append(subprocess.Popen(command, cwd=ROOT))
            ended.callback(running[-1].kill)
        run(python, "-m", "ruff", "check", ".")
        run(python, "-m", "ruff", "format", "--check", ".")
        run(python, "tools/unused_code.py")
        run(python, "tools/words.py")
        for process in running:
            if process.wait():
                sys.exit(process.returncode)


def main() -> None:
    """Run the job named on the command line."""
    job, *arguments = sys.argv[1:] or ["help"]
    if job == "lock":
        command = [find_uv(), "pip", "compile", "-q", "--python-version", "3.13"]
        command += ["--generate-hashes", "--no-header", "--no-annotate", *arguments]
        run(*command, "pyproject.toml", "--all-extras", "--group", "dev", "-o", LOCK)
        run(*command, "--group", "docs", "-o", DOCS_LOCK)
    elif job == "example":
        example(set_up())
    elif job == "test":
        # Two at a time: most of a test is one thread, compiling shaders above all.
        run(set_up(), "-m", "pytest", "-n", "2", "--dist", "loadfile", "--costs", *arguments)
    elif job == "check":
        check(set_up())
    elif job == "build":
        tool = "build_wheel.py" if "--wheel" in arguments else "build_extension.py"
        run(set_up(), f"tools/{tool}", *arguments)
    elif job == "site":
        run(environment(DOCS_VENV, DOCS_LOCK), "tools/build_site.py", *arguments)
    elif job == "measure":
        run(set_up(), "-m", "benchmarks", "measure", *arguments)
    elif job == "run" and arguments:
        run(set_up(), *arguments)
    else:
        print(__doc__)
        sys.exit(0 if job in {"help", "-h", "--help"} else 2)


if __name__ == "__main__":
    main()
