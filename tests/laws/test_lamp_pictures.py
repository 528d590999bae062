"""Laws of pictures by lamps, in EEVEE in real time.

``python3 dev.py test -m slow tests/laws``
"""

from __future__ import annotations

from collections.abc import Iterator

import bpy
import numpy as np
import pytest

from .scene import LAMPS, Drawing, off, plan

pytestmark = pytest.mark.slow

ROUNDING = 0.003, 0.01
"""Mean and worst block: half floats. By day they are .2 and 1 % of a picture of sun and lamps, and
what lamps add is a tenth of it."""


@pytest.fixture(scope="module")
def drawing() -> Iterator[Drawing]:
    found = Drawing("realtime", plan(4, sunlight=0.0), lamps=True)
    yield found
    found.close()


def _drawn(drawing: Drawing, *watts: float) -> np.ndarray:
    for name, energy in zip(LAMPS, watts, strict=True):
        bpy.data.lights[name].energy = energy
    return drawing.draw()


def _same(one: np.ndarray, other: np.ndarray) -> bool:
    return all(x <= bound for x, bound in zip(off(one, other), ROUNDING, strict=True))


def test_lamps_add_up(drawing):
    both = _drawn(drawing, 20.0, 10.0)
    parts = _drawn(drawing, 20.0, 0.0) + _drawn(drawing, 0.0, 10.0)
    assert _same(both, parts), off(both, parts)
    assert not _same(both, 1.1 * parts), "an error of a tenth is seen"


def test_lamps_without_power_leave_the_night_black(drawing):
    assert _drawn(drawing, 0.0, 0.0).max() < 1e-6 * _drawn(drawing, 20.0, 0.0).max()
