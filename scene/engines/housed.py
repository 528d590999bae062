"""Engines behind a port: a pinhole in the water, warped; or rays that begin at the port.

An engine renders as it always does, from a camera that hangs on the user's own; what it draws is
then moved, band by band, to where the port shows it. Cycles traces the port's own rays instead,
where it can and no layers are wanted: warped noise is no longer each pixel's own.
"""

from __future__ import annotations

import contextlib
import functools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ...datasets.housed_layers import TYPICAL_WAVELENGTH, PortView, seen_layers
from ...datasets.layer_file import FrameLayers
from ...settings.descriptions import housing_of
from ...settings.render_plan import RenderPlan
from ...uw_spectral.errors import InputError
from ...uw_spectral.housing import (
    Housing,
    PinholeView,
    RayFit,
    defocus_factor,
    effective_wavelength,
    field_needed,
    fit_rays,
    intrinsics_in_water,
    water_begins,
)
from ...uw_spectral.imaging.layers import parse_layers
from ...uw_spectral.spectra.spectral_image import band_labels, read_exr, write_rgb_exr
from ..readers import moving_surface, port_eye
from ..readers.pinhole import pose_of
from . import traced_port
from .band_engine import BandEngine, Engine, Opening, RenderPass, Weights
from .split_passes import draw_apart

_NEAREST = 0.05  # m before the port: to there the rendered field is wide enough


@dataclass(frozen=True)
class _Look:
    """What a camera sees through its port at a frame."""

    housing: Housing
    view: PinholeView

    @property
    def blur(self) -> float:
        """Aperture in the water over that of the lens: their discs of defocus are the same."""
        return self.housing.camera.fx / self.view.camera.fx

    def aperture(self, camera: bpy.types.Object, distance: float) -> float:
        """Diameter of the lens as it counts in the water, mm, focused at a distance in m."""
        chosen = camera.data.lens / camera.data.dof.aperture_fstop
        return chosen * self.blur * defocus_factor(self.housing, distance, TYPICAL_WAVELENGTH)


def look_of(
    scene: bpy.types.Scene, camera: bpy.types.Object, plan: RenderPlan, depth: float
) -> Housing | None:
    """Return the housing of a camera at this frame; None if the settings have none.

    InputError if the camera, the port or the lens cannot be used.
    """
    described = housing_of(plan.settings)
    if not described.is_any:
        return None
    in_air = port_eye.lens_camera(scene, camera)
    return described.measured().before(in_air, described.water(depth))


@contextlib.contextmanager
def opened(
    engine: Engine, scene: bpy.types.Scene, camera: bpy.types.Object, opening: Opening
) -> Iterator[BandEngine]:
    """Open an engine for a camera, behind a port if the settings have one.

    InputError if the port, the lens or the camera cannot be used.
    """
    housing = look_of(scene, camera, opening.plan, opening.depth)
    if housing is None:
        with engine.open(scene, camera, opening) as found:
            yield found
        return
    trough = moving_surface.deepest_trough(opening.plan.settings)
    port_eye.require_under_water(camera, opening.eyes, trough)
    way = _traced if _traces(engine, camera, opening) else _warped
    with port_eye.port_eye(scene, camera) as eye, way(engine, scene, camera, eye, opening) as found:
        yield replace(found, notes=[*found.notes, _note(housing)])


def _traces(engine: Engine, camera: bpy.types.Object, opening: Opening) -> bool:
    return (
        engine.method.traced
        and opening.device == "cpu"
        and not parse_layers(opening.plan.settings.layers)
        and traced_port.is_known(camera)
    )


def _note(housing: Housing) -> str:
    air = housing.camera
    try:
        fitted, error = intrinsics_in_water(housing, TYPICAL_WAVELENGTH, distorted=True)
    except InputError as problem:
        return f"behind the port: {problem}"
    found = fitted.camera
    return (
        f"behind the port: in air focal length {air.fx:.1f} pixels; in water the picture is that "
        f"of a camera of {found.fx:.1f} pixels with distortion "
        f"{', '.join(f'{k:.4f}' for k in found.lens.numbers.values())} (k1, k2, p1, p2, k3) at "
        f"{TYPICAL_WAVELENGTH:g} nm, to {error:.2f} pixels"
    )


@contextlib.contextmanager
def _warped(
    engine: Engine,
    scene: bpy.types.Scene,
    camera: bpy.types.Object,
    eye: bpy.types.Object,
    opening: Opening,
) -> Iterator[BandEngine]:
    def look(plan: RenderPlan, depth: float) -> _Look:
        housing = look_of(scene, camera, plan, depth)
        assert housing is not None, "no keyframe takes a port away"
        view = field_needed(housing, _NEAREST, plan.bands.centres, finest=False)
        found = _Look(housing, view)
        focus = port_eye.focus_of(camera)
        aperture = found.aperture(camera, focus)
        port_eye.set_eye(eye, camera, view, water_begins(housing, view), aperture, focus)
        return found

    with contextlib.ExitStack() as stack:
        first = look(opening.plan, opening.depth)
        with port_eye.picture_of(scene, first.view):
            inner = stack.enter_context(engine.open(scene, eye, opening))

        def frame(now: RenderPlan, depth: float, weights: Weights | None = None) -> RenderPass:
            seen = look(now, depth)
            with port_eye.picture_of(scene, seen.view):
                draw = inner.frame(now, depth, weights)
            colours = None
            if engine.method.draws_colours:
                place = now.viewpoint(depth)
                given = place.reduction.weights if weights is None else weights
                colours = effective_wavelength(now.bands.centres, (given * place.light).T).tolist()
            return _Warp(scene, camera, eye, inner, seen, now, depth, colours).around(draw)

        yield replace(inner, frame=frame)


@dataclass
class _Warp:
    """The passes of a frame, moved to where the port shows what they hold."""

    scene: bpy.types.Scene
    camera: bpy.types.Object
    eye: bpy.types.Object
    inner: BandEngine
    look: _Look
    plan: RenderPlan
    depth: float
    colours: Sequence[float] | None
    port: PortView | None = None

    def around(self, draw: RenderPass) -> RenderPass:
        def render(indices: tuple[int, ...], path: Path) -> FrameLayers | None:
            with port_eye.picture_of(self.scene, self.look.view):
                port = self._seen(path)
                layers = draw(indices, path)
            image, _ = read_exr(path)
            write_rgb_exr(path, port.picture(image[..., :3], self._wavelengths(indices)))
            return None if layers is None else self._moved(layers, port)

        return render

    def _seen(self, path: Path) -> PortView:
        if self.port is None:
            depth = self.inner.depth(path)
            self.port = PortView(self.look.housing, self.look.view, depth)
        return self.port

    def _wavelengths(self, indices: tuple[int, ...]) -> Sequence[float]:
        if self.colours is not None:
            return self.colours
        centres = self.plan.bands.centres
        return [float(centres[i]) for i in [*indices, *[indices[-1]] * (3 - len(indices))]]

    def _moved(self, layers: FrameLayers, port: PortView) -> FrameLayers:
        bands, place = self.plan.bands, self.plan.viewpoint(self.depth, 0.0)
        labels = dict(zip(band_labels(bands), bands.centres.tolist(), strict=True))
        sensor = effective_wavelength(bands.centres, (place.reduction.response * place.light).T)
        return seen_layers(
            layers, port, labels, sensor.tolist(), pose_of(self.eye), self.camera.name
        )


@contextlib.contextmanager
def _traced(
    engine: Engine,
    scene: bpy.types.Scene,
    camera: bpy.types.Object,
    eye: bpy.types.Object,
    opening: Opening,
) -> Iterator[BandEngine]:
    with engine.open(scene, eye, opening) as inner:

        @functools.lru_cache(maxsize=len(opening.plan.bands))
        def port(housing: Housing, nm: float) -> tuple[RayFit, NDArray[np.float64]]:
            """Rays of a band, and the fraction of its light that is let through."""
            passed = housing.transmittance(housing.camera.pixel_centres(), nm)
            return fit_rays(housing, nm), np.nan_to_num(passed)

        def frame(now: RenderPlan, depth: float, weights: Weights | None = None) -> RenderPass:
            housing = look_of(scene, camera, now, depth)
            assert housing is not None, "no keyframe takes a port away"
            draw = inner.frame(now, depth, weights)
            radius, focus = _lens(housing, camera, now)

            def one(indices: tuple[int, ...], path: Path) -> FrameLayers | None:
                rays, passed = port(housing, float(now.bands.centres[indices[0]]))
                with traced_port.rays(eye, rays, radius, focus):
                    layers = draw(indices, path)
                image, _ = read_exr(path)
                write_rgb_exr(path, image * passed[..., None].astype(np.float32))
                return layers

            def render(indices: tuple[int, ...], path: Path) -> FrameLayers | None:
                return draw_apart([(index,) for index in indices], path, one)

            return render

        yield replace(inner, frame=frame)


def _lens(housing: Housing, camera: bpy.types.Object, plan: RenderPlan) -> tuple[float, float]:
    """Radius of the lens as it counts in the water, and distance of the focus, m."""
    focus = port_eye.focus_of(camera)
    if not camera.data.dof.use_dof:
        return 0.0, focus
    try:
        view = field_needed(housing, _NEAREST, plan.bands.centres, finest=False)
    except InputError as problem:
        raise InputError(f"{problem}; or switch depth of field off") from problem
    return 0.5e-3 * _Look(housing, view).aperture(camera, focus), focus
