"""Abstract scalars: the numbers that the equations of mechanics are written over, and the kernels that come of them.

An equation is a plain function of scalars. What a scalar is, the caller decides: a float gives one value, and a NumPy
array one value per configuration, all in one sweep. A traced scalar leaves a graph of the operations (``graph``), in
which shared terms are one node and constants are folded; of the graph straight-line source is emitted (``emit``), which
Numba compiles once and a cache on disk keeps (``cache``), and which is called with arrays as a function (``kernel``).
"""

from armwright.lazy_namespace import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
