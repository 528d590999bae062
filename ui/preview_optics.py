"""What the panel shows of a water at a depth: read-outs and pictures, computed from its optics."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..settings.render_plan import plan_of, quiet
from ..settings.scene_settings import SETTINGS, SceneSettings
from ..settings.water_settings import CONSTITUENTS
from ..uw_spectral.errors import InputError
from ..uw_spectral.imaging import visibility as seen
from ..uw_spectral.imaging.description import REFERENCE_BANDS
from ..uw_spectral.imaging.summary import readouts
from ..uw_spectral.imaging.water_colour import inelastic_fraction, water_swatch
from ..uw_spectral.spectra.spectrum import Spectrum
from ..uw_spectral.transfer.water_column import FEW_STREAMS
from ..uw_spectral.water.named import list_waters
from ..uw_spectral.water.optical_properties import DEFAULT_SOURCE, JERLOV_TYPES
from . import plots
from .reporting import sentence

if TYPE_CHECKING:
    from .previews import Pictures

_SWATCH_SIZE = 64
_PLOT_SIZE = (360, 240)


def concentration_for(chosen: SceneSettings, depth: float, visibility: float) -> float:
    """Return the concentration at which one sees as far, in m; InputError if there is no light."""
    fine = replace(chosen, bands=REFERENCE_BANDS, wavelengths="", inelastic="")

    def at(concentration: float) -> float:
        plan = plan_of(replace(fine, concentration=concentration))
        return seen.horizontal_visibility(plan.viewpoint(depth))

    with quiet():
        return seen.concentration_for(visibility, at, SETTINGS["concentration"].limits[1])


def fill(
    pictures: Pictures,
    chosen: SceneSettings,
    depth: float,
    show: Callable[[str, NDArray[np.float32]], None],
) -> None:
    """Compute read-outs, and show pictures by their names."""
    fine = replace(chosen, bands=REFERENCE_BANDS, wavelengths="")
    gallery = JERLOV_TYPES if chosen.water != CONSTITUENTS else ()  # it is not shown then
    for name in gallery:
        try:
            plan = plan_of(
                replace(fine, water=f"jerlov:{name}", water_source=_source(chosen, name),
                        second_water="", second_water_fraction=0.0, inelastic="")
            )  # fmt: skip
            swatch = water_swatch(plan.viewpoint(depth))
        except InputError:
            continue
        show(f"swatch {name}", _plain(swatch))
    plan, reference = plan_of(chosen), plan_of(fine)
    pictures.source, pictures.sensor = plan.water.source, sentence(plan.sensor.note)
    scheme, _, water_type = chosen.water.partition(":")
    if scheme == "jerlov":
        each = seen.visibility_by_source(water_type).items()
        ranges = ", ".join(f"{metres:.3g} m ({source})" for source, metres in each)
        pictures.visibility = f"Visibility at 550 nm: {ranges}"
    view = plan.viewpoint(depth)
    with quiet():
        fine_view = reference.viewpoint(depth)
        pictures.readouts = readouts(view, fine_view)
        emission = reference.emission(FEW_STREAMS)
        if emission is not None:
            pictures.inelastic = inelastic_fraction(fine_view, emission)
    show("open water", _plain(pictures.readouts.swatch))
    water = plan.waters.at(depth)
    layer = fine_view.layer
    bb = layer.phase.backscatter_ratio * layer.scattering
    coefficients = {"a": water.absorption, "b": water.scattering}
    coefficients["bb"] = Spectrum(fine_view.column.bands.centres, bb, "bb")
    if water.diffuse_attenuation is not None:
        coefficients["Kd"] = water.diffuse_attenuation
    show("water", plots.plot_coefficients(coefficients, plan.bands, _PLOT_SIZE))
    show("sensor", plots.plot_sensor(plan.sensor, plan.bands, _PLOT_SIZE))
    light = pictures.readouts.transmitted_light
    show("light", plots.plot_transmitted_light(light, plan.bands, _PLOT_SIZE))


def _source(chosen: SceneSettings, name: str) -> str:
    """Source of a swatch: the chosen one if it has the type."""
    known = f"jerlov:{name}" in list_waters()[chosen.water_source]
    return chosen.water_source if known else DEFAULT_SOURCE


def _plain(colour: NDArray[np.float64]) -> NDArray[np.float32]:
    picture = np.ones((_SWATCH_SIZE, _SWATCH_SIZE, 4), dtype=np.float32)
    picture[..., :3] = colour
    return picture
