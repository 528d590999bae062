"""Real time on a GPU: how fast, in how much memory, and how near to the processor's picture.

    python3 dev.py run -m benchmarks gpu_check [--reference DIR]
    python3 dev.py run -m benchmarks gpu_check --make-reference DIR

Needs this checkout, its environment and at most ten minutes, no network. The reef, the wreck, the
cave and a scene of fifty materials are built and rendered at Full HD by whatever EEVEE runs on:
the first frame, with nothing compiled yet, further frames, memory, pixels that are no numbers. A
small picture of each is compared with that of Mesa's software rasteriser, by ΔE2000.

The small pictures of the software rasteriser are made first, into DIR (out/gpu_check/reference), by
processes that Mesa is asked to draw, which takes some minutes once; where that cannot be had, make
them with ``--make-reference`` on another machine and copy DIR. On the software rasteriser itself
only the small pictures are rendered, unless there is ``--force``, and no page is written.
"""

from __future__ import annotations

import argparse
import json
import re
import resource
import shutil
import statistics
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import bpy
import gpu
import numpy as np

from ..settings.scene_settings import SceneSettings
from ..uw_spectral.errors import InputError
from ..uw_spectral.spectra.colour_rendering import delta_e_CIE2000_images
from ..uw_spectral.spectra.spectral_image import read_exr, replacing
from . import _many_materials
from ._drawing import Drawing, drawing, hang_lamps, said_by_process
from ._scenery import camera_at, example, new_file, sized
from .runner import ROOT, markdown, table

_TOOL = Path(__file__).stem
_OUT = ROOT / "out" / "gpu_check"
_SMALL, _FULL = (240, 135), (1920, 1080)
_FRAMES = 5  # of each kind that is timed; the median counts
_BANDS, _DETAIL = 6, "panel"
_TARGET = 0.1  # mean ΔE2000
_SOFTWARE = "SOFTWARE"
_LIMIT = 120  # s, of a scene
_HEADS = (
    "scene", "first frame, s", "frame of 1 sample, ms", "further sample, ms", "frames per second",
    "peak MB", "of the GPU, MB", "no numbers", "ΔE2000 mean", "95 %", "worst", "met",
)  # fmt: skip
_MESA = Path("/usr/share/glvnd/egl_vendor.d/50_mesa.json")

_SCENES: dict[str, dict[str, Any]] = {
    "reef": {"water": "jerlov:IB", "surface": "waves"},
    "wreck": {"water": "jerlov:II", "sun_zenith": 60.0},
    "cave": {"water": "jerlov:IB"},
    "materials": {"water": "jerlov:IA"},
}
_LIT = {"cave": "torch"}
"""Lamps that hang on the camera."""

_PAGE = ROOT / "docs" / "measured" / "gpu.md"
_RESULTS = re.compile(r"^(?:\*\*Not run yet|Measured on)", re.MULTILINE)
"""Where the results begin on the page; what stands before them stays."""


@dataclass(frozen=True)
class _Found:
    """What a process found out about a scene; times in s, memory in MB."""

    device: dict[str, str]
    no_numbers: int
    memory: float
    first: float
    one: float = 0.0
    many: float = 0.0
    on_gpu: float | None = None
    """Memory of the first GPU that is used, by all processes."""


def main(arguments: Sequence[str]) -> None:
    """Build, render, compare, and write the page."""
    parser = argparse.ArgumentParser(prog="gpu_check", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--reference", type=Path, default=_OUT / "reference", metavar="DIR")
    parser.add_argument("--make-reference", type=Path, metavar="DIR")
    parser.add_argument("--scenes", nargs="+", choices=list(_SCENES), default=list(_SCENES))
    parser.add_argument("--resolution", type=int, nargs=2, default=_FULL, help="of what is timed")
    parser.add_argument("--samples", type=int, default=16)
    parser.add_argument("--force", action="store_true", help="Full HD on the software rasteriser")
    parser.add_argument("--case", help="one scene as JSON, rendered in this process")
    parser.add_argument("--probe", action="store_true", help="only print what EEVEE draws with")
    options = parser.parse_args(arguments)
    if min(options.samples, *options.resolution) < 1:
        parser.error("samples and resolution must be 1 or more")
    if options.probe:
        print(json.dumps(_probe()))
        return
    if options.case:
        print(json.dumps(asdict(_render(**json.loads(options.case)))))
        return
    try:
        if options.make_reference:
            _make_reference(options.make_reference.absolute(), options)
        else:
            _check(options)
    except InputError as error:
        parser.exit(2, f"gpu_check: {error}\n")


def _make_reference(folder: Path, options: argparse.Namespace) -> None:
    """Render the small pictures on the software rasteriser."""
    folder.mkdir(parents=True, exist_ok=True)
    with replacing(folder / "reference.json") as path:
        path.write_text(json.dumps(options.samples))
    for name in options.scenes:
        picture = folder / f"{name}.exr"
        if picture.exists():
            continue
        started = time.perf_counter()
        found = _of_process(name, picture, options, full=False, software=True)
        if found.device["device"] != _SOFTWARE:
            picture.unlink()
            raise InputError(
                f"the reference was drawn by {found.device['renderer']}, not by Mesa's software "
                "rasteriser; make it with --make-reference on a machine without a GPU and copy it"
            )
        print(f"reference of {name}: {time.perf_counter() - started:.0f} s", flush=True)


def _check(options: argparse.Namespace) -> None:
    reference = options.reference.absolute()
    known = reference / "reference.json"
    if known.exists() and json.loads(known.read_text()) != options.samples:
        raise InputError(f"{reference} is of other samples; delete it, or name it")
    try:
        _make_reference(reference, options)
    except InputError as error:
        print(f"{error}\nΔE2000 is left out.", file=sys.stderr)
    device = json.loads(said_by_process(_TOOL, "--probe", timeout=_LIMIT))
    full = options.force or device["device"] != _SOFTWARE
    if not full:
        print(
            f"{device['renderer']} is a software rasteriser: only small pictures; --force for more"
        )
    rows: list[list[str]] = []
    for name in options.scenes:
        before, picture = _gpu_memory(), _OUT / f"{name}.exr"
        try:
            found = _of_process(name, picture, options, full=full)
        except InputError as error:  # the others count all the same
            print(error, file=sys.stderr)
            rows.append([name, "could not be rendered", *[""] * (len(_HEADS) - 2)])
            continue
        rows.append(_row(name, found, picture, reference / f"{name}.exr", options, before))
    body = _body(device, rows, options)
    print(f"\n{body}")
    if device["device"] != _SOFTWARE:
        head = _RESULTS.split(_PAGE.read_text(), maxsplit=1)[0]
        with replacing(_PAGE) as path:
            path.write_text(head + body)


def _row(
    name: str, found: _Found, picture: Path, reference: Path, options: argparse.Namespace,
    before: float | None,
) -> list[str]:  # fmt: skip
    apart = ["-"] * 4
    if reference.exists():
        ours, theirs = (np.clip(read_exr(path)[0], 0, 1) for path in (picture, reference))
        differs = delta_e_CIE2000_images(np.nan_to_num(ours), theirs)
        numbers = (differs.mean(), np.quantile(differs, 0.95), differs.max())
        met = "yes" if numbers[0] <= _TARGET and not found.no_numbers else "**no**"
        apart = [*(f"{value:.3f}" for value in numbers), met]
    of_gpu = "-"
    if before is not None and found.on_gpu is not None:
        of_gpu = f"{found.on_gpu - before:.0f}"
    times = ["-"] * 3
    if found.many:
        sample = 1e3 * (found.many - found.one) / options.samples
        times = [f"{1e3 * found.one:.1f}", f"{sample:.2f}", f"{1 / found.many:.1f}"]
    return [name, f"{found.first:.1f}", *times, f"{found.memory:.0f}", of_gpu,
            str(found.no_numbers), *apart]  # fmt: skip


def _body(device: dict[str, str], rows: Sequence[list[str]], options: argparse.Namespace) -> str:
    named = ", ".join(f"{word} {value}" for word, value in device.items())
    width, height = options.resolution
    return f"""Measured on: {named}. {_BANDS} bands, {options.samples} samples,
{width} × {height} for times and {_SMALL[0]} × {_SMALL[1]} for ΔE2000,
whose mean shall be {_TARGET} or less; scenes in detail *{_DETAIL}*. A further frame is rendered,
but not written: with 1 sample, and with {1 + options.samples} for the frames per second.
The first frame begins with nothing compiled.

{markdown(table(_HEADS, rows))}
"""


def _of_process(
    name: str, picture: Path, options: argparse.Namespace, *, full: bool, software: bool = False
) -> _Found:
    """Render a scene in a process of its own, with nothing compiled."""
    picture.parent.mkdir(parents=True, exist_ok=True)
    case = {
        "name": name, "blend": str(_scene(name)), "picture": str(picture),
        "samples": options.samples, "size": list(options.resolution) if full else None,
    }  # fmt: skip
    limit = None if options.force or software else _LIMIT
    environment = {}
    if software:
        environment = {"LIBGL_ALWAYS_SOFTWARE": "1", "GALLIUM_DRIVER": "llvmpipe"}
        if _MESA.exists():
            environment["__EGL_VENDOR_LIBRARY_FILENAMES"] = str(_MESA)
    try:
        said = said_by_process(_TOOL, "--case", json.dumps(case), timeout=limit, **environment)
    except subprocess.TimeoutExpired:
        raise InputError(f"{name} took more than {_LIMIT} s; try --scenes, --samples") from None
    return _Found(**json.loads(said))


def _scene(name: str) -> Path:
    """Return the .blend of a scene; it is built if it is not there."""
    blend = _OUT / "scenes" / f"{name}-{_DETAIL}.blend"
    if name != "materials":
        return example(blend, name, _DETAIL)
    if not blend.exists():
        blend.parent.mkdir(parents=True, exist_ok=True)
        new_file()
        _many_materials.build()
        bpy.ops.wm.save_as_mainfile(filepath=str(blend), compress=True)
    return blend


def _render(name: str, blend: str, picture: str, samples: int, size: list[int] | None) -> _Found:
    """Render a scene in this process: times at a size if one is given, and the small picture."""
    bpy.ops.wm.open_mainfile(filepath=blend, load_ui=False, use_scripts=False)
    if name in _LIT:
        hang_lamps(_LIT[name])
    settings = SceneSettings(bands=_BANDS, samples=1, **_SCENES[name])
    path, times, no_numbers = Path(picture), (0.0, 0.0), 0
    sized(size or _SMALL)
    with drawing(settings) as drawn:
        first = drawn.seconds(1, time.perf_counter)
        if size:
            no_numbers += _no_numbers(drawn.path)
            times = _median(drawn, 1), _median(drawn, 1 + samples)
            sized(_SMALL)
        drawn.picture(samples, path)
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    no_numbers += _no_numbers(path)
    one, many = times
    return _Found(_device(), no_numbers, memory, first, one, many, _gpu_memory())


def _probe() -> dict[str, str]:
    """Draw next to nothing, and return what has drawn it."""
    new_file((16, 16))
    camera_at((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 1.0)
    with drawing(None) as drawn:
        drawn.again(1)
    return _device()


def _median(drawn: Drawing, samples: int) -> float:
    """Seconds of a frame that is rendered and not written."""
    times = []
    for _ in range(_FRAMES):
        start = time.perf_counter()
        drawn.again(samples)
        times.append(time.perf_counter() - start)
    return statistics.median(times)


def _no_numbers(path: Path) -> int:
    return int((~np.isfinite(read_exr(path)[0])).any(axis=-1).sum())


def _device() -> dict[str, str]:
    """Return what EEVEE has drawn with; known once it has."""
    names = {"renderer": "renderer", "vendor": "vendor", "driver": "version",
             "backend": "backend_type", "device": "device_type"}  # fmt: skip
    return {word: getattr(gpu.platform, f"{name}_get")() for word, name in names.items()}


def _gpu_memory() -> float | None:
    """Memory in MB that is used on the first GPU, where NVIDIA's tool tells it."""
    tool = shutil.which("nvidia-smi")
    if tool is None:
        return None
    command = [tool, "--query-gpu=memory.used", "--format=csv,noheader,nounits", "--id=0"]
    done = subprocess.run(command, capture_output=True, text=True)
    return float(done.stdout) if done.returncode == 0 and done.stdout.strip() else None
