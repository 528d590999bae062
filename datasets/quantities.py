"""What a specification gives: one value, a list of values, or a range to draw from."""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass

import numpy as np

from ..uw_spectral.errors import InputError

Value = float | str
LARGEST_SEED = 2**31 - 1
"""That Cycles takes."""
_DIGITS = 12
_RANGE = {"from", "to", "steps", "log"}


@dataclass(frozen=True)
class Quantity:
    """Values that are all taken, or a range from which every pose draws one.

    ``values`` are taken in turn, each with everything else; one if it is drawn. ``drawn`` are the
    bounds of the range, ``log`` is whether it is drawn evenly in its logarithm.
    """

    values: tuple[Value, ...]
    drawn: tuple[float, float] | None = None
    log: bool = False

    def resolved(self, value: Value, *key: object) -> Value:
        """Return the value, or what the key draws from the range; the same for the same key."""
        if self.drawn is None:
            return value
        low, high = self.drawn
        fraction = float(generator(*key).random())
        if self.log:
            found = math.exp(math.log(low) + fraction * (math.log(high) - math.log(low)))
        else:
            found = low + fraction * (high - low)
        # Where logarithms differ in their last digit, views are still named alike.
        return float(f"{found:.{_DIGITS}g}")


def generator(*key: object) -> np.random.Generator:
    """Return a generator of random numbers that depends on the content of a key alone."""
    digest = hashlib.sha256(repr(key).encode()).digest()
    return np.random.Generator(np.random.PCG64(int.from_bytes(digest[:16], "big")))


def read_quantity(where: str, given: object, *, text: bool = False) -> Quantity:
    """Read a quantity of a specification, whose place ``where`` messages name.

    ``given`` is a number, text, a list of them, or a table: ``{from = 1, to = 5}`` is drawn,
    ``{from = 1, to = 5, steps = 3}`` are three values; ``log = true`` spaces or draws them evenly
    in the logarithm. Text has no range. Raises InputError if it is empty, of another kind, or a
    range whose end is not above its beginning.

    Examples
    --------
    >>> read_quantity("sun.zenith", {"from": 0, "to": 60, "steps": 3}).values
    (0.0, 30.0, 60.0)
    """
    if isinstance(given, dict) and not text:
        return _range(where, given)
    values = given if isinstance(given, list) else [given]
    if not values:
        raise InputError(f"{where}: the list is empty; give one value at least, or leave it out")
    found = tuple(_text(where, v) if text else number(where, v) for v in values)
    if len(set(found)) < len(found):
        raise InputError(f"{where}: {given} holds a value twice; its views would be the same")
    return Quantity(found)


def number(where: str, given: object) -> float:
    """Return a finite number; raise InputError where it is none."""
    if isinstance(given, bool) or not isinstance(given, int | float) or not math.isfinite(given):
        raise InputError(f"{where}: {given!r} is not a finite number")
    return float(given)


def _text(where: str, given: object) -> str:
    if not isinstance(given, str) or not given.strip():
        raise InputError(f"{where}: {given!r} is no text; write it in quotes")
    return given


def _range(where: str, given: dict[str, object]) -> Quantity:
    strange = set(given) - _RANGE
    if strange or not {"from", "to"} <= set(given):
        raise InputError(
            f"{where}: a range is {{from = 1, to = 5}}, with steps or log if wanted, not {given}"
        )
    low, high = number(f"{where}.from", given["from"]), number(f"{where}.to", given["to"])
    log = given.get("log", False)
    if not isinstance(log, bool):
        raise InputError(f"{where}.log: {log!r} is neither true nor false")
    if not low < high:
        raise InputError(
            f"{where}: the range from {low:g} to {high:g} is empty; let it end above its "
            "beginning, or give a single number"
        )
    if log and low <= 0:
        raise InputError(f"{where}: a logarithmic range starts above 0, not at {low:g}")
    if "steps" not in given:
        return Quantity((low,), (low, high), log)
    steps = given["steps"]
    if isinstance(steps, bool) or not isinstance(steps, int) or steps < 2:
        raise InputError(f"{where}.steps: {steps!r} is not a whole number of 2 or more")
    space = np.geomspace if log else np.linspace
    return Quantity(tuple(space(low, high, steps).tolist()))
