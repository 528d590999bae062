"""Pictures of sunlit water by Cycles and by EEVEE, in the same bands."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import bpy
import numpy as np
from numpy.typing import NDArray

from ..scene.engines import engines
from ..scene.water import water_body
from ..settings import render_plan
from ..settings.scene_settings import BOUNDED, EXACT, SceneSettings
from ..settings.water_settings import DEFAULT_PHASE
from . import grey_scene

WIDTH, HEIGHT = 60, 40
FIELD_OF_VIEW = 130.0
BANDS = 3
FLOOR_BELOW, FLOOR_REFLECTANCE = 3.0, 0.3
_EEVEE_SAMPLES = 4
_COLOUR = (0.6, 0.4, 0.2)
_RIG = "rig"


@dataclass(frozen=True)
class Scene:
    """A water, a sun and a sky, and a camera at a depth that looks level."""

    water: str
    depth: float
    sun: float = 30.0
    sky: str = "clear"
    objects: bool = False
    phase: str = DEFAULT_PHASE
    forward_peak: str = BOUNDED
    bands: int = BANDS
    share_passes: bool = False

    @property
    def title(self) -> str:
        """All of it in words."""
        objects = ", objects" if self.objects else ""
        peak = ", exact peak" if self.forward_peak == EXACT else ""
        where = f"{self.water} {self.depth:g} m, sun {self.sun:g}°, {self.sky}{objects}"
        return f"{where}, {self.phase}{peak}"

    def plan(self, samples: int) -> render_plan.RenderPlan:
        """Resolve it; under an overcast sky little of the light is direct sun."""
        return render_plan.make_plan(
            SceneSettings(
                water=f"jerlov:{self.water}", phase=self.phase, bands=self.bands, surface="flat",
                sky=self.sky, sky_radiance=0.05 if self.sky == "clear" else 3.0,
                sun_zenith=self.sun, sun_azimuth=60.0, floor_depth=self.depth + FLOOR_BELOW,
                floor_reflectance=str(FLOOR_REFLECTANCE), samples=samples,
                forward_peak=self.forward_peak, share_passes=self.share_passes,
            )
        )  # fmt: skip


def build() -> bpy.types.Object:
    """Fill an empty file with the camera, a sphere, a cube and a tilted square; return the first.

    They hang on an empty that :func:`place` moves.
    """
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = WIDTH, HEIGHT
    scene.render.resolution_percentage = 100
    scene.cycles.pixel_filter_type = "BOX"
    rig = bpy.data.objects.new(_RIG, None)
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.rotation_euler = (math.radians(90.0), 0.0, 0.0)
    camera.data.angle = math.radians(FIELD_OF_VIEW)
    material = _material()
    shapes = {
        "sphere": (bpy.ops.mesh.primitive_uv_sphere_add, (-0.9, 1.6, 0.1), 0.3),
        "cube": (bpy.ops.mesh.primitive_cube_add, (0.9, 1.5, -0.5), 0.25),
        "square": (bpy.ops.mesh.primitive_plane_add, (0.1, 1.4, 0.35), 0.35),
    }
    for name, (add, where, size) in shapes.items():
        add(location=where)
        body = bpy.context.object
        body.name, body.scale, body.parent = name, (size,) * 3, rig
        body.rotation_euler = (0.4, 0.3, 0.2)
        body.data.materials.append(material)
    for item in (rig, camera):
        scene.collection.objects.link(item)
    camera.parent = rig
    scene.camera = camera
    return camera


def _material() -> bpy.types.Material:
    material = bpy.data.materials.new("things")
    tree = material.node_tree
    tree.nodes.clear()
    diffuse = tree.nodes.new("ShaderNodeBsdfDiffuse")
    diffuse.inputs["Color"].default_value = (*_COLOUR, 1.0)
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(diffuse.outputs[0], output.inputs["Surface"])
    return material


def place(scene: Scene) -> None:
    """Move the camera to a depth; show or hide the objects."""
    bpy.data.objects[_RIG].location.z = -scene.depth
    for name in ("sphere", "cube", "square"):
        bpy.data.objects[name].hide_render = not scene.objects
        bpy.data.objects[name].hide_viewport = not scene.objects
    bpy.context.view_layer.update()


def by_cycles(
    scene: Scene, camera: bpy.types.Object, samples: int, seeds: Sequence[int]
) -> NDArray[np.float64]:
    """Band radiances of seeds, shape (seeds, h, w, n)."""
    place(scene)
    plan = scene.plan(samples)
    extent = water_body.water_extent(bpy.context.scene, plan.column, scene.depth)
    images = []
    for seed in seeds:
        with engines.cycles_bands(bpy.context.scene, camera, plan, extent, seed=seed) as engine:
            images.append(grey_scene.band_image(engine, plan, scene.depth))
    return np.stack(images)


def by_eevee(scenes: Sequence[Scene], camera: bpy.types.Object) -> Iterator[NDArray[np.float64]]:
    """Band radiances of scenes under one sky, shape (h, w, n)."""
    plans = []
    for scene in scenes:
        place(scene)
        plan = scene.plan(_EEVEE_SAMPLES)
        extent = water_body.water_extent(bpy.context.scene, plan.column, scene.depth)
        plans.append((scene, plan, extent))
    widest = water_body.WaterExtent(
        max(e.half_width for *_, e in plans), max(e.bottom for *_, e in plans)
    )
    with engines.eevee_bands(
        bpy.context.scene, camera, plans[0][1], widest, scenes[0].depth
    ) as engine:
        for scene, plan, _ in plans:
            place(scene)
            yield grey_scene.band_image(engine, plan, scene.depth)


def camera_rays(
    camera: bpy.types.Object, columns: int, rows: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Origin, shape (3,), and unit directions, shape (rows, columns, 3)."""
    corners = camera.data.view_frame(scene=bpy.context.scene)
    top_right, _, bottom_left, top_left = (np.array(c) for c in corners)
    u, v = ((np.arange(n) + 0.5) / n for n in (columns, rows))
    local = (
        top_left
        + u[None, :, None] * (top_right - top_left)
        + v[:, None, None] * (bottom_left - top_left)
    )
    matrix = np.array(camera.matrix_world)
    direction = local @ matrix[:3, :3].T
    return matrix[:3, 3], direction / np.linalg.norm(direction, axis=-1, keepdims=True)
