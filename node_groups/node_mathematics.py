"""Formulas of the optics as shader nodes.

A :class:`NodeValue` stands for the output of a node. Arithmetic on terms adds nodes to the tree, so
a formula written for numpy arrays builds its own nodes; :data:`NODES` supplies the functions. Equal
expressions become one node, and a product to which something is added becomes one with the sum:
what a shader costs to compile grows faster than the number of its nodes.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType

import bpy
import numpy as np

from ..uw_spectral.mathematics import NUMPY, Mathematics, Operand

MARK = "uw_node"
"""Custom property of every node and data-block of the water."""

PART_SIZE = 64
"""Nodes of a part of a graph: fastest to build within a factor of two."""
_COLUMNS = 40
_NONE = MappingProxyType({})


@dataclass(eq=False)
class Graph:
    """The node tree under construction, and the nodes it has so far."""

    tree: bpy.types.ShaderNodeTree
    #: Puts the mathematics into groups of so many nodes: Blender updates the whole of a tree with
    #: each node and link it gets, so the time to build one grows as the square of its size.
    part_size: int | None = None
    #: Keeps the constants few, with parts: a shader holds 64 KB of them, among which each open
    #: input counts, those that an operation does not have included, and each use of a value that
    #: never varies.
    slim: bool = False
    #: The group of :mod:`.realtime_refraction`, where view rays may be bent at the surface.
    rays: bpy.types.ShaderNodeTree | None = None
    slim_numbers: bool = False  #: That holds for operations on single numbers too.
    _made: dict[tuple[Operand, ...], Operand] = field(default_factory=dict)
    _products: dict[tuple[Operand, ...], NodeValue] = field(default_factory=dict)
    _groups: dict[tuple[object, ...], bpy.types.ShaderNodeTree] = field(default_factory=dict)
    _parts: list[_Part] = field(default_factory=list)
    _open: bool = False
    _zone: tuple[int, ...] = ()

    def node(
        self,
        kind: str,
        inputs: Mapping[str, Operand] | Mapping[int, Operand] = _NONE,
        **properties: Operand,
    ) -> bpy.types.Node:
        """Add a node of a type to the tree, and set its properties and its inputs."""
        node = _new_node(self.tree, kind, len(self._made), properties)
        for name, value in inputs.items():
            self.assign(value, node.inputs[name])
        return node

    def shared(self, group: bpy.types.ShaderNodeTree) -> bpy.types.NodeOutputs:
        """Return the outputs of the one node of a group without inputs."""
        key = ("shared", group)
        if key not in self._made:
            self._made[key] = self.node("ShaderNodeGroup", node_tree=group)
        return self._made[key].outputs

    def kept(
        self, key: tuple[object, ...], make: Callable[[], bpy.types.ShaderNodeTree]
    ) -> bpy.types.ShaderNodeTree:
        """Return a group that is made once for the tree."""
        if key not in self._groups:
            self._groups[key] = make()
        return self._groups[key]

    def term(self, socket: bpy.types.NodeSocket) -> NodeValue:
        """Return the term of an output socket."""
        return NodeValue(self, socket, 1 if socket.type in {"VALUE", "INT", "BOOLEAN"} else 3)

    def assign(self, value: Operand, socket: bpy.types.NodeSocket) -> None:
        """Bring a value, or what comes out of a socket, to an input: as a link or as a constant.

        All parts of a vector or colour get a number.
        """
        tree = socket.id_data
        if isinstance(value, NodeValue):
            tree.links.new(self._brought(value, tree), socket)
        elif isinstance(value, bpy.types.NodeSocket):
            tree.links.new(value, socket)
        elif socket.type in {"RGBA", "VECTOR"} and np.ndim(value) == 0:
            size = len(socket.default_value)
            socket.default_value = [float(value)] * 3 + [1.0] * (size - 3)
        else:
            socket.default_value = float(value) if socket.type == "VALUE" else value

    def mixed(
        self,
        fraction: NodeValue | float | bpy.types.NodeSocket,
        one: bpy.types.NodeSocket,
        other: bpy.types.NodeSocket,
    ) -> bpy.types.NodeSocket:
        """Mix two shaders."""
        return self.node("ShaderNodeMixShader", {0: fraction, 1: one, 2: other}).outputs[0]

    def added(self, one: bpy.types.NodeSocket, other: bpy.types.NodeSocket) -> bpy.types.NodeSocket:
        """Add two shaders."""
        return self.node("ShaderNodeAddShader", {0: one, 1: other}).outputs[0]

    def operation(self, name: str, operands: Sequence[NodeValue | float]) -> NodeValue:
        """Return the term of one mathematical node; that of a product is made when it is used."""
        if name == "MULTIPLY":
            key = _key(name, operands)
            if key not in self._products:
                self._products[key] = NodeValue(self, None, _size(operands), tuple(operands))
            return self._products[key]
        fused = self._with_product(name, operands)
        if fused is not None:
            name, operands = "MULTIPLY_ADD", fused
        return self._operation(name, operands)

    def product(self, factors: Sequence[NodeValue | float]) -> bpy.types.NodeSocket:
        """Return what a product comes out of."""
        return self._operation("MULTIPLY", factors).socket

    def _with_product(
        self, name: str, operands: Sequence[NodeValue | float]
    ) -> Sequence[NodeValue | float] | None:
        """Return what multiplies and adds in one node, if an operand is a product not yet made."""
        if name not in {"ADD", "SUBTRACT"}:
            return None
        (x, y), (of_x, of_y) = operands, map(self._factors, operands)
        if of_x and (name == "ADD" or not isinstance(y, NodeValue)):
            return (*of_x, y if name == "ADD" else -y)
        if not of_y:
            return None
        one, other = of_y
        if name == "ADD":
            return one, other, x
        return None if isinstance(other, NodeValue) else (one, -other, x)

    def _factors(self, x: NodeValue | float) -> tuple[NodeValue | float, ...]:
        """Return those of a product not yet made."""
        if not isinstance(x, NodeValue) or _key("MULTIPLY", x.factors) in self._made:
            return ()
        return x.factors

    def _operation(self, name: str, operands: Sequence[NodeValue | float]) -> NodeValue:
        key = _key(name, operands)
        if key not in self._made:
            node, sockets, operands = self._made_for(name, operands)
            for operand, socket in zip(operands, sockets, strict=True):
                self.assign(operand, socket)
            output = node.outputs["Value"] if name in _TO_NUMBER else node.outputs[0]
            self._made[key] = self.term(output)
        return self._made[key]

    def _made_for(
        self, name: str, operands: Sequence[NodeValue | float]
    ) -> tuple[bpy.types.Node, list[bpy.types.NodeSocket], Sequence[NodeValue | float]]:
        """Return a node for an operation, its inputs and what they get.

        A slim one takes little room: of its inputs none is a constant, and those of one number are
        all given. Multiply Add has no vector without effect, as Add and Multiply have.
        """
        numbers = _size(operands) == 1
        slim = self.slim_numbers if numbers else self.slim
        if slim and name in _FUSED:
            name, operands = "MULTIPLY_ADD", _FUSED[name](*operands)
        if slim and not numbers and name == "DIVIDE":
            node = self.inner_node("ShaderNodeMixRGB", blend_type=name)
            node.inputs[0].default_value = 1.0
            sockets = list(node.inputs)[1:]
        else:
            kind = "ShaderNodeMath" if numbers else "ShaderNodeVectorMath"
            node = self.inner_node(kind, operation=name)
            sockets = list(node.inputs)[: len(operands)]
        if slim:
            number = self._parts[-1].number  # of the part that is being filled
            operands = [
                v if isinstance(v, NodeValue) else self.term(number(float(v))) for v in operands
            ]
        return node, sockets, operands

    def vector(self, x: NodeValue | float, y: NodeValue | float, z: NodeValue | float) -> NodeValue:
        """Join three numbers."""
        parts = x, y, z
        key = _key("vector", parts)
        if key not in self._made:
            node = self.inner_node("ShaderNodeCombineXYZ")
            for value, socket in zip(parts, node.inputs, strict=True):
                self.assign(value, socket)
            self._made[key] = self.term(node.outputs[0])
        return self._made[key]

    def components(self, vector: NodeValue) -> tuple[NodeValue, NodeValue, NodeValue]:
        """Split a vector."""
        key = ("components", vector.socket)
        if key not in self._made:
            node = self.inner_node("ShaderNodeSeparateXYZ")
            self.assign(vector, node.inputs[0])
            self._made[key] = tuple(self.term(output) for output in node.outputs)
        return self._made[key]

    def inner_node(self, kind: str, **properties: Operand) -> bpy.types.Node:
        """Add a node to the part that is being filled, or to the tree if there are no parts.

        What it gets must have been made before it: links have no circles.
        """
        if self.part_size is None:
            return self.node(kind, **properties)
        if not self._open or self._parts[-1].nodes >= self.part_size:
            self._open = True
            group = new_group(f".{self.tree.name} {len(self._parts) + 1}")
            node = self.node("ShaderNodeGroup", node_tree=group)
            self._parts.append(_Part(group, node, self._zone))
        part = self._parts[-1]
        part.nodes += 1
        return _new_node(part.tree, kind, part.nodes, properties)

    def _brought(self, term: NodeValue, tree: bpy.types.ShaderNodeTree) -> bpy.types.NodeSocket:
        """Return the socket of a term in a tree, led through the sockets of the parts."""
        home = term.socket.id_data
        if home == tree:
            return term.socket
        key = ("brought", term.socket, tree)
        if key not in self._made:
            socket = term.socket
            if home != self.tree:
                part = self._part_of(home)
                if self._zone[: len(part.zone)] != part.zone:
                    raise RuntimeError("what a repeat zone made is used outside it")
                socket = part.export(socket)
                if tree == self.tree and part is self._parts[-1]:
                    # What reads the node outside may not lie in this part: links have no circles.
                    self._open = False
            if tree != self.tree:
                part = self._part_of(tree)
                entry, inside = part.entry(socket)
                self.tree.links.new(socket, entry)
                socket = inside
            self._made[key] = socket
        return self._made[key]

    @contextlib.contextmanager
    def apart(self) -> Iterator[None]:
        """What is made in the block shares no parts with what is made outside it, nor nodes."""
        made = dict(self._made)
        self._zone, self._open = (*self._zone, len(self._parts)), False
        yield
        self._zone, self._open = self._zone[:-1], False
        self._made = made

    def _part_of(self, tree: bpy.types.ShaderNodeTree) -> _Part:
        return next(part for part in self._parts if part.tree == tree)


@dataclass(eq=False)
class _Part:
    """A group inside a tree, and its node there."""

    tree: bpy.types.ShaderNodeTree
    node: bpy.types.Node
    zone: tuple[int, ...] = ()
    nodes: int = 0
    _ends: dict[str, bpy.types.Node] = field(default_factory=dict)

    def export(self, socket: bpy.types.NodeSocket) -> bpy.types.NodeSocket:
        """Lead a socket of the group out; return the output of its node."""
        key = str(len(self.node.outputs))
        self.tree.interface.new_socket(key, in_out="OUTPUT", socket_type=_socket_type(socket))
        self.tree.links.new(socket, self._end("NodeGroupOutput").inputs[key])
        return self.node.outputs[key]

    def entry(
        self, socket: bpy.types.NodeSocket
    ) -> tuple[bpy.types.NodeSocket, bpy.types.NodeSocket]:
        """Add an input for a value like a socket's; return it outside and inside."""
        key = str(len(self.node.inputs))
        self.tree.interface.new_socket(key, in_out="INPUT", socket_type=_socket_type(socket))
        return self.node.inputs[key], self._end("NodeGroupInput").outputs[key]

    def number(self, value: float) -> bpy.types.NodeSocket:
        """Return a number that Blender cannot know beforehand, one node for all its uses."""
        key = repr(value)
        if key not in self._ends:
            geometry = self._end("ShaderNodeNewGeometry")
            node = _new_node(self.tree, "ShaderNodeMath", 0, {"operation": "MULTIPLY_ADD"})
            self.tree.links.new(geometry.outputs["Backfacing"], node.inputs[0])
            node.inputs[1].default_value, node.inputs[2].default_value = 0.0, value
            self._ends[key] = node
        return self._ends[key].outputs[0]

    def _end(self, kind: str) -> bpy.types.Node:
        if kind not in self._ends:
            self._ends[kind] = _new_node(self.tree, kind, 0, {})
        return self._ends[kind]


def _size(operands: Sequence[NodeValue | float]) -> int:
    return max(o.size for o in operands if isinstance(o, NodeValue))


def _key(name: str, operands: Sequence[NodeValue | float]) -> tuple[object, ...]:
    """What equal expressions have in common."""
    return (name, *(o.socket if isinstance(o, NodeValue) else float(o) for o in operands))


def _socket_type(socket: bpy.types.NodeSocket) -> str:
    return {"VECTOR": "NodeSocketVector", "RGBA": "NodeSocketColor"}.get(
        socket.type, "NodeSocketFloat"
    )


def _new_node(
    tree: bpy.types.ShaderNodeTree, kind: str, place: int, properties: dict[str, Operand]
) -> bpy.types.Node:
    # To look for the active node takes time, which only trees of the user's are worth.
    active = None if MARK in tree else tree.nodes.active
    node = tree.nodes.new(kind)
    if MARK in tree:
        # Blender looks for a free name among all nodes of a kind: the next one finds its own free.
        node.name = f"{place} {node.name}"
    for name, value in properties.items():
        setattr(node, name, value)
    node[MARK] = True
    if tree.name.startswith("."):
        return node  # nobody looks into a part
    node.select = False
    node.hide = True
    if active is not None:
        tree.nodes.active = active
    node.location = (180.0 * (place % _COLUMNS), -60.0 * (place // _COLUMNS))
    return node


def new_group(name: str, kind: str = "ShaderNodeTree") -> bpy.types.ShaderNodeTree:
    """Add an empty node group that is marked as made here; of geometry too, if so named."""
    tree = bpy.data.node_groups.new(name, kind)
    tree[MARK] = True
    return tree


_TO_NUMBER = {"DOT_PRODUCT"}
# What Multiply Add gets in place of an operation's two operands.
_FUSED: dict[str, Callable[[Operand, Operand], tuple[Operand, Operand, Operand]]] = {
    "ADD": lambda a, b: (a, 1.0, b),
    "SUBTRACT": lambda a, b: (b, -1.0, a),
    "MULTIPLY": lambda a, b: (a, b, 0.0),
}


@dataclass(frozen=True, eq=False)
class NodeValue:
    """A number (size 1) or three bands at once (size 3) in a node tree.

    It comes out of a socket, or is a product of two factors that may not have one yet.
    """

    graph: Graph
    known: bpy.types.NodeSocket | None
    size: int
    factors: tuple[NodeValue | float, ...] = ()

    # Keeps numpy numbers from taking a term for an array.
    __array_ufunc__ = None

    @property
    def socket(self) -> bpy.types.NodeSocket:
        """Where it comes out."""
        return self.graph.product(self.factors) if self.known is None else self.known

    def __add__(self, other: Operand) -> Operand:
        return self if _is(other, 0.0) else self.graph.operation("ADD", (self, other))

    __radd__ = __add__

    def __sub__(self, other: Operand) -> Operand:
        return self if _is(other, 0.0) else self.graph.operation("SUBTRACT", (self, other))

    def __rsub__(self, other: Operand) -> Operand:
        return self.graph.operation("SUBTRACT", (other, self))

    def __mul__(self, other: Operand) -> Operand:
        if _is(other, 0.0):
            return 0.0
        return self if _is(other, 1.0) else self.graph.operation("MULTIPLY", (self, other))

    __rmul__ = __mul__

    def __truediv__(self, other: Operand) -> Operand:
        return self if _is(other, 1.0) else self.graph.operation("DIVIDE", (self, other))

    def __rtruediv__(self, other: Operand) -> Operand:
        return 0.0 if _is(other, 0.0) else self.graph.operation("DIVIDE", (other, self))

    def __neg__(self) -> Operand:
        return self * -1.0

    def dot(self, other: NodeValue) -> NodeValue:
        """Sum of the products of the three bands."""
        return self.graph.operation("DOT_PRODUCT", (self, other))


def _is(value: object, number: float) -> bool:
    return not isinstance(value, NodeValue) and value == number


def _function(name: str, on_numbers: Operand) -> Operand:
    """Return a function of terms or plain numbers."""

    def call(*operands: Operand) -> Operand:
        graph = next((o.graph for o in operands if isinstance(o, NodeValue)), None)
        return on_numbers(*operands) if graph is None else graph.operation(name, operands)

    return call


_maximum = _function("MAXIMUM", NUMPY.maximum)
_LEAST = 1e-37


def _each(name: str, on_numbers: Operand) -> Operand:
    """Return a function of each of three bands, which vectors have not, or only a slow one."""
    of_number = _function(name, on_numbers)

    def call(x: Operand) -> Operand:
        if isinstance(x, NodeValue) and x.size == 3:
            return x.graph.vector(*map(of_number, x.graph.components(x)))
        return of_number(x)

    return call


_exp = _each("EXPONENT", NUMPY.exp)
_sqrt = _each("SQRT", NUMPY.sqrt)


def _power(base: Operand, exponent: Operand) -> Operand:
    """Power of what is not negative; Blender's own also tells the sign, which is slow."""
    if not isinstance(base, NodeValue) and not isinstance(exponent, NodeValue):
        return NUMPY.power(base, exponent)
    return _exp(_log(_maximum(base, _LEAST)) * exponent)


def _log(x: Operand) -> Operand:
    # The mathematics of vectors has no logarithm; no formula takes one of bands.
    return x.graph.operation("LOGARITHM", (x, math.e)) if isinstance(x, NodeValue) else NUMPY.log(x)


def _less(x: Operand, y: Operand) -> Operand:
    terms = [o for o in (x, y) if isinstance(o, NodeValue)]
    if terms and max(t.size for t in terms) == 3:
        return _maximum(terms[0].graph.operation("SIGN", (y - x,)), 0.0)
    return _less_numbers(x, y)


_less_numbers = _function("LESS_THAN", NUMPY.less)


def _interpolate(x: Operand, xs: Sequence[float], ys: Sequence[float]) -> Operand:
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
    arccos=_function("ARCCOSINE", NUMPY.arccos),
    tan=_function("TANGENT", NUMPY.tan),
    arctan2=_function("ARCTAN2", NUMPY.arctan2),
    floor=_function("FLOOR", NUMPY.floor),
    sine=_function("SINE", NUMPY.sine),
    power=_power,
    minimum=_function("MINIMUM", NUMPY.minimum),
    maximum=_maximum,
    less=_less,
    interpolate=_interpolate,
)
"""The elementary functions over terms; plain numbers are computed at once."""
