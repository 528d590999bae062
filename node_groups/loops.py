"""Repeat zones: what is compiled does not grow with the number of their iterations."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import bpy

from ..uw_spectral.mathematics import Operand
from .node_mathematics import Graph, NodeValue


def summed(
    graph: Graph, count: int | NodeValue, terms: Callable[[NodeValue], Sequence[NodeValue]]
) -> tuple[NodeValue, ...]:
    """Add up terms over 0 to count - 1; ``terms`` makes the nodes of one iteration, for its index.

    A count that is a value of nodes is heeded by EEVEE; Cycles takes it for 0.
    """
    begin, end = _zone(graph, count)
    with graph.apart():
        found = terms(graph.term(begin.outputs["Iteration"]))
        end.repeat_items.clear()
        return _added_up(graph, begin, end, found)


def followed(
    graph: Graph,
    count: int,
    terms: Callable[[NodeValue, NodeValue], tuple[NodeValue, Sequence[NodeValue]]],
    met: NodeValue | float = 1.0,
    *,
    skips: bool = True,
) -> tuple[NodeValue, ...]:
    """Add up a number over 0 to count - 1, and terms that know its sum before them.

    ``terms`` makes the nodes of one iteration, for its index and that sum: the number, and terms.
    Where ``met`` is 0, so are all; with ``skips`` there are no iterations then: EEVEE heeds that,
    Cycles makes none anywhere.
    """
    counted = met * float(count) if skips and isinstance(met, NodeValue) else count
    begin, end = _zone(graph, counted)
    with graph.apart():
        end.repeat_items.clear()
        end.repeat_items.new("FLOAT", _sum(0))
        before = graph.term(begin.outputs[_sum(0)])
        number, others = terms(graph.term(begin.outputs["Iteration"]), before)
        return _added_up(graph, begin, end, (number, *others))


def _added_up(
    graph: Graph, begin: bpy.types.Node, end: bpy.types.Node, found: Sequence[NodeValue]
) -> tuple[NodeValue, ...]:
    """Add the terms of an iteration to those before; return what the zone ends with."""
    there = len(end.repeat_items)
    for place, term in enumerate(found[there:], there):
        end.repeat_items.new("FLOAT" if term.size == 1 else "VECTOR", _sum(place))
    for place, term in enumerate(found):
        graph.assign(graph.term(begin.outputs[_sum(place)]) + term, end.inputs[_sum(place)])
    return tuple(graph.term(end.outputs[_sum(place)]) for place in range(len(found)))


def _sum(place: int) -> str:
    return f"Sum {place}"


def iterated(
    graph: Graph, count: int, state: Sequence[Operand], step: Callable[..., Sequence[Operand]]
) -> tuple[NodeValue, ...]:
    """Take numbers through a repeat zone; ``step`` makes the nodes of one iteration."""
    begin, end = _zone(graph, count)
    end.repeat_items.clear()
    names = [f"State {place}" for place in range(len(state))]
    for name in names:
        end.repeat_items.new("FLOAT", name)
    for name, value in zip(names, state, strict=True):
        graph.assign(value, begin.inputs[name])
    with graph.apart():
        before = [graph.term(begin.outputs[name]) for name in names]
        after = step(graph.term(begin.outputs["Iteration"]), *before)
        for name, value in zip(names, after, strict=True):
            graph.assign(value, end.inputs[name])
    return tuple(graph.term(end.outputs[name]) for name in names)


def _zone(graph: Graph, count: int | NodeValue) -> tuple[bpy.types.Node, bpy.types.Node]:
    begin = graph.node("GeometryNodeRepeatInput")
    end = graph.node("GeometryNodeRepeatOutput")
    begin.pair_with_output(end)
    graph.assign(count, begin.inputs["Iterations"])
    return begin, end
