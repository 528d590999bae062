"""Tables of a TOML file, read key by key; what is left over is named."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path

from ..uw_spectral.errors import InputError, unknown_name
from .quantities import Quantity, number, read_quantity


class SpecTable:
    """A table of a specification and its place in the file, for messages.

    Raises InputError if it is no table.
    """

    def __init__(self, content: object, where: str) -> None:
        if not isinstance(content, dict):
            raise InputError(f"{where} is {content!r}; it should be a table")
        self._content, self.where, self._known = content, where, list[str]()

    def __contains__(self, key: str) -> bool:
        self._known.append(key)
        return key in self._content

    def place(self, key: str) -> str:
        """Return the place of a key."""
        return f"{self.where}.{key}" if self.where else key

    def get(self, key: str, default: object = None) -> object:
        """Return what is there, as it is."""
        self._known.append(key)
        return self._content.get(key, default)

    def keys(self) -> tuple[str, ...]:
        """Return all keys."""
        return tuple(self._content)

    def switch(self, key: str, default: bool) -> bool:
        """Return true or false."""
        found = self.get(key, default)
        if not isinstance(found, bool):
            raise self.needed(key, "true or false", found)
        return found

    def text(self, key: str, default: str | None = None) -> str:
        """Return text; needed if there is no default."""
        found = self.get(key, default)
        if not isinstance(found, str) or (not found.strip() and default != ""):
            raise self.needed(key, "text in quotes", found)
        return found

    def choice(self, key: str, known: Collection[str], default: str | None = None) -> str:
        """Return a word that is known; needed if there is no default."""
        found = self.text(key, default)
        if found not in known:
            raise unknown_name(self.place(key), found, known)
        return found

    def number(self, key: str, default: float | None = None) -> float:
        """Return a finite number; needed if there is no default."""
        found = self.get(key, default)
        if found is None:
            raise self.needed(key, "a number", found)
        return number(self.place(key), found)

    def whole(self, key: str, default: int | None = None, least: int = 0) -> int:
        """Return a whole number; needed if there is no default."""
        found = self.get(key, default)
        if isinstance(found, bool) or not isinstance(found, int) or found < least:
            raise self.needed(key, f"a whole number, {least} or more", found)
        return found

    def numbers(
        self, key: str, count: int, default: tuple[float, ...] | None = None
    ) -> tuple[float, ...]:
        """Return so many finite numbers; needed if there is no default."""
        found = self.get(key, default)
        if not isinstance(found, list | tuple) or len(found) != count:
            raise self.needed(key, f"a list of {count} numbers", found)
        return tuple(number(self.place(key), value) for value in found)

    def texts(self, key: str, default: tuple[str, ...]) -> tuple[str, ...]:
        """Return a list of texts."""
        found = self.get(key, list(default))
        if not isinstance(found, list) or not all(isinstance(text, str) for text in found):
            raise self.needed(key, "a list of texts", found)
        return tuple(map(str, found))

    def quantity(
        self, key: str, default: object = None, *, text: bool = False, known: Collection[str] = ()
    ) -> Quantity:
        """Return a quantity, of words if some are ``known``; needed if there is no default."""
        found = self.get(key, default)
        if found is None:
            raise self.needed(key, "a value, a list or a range", found)
        quantity = read_quantity(self.place(key), found, text=text or bool(known))
        for value in quantity.values if known else ():
            if value not in known:
                raise unknown_name(self.place(key), str(value), known)
        return quantity

    def table(self, key: str) -> SpecTable:
        """Return the table of a key, empty if it is not there."""
        return SpecTable(self.get(key, {}), self.place(key))

    def tables(self, key: str) -> list[SpecTable]:
        """Return the tables of ``[[key]]``."""
        found = self.get(key, [])
        if not isinstance(found, list):
            raise self.needed(key, f"a list of tables, [[{self.place(key)}]]", found)
        return [SpecTable(item, f"{self.place(key)}[{i}]") for i, item in enumerate(found)]

    def close(self) -> None:
        """Refuse keys that nobody asked for."""
        for key in self._content:
            if key not in self._known:
                known = dict.fromkeys(self._known)
                raise unknown_name(f"key of {self.where or 'the file'}", key, known)

    def needed(self, key: str, what: str, found: object) -> InputError:
        """Return the error for a key that is missing or of another kind."""
        if found is None:
            return InputError(f"{self.place(key)} is missing; give {what}")
        return InputError(f"{self.place(key)}: {found!r} should be {what}")


def in_folder(text: str, folder: Path) -> str:
    """Return what names a file with its path from the folder of the specification."""
    scheme, _, rest = text.partition(":")
    return f"file:{folder / rest}" if scheme == "file" and rest else text
