"""The one error type for input that cannot be used."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class InputError(ValueError):
    """Input that cannot be used; the message names what, where and what to do."""


class DataWarning(UserWarning):
    """A caveat of the data that the user should know about."""


def printable(text: str, most: int = 200) -> str:
    """Return text from outside as a message may hold it: not long, no control characters.

    Examples
    --------
    >>> printable("a" + chr(9) + "b")
    'a b'
    """
    return "".join(c if c.isprintable() else " " for c in text[:most])


def first_of(names: Iterable[str], most: int = 3, between: str = ", ") -> str:
    """Return the first of some names, and how many more there are.

    Examples
    --------
    >>> first_of(["a", "b", "c", "d", "e"])
    'a, b, c and 2 more'
    """
    found = list(names)
    more = f" and {len(found) - most} more" if len(found) > most else ""
    return f"{between.join(found[:most])}{more}"


def unknown_name(kind: str, name: str, known: Iterable[str]) -> InputError:
    """Return the error for a name that is not in a catalogue."""
    names = list(known)
    lowered = {n.lower(): n for n in names}
    near = [lowered[m] for m in difflib.get_close_matches(name.lower(), lowered, n=3, cutoff=0.4)]
    near += [n for n in names if name and name.lower() in n.lower() and n not in near][:3]
    hint = f" Near names: {', '.join(near)}." if near else ""
    listed = names if len(names) <= 12 else [*names[:12], "…"]
    return InputError(f"unknown {kind} {name!r}.{hint} Known: {', '.join(listed)}")
