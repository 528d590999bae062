"""What was asked for in this frame or in the last one."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import Generic, TypeVar

Key = TypeVar("Key", bound=Hashable)
Value = TypeVar("Value")


class LastUsed(Generic[Key, Value]):
    """Values by key; those that a frame does not ask for are forgotten after the next.

    Examples
    --------
    >>> known = LastUsed[str, int]()
    >>> known.get("a", lambda: 1), known.get("a", lambda: 2)
    (1, 1)
    >>> for _ in range(2):
    ...     known.next_frame()
    >>> known.get("a", lambda: 3)
    3
    """

    def __init__(self) -> None:
        self._before: dict[Key, Value] = {}
        self._now: dict[Key, Value] = {}

    def __len__(self) -> int:
        return len(self._before) + len(self._now)

    def __bool__(self) -> bool:
        return True

    def next_frame(self) -> None:
        """Forget what was not asked for since the last time."""
        self._before, self._now = self._now, {}

    def last(self, key: Key) -> Value | None:
        """Return what is known, if anything is."""
        return self._now.get(key, self._before.get(key))

    def put(self, key: Key, value: Value) -> Value:
        """Keep a value; return it."""
        self._now[key] = value
        return value

    def get(self, key: Key, make: Callable[[], Value]) -> Value:
        """Return what is known, else what is made now."""
        found = self.last(key)
        return self.put(key, make() if found is None else found)
