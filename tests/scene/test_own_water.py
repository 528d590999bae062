"""Water of a scene's own is named; what only looks a little like it is not."""

from __future__ import annotations

import bpy
import pytest
from underwater_spectral.scene.unheeded import unheeded
from underwater_spectral.tests.scene import scenes

pytestmark = pytest.mark.usefixtures("registered")


def _plane(size, z, node, **inputs):
    bpy.ops.mesh.primitive_plane_add(size=size, location=(0.0, 0.0, z))
    item, material = bpy.context.object, bpy.data.materials.new("Sea")
    tree = material.node_tree
    tree.nodes.clear()
    shader, output = tree.nodes.new(node), tree.nodes.new("ShaderNodeOutputMaterial")
    for name, value in inputs.items():
        shader.inputs[name.replace("_", " ")].default_value = value
    target = "Volume" if "Volume" in node else "Surface"
    tree.links.new(shader.outputs[0], output.inputs[target])
    item.data.materials.append(material)
    return item


def _fog(size):
    item = _plane(1.0, -5.0, "ShaderNodeVolumePrincipled")
    item.data.clear_geometry()
    s = size / 2.0
    corners = [(x, y, z) for x in (-s, s) for y in (-s, s) for z in (-s, s)]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    item.data.from_pydata(corners, [], faces)
    item.location.x = 0.5


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: _plane(80.0, 0.3, "ShaderNodeBsdfGlass"), "looks like a water surface"),
        (
            lambda: _plane(80.0, 0.0, "ShaderNodeBsdfPrincipled", Transmission_Weight=1.0),
            "looks like a water surface",
        ),
        (lambda: _fog(40.0), "has a volume, and the camera is in it"),
        (lambda: _plane(80.0, 0.0, "ShaderNodeBsdfPrincipled"), ""),
        (lambda: _plane(80.0, -9.0, "ShaderNodeBsdfGlass"), ""),
        (lambda: _plane(2.0, 0.0, "ShaderNodeBsdfGlass"), ""),
        (lambda: _fog(0.5), ""),
    ],
    ids=["glass", "transmission", "body", "matte", "deep", "small", "aside"],
)
def test_it_is_named(make, words):
    scenes.add_camera((0.0, 0.0, -5.0))
    make()
    bpy.context.view_layer.update()
    found = [note for note in unheeded(bpy.context.scene) if "hide it in renders" in note]
    assert len(found) == bool(words)
    assert all(words in note and "'Plane'" in note for note in found)
