"""Sets the values of a render pass on a view layer, where the node trees read them."""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np
from numpy.typing import NDArray

from ..node_groups import attributes


@dataclass(frozen=True, eq=False)
class PassValues:
    """Every quantity that differs by band, over all n bands.

    ``values`` maps the name of a view-layer property to an array, shape (n,).
    """

    values: dict[str, NDArray[np.float64]]

    def apply(self, layer: bpy.types.ViewLayer, indices: tuple[int, ...]) -> None:
        """Give a view layer the values of the pass that carries these bands.

        A pass with fewer than three bands repeats its last one.
        """
        filled = list(indices) + [indices[-1]] * (3 - len(indices))
        for name, values in self.values.items():
            layer[name] = [float(value) for value in values[filled]]

    def refresh(self, scene: bpy.types.Scene) -> None:
        """Tell Blender that materials, lamps and the world read new values.

        Without it a render that keeps its data uses stale ones.
        """
        scene.world.update_tag()
        for item in scene.objects:
            if item.type == "LIGHT":
                item.data.update_tag()
            for slot in item.material_slots:
                if slot.material is not None:
                    slot.material.update_tag()


def clear(layer: bpy.types.ViewLayer) -> None:
    """Delete every value that :class:`PassValues` has set."""
    for name in [key for key in layer.keys() if key.startswith(attributes.PREFIX)]:  # noqa: SIM118
        del layer[name]
