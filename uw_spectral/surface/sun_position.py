"""Where the sun stands at a time and place."""

from __future__ import annotations

import math
from datetime import UTC, datetime


def sun_zenith_Spencer1971(time: datetime, latitude: float, longitude: float) -> float:
    """Zenith angle of the sun's centre, degrees; above 90 it is below the horizon.

    Refraction by the air, 0.5° at the horizon, is left out.

    Latitude and longitude in degrees, positive north and east; the time has a zone.

    J. W. Spencer, Search 2, 172 (1971): declination within 0.04°, equation of time within half
    a minute.
    """
    time = time.astimezone(UTC)
    hour = time.hour + time.minute / 60 + time.second / 3600
    year = 2 * math.pi / 365 * (time.timetuple().tm_yday - 1 + (hour - 12) / 24)
    declination = (
        0.006918
        - 0.399912 * math.cos(year)
        + 0.070257 * math.sin(year)
        - 0.006758 * math.cos(2 * year)
        + 0.000907 * math.sin(2 * year)
        - 0.002697 * math.cos(3 * year)
        + 0.00148 * math.sin(3 * year)
    )
    minutes = 229.18 * (
        0.000075
        + 0.001868 * math.cos(year)
        - 0.032077 * math.sin(year)
        - 0.014615 * math.cos(2 * year)
        - 0.040849 * math.sin(2 * year)
    )
    turn = math.radians(15 * (hour - 12) + longitude + minutes / 4)
    north = math.radians(latitude)
    cosine = math.sin(north) * math.sin(declination)
    cosine += math.cos(north) * math.cos(declination) * math.cos(turn)
    return math.degrees(math.acos(max(-1.0, min(cosine, 1.0))))
