"""Which multiplications of a graph join the addition that follows them: a · b + c in one instruction, rounded once.

A compiler may do the same on its own, but then what it does depends on what stands around the code. Here it is part
of the graph's translation, so a kernel gives the same bits however it is compiled: alone, in a vectorised loop,
inlined into another loop.
"""

from collections.abc import Iterable

from armwright.tracing.graph import Graph

_SUMS = frozenset({"add", "subtract"})


def fused(graph: Graph, order: Iterable[int], outputs: Iterable[int]) -> dict[int, int]:
    """Return which multiplication each sum takes in: number of the sum -> number of the multiplication.

    A multiplication is taken in only where that makes it disappear: by all sums that use it, or by none.

    Args:
        graph: the graph.
        order: the nodes in use.
        outputs: the nodes whose values are asked for.
    """
    users: dict[int, list[int]] = {}
    for i in order:
        for operand in set(graph.nodes[i].operands):
            users.setdefault(operand, []).append(i)
    required = set(outputs)
    products = [
        i
        for i, of in users.items()
        if graph.nodes[i].op == "multiply" and i not in required and all(graph.nodes[j].op in _SUMS for j in of)
    ]
    taken: dict[int, int] = {}
    # Those with one user first: each of them is one instruction less, whatever becomes of the others.
    for i in sorted(products, key=lambda i: (len(users[i]), -i)):
        squares = any(graph.nodes[j].operands == (i, i) for j in users[i])
        if not squares and not any(j in taken for j in users[i]):
            taken.update(dict.fromkeys(users[i], i))
    return taken
