"""Node groups under construction: what goes in, a graph, what comes out."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import bpy

from ..uw_spectral.mathematics import Operand
from .node_mathematics import Graph, NodeValue, new_group

FLOAT, VECTOR = "NodeSocketFloat", "NodeSocketVector"
COLOUR, SHADER = "NodeSocketColor", "NodeSocketShader"
INTEGER, SWITCH, GEOMETRY = "NodeSocketInt", "NodeSocketBool", "NodeSocketGeometry"
_NONE = MappingProxyType({})


@dataclass(frozen=True)
class Socket:
    """An input or output: its type, words with the unit, its value and its bounds."""

    kind: str
    text: str = ""
    value: float | tuple[float, ...] | None = None
    least: float | None = None
    most: float | None = None


class OpenGroup:
    """A group of a kind under construction: its graph, with some options, and what comes in.

    Sockets are told by their type, or by more that people need who use a group by hand.
    """

    def __init__(
        self,
        name: str,
        inputs: Mapping[str, Socket | str] = _NONE,
        outputs: Mapping[str, Socket | str] = _NONE,
        text: str = "",
        kind: str = "ShaderNodeTree",
        **options: Any,  # noqa: ANN401
    ) -> None:
        self.tree = new_group(name, kind)
        self.tree.description = text
        for socket, about in inputs.items():
            self._add("INPUT", socket, about)
        for socket, about in outputs.items():
            self._add("OUTPUT", socket, about)
        self._named = set(outputs)
        self.graph = Graph(self.tree, **options)

    @functools.cached_property
    def given(self) -> dict[str, NodeValue]:
        """Terms of the inputs."""
        found = self.graph.node("NodeGroupInput").outputs
        return {socket.name: self.graph.term(socket) for socket in found if socket.name}

    def _add(self, direction: str, name: str, about: Socket | str) -> None:
        about = Socket(about) if isinstance(about, str) else about
        socket = self.tree.interface.new_socket(name, in_out=direction, socket_type=about.kind)
        socket.description = about.text
        if about.value is not None:
            socket.default_value = about.value
        for bound, value in (("min_value", about.least), ("max_value", about.most)):
            if value is not None and hasattr(socket, bound):
                setattr(socket, bound, value)

    def finished(self, results: Mapping[str, Operand]) -> bpy.types.ShaderNodeTree:
        """Bring the results out; an output that was not named is a number or a vector."""
        for name in [name for name in results if name not in self._named]:
            self._add("OUTPUT", name, FLOAT if getattr(results[name], "size", 1) == 1 else VECTOR)
        self.graph.node("NodeGroupOutput", results)
        return self.tree
