"""Node group colour of what is clear → fraction of each channel that it lets through.

Channels are sums over bands: what a colour takes of one depends on the light behind, for which that
of level open water at the camera stands.
"""

from __future__ import annotations

import bpy

from . import uplift
from .group_sockets import VECTOR, OpenGroup
from .realtime_values import FILTERS, Values
from .shape import Shape

NAME = "UW Filter"


def build(values: bpy.types.ShaderNodeTree, shape: Shape) -> bpy.types.ShaderNodeTree:
    """Build the group; it is one of those that stand before the user's inputs."""
    group = OpenGroup(NAME, {uplift.COLOR_INPUT: VECTOR})
    group.tree[uplift.KIND] = uplift.FILTER
    columns = Values(group.graph, values, shape).of(*FILTERS)
    return group.finished({"Fraction": uplift.weighed(columns, group.given[uplift.COLOR_INPUT])})
