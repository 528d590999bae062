"""Samples of surfaces: everywhere, and not many more than are needed."""

from __future__ import annotations

import math

import bpy
import numpy as np
from underwater_spectral.scene.readers.surface_samples import sampled, visible_triangles

LENGTH, RADIUS, SIDES = 14.0, 1.0, 48
SPACING = 0.05


def test_long_narrow_triangles_have_samples_everywhere_and_no_more_than_others():
    """Quarters of those of a pipe, 14 m by .13 m, were 25 million in the place of .8."""
    bpy.ops.mesh.primitive_cylinder_add(
        radius=RADIUS, depth=LENGTH, vertices=SIDES, end_fill_type="NOTHING",
        rotation=(0.3, 1.1, 0.2),
    )  # fmt: skip
    bpy.context.view_layer.update()
    pipe = next(visible_triangles(bpy.context.evaluated_depsgraph_get()))
    found = sampled(pipe, np.full(3, -20.0), np.full(3, 20.0), SPACING)
    area = SIDES * 2.0 * RADIUS * math.sin(math.pi / SIDES) * LENGTH
    np.testing.assert_allclose(found.areas.sum(), area, rtol=1e-4)
    assert len(found.areas) < 24 * area / SPACING**2
    assert (found.extents <= SPACING + 1e-5).all()
    # Of the outside all normals are across the axis, and there is a sample within a spacing.
    axis = np.array(bpy.context.object.matrix_world)[:3, 2]
    np.testing.assert_allclose(found.normals @ axis, 0.0, atol=1e-3)
    corners = pipe.corners.astype(np.float64)
    random = np.random.default_rng(2)
    parts = random.dirichlet([1.0, 1.0, 1.0], 40)
    for point in np.einsum("pk,pkx->px", parts, corners[random.integers(0, len(corners), 40)]):
        assert np.linalg.norm(found.points - point, axis=1).min() < SPACING
