"""Irradiance and radiance meters in Cycles: the renderer as a measuring instrument."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np
from underwater_spectral.scene.engines import cycles_settings, exr_output
from underwater_spectral.scene.water import cycles_water, pass_values, scene_water, water_body
from underwater_spectral.scene.water.cycles_phase import CyclesPhase
from underwater_spectral.tests.scene import columns
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr
from underwater_spectral.uw_spectral.transfer.water_column import WaterColumn


@dataclass(frozen=True)
class Measurement:
    """A mean with its standard error."""

    mean: float
    error: float


def _pixels(
    scene: bpy.types.Scene,
    camera: bpy.types.Object,
    column: WaterColumn,
    phases: list[CyclesPhase],
    samples: int,
    path: Path,
) -> np.ndarray:
    extent = water_body.water_extent(scene, column, -camera.location.z)
    cycles_water.add_water(scene, column, phases, extent)
    pass_values.PassValues.of_column(column, phases).apply(scene.view_layers[0], (0, 1, 2))
    scene.cycles.pixel_filter_type = "BOX"
    settings = {"samples": samples, "seed": 1}
    with cycles_settings.reference_settings(scene, camera, **settings):
        exr_output.write_float_exr(scene, path)
    scene_water.remove(scene)
    return read_exr(path)[0].astype(np.float64)


def _camera(scene: bpy.types.Scene, depth: float, rotation: tuple[float, float, float]):
    camera = bpy.data.objects.new("meter", bpy.data.cameras.new("meter"))
    camera.location = (0.0, 0.0, -depth)
    camera.rotation_euler = rotation
    scene.collection.objects.link(camera)
    return camera


def _of_blocks(values: np.ndarray) -> Measurement:
    """Mean and standard error from pixels, which are independent under a box filter."""
    flat = values.ravel()
    return Measurement(flat.mean(), flat.std(ddof=1) / math.sqrt(len(flat)))


def radiance(scene, column, lobes, depth, rotation, *, samples, path, fractions=(1.0,), size=16):
    """Radiance in one direction (a narrow camera), band 0."""
    phases = columns.layers_of(column, lobes, fractions)
    return radiance_of_phases(
        scene, column, phases, depth, rotation, samples=samples, path=path, size=size
    )


def radiance_of_phases(scene, column, phases, depth, rotation, *, samples, path, size=16):
    """Likewise, of the phase functions of all layers."""
    scene.render.resolution_x = scene.render.resolution_y = size
    camera = _camera(scene, depth, rotation)
    camera.data.angle = math.radians(1.0)
    pixels = _pixels(scene, camera, column, phases, samples, path)
    return _of_blocks(pixels[..., 0])


def downwelling_irradiance(scene, column, lobes, depth, *, samples, path, fractions=(1.0,)):
    """Ed on a small white horizontal patch, too small to change the light, band 0."""
    half = 0.004 / float(column.attenuation.max()) ** 0.5
    mesh = bpy.data.meshes.new("collector")
    corners = [(-half, -half, 0), (half, -half, 0), (half, half, 0), (-half, half, 0)]
    mesh.from_pydata(corners, [], [(0, 1, 2, 3)])
    material = bpy.data.materials.new("collector")
    tree = material.node_tree
    tree.nodes.clear()
    diffuse = tree.nodes.new("ShaderNodeBsdfDiffuse")
    diffuse.inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(diffuse.outputs[0], output.inputs["Surface"])
    mesh.materials.append(material)
    collector = bpy.data.objects.new("collector", mesh)
    collector.location = (0.0, 0.0, -depth)
    scene.collection.objects.link(collector)
    scene.render.resolution_x = scene.render.resolution_y = 16
    camera = _camera(scene, depth - half / 10, (0.0, 0.0, 0.0))
    camera.data.type = "ORTHO"
    camera.data.ortho_scale = half
    phases = columns.layers_of(column, lobes, fractions)
    pixels = _pixels(scene, camera, column, phases, samples, path)
    bpy.data.objects.remove(collector)
    return _of_blocks(math.pi * pixels[..., 0])


def upwelling_scalar_irradiance(scene, column, lobes, depth, *, samples, path, fractions=(1.0,)):
    """Eou: the radiance of all directions below the horizon, integrated, band 0."""
    width, height = 64, 32
    scene.render.resolution_x, scene.render.resolution_y = width, height
    camera = _camera(scene, depth, (math.pi / 2, 0.0, 0.0))
    camera.data.type = "PANO"
    camera.data.panorama_type = "EQUIRECTANGULAR"
    pixels = _pixels(
        scene, camera, column, columns.layers_of(column, lobes, fractions), samples, path
    )[..., 0]
    below = pixels[height // 2 :]
    edges = np.linspace(0.0, math.pi / 2, height // 2 + 1)
    solid_angle = (np.sin(edges[1:]) - np.sin(edges[:-1])) * 2 * math.pi / width
    # Neighbours in azimuth see nearly the same radiance: they differ by noise. Around the whole
    # circle they would differ by the azimuthal variation of the light.
    per_pixel = below * solid_angle[:, None]
    total = per_pixel.sum()
    error = math.sqrt(((per_pixel - np.roll(per_pixel, 1, axis=1)) ** 2).sum() / 2)
    return Measurement(total, error)
