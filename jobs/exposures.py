"""How the views of a frame are developed: exposed, balanced and reduced to colours."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import ArrayLike

from ..settings.render_plan import RenderPlan
from .manifest import Development


def developments(
    plan: RenderPlan,
    depths: Sequence[float],
    lamplight: Sequence[ArrayLike | None],
    stops: float | None,
) -> Iterator[Development]:
    """Yield how each camera of a frame is developed; they share the exposure of the first.

    ``depths`` are those of the cameras, m; ``lamplight`` the irradiance of lamps that each exposes
    by, shape (n,); ``stops`` what the first camera's picture asks for, None for those of the light
    at it.
    """
    for depth, lit in zip(depths, lamplight, strict=True):
        view = plan.viewpoint(depth, stops, None if lit is None else np.asarray(lit, np.float64))
        stops = view.stops
        weights = view.reduction.weights.tolist()
        yield Development(view.reduction.description, tuple(map(tuple, weights)))
