"""Compositor group: band images times the sensor's weights → linear RGB."""

from __future__ import annotations

import functools
import operator
from collections.abc import Sequence

import bpy
import numpy as np
from nodebpy import compositor as c
from numpy.typing import NDArray

NAME = "UW Sensor"


def build(
    weights: NDArray[np.float64], passes: Sequence[tuple[int, ...]]
) -> bpy.types.CompositorNodeTree:
    """Build the group for a reduction.

    Parameters
    ----------
    weights : array, shape (3, n)
        Linear RGB per unit radiance of each band.
    passes : sequence of tuples
        The band indices that the channels of each pass image carry.

    Returns
    -------
    CompositorNodeTree
        Inputs ``Pass 1`` … ``Pass m`` (colour), output ``Image``.
    """
    with c.tree(NAME) as tree:
        parts = []
        for number, indices in enumerate(passes, start=1):
            image = tree.inputs.color(f"Pass {number}")
            bands = c.SeparateColor(image)
            vector = c.CombineXYZ(bands.o.red, bands.o.green, bands.o.blue).o.vector
            rows = np.zeros((3, 3))
            rows[:, : len(indices)] = weights[:, list(indices)]
            parts.append([vector.dot(tuple(row)) for row in rows])
        sums = (functools.reduce(operator.add, channel) for channel in zip(*parts, strict=True))
        c.CombineColor(*sums) >> tree.outputs.color("Image")
    return tree.tree
