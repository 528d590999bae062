"""How the views of a job are developed: exposed, balanced and reduced to colours."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from ..settings.render_plan import RenderPlan
from .manifest import Development, View

Light = tuple[RenderPlan, Sequence[ArrayLike | None], float | None]
"""Plan of a frame; the irradiance of lamps that each of its cameras exposes by, shape (n,); and the
stops that the picture of the first asks for, None for those of the light at it."""


def developed_views(
    views: Sequence[View], light_of: Callable[[int], Light]
) -> tuple[tuple[Development, ...], tuple[View, ...]]:
    """Return how views are developed, and the views, each with its place in that list.

    The cameras of a frame share the exposure of the first.
    """
    by_frame: dict[int, list[View]] = {}
    for view in views:
        by_frame.setdefault(view.frame, []).append(view)
    found, places = dict[Development, int](), dict[View, int]()
    for frame, seen in by_frame.items():
        plan, lamplight, stops = light_of(frame)
        for view, lit in zip(seen, lamplight, strict=True):
            light = None if lit is None else np.asarray(lit, np.float64)
            camera = plan.viewpoint(view.depth, stops, light)
            stops, reduction = camera.stops, camera.reduction
            weights = tuple(map(tuple, reduction.weights.tolist()))
            chosen = Development(reduction.description, weights)
            places[view] = found.setdefault(chosen, len(found))
    return tuple(found), tuple(replace(view, development=places[view]) for view in views)
