r"""Walk through the panel in a real Blender window and take a picture of each step.

    Xvfb :99 -screen 0 1280x960x24 & DISPLAY=:99 blender --window-geometry 0 0 1280 960 \
        -P tools/screenshots.py -- FOLDER [PATIENCE]

Needs the extension installed and enabled, and ImageMagick's ``import``. The
steps call what the buttons call; ``status.txt`` in the folder says how each went.
Without a GPU shaders take minutes to compile: PATIENCE multiplies the waits.
"""

from __future__ import annotations

import subprocess
import sys
import time
import traceback
from collections.abc import Callable, Iterator
from pathlib import Path

import bpy

FOLDER, *_REST = (Path(word) for word in sys.argv[sys.argv.index("--") + 1 :])
_PATIENCE = float(str(_REST[0])) if _REST else 1.0
SAMPLES = 4
_PAUSE = 1.5
_SCROLL_STEP = 40
_TIMEOUT = 900.0


def area() -> bpy.types.Area:
    """Return the largest 3D viewport."""
    areas = [a for a in bpy.context.window_manager.windows[0].screen.areas if a.type == "VIEW_3D"]
    return max(areas, key=lambda a: a.width * a.height)


def sidebar() -> bpy.types.Region:
    """Return its sidebar."""
    return next(r for r in area().regions if r.type == "UI")


def call(operator: Callable[..., set[str]], *arguments: str, **properties: object) -> None:
    """Call an operator as if the mouse were in the viewport."""
    window = bpy.context.window_manager.windows[0]
    region = next(r for r in area().regions if r.type == "WINDOW")
    with bpy.context.temp_override(window=window, area=area(), region=region):
        operator(*arguments, **properties)


def scroll(pixels: int) -> None:
    """Scroll the sidebar down, or up where negative."""
    window = bpy.context.window_manager.windows[0]
    with bpy.context.temp_override(window=window, area=area(), region=sidebar()):
        step = bpy.ops.view2d.scroll_down if pixels > 0 else bpy.ops.view2d.scroll_up
        for _ in range(abs(pixels) // _SCROLL_STEP):
            step(deltax=0, deltay=_SCROLL_STEP)


def picture(name: str) -> None:
    """Take a picture of the whole screen."""
    command = ["import", "-window", "root", str(FOLDER / f"{name}.png")]
    subprocess.run(command, check=True)


def scene() -> bpy.types.Scene:
    """Return the scene of the window."""
    return bpy.context.window_manager.windows[0].scene


def build() -> None:
    """Replace the default cube by coloured balls at growing distances from the camera."""
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    colours = [(0.8, 0.05, 0.03), (0.9, 0.4, 0.05), (0.8, 0.7, 0.1), (0.1, 0.5, 0.1), (0.9,) * 3]
    for index, colour in enumerate(colours):
        bpy.ops.mesh.primitive_uv_sphere_add(
            radius=0.7, location=(1.7 * index - 3.4, 2.0 * index, 2.0), segments=24, ring_count=12
        )
        ball = bpy.context.object
        bpy.ops.object.shade_smooth()
        material = bpy.data.materials.new(f"ball {index}")
        shader = material.node_tree.nodes["Principled BSDF"]
        shader.inputs["Base Color"].default_value = (*colour, 1.0)
        ball.data.materials.append(material)
    camera = scene().camera
    camera.location, camera.rotation_euler = (-2.0, -9.0, 2.6), (1.5, 0.0, -0.22)


def settle(seconds: float) -> Iterator[float]:
    """Wait, and let the sidebar draw until its panels have found their places."""
    end = time.monotonic() + _PATIENCE * seconds
    while time.monotonic() < end:
        area().tag_redraw()
        yield 0.3


def walk() -> Iterator[float]:
    """Yield the seconds to wait after each step."""
    space = area().spaces.active
    space.show_region_ui = True
    space.overlay.show_overlays = False
    scene().render.preview_pixel_size = "8"
    scene().eevee.taa_samples = SAMPLES
    scene().underwater.samples = SAMPLES
    if "Cube" in bpy.data.objects:
        build()
    yield from settle(_PAUSE)
    sidebar().active_panel_category = "Underwater"
    yield from settle(_PAUSE)
    picture("01_start")
    call(bpy.ops.underwater.add_water, "EXEC_DEFAULT")
    yield from settle(4 * _PAUSE)
    picture("02_added")
    call(bpy.ops.underwater.submerge, "EXEC_DEFAULT", depth=5.0)
    names = {path.stem: path for path in presets("look")}
    call(bpy.ops.underwater.apply_preset, filepath=str(names["Tropical_reef"]),
         menu_idname="UNDERWATER_PT_look_presets")  # fmt: skip
    space.region_3d.view_perspective = "CAMERA"
    space.shading.type = "RENDERED"
    yield from settle(20 * _PAUSE)
    picture("03_tropical_reef")
    scroll(420)
    yield from settle(2 * _PAUSE)
    picture("04_water")
    scene().underwater_panel.gallery = "JERLOV_3C"
    yield from settle(8 * _PAUSE)
    picture("05_jerlov_3C")
    scene().underwater_panel.gallery = "JERLOV_IB"
    scroll(520)
    scene().underwater.sensor = "ARRI D21"
    yield from settle(8 * _PAUSE)
    picture("06_camera")
    scroll(600)
    scene().underwater_panel.quality = "BANDS"
    call(bpy.ops.underwater.auto, "EXEC_DEFAULT")
    yield from settle(8 * _PAUSE)
    picture("07_quality_readouts")
    scene().render.resolution_x, scene().render.resolution_y = 240, 135
    scene().render.resolution_percentage = 100
    scene().underwater_panel.output = str(FOLDER / "render")
    call(bpy.ops.underwater.render, "INVOKE_DEFAULT")
    started = time.monotonic()
    shown = False
    while time.monotonic() - started < _TIMEOUT:
        done = sorted((FOLDER / "render" / "passes").glob("*/pass_*.exr"))
        if done and not shown:
            picture("08_rendering")
            shown = True
        if list((FOLDER / "render").glob("[0-9]*.json")):
            break
        yield 0.2
    yield from settle(8 * _PAUSE)
    picture("09_last_pass")
    scroll(-3000)
    call(bpy.ops.underwater.remove_water, "EXEC_DEFAULT")
    yield from settle(6 * _PAUSE)
    picture("10_removed")


def presets(kind: str) -> list[Path]:
    """Return the factory presets of a kind."""
    folders = bpy.utils.preset_paths(f"underwater_spectral/{kind}")
    return [path for folder in folders for path in Path(folder).glob("*.py")]


def main() -> None:
    """Run the walk in timers, so that the window draws between the steps."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    preferences = bpy.context.preferences
    preferences.view.show_splash = False
    preferences.view.ui_scale = 0.85
    steps = walk()

    def next_step() -> float | None:
        try:
            return next(steps)
        except StopIteration:
            (FOLDER / "status.txt").write_text("done\n")
        except Exception:  # noqa: BLE001 - the walk ends, and says why
            (FOLDER / "status.txt").write_text(traceback.format_exc())
            traceback.print_exc()
        bpy.ops.wm.quit_blender()
        return None

    bpy.app.timers.register(next_step, first_interval=3.0)


main()
