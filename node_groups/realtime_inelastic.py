"""Inelastic light in the real-time groups: a few more exponentials of depth in each band."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.mathematics import Operand
from ..uw_spectral.transfer.inelastic_light import DepthExponential, InelasticLight
from ..uw_spectral.transfer.light_field import LightField

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


def light_of(
    field: LightField, rising: tuple[bool, ...], number: Callable[[str], Operand]
) -> InelasticLight:
    """Return the light whose quantities have these values, by :func:`band_names`."""
    terms = tuple(
        DepthExponential(rising=up, **{q: number(_name(q, i)) for q in _QUANTITIES})
        for i, up in enumerate(rising)
    )
    return InelasticLight(field, terms)
