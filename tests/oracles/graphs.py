"""Graphs of traced equations run on floats, node by node: what an emitted kernel must agree with."""

from collections.abc import Sequence

from armwright.tracing.graph import Graph, reachable


def evaluate(graph: Graph, outputs: Sequence[int], inputs: Sequence[float]) -> list[float]:
    """Return the values of nodes of a graph, by folding it with constants for its inputs."""
    folded, values = Graph(), {}
    for i in reachable(graph, outputs):
        node = graph.nodes[i]
        if node.op in ("input", "constant"):
            values[i] = folded.constant(inputs[int(node.value)] if node.op == "input" else node.value)
        else:
            values[i] = folded.apply(node.op, *(values[j] for j in node.operands))
    return [folded.value(values[i]) for i in outputs]
