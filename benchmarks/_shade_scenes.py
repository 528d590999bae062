"""Places where light is kept away: some that are built here, and the example scenes with roofs."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix, Vector
from numpy.typing import NDArray

from ..quality.seen_points import SeenPoints
from ..scene.engines import engines
from ..scene.seen import view_tracing
from ..scene.water import water_body
from ..settings import render_plan
from ..settings.scene_settings import SceneSettings
from . import grey_scene

WIDTH, HEIGHT = 48, 27
BANDS = 3
_EEVEE_SAMPLES = 16
_SAND, _STONE, _RED = (0.35, 0.32, 0.26), (0.25, 0.25, 0.23), (0.5, 0.12, 0.08)
_WOOD = (0.3, 0.2, 0.11)


@dataclass(frozen=True)
class Place:
    """A scene and its water.

    Parameters
    ----------
    name : str
    build : callable
        Fills an empty file and returns the camera.
    water : str
        Jerlov type.
    sun : float
        Zenith angle in air, degrees.
    samples : int
        Of Cycles.
    settings : mapping of str to object
        Others that its water has.
    """

    name: str
    build: Callable[[], bpy.types.Object]
    water: str = "IB"
    sun: float = 30.0
    samples: int = 256
    settings: Mapping[str, object] = field(default_factory=dict)

    def plan(self, samples: int, **changes: object) -> render_plan.RenderPlan:
        """Resolve it; ``changes`` are other settings."""
        chosen = SceneSettings(
            water=f"jerlov:{self.water}", bands=BANDS, surface="flat", sky="clear",
            sun_zenith=self.sun, sun_azimuth=60.0, samples=samples,
        )  # fmt: skip
        return render_plan.make_plan(replace(chosen, **self.settings, **changes))

    def open(self) -> bpy.types.Object:
        """Build it in an empty file; return the camera."""
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        camera = self.build()
        scene = bpy.context.scene
        scene.camera = camera
        scene.render.resolution_x, scene.render.resolution_y = WIDTH, HEIGHT
        scene.render.resolution_percentage = 100
        scene.cycles.pixel_filter_type = "BOX"
        bpy.context.view_layer.update()
        return camera

    def by_cycles(self, camera: bpy.types.Object, seeds: Sequence[int]) -> NDArray[np.float64]:
        """Band radiances of seeds, shape (seeds, h, w, n)."""
        plan, depth = self.plan(self.samples), -camera.matrix_world.translation.z
        extent = water_body.water_extent(bpy.context.scene, plan.column, depth)
        images = []
        for seed in seeds:
            with engines.cycles_bands(bpy.context.scene, camera, plan, extent, seed=seed) as engine:
                images.append(grey_scene.band_image(engine, plan, depth))
        return np.stack(images)

    def by_eevee(self, camera: bpy.types.Object, **changes: object) -> NDArray[np.float64]:
        """Band radiances, shape (h, w, n)."""
        plan, depth = self.plan(_EEVEE_SAMPLES, **changes), -camera.matrix_world.translation.z
        extent = water_body.water_extent(bpy.context.scene, plan.column, depth)
        with engines.eevee_bands(bpy.context.scene, camera, plan, extent, depth) as engine:
            return grey_scene.band_image(engine, plan, depth)

    def seconds(
        self, camera: bpy.types.Object, clock: Callable[[], float] = time.perf_counter
    ) -> float:
        """Seconds of a pass of EEVEE, the shaders compiled; of the wall, or of another clock."""
        plan, depth = self.plan(_EEVEE_SAMPLES), -camera.matrix_world.translation.z
        extent = water_body.water_extent(bpy.context.scene, plan.column, depth)
        with engines.eevee_bands(bpy.context.scene, camera, plan, extent, depth) as engine:
            grey_scene.band_image(engine, plan, depth)
            start = clock()
            grey_scene.band_image(engine, plan, depth)
            return clock() - start

    def distance(self, camera: bpy.types.Object) -> NDArray[np.float64]:
        """Distance of what pixels show, m, shape (h, w); infinite of open water."""
        return self._seen(camera).distance.reshape(HEIGHT, WIDTH)

    def shaded(self, camera: bpy.types.Object) -> NDArray[np.bool_]:
        """Which pixels show a thing that the sun does not reach, shape (h, w)."""
        seen = self._seen(camera)
        return (np.isfinite(seen.distance) & ~seen.sunlit).reshape(HEIGHT, WIDTH)

    def _seen(self, camera: bpy.types.Object) -> SeenPoints:
        plan = self.plan(1)
        return view_tracing.trace_view(
            bpy.context.scene, camera, plan.column, plan.viewpoint(0.0).field, rays=WIDTH * HEIGHT
        )


def slab() -> bpy.types.Object:
    """Fill a file with a slab of 8 m that hangs 4 m above sand, and two balls."""
    _block("slab", (0.0, 0.0, -4.15), (8.0, 8.0, 0.3), _STONE)
    _ground(-8.0)
    ball((0.5, 0.5, -6.5), 0.5, _RED)
    ball((-3.0, -5.2, -6.8), 0.5, _RED)
    return look_at((1.0, -9.5, -6.2), (0.0, 0.0, -6.0))


def box() -> bpy.types.Object:
    """Fill a file with a box of 4 × 5 × 3 m on sand, open to one side, and a ball inside."""
    for name, at, size in (
        ("back", (0.0, 2.6, -8.5), (4.4, 0.2, 3.0)),
        ("left", (-2.1, 0.0, -8.5), (0.2, 5.4, 3.0)),
        ("right", (2.1, 0.0, -8.5), (0.2, 5.4, 3.0)),
        ("roof", (0.0, 0.0, -6.9), (4.4, 5.4, 0.2)),
    ):
        _block(name, at, size, _RED if name == "left" else _STONE)
    _ground(-10.0)
    ball((0.6, 0.8, -9.4), 0.6, _SAND)
    return look_at((-0.8, -5.6, -8.8), (0.1, 1.0, -8.5))


def tunnel(*, inside: bool) -> Callable[[], bpy.types.Object]:
    """Return what fills a file with a tunnel of 3 × 8 m that bends, with a hole in its roof.

    The camera looks through it, or at one of its ends.
    """

    def build() -> bpy.types.Object:
        for name, x, y, turn in (("south", 0.0, -2.0, 0.0), ("north", 1.15, 2.1, -35.0)):
            parts = [
                ("left", (-1.7, 0.0, 1.2), (0.4, 5.0, 2.8), _STONE),
                ("right", (1.7, 0.0, 1.2), (0.4, 5.0, 2.8), _RED if name == "south" else _STONE),
            ]
            if name == "south":
                parts += [
                    ("front", (0.0, -1.55, 2.75), (3.8, 1.9, 0.3), _STONE),
                    ("back", (0.0, 1.55, 2.75), (3.8, 1.9, 0.3), _STONE),
                    ("beside", (-1.25, 0.0, 2.75), (1.3, 1.2, 0.3), _STONE),
                    ("across", (1.25, 0.0, 2.75), (1.3, 1.2, 0.3), _STONE),
                ]
            else:
                parts.append(("roof", (0.0, 0.0, 2.75), (3.8, 5.0, 0.3), _STONE))
            for part, at, size, colour in parts:
                _block(f"{name} {part}", _turned(at, turn, (x, y, -10.0)), size, colour, turn)
        _ground(-10.0)
        ball((0.5, -0.6, -9.6), 0.4, _SAND)
        ball((1.2, 2.6, -9.5), 0.5, _RED)
        if inside:
            return look_at((-0.4, -3.9, -8.6), (0.5, 1.0, -8.9))
        return look_at((-1.6, -9.5, -8.2), (0.2, -3.0, -8.7))

    return build


def jetty(*, inside: bool) -> Callable[[], bpy.types.Object]:
    """Return what fills a file with a deck of planks on twelve piles; a boat and crates below.

    The camera is under it, or beside.
    """

    def build() -> bpy.types.Object:
        for k in range(17):
            _block(f"plank {k}", (0.0, 0.75 * (k - 8), -0.45), (3.2, 0.5, 0.1), _WOOD)
        for side in (-1.0, 1.0):
            _block(f"beam {side}", (1.4 * side, 0.0, -0.6), (0.2, 12.6, 0.2), _WOOD)
            for k in range(6):
                at = (1.4 * side, 2.4 * (k - 2.5), -2.6)
                bpy.ops.mesh.primitive_cylinder_add(radius=0.16, depth=4.0, location=at)
                bpy.context.object.data.materials.append(matt(_STONE))
        _ground(-4.5)
        _block("boat", (-0.3, 1.6, -4.15), (1.3, 3.2, 0.6), _RED, 25.0)
        for k, at in enumerate([(0.6, -1.6, -4.15), (0.5, -1.5, -3.5), (-0.7, -2.9, -4.15)]):
            _block(f"crate {k}", at, (0.7, 0.7, 0.65), _WOOD, 20.0 * k)
        if inside:
            return look_at((0.2, -4.6, -3.0), (0.0, -1.5, -3.4))
        return look_at((-3.6, -4.4, -2.6), (-0.3, -1.6, -3.2))

    return build


def car(*, inside: bool) -> Callable[[], bpy.types.Object]:
    """Return what fills a file with a hull as large as a car, of sheets with windows, on sand.

    The camera is behind its seats, or beside.
    """

    def build() -> bpy.types.Object:
        sill, top, end, half = 0.85, 1.5, 1.9, 0.9
        _block("bottom", (0.0, 0.0, 0.25 - 7.0), (1.8, 4.4, 0.06), _RED)
        _block("roof", (0.0, -0.3, top - 7.0), (1.8, 2.6, 0.06), _RED)
        _block("bonnet", (0.0, end - 0.25, sill - 7.0), (1.8, 1.1, 0.06), _RED)
        for side in (-half, half):
            _block(f"door {side}", (side, 0.0, 0.55 - 7.0), (0.06, 4.4, 0.6), _RED)
            for y in (-1.5, -0.2, 0.95):
                at = (side, y, (sill + top) / 2.0 - 7.0)
                _block(f"pillar {side} {y}", at, (0.06, 0.14, top - sill), _RED)
        for y in (-2.2, 2.2):
            _block(f"end {y}", (0.0, y, 0.55 - 7.0), (1.8, 0.06, 0.6), _RED)
        for x in (-0.42, 0.42):
            _block(f"seat {x}", (x, 0.2, 0.5 - 7.0), (0.5, 0.5, 0.3), _STONE)
            _block(f"back {x}", (x, -0.1, 0.85 - 7.0), (0.5, 0.14, 0.6), _STONE)
        _ground(-7.0)
        if inside:
            return look_at((0.1, -1.35, 1.05 - 7.0), (-0.05, 1.0, 0.75 - 7.0))
        return look_at((-3.4, -2.2, 1.5 - 7.0), (0.0, 0.0, 0.7 - 7.0))

    return build


def canyon(*, inside: bool) -> Callable[[], bpy.types.Object]:
    """Return what fills a file with two walls of 7 × 16 m, 2 m apart, on sand.

    The camera is between them, or before them.
    """

    def build() -> bpy.types.Object:
        for side, colour in ((-1.0, _STONE), (1.0, _SAND)):
            _block(f"wall {side}", (2.5 * side, 0.0, -8.5), (3.0, 16.0, 7.0), colour, 2.0 * side)
        _ground(-12.0)
        ball((0.3, -2.0, -11.5), 0.5, _RED)
        if inside:
            return look_at((-0.2, -6.0, -10.6), (0.1, 0.0, -10.4))
        return look_at((0.8, -12.5, -10.0), (0.0, -7.0, -10.0))

    return build


def of_file(path: Path, camera: str = "") -> Callable[[], bpy.types.Object]:
    """Return what opens a file; its camera, or the one of a name, looks."""

    def build() -> bpy.types.Object:
        bpy.ops.wm.open_mainfile(filepath=str(path))
        scene = bpy.context.scene
        return bpy.data.objects[camera] if camera else scene.camera

    return build


def _turned(at: Sequence[float], turn: float, origin: Sequence[float]) -> Vector:
    return Matrix.Rotation(math.radians(turn), 3, "Z") @ Vector(at) + Vector(origin)


def _block(
    name: str,
    at: Sequence[float],
    size: Sequence[float],
    colour: Sequence[float],
    turn: float = 0.0,
) -> None:
    bpy.ops.mesh.primitive_cube_add(size=1.0, location=at, rotation=(0.0, 0.0, math.radians(turn)))
    thing = bpy.context.object
    thing.name, thing.scale = name, size
    thing.data.materials.append(matt(colour))


def _ground(z: float) -> None:
    bpy.ops.mesh.primitive_plane_add(size=400.0, location=(0.0, 0.0, z))
    bpy.context.object.data.materials.append(matt(_SAND))


def ball(at: Sequence[float], radius: float, colour: Sequence[float]) -> None:
    """Add a ball of a Lambertian colour."""
    bpy.ops.mesh.primitive_uv_sphere_add(radius=radius, location=at)
    bpy.ops.object.shade_smooth()
    bpy.context.object.data.materials.append(matt(colour))


def matt(colour: Sequence[float]) -> bpy.types.Material:
    """Make a Lambertian material."""
    material = bpy.data.materials.new("matt")
    tree = material.node_tree
    tree.nodes.clear()
    diffuse = tree.nodes.new("ShaderNodeBsdfDiffuse")
    diffuse.inputs["Color"].default_value = (*colour, 1.0)
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(diffuse.outputs[0], output.inputs["Surface"])
    return material


def look_at(
    at: Sequence[float], target: Sequence[float], angle: float = math.radians(70.0)
) -> bpy.types.Object:
    """Add a camera of a width in rad."""
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.location = at
    look = Vector(target) - Vector(at)
    camera.rotation_euler = look.to_track_quat("-Z", "Y").to_euler()
    camera.data.angle = angle
    bpy.context.scene.collection.objects.link(camera)
    return camera
