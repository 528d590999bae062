"""Pictures of a job for sensors of any number of channels, and what is shown of them."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ..quality.methods import Method
from ..settings.render_plan import RenderPlan
from ..uw_spectral.errors import InputError
from ..uw_spectral.imaging.viewpoint import Viewpoint
from ..uw_spectral.spectra.bands import Bands
from ..uw_spectral.spectra.colour_rendering import DARKEST, white_response
from ..uw_spectral.spectra.receptors import Receptors, parse_false_colour
from ..uw_spectral.spectra.spectral_image import write_exr, write_png
from .view_passes import ViewPasses, Written

_LEGEND = (24, 320)  # height and width, pixels


def require_bands(plan: RenderPlan, method: Method) -> None:
    """Refuse receptors that the files, the bands or the method do not allow, before a render."""
    if plan.settings.receptors and method.draws_colours:
        raise InputError(
            "--receptors: real time draws the colours of the sensor alone; render --mode bands, or "
            "with --engine cycles"
        )
    receptors = plan.receptors
    if receptors is not None:
        receptors.response_in(plan.bands)
        receptors.warn_doubts(plan.bands)
        parse_false_colour(plan.settings.false_colour, receptors)


def write_receptor_pictures(passes: ViewPasses) -> Written:
    """Write what receptors see of a view, if there are some, and return what the files hold.

    Responses are as rendered: not denoised, neither balanced nor exposed, in units of radiance
    times nm; false colours are denoised where the picture is.
    """
    manifest, view, plan, output = passes.manifest, passes.view, passes.plan, passes.output
    receptors = plan.receptors
    if receptors is None or manifest.method.draws_colours:
        return {}, []
    false_colour = parse_false_colour(plan.settings.false_colour, receptors)
    response = receptors.response_in(plan.bands)
    # The compositor combines bands into three channels at a time.
    triples = np.zeros((math.ceil(len(response) / 3), 3, response.shape[1]))
    triples.reshape(-1, response.shape[1])[: len(response)] = response
    found = [passes.developed(weights, denoise=False) for weights in triples]
    seen = np.concatenate(found, axis=-1)[..., : len(response)]
    exr, tiff, shown, legend = passes.files.receptors
    camera = plan.viewpoint(view.depth, 0.0, manifest.lamplight_of(view))
    white = _white(plan, camera, receptors, response)
    stops = camera.reduction.stops_to(manifest.weights(view))
    matrix = false_colour.matrix(receptors, white) * 2.0**stops
    record = {
        "name": receptors.name,
        "channels": list(receptors.channels),
        "units": f"{plan.radiance_units} nm",
        "false_colour": {**false_colour.legend, "white": white.tolist(), "stops": stops},
    }
    header = {"ImageDescription": ", ".join(receptors.channels), "receptors": record}
    for path in (exr, tiff):
        write_exr(path, output.framed(seen), receptors.channels, header)
    colours = passes.developed(matrix @ response, denoise=output.denoise)
    write_png(shown, output.framed(colours))
    write_png(legend, _legend(matrix, receptors, plan.bands))
    return {"receptors": record}, []


def _white(
    plan: RenderPlan, camera: Viewpoint, receptors: Receptors, response: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the responses that false colours show as white, as the white balance is set."""
    names = f"receptors {receptors.name}", *receptors.channels
    above = plan.illuminant.total_in(plan.bands)
    surface = white_response(response, above, names, "at the surface")
    if camera.white_balance == "none":
        return np.full(len(response), surface.mean())
    if camera.white_balance == "daylight":
        return surface
    return white_response(response, camera.light, names, "at depth", DARKEST * surface)


def _legend(matrix: NDArray[np.float64], receptors: Receptors, bands: Bands) -> NDArray[np.float64]:
    """Return the false colours of single wavelengths, the shortest at the left."""
    ends = bands.centres[0] - bands.widths[0] / 2, bands.centres[-1] + bands.widths[-1] / 2
    colours = receptors.sensitivity.at_or_zero(np.linspace(*ends, _LEGEND[1])) @ matrix.T
    return np.broadcast_to(colours / max(colours.max(), DARKEST), (*_LEGEND, 3))
