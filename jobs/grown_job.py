"""A job that goes on with other frames: what was planned before stays in its manifest."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from .manifest import Development, Exposed, Manifest, View, changed, settings_by_frame


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
    settings, changes = settings_by_frame((n, source[n].settings_of(n)) for n in frames)
    developments, views = _views(source, frames, now)
    return replace(
        made,
        frames=frames,
        settings=settings,
        changes=changes,
        developments=developments,
        views=views,
        lamps=changed(((n, source[n].lamps_of(n)) for n in frames), ()),
        clouds=changed(((n, source[n].clouds_of(n)) for n in frames), ()),
        exposed=changed(((n, source[n].exposed_of(n)) for n in frames), Exposed()),
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
