"""A tilted plane in open water, drawn by EEVEE and by numpy."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from unittest import mock

import bpy
import numpy as np
from mathutils import Matrix, Vector
from underwater_spectral.scene.engines import eevee_settings, exr_output
from underwater_spectral.scene.water import frame_water, realtime, scene_water, water_body
from underwater_spectral.uw_spectral.spectra.reflectance import uplift_basis
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr
from underwater_spectral.uw_spectral.transfer.channel_pixel import along_rays
from underwater_spectral.uw_spectral.transfer.pixel_parts import (
    COLOURS,
    SeenObject,
    SurfaceAbove,
    SurfaceMaterial,
)
from underwater_spectral.validation.solved_cases import FROM_SUN, Case, LightAround

COLOR = (0.8, 0.4, 0.2)
_DEPTHS = 17


@dataclasses.dataclass(frozen=True, eq=False)
class View:
    """A camera at a depth, turned about x (0 looks down, 90 level), before a square.

    ``square`` is its corner and two edges in camera axes; None for open water.
    """

    depth: float
    turn: float = 88.0
    angle: float = 80.0
    clip: tuple = (0.01, 100.0)
    square: tuple | None = ((-1.5, -1.8, -3.0), (3.0, 0.0, 0.0), (0.0, 1.5, -4.0))
    size: tuple = (32, 17)

    @property
    def matrix(self) -> Matrix:
        return Matrix.Translation((0, 0, -self.depth)) @ Matrix.Rotation(
            math.radians(self.turn), 4, "X"
        )

    def rays(self) -> np.ndarray:
        width, height = self.size
        step = 2 * math.tan(math.radians(self.angle) / 2) / width
        x = (np.arange(width) + 0.5 - width / 2) * step
        y = (height / 2 - np.arange(height) - 0.5) * step
        right, up = np.meshgrid(x, y)
        rays = np.stack([right, up, -np.ones_like(right)], -1)
        rays = rays @ np.array(self.matrix.to_3x3()).T
        return rays / np.linalg.norm(rays, axis=-1, keepdims=True)


def level_square(turn: float, drop: float, size: float = 4.0):
    """Corner and edges in camera axes of a level square so far below a camera, ahead of it."""
    turned = View(0.0, turn).matrix.to_3x3()
    ahead = np.array(turned @ Vector((0.0, 0.0, -1.0)))
    middle = ahead * drop / -ahead[2]
    corner = middle - [size / 2, size / 2, 0.0]
    return tuple(
        tuple(turned.transposed() @ Vector(part))
        for part in (corner, (size, 0.0, 0.0), (0.0, size, 0.0))
    )


def place(view: View) -> bpy.types.Object:
    """Put camera and square where the view wants them."""
    scene = bpy.context.scene
    camera = bpy.data.objects.get("Camera")
    if camera is None:
        camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
        mesh = bpy.data.meshes.new("Square")
        mesh.from_pydata([(0, 0, 0)] * 4, [], [(0, 1, 2, 3)])
        material = bpy.data.materials.new("Square")
        material.node_tree.nodes.clear()
        diffuse = material.node_tree.nodes.new("ShaderNodeBsdfDiffuse")
        diffuse.inputs["Color"].default_value = (*COLOR, 1.0)
        output = material.node_tree.nodes.new("ShaderNodeOutputMaterial")
        material.node_tree.links.new(diffuse.outputs[0], output.inputs[0])
        mesh.materials.append(material)
        for item in (camera, bpy.data.objects.new("Square", mesh)):
            scene.collection.objects.link(item)
        scene.camera = camera
        scene.render.filter_size = 0.0
    scene.render.resolution_x, scene.render.resolution_y = view.size
    camera.matrix_world = view.matrix
    camera.data.angle = math.radians(view.angle)
    camera.data.clip_start, camera.data.clip_end = view.clip
    square = bpy.data.objects["Square"]
    square.hide_render = view.square is None
    if view.square is not None:
        origin, first, second = (np.array(v) for v in view.square)
        corners = (origin, origin + first, origin + first + second, origin + second)
        for vertex, corner in zip(square.data.vertices, corners, strict=True):
            vertex.co = corner
        square.data.update()
        square.matrix_world = view.matrix
    return camera


def render(
    water: frame_water.RealtimeWater, view: View, path: Path, samples: int = 1
) -> np.ndarray:
    """Render with EEVEE; nodes that are there get new values, unless the water needs others."""
    scene = bpy.context.scene
    camera = place(view)
    if realtime.fits(scene, water):
        realtime.set_values(scene, water)
    else:
        scene_water.remove(scene)
        # Formulas are tested to more digits than EEVEE keeps of the colours of closures.
        with mock.patch.object(frame_water.RealtimeWater, "has_native_closures", new=False):
            realtime.add_realtime(scene, water, water_body.WaterExtent(2000.0, 2000.0))
        floor = bpy.data.objects.get("UW Floor")
        if floor is not None:  # the floor term of the background is what is tested
            bpy.data.objects.remove(floor)
    with eevee_settings.realtime_settings(scene, camera, samples=samples, water=water):
        exr_output.write_float_exr(scene, path)
    return read_exr(path)[0].astype(np.float64)


def square_ahead(view: View) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Distance in m to the square along every ray, its normal, and where it is.

    1 is on it, 2 where it has an edge, 0 elsewhere.
    """
    rays, turn = view.rays(), np.array(view.matrix.to_3x3())
    if view.square is None:
        return np.ones(rays.shape[:2]), np.array([0.0, 0.0, 1.0]), np.zeros(rays.shape[:2], int)
    origin, first, second = (turn @ np.array(v) for v in view.square)
    normal = np.cross(first, second)
    normal *= -np.sign(origin @ normal) / np.linalg.norm(normal)
    with np.errstate(divide="ignore"):
        P = (origin @ normal) / (rays @ normal)
    hit = P[..., None] * rays - origin
    along = np.stack([hit @ e / (e @ e) for e in (first, second)], -1)
    margin = 0.1
    where = ((P > 0) & np.all((along > -margin) & (along < 1 + margin), axis=-1)).astype(int)
    where += (where == 1) & ~np.all((along > margin) & (along < 1 - margin), axis=-1)
    return P, normal, where


def hit_depth(view: View) -> np.ndarray:
    """Depth in m at which every ray meets the plane of the square, shape (h, w)."""
    return view.depth - view.rays()[..., 2] * square_ahead(view)[0]


def expected_of_solved(column, phase, view: View, weights):
    """Return the picture by the solution without its tables, and where the square is."""
    field, w3 = column.solved_field(phase), view.rays()
    w = tuple(np.moveaxis(w3, -1, 0))
    picture = field.radiance(np.full(w3.shape[:2], view.depth), w)
    P, normal, where = square_ahead(view)
    seen = where == 1
    if seen.any():
        rays, P = tuple(part[seen] for part in w), P[seen]
        y = view.depth - rays[2] * P
        passed = field.extinction_between(view.depth, y, scaled=False)
        passed = np.exp(-passed * P[:, None])
        lit = _lit(column, phase, y, normal) * (np.array(COLOR) @ uplift_basis(column.bands).T)
        picture[seen] += passed * (lit / math.pi - field.radiance(y, rays))
    return picture @ np.asarray(weights).T, where


def expected_of_projected(water: frame_water.RealtimeWater, view: View, around=None):
    """Return the picture by the same tables in numpy, and where the square is.

    ``around`` tells what objects about points do to light scattered forward.
    """
    column, light, w3 = water.column, water.projected, view.rays()
    w = [w3[..., i, None] for i in range(3)]
    sky = dataclasses.replace(column.skylight, level=1.0)
    index = column.refractive_index if column.reflects else None
    depth = np.full(w[0].shape, view.depth)
    picture = (
        along_rays(light, water.field.sun, w).open_water(depth, w, SurfaceAbove(sky, index)).total
    )
    P, normal, where = square_ahead(view)
    seen = where == 1
    if seen.any():
        w = [part[seen] for part in w]
        P, depth = P[seen][:, None], depth[seen]
        y = np.maximum(depth - w[2] * P, 0.0)
        cosine = max(-(normal @ np.asarray(water.field.sun)), 0.0)
        lit = [np.full(P.shape, c * cosine / math.pi) for c in COLOR]
        surface = SurfaceMaterial(COLOURS, lit, [np.full(P.shape, c) for c in COLOR])
        ray = along_rays(light, water.field.sun, w)
        normals = [np.full(P.shape, x) for x in normal]
        leaving = ray.leaving(surface, y, normals, P)
        points = np.hstack([part * P for part in w]) - np.array([0.0, 0.0, view.depth])
        does = None if around is None else around(points)
        picture[seen] = ray.surface(depth, y, w, P, SeenObject(leaving), around=does).total
    return picture, where


def errors_of_solved(column, phase, view: View, weights, path: Path, channels=slice(None)):
    """Relative errors of EEVEE away from the sun: of open water, and of the square.

    EEVEE cuts the digits beyond half floats; half a step is put back.
    """
    solved = column.solved_field(phase)
    seen = render(
        frame_water.realtime_water(column, phase, view.depth, weights, solved=solved), view, path
    )
    wanted, where = expected_of_solved(column, phase, view, weights)
    far = view.rays() @ -column.sun_direction < math.cos(math.radians(FROM_SUN))
    if column.reflects:
        # A pixel across the edge of Snell's window is neither bright nor dark.
        zenith = np.degrees(np.arccos(view.rays()[..., 2]))
        far &= np.abs(zenith - math.degrees(math.asin(1 / column.refractive_index))) > 1.0
    errors = np.abs(seen / wanted - 1 + 2.0**-11)[..., channels]
    return [errors[far & (where == part)].ravel() for part in (0, 1)]


def errors_of_case(case: Case, path: Path):
    """Errors in each band of a random case, exposed so that a white patch is near 1."""
    white = np.maximum(case.field.Ed(case.depth) / math.pi, 1e-30)
    view = View(case.depth, case.turn, square=case.square)
    return errors_of_solved(case.column, case.phase, view, np.diag(1.0 / white), path, case.lit)


def _lit(column, phase, y: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Irradiance on patches at depths, shape (q, n)."""
    field, mu_s = column.solved_field(phase), column.sun_cosine
    if field.layered:
        assert normal[2] > 1 - 1e-9, "in layers the squares lie level"
        return field.Ed(y)
    depths = np.linspace(y.min(), y.max(), _DEPTHS)
    direct = max(-(normal @ column.sun_direction), 0.0) / mu_s * column.sun_irradiance
    E = LightAround.at(column, phase, depths).on_patch(normal)
    E += direct * np.exp(-field.extinction * depths[:, None] / mu_s)
    logarithms = (np.interp(y, depths, np.log(band)) for band in E.T)
    return np.exp(np.stack(list(logarithms), axis=-1))
