"""A lamp of Blender's as a light in the water, spectrally."""

from __future__ import annotations

import numpy as np

from ...uw_spectral.lamps.emission import (
    intensity_of_colour,
    parse_emission,
    radiant_intensity,
    without_light_beyond,
)
from ...uw_spectral.lamps.lamp import Lamp
from ...uw_spectral.spectra.bands import Bands
from ...uw_spectral.spectra.illuminant import RELATIVE, full_sun
from .. import marks
from ..stored_lamps import stored_lamp
from .lamp_files import SPECTRUM, files_of
from .lamp_form import axis_of, colour_of, form_of
from .lamp_nodes import LampNodes
from .shown_lamps import ShownLamp


def lit_lamp(
    shown: ShownLamp,
    nodes: LampNodes,
    bands: Bands,
    unit: str,
    n: float,
    *,
    dark: bool,
    dark_beyond: bool = False,
) -> Lamp:
    """Return it in bands, its form as :func:`.form_of` has it; without light if it is ``dark``.

    Its spectrum is, beyond its table, with ``dark_beyond``.
    """
    light, chosen, form = shown.light, stored_lamp(shown.light), form_of(shown, nodes, n)
    if dark:
        intensity = np.zeros(len(bands))
    elif chosen.spectrum:
        table = files_of(light).get(SPECTRUM)
        shape = parse_emission(f"file:{table.whole}" if table else chosen.spectrum)
        shape = without_light_beyond(shape) if dark_beyond else shape
        intensity = radiant_intensity(shape, form.power, bands, chosen.unit, form.fraction)
        if unit == RELATIVE:
            intensity = intensity / full_sun()
    else:
        intensity = intensity_of_colour(colour_of(light) * form.gain, form.power, bands)
    place, seen = shown.place, float(marks.is_seen(shown.item))
    return Lamp(
        tuple(place.translation), axis_of(place), intensity, form.profile, form.radius, seen,
        unblocked=float(not light.use_shadow),
    )  # fmt: skip
