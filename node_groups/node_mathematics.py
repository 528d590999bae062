"""Formulas of the optics as shader nodes.

A :class:`Term` stands for the output of a node. Arithmetic on terms adds nodes
to the tree, so a formula written for numpy arrays builds its own nodes;
:data:`NODES` supplies the functions. Equal expressions become one node.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import bpy
import numpy as np

from ..uw_spectral.math_backend import NUMPY, Mathematics

MARK = "uw_node"
"""Custom property of every node and group that is made here."""

_COLUMNS = 40


@dataclass(eq=False)
class Graph:
    """The node tree under construction, and the nodes it has so far.

    Parameters
    ----------
    tree : ShaderNodeTree
        Gets the nodes.
    """

    tree: bpy.types.ShaderNodeTree
    _made: dict[tuple[Any, ...], Term] = field(default_factory=dict)

    def node(self, kind: str, **properties: Any) -> bpy.types.Node:  # noqa: ANN401
        """Add a node of a type and set its properties."""
        active = self.tree.nodes.active
        node = self.tree.nodes.new(kind)
        for name, value in properties.items():
            setattr(node, name, value)
        node[MARK] = True
        node.select = False
        node.hide = True
        self.tree.nodes.active = active
        made = len(self._made)
        node.location = (180.0 * (made % _COLUMNS), -60.0 * (made // _COLUMNS))
        return node

    def term(self, socket: bpy.types.NodeSocket) -> Term:
        """Return the term of an output socket."""
        return Term(self, socket, 1 if socket.type in {"VALUE", "INT", "BOOLEAN"} else 3)

    def put(self, value: Term | float, socket: bpy.types.NodeSocket) -> None:
        """Bring a value to an input socket, as a link or as a constant."""
        if isinstance(value, Term):
            self.tree.links.new(value.socket, socket)
        elif socket.type == "VALUE":
            socket.default_value = float(value)
        else:
            size = len(socket.default_value)
            socket.default_value = [float(value)] * 3 + [1.0] * (size - 3)

    def operation(self, name: str, operands: Sequence[Term | float]) -> Term:
        """Return the term of one mathematical node."""
        key = (name, *(o.socket if isinstance(o, Term) else float(o) for o in operands))
        if key not in self._made:
            sizes = [o.size for o in operands if isinstance(o, Term)]
            node = self.node(
                "ShaderNodeMath" if max(sizes) == 1 else "ShaderNodeVectorMath", operation=name
            )
            for operand, socket in zip(operands, node.inputs, strict=False):
                self.put(operand, socket)
            output = node.outputs["Value"] if name in _TO_NUMBER else node.outputs[0]
            self._made[key] = self.term(output)
        return self._made[key]

    def vector(self, x: Term | float, y: Term | float, z: Term | float) -> Term:
        """Join three numbers."""
        node = self.node("ShaderNodeCombineXYZ")
        for value, socket in zip((x, y, z), node.inputs, strict=True):
            self.put(value, socket)
        return self.term(node.outputs[0])

    def components(self, vector: Term) -> tuple[Term, Term, Term]:
        """Split a vector."""
        key = ("components", vector.socket)
        if key not in self._made:
            node = self.node("ShaderNodeSeparateXYZ")
            self.put(vector, node.inputs[0])
            self._made[key] = tuple(self.term(output) for output in node.outputs)
        return self._made[key]


def new_group(name: str) -> bpy.types.ShaderNodeTree:
    """Add an empty node group that is marked as made here."""
    tree = bpy.data.node_groups.new(name, "ShaderNodeTree")
    tree[MARK] = True
    return tree


_TO_NUMBER = {"DOT_PRODUCT"}


@dataclass(frozen=True, eq=False)
class Term:
    """A number (size 1) or three bands at once (size 3) in a node tree."""

    graph: Graph
    socket: bpy.types.NodeSocket
    size: int

    # Keeps numpy numbers from taking a term for an array.
    __array_ufunc__ = None

    def __add__(self, other: Any) -> Any:  # noqa: ANN401
        return self if _is(other, 0.0) else self.graph.operation("ADD", (self, other))

    def __radd__(self, other: Any) -> Any:  # noqa: ANN401
        return self + other

    def __sub__(self, other: Any) -> Any:  # noqa: ANN401
        return self if _is(other, 0.0) else self.graph.operation("SUBTRACT", (self, other))

    def __rsub__(self, other: Any) -> Any:  # noqa: ANN401
        return self.graph.operation("SUBTRACT", (other, self))

    def __mul__(self, other: Any) -> Any:  # noqa: ANN401
        if _is(other, 0.0):
            return 0.0
        return self if _is(other, 1.0) else self.graph.operation("MULTIPLY", (self, other))

    def __rmul__(self, other: Any) -> Any:  # noqa: ANN401
        return self * other

    def __truediv__(self, other: Any) -> Any:  # noqa: ANN401
        return self if _is(other, 1.0) else self.graph.operation("DIVIDE", (self, other))

    def __rtruediv__(self, other: Any) -> Any:  # noqa: ANN401
        return 0.0 if _is(other, 0.0) else self.graph.operation("DIVIDE", (other, self))

    def __neg__(self) -> Any:  # noqa: ANN401
        return self * -1.0

    def dot(self, other: Term) -> Term:
        """Sum of the products of the three bands."""
        return self.graph.operation("DOT_PRODUCT", (self, other))


def _is(value: object, number: float) -> bool:
    return not isinstance(value, Term) and value == number


def _function(name: str, on_numbers: Any) -> Any:  # noqa: ANN401
    """Return a function of terms or plain numbers."""

    def call(*operands: Any) -> Any:  # noqa: ANN401
        graph = next((o.graph for o in operands if isinstance(o, Term)), None)
        return on_numbers(*operands) if graph is None else graph.operation(name, operands)

    return call


_power = _function("POWER", NUMPY.power)
_maximum = _function("MAXIMUM", NUMPY.maximum)


def _exp(x: Any) -> Any:  # noqa: ANN401
    return _power(math.e, x)


def _sqrt(x: Any) -> Any:  # noqa: ANN401
    return _power(x, 0.5)


def _log(x: Any) -> Any:  # noqa: ANN401
    # The mathematics of vectors has no logarithm; no formula takes one of bands.
    return x.graph.operation("LOGARITHM", (x, math.e)) if isinstance(x, Term) else NUMPY.log(x)


def _less(x: Any, y: Any) -> Any:  # noqa: ANN401
    terms = [o for o in (x, y) if isinstance(o, Term)]
    if terms and max(t.size for t in terms) == 3:
        return _maximum(terms[0].graph.operation("SIGN", (y - x,)), 0.0)
    return _less_numbers(x, y)


_less_numbers = _function("LESS_THAN", NUMPY.less)


def _interpolate(x: Any, xs: Sequence[float], ys: Sequence[float]) -> Any:  # noqa: ANN401
    """Sum of ramps: exact, where a curve node would be sampled."""
    slopes = np.diff(ys) / np.diff(xs)
    x = NODES.clamp(x, float(xs[0]), float(xs[-1]))
    total = float(ys[0]) + float(slopes[0]) * (x - float(xs[0]))
    for start, bend in zip(xs[1:-1], np.diff(slopes), strict=True):
        total = total + float(bend) * _maximum(x - float(start), 0.0)
    return total


NODES = Mathematics(
    exp=_exp,
    log=_log,
    sqrt=_sqrt,
    absolute=_function("ABSOLUTE", NUMPY.absolute),
    power=_power,
    minimum=_function("MINIMUM", NUMPY.minimum),
    maximum=_maximum,
    less=_less,
    interpolate=_interpolate,
)
"""The elementary functions over terms; plain numbers are computed at once."""
