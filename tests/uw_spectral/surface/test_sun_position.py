"""Where the sun stands, against published positions."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta, timezone

import pytest
from underwater_spectral.uw_spectral.surface.sun_position import sun_zenith_Spencer1971


@pytest.mark.parametrize(
    ("time", "latitude", "longitude", "zenith"),
    [
        # The example of I. Reda & A. Andreas, NREL/TP-560-34302: 50.11°.
        (
            datetime(2003, 10, 17, 12, 30, 30, tzinfo=timezone(timedelta(hours=-7))),
            39.742476, -105.1786, 50.11,
        ),
        # Equinox of 20 March 2020, 3:50 UTC: overhead where the equator has noon.
        (datetime(2020, 3, 20, 12, 7, 30, tzinfo=UTC), 0.0, 0.0, 0.1),
        # December solstice at the Arctic circle: on the horizon at noon.
        (datetime(2021, 12, 21, 11, 58, tzinfo=UTC), 66.56, 0.0, 90.0),
        (datetime(2021, 12, 21, 23, 58, tzinfo=UTC), -66.56, 0.0, 90.0),
    ],
)  # fmt: skip
def test_published_positions(time, latitude, longitude, zenith):
    assert sun_zenith_Spencer1971(time, latitude, longitude) == pytest.approx(zenith, abs=0.25)
