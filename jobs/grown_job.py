"""A job that goes on with other frames: what was planned before stays in its manifest."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

from .manifest import Development, Exposed, Manifest, View


def with_earlier(earlier: Manifest, now: Manifest) -> Manifest:
    """Return a job with the frames of an earlier one beside its own, in order.

    The water is as wide as the wider one. Frames of both are as they are planned now. Jobs of other
    cameras or passes have no frames in common; then this is the job as it is now. The jobs have no
    :func:`.manifest.differences`.
    """
    extents = zip(earlier.output.extent, now.output.extent, strict=True)
    wide, deep = (max(pair) for pair in extents)
    made = replace(now, output=replace(now.output, extent=(wide, deep)))
    old = [frame for frame in earlier.frames if frame not in now.frames]
    if not old or earlier.cameras != now.cameras or earlier.passes != now.passes:
        return made
    source = dict.fromkeys(old, earlier) | dict.fromkeys(now.frames, now)
    frames = tuple(sorted(source))
    base = vars(source[frames[0]].settings_of(frames[0]))
    changes = {}
    for frame in frames:
        values = vars(source[frame].settings_of(frame))
        other = {name: value for name, value in values.items() if value != base[name]}
        if other:
            changes[frame] = other
    developments, views = _views(source, frames, now)
    return replace(
        made,
        frames=frames,
        settings=dict(base),
        changes=changes,
        developments=developments,
        views=views,
        lamps=_changed(source, frames, Manifest.lamps_of, ()),
        clouds=_changed(source, frames, Manifest.clouds_of, ()),
        exposed=_changed(source, frames, Manifest.exposed_of, Exposed()),
    )


def _views(
    source: Mapping[int, Manifest], frames: tuple[int, ...], now: Manifest
) -> tuple[tuple[Development, ...], tuple[View, ...]]:
    """Cameras in turn, the frames of each in order."""
    found: dict[Development, int] = {}
    known = {
        id(job): {(view.camera, view.frame): view for view in job.views} for job in source.values()
    }
    views = []
    for camera in now.cameras:
        for frame in frames:
            job = source[frame]
            view = known[id(job)][camera.name, frame]
            chosen = job.developments[view.development]
            views.append(replace(view, development=found.setdefault(chosen, len(found))))
    return tuple(found), tuple(views)


def _changed[Value](
    source: Mapping[int, Manifest],
    frames: tuple[int, ...],
    of_frame: Callable[[Manifest, int], Value],
    before: Value,
) -> dict[int, Value]:
    """Return what frames have, where it is not as at the frame before."""
    found: dict[int, Value] = {}
    for frame in frames:
        now = of_frame(source[frame], frame)
        if now != before:
            found[frame] = before = now
    return found
