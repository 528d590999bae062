"""Pictures of twelve scenes, to show that a change of the code changes none of them.

    python3 dev.py run -m benchmarks frozen out/before            render the pictures
    python3 dev.py run -m benchmarks frozen out/now --against out/before

Each case is rendered by a process of its own through ``render_bands.py``, in both modes of EEVEE.
The scenes are built once and kept in OUT/scenes, so that two checkouts can draw the same ones
(``--scenes out/before/scenes``). ``--against`` prints ΔE2000 between the two, mean, 95 % and worst
pixel: what changed, where two runs of one checkout give 0.
"""

from __future__ import annotations

import argparse
import itertools
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np

from ..uw_spectral.spectra.colour_rendering import delta_e_CIE2000_images
from ..uw_spectral.spectra.spectral_image import read_exr
from . import materials
from ._material_kinds import KINDS
from ._scenery import example, ground, look_at
from .runner import ROOT, markdown, table

_SIZE = (96, 54)
_MODES = ("realtime", "bands")
_MATERIALS = (
    "diffuse", "principled, dark", "plastic .1", "metallic .3", "coat", "glass, rough",
    "emission, principled", "alpha .5",
)  # fmt: skip
_HEIGHTS = {"balls": -4.0, "above": 1.5}
_PROFILE = """depth_m,wavelength_nm,a,b
0,400,0.06,0.25
0,700,0.62,0.20
5,400,0.20,0.60
5,700,0.75,0.50
12,400,0.05,0.15
12,700,0.61,0.12
"""


@dataclass(frozen=True)
class _Case:
    """A picture: its scene, and options of ``render_bands.py``."""

    name: str
    scene: str
    options: str


_CASES = (
    _Case("reef", "reef", "--water jerlov:IB --surface flat --sky clear"),
    _Case("reef_waves", "reef", "--water jerlov:IA --surface waves --wind 5 --shafts"),
    _Case("wreck", "wreck", "--water jerlov:II --surface flat --sun-zenith 60 --sky clear"),
    _Case("cave", "cave", "--water jerlov:IB --surface flat --sky clear"),
    _Case("pool", "pool", "--water jerlov:I --surface waves --wind 3 --floor-depth 0"),
    _Case("cube", "cube", "--water jerlov:1C --surface flat"),
    _Case("balls", "balls", "--water jerlov:IB --surface flat --sky clear"),
    _Case("balls_turbid", "balls", "--water jerlov:5C --surface flat --sky overcast"),
    _Case("balls_layers", "balls", "--water file:PROFILE --surface flat"),
    _Case("balls_glow", "balls", "--water constituents --chlorophyll 5 --inelastic all"),
    _Case("reef_night", "torch", "--water jerlov:IB --sunlight 0 --exposure 5"),
    _Case("from_above", "above", "--water jerlov:IA --surface flat --sky clear"),
)


def main(arguments: list[str]) -> None:
    """Render what is not there yet, and compare."""
    options = argparse.ArgumentParser(prog="frozen", description=__doc__.splitlines()[0])
    options.add_argument("out", type=Path)
    options.add_argument("--against", type=Path)
    options.add_argument("--scenes", type=Path, help="default: OUT/scenes")
    options.add_argument("--cases", default="", help="names, with commas; default: all")
    chosen = options.parse_args(arguments)
    scenes = (chosen.scenes or chosen.out / "scenes").absolute()
    wanted = set(chosen.cases.split(",")) - {""}
    cases = [case for case in _CASES if case.name in (wanted or {c.name for c in _CASES})]
    for case, mode in itertools.product(cases, _MODES):
        _render(case, mode, scenes, chosen.out.absolute() / case.name / mode)
    if chosen.against is not None:
        _compare(cases, chosen.out, chosen.against)


def _render(case: _Case, mode: str, scenes: Path, out: Path) -> None:
    blend, profile = scenes / f"{case.scene}.blend", scenes / "profile.csv"
    if not blend.exists():
        scenes.mkdir(parents=True, exist_ok=True)
        profile.write_text(_PROFILE)
        _built(case.scene, blend)
    if (out / "0001.json").exists():
        return
    started = time.perf_counter()
    command = [sys.executable, ROOT / "render_bands.py", blend, "--engine", "eevee"]
    command += [word.replace("PROFILE", str(profile)) for word in case.options.split()]
    command += ["--mode", mode, "--bands", "6", "--samples", "4", "--out", out]
    command += ["--resolution", *map(str, _SIZE)]
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{case.name}, {mode}: {done.stderr.strip().splitlines()[-1]}")
    print(f"{case.name}, {mode}: {time.perf_counter() - started:.0f} s", flush=True)


def _compare(cases: list[_Case], now: Path, before: Path) -> None:
    rows, means, most = [], [], []
    for case, mode in itertools.product(cases, _MODES):
        one, other = (read_exr(at / case.name / mode / "0001.exr")[0] for at in (now, before))
        apart = delta_e_CIE2000_images(np.clip(one, 0, 1), np.clip(other, 0, 1))
        means.append(float(apart.mean()))
        most.append(float(np.quantile(apart, 0.95)))
        numbers = (means[-1], most[-1], float(apart.max()), float(one.mean() / other.mean()))
        rows.append([case.name, mode, *(f"{x:.3f}" for x in numbers)])
    heads = ("case", "mode", "ΔE2000 mean", "95 %", "worst", "brightness")
    print(markdown(table(heads, rows)))
    print(f"mean of all {np.mean(means):.3f}, largest 95 % {max(most):.3f}")


def _built(scene: str, blend: Path) -> None:
    if scene == "cube":
        _cube(blend)
    elif scene in _HEIGHTS:
        _balls(blend, _HEIGHTS[scene])
    elif scene == "torch":
        example(blend, "reef", "draft", "--lamps", "torch")
    else:
        example(blend, scene, "draft")


def _cube(blend: Path) -> None:
    bpy.ops.wm.read_factory_settings()
    for item in bpy.context.scene.objects:
        item.location.z -= 9.0
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))


def _balls(blend: Path, height: float) -> None:
    """A row of eight materials on sand, seen from a height."""
    kinds = [kind for kind in KINDS if kind.name in _MATERIALS]
    items, _ = materials.build(kinds)
    ground(-7.0, (0.5, 0.45, 0.35), 60.0)
    look_at((0.0, -6.5, height), items[1].location)
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
