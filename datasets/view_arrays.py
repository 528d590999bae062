"""A file a view with all of its pixels: OpenEXR for compositors, HDF5 with BlenderProc's keys."""

from __future__ import annotations

import json

import numpy as np

from ..uw_spectral.spectra.spectral_image import LINEAR_REC709, read_exr, replacing, write_exr
from .depth_maps import PLANAR
from .files import make_folder
from .picture_codes import read_codes
from .set_files import SetFiles, shown_pixels
from .view import category_numbers

COMPOSITOR_LAYERS = {
    PLANAR: ("Depth", "Z"),
    "normal": ("Normal", "XYZ"),
    "motion": ("Vector", "XYZW"),
}
"""Layers of an EXR for compositors, by the names and channels that Blender gives them."""
_LAYER = "ViewLayer"
_NOTHING = 1e10  # m; Blender's depth where nothing is seen


def write_compositor_exrs(files: SetFiles) -> None:
    """Write ``exr/NAME.exr``: ``ViewLayer.Combined.R``, ``ViewLayer.Depth.Z`` and so on.

    Source: Blender manual, *Render output, OpenEXR*.
    """
    folder = make_folder(files.folder / "exr")
    for view in files.views:
        rgb, layers = read_exr(files.rendered[view.name].picture)[0], files.layers(view)
        values = [np.dstack([rgb[..., :3], np.ones_like(rgb[..., :1])])]
        channels = [f"{_LAYER}.Combined.{c}" for c in "RGBA"]
        for name, (shown, letters) in COMPOSITOR_LAYERS.items():
            found = layers[name]
            image = found if found.ndim == 3 else found[..., None]
            if name == PLANAR:
                image = np.where(np.isfinite(image), image, _NOTHING)
            values.append(image)
            channels += [f"{_LAYER}.{shown}.{letter}" for letter in letters]
        write_exr(folder / f"{view.name}.exr", np.dstack(values), channels, LINEAR_REC709)


def write_hdf5s(files: SetFiles) -> None:
    """Write ``hdf5/NUMBER.hdf5`` in the order of the views.

    ``colors``, ``depth`` (planar, m, 0 where nothing is seen), ``instance_segmaps`` with
    ``instance_attribute_maps``, and ``camera``: K, pose and name as JSON.

    Source: M. Denninger et al., J. Open Source Softw. 8, 4901 (2023); BlenderProc, *HDF5 writer*.
    """
    import h5py

    folder = make_folder(files.folder / "hdf5")
    numbers = category_numbers(files.views, first=1)
    for number, view in enumerate(files.views):
        depth = files.planar_depth(view).astype(np.float32)
        camera = {
            "name": view.name,
            "split": view.split,
            "cam_K": view.camera.K_opencv.tolist(),
            "cam2world_matrix": view.camera_to_world.tolist(),
            **{key: view.metadata[key] for key in ("water", "camera") if key in view.metadata},
        }
        objects = [
            {"idx": x.number, "name": x.category, "category_id": numbers[x.category]}
            for x in view.instances
        ]
        with replacing(folder / f"{number}.hdf5") as temporary, h5py.File(temporary, "w") as file:
            file.create_dataset("colors", data=shown_pixels(view), compression="gzip")
            shown = np.where(np.isfinite(depth), depth, 0.0)
            file.create_dataset("depth", data=shown, compression="gzip")
            if view.instance_map is not None:
                codes = read_codes(view.instance_map)
                file.create_dataset("instance_segmaps", data=codes, compression="gzip")
            for key, content in (("instance_attribute_maps", objects), ("camera", camera)):
                file.create_dataset(key, data=np.bytes_(json.dumps(content)))
