r"""Walk through the panel in a real Blender window and take a picture of each step.

    Xvfb :99 -screen 0 1280x960x24 & DISPLAY=:99 blender --window-geometry 0 0 1280 960 \
        -P tools/screenshots.py -- FOLDER [PATIENCE]

Needs the extension installed from its zip and enabled, ImageMagick's ``import``, and xdotool,
which drags an asset into the viewport. The steps call what the buttons call; ``status.txt`` in
the folder says how each went. Without a GPU shaders take minutes to compile: PATIENCE multiplies
the waits.
"""

from __future__ import annotations

import importlib
import subprocess
import sys
import time
import traceback
from collections.abc import Callable, Iterator
from pathlib import Path

import bpy

FOLDER, *_REST = (Path(word) for word in sys.argv[sys.argv.index("--") + 1 :])
_PATIENCE = float(str(_REST[0])) if _REST else 1.0
PACKAGE = "bl_ext.user_default.underwater_spectral"
SAMPLES = 4
LOOK, RIG, PARTICLES = "Blue hole", "Torch", "Snow"
_PAUSE = 1.5
_WINDOWS = ("start", "added", "assets", "dropped", "lamps_dropped", "particles_dropped")
_SHEETS = (
    ("looks", "essentials", "render", "water", "depth"),
    ("waves", "particles", "sun", "lamps", "sensor", "quality", "readouts"),
)


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


def picture(name: str, region: bpy.types.Region | None = None) -> None:
    """Take a picture of the whole screen, or of a region of the window."""
    crop = []
    if region is not None:
        top = bpy.context.window_manager.windows[0].height - region.y - region.height
        crop = ["-crop", f"{region.width}x{region.height}+{region.x}+{top}", "+repage"]
    command = ["import", "-window", "root", *crop, str(FOLDER / f"{name}.png")]
    subprocess.run(command, check=True)


def scene() -> bpy.types.Scene:
    """Return the scene of the window."""
    return bpy.context.window_manager.windows[0].scene


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
    scene().render.preview_pixel_size = "4"
    scene().eevee.taa_samples = SAMPLES
    yield from settle(_PAUSE)
    sidebar().active_panel_category = "Underwater"
    yield from settle(2 * _PAUSE)
    picture("start")
    call(bpy.ops.underwater.add_water, "EXEC_DEFAULT")
    yield from settle(40 * _PAUSE)
    picture("added")
    space.shading.type = "SOLID"
    yield from sections()
    yield from properties()
    space.shading.type = "RENDERED"
    yield from assets()
    sheets()


def properties() -> Iterator[float]:
    """Show the panels in the Properties editor, beside the object's."""
    areas = bpy.context.window_manager.windows[0].screen.areas
    editor = next(a for a in areas if a.type == "PROPERTIES")
    before, editor.spaces.active.context = editor.spaces.active.context, "SCENE"
    yield from settle(2 * _PAUSE)
    picture("properties")
    editor.spaces.active.context = before


def sections() -> Iterator[float]:
    """Show one section of the panel after the other, unfolded, the others away."""
    panels = importlib.import_module(f"{PACKAGE}.ui.panels")
    others = panels.CLASSES[1:]
    for cls in reversed((*others, *panels.PROPERTIES)):
        bpy.utils.unregister_class(cls)
    for cls in others:
        if cls is panels.AdvancedPanel:
            continue
        # Blender remembers by the name whether a panel is folded.
        name = cls.bl_idname
        facts = {"bl_idname": f"{name}_open", "bl_options": set()}
        facts["bl_parent_id"] = panels.MainPanel.bl_idname
        unfolded = type(cls.__name__, (cls,), facts)
        bpy.utils.register_class(unfolded)
        yield from settle(3 * _PAUSE)
        picture(f"section_{name.rpartition('_')[2]}", sidebar())
        bpy.utils.unregister_class(unfolded)
    for cls in (*others, *panels.PROPERTIES):
        bpy.utils.register_class(cls)


def sheets() -> None:
    """Lay the sections side by side without their tabs, as JPEG, and the windows too."""
    for number, names in enumerate(_SHEETS, 1):
        parts = [str(FOLDER / f"section_{name}.png") for name in names]
        cut = ["-gravity", "East", "-chop", "26x0", "-fuzz", "12%"]
        cut += ["-define", "trim:edges=south", "-trim", "+repage"]
        frame = ["-gravity", "North", "-background", "white", "-bordercolor", "white"]
        frame += ["-border", "8x0", "+append", "-quality", "85"]
        command = ["convert", *parts, *cut, *frame, str(FOLDER / f"sections_{number}.jpg")]
        subprocess.run(command, check=True)
    for name in _WINDOWS:
        picture = str(FOLDER / f"{name}.png")
        command = ["convert", picture, "-quality", "80", str(FOLDER / f"{name}.jpg")]
        subprocess.run(command, check=True)


def assets() -> Iterator[float]:
    """Add the library, look at it, and drag a look into the viewport."""
    call(bpy.ops.underwater.add_assets)
    before = set(bpy.context.window_manager.windows[0].screen.areas)
    call(bpy.ops.screen.area_split, direction="HORIZONTAL", factor=0.4)
    yield from settle(_PAUSE)
    created = set(bpy.context.window_manager.windows[0].screen.areas) - before
    below = min([*created, area()], key=lambda found: found.y)
    below.ui_type = "ASSETS"
    yield from settle(2 * _PAUSE)
    browser = below.spaces.active
    browser.params.asset_library_reference = "Underwater Spectral"
    browser.params.display_size = 80
    yield from settle(10 * _PAUSE)
    picture("assets")
    for name, shown in zip((LOOK, RIG, PARTICLES), _WINDOWS[3:], strict=True):
        # It is then the first and only one.
        browser.params.filter_search = name
        yield from settle(3 * _PAUSE)
        drag((below.x + 0.235 * below.width, below.y + 0.8 * below.height), middle(area()))
        yield from settle(40 * _PAUSE)
        picture(shown)
        (FOLDER / f"{shown}.txt").write_text(state())


def state() -> str:
    """Name what a drop may have changed: the world, objects with parents and modifiers."""
    lines = [f"world {scene().world.name}"]
    for item in scene().objects:
        parent = "" if item.parent is None else f" on {item.parent.name}"
        modifiers = ", ".join(m.name for m in item.modifiers)
        lines.append(f"{item.type} {item.name}{parent}: {modifiers}")
    return "\n".join(lines) + "\n"


def middle(of: bpy.types.Area) -> tuple[float, float]:
    """Return the middle of an area, in pixels of the window."""
    return of.x + 0.4 * of.width, of.y + 0.5 * of.height


def drag(start: tuple[float, float], end: tuple[float, float]) -> None:
    """Drag with the mouse, while Blender goes on with its events."""
    height = bpy.context.window_manager.windows[0].height
    words = ["sleep", "0.5"]
    for step in range(9):
        x, y = (a + (b - a) * step / 8 for a, b in zip(start, end, strict=True))
        words += ["mousemove", str(int(x)), str(int(height - y)), "sleep", "0.3"]
        words += ["mousedown", "1", "sleep", "0.3"] if step == 0 else []
    subprocess.Popen(["xdotool", *words, "mouseup", "1"])


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
