"""Draw the small pictures that the panel and the listing show, ray by ray, by the optics.

    python3 dev.py run tools/make_pictures.py thumbnails     into ui/thumbnails/
    python3 dev.py run tools/make_pictures.py icon           docs/listing/icon.png
    python3 dev.py run tools/make_pictures.py featured ...   docs/listing/featured.jpg ...

A thumbnail shows balls of three colours on sand at 4 m, in each look. The colours are those of
`quality.picture`, which EEVEE draws too; no shader has to be compiled. The others,
`featured`, `window` and so on (`photographs.py`), are Cycles', denoised; they take minutes to an
hour each without a GPU, and a job that was stopped goes on.
"""

from __future__ import annotations

import importlib
import runpy
import sys
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import OpenImageIO
import photographs

ROOT = Path(__file__).resolve().parent.parent
THUMBNAILS, LISTING = ROOT / "ui" / "thumbnails", ROOT / "docs" / "listing"
SIZE = (96, 60)
TONE = "nikon-d7000"
_FLOOR = 5.25
_COLOURS = ((0.75, 0.05, 0.03), (0.8, 0.8, 0.8), (0.85, 0.65, 0.05))
_SPECTRUM = (
    (0.20, 0.02, 0.45), (0.03, 0.10, 0.75), (0.02, 0.55, 0.60), (0.08, 0.60, 0.08),
    (0.85, 0.75, 0.04), (0.85, 0.30, 0.02), (0.70, 0.02, 0.02),
)  # fmt: skip


def start() -> bpy.types.Scene:
    """Register the extension in an empty file."""
    package = runpy.run_path(str(ROOT / "tools" / "load_checkout.py"))["load"]()
    bpy.ops.wm.read_factory_settings(use_empty=True)
    if not hasattr(bpy.types.Scene, "underwater"):
        package.register()
    return bpy.context.scene


def store(path: Path) -> None:
    """Store a copy of the open file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True, compress=True)


def grown() -> tuple[Any, Any, Any, Any]:
    """Return what the example scenes make corals and materials with, and shapes and cameras."""
    growth, materials, detail, shapes, cameras = (
        importlib.import_module(f"underwater_spectral.examples.parts.{name}")
        for name in ("growth", "materials", "detail", "shapes", "cameras")
    )
    chosen = detail.DETAILS["panel"]
    made = materials.Materials(1, chosen)
    return growth.Growth(1, chosen, made), made, shapes, cameras


def sand(materials: Any, depth: float) -> None:  # noqa: ANN401 - of the example scenes
    """Add a plane of their sand at a depth, m."""
    bpy.ops.mesh.primitive_plane_add(size=80.0, location=(0.0, 0.0, -depth))
    bpy.context.object.data.materials.append(materials.sand)


def paint(color: tuple[float, float, float]) -> bpy.types.Material:
    """Return a material of a plain colour."""
    material = bpy.data.materials.new("Paint")
    material.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (*color, 1.0)
    return material


def ball(place: tuple[float, float, float], radius: float, fine: int = 5) -> bpy.types.Mesh:
    """Add a ball, subdivided so often."""
    bpy.ops.mesh.primitive_ico_sphere_add(radius=radius, location=place, subdivisions=fine)
    return bpy.context.object.data


def camera(place: tuple[float, float, float], tilt: float, lens: float) -> None:
    """Add the camera; it looks along +y."""
    data = bpy.data.cameras.new("Camera")
    data.lens = lens
    item = bpy.data.objects.new("Camera", data)
    item.location, item.rotation_euler = place, (np.pi / 2 + tilt, 0.0, 0.0)
    bpy.context.scene.collection.objects.link(item)
    bpy.context.scene.camera = item
    bpy.context.view_layer.update()


def drawn(size: tuple[int, int], finer: int) -> np.ndarray:
    """Draw the scene by its settings, with ``finer`` rays across a pixel."""
    from underwater_spectral.quality.picture import Optics, picture
    from underwater_spectral.scene import stored_settings
    from underwater_spectral.scene.readers import view_tracing
    from underwater_spectral.settings.render_plan import plan_of
    from underwater_spectral.uw_spectral.spectra.colour_rendering import (
        luminance,
        metered_stops,
        srgb_encode,
    )
    from underwater_spectral.uw_spectral.spectra.tone import camera_curve

    scene = bpy.context.scene
    grid = finer * size[0], finer * size[1]
    scene.render.resolution_x, scene.render.resolution_y = size
    chosen = stored_settings.stored_settings(scene)
    plan, depth = plan_of(chosen), -scene.camera.matrix_world.translation.z
    view = plan.viewpoint(depth, 0.0)
    seen = view_tracing.trace_view(
        scene, scene.camera, plan.column, view.field, rays=grid[0] * grid[1], grid=grid, skyward=4,
        steps=1,
    )  # fmt: skip
    colours = picture(Optics(view), seen).without()
    gain = 2.0 ** metered_stops(np.maximum(luminance(colours), 0.0), seen.pixels)
    pixels = (gain * colours).reshape(size[1], finer, size[0], finer, 3).mean(axis=(1, 3))
    return srgb_encode(camera_curve(TONE)(np.maximum(pixels, 0.0)))


def save(path: Path, picture: np.ndarray) -> None:
    """Write a picture; JPEG progressive and small enough for a repository."""
    path.parent.mkdir(parents=True, exist_ok=True)
    picture = np.ascontiguousarray(np.clip(picture, 0.0, 1.0), dtype=np.float32)
    height, width = picture.shape[:2]
    spec = OpenImageIO.ImageSpec(width, height, 3, "uint8")
    if path.suffix == ".jpg":
        spec.attribute("Compression", "jpeg:80")
        spec.attribute("jpeg:progressive", 1)
    else:
        spec.attribute("png:compressionLevel", 9)
    buffer = OpenImageIO.ImageBuf(spec)
    buffer.set_pixels(OpenImageIO.ROI(0, width, 0, height), picture)
    if not buffer.write(str(path)):
        raise OSError(buffer.geterror())
    print(path.relative_to(ROOT), path.stat().st_size)  # noqa: T201


def thumbnails() -> None:
    """Draw every factory look."""
    scene = start()
    from underwater_spectral.ui import presets

    for index, colour in enumerate(_COLOURS):
        mesh = ball((1.15 * index - 1.15, 2.7 + 0.9 * index, -4.75), 0.5)
        mesh.materials.append(paint(colour))
    camera((0.0, 0.0, -4.3), -0.1, 26.0)
    water = scene.underwater
    water.surface, water.floor_reflectance, water.white_balance = "flat", "0.3", "daylight"
    for name, path in presets.names("look").items():
        if path.is_relative_to(ROOT):
            presets.apply("look", name)
            # Looks have floors that lie deeper than these balls.
            water.floor_depth = _FLOOR
            save(THUMBNAILS / "look" / f"{path.stem}.png", drawn(SIZE, 2))


def icon() -> None:
    """Draw a ball that carries the spectrum, in clear water."""
    scene = start()
    mesh = ball((0.0, 3.0, -2.5), 1.0, 7)
    for colour in _SPECTRUM:
        mesh.materials.append(paint(colour))
    for face in mesh.polygons:
        across = (face.center.x + 0.25 * face.center.z + 1.0) / 2.0
        face.material_index = min(max(int(across * len(_SPECTRUM)), 0), len(_SPECTRUM) - 1)
    camera((0.0, 0.0, -2.6), -0.02, 34.0)
    water = scene.underwater
    water.water, water.surface, water.white_balance = "jerlov:IA", "flat", "depth"
    water.floor_depth, water.floor_reflectance = 3.5, "0.3"
    save(LISTING / "icon.png", drawn((256, 256), 1))


def photograph(name: str) -> None:
    """Render an example scene for the listing."""
    image = OpenImageIO.ImageBuf(str(photographs.render(name, start)))
    save(LISTING / f"{name}.jpg", image.get_pixels(OpenImageIO.FLOAT)[..., :3])


def main() -> None:
    """Do the jobs of the command line."""
    jobs = {"thumbnails": thumbnails, "icon": icon}
    for job in sys.argv[1:]:
        if job in jobs:
            jobs[job]()
        elif job in photographs.PHOTOGRAPHS:
            photograph(job)
        else:
            sys.exit(f"no job {job!r}; there are {', '.join([*jobs, *photographs.PHOTOGRAPHS])}")


if __name__ == "__main__":
    main()
