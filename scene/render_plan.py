"""Resolves settings into everything a render of bands needs."""

from __future__ import annotations

import functools
import importlib.metadata
import math
import platform
from dataclasses import dataclass, replace
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ..node_groups import attributes
from ..uw_spectral.errors import InputError
from ..uw_spectral.imaging.optimised_bands import FittedViewpoint, optimised_bands
from ..uw_spectral.imaging.readouts import REFERENCE_BANDS, Viewpoint
from ..uw_spectral.spectra.bands import Bands
from ..uw_spectral.spectra.colour_rendering import SensorReduction
from ..uw_spectral.spectra.illuminant import RELATIVE, Illuminant, parse_illuminant
from ..uw_spectral.spectra.reflectance import emission_basis, parse_reflectance, uplift_basis
from ..uw_spectral.spectra.sensor import Sensor, parse_sensor
from ..uw_spectral.spectra.spectral_image import RADIANCE_UNITS
from ..uw_spectral.spectra.spectrum import Spectrum
from ..uw_spectral.surface.refraction import (
    fresnel_reflectance,
    in_water_cosine,
    sun_travel_direction,
)
from ..uw_spectral.transfer.closed_form import ClosedForm, solve_closed_form
from ..uw_spectral.transfer.inelastic_light import (
    InelasticLight,
    excitation_fields,
    solve_inelastic,
)
from ..uw_spectral.transfer.water_column import WaterColumn
from ..uw_spectral.water.bio_optics import Constituents, constituents_of
from ..uw_spectral.water.inelastic_processes import (
    EXCITATION,
    InelasticProcess,
    inelastic_processes,
    parse_processes,
)
from ..uw_spectral.water.named import parse_water
from ..uw_spectral.water.optical_properties import Water, molecular_scattering
from ..uw_spectral.water.phase import BandPhase, parse_phase
from . import band_colors
from .cycles_phase import CyclesPhase, cycles_phase
from .pass_values import PassValues
from .realtime import RealtimeWater, realtime_water
from .settings import AUTO, CONSTITUENTS, DEFAULT_PHASE, OPTIMISED, SceneSettings

_RELATIVE_UNITS = "sr^-1, relative to an irradiance of 1 at 560 nm"
_RECORDED_PACKAGES = ("numpy", "colour-science", "jerlov", "nodebpy", "OpenImageIO")


@dataclass(frozen=True, eq=False)
class RenderPlan:
    """The settings of a scene, resolved: optics, passes, development."""

    settings: SceneSettings
    bands: Bands
    water: Water
    phase: BandPhase
    illuminant: Illuminant
    sensor: Sensor
    floor: Spectrum
    column: WaterColumn
    cycles: CyclesPhase
    inelastic: InelasticLight | None = None
    reference: tuple[WaterColumn, BandPhase] | None = None
    """Column and phase function on many bands, to which the weights of few are fitted."""

    @property
    def passes(self) -> list[tuple[int, ...]]:
        """The bands of each render pass."""
        return self.bands.packed(self.cycles.bands_per_pass)

    @property
    def radiance_units(self) -> str:
        """Unit of the band radiances."""
        return _RELATIVE_UNITS if self.illuminant.unit == RELATIVE else RADIANCE_UNITS

    @property
    def notes(self) -> tuple[str, ...]:
        """Caveats of the data and of the renderer."""
        notes = (*self.water.caveats_at(self.bands.centres), *self.cycles.notes)
        if self.reference is not None and self.inelastic is not None:
            notes += ("optimised bands do not expect inelastic light; its colour may be off",)
        return notes

    def pass_values(self, scene: bpy.types.Scene) -> PassValues:
        """Return every value that differs by band, for the materials of a scene."""
        values: dict[str, NDArray[np.float64]] = {}
        for names, basis in (
            (attributes.REFLECTANCE_BASIS, uplift_basis(self.bands)),
            (attributes.EMISSION_BASIS, emission_basis(self.bands)),
        ):
            values.update(zip(names, basis.T, strict=True))
        for material, reflectance in band_colors.measured_reflectances(scene):
            name = band_colors.measured_attribute(material)
            if name is not None:
                values[name] = reflectance.at(self.bands.centres)
        return PassValues.of_column(self.column, self.cycles.shares).with_values(values)

    def realtime(
        self,
        scene: bpy.types.Scene,
        depth: float,
        weights: NDArray[np.float64],
    ) -> RealtimeWater:
        """Return the water of EEVEE for a camera at a depth in m, see :func:`realtime_water`."""
        reflectances = {
            material.name: reflectance.at(self.bands.centres)
            for material, reflectance in band_colors.measured_reflectances(scene)
        }
        return realtime_water(
            self.column, self.phase, depth, weights, aureole=self.settings.aureole,
            shafts=self.settings.shafts, diffuse_shadows=self.settings.diffuse_shadows,
            reflectances=reflectances, inelastic=self.inelastic,
        )  # fmt: skip

    def path_radiance(self, depth: float) -> ClosedForm:
        """Return the closed form for a camera at a depth in m."""
        field = self.column.light_field(self.phase)
        return solve_closed_form(field, self.phase, depth, self.column.sun_direction)

    def viewpoint(self, depth: float) -> Viewpoint:
        """Return the camera of the plan at a depth in m."""
        chosen = self.settings
        stops = None if chosen.exposure == AUTO else _stops(chosen.exposure)
        camera = (self.illuminant, self.sensor, depth, chosen.white_balance, stops)
        if self.reference is None:
            return Viewpoint(self.column, self.phase, *camera)
        reference = Viewpoint(*self.reference, *camera)
        return FittedViewpoint(self.column, self.phase, *camera, reference=reference)

    def reduction(self, depth: float) -> SensorReduction:
        """Return the sensor's map for a camera at a depth in m."""
        return self.viewpoint(depth).reduction

    def fixed_bands(self, settings: SceneSettings) -> SceneSettings:
        """Return settings of another frame with the bands of this plan, if they are optimised."""
        if self.reference is None:
            return settings
        return replace(settings, wavelengths=",".join(map(repr, self.bands.centres.tolist())))

    def record(self) -> dict[str, Any]:
        """Return bands, coefficients, sources and versions, for the record of a render."""
        column = self.column
        return {
            "bands": {
                "centres_nm": self.bands.centres.tolist(),
                "widths_nm": self.bands.widths.tolist(),
                "absorption_per_m": column.absorption.tolist(),
                "scattering_per_m": column.scattering.tolist(),
                "sun_irradiance_below_surface": column.sun_irradiance.tolist(),
                "sky_radiance": column.sky_radiance.tolist(),
                "floor_reflectance": column.floor_reflectance.tolist(),
                "radiance_units": self.radiance_units,
            },
            "sources": {
                "water": self.water.source,
                "illuminant": self.illuminant.source,
                "sensor": f"{self.sensor.source} ({self.sensor.licence})",
            },
            "versions": {
                "blender": bpy.app.version_string,
                "python": platform.python_version(),
                **{name: _version(name) for name in _RECORDED_PACKAGES},
            },
        }


def make_plan(settings: SceneSettings) -> RenderPlan:
    """Resolve settings.

    Raises
    ------
    InputError
        If a name is unknown, a file cannot be used, or a table does not
        reach the bands.
    """
    if settings.exposure != AUTO:
        _stops(settings.exposure)
    water = _water(settings)
    illuminant = parse_illuminant(settings.illuminant, settings.sun_zenith)
    floor = parse_reflectance(settings.floor_reflectance)
    bands, reference = _bands(settings), None
    if settings.band_placement == OPTIMISED and len(bands) < REFERENCE_BANDS:
        fine = _reference_bands(settings.range_start, settings.range_end)
        fine_column = _column(settings, water, illuminant, fine, floor.at(fine.centres))
        reference = fine_column, _phase(settings, water, fine)
        if not settings.wavelengths:
            above = Viewpoint(*reference, illuminant, parse_sensor("cie1931"), depth=0.0)
            bands = optimised_bands(settings.bands, above).bands
    water.warn_doubts(bands.centres)
    phase = _phase(settings, water, bands)
    column = _column(settings, water, illuminant, bands, floor.at(bands.centres))
    inelastic = None
    switched_on = parse_processes(settings.inelastic)
    if switched_on:
        # A measured floor need not reach the ultraviolet, which only excites.
        known = np.clip(EXCITATION.centres, floor.wavelengths[0], floor.wavelengths[-1])
        exciting = _column(settings, water, illuminant, EXCITATION, floor.at(known))
        inelastic = solve_inelastic(
            _processes(settings, switched_on, bands),
            excitation_fields(exciting, _phase(settings, water, EXCITATION)),
            EXCITATION,
            column.light_field(phase),
            bands,
        )
    sensor = parse_sensor(settings.sensor)
    return RenderPlan(
        settings, bands, water, phase, illuminant, sensor, floor, column, cycles_phase(phase),
        inelastic, reference,
    )  # fmt: skip


@functools.lru_cache(maxsize=4)
def _reference_bands(start: float, end: float) -> Bands:
    """Return the same object each time, by which a fit to it is known again."""
    return Bands.uniform(REFERENCE_BANDS, start, end)


def _column(
    settings: SceneSettings,
    water: Water,
    illuminant: Illuminant,
    bands: Bands,
    floor_reflectance: NDArray[np.float64],
) -> WaterColumn:
    index, zenith = settings.refractive_index, settings.sun_zenith
    direct = illuminant.direct_in(bands)
    transmitted = 1.0
    if settings.irradiance == "above":
        transmitted = 1.0 - float(fresnel_reflectance(math.cos(math.radians(zenith)), index))
    return WaterColumn(
        bands=bands,
        absorption=water.a(bands.centres),
        scattering=water.b(bands.centres),
        sun_irradiance=direct * transmitted,
        sun_cosine=float(in_water_cosine(zenith, index)),
        sun_direction=sun_travel_direction(zenith, settings.sun_azimuth, index),
        sky_radiance=illuminant.diffuse_in(bands) / math.pi + settings.sky_radiance * direct,
        floor_depth=settings.floor_depth or math.inf,
        floor_reflectance=floor_reflectance,
        surface=settings.surface,
        refractive_index=index,
    )


def _phase(settings: SceneSettings, water: Water, bands: Bands) -> BandPhase:
    """Return the phase function; by default a bio-optical water has that of its particles."""
    constituents = _constituents(settings)
    if settings.phase == DEFAULT_PHASE and constituents is not None:
        if settings.water == CONSTITUENTS:  # amounts that are animated must not change the nodes
            return constituents.phase_of_fixed_parts(bands.centres)
        return constituents.phase(bands.centres)
    b = water.b(bands.centres)
    return parse_phase(settings.phase).for_bands(b, molecular_scattering(bands.centres))


def _constituents(settings: SceneSettings) -> Constituents | None:
    """Return what the water is made of, if it is one bio-optical water."""
    if settings.second_water:
        return None
    if settings.water == CONSTITUENTS:
        return _chosen_constituents(settings)
    return constituents_of(settings.water)


def _chosen_constituents(settings: SceneSettings) -> Constituents:
    return Constituents(settings.chlorophyll, settings.cdom, settings.minerals, settings.detritus)


def _processes(
    settings: SceneSettings, switched_on: tuple[str, ...], bands: Bands
) -> tuple[InelasticProcess, ...]:
    constituents = _constituents(settings)
    if constituents is None:
        fluorescent = [name for name in switched_on if name != "raman"]
        if fluorescent:
            raise InputError(
                f"--inelastic: {', '.join(fluorescent)} needs one water of known constituents, "
                f"{CONSTITUENTS}, bio: or case:, not {settings.water!r}"
                + (" with a second water" if settings.second_water else "")
            )
        constituents = Constituents()
    found = inelastic_processes(constituents, EXCITATION, bands, switched_on)
    return tuple(
        p
        if p.name == "raman"
        else replace(p, coefficient=p.coefficient * settings.absorption_factor)
        for p in found
    )


def _water(settings: SceneSettings) -> Water:
    if settings.water == CONSTITUENTS:
        water = _chosen_constituents(settings).water()
    else:
        water = parse_water(settings.water, settings.water_source)
    if settings.second_water:
        other = parse_water(settings.second_water, settings.water_source)
        water = water.mixed(other, settings.second_water_share)
    return water.scaled(settings.absorption_factor, settings.scattering_factor)


def _bands(settings: SceneSettings) -> Bands:
    if not settings.wavelengths:
        return Bands.uniform(settings.bands, settings.range_start, settings.range_end)
    try:
        centres = [float(part) for part in settings.wavelengths.split(",")]
    except ValueError as error:
        raise InputError(
            f"--wavelengths: {settings.wavelengths!r} is not a list of numbers like 450,550,650"
        ) from error
    return Bands.at_wavelengths(centres)


def _stops(text: str) -> float:
    try:
        stops = float(text)
    except ValueError:
        stops = math.nan
    if not math.isfinite(stops):
        raise InputError(f"--exposure: {text!r} is neither {AUTO!r} nor a number of stops")
    return stops


def _version(package: str) -> str:
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return "bundled with Blender"
