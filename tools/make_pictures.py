"""Render the pictures that the panel and the listing show, with EEVEE.

    python3 dev.py run tools/make_pictures.py thumbnails     into ui/thumbnails/
    python3 dev.py run tools/make_pictures.py icon           docs/listing/icon.png
    python3 dev.py run tools/make_pictures.py featured       docs/listing/featured.jpg

Everything is small but the last, which is 1920 x 1080. A thumbnail shows balls of three colours
on sand, at 4 m, each water and each look as the panel sets it.
"""

from __future__ import annotations

import runpy
import sys
import tempfile
from pathlib import Path

import bpy
import numpy as np
import OpenImageIO

ROOT = Path(__file__).resolve().parent.parent
THUMBNAILS, LISTING = ROOT / "ui" / "thumbnails", ROOT / "docs" / "listing"
SIZE = (160, 100)
_COLOURS = ((0.75, 0.05, 0.03, 1.0), (0.8, 0.8, 0.8, 1.0), (0.85, 0.65, 0.05, 1.0))
_SPECTRUM = (
    (0.20, 0.02, 0.45), (0.03, 0.10, 0.75), (0.02, 0.55, 0.60), (0.08, 0.60, 0.08),
    (0.85, 0.75, 0.04), (0.85, 0.30, 0.02), (0.70, 0.02, 0.02),
)  # fmt: skip


def start() -> bpy.types.Scene:
    """Register the extension in an empty file."""
    package = runpy.run_path(str(ROOT / "tools" / "load_checkout.py"))["load"]()
    bpy.ops.wm.read_factory_settings(use_empty=True)
    package.register()
    return bpy.context.scene


def painted() -> bpy.types.Material:
    """Return a material that shows the colours of a mesh: one for all, since each is compiled."""
    material = bpy.data.materials.new("Painted")
    nodes, links = material.node_tree.nodes, material.node_tree.links
    colour = nodes.new("ShaderNodeVertexColor")
    colour.layer_name = "colour"
    shader = nodes["Principled BSDF"]
    shader.inputs["Roughness"].default_value = 0.6
    links.new(colour.outputs["Color"], shader.inputs["Base Color"])
    return material


def ball(
    place: tuple[float, float, float], radius: float, material: bpy.types.Material
) -> bpy.types.Mesh:
    """Add a smooth ball, white so far."""
    bpy.ops.mesh.primitive_uv_sphere_add(radius=radius, location=place, segments=56, ring_count=28)
    mesh = bpy.context.object.data
    mesh.shade_smooth()
    mesh.materials.append(material)
    mesh.color_attributes.new("colour", "FLOAT_COLOR", "POINT")
    return mesh


def paint(mesh: bpy.types.Mesh, colours: np.ndarray) -> None:
    """Give the vertices of a mesh colours, shape (n, 4)."""
    data = mesh.color_attributes["colour"].data
    data.foreach_set("color", np.asarray(colours, dtype=np.float32).ravel())


def camera(place: tuple[float, float, float], tilt: float, lens: float) -> None:
    """Add the camera; it looks along +y."""
    data = bpy.data.cameras.new("Camera")
    data.lens = lens
    item = bpy.data.objects.new("Camera", data)
    item.location, item.rotation_euler = place, (np.pi / 2 + tilt, 0.0, 0.0)
    bpy.context.scene.collection.objects.link(item)
    bpy.context.scene.camera = item


def render(size: tuple[int, int], samples: int) -> np.ndarray:
    """Render the scene of the window; return display values, shape (h, w, 3)."""
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = size
    scene.render.resolution_percentage = 100
    scene.eevee.taa_render_samples = samples
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "picture.png"
        scene.render.image_settings.media_type = "IMAGE"
        scene.render.image_settings.file_format = "PNG"
        scene.render.filepath = str(path)
        bpy.ops.render.render(write_still=True)
        return np.asarray(OpenImageIO.ImageBuf(str(path)).get_pixels(OpenImageIO.FLOAT)[..., :3])


def save(path: Path, picture: np.ndarray) -> None:
    """Write a picture; JPEG at good quality."""
    path.parent.mkdir(parents=True, exist_ok=True)
    picture = np.ascontiguousarray(np.clip(picture, 0.0, 1.0), dtype=np.float32)
    height, width = picture.shape[:2]
    spec = OpenImageIO.ImageSpec(width, height, 3, "uint8")
    if path.suffix == ".jpg":
        spec.attribute("Compression", "jpeg:88")
    else:
        spec.attribute("png:compressionLevel", 9)
    buffer = OpenImageIO.ImageBuf(spec)
    buffer.set_pixels(OpenImageIO.ROI(0, width, 0, height), picture)
    if not buffer.write(str(path)):
        raise OSError(buffer.geterror())
    print(path.relative_to(ROOT), path.stat().st_size)  # noqa: T201


def thumbnails() -> None:
    """Render every factory water and look."""
    from underwater_spectral.scene import live
    from underwater_spectral.ui import presets

    scene = start()
    material = painted()
    for index, colour in enumerate(_COLOURS):
        mesh = ball((1.15 * index - 1.15, 2.7 + 0.9 * index, -4.75), 0.5, material)
        paint(mesh, np.tile(colour, (len(mesh.vertices), 1)))
    camera((0.0, 0.0, -4.3), -0.1, 26.0)
    bpy.context.view_layer.update()
    water = scene.underwater
    water.surface, water.floor_depth, water.floor_reflectance = "flat", 5.25, "0.3"
    water.white_balance, water.exposure, water.tone = "depth", "auto-picture", "nikon-d7000"
    live.add(scene)
    for kind in ("water", "look"):
        for name, path in presets.names(kind).items():
            if not path.is_relative_to(ROOT):
                continue
            presets.apply(kind, name)
            # Looks differ in floors that lie deeper than these balls.
            water.floor_depth = 5.25
            save(THUMBNAILS / kind / f"{path.stem}.png", render(SIZE, 8))


def icon() -> None:
    """Render a ball that carries the spectrum, in clear water under waves."""
    scene = start()
    mesh = ball((0.0, 3.0, -2.3), 1.0, painted())
    height = np.array([v.co.x + 0.25 * v.co.z for v in mesh.vertices])
    stripe = np.clip((height + 1.0) / 2.0 * len(_SPECTRUM), 0, len(_SPECTRUM) - 1).astype(int)
    paint(mesh, np.array([(*_SPECTRUM[i], 1.0) for i in stripe]))
    camera((0.0, 0.0, -2.5), 0.08, 32.0)
    bpy.context.view_layer.update()
    water = scene.underwater
    water.water, water.surface, water.wind_speed = "jerlov:IA", "waves", 5.0
    water.white_balance, water.exposure, water.tone = "depth", "auto-picture", "nikon-d7000"
    water.floor_depth, water.floor_reflectance = 3.35, "0.35"
    bpy.ops.underwater.add_water(start=False)
    save(LISTING / "icon.png", render((256, 256), 16))


def featured() -> None:
    """Render the example wreck."""
    start()
    bpy.ops.underwater.add_example(example="wreck")
    save(LISTING / "featured.jpg", render((1920, 1080), 8))


if __name__ == "__main__":
    for job in sys.argv[1:]:
        {"thumbnails": thumbnails, "icon": icon, "featured": featured}[job]()
