"""Abstract scalars: the numbers that the equations of mechanics are written over, and the kernels that come of them.

An equation is a plain function of scalars. What a scalar is, the caller decides: a float gives one value, and a NumPy
array one value per configuration, all in one sweep. A traced scalar leaves a graph of the operations (``graph``), in
which shared terms are one node and constants are folded. The graph is translated to the operations of a processor
(``machine``) and written as LLVM IR (``emit``, ``emit_llvm``), which is compiled once and kept on disk (``native``).
It is called with arrays as a function (``kernel``, ``door``), or from loops that Numba compiles (``from_numba``,
``cache``).
"""

from armwright.lazy_namespace import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
