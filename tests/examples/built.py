"""Build a draft, and ask what is in it."""

from __future__ import annotations

import bpy
import numpy as np
from mathutils import Vector
from underwater_spectral.examples.parts.shapes import Shape
from underwater_spectral.examples.scenes import build_scene


def fresh(name: str, seed: int) -> bpy.types.Scene:
    """Build a draft in an empty file."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    build_scene(name, seed, "draft")
    bpy.context.view_layer.update()
    return bpy.context.scene


def _in_world(item: bpy.types.Object) -> np.ndarray:
    flat = np.empty(3 * len(item.data.vertices), np.float32)
    item.data.vertices.foreach_get("co", flat)
    matrix = np.array(item.matrix_world)
    return flat.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]


def world_vertices() -> dict[str, np.ndarray]:
    """Vertices of every mesh object in the world."""
    return {item.name: _in_world(item) for item in bpy.data.objects if item.type == "MESH"}


def closed_shape(item: bpy.types.Object) -> Shape:
    """Mesh of an object in the world."""
    corners = np.empty(3 * len(item.data.polygons), np.int32)
    item.data.loops.foreach_get("vertex_index", corners)
    return Shape(_in_world(item).astype(float), corners.reshape(-1, 3).astype(np.int64))


def openness(scene: bpy.types.Scene, point: np.ndarray, rays: int = 300) -> float:
    """Fraction of even light from above that reaches a point."""
    index = np.arange(rays) + 0.5
    up, angle = np.sqrt(1 - index / rays), index * 2.399963
    across = np.sqrt(1 - up**2)
    ways = np.stack([across * np.cos(angle), across * np.sin(angle), up], axis=1)
    graph = bpy.context.evaluated_depsgraph_get()
    return float(np.mean([not scene.ray_cast(graph, point, way)[0] for way in ways]))


def distance(scene: bpy.types.Scene, point: np.ndarray, rays: int = 200) -> float:
    """Distance from a point to what is nearest in any of many directions."""
    index = np.arange(rays) + 0.5
    up, angle = 1 - 2 * index / rays, index * 2.399963
    across = np.sqrt(1 - up**2)
    ways = np.stack([across * np.cos(angle), across * np.sin(angle), up], axis=1)
    graph = bpy.context.evaluated_depsgraph_get()
    hits = [scene.ray_cast(graph, point, way) for way in ways]
    return min(float(np.linalg.norm(hit[1] - Vector(point))) for hit in hits if hit[0])


def floor_under(scene: bpy.types.Scene, point: np.ndarray) -> float:
    """Height z of what is under a point."""
    graph = bpy.context.evaluated_depsgraph_get()
    below, floor, *_ = scene.ray_cast(graph, point, (0, 0, -1))
    assert below
    return floor.z


def unread() -> list[tuple[str, str]]:
    """Meshes that lack an attribute or a UV map which one of their materials reads."""
    found = []
    for mesh in bpy.data.meshes:
        for material in mesh.materials:
            for node in material.node_tree.nodes:
                lacks = node.type == "ATTRIBUTE" and node.attribute_name not in mesh.attributes
                uv = node.type == "TEX_COORD" and node.outputs["UV"].is_linked
                if lacks or (uv and not mesh.uv_layers):
                    found.append((mesh.name, material.name))
    return found


def assert_materials_end_in_an_output() -> None:
    """Every material is used, has no broken link, and is a Principled BSDF."""
    for material in bpy.data.materials:
        tree = material.node_tree
        output = tree.get_output_node("ALL")
        assert output is not None, material.name
        (link,) = output.inputs["Surface"].links
        assert link.from_node.type == "BSDF_PRINCIPLED", material.name
        assert all(found.is_valid for found in tree.links), material.name
        assert material.users, material.name
