"""Layers for compositors: an OpenEXR of the names and values that Blender's renders have."""

from __future__ import annotations

import numpy as np

from ..uw_spectral.spectra.spectral_image import LINEAR_REC709, read_exr, write_exr
from .depth_maps import PLANAR
from .files import make_folder
from .set_files import SetFiles

LAYERS = (PLANAR, "normal", "motion")
"""Layers that it is made of."""
NAMES = {PLANAR: ("Depth", "Z"), "normal": ("Normal", "XYZ"), "motion": ("Vector", "XYZW")}
_LAYER = "ViewLayer"
_NOTHING = 1e10  # m; Blender's depth where nothing is seen


def write_compositor_exrs(files: SetFiles) -> None:
    """Write ``exr/NAME.exr``: ``ViewLayer.Combined.R``, ``ViewLayer.Depth.Z`` and so on.

    References
    ----------
    Blender manual, *Render output, OpenEXR*.
    """
    folder = make_folder(files.folder / "exr")
    for view in files.views:
        rgb, layers = read_exr(files.rendered[view.name].picture)[0], files.layers(view)
        values = [np.dstack([rgb[..., :3], np.ones_like(rgb[..., :1])])]
        channels = [f"{_LAYER}.Combined.{c}" for c in "RGBA"]
        for name, (shown, letters) in NAMES.items():
            found = layers[name]
            image = found if found.ndim == 3 else found[..., None]
            if name == PLANAR:
                image = np.where(np.isfinite(image), image, _NOTHING)
            values.append(image)
            channels += [f"{_LAYER}.{shown}.{letter}" for letter in letters]
        write_exr(folder / f"{view.name}.exr", np.dstack(values), channels, LINEAR_REC709)
