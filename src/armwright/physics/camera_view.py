"""What the cameras of a cell see of it as it is shown."""

from __future__ import annotations

from collections.abc import Mapping

from armwright.arrays import Array
from armwright.cell.model import Cell
from armwright.mujoco_library import load_mujoco
from armwright.physics.geoms import quaternion
from armwright.physics.pictures import Photographer, png
from armwright.physics.plant import arm_indices
from armwright.physics.world_model import world_model


class CameraView:
    """A world of a cell that stands still, for its pictures; made and used in one thread."""

    def __init__(self, cell: Cell) -> None:
        """Make the world.

        Raises:
            UnsupportedArmError: masses of an arm are unknown.
            MissingExtraError: OpenCV or OpenGL is missing.
        """
        self._cell = cell
        self._model = world_model(cell, cell.parts).model
        self._mujoco = load_mujoco()
        self._data = self._mujoco.MjData(self._model)
        self._photographer = Photographer(self._model, cell.cameras)

    def close(self) -> None:
        """Give back what the graphics hold."""
        self._photographer.close()

    def picture(self, camera: str, configurations: Mapping[str, Array], parts: Mapping[str, Array]) -> bytes:
        """Return a picture as the content of a PNG file.

        Args:
            camera: its name.
            configurations: (n,) of each arm.
            parts: (4, 4) pose of each part in the world.
        """
        data = self._data
        for name, q in configurations.items():
            data.qpos[arm_indices(self._model, name, len(q)).positions] = q
        for name, X in parts.items():
            data.joint(name).qpos[:3], data.joint(name).qpos[3:] = X[:3, 3], quaternion(X[:3, :3])
        self._mujoco.mj_kinematics(self._model, data)
        self._mujoco.mj_camlight(self._model, data)
        return png(self._photographer.picture(data, camera))
