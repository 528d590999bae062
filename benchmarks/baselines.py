"""What others draw: the paper's formula, its RGB variant, and exponential fog.

Only for comparison; nothing here reaches the add-on's interface.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ..settings.render_plan import RenderPlan, make_plan
from ..settings.scene_settings import SceneSettings
from ..uw_spectral.spectra.colour_rendering import luminance
from ..uw_spectral.surface.refraction import fresnel_reflectance
from ..uw_spectral.transfer.radiance_field import distance_in_water
from ..validation.monzon import path_radiance_Monzon2024, path_radiance_Monzon2024_corrected
from .grey_scene import Hits

PathRadianceForm = Callable[..., NDArray[np.float64]]
# One wavelength per channel, at the dominant wavelengths of the Rec.709 primaries.
_RGB_WAVELENGTHS = "464,549,611"


def rgb_plan(settings: SceneSettings) -> RenderPlan:
    """Return the plan of settings with one wavelength each for blue, green and red."""
    return make_plan(SceneSettings(**{**vars(settings), "wavelengths": _RGB_WAVELENGTHS}))


def as_rgb(plan: RenderPlan, depth: float, image: NDArray[np.float64]) -> NDArray[np.float64]:
    """Take three wavelengths for blue, green, red; expose as the spectral pictures are."""
    return sensed(plan, depth, image, np.eye(3)[::-1])


def sensed(
    plan: RenderPlan, depth: float, image: NDArray[np.float64], response: NDArray[np.float64]
) -> NDArray[np.float64]:
    """What channels of responses (3, n) tell, balanced for the light above, without a matrix.

    Exposed as the spectral pictures are: white at the camera's depth has luminance 0.9.
    """
    white = plan.illuminant.total_in(plan.bands) / math.pi @ response.T
    at_depth = plan.column.Ed(depth, plan.phase) / math.pi @ response.T / white
    return image @ response.T / white * (0.9 / luminance(at_depth))


def paper_image(
    plan: RenderPlan, hits: Hits, depth: float, form: PathRadianceForm
) -> NDArray[np.float64]:
    """Band radiances with the paper's path radiance and its surface lighting by Kd.

    Their shape is (h, w, n). The water must have a Kd; ``hits`` are what the camera's rays meet;
    ``depth`` is that of the camera, m; ``form`` :func:`path_radiance_Monzon2024` or its corrected
    form.
    """
    column = plan.column
    Kd = plan.water.Kd(plan.bands.centres)
    w_y = -hits.direction[..., 2, None]
    seen = np.isfinite(hits.distance)[..., None]
    open_water = distance_in_water(depth, w_y, column.floor_depth)
    P = np.where(seen, hits.distance[..., None], open_water)
    y = depth + w_y * P
    cosine = np.maximum(-(hits.normal @ column.sun_direction), 0.0) / column.sun_cosine
    lit = (cosine * hits.sunlit)[..., None] * column.sun_irradiance * np.exp(-Kd * y)
    surface = hits.in_bands(plan.bands) / math.pi * lit
    path = form(
        column.scattering, column.attenuation, Kd, column.sun_irradiance, column.floor_reflectance,
        depth, w_y, P, column.floor_depth,
    )  # fmt: skip
    behind = np.where(seen, surface, 0.0)
    if column.reflects:
        # The fraction of the sky that the surface lets through; the paper has no n².
        cosine = np.maximum(-w_y, 0.0)
        passed = 1.0 - fresnel_reflectance(cosine, 1.0 / column.refractive_index)
        behind = behind + np.where(seen | (w_y >= 0), 0.0, passed * column.sky_radiance)
    return path + np.exp(-column.attenuation * P) * behind


def fog_image(plan: RenderPlan, hits: Hits, depth: float) -> NDArray[np.float64]:
    """Band radiances with exponential fog towards the colour of level open water.

    The fog gets the best constants there are, those of the solved field: its
    colour is the radiance of the open water ahead, its density c.
    """
    column = plan.column
    P = hits.distance[..., None]
    ahead = plan.viewpoint(depth).field.radiance(depth, (0.0, 1.0, 0.0))
    cosine = np.maximum(-(hits.normal @ column.sun_direction), 0.0) / column.sun_cosine
    lit = (cosine * hits.sunlit)[..., None] * column.Ed(depth, plan.phase)
    surface = hits.in_bands(plan.bands) / math.pi * lit
    transmitted = np.exp(-column.attenuation * P)
    return transmitted * surface + (1.0 - transmitted) * ahead


PAPER_FORMS = {
    "paper, printed": path_radiance_Monzon2024,
    "paper, corrected": path_radiance_Monzon2024_corrected,
}
