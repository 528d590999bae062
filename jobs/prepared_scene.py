"""A scene as jobs plan and render it, whatever else its file holds."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Sequence

import bpy

from ..scene import colour_space, contents
from ..scene.as_rendered import as_rendered
from ..scene.marks import require_no_water
from ..scene.materials import own_water
from ..scene.readers import stereo
from . import staging
from .stage import Stage


def require_usable(scene: bpy.types.Scene) -> None:
    """Refuse a scene with live water, another colour space, or parts that cannot be changed."""
    require_no_water(scene)
    if not bpy.app.background:  # there a worker makes them local
        contents.require_local(scene)
    colour_space.require_rec709()


@contextlib.contextmanager
def prepared(scene: bpy.types.Scene, hidden: Sequence[str], stage: Stage | None) -> Iterator[None]:
    """Show a scene as it is rendered while the block runs, on its stage.

    ``hidden`` names objects of water of its own that are left out.
    """
    with (
        own_water.hidden(scene, hidden),
        as_rendered(scene),
        stereo.two_eyes(scene),
        staging.staged(scene, stage),
    ):
        yield
