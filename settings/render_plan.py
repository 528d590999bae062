"""Settings, resolved: the optics of a scene, its passes and their development."""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import math
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import PurePath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.errors import DataWarning
from ..uw_spectral.imaging import ResolvedOptics, resolve
from ..uw_spectral.lamps.inelastic_source import LampExcitation, lamp_excitation
from ..uw_spectral.lamps.lamp_harmonics import Harmonics
from ..uw_spectral.lamps.multiple_scattering import LampWater, lamp_water
from ..uw_spectral.spectra.bands import Bands
from ..uw_spectral.spectra.colour_rendering import SensorReduction
from ..uw_spectral.spectra.illuminant import RELATIVE
from ..uw_spectral.spectra.receptors import Receptors, parse_receptors
from ..uw_spectral.spectra.reflectance import uplift_basis
from ..uw_spectral.spectra.sky_colours import SKY_SOURCE
from ..uw_spectral.spectra.spectral_image import IRRADIANCE_UNITS, RADIANCE_UNITS
from ..uw_spectral.transfer.water_column import WaterColumn
from ..uw_spectral.water.phase import BandPhase
from ..uw_spectral.water.shared_phase import LARGEST_SPREAD, alike
from .descriptions import description_of
from .scene_settings import SceneSettings

_RELATIVE_UNITS = "sr^-1, relative to an irradiance of 1 at 560 nm"
_RELATIVE_IRRADIANCE = "relative to an irradiance of 1 at 560 nm"


@dataclass(frozen=True, eq=False)
class RenderPlan(ResolvedOptics):
    """The settings of a scene, resolved: optics, passes, development."""

    settings: SceneSettings = dataclasses.field(kw_only=True)

    @functools.cached_property
    def passes(self) -> list[tuple[int, ...]]:
        """The bands of each pass of Cycles: those that share a phase function."""
        return alike(self.phases, spread=LARGEST_SPREAD if self.settings.share_passes else 0.0)

    @property
    def phases(self) -> tuple[BandPhase, ...]:
        """Phase functions of the layers, from the surface down."""
        return self.phase, *(layer.phase for layer in self.column.below)

    @functools.cached_property
    def receptors(self) -> Receptors | None:
        """The sensor of any number of channels, if there is one."""
        return parse_receptors(self.settings.receptors) if self.settings.receptors else None

    @property
    def radiance_units(self) -> str:
        """Unit of the band radiances."""
        return _RELATIVE_UNITS if self.illuminant.unit == RELATIVE else RADIANCE_UNITS

    @property
    def irradiance_units(self) -> str:
        """Unit of the band irradiances."""
        return _RELATIVE_IRRADIANCE if self.illuminant.unit == RELATIVE else IRRADIANCE_UNITS

    @property
    def notes(self) -> tuple[str, ...]:
        """Caveats of the data and of the bands."""
        caveats = [text for x in self.waters.layers for text in x.caveats_at(self.bands.centres)]
        notes = tuple(dict.fromkeys(caveats))
        if self.settings.shafts and not self.draws_shafts:
            notes += ("shafts of light are not drawn in water of several layers",)
        notes += tuple(filter(None, (self.sky_note, self.sensor.note)))
        if self.reference is not None and self.excitation is not None:
            notes += ("optimised bands do not expect inelastic light; its colour may be off",)
        return notes

    @property
    def sky_note(self) -> str:
        """Which picture of a sky lights the water; empty if none does."""
        if self.column.sky_picture is None:
            return ""
        sun, sky = self.column.sun_irradiance.sum(), self.column.sky_irradiance.sum()
        x, y, z = self.column.skylight.sun
        high, to = math.degrees(math.asin(-z)), math.degrees(math.atan2(y, x))
        direct = (
            f"its sun is {high:.1f}° high, shines towards {to:.0f}° and brings "
            f"{100.0 * sun / (sun + sky):.0f} % of the light below the surface"
            if sun > 0
            else "no sun was found in it"
        )
        if self.column.sky_picture.sun_irradiance.any():
            direct += "; another bright spot of it lights as sky does, without shadows"
        name = PurePath(self.settings.sky_picture).name
        return f"the water is lit by the picture of the sky {name}: {direct}"

    @property
    def draws_shafts(self) -> bool:
        """Whether EEVEE draws shafts of light; in water of several layers it does not."""
        return self.settings.shafts and not self.column.below

    def lamp_water(self, depth: float) -> LampWater:
        """Return the water at a depth in m as light of lamps meets it."""
        here = self.column.layer_at(depth, self.phase)
        return lamp_water(here.absorption, here.scattering, here.phase)

    def lamp_excitation(self) -> LampExcitation | None:
        """Return what lamps excite in the water; None if nothing changes the wavelength."""
        if self.excitation is None:
            return None
        column, phase = self.excitation.column, self.excitation.phase
        water = Harmonics(column.absorption, column.scattering, phase)
        return lamp_excitation(self.excitation.processes, column.bands, self.bands, water)

    def over_ground(self, depth: float, colour: Sequence[float]) -> RenderPlan:
        """Return the plan over a ground of the scene's own, if it is wanted and no floor is added.

        ``depth`` is that of the ground, m; ``colour`` the linear RGB that it reflects diffusely.
        """
        if not self.settings.scene_floor or math.isfinite(self.column.floor_depth):
            return self

        def over(column: WaterColumn, bands: Bands) -> WaterColumn:
            reflectance = np.clip(uplift_basis(bands) @ np.array(colour), 0.0, 1.0)
            return replace(column, floor_depth=depth, floor_reflectance=reflectance)

        excitation = self.excitation
        if excitation is not None:
            below = over(excitation.column, excitation.column.bands)
            excitation = replace(excitation, column=below)
        return replace(self, column=over(self.column, self.bands), excitation=excitation)

    def reduction(
        self, depth: float, lamplight: NDArray[np.float64] | None = None, stops: float | None = None
    ) -> SensorReduction:
        """Return the sensor's map for a camera at a depth in m, at its exposure or another."""
        return self.viewpoint(depth, stops, lamplight).reduction

    def response(self, depth: float) -> NDArray[np.float64]:
        """Return the responses of the sensor's channels to the bands, shape (3, n).

        They depend on depth only where they are fitted to it.
        """
        return self.viewpoint(depth, 0.0).reduction.response

    def fixed_bands(self, settings: SceneSettings) -> SceneSettings:
        """Return settings of another frame with the bands of this plan, if they are optimised."""
        if self.reference is None:
            return settings
        return replace(settings, wavelengths=",".join(map(repr, self.bands.centres.tolist())))

    def record(self) -> dict[str, Any]:
        """Return bands, coefficients and sources, for the record of a render."""
        column, has_floor = self.column, math.isfinite(self.column.floor_depth)
        floor = {"floor_reflectance": column.floor_reflectance.tolist()} if has_floor else {}
        layers = [
            {
                "top_m": layer.top,
                "water": water.name,
                "absorption_per_m": layer.absorption.tolist(),
                "scattering_per_m": layer.scattering.tolist(),
            }
            for layer, water in zip(column.below, self.waters.layers[1:], strict=True)
        ]
        return {
            "bands": {
                "centres_nm": self.bands.centres.tolist(),
                "widths_nm": self.bands.widths.tolist(),
                "absorption_per_m": column.absorption.tolist(),
                "scattering_per_m": column.scattering.tolist(),
                "sun_irradiance_below_surface": column.sun_irradiance.tolist(),
                "sky_radiance": column.sky_radiance.tolist(),
                **floor,
                "radiance_units": self.radiance_units,
            },
            **({"deeper_layers": layers} if layers else {}),
            "sources": {
                "water": "; ".join(dict.fromkeys(x.source for x in self.waters.layers)),
                "illuminant": self.illuminant.source,
                **({"sky": SKY_SOURCE} if column.sky_picture is not None else {}),
                "sensor": f"{self.sensor.source} ({self.sensor.licence})",
            },
        }


def make_plan(settings: SceneSettings) -> RenderPlan:
    """Resolve settings; files are read.

    Raises InputError if a name is unknown, a file cannot be used, or a table does not reach the
    bands.
    """
    optics = resolve(description_of(settings))
    for water in optics.waters.layers:
        water.warn_doubts(optics.bands.centres)
    return _plan(settings, optics)


def plan_of(settings: SceneSettings) -> RenderPlan:
    """Resolve settings as :func:`make_plan` does, for a view that follows them.

    What was resolved is kept, a file's content too, until :func:`forget_files`; caveats of the data
    are left to the records of renders.
    """
    with quiet():
        return _plan(settings, _resolved(description_of(settings)))


def forget_files() -> None:
    """Let :func:`plan_of` read files again."""
    _resolved.cache_clear()


@contextlib.contextmanager
def quiet() -> Iterator[None]:
    """Keep caveats of the data to the records of renders."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DataWarning)
        yield


_resolved = functools.lru_cache(maxsize=32)(resolve)


def _plan(settings: SceneSettings, optics: ResolvedOptics) -> RenderPlan:
    parts = {field.name: getattr(optics, field.name) for field in dataclasses.fields(optics)}
    return RenderPlan(**parts, settings=settings)
