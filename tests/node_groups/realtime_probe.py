"""A tilted plane in open water, drawn by EEVEE and by numpy."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix
from underwater_spectral.scene import eevee_settings, exr_output, realtime, water_body
from underwater_spectral.tests import by_hand
from underwater_spectral.uw_spectral.spectra.reflectance import uplift_basis
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr
from underwater_spectral.uw_spectral.transfer.aureole import Aureole
from underwater_spectral.uw_spectral.transfer.closed_form import solve_closed_form
from underwater_spectral.uw_spectral.transfer.radiance_field import under_surface

WIDTH, HEIGHT = 32, 17
COLOR = (0.8, 0.4, 0.2)


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

    @property
    def matrix(self) -> Matrix:
        return Matrix.Translation((0, 0, -self.depth)) @ Matrix.Rotation(
            math.radians(self.turn), 4, "X"
        )

    def rays(self) -> np.ndarray:
        step = 2 * math.tan(math.radians(self.angle) / 2) / WIDTH
        x = (np.arange(WIDTH) + 0.5 - WIDTH / 2) * step
        y = (HEIGHT / 2 - np.arange(HEIGHT) - 0.5) * step
        right, up = np.meshgrid(x, y)
        rays = np.stack([right, up, -np.ones_like(right)], -1)
        rays = rays @ np.array(self.matrix.to_3x3()).T
        return rays / np.linalg.norm(rays, axis=-1, keepdims=True)


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
        scene.render.resolution_x, scene.render.resolution_y = WIDTH, HEIGHT
        scene.render.filter_size = 0.0
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


def render(water: realtime.RealtimeWater, view: View, path: Path, samples: int = 1) -> np.ndarray:
    """Render with EEVEE; the nodes are built once and only get new values after."""
    scene = bpy.context.scene
    camera = place(view)
    if realtime.has_realtime(scene):
        realtime.set_values(scene, water)
    else:
        realtime.add_realtime(scene, water, water_body.WaterExtent(2000.0, 2000.0))
        floor = bpy.data.objects.get("UW Floor")
        if floor is not None:  # the floor term of the background is what is tested
            bpy.data.objects.remove(floor)
    with eevee_settings.realtime_settings(scene, camera, samples=samples, water=water):
        exr_output.write_float_exr(scene, path)
    return read_exr(path)[0].astype(np.float64)


def hit_depth(view: View) -> np.ndarray:
    """Depth in m at which every ray meets the plane of the square, shape (h, w)."""
    rays, turn = view.rays(), np.array(view.matrix.to_3x3())
    origin, first, second = (turn @ np.array(v) for v in view.square)
    normal = np.cross(first, second)
    with np.errstate(divide="ignore"):
        return view.depth - rays[..., 2] * (origin @ normal) / (rays @ normal)


def expected(column, phase, view: View, weights, *, aureole: bool = True):
    """Return the picture by numpy, and where the square is (2 where it has an edge)."""
    w3 = view.rays()
    w = tuple(w3[..., i, None] for i in range(3))
    water = solve_closed_form(column.light_field(phase), phase, view.depth, column.sun_direction)
    if not aureole:
        water = dataclasses.replace(water, aureole=Aureole(1.0, (0.0,) * 3, (), ()))

    def background(y):
        sky = column.sky_radiance
        if column.surface == "flat":
            sky = under_surface(water, w, sky, column.refractive_index)
        return water.radiance(y, w, sky)

    picture = background(view.depth)
    where = np.zeros(w3.shape[:2], dtype=int)
    if view.square is not None:
        turn = np.array(view.matrix.to_3x3())
        origin, first, second = (turn @ np.array(v) for v in view.square)
        normal = np.cross(first, second)
        normal /= np.linalg.norm(normal)
        with np.errstate(divide="ignore"):
            P = (origin @ normal) / (w3 @ normal)
        normal = normal * -np.sign(origin @ normal)
        hit = P[..., None] * w3 - origin
        along = np.stack([hit @ e / (e @ e) for e in (first, second)], -1)
        margin = 0.1
        where += (P > 0) & np.all((along > -margin) & (along < 1 + margin), axis=-1)
        where += (where == 1) & ~np.all((along > margin) & (along < 1 - margin), axis=-1)
        P = np.where(where > 0, P, 1.0)[..., None]
        y = np.maximum(view.depth - w[2] * P, 0.0)
        cosine = -(normal @ column.sun_direction)
        direct, forward, diffuse = water.field.surface_irradiance(y, cosine, normal[2])
        colour = np.array(COLOR) @ uplift_basis(column.bands).T / math.pi
        lit = colour * (direct + forward + diffuse)
        pixel = by_hand.pixel(water, view.depth, w, P, lit, background(y))
        picture = np.where(where[..., None] == 1, pixel, picture)
    return picture @ np.asarray(weights).T, where
