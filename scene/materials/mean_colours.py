"""What materials reflect and cover in the mean, by following the shader that is rendered."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import bpy
import numpy as np
from numpy.typing import NDArray

from ...node_groups import uplift
from ...uw_spectral.surface.refraction import REFRACTIVE_INDEX
from ...uw_spectral.surface.wet_reflectance import (
    GRAIN_INDEX,
    mean_cosine_of_grains,
    wet_reflectance_TwomeyEtAl1986,
)
from ...uw_spectral.transfer.closures import hair_albedo, sheen_albedo
from .. import contents
from ..stored_materials import is_porous
from .sampled_sockets import SampledSockets
from .shader_nodes import ShaderNode
from .shader_walk import GREY, Closure, ShaderWalk, mean
from .socket_rules import limits
from .surface_points import SurfacePoints
from .wet_trees import own_shader

Array = NDArray[np.float64]
Rgb = tuple[float, float, float]

_BARE: Rgb = (0.8, 0.8, 0.8)  # what Blender draws without a material
_BLACK: Rgb = (0.0, 0.0, 0.0)
_THINNEST = 1e-6
_GRAINS = GRAIN_INDEX / REFRACTIVE_INDEX
# Of what comes through, by the light on this side: sides seen are mostly the lit.
_FROM_BEHIND = 0.5
_SIDES = 64
_APART = 0.05  # of what is reflected or covered, by which it matters what a node gives
_UNKNOWN = Closure(colour=GREY)


@dataclass(frozen=True)
class MeanSurface:
    """What a surface reflects and covers in the mean."""

    colour: Rgb  #: Base colour of what covers, linear Rec.709.
    coverage: float  #: Fraction of light that it stops.
    anywhere: bool = True  #: All surfaces of the material have the same.
    unknown: tuple[str, ...] = ()  #: Nodes that decide it and are not known.


def mean_colour(material: bpy.types.Material | None) -> Rgb:
    """Mean base colour of a material of which all of its pictures shows, linear Rec.709."""
    return mean_surface(material).colour


def attributes_of(material: bpy.types.Material | None) -> set[str]:
    """Names of the attributes of meshes that a material reads; empty for the mesh's colours."""
    tree = None if material is None else material.node_tree
    return set() if tree is None else set(_attributes(tree, set()))


def _attributes(tree: bpy.types.NodeTree, known: set[bpy.types.NodeTree]) -> Iterator[str]:
    known.add(tree)
    for node in tree.nodes:
        inner = getattr(node, "node_tree", None)
        if inner is not None and inner not in known:
            yield from _attributes(inner, known)
        if node.bl_idname == "ShaderNodeVertexColor":
            yield node.layer_name
        elif node.bl_idname == "ShaderNodeAttribute" and node.attribute_type == "GEOMETRY":
            yield node.attribute_name


def mean_surface(
    material: bpy.types.Material | None, points: SurfacePoints | None = None
) -> MeanSurface:
    """Return what a material reflects and covers at points of a surface, in their mean.

    That of Blender's grey without a material. Without points all of its pictures counts, and
    attributes count as halfway.
    """
    if material is None:
        return MeanSurface(_BARE, 1.0)
    tree = material.node_tree
    shader = None if tree is None else own_shader(tree)
    if tree is None or shader is None:
        return MeanSurface(_rgb(material.diffuse_color), 1.0)
    if not shader.is_linked:
        output = contents.output_of(tree)
        is_volume = output is not None and output.inputs["Volume"].is_linked
        return MeanSurface(_BLACK, 0.0 if is_volume else 1.0)
    points = points or SurfacePoints()
    found = _shown(material, shader, SampledSockets(points))
    if found.unknown:
        ends = [_shown(material, shader, SampledSockets(points, end)) for end in (0.0, 1.0)]
        low, high = (np.array([*one.colour, 1.0]) * one.coverage for one in ends)
        if np.abs(high - low).max() <= _APART:
            return replace(found, unknown=())
    return found


def _shown(
    material: bpy.types.Material, shader: bpy.types.NodeSocket, sockets: SampledSockets
) -> MeanSurface:
    found = _SampledWalk(sockets).closure(shader)
    coverage = 1.0 - mean(np.atleast_2d(found.transmittance))
    colour = found.colour - (1.0 - _FROM_BEHIND) * found.behind
    coverage = np.clip(np.nan_to_num(coverage), 0.0, 1.0)
    shown = np.nan_to_num(np.atleast_2d(colour)) / np.maximum(coverage, _THINNEST)
    if is_porous(material):
        shown = wet_reflectance_TwomeyEtAl1986(
            np.clip(shown, 0.0, 1.0), mean_cosine_of_grains(_GRAINS), -1.0
        )
    covers = float(coverage.mean())
    whole = np.broadcast_to(shown * coverage, (max(len(shown), len(coverage)), 3)).mean(axis=0)
    reflected = _rgb(np.clip(whole / max(covers, _THINNEST), 0.0, 1.0))
    return MeanSurface(reflected, covers, not sockets.asked, tuple(sorted(sockets.unknown)))


@dataclass
class _SampledWalk(ShaderWalk):
    sockets: SampledSockets

    def value(self, socket: bpy.types.NodeSocket) -> Array:
        return np.clip(self.sockets.of(socket), *limits(socket))

    def closure(self, socket: bpy.types.NodeSocket) -> Closure:
        return self.sockets.followed(lambda: super(_SampledWalk, self).closure(socket), _UNKNOWN)

    def group(self, node: bpy.types.Node, output: bpy.types.NodeSocket) -> Closure:
        if getattr(node, "node_tree", output) is None:
            return Closure()
        return self.sockets.within(output, self.closure, _UNKNOWN)

    def colour(self, node: bpy.types.Node, row: ShaderNode) -> Array:
        colour = super().colour(node, row)
        if row.matte == uplift.SHEEN:
            return colour * _mean_sheen(float(self.sockets.of(node.inputs["Roughness"]).mean()))
        return np.asarray(hair_albedo(colour)) if row.matte == uplift.HAIR else colour


def _mean_sheen(roughness: float) -> float:
    """Fraction of light that a white sheen throws back, in the mean over a round object."""
    side = (np.arange(_SIDES) + 0.5) / _SIDES
    return float(np.mean(sheen_albedo(roughness, np.sqrt(side))))


def _rgb(values: object) -> Rgb:
    red, green, blue = (float(v) for v in np.asarray(values).ravel()[:3])
    return red, green, blue
