"""Shader groups whose sockets say what they are: for people who use them by hand."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import bpy

from .node_mathematics import Graph, NodeValue, new_group


@dataclass(frozen=True)
class Socket:
    """An input or output: its type, words with the unit, its value and its bounds."""

    kind: str
    text: str
    value: float | tuple[float, ...] | None = None
    least: float | None = None
    most: float | None = None


class OpenGroup:
    """A group under construction: its graph and the terms of its inputs; ``text`` says what for."""

    def __init__(
        self,
        name: str,
        inputs: Mapping[str, Socket],
        outputs: Mapping[str, Socket],
        text: str,
        part_size: int | None = None,
    ) -> None:
        self.tree = new_group(name)
        self.tree.description = text
        for direction, sockets in (("INPUT", inputs), ("OUTPUT", outputs)):
            for socket_name, about in sockets.items():
                socket = self.tree.interface.new_socket(
                    socket_name, in_out=direction, socket_type=f"NodeSocket{about.kind}"
                )
                socket.description = about.text
                if about.value is not None:
                    socket.default_value = about.value
                for bound, value in (("min_value", about.least), ("max_value", about.most)):
                    if value is not None and hasattr(socket, bound):
                        setattr(socket, bound, value)
        self.graph = Graph(self.tree, part_size, slim=part_size is not None)
        found = self.graph.node("NodeGroupInput").outputs
        self.given = {s.name: self.graph.term(s) for s in found if s.name}

    def finished(self, results: Mapping[str, NodeValue]) -> bpy.types.ShaderNodeTree:
        """Link the results, and spread the nodes."""
        end = self.graph.node("NodeGroupOutput")
        for name, value in results.items():
            self.graph.assign(value, end.inputs[name])
        return self.tree
