"""Abstract scalars: the numbers that the equations of mechanics are written over.

An equation is a plain function of scalars. What a scalar is, the caller decides: a float gives one value, a
NumPy array gives one value per configuration, all in one sweep.
"""
