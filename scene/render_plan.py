"""Resolves settings into everything a render of bands needs."""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import importlib.metadata
import math
import platform
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ..node_groups import attributes
from ..uw_spectral.errors import DataWarning, InputError
from ..uw_spectral.imaging.description import (
    BandsDescription,
    CameraDescription,
    Description,
    FloorDescription,
    SunAndSky,
    SurfaceDescription,
    WaterDescription,
)
from ..uw_spectral.imaging.optics import ResolvedOptics, resolve
from ..uw_spectral.lamps.lamp_surface import lamplight
from ..uw_spectral.lamps.multiple_scattering import LampWater, lamp_water
from ..uw_spectral.shade.shade_table import ShadeTable, without_shade
from ..uw_spectral.spectra.colour_rendering import SensorReduction
from ..uw_spectral.spectra.illuminant import RELATIVE
from ..uw_spectral.spectra.reflectance import emission_basis, uplift_basis
from ..uw_spectral.spectra.spectral_image import IRRADIANCE_UNITS, RADIANCE_UNITS
from ..uw_spectral.surface.wave_patterns import Sea
from ..uw_spectral.transfer.radiance_table import TABLE_STREAMS
from ..uw_spectral.transfer.water_column import WAVES
from ..uw_spectral.water.bio_optics import Constituents
from ..uw_spectral.water.phase import BandPhase
from ..uw_spectral.water.shared_phase import LARGEST_SPREAD, alike, with_mean_of
from . import (
    band_colors,
    cameras,
    contents,
    particles,
    realtime_materials,
    shade,
    waterline,
)
from .cycles_phase import CyclesPhase, cycles_phase
from .lamps import SceneLamps, lamps_of, seen_places
from .particles import SceneParticles, particles_of
from .pass_values import PassValues
from .realtime import (
    RealtimeWater,
    ViewFromAir,
    realtime_water,
)
from .settings import (
    AUTO,
    BANDS,
    BOUNDED,
    BY_PICTURE,
    CONSTITUENTS,
    DEFAULT_PHASE,
    OPTIMISED,
    SceneSettings,
)  # fmt: skip
from .surroundings import Ground, Surroundings, has_things, look_around

_RELATIVE_UNITS = "sr^-1, relative to an irradiance of 1 at 560 nm"
_RELATIVE_IRRADIANCE = "relative to an irradiance of 1 at 560 nm"
_RECORDED_PACKAGES = ("numpy", "colour-science", "jerlov", "OpenImageIO")


@dataclass(frozen=True, eq=False)
class RenderPlan(ResolvedOptics):
    """The settings of a scene, resolved: optics, passes, development."""

    settings: SceneSettings = dataclasses.field(kw_only=True)

    @functools.cached_property
    def cycles_phases(self) -> list[CyclesPhase]:
        """How Cycles draws the phase function of each layer, from the surface down."""
        bounded = self.settings.forward_peak == BOUNDED
        return [
            cycles_phase(with_mean_of(phase, self.passes), bounded=bounded)
            for phase in self._phases
        ]

    @functools.cached_property
    def passes(self) -> list[tuple[int, ...]]:
        """The bands of each pass of Cycles: those that share a phase function."""
        return alike(self._phases, spread=LARGEST_SPREAD if self.settings.share_passes else 0.0)

    @property
    def _phases(self) -> tuple[BandPhase, ...]:
        return self.phase, *(layer.phase for layer in self.column.below)

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
        if self.sensor.note:
            notes += (self.sensor.note,)
        if self.reference is not None and self.excitation is not None:
            notes += ("optimised bands do not expect inelastic light; its colour may be off",)
        return notes

    @property
    def cycles_notes(self) -> tuple[str, ...]:
        """Caveats of the phase functions that Cycles draws."""
        return tuple(note for phase in self.cycles_phases for note in phase.notes)

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
        for index, lamp in enumerate(self.lamps(scene).lamps):
            values[attributes.lamp(index)] = lamp.intensity
        return PassValues.of_column(self.column, self.cycles_phases).with_values(values)

    @functools.cached_property
    def particles(self) -> SceneParticles:
        """Particles that are seen one by one."""
        return particles_of(self.settings, self.column)

    @property
    def draws_shafts(self) -> bool:
        """Whether EEVEE draws shafts of light; in water of several layers it does not."""
        return self.settings.shafts and not self.column.below

    def realtime(
        self,
        scene: bpy.types.Scene,
        depth: float,
        weights: NDArray[np.float64],
        camera: bpy.types.Object | None = None,
        shaded: ShadeTable | None = None,
        *,
        eyes: Sequence[tuple[float, ...]] = (),
        kept: shade.Kept | None = None,
        in_air: bool | None = None,
        unchanged: bool = False,
    ) -> RealtimeWater:
        """Return the water of EEVEE, see :func:`realtime_water`.

        Parameters
        ----------
        scene : Scene
        depth : float
            Of the camera, m.
        weights : array, shape (3, n)
            Linear RGB per unit radiance of each band.
        camera : Object, optional
            The scene's by default.
        shaded : ShadeTable, optional
            What is known already of the shade; the ground is then the one that was kept.
        eyes : sequence of six floats
            Where the camera is at the frames of a job, for all of which the shade shall serve.
        kept : Kept, optional
            What may be used again.
        in_air : bool, optional
            Whether rays begin in the air; by where the camera is without.
        unchanged : bool
            Whether things may be taken to be where they were when ``kept`` was filled.
        """
        reflectances = {
            material.name: reflectance.at(self.bands.centres)
            for material, reflectance in band_colors.measured_reflectances(scene)
        }
        chosen, around, kept = self.settings, None, kept or shade.Kept()
        viewer = camera or scene.camera
        shades = chosen.diffuse_shadows and has_things(scene)
        if not shades:
            shaded = None
        elif chosen.sunlight == 0:
            # The same nodes as by day; there is nothing to shade.
            shaded = without_shade(len(self.bands))
        looks = shades or (chosen.scene_floor and has_things(scene))
        if looks and shaded is None:
            clearest = float(self.column.attenuation.min())
            around = look_around(scene, viewer, clearest, eyes, kept.samples)
            kept.ground = around.ground
        over = self.over_ground(kept.ground if looks else None)
        solved = over.solved_field(TABLE_STREAMS)
        if shades and around is not None:
            shaded = self._shaded(scene, around, depth, viewer, kept)
        place = (0.0, 0.0, -depth) if viewer is None else tuple(viewer.matrix_world.translation)
        lamps = kept.lamp_shadows.of(scene, self.lamps(scene), unchanged=unchanged)
        if lamps.lamps:
            lamps = lamps.with_thrown_back(self.lamp_water(max(depth, 0.0)), self.bands, place)
        water = realtime_water(
            over.column, self.phase, depth, weights, solved=solved,
            shafts=self.draws_shafts, reflectances=reflectances, shade=shaded,
            lamps=lamps, above=_view_from_air(viewer, eyes, in_air),
            kinds=realtime_materials.kinds(contents.materials(scene)),
        )  # fmt: skip
        frame = cameras.orthographic_frame(scene, viewer)
        if viewer is not None and frame is not None and water.shape.layered:
            raise InputError(
                f"camera {viewer.name!r} is orthographic, and the water differs with depth; EEVEE "
                "draws that for perspective cameras: take one, or Cycles"
            )
        # The scene has that floor already.
        water = replace(water, column=self.column, particles=self.particles)
        return water if frame is None else replace(water, frame=frame)

    def _shaded(
        self,
        scene: bpy.types.Scene,
        around: Surroundings,
        depth: float,
        viewer: bpy.types.Object,
        kept: shade.Kept,
    ) -> ShadeTable:
        """Return the shade of things, whose spectrum few bands tell well enough."""
        few = self.settings.with_at_most(shade.MOST_BANDS)
        plan = self if few == self.settings else plan_of(few)
        over = plan.over_ground(kept.ground)
        solved = over.solved_field(TABLE_STREAMS)
        # What the sensor sees decides, in band passes too, so that they agree.
        seen = plan.reduction(depth, plan.lamplight(scene, viewer)).weights
        table = shade.table_of(around, plan.bands, solved, seen, depth, kept)
        return table.on(plan.bands.centres, self.bands.centres)

    def lamps(self, scene: bpy.types.Scene) -> SceneLamps:
        """Return the lamps of a scene's current frame."""
        return lamps_of(scene, self.bands, self.illuminant.unit)

    def lamplight(
        self,
        scene: bpy.types.Scene,
        camera: bpy.types.Object,
        seen: Sequence[tuple[float, ...]] | None = None,
    ) -> NDArray[np.float64] | None:
        """Return the irradiance of lamps that a camera exposes by; None without lamps.

        What it sees is looked for unless it is given, see :func:`.seen_places`.
        """
        lamps = self.lamps(scene).lamps
        if not lamps:
            return None
        place = tuple(camera.matrix_world.translation)
        water = self.lamp_water(max(-place[2], 0.0))
        seen = seen_places(scene, camera) if seen is None else seen
        return lamplight(lamps, water, place, seen)

    def lamp_water(self, depth: float) -> LampWater:
        """Return the water at a depth in m as light of lamps meets it."""
        here = self.column.layer_at(depth, self.phase)
        return lamp_water(here.absorption, here.scattering, here.phase)

    def over_ground(self, ground: Ground | None) -> RenderPlan:
        """Return the plan over the scene's own ground, if there is any and no floor is added."""
        if (
            ground is None
            or not self.settings.scene_floor
            or math.isfinite(self.column.floor_depth)
        ):
            return self
        reflectance = np.clip(uplift_basis(self.bands) @ np.array(ground.colour), 0.0, 1.0)
        column = replace(self.column, floor_depth=ground.depth, floor_reflectance=reflectance)
        excitation = self.excitation
        if excitation is not None:
            below = replace(
                excitation.column,
                floor_depth=ground.depth,
                floor_reflectance=np.clip(
                    uplift_basis(excitation.column.bands) @ np.array(ground.colour), 0.0, 1.0
                ),
            )
            excitation = replace(excitation, column=below)
        return replace(self, column=column, excitation=excitation)

    def reduction(
        self,
        depth: float,
        lamplight: NDArray[np.float64] | None = None,
        stops: float | None = None,
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
            "deeper_layers": [
                {
                    "top_m": layer.top,
                    "water": water.name,
                    "absorption_per_m": layer.absorption.tolist(),
                    "scattering_per_m": layer.scattering.tolist(),
                }
                for layer, water in zip(column.below, self.waters.layers[1:], strict=True)
            ],
            "sources": {
                "water": "; ".join(dict.fromkeys(x.source for x in self.waters.layers)),
                "illuminant": self.illuminant.source,
                "sensor": f"{self.sensor.source} ({self.sensor.licence})",
            },
            **particles.record(self.settings, column),
            "versions": {
                "blender": bpy.app.version_string,
                "python": platform.python_version(),
                **{name: _version(name) for name in _RECORDED_PACKAGES},
            },
        }


def make_plan(settings: SceneSettings) -> RenderPlan:
    """Resolve settings; files are read.

    Raises
    ------
    InputError
        If a name is unknown, a file cannot be used, or a table does not
        reach the bands.
    """
    optics = resolve(description_of(settings))
    for water in optics.waters.layers:
        water.warn_doubts(optics.bands.centres)
    return _plan(settings, optics)


def plan_of(settings: SceneSettings) -> RenderPlan:
    """Resolve settings as :func:`make_plan` does, for a view that follows them.

    What was resolved is kept, a file's content too, until :func:`forget_files`;
    caveats of the data are left to the records of renders.

    Raises
    ------
    InputError
        If a name is unknown or a file cannot be used.
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


def sea_of(settings: SceneSettings) -> Sea:
    """Return the sea that settings describe."""
    return Sea(
        settings.wind_speed,
        settings.wind_direction,
        1e3 * settings.fetch,
        settings.floor_depth or math.inf,
        settings.wave_seed,
        settings.wave_tile,
        settings.wave_resolution,
        settings.wave_loop or None,
    )


def description_of(settings: SceneSettings) -> Description:
    """Return the description that settings are.

    Raises
    ------
    InputError
        If wavelengths or exposure are no numbers.
    """
    return Description(
        WaterDescription(
            _constituents(settings) if settings.water == CONSTITUENTS else settings.water,
            settings.water_source,
            settings.second_water,
            settings.second_water_share,
            settings.absorption_factor,
            settings.scattering_factor,
            None if settings.phase == DEFAULT_PHASE else settings.phase,
            settings.inelastic,
        ),
        SunAndSky(
            settings.illuminant,
            settings.sun_zenith,
            settings.sun_azimuth,
            settings.sky_radiance,
            {"above": True, "below": False}.get(settings.irradiance),
            settings.sky,
            settings.sunlight,
        ),
        SurfaceDescription(
            settings.surface,
            settings.refractive_index,
            sea_of(settings).spectrum.mean_square_slope if settings.surface == WAVES else 0.0,
        ),
        FloorDescription(settings.floor_depth or math.inf, settings.floor_reflectance),
        CameraDescription(
            settings.sensor,
            settings.white_balance,
            _stops(settings.exposure),
            settings.exposure_compensation,
        ),
        BandsDescription(
            settings.in_mode(BANDS).bands,
            settings.range_start,
            settings.range_end,
            _wavelengths(settings.wavelengths),
            settings.band_placement == OPTIMISED,
        ),
    )


_resolved = functools.lru_cache(maxsize=32)(resolve)


def _view_from_air(
    camera: bpy.types.Object | None, eyes: Sequence[tuple[float, ...]], in_air: bool | None
) -> ViewFromAir | None:
    """Return what is special about views from the air; None if a job has none."""
    if camera is None:
        return None
    if not waterline.above(camera, eyes):
        return None
    eye = cameras.eye_of(camera)
    return ViewFromAir(eye[:3], eye[2] > 0.0 if in_air is None else in_air, eye[3:])


def _plan(settings: SceneSettings, optics: ResolvedOptics) -> RenderPlan:
    parts = {field.name: getattr(optics, field.name) for field in dataclasses.fields(optics)}
    return RenderPlan(**parts, settings=settings)


def _constituents(settings: SceneSettings) -> Constituents:
    return Constituents(settings.chlorophyll, settings.cdom, settings.minerals, settings.detritus)


def _wavelengths(text: str) -> tuple[float, ...]:
    try:
        return tuple(float(part) for part in text.split(",")) if text else ()
    except ValueError as error:
        raise InputError(
            f"--wavelengths: {text!r} is not a list of numbers like 450,550,650"
        ) from error


def _stops(text: str) -> float | None:
    """Read an exposure; None is automatic."""
    if text in (AUTO, BY_PICTURE):
        return None
    try:
        stops = float(text)
    except ValueError:
        stops = math.nan
    if not math.isfinite(stops):
        raise InputError(
            f"--exposure: {text!r} is neither {AUTO!r}, {BY_PICTURE!r} nor a number of stops"
        )
    return stops


def _version(package: str) -> str:
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return "bundled with Blender"
