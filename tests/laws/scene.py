"""A small scene under water that can be changed and drawn again without compiling anything."""

from __future__ import annotations

import contextlib
import math
import tempfile
import warnings
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix
from underwater_spectral.scene.engines import engines
from underwater_spectral.scene.water import water_body
from underwater_spectral.scene.water.occlusion import Cache
from underwater_spectral.settings.render_plan import RenderPlan, make_plan
from underwater_spectral.settings.scene_settings import SceneSettings
from underwater_spectral.tests.scene import scenes
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr

DEPTH, SEABED, WIDTH, HEIGHT = 5.0, 8.0, 48, 27
OPTIONS = {
    "water": "jerlov:IB", "bands": 3, "phase": "hg:0.9", "surface": "flat", "sky": "clear",
    "illuminant": "clear-sky", "exposure": "0",
}  # fmt: skip
LAMPS = ("left lamp", "right lamp")

Picture = np.ndarray


def plan(samples: int = 16, **options: object) -> RenderPlan:
    return make_plan(SceneSettings(**(OPTIONS | {"samples": samples} | options)))


def _add(operator: Callable, material: bpy.types.Material, **options: object) -> bpy.types.Object:
    operator(**options)
    item, everything = bpy.context.object, bpy.context.scene.collection
    item.data.materials.append(material)
    if item.name not in everything.objects:  # the active collection may be the water's
        everything.objects.link(item)
    return item


def _matt(name: str, colour: tuple[float, ...]) -> bpy.types.Material:
    material, tree, output = scenes._material(name)
    diffuse = tree.nodes.new("ShaderNodeBsdfDiffuse")
    diffuse.inputs["Color"].default_value = colour
    tree.links.new(diffuse.outputs[0], output.inputs["Surface"])
    return material


def build(*, lamps: bool = False) -> bpy.types.Scene:
    """Fill a new file with a cube, a ball and an arch over sand, maybe two lamps, and a camera."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    scene, mesh = bpy.context.scene, bpy.ops.mesh
    scene.eevee.shadow_pool_size = "128"
    sand, rock = _matt("sand", (0.5, 0.45, 0.35, 1.0)), _matt("rock", (0.3, 0.2, 0.15, 1.0))
    _add(mesh.primitive_plane_add, sand, size=60.0, location=(0.0, 0.0, -SEABED)).name = "sand"
    _add(mesh.primitive_cube_add, rock, size=1.2, location=(-1.5, 0.6, -7.4)).name = "cube"
    _add(mesh.primitive_uv_sphere_add, rock, radius=0.6, location=(0.2, -0.7, -7.3)).name = "ball"
    for x, z, width, height in (
        (0.9, -7.0, 0.5, 2.0),
        (2.7, -7.0, 0.5, 2.0),
        (1.8, -5.8, 2.3, 0.5),
    ):
        size = (width, 0.8, height)
        _add(mesh.primitive_cube_add, rock, size=1.0, location=(x, 1.6, z), scale=size)
    for name, x in zip(LAMPS if lamps else (), (-2.0, 2.2), strict=False):
        lamp = bpy.data.lights.new(name, "POINT")
        lamp.energy = 20.0
        item = bpy.data.objects.new(name, lamp)
        item.location = (x, -2.0, -5.6)
        scene.collection.objects.link(item)
    camera = scenes.add_camera((0.0, -5.5, -DEPTH), (math.radians(72.0), 0.0, 0.0))
    camera.data.angle = math.radians(60.0)
    scene.render.resolution_x, scene.render.resolution_y = WIDTH, HEIGHT
    scene.render.resolution_percentage = 100
    bpy.context.view_layer.update()
    return scene


def meshes() -> list[bpy.types.Object]:
    return [item for item in bpy.context.scene.objects if item.type == "MESH" and "uw" not in item]


def copy_materials() -> None:
    """Give each thing a material of its own."""
    for item in meshes():
        item.data.materials[0] = item.data.materials[0].copy()


def join() -> None:
    """Make one mesh of all that stands on the sand."""
    standing = [item for item in meshes() if item.name != "sand"]
    with bpy.context.temp_override(
        active_object=standing[0], selected_editable_objects=standing, selected_objects=standing
    ):
        bpy.ops.object.join()


def instance() -> None:
    """Show all that stands on the sand as an instance of a collection."""
    scene, group = bpy.context.scene, bpy.data.collections.new("group")
    for item in [item for item in meshes() if item.name != "sand"]:
        scene.collection.objects.unlink(item)
        group.objects.link(item)
    empty = bpy.data.objects.new("group", None)
    empty.instance_type, empty.instance_collection = "COLLECTION", group
    scene.collection.objects.link(empty)


def seal(thick: float = 0.2) -> list[bpy.types.Object]:
    """Put walls around the camera, its lamps and what it sees, down to below the sand."""
    rock, found = bpy.data.materials["rock"], []
    for axis in range(3):
        for side in (-1.0, 1.0):
            size, place = np.array([8.0, 12.0, 5.0]), np.array([0.0, 0.0, -6.0])
            place[axis] += side * (size[axis] - thick) / 2.0
            size[axis] = thick
            found.append(_add(bpy.ops.mesh.primitive_cube_add, rock, size=1.0, location=place))
            found[-1].scale = size
    bpy.context.view_layer.update()
    return found


class Drawing:
    """The scene in the water of a mode, drawn as often as wanted.

    Parameters
    ----------
    mode : str
        ``realtime``, ``bands`` or ``cycles``.
    first : RenderPlan
        Decides the nodes.
    change : callable, optional
        What is done to the dry scene.
    """

    def __init__(
        self,
        mode: str,
        first: RenderPlan,
        *,
        lamps: bool = False,
        change: Callable[[], None] | None = None,
    ) -> None:
        self.scene, self.mode, self._first = build(lamps=lamps), mode, first
        if change is not None:
            change()
            bpy.context.view_layer.update()
        self._own = [item for item in self.scene.objects if item.type != "CAMERA"]
        self._stack, self._cache = contextlib.ExitStack(), Cache(of_job=True)
        self._engine = self._stack.enter_context(self._opened())
        self._folder = Path(self._stack.enter_context(tempfile.TemporaryDirectory()))

    def _opened(self) -> contextlib.AbstractContextManager[engines.BandEngine]:
        scene, plan = self.scene, self._first
        camera, extent = scene.camera, water_body.water_extent(scene, plan.column, DEPTH)
        if self.mode == "cycles":
            return engines.cycles_bands(scene, camera, plan, extent, seed=1, cache=self._cache)
        open_ = {"bands": engines.eevee_bands, "realtime": engines.eevee_realtime}[self.mode]
        return open_(scene, camera, plan, extent, DEPTH, cache=self._cache)

    def close(self) -> None:
        self._stack.close()

    @property
    def objects(self) -> list[bpy.types.Object]:
        """What is the scene's own, lamps included."""
        return [item for item in self._own if item.name in bpy.data.objects]

    @contextlib.contextmanager
    def moved(self, by: Matrix, *, camera: bool = True) -> Iterator[None]:
        """Move all of the scene, or all but the camera."""
        items = [*self.objects, *([self.scene.camera] if camera else [])]
        before = [item.matrix_world.copy() for item in items]
        for item, place in zip(items, before, strict=True):
            item.matrix_world = by @ place
        yield
        for item, place in zip(items, before, strict=True):
            item.matrix_world = place

    def draw(
        self,
        now: RenderPlan | None = None,
        depth: float = DEPTH,
        *,
        seed: int = 1,
        groups: Sequence[tuple[int, ...]] | None = None,
    ) -> Picture:
        """Draw the scene as a process would that begins with it, shape (h, w, n).

        What is drawn are bands, or the picture in real time.
        """
        now = now or self._first
        bpy.context.view_layer.update()
        self.scene.frame_set(self.scene.frame_current + 1)
        self._cache.__init__(of_job=True)
        if self.mode == "cycles":
            self._engine.draw(seed, now.settings.samples)
        render = self._engine.frame(now, depth)
        path, found = self._folder / "a.exr", {}
        for indices in groups or self._engine.passes:
            render(tuple(indices), path)
            image = read_exr(path)[0].astype(np.float64)
            found |= {band: image[..., k] for k, band in enumerate(indices)}
        return np.stack([found[band] for band in sorted(found)], axis=-1)


def off(one: Picture, other: Picture, block: tuple[int, int] = (3, 3)) -> tuple[float, float]:
    """Difference of the blocks of two pictures over their brightness, mean and worst.

    Blocks are so many pixels high and wide. Bands count alike, but for those with next to no light.
    """
    (a, b), (h, w) = block, one.shape[:2]
    pair = np.stack([one, other])[:, : h // a * a, : w // b * b]
    scale = np.abs(pair).mean(axis=(0, 1, 2))
    pair /= np.maximum(scale, 0.05 * scale.max())
    few = pair.reshape(2, h // a, a, w // b, b, -1).mean(axis=(2, 4))
    apart = np.abs(few[0] - few[1]).mean(axis=-1) / np.maximum(few.mean(axis=(0, -1)), 0.02)
    return float(apart.mean()), float(apart.max())
