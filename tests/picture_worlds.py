"""Small MuJoCo worlds to take pictures of."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.cell.scene import Camera, Marker
from armwright.physics.markers import add_marker
from armwright.physics.pictures import Photographer, add_camera, add_lights
from armwright.spatial.lens import simple_lens
from armwright.spatial.poses import homogeneous

# A lens as of a cheap camera: barrel distortion that moves the corners of the picture by 25 px.
DISTORTION = (-0.25, 0.08, 0.002, -0.001, 0.0)
SIMPLE = simple_lens(640, 480, np.radians(42))
ROUND = simple_lens(640, 480, np.radians(42), DISTORTION)
# It looks straight down from 0.8 m.
TOP = Camera(name="TOP", lens=SIMPLE, pose=homogeneous(np.diag((1.0, -1.0, -1.0)), (0, 0, 0.8)))
# On top of a block of 40 mm.
ON_TOP = Marker(number=3, size=0.03, pose=homogeneous(np.eye(3), (0, 0, 0.02)))


@attrs.frozen(eq=False)
class World:
    """A model with its state and its cameras; each camera is carried by a body of its own that can be put anywhere."""

    model: Any
    data: Any
    cameras: Mapping[str, Camera]

    def put(self, camera: str, X: Array) -> None:
        """Put a camera at a pose (4, 4)."""
        import mujoco

        number = self.model.body(f"holder of {camera}").mocapid[0]
        self.data.mocap_pos[number] = X[:3, 3]
        mujoco.mju_mat2Quat(self.data.mocap_quat[number], np.ascontiguousarray(X[:3, :3]).ravel())
        mujoco.mj_forward(self.model, self.data)


def world(*cameras: Camera, marker: Marker | None = None) -> World:
    """A grey table at height 0, a block of 40 mm on it with a marker, and cameras."""
    import mujoco

    spec = mujoco.MjSpec()
    add_lights(spec)
    box = mujoco.mjtGeom.mjGEOM_BOX
    spec.worldbody.add_geom(name="TABLE", type=box, size=(0.5, 0.5, 0.05), pos=(0, 0, -0.05), rgba=(0.5, 0.45, 0.4, 1))
    block = spec.worldbody.add_body(name="BLOCK", pos=(0, 0, 0.02))
    block.add_geom(type=box, size=(0.02,) * 3, rgba=(0.8, 0.5, 0.2, 1))
    if marker is not None:
        add_marker(spec, block, marker, "BLOCK marker")
    for camera in cameras:
        holder = spec.worldbody.add_body(name=f"holder of {camera.name}", mocap=True)
        add_camera(holder, attrs.evolve(camera, pose=np.eye(4)))
    model = spec.compile()
    made = World(model, mujoco.MjData(model), {camera.name: camera for camera in cameras})
    for camera in made.cameras.values():
        made.put(camera.name, camera.pose)
    return made


@contextmanager
def photographer(of: World) -> Iterator[Photographer]:
    """What takes pictures of a world, and gives back the graphics."""
    taking = Photographer(of.model, of.cameras)
    try:
        yield taking
    finally:
        taking.close()


def looking_at(target: Array, eye: Array, roll: float) -> Array:
    """The pose of a camera at an eye (3,) that looks at a point (3,)."""
    forward = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(forward, (np.cos(roll), np.sin(roll), 0.3))
    right /= np.linalg.norm(right)
    return homogeneous(np.column_stack([right, np.cross(forward, right), forward]), eye)


def random_view(rng: np.random.Generator, distance: float = 0.8) -> Array:
    """The pose of a camera about so far away that looks down on the table, up to 45 degrees off the vertical.

    The middle of the table is somewhere in the picture.
    """
    tilt, around = np.arccos(rng.uniform(np.cos(np.pi / 4), 1.0)), rng.uniform(-np.pi, np.pi)
    eye = (
        distance
        * rng.uniform(0.95, 1.05)
        * np.array([np.sin(tilt) * np.cos(around), np.sin(tilt) * np.sin(around), np.cos(tilt)])
    )
    return looking_at(np.array([*rng.uniform(-0.15, 0.15, 2) * distance, 0.0]), eye, rng.uniform(-np.pi, np.pi))
