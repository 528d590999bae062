"""Frozen dataclasses of numbers, whose fields are outputs of the group of all values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

import bpy
import numpy as np

from ..uw_spectral.mathematics import Operand
from .node_mathematics import Graph


@dataclass(frozen=True)
class ValueFields[T]:
    """How the numbers of the dataclass ``kind`` are named; ``sizes`` are of fields with several."""

    kind: type[T]
    prefix: str
    sizes: Mapping[str, int]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all numbers, in the order of the fields."""
        return tuple(name for field in self._fields() for name in self._names_of(field))

    def numbers(self, values: T) -> dict[str, float]:
        """Return the numbers by their names."""
        found = [x for field in self._fields() for x in np.ravel(getattr(values, field)).tolist()]
        return dict(zip(self.names, found, strict=True))

    def read(self, graph: Graph, values: bpy.types.NodeOutputs) -> T:
        """Return the dataclass with node values in its fields."""
        parts: dict[str, Any] = {}
        for field in self._fields():
            terms: list[Operand] = [graph.term(values[name]) for name in self._names_of(field)]
            parts[field] = terms if field in self.sizes else terms[0]
        return self.kind(**parts)

    def _fields(self) -> list[str]:
        return [field.name for field in fields(self.kind)]  # pyright: ignore[reportArgumentType]

    def _names_of(self, field: str) -> list[str]:
        name = f"{self.prefix} {field}"
        if field not in self.sizes:
            return [name]
        return [f"{name} {i}" for i in range(self.sizes[field])]
