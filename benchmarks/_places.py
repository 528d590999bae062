"""A scene, its water and its camera: drawn by both engines, compared, and put into a sheet."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector
from numpy.typing import NDArray

from ..quality.seen_points import SeenPoints
from ..scene.engines import engines
from ..scene.readers import view_tracing
from ..scene.water import water_body
from ..settings import render_plan
from ..settings.scene_settings import SceneSettings
from ..uw_spectral.spectra.colour_rendering import delta_e_CIE2000_images
from ..uw_spectral.spectra.spectral_image import read_exr
from . import grey_scene

WIDTH, HEIGHT = 48, 27
BANDS = 3

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Place:
    """A scene and its water.

    ``build`` fills an empty file and returns the camera; ``water`` is a Jerlov type; ``sun`` the
    zenith angle in air, degrees; ``samples`` and ``drawn`` are those of Cycles, and of EEVEE;
    ``settings`` others that its water has; ``size`` is that of the pictures, pixels.
    """

    name: str
    build: Callable[[], bpy.types.Object]
    water: str = "IB"
    sun: float = 30.0
    samples: int = 256
    settings: Mapping[str, object] = field(default_factory=dict)
    size: tuple[int, int] = (WIDTH, HEIGHT)
    drawn: int = 16

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
        scene.render.resolution_x, scene.render.resolution_y = self.size
        scene.render.resolution_percentage = 100
        scene.cycles.pixel_filter_type = "BOX"
        bpy.context.view_layer.update()
        return camera

    def by_cycles(self, camera: bpy.types.Object, seeds: Sequence[int] = (1, 2)) -> Array:
        """Band radiances of seeds, shape (seeds, h, w, n)."""
        plan, depth = self.plan(self.samples), depth_of(camera)
        extent = water_body.water_extent(bpy.context.scene, plan.column, depth)
        images = []
        for seed in seeds:
            with engines.cycles_bands(bpy.context.scene, camera, plan, extent, seed=seed) as engine:
                images.append(grey_scene.band_image(engine, plan, depth))
        return np.stack(images)

    def by_eevee(self, camera: bpy.types.Object, **changes: object) -> Array:
        """Band radiances, shape (h, w, n)."""
        return self.timed(camera, **changes)[0]

    def timed(
        self, camera: bpy.types.Object, clock: Callable[[], float] | None = None, **changes: object
    ) -> tuple[Array, float]:
        """Band radiances, and what a clock says of a second picture, the shaders compiled."""
        plan, depth = self.plan(self.drawn, **changes), depth_of(camera)
        extent = water_body.water_extent(bpy.context.scene, plan.column, depth)
        with engines.eevee_bands(bpy.context.scene, camera, plan, extent, depth) as engine:
            image = grey_scene.band_image(engine, plan, depth)
            if clock is None:
                return image, 0.0
            start = clock()
            grey_scene.band_image(engine, plan, depth)
            return image, clock() - start

    def seconds(
        self, camera: bpy.types.Object, clock: Callable[[], float] = time.perf_counter
    ) -> float:
        """Seconds of a pass of EEVEE, the shaders compiled; of the wall, or of another clock."""
        return self.timed(camera, clock)[1]

    def in_real_time(self, camera: bpy.types.Object, **changes: object) -> Array:
        """Linear RGB of EEVEE's real-time mode, shape (h, w, 3)."""
        return realtime(camera, self.plan(self.drawn, **changes))

    def compared(
        self, camera: bpy.types.Object, block: int, kept: Callable[..., Array], *,
        forms: Mapping[str, Mapping[str, object]] | None = None, fast: bool = True,
        clock: Callable[[], float] | None = None,
    ) -> Compared:  # fmt: skip
        """Render by Cycles, unless that is kept, and by EEVEE.

        ``forms`` are other settings by name, by default none as *bands*; ``fast``: *real time*
        as well; ``clock`` as of :meth:`timed`.
        """
        develop = self.plan(1).reduction(depth_of(camera)).apply
        halves = kept(f"{self.name} {self.samples}", lambda: self.by_cycles(camera))
        drawn = {
            name: self.timed(camera, clock, **changes)
            for name, changes in (forms or {"bands": {}}).items()
        }
        found = {name: develop(image) for name, (image, _) in drawn.items()}
        if fast:
            found["real time"] = self.in_real_time(camera)
        seconds = {name: taken for name, (_, taken) in drawn.items()}
        return Compared(np.stack([develop(half) for half in halves]), found, block, seconds)

    def distance(self, camera: bpy.types.Object) -> Array:
        """Distance of what pixels show, m, shape (h, w); infinite of open water."""
        return self._seen(camera).distance.reshape(self.size[::-1])

    def occluded(self, camera: bpy.types.Object) -> NDArray[np.bool_]:
        """Which pixels show an object that the sun does not reach, shape (h, w)."""
        seen = self._seen(camera)
        return (np.isfinite(seen.distance) & ~seen.sunlit).reshape(self.size[::-1])

    def _seen(self, camera: bpy.types.Object) -> SeenPoints:
        plan = self.plan(1)
        return view_tracing.trace_view(
            bpy.context.scene, camera, plan.column, plan.viewpoint(0.0).field,
            rays=self.size[0] * self.size[1],
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Compared:
    """Linear RGB of a place: two pictures of Cycles, EEVEE's by name, and its seconds."""

    halves: Array
    pictures: Mapping[str, Array]
    block: int
    seconds: Mapping[str, float] = field(default_factory=dict)

    @property
    def reference(self) -> Array:
        """Mean of Cycles' pictures."""
        return self.halves.mean(axis=0)

    def delta_e(self, name: str) -> Array:
        """ΔE2000 of blocks of pixels of a picture; the noise of the reference is in it."""
        return delta_e(self.pictures[name], self.reference, self.block)

    @property
    def noise(self) -> Array:
        """What ΔE2000 the reference's own noise makes, by block."""
        return delta_e(*self.halves, self.block) / 2.0


def delta_e(one: Array, other: Array, block: int) -> Array:
    """ΔE2000 of blocks of pixels of linear RGB, as a display shows it."""
    blocks = (grey_scene.blocks(np.clip(x, 0.0, 1.0), block) for x in (one, other))
    return delta_e_CIE2000_images(*blocks)


def depth_of(camera: bpy.types.Object) -> float:
    """Depth of a camera, m; 0 above the water."""
    return max(-float(camera.matrix_world.translation.z), 0.0)


def realtime(camera: bpy.types.Object, plan: render_plan.RenderPlan) -> Array:
    """Draw the open scene in real time, linear RGB, shape (h, w, 3)."""
    scene, depth = bpy.context.scene, depth_of(camera)
    extent = water_body.water_extent(scene, plan.column, depth)
    with (
        tempfile.TemporaryDirectory() as folder,
        engines.eevee_realtime(scene, camera, plan, extent, depth) as engine,
    ):
        path = Path(folder, "picture.exr")
        engine.frame(plan, depth)(engine.passes[0], path)
        return read_exr(path)[0].astype(np.float64)


def sheet(
    path: Path, rows: Mapping[str, Sequence[Array]], titles: Sequence[str], *, size: float = 1.6,
    across: int = 1,
) -> None:  # fmt: skip
    """Draw rows of pictures of 0 to 1, beneath titles, so many rows beside one another."""
    import matplotlib as mpl

    mpl.use("agg")
    import matplotlib.pyplot as plt

    down, columns = -(-len(rows) // across), len(titles)
    height, width = next(iter(rows.values()))[0].shape[:2]
    figure, axes = plt.subplots(
        down, across * columns, squeeze=False,
        figsize=(size * columns * across, (size * height / width + 0.15) * down),
    )  # fmt: skip
    for axis in axes.flat:
        axis.set(xticks=[], yticks=[], frame_on=False)
    for number, (label, images) in enumerate(rows.items()):
        row, part = divmod(number, across)
        shown = axes[row, part * columns : (part + 1) * columns]
        shown[0].set_ylabel(label.replace(", ", ",\n"), fontsize=6)
        for axis, image, title in zip(shown, images, titles, strict=True):
            axis.imshow(np.clip(image, 0.0, 1.0), interpolation="nearest")
            if row == 0:
                axis.set_title(title, fontsize=7)
    figure.tight_layout(pad=0.3)
    figure.savefig(path, dpi=80, pil_kwargs={"quality": 80} if path.suffix == ".jpg" else None)
    plt.close(figure)


def block(
    name: str, at: Sequence[float], size: Sequence[float], colour: Sequence[float],
    turn: float = 0.0,
) -> None:  # fmt: skip
    """Add a box of a Lambertian colour, turned about z by degrees."""
    rotation = (0.0, 0.0, np.radians(turn))
    bpy.ops.mesh.primitive_cube_add(size=1.0, location=at, rotation=rotation)
    item = bpy.context.object
    item.name, item.scale = name, size
    item.data.materials.append(matt(colour))


def ground(z: float, colour: Sequence[float], size: float = 400.0) -> None:
    """Add a plane of a Lambertian colour."""
    bpy.ops.mesh.primitive_plane_add(size=size, location=(0.0, 0.0, z))
    bpy.context.object.data.materials.append(matt(colour))


def ball(
    at: Sequence[float], radius: float | Sequence[float], colour: Sequence[float],
    turn: float = 0.0,
) -> None:  # fmt: skip
    """Add a ball or an ellipsoid of a Lambertian colour."""
    bpy.ops.mesh.primitive_uv_sphere_add(radius=1.0, location=at, segments=64, ring_count=32)
    item = bpy.context.object
    item.scale, item.rotation_euler.z = np.broadcast_to(radius, 3), turn
    item.data.shade_smooth()
    item.data.materials.append(matt(colour))


def post(
    at: Sequence[float], radius: float, length: float, colour: Sequence[float], tilt: float = 0.0
) -> None:
    """Add a cylinder of a Lambertian colour, tilted about y by an angle in rad."""
    bpy.ops.mesh.primitive_cylinder_add(
        radius=radius, depth=length, location=at, vertices=48, rotation=(0.0, tilt, 0.0)
    )
    mesh = bpy.context.object.data
    mesh.materials.append(matt(colour))
    for face in mesh.polygons:
        face.use_smooth = len(face.vertices) == 4


def matt(colour: Sequence[float]) -> bpy.types.Material:
    """Make a Lambertian material."""
    return material("BsdfDiffuse", Color=colour)


def material(shader: str, **values: float | Sequence[float]) -> bpy.types.Material:
    """Make a material of one shader; values of its sockets, with _ for blanks."""
    made = bpy.data.materials.new(shader)
    tree = made.node_tree
    tree.nodes.clear()
    node = tree.nodes.new(f"ShaderNode{shader}")
    for name, value in values.items():
        socket = node.inputs[name.replace("_", " ")]
        socket.default_value = value if np.isscalar(value) else (*value, 1.0)
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(node.outputs[0], output.inputs["Surface"])
    return made


def camera_at(at: Sequence[float], turn: Sequence[float], angle: float) -> bpy.types.Object:
    """Add a camera of a width in rad, turned from straight down by angles in rad."""
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.location, camera.rotation_euler, camera.data.angle = at, turn, angle
    bpy.context.scene.collection.objects.link(camera)
    return camera


def look_at(
    at: Sequence[float], target: Sequence[float], angle: float = np.radians(70.0)
) -> bpy.types.Object:
    """Add a camera of a width in rad that looks at a place."""
    look = Vector(target) - Vector(at)
    return camera_at(at, look.to_track_quat("-Z", "Y").to_euler(), angle)
