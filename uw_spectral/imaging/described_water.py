"""The column of water of a description, on bands."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..spectra.bands import Bands
from ..spectra.illuminant import Illuminant
from ..transfer.sky import UNIFORM
from ..transfer.sky_picture import SkyPicture
from ..transfer.water_column import DeeperWater, WaterColumn
from ..water.phase import BandPhase
from ..water.profile import DepthProfile
from .description import Description
from .incident_light import incident_light
from .mixed_water import Mixture, phase_of


def column_of(
    description: Description,
    mixtures: DepthProfile[Mixture],
    illuminant: Illuminant,
    bands: Bands,
    floor_reflectance: NDArray[np.float64],
    picture: SkyPicture | None = None,
) -> tuple[WaterColumn, BandPhase]:
    """Return the column of water in bands, and the phase function of its first layer.

    ``picture`` is that of the sky, if one lights the water.
    """
    light, surface = description.light, description.surface
    phases = mixtures.map(lambda mixture: phase_of(description.water, mixture, bands))
    first, *deeper = (
        DeeperWater(top, mixture.water.a(bands.centres), mixture.water.b(bands.centres), phase)
        for top, mixture, phase in zip(mixtures.tops, mixtures.layers, phases.layers, strict=True)
    )
    column = WaterColumn(
        bands=bands,
        absorption=first.absorption,
        scattering=first.scattering,
        floor_depth=description.floor.depth,
        floor_reflectance=floor_reflectance,
        surface=surface.kind,
        refractive_index=surface.refractive_index,
        below=tuple(deeper),
        sky=light.sky if picture is None else UNIFORM,
        sky_picture=None if picture is None else picture.without_sun,
        **vars(incident_light(light, surface, illuminant, bands, picture)),
    )
    return column, phases.layers[0]
