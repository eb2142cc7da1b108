"""Abstract scalars: the numbers that the equations of mechanics are written over, and the kernels that come of them.

An equation is a plain function of scalars. What a scalar is, the caller decides: a float gives one value, and a NumPy
array one value per configuration, all in one sweep. A traced scalar leaves a graph of the operations (``graph``), in
which shared terms are one node and constants are folded. A graph can be differentiated (``derivatives``), evaluated
with NumPy (``evaluation``), and compiled (``emit``, ``native``) into a kernel that takes arrays (``kernel``).

The functions of this namespace are those that an equation may use beside + - * /, abs and comparisons.
"""

from armwright.lazy_namespace import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
