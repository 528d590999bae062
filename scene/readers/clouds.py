"""The clouds of a scene: objects that are marked as matter that floats in its water."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np
from numpy.typing import ArrayLike

from ...uw_spectral.clouds.gaussian_blob import GaussianBlob
from ...uw_spectral.clouds.matter import BUBBLES, UNITS, suspended_matter
from ...uw_spectral.clouds.solved_cloud import Cloud
from ...uw_spectral.errors import InputError
from .. import marks
from ..materials import bare_surfaces
from ..rendered import ever_rendered
from ..stored_clouds import stored_cloud

BLOB, GRID = "EMPTY", "VOLUME"
"""Types of objects that are clouds: of a blob, and of a grid."""
_NEITHER = (
    "it is neither an empty nor a volume object, and no cloud is drawn; bake smoke to OpenVDB and "
    "add that as a volume object"
)
_ABOVE = "its middle is above the water, and it is not drawn; lower it"
_SHAFTS = "shafts of light are drawn as if it were not there"

BUBBLES_IN_CYCLES = (
    "Cycles has no phase function of bubbles: a Henyey-Greenstein one of their mean cosine stands "
    "for it, so that thin clouds of them are too bright with the sun behind, up to 3.2 times"
)


@dataclass(frozen=True, eq=False)
class SceneClouds:
    """Clouds of a scene, and the objects that they come from."""

    objects: tuple[bpy.types.Object, ...] = ()
    #: That of a grid has its bounds, and only tells its matter and place.
    clouds: tuple[Cloud, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def blobs(self) -> tuple[Cloud, ...]:
        """Those of empties."""
        pairs = zip(self.objects, self.clouds, strict=True)
        return tuple(cloud for item, cloud in pairs if item.type == BLOB)

    @property
    def grids(self) -> tuple[tuple[bpy.types.Object, Cloud], ...]:
        """Those of volume objects, with these; their density is read by :mod:`.volume_grids`."""
        pairs = zip(self.objects, self.clouds, strict=True)
        return tuple((item, cloud) for item, cloud in pairs if item.type == GRID)

    def unseen_by_eevee(self, *, shafts: bool) -> tuple[str, ...]:
        """Return what EEVEE does not draw of them, one line each."""
        notes = list(self.notes)
        for item in self.objects:
            notes += [f"cloud {item.name!r}: {_SHAFTS}"] if shafts else []
        return tuple(notes)


def objects_of(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """Return the objects of a scene that are clouds now or at another frame, by name."""
    return [item for item in marked(scene) if item.type in (BLOB, GRID)]


def is_grid(block: bpy.types.ID) -> bool:
    """Whether a data-block is a volume object that is a cloud."""
    is_volume = isinstance(block, bpy.types.Object) and block.type == GRID
    return is_volume and bool(stored_cloud(block).constituent)


def grids_of(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """Return those of them that have grids."""
    return [item for item in objects_of(scene) if item.type == GRID]


def diagnostics(item: bpy.types.Object) -> tuple[str, ...]:
    """Return what to know of an object that is marked as a cloud, for the panel."""
    if item.type not in (BLOB, GRID):
        return (_NEITHER,)
    bubbles = stored_cloud(item).constituent == BUBBLES
    notes = (BUBBLES_IN_CYCLES,) if bubbles else ()
    return (*notes, _ABOVE) if is_above(item) else notes


def is_above(item: bpy.types.Object) -> bool:
    """Whether a blob has its middle above the water: it is none then. Grids end at the surface."""
    return item.type == BLOB and item.matrix_world.translation.z > 0.0


def clouds_of(scene: bpy.types.Scene, wavelengths: ArrayLike) -> SceneClouds:
    """Return the clouds of a scene's current frame, for bands at wavelengths in nm.

    InputError names the object if one is flat, or its concentration is out of range.
    """
    objects, found = objects_of(scene), []
    notes = [f"cloud {x.name!r}: {_NEITHER}" for x in marked(scene) if x not in objects]
    for item in objects:
        chosen = stored_cloud(item)
        above = is_above(item)
        notes += [f"cloud {item.name!r}: {_ABOVE}"] if above else []
        amount = 0.0 if above or marks.is_hidden(item) else chosen.concentration
        try:
            matter = suspended_matter(chosen.constituent, amount, wavelengths)
            place = np.array(item.matrix_world, dtype=np.float64)
            blob = GaussianBlob.of_axes(place[:3, 3], place[:3, :3] * outline(item))
        except InputError as error:
            raise InputError(f"cloud {item.name!r}: {error}") from error
        found.append(Cloud(blob, matter))
    return SceneClouds(tuple(objects), tuple(found), tuple(notes))


def outline(item: bpy.types.Object) -> float:
    """Return the length in an object's own space that its outline is away from its middle."""
    return float(item.empty_display_size) if item.type == BLOB else 1.0


def state(scene: bpy.types.Scene) -> tuple[object, ...]:
    """Return all that the clouds of a scene depend on, to be compared."""
    return tuple(
        (
            item.name_full, stored_cloud(item), outline(item), marks.is_hidden(item),
            *(x for row in item.matrix_world for x in row), *_contents(scene, item),
        )
        for item in objects_of(scene)
    )  # fmt: skip


def _contents(scene: bpy.types.Scene, item: bpy.types.Object) -> tuple[object, ...]:
    """What the density of a volume object depends on; how its nodes are set is not looked at."""
    if item.type != GRID:
        return ()
    volume, own = item.data, [x for x in item.modifiers if x.name != bare_surfaces.MODIFIER]
    changes = volume.is_sequence or bool(own)
    modifiers = [(x.name, x.type, x.show_render, x.show_viewport) for x in own]
    return volume.name_full, volume.filepath, *modifiers, scene.frame_current_final * changes


def records(scene: bpy.types.Scene) -> tuple[dict[str, Any], ...]:
    """Return the clouds of a scene's current frame as JSON holds them; lengths are m."""
    return tuple(
        _record(item) for item in objects_of(scene) if not (marks.is_hidden(item) or is_above(item))
    )


def _record(item: bpy.types.Object) -> dict[str, Any]:
    chosen, place = stored_cloud(item), np.array(item.matrix_world, dtype=np.float64)
    found: dict[str, Any] = {
        "name": item.name,
        "kind": "blob" if item.type == BLOB else "grid",
        "constituent": chosen.constituent,
        "concentration": chosen.concentration,
        "unit": UNITS[chosen.constituent],
        "position": place[:3, 3].tolist(),
    }
    if item.type == BLOB:
        found["half_axes"] = (place[:3, :3] * outline(item)).T.tolist()
    return found


def marked(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """Return the objects that are marked as clouds, by name, whether they can be or not."""
    own = [item for item in ever_rendered(scene) if marks.MARK not in item]
    # Volume objects are hidden while their copies are in the water.
    hidden = [item for item in scene.objects if marks.HIDDEN in item and item not in own]
    found = [item for item in (*own, *hidden) if stored_cloud(item).constituent]
    return sorted(found, key=lambda item: item.name_full)
