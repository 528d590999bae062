"""Inelastic light in the real-time groups: a few more exponentials of depth in each band."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.transfer.inelastic_light import DepthExponential, InelasticLight
from .node_mathematics import NODES, NodeValue

if TYPE_CHECKING:
    from .realtime_values import Values

_QUANTITIES = ("rate", "emission", "E0", "F")


def _name(quantity: str, index: int) -> str:
    return f"inelastic {quantity} {index}"


def band_names(rising: tuple[bool, ...]) -> list[str]:
    """Names of the quantities per band, for exponentials that rise or fall with depth."""
    return [_name(quantity, i) for i in range(len(rising)) for quantity in _QUANTITIES]


def of_light(light: InelasticLight) -> dict[str, NDArray[np.float64]]:
    """Return the numbers of light that was made by :func:`.inelastic_light.reduced`."""
    return {
        _name(quantity, i): getattr(term, quantity)
        for i, term in enumerate(light.terms)
        for quantity in _QUANTITIES
    }


def inelastic_light(values: Values) -> InelasticLight:
    """Return the light of three bands over terms."""
    terms = tuple(
        DepthExponential(rising=rising, **{q: values[_name(q, i)] for q in _QUANTITIES})
        for i, rising in enumerate(values.shape.inelastic)
    )
    return InelasticLight(values.water.field, terms)


def background(
    values: Values, y: NodeValue, w: tuple[NodeValue, NodeValue, NodeValue], index: NodeValue
) -> NodeValue:
    """Inelastic radiance of undisturbed water; a surface mirrors it as if it were flat."""
    light = inelastic_light(values)
    mirrored = light.under_surface(w, index, NODES) if values.shape.flat else 0.0
    return light.background(y, w, mirrored, NODES)
