"""Mechanisms with play: planar linkages whose pins rattle in their bearings, what that costs, and how to undo it."""
