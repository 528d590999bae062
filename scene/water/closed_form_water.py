"""The closed form as EEVEE draws it: ``--field closed-form``, which combines with nothing else.

Every material is lit white by the sun (Shader to RGB) and sent through one group for every three
bands; the world shows the open water with its surface and its floor, on which nothing throws a
shadow. There are no tables: what differs between frames are the numbers of the groups.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import bpy
import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...node_groups import closed_form_bands, closed_form_group
from ...node_groups.closed_form_group import (
    ABSORPTION,
    ASYMMETRY,
    FLOOR_REFLECTANCE,
    SCATTERING,
    SECOND_MOMENT,
    SKY_RADIANCE,
    SUN_IRRADIANCE,
)
from ...settings.scene_settings import SceneSettings
from ...uw_spectral.errors import InputError
from ...uw_spectral.imaging.layers import parse_layers
from ...uw_spectral.spectra.reflectance import emission_basis, uplift_basis
from ...uw_spectral.transfer.sky import UNIFORM
from ...uw_spectral.transfer.water_column import WAVES, WaterColumn
from ...uw_spectral.water.phase import BandPhase
from .. import marks
from ..materials import realtime_materials
from ..seen.closed_bodies import closed_materials
from . import scene_water
from .water_body import WaterExtent

MOST_BANDS = 12
"""Bands of one shader, which computes each anew; more take more passes."""
_BACKGROUND = "uw_closed_form_background"
_SHADOW = 0.01  # m: finest detail of the sun's shadow


@dataclass(frozen=True, eq=False)
class ClosedFormWater:
    """The water of a frame; make it with :func:`closed_form_water`.

    Parameters
    ----------
    column : WaterColumn
        Of one layer.
    phase : BandPhase
        On its bands; its first two moments count.
    weights : array, shape (3, n)
        Linear RGB per unit radiance of each band.
    indices : tuple of int
        The bands that are drawn.
    count : int
        Bands that the nodes have; the last one that is drawn fills up, unseen.
    """

    column: WaterColumn
    phase: BandPhase
    weights: NDArray[np.float64]
    indices: tuple[int, ...]
    count: int

    def of_bands(self, indices: Sequence[int], count: int) -> ClosedFormWater:
        """Return the water of some of the bands, in nodes of ``count``."""
        return replace(self, indices=tuple(indices), count=count)

    def of_triple(self, indices: Sequence[int], gains: ArrayLike) -> ClosedFormWater:
        """Return the water of one band pass: up to three bands, as red, green and blue.

        Parameters
        ----------
        indices : sequence of int
        gains : array_like, shape (3,) or fewer
            Factor of each channel that brings its radiance near 1.
        """
        weights = np.zeros_like(self.weights)
        for channel, (band, gain) in enumerate(zip(indices, np.asarray(gains), strict=False)):
            weights[channel, band] = gain
        return replace(self, weights=weights, indices=tuple(indices), count=3)

    def of_sign(self, sign: float) -> ClosedFormWater:
        """Return the water with the weights of one sign, 1 or -1, as positive ones."""
        return replace(self, weights=np.maximum(sign * self.weights, 0.0))

    @property
    def numbers(self) -> closed_form_bands.BandNumbers:
        """What the nodes hold."""
        column, chosen = self.column, list(self.indices)
        bands = {
            ABSORPTION: column.absorption,
            SCATTERING: column.scattering,
            ASYMMETRY: self.phase.chi1,
            SECOND_MOMENT: self.phase.chi2,
            SUN_IRRADIANCE: column.sun_irradiance,
            SKY_RADIANCE: column.sky_radiance,
            FLOOR_REFLECTANCE: column.floor_reflectance,
        }
        return closed_form_bands.numbers_of(
            {name: np.broadcast_to(x, len(column.bands))[chosen] for name, x in bands.items()},
            sun=column.sun_direction.tolist(),
            floor_depth=column.floor_depth,
            index=column.refractive_index if column.reflects else 1.0,
            reflectance=uplift_basis(column.bands)[chosen],
            emission=emission_basis(column.bands)[chosen],
            sensor=np.asarray(self.weights)[:, chosen],
            count=self.count,
        )


def closed_form_water(
    column: WaterColumn, phase: BandPhase, weights: NDArray[np.float64]
) -> ClosedFormWater:
    """Return the water of a frame.

    Raises
    ------
    InputError
        If the water has layers.
    """
    column.require_one_layer("the closed form (--field) knows")
    count = len(column.bands)
    return ClosedFormWater(column, phase, weights, tuple(range(count)), count)


def refuse(chosen: SceneSettings, *, lamps: bool = False, above: bool = False) -> None:
    """Refuse what the closed form does not combine with.

    Parameters
    ----------
    chosen : SceneSettings
    lamps : bool
        Whether the scene has lamps in its water.
    above : bool
        Whether the camera may be in the air.

    Raises
    ------
    InputError
        If anything of it is asked for; each is named.
    """
    found = [
        text
        for text, asked in (
            ("--surface waves", chosen.surface == WAVES),
            ("--shafts", chosen.shafts),
            ("--inelastic", bool(chosen.inelastic)),
            ("--layers", bool(parse_layers(chosen.layers))),
            ("lamps in the water", lamps),
            ("a camera in the air", above),
        )
        if asked
    ]
    if found:
        raise InputError(
            f"--field closed-form combines with nothing, and this asks for {', '.join(found)}; "
            "leave that out, or take --field solved"
        )


def notes(chosen: SceneSettings, phase: BandPhase) -> list[str]:
    """Return what the closed form leaves out without asking, one line each."""
    found = ["closed form: things throw shadows of the sun only, and none on the added floor"]
    if chosen.sky != UNIFORM:
        found.append(f"closed form: the {chosen.sky} sky is drawn as a uniform one")
    if not all("HenyeyGreenstein" in type(part).__name__ for part in phase.components):
        found.append(
            "closed form: the phase function is drawn as Henyey-Greenstein's of its mean cosine"
        )
    return found


def add(scene: bpy.types.Scene, water: ClosedFormWater, extent: WaterExtent) -> list[str]:
    """Put the water into a scene; :func:`.scene_water.remove` takes it out.

    Parameters
    ----------
    scene : Scene
        Its z = 0 is the mean water surface.
    water : ClosedFormWater
        Of the first frame; its bands decide how many groups there are.
    extent : WaterExtent
        Size of the water.

    Returns
    -------
    list of str
        What could not be treated, one line each.

    Raises
    ------
    InputError
        If the scene has water already or is linked from another file, or the water has more
        bands than one shader carries.
    """
    if water.count > MOST_BANDS:
        raise InputError(
            f"one shader carries up to {MOST_BANDS} bands of the closed form, and this water has "
            f"{water.count}; take some of them at a time (ClosedFormWater.of_bands)"
        )
    scene_water.prepare(scene)
    materials, found = scene_water.own_materials(scene, routed=False)
    numbers = water.numbers
    group = closed_form_group.build()
    surface = closed_form_bands.build(group, numbers.triples)
    background = closed_form_bands.build_background(group, numbers.triples)
    found += realtime_materials.insert(
        materials, realtime_materials.Surfaces(surface, closed=closed_materials(scene))
    )
    sun = bpy.data.lights.new("UW Sun", "SUN")
    sun.energy, sun.shadow_maximum_resolution = 1.0, _SHADOW
    filling = scene_water.Filling(
        closed_form_bands.build_world(background), [sun], None, [],
        parts={marks.SURFACE: surface, _BACKGROUND: background},
    )  # fmt: skip
    found += scene_water.add(scene, filling, water.column, extent)
    set_values(scene, water)
    return found


def set_values(scene: bpy.types.Scene, water: ClosedFormWater) -> None:
    """Give the water in a scene other values; nothing is rebuilt.

    Raises
    ------
    InputError
        If it holds no such water, or that of another number of bands.
    """
    trees = [marks.part(scene, name) for name in (marks.SURFACE, _BACKGROUND)]
    numbers = water.numbers
    for tree in trees:
        held = 0 if tree is None else closed_form_bands.triples_of(tree)
        if tree is None or held != numbers.triples:
            raise InputError(
                f"scene {scene.name!r} holds closed-form water of {held} times three bands, not "
                f"{numbers.triples}; remove it and add it again"
            )
        closed_form_bands.write(tree, numbers)
    realtime_materials.refresh()
    scene_water.place(scene, water.column)
