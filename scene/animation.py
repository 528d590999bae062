"""What moves a property of a data-block."""

from __future__ import annotations

from collections.abc import Iterator

import bpy


def curves(block: bpy.types.ID, path: str) -> Iterator[bpy.types.FCurve]:
    """Yield the animation curves and drivers of a property, those of NLA strips too."""
    data = block.animation_data
    if data is None:
        return
    actions = [data.action, *(s.action for track in data.nla_tracks for s in track.strips)]
    yield from (curve for curve in data.drivers if curve.data_path == path)
    for action in dict.fromkeys(action for action in actions if action is not None):
        yield from (curve for curve in curves_of(action) if curve.data_path == path)


def curves_of(action: bpy.types.Action) -> Iterator[bpy.types.FCurve]:
    """Yield every curve of an action."""
    for layer in action.layers:
        for strip in layer.strips:
            for bag in strip.channelbags:
                yield from bag.fcurves
