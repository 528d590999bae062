"""What stands for a Blender without extensions: the module bpy, with the profile it is given.

Takes ``--command extension install-file …`` and the commands of the extensions in the profile.
"""

from __future__ import annotations

import importlib
import sys

import bpy


def main(arguments: list[str]) -> int:
    if arguments[:3] == ["--command", "extension", "install-file"]:
        *options, file = arguments[3:]
        assert options == ["-r", "user_default", "-e"]
        bpy.ops.extensions.package_install_files(
            filepath=file, repo="user_default", enable_on_install=True
        )
        bpy.ops.wm.save_userpref()
        return 0
    import addon_utils  # found once bpy is there

    bpy.ops.wm.read_userpref()
    command, name, *rest = arguments
    assert command == "--command"
    for extension in bpy.context.preferences.addons.keys():  # noqa: SIM118 - not a dict
        if extension.startswith("bl_ext."):
            addon_utils.enable(extension)
            module = importlib.import_module(f"{extension}.ui.handlers")
            if name == module.COMMAND:
                return module.run_batch(rest)
    sys.stderr.write(f"Unrecognized command: {name}\n")
    return 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
