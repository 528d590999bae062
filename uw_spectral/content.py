"""Values that compare by what they hold, arrays included."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Hashable

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray


@dataclasses.dataclass(frozen=True, eq=False)
class ComparedByContent:
    """Base of frozen dataclasses that are equal, and hash alike, if all their fields do.

    Arrays count by shape and bytes, so such a value can be a key: what was
    computed from it is known again for an equal one. Declare the dataclass
    with ``eq=False``, and hold arrays that nobody changes (:func:`constant`).

    Examples
    --------
    >>> @dataclasses.dataclass(frozen=True, eq=False)
    ... class Samples(ComparedByContent):
    ...     values: NDArray[np.float64]
    >>> Samples(np.arange(3.0)) == Samples(np.arange(3.0))
    True
    >>> len({Samples(np.ones(2)), Samples(np.ones(2)), Samples(np.zeros(2))})
    2
    """

    @functools.cached_property
    def _content(self) -> tuple[Hashable, ...]:
        return tuple(
            _hashable(getattr(self, field.name))
            for field in dataclasses.fields(self)
            if field.compare
        )

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, ComparedByContent) or type(self) is not type(other):
            return NotImplemented
        return self is other or self._content == other._content

    def __hash__(self) -> int:
        return hash((type(self), self._content))


def constant(values: ArrayLike, dtype: DTypeLike = np.float64) -> NDArray[np.float64]:
    """Return values as an array that cannot be written to; the caller's own still can."""
    array = np.asarray(values, dtype=dtype).view()
    array.setflags(write=False)
    return array


def _hashable(value: object) -> Hashable:
    # Bytes keep their hash, so that it is computed once.
    if isinstance(value, np.ndarray):
        return value.shape, value.dtype.str, value.tobytes()
    return value
