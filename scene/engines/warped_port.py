"""Engines behind a port whose pictures are moved, band by band, to where the port shows them."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import bpy

from ...datasets.housed_layers import PortView, seen_layers
from ...datasets.layer_file import FrameLayers
from ...settings.render_plan import RenderPlan
from ...uw_spectral.housing import effective_wavelength, water_begins
from ...uw_spectral.spectra.spectral_image import band_labels, read_exr, write_rgb_exr
from ..readers import port_eye
from ..readers.pinhole import pose_of
from .band_engine import BandEngine, Engine, Opening, RenderPass, Weights
from .port_look import PortLook, look_of


@contextlib.contextmanager
def warped(
    engine: Engine,
    scene: bpy.types.Scene,
    camera: bpy.types.Object,
    eye: bpy.types.Object,
    opening: Opening,
) -> Iterator[BandEngine]:
    """Open an engine for an eye that hangs on a camera, and move what it draws."""

    def look(plan: RenderPlan, depth: float) -> PortLook:
        housing = look_of(scene, camera, plan, depth)
        assert housing is not None, "no keyframe takes a port away"
        found = PortLook.of(housing, plan)
        view = found.view
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
    look: PortLook
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
