"""Kinds of materials and objects under water: EEVEE against converged Cycles, kind by kind.

    python3 dev.py run -m benchmarks materials OUT [--only NAME ...] [--samples N] [--modes ...]

Twelve things stand on sand in each picture. Cycles' pictures are rendered with two seeds and kept
in OUT; they are rendered anew only where they are missing. A kind's colour difference is the mean
CIE2000 over blocks of pixels that lie within it, its noise that of Cycles' halves.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix, Vector
from mathutils.bvhtree import BVHTree
from numpy.typing import NDArray

from ..scene.engines import eevee_engine
from ..scene.water import water_body
from ..settings import render_plan
from ..settings.scene_settings import SceneSettings
from ..uw_spectral.spectra.colour_rendering import delta_e_CIE2000_images, luminance
from ..uw_spectral.spectra.spectral_image import read_exr, replacing, write_jpeg, write_png
from . import grey_scene
from ._drawing import drawing
from ._material_kinds import KINDS, RADIUS, Kind, place

_COLUMNS, _ROWS, _PITCH = 4, 3, 1.15
_WIDTH, _HEIGHT, _BLOCK = 336, 216, 3
_FLOOR, _DEPTH, _AWAY = 7.0, 4.2, 4.4
_SHRUNK = 0.9  # of a ball that stands for what has no faces
_EEVEE_SAMPLES = 32
_CLOSE = 2.5  # ΔE of kinds that are only named
_MODES = {"realtime": "Real-time", "bands": "Bands"}
_PAGE = Path(__file__).parent.parent / "docs" / "measured" / "materials.md"
_TEXT = """# Materials and objects

Sixty-five kinds of what users give things on sand at 7 m in Jerlov IB, sun at 30°, six bands:
EEVEE against Cycles with 2 × 128 samples. Mean ΔE2000 of blocks of 3 × 3 pixels within a kind,
what 95 % stay below, EEVEE over Cycles in luminance.

Of kinds that are drawn: {summaries}. Targets are mean 2, 95 % 6, worst 12.
{close} kinds are at most at {limit:g}; the others:

`python3 dev.py run -m benchmarks materials out/materials` renders what is missing and writes
this page.

![EEVEE above, Cycles below](materials.jpg)

| kind | {head} |
{rule}
{table}

## What differs
- EEVEE draws sharp reflections of the water only; balls of glass are no lenses.
- Translucent bodies are lit by half of what falls on either side; hair keeps no light from other
  hair and is half again too bright.
- Clear coloured things show the mean of the channels behind them in the colour of open water.
- Volumes in things are left out of EEVEE's modes, and log, record and panel name them.
"""


@dataclass(frozen=True)
class Row:
    """What was found of a kind in a mode.

    ``delta_e`` is the mean over blocks, ``worst`` the value that 95 % of them stay below, ``noise``
    the mean that the reference's noise makes, ``ratio`` EEVEE over Cycles in luminance.
    """

    kind: Kind
    mode: str
    delta_e: float
    worst: float
    noise: float
    ratio: float

    @property
    def cells(self) -> str:
        """Columns of the page."""
        return f"{self.delta_e:.1f} | {self.worst:.1f} | {self.ratio:.2f}"

    def __str__(self) -> str:
        return (
            f"{self.kind.name:24s} {self.mode:8s} dE {self.delta_e:5.2f}, 95 % {self.worst:5.2f}, "
            f"noise {self.noise:4.2f}, x {self.ratio:.2f}"
        )


def main(arguments: Sequence[str]) -> None:
    """Render, compare and print; write docs/measured/materials.md of all kinds."""
    parser = argparse.ArgumentParser(prog="materials", description=__doc__)
    parser.add_argument("out", type=Path)
    parser.add_argument("--only", nargs="+", default=[], help="names of kinds; nothing is written")
    parser.add_argument("--samples", type=int, default=128, help="of Cycles, each of two times")
    parser.add_argument("--modes", nargs="+", default=["realtime"], choices=list(_MODES))
    parser.add_argument("--reference", action="store_true", help="only render what is missing")
    options = parser.parse_args(arguments)
    size, rows, pairs = _COLUMNS * _ROWS, [], []
    for first in range(0, len(KINDS), size):
        kinds = KINDS[first : first + size]
        if options.only and not any(kind.name in options.only for kind in kinds):
            continue
        number = first // size
        halves = _reference(options.out / f"cycles_{number}.npz", kinds, options.samples)
        for mode in () if options.reference else options.modes:
            picture = _eevee(kinds, mode)
            pair = np.concatenate([picture, halves.mean(axis=0)]).astype(np.float32)
            write_png(options.out / f"{mode}_{number}.png", pair)
            pairs += [pair] if mode == options.modes[0] else []
            found = _compared(kinds, mode, picture, halves)
            rows += [row for row in found if not options.only or row.kind.name in options.only]
            print(*found, sep="\n", flush=True)
    for mode in options.modes if rows else ():
        print(f"{mode}: {_summary(rows, mode)}")
    if rows and not options.only:
        _write(rows, options.modes, pairs)


def _summary(rows: Sequence[Row], mode: str) -> str:
    means = np.array([row.delta_e for row in rows if row.mode == mode and not row.kind.left_out])
    if not len(means):
        return "no kind that is drawn"
    return (
        f"{len(means)} kinds, mean {means.mean():.2f}, 95 % {np.percentile(means, 95):.2f}, "
        f"worst {means.max():.2f}"
    )


def _write(rows: Sequence[Row], modes: Sequence[str], pairs: Sequence[NDArray[np.float32]]) -> None:
    """Write the page of the documentation, and its pictures side by side."""
    by_kind: dict[str, dict[str, Row]] = {}
    for row in rows:
        by_kind.setdefault(row.kind.name, {})[row.mode] = row
    lines, close = [], []
    for name, found in by_kind.items():
        if all(row.delta_e <= _CLOSE for row in found.values()):
            close.append(name)
            continue
        one, cells = found[modes[0]], " | ".join(found[mode].cells for mode in modes)
        said = ", left out" if one.kind.left_out else ""
        lines.append(f"| {name}{said} | {cells} |")
    table = "\n".join(lines)
    summaries = "; ".join(f"{_MODES[mode]}: {_summary(rows, mode)}" for mode in modes)
    head = " | ".join(f"{_MODES[mode]} | 95 % | ×" for mode in modes)
    rule = "|---" * (3 * len(modes) + 1) + "|"
    with replacing(_PAGE) as temporary:
        temporary.write_text(
            _TEXT.format(
                table=table,
                summaries=summaries,
                head=head,
                rule=rule,
                limit=_CLOSE,
                close=len(close),
            ),
            encoding="utf-8",
        )
    sheet = np.concatenate(list(pairs), axis=1)
    sheet = grey_scene.blocks(sheet.astype(np.float64), 2)
    write_jpeg(_PAGE.with_suffix(".jpg"), sheet.astype(np.float32))


def settings(samples: int = 64) -> SceneSettings:
    """Return the water of all pictures, over sand.

    Its phase function is the same in all bands, so that those of Cycles share passes.
    """
    return SceneSettings(
        water="jerlov:IB",
        phase="hg:0.85", bands=6, band_placement="optimised", sun_zenith=30.0, sun_azimuth=60.0,
        surface="flat", illuminant="clear-sky", floor_depth=_FLOOR, floor_reflectance="0.3",
        samples=samples, exposure="auto",
    )  # fmt: skip


def build(kinds: Sequence[Kind]) -> tuple[list[bpy.types.Object], list[Vector]]:
    """Fill an empty file with things of some kinds, and a camera; return them and their places."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    scene = bpy.context.scene
    items, places = [], []
    for index, kind in enumerate(kinds):
        row, column = divmod(index, _COLUMNS)
        x = (column - (_COLUMNS - 1) / 2.0) * _PITCH
        where = Vector((x, row * _PITCH, -_FLOOR + RADIUS + 0.02))
        items.append(place(kind, where))
        places.append(where)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    middle = Vector((0.0, (_ROWS - 1) / 2.0 * _PITCH, -_FLOOR + 0.5 * RADIUS))
    camera.location = (0.0, -_AWAY, -_DEPTH)
    camera.rotation_euler = (middle - camera.location).to_track_quat("-Z", "Y").to_euler()
    camera.data.lens = 42.0
    scene.collection.objects.link(camera)
    scene.camera = camera
    render = scene.render
    render.resolution_x, render.resolution_y, render.resolution_percentage = _WIDTH, _HEIGHT, 100
    scene.cycles.pixel_filter_type = "BOX"
    bpy.context.view_layer.update()
    return items, places


def _reference(path: Path, kinds: Sequence[Kind], samples: int) -> NDArray[np.float64]:
    """Return Cycles' pictures with two seeds, shape (2, h, w, 3)."""
    if path.exists():
        with np.load(path) as kept:
            return kept["halves"]
    path.parent.mkdir(parents=True, exist_ok=True)
    build(kinds)
    camera = bpy.context.scene.camera
    plan = render_plan.make_plan(settings(samples))
    develop = plan.reduction(_DEPTH).apply
    halves = [develop(grey_scene.cycles_image(plan, camera, samples, seed)) for seed in (1, 2)]
    with replacing(path) as temporary, temporary.open("wb") as file:
        np.savez_compressed(file, halves=np.stack(halves))
    return np.stack(halves)


def _eevee(kinds: Sequence[Kind], mode: str) -> NDArray[np.float64]:
    build(kinds)
    chosen = settings(_EEVEE_SAMPLES)
    plan = render_plan.make_plan(chosen)
    if mode == "bands":
        camera = bpy.context.scene.camera
        extent = water_body.water_extent(bpy.context.scene, plan.column, _DEPTH)
        with eevee_engine.eevee_bands(bpy.context.scene, camera, plan, extent, _DEPTH) as engine:
            for note in engine.notes:
                print("  note:", note)
            return plan.reduction(_DEPTH).apply(grey_scene.band_image(engine, plan, _DEPTH))
    with tempfile.TemporaryDirectory() as folder, drawing(chosen) as drawn:
        for note in drawn.notes:
            print("  note:", note)
        drawn.picture(Path(folder, "a.exr"), _EEVEE_SAMPLES)
        return read_exr(Path(folder, "a.exr"))[0].astype(np.float64)


def _compared(
    kinds: Sequence[Kind], mode: str, picture: NDArray[np.float64], halves: NDArray[np.float64]
) -> list[Row]:
    items, places = build(kinds)
    masks = _masks(items, places)
    reference = halves.mean(axis=0)
    rows = []
    for number, kind in enumerate(kinds):
        inside = _blocks((masks == number).astype(np.float64)[..., None])[..., 0] > 0.999
        seen, truth, one, other = (_blocks(x)[inside] for x in (picture, reference, *halves))
        delta = delta_e_CIE2000_images(seen[None], truth[None]).ravel()
        noise = delta_e_CIE2000_images(one[None], other[None]).ravel() / 2.0
        ratio = float(luminance(seen.mean(axis=0)) / luminance(truth.mean(axis=0)))
        worst = float(np.percentile(delta, 95))
        rows.append(Row(kind, mode, float(delta.mean()), worst, float(noise.mean()), ratio))
    return rows


def _blocks(image: NDArray[np.float64]) -> NDArray[np.float64]:
    return grey_scene.blocks(image, _BLOCK)


def _masks(items: Sequence[bpy.types.Object], places: Sequence[Vector]) -> NDArray[np.int32]:
    """Return the number of the thing that each pixel shows, -1 for none, shape (h, w)."""
    depsgraph = bpy.context.evaluated_depsgraph_get()
    trees = [_tree_of(item, place, depsgraph) for item, place in zip(items, places, strict=True)]
    camera = bpy.context.scene.camera
    frame = [
        camera.matrix_world.to_3x3() @ v for v in camera.data.view_frame(scene=bpy.context.scene)
    ]
    top_right, _, bottom_left, top_left = frame
    eye, found = camera.matrix_world.translation, np.full((_HEIGHT, _WIDTH), -1, np.int32)
    for v in range(_HEIGHT):
        for u in range(_WIDTH):
            x, y = (u + 0.5) / _WIDTH, (v + 0.5) / _HEIGHT
            w = top_left + (top_right - top_left) * x + (bottom_left - top_left) * y
            hits = [tree.ray_cast(eye, w.normalized())[3] for tree in trees]
            near = [(hit, i) for i, hit in enumerate(hits) if hit is not None]
            if near:
                found[v, u] = min(near)[1]
    return found


def _tree_of(item: bpy.types.Object, where: Vector, depsgraph: bpy.types.Depsgraph) -> BVHTree:
    """Faces of a thing; those of a ball around its middle where it has none."""
    import bmesh

    shape = bmesh.new()
    shown = item.evaluated_get(depsgraph)
    mesh = shown.to_mesh() if item.type in {"MESH", "CURVE", "FONT", "META"} else None
    has = mesh is not None and len(mesh.polygons) > 0 and not item.particle_systems
    if has and not any(m.type == "NODES" for m in item.modifiers):
        shape.from_mesh(mesh)
        shape.transform(shown.matrix_world)
    else:
        bmesh.ops.create_icosphere(shape, subdivisions=3, radius=_SHRUNK * RADIUS)
        shape.transform(Matrix.Translation(where))
    tree = BVHTree.FromBMesh(shape)
    shape.free()
    return tree
