"""Sums over the places of a repeat zone: what is compiled does not grow with their number."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from .node_mathematics import Graph, NodeValue


def summed(
    graph: Graph, count: int, terms: Callable[[NodeValue], Sequence[NodeValue]]
) -> tuple[NodeValue, ...]:
    """Add up terms over 0 to count - 1.

    Parameters
    ----------
    graph : Graph
    count : int
    terms : callable
        Makes the nodes of one iteration, for its index.
    """
    begin = graph.node("GeometryNodeRepeatInput")
    end = graph.node("GeometryNodeRepeatOutput")
    begin.pair_with_output(end)
    begin.inputs["Iterations"].default_value = count
    with graph.apart():
        found = terms(graph.term(begin.outputs["Iteration"]))
        end.repeat_items.clear()
        names = [f"Sum {place}" for place in range(len(found))]
        for name, term in zip(names, found, strict=True):
            end.repeat_items.new("FLOAT" if term.size == 1 else "VECTOR", name)
        for name, term in zip(names, found, strict=True):
            graph.assign(graph.term(begin.outputs[name]) + term, end.inputs[name])
    return tuple(graph.term(end.outputs[name]) for name in names)
