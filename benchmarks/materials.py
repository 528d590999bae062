"""Kinds of materials and objects under water: EEVEE against converged Cycles, kind by kind.

Twelve objects stand on sand in each picture. A kind's colour difference is the mean CIE2000 over
blocks of pixels that lie within it.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence

import bpy
import numpy as np
from mathutils import Matrix, Vector
from mathutils.bvhtree import BVHTree
from numpy.typing import NDArray

from ..settings import render_plan
from ..settings.scene_settings import SceneSettings
from ..uw_spectral.spectra.colour_rendering import luminance
from ..uw_spectral.spectra.spectral_image import write_jpeg
from . import grey_scene
from ._material_kinds import KINDS, RADIUS, Kind, place
from ._places import Compared, realtime
from ._scenery import look_at, new_file, view_rays
from .runner import Ask, Page, Target, table

_COLUMNS, _ROWS, _PITCH = 4, 3, 1.15
_WIDTH, _HEIGHT, _BLOCK = 336, 216, 3
_FLOOR, _DEPTH, _AWAY = 7.0, 4.2, 4.4
_SHRUNK = 0.9  # of a ball that stands for what has no faces
_EEVEE_SAMPLES = 32
_CLOSE = 2.5  # ΔE of kinds that are only named


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
    """Fill an empty file with objects of some kinds, and a camera; return them and their places."""
    new_file((_WIDTH, _HEIGHT))
    items, places = [], []
    for index, kind in enumerate(kinds):
        row, column = divmod(index, _COLUMNS)
        x = (column - (_COLUMNS - 1) / 2.0) * _PITCH
        where = Vector((x, row * _PITCH, -_FLOOR + RADIUS + 0.02))
        items.append(place(kind, where))
        places.append(where)
    middle = Vector((0.0, (_ROWS - 1) / 2.0 * _PITCH, -_FLOOR + 0.5 * RADIUS))
    look_at((0.0, -_AWAY, -_DEPTH), middle).data.lens = 42.0
    return items, places


def _masks(items: Sequence[bpy.types.Object], places: Sequence[Vector]) -> NDArray[np.int32]:
    """Return the number of the object that each pixel shows, -1 for none, shape (h, w)."""
    depsgraph = bpy.context.evaluated_depsgraph_get()
    trees = [_tree_of(item, place, depsgraph) for item, place in zip(items, places, strict=True)]
    camera = bpy.context.scene.camera
    eye, found = camera.matrix_world.translation, np.full((_HEIGHT, _WIDTH), -1, np.int32)
    rays = view_rays(camera)
    for v, u in np.ndindex(found.shape):
        hits = [tree.ray_cast(eye, Vector(rays[v, u]))[3] for tree in trees]
        near = [(hit, i) for i, hit in enumerate(hits) if hit is not None]
        if near:
            found[v, u] = min(near)[1]
    return found


def _tree_of(item: bpy.types.Object, where: Vector, depsgraph: bpy.types.Depsgraph) -> BVHTree:
    """Faces of an object; those of a ball around its middle where it has none."""
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


def measure(ask: Ask) -> Mapping[str, object]:
    """Render all sheets of kinds."""
    size, rows, drawn, noises, close, pairs = _COLUMNS * _ROWS, [], [], [], 0, []
    for first in range(0, len(KINDS), size)[: ask.sheets]:
        kinds = KINDS[first : first + size]
        items, places = build(kinds)
        camera, plan = bpy.context.scene.camera, render_plan.make_plan(settings(ask.samples))
        traced = functools.partial(grey_scene.cycles_images, plan, camera, ask.samples)
        develop = plan.reduction(_DEPTH).apply
        halves = develop(ask.kept(f"sheet {first}", traced))
        seen = realtime(render_plan.make_plan(settings(_EEVEE_SAMPLES)))
        found = Compared(halves, {"real time": seen}, _BLOCK)
        off, noise, masks = found.delta_e("real time"), found.noise, _masks(items, places)
        images = seen, found.reference
        pairs.append(np.concatenate(images))
        light = [luminance(grey_scene.blocks(x, _BLOCK)) for x in images]
        for number, kind in enumerate(kinds):
            here = (masks == number).astype(np.float64)[..., None]
            inside = grey_scene.blocks(here, _BLOCK)[..., 0] > 0.999
            mean = float(off[inside].mean())
            if not kind.left_out:
                drawn.append(mean)
                noises.append(float(noise[inside].mean()))
            if mean <= _CLOSE:
                close += 1
                continue
            ratio = light[0][inside].mean() / light[1][inside].mean()
            said = f"{kind.name}, left out" if kind.left_out else kind.name
            most = np.percentile(off[inside], 95)
            rows.append([said, f"{mean:.1f}", f"{most:.1f}", f"{ratio:.2f}"])
    sheet = grey_scene.blocks(np.concatenate(pairs, axis=1), 2)
    write_jpeg(ask.shown("materials.jpg"), sheet.astype(np.float32))
    return {
        "rows": table(("kind", "Real-time", "95 %", "×"), rows), "count": len(drawn),
        "close": close, "mean": float(np.mean(drawn)), "most": float(np.percentile(drawn, 95)),
        "worst": max(drawn), "noise": float(np.mean(noises)),
    }  # fmt: skip


PAGE = Page(
    "Materials and objects",
    """
Sixty-five kinds of what users give objects on sand at 7 m in Jerlov IB, sun at 30°, six bands:
EEVEE in real time against Cycles with 2 × {samples} samples. Mean ΔE2000 of blocks of 3 × 3 pixels
within a kind (noise of Cycles in it: {noise:.2f}), what 95 % stay below, EEVEE over Cycles in
luminance. {count} kinds are drawn; {close} kinds are at most at 2.5; the others:

![EEVEE above, Cycles below](materials.jpg)

{rows}

## What differs
- EEVEE draws sharp reflections of the water only; balls of glass are no lenses.
- Translucent bodies are lit by half of what falls on either side; what hair keeps from other hair
  is told by the picture's depths, within some 30 %, and keeps none from the skin below it.
- Clear coloured objects show the mean of the channels behind them in the colour of open water.
- Volumes in objects are left out of EEVEE's modes, and log, record and panel name them.
""",
    (
        Target("mean ΔE2000 of kinds that are drawn", "mean", 1.5),
        Target("95 % of them", "most", 4.0),
        Target("worst of them", "worst", 6.0),
    ),
    {"samples": 128, "sheets": 99},
)
