"""Zones of a cell: an input tells whether the tool of an arm is inside, as that of a light barrier or a switch."""

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.spatial.poses import inverse_pose


@attrs.frozen(kw_only=True, eq=False)
class Zone:
    """A ball or a box that stands in the world.

    Attributes:
        arm: whose tool point is looked for.
        pose: (4, 4) of its centre in the world; the sides of a box are along the axes.
        radius: of a ball [m]; None for a box.
        sides: (3,) lengths of the sides of a box [m]; None for a ball.
        inverted: whether the input is on while the tool point is not inside.
    """

    arm: str
    pose: Array
    radius: float | None = None
    sides: Array | None = None
    inverted: bool = False

    def holds(self, p: Array) -> Array:
        """Return for positions (k, 3) of the tool point in the world whether the input is on, (k,)."""
        X_ZW = inverse_pose(self.pose)
        local = p @ X_ZW[:3, :3].T + X_ZW[:3, 3]
        if self.sides is None:
            inside = np.linalg.norm(local, axis=1) <= self.radius
        else:
            inside = (np.abs(local) <= self.sides / 2).all(axis=1)
        return np.asarray(inside ^ self.inverted)

    def changes(self, p: Array, start: float, period: float) -> tuple[tuple[float, float], ...]:
        """Return what the input is from a time on, and when it changes.

        Args:
            p: (k, 3) positions of the tool point in the world at servo ticks; at the last one it stays.
            start: time of the first tick [s].
            period: of the servo [s].
        """
        on = self.holds(p)
        ticks = np.concatenate([[0], np.flatnonzero(on[1:] != on[:-1]) + 1])
        return tuple((start + int(tick) * period, float(on[tick])) for tick in ticks)
