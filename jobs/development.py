"""Develops band images into an RGB image through the sensor, in Blender's compositor.

A picture is denoised as a whole: bands that are denoised one by one lose different details, which
shows as blotches of colour.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ..datasets.layer_file import FrameLayers
from ..node_groups import sensor_reduction
from ..scene.engines.denoising_guides import ALBEDO, NORMAL
from ..scene.engines.exr_output import write_float_exr
from ..uw_spectral.spectra.spectral_image import read_exr, write_rgb_exr
from .render_region import Region

_NAME = "UW Development"


@dataclass(frozen=True, eq=False)
class Guides:
    """Albedo and normal of what a picture shows, shape (h, w, 3) each."""

    albedo: NDArray[np.float64]
    normal: NDArray[np.float64]


def develop(
    images: Sequence[Path],
    weights: NDArray[np.float64],
    passes: Sequence[tuple[int, ...]],
    *,
    denoise: bool = False,
    guides: Guides | None = None,
    region: Region | None = None,
) -> NDArray[np.float32]:
    """Combine band images into a scene-linear RGB image of the region, shape (height, width, 3).

    ``images`` are float EXRs, one for each of the ``passes``, which are the bands that it carries;
    ``weights``, shape (3, n), linear RGB per unit radiance of each band; ``region`` what there is
    of the images.
    """
    with _Tree(images, passes, region) as tree:
        if not denoise:
            return tree.rendered(tree.weighed(weights))
        sockets = tree.guides(guides) if guides is not None else ()
        # The denoiser takes what is below zero for zero, and so would lose colours out of gamut:
        # a grey picture is added that lifts them above it.
        lift = np.maximum(-weights, 0.0).max(axis=0)
        image = tree.denoised(tree.weighed(weights + lift), sockets)
        if lift.any():
            grey = tree.denoised(tree.weighed(np.broadcast_to(lift, weights.shape)), sockets)
            image = tree.difference(image, grey)
        return tree.rendered(image)


class _Tree:
    """A scene of the compositor, with the band images loaded; gone after the block."""

    def __init__(
        self, images: Sequence[Path], passes: Sequence[tuple[int, ...]], region: Region | None
    ) -> None:
        self._paths, self._passes, self._region = images, passes, region
        self._groups: list[bpy.types.NodeTree] = []
        self._images: list[bpy.types.Image] = []
        self._folder = tempfile.TemporaryDirectory()

    def __enter__(self) -> _Tree:
        self._scene = bpy.data.scenes.new(_NAME)
        self._tree = bpy.data.node_groups.new(_NAME, "CompositorNodeTree")
        self._groups.append(self._tree)
        try:
            self._sources = [self._loaded(path) for path in self._paths]
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        bpy.data.scenes.remove(self._scene)
        for group in self._groups:
            bpy.data.node_groups.remove(group)
        for image in self._images:
            bpy.data.images.remove(image)
        self._folder.cleanup()

    def _loaded(self, path: Path) -> bpy.types.NodeSocket:
        if self._region is not None:
            cut = self._region.cut(read_exr(path)[0])
            path = Path(self._folder.name, f"{len(self._images)}.exr")
            write_rgb_exr(path, cut)
        image = bpy.data.images.load(str(path))
        self._images.append(image)
        image.colorspace_settings.is_data = True
        source = self._tree.nodes.new("CompositorNodeImage")
        source.image = image
        return source.outputs["Image"]

    def weighed(self, weights: NDArray[np.float64]) -> bpy.types.NodeSocket:
        """Return the bands through weights."""
        sensor = sensor_reduction.build(weights, self._passes)
        self._groups.append(sensor)
        group = self._tree.nodes.new("CompositorNodeGroup")
        group.node_tree = sensor
        for source, socket in zip(self._sources, group.inputs, strict=True):
            self._tree.links.new(source, socket)
        return group.outputs["Image"]

    def guides(self, guides: Guides) -> tuple[bpy.types.NodeSocket, ...]:
        """Return albedo and normal."""
        found = []
        for name, values in (("albedo", guides.albedo), ("normal", guides.normal)):
            path = Path(self._folder.name, f"{name}.exr")
            write_rgb_exr(path, values)
            found.append(self._loaded(path))
        return tuple(found)

    def denoised(
        self, image: bpy.types.NodeSocket, guides: Sequence[bpy.types.NodeSocket]
    ) -> bpy.types.NodeSocket:
        """Return an image without its noise."""
        node = self._tree.nodes.new("CompositorNodeDenoise")
        node.inputs["HDR"].default_value = True
        # What water scatters is noise in the guides too.
        node.inputs["Prefilter"].default_value = "Accurate"
        node.inputs["Quality"].default_value = "High"
        for source, socket in zip((image, *guides), node.inputs, strict=False):
            self._tree.links.new(source, socket)
        return node.outputs["Image"]

    def difference(
        self, one: bpy.types.NodeSocket, other: bpy.types.NodeSocket
    ) -> bpy.types.NodeSocket:
        """Return an image less another."""
        node = self._tree.nodes.new("ShaderNodeVectorMath")
        node.operation = "SUBTRACT"
        for source, socket in zip((one, other), node.inputs, strict=False):
            self._tree.links.new(source, socket)
        return node.outputs["Vector"]

    def rendered(self, image: bpy.types.NodeSocket) -> NDArray[np.float32]:
        """Return the pixels of an image; Blender's own header knows this scene alone."""
        tree, scene = self._tree, self._scene
        tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
        output = tree.nodes.new("NodeGroupOutput")
        tree.links.new(image, output.inputs["Image"])
        scene.compositing_node_group = tree
        scene.render.compositor_device = "CPU"
        scene.render.resolution_x, scene.render.resolution_y = self._images[0].size
        path = Path(self._folder.name, "picture.exr")
        write_float_exr(scene, path)
        return read_exr(path)[0]


def mean_guides(
    found: Sequence[tuple[FrameLayers, tuple[int, ...], int]], weights: NDArray[np.float64]
) -> Guides:
    """Return the guides of a picture, of layers, bands and samples of every pass.

    An albedo counts by the size of the ``weights``, shape (3, n), of its bands in the picture.
    """
    height, width = found[0][0][NORMAL].shape[:2]
    albedo, normal = np.zeros((height, width, weights.shape[1])), np.zeros((height, width, 3))
    counts = np.zeros(weights.shape[1])
    for layers, bands, samples in found:
        albedo[..., list(bands)] += samples * layers[ALBEDO]
        counts[list(bands)] += samples
        normal += samples * layers[NORMAL]
    size = np.abs(weights)
    fractions = size / np.maximum(size.sum(axis=1, keepdims=True), np.finfo(float).tiny)
    total = sum(samples for _, _, samples in found)
    return Guides(albedo / counts @ fractions.T, normal / total)
