"""Build an example scene: a .blend without light and water, ready for both.

Two ways to start, same options::

    python examples/build_scene.py reef|wreck|cave|pool OUT.blend [--seed N]
        [--detail draft|panel|full]
        [--camera NAME] [--lamps torch|strobes|rov2|rov4]
    blender -b -P examples/build_scene.py -- reef|wreck|cave|pool OUT.blend [--seed N] …
"""

from __future__ import annotations

import argparse
import importlib
import os
import runpy
import sys
from pathlib import Path
from types import ModuleType

import bpy


def _module(name: str) -> ModuleType:
    """Import a module as part of the repository root, whatever folder that lies in."""
    root = Path(__file__).resolve().parent.parent
    extension = runpy.run_path(str(root / "tools" / "load_checkout.py"))["load"]()
    return importlib.import_module(f"{extension.__name__}.{name}")


def choose_camera(name: str) -> None:
    """Let a camera of the open scene be the one that looks."""
    cameras = {item.name: item for item in bpy.context.scene.objects if item.type == "CAMERA"}
    if name not in cameras:
        sys.exit(f"no camera {name!r}; there are {', '.join(sorted(cameras))}")
    bpy.context.scene.camera = cameras[name]


def hang_lamps(rig: str) -> None:
    """Hang lamps on the camera that looks."""
    stored = _module("scene.stored_lamps")
    if not hasattr(bpy.types.Light, stored.PROPERTY):
        stored.register()
    _module("scene.water.lamp_rigs").add_rig(bpy.context.scene, rig)


def save_atomically(path: Path) -> None:
    """Save the open file under `path`, whole or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_name(f".{path.stem}.{os.getpid()}.partial.blend")
    try:
        bpy.ops.wm.save_as_mainfile(filepath=str(partial), copy=True, compress=True)
        partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)


def parser() -> argparse.ArgumentParser:
    """Return the command line."""
    scenes, rigs = _module("examples.scenes"), _module("scene.water.lamp_rigs").RIGS
    result = argparse.ArgumentParser(prog="build_scene.py", description=__doc__.split("\n")[0])
    result.add_argument("scene", choices=list(scenes.SCENES))
    result.add_argument("output", type=Path, metavar="OUT.blend")
    result.add_argument("--seed", type=int, default=1)
    result.add_argument("--detail", choices=sorted(scenes.DETAILS), default="full")
    result.add_argument("--camera", help="the one that looks")
    result.add_argument("--lamps", choices=list(rigs), help="that hang on it")
    return result


def main(arguments: list[str]) -> None:
    """Build, save, and say how large it is."""
    scenes, command = _module("examples.scenes"), parser()
    options = command.parse_args(arguments)
    if options.output.suffix != ".blend":
        command.error(f"{options.output} must end in .blend")
    if options.seed < 0:
        command.error(f"the seed must not be negative, got {options.seed}")
    # Unlike factory settings, this keeps the add-ons, and with them their Python packages.
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    scenes.build_scene(options.scene, options.seed, options.detail)
    if options.camera is not None:
        choose_camera(options.camera)
    if options.lamps is not None:
        hang_lamps(options.lamps)
    save_atomically(options.output)
    rendered, stored = scenes.count_triangles()
    print(f"{options.output}: {rendered} triangles rendered, {stored} stored")


if __name__ == "__main__":
    # Blender passes its own arguments too; those of the script follow "--".
    after = sys.argv.index("--") + 1 if "--" in sys.argv else 1
    main(sys.argv[after:])
