"""Pictures that cameras of a cell take of a MuJoCo world, rendered without a screen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from armwright.arrays import Array
from armwright.cell.scene import Camera
from armwright.errors import MissingExtraError
from armwright.extras import opencv
from armwright.mujoco_library import graphics, load_mujoco
from armwright.physics.geoms import quaternion
from armwright.physics.markers import PURPOSE
from armwright.spatial.lens import Lens
from armwright.spatial.poses import homogeneous

# Red, green and blue (height, width, 3).
Picture: TypeAlias = npt.NDArray[np.uint8]

# Everything is drawn with so many pixels for each of the picture, along either side, and averaged.
_FINER = 2
# Pixels between those whose directions are computed, and how far sizes are off by rounding [px].
_SPACING, _ROUNDING = 10, 1e-6
# What is nearer or farther is not drawn [m].
_NEAREST, _FARTHEST = 0.01, 100.0
# Groups of geometries that are drawn: the rest is for contact only.
DRAWN_GROUPS = np.array([1, 1, 1, 0, 0, 0], dtype=np.uint8)
# Axes of a camera of MuJoCo, which looks along -z with y up, in those of a camera of a cell.
_MUJOCO_AXES = np.diag((1.0, -1.0, -1.0))
_MOST_GEOMETRIES = 100_000


def add_camera(body: Any, camera: Camera) -> None:
    """Add a camera to a body of a MuJoCo specification: to the world, or to the tool of the arm that carries it."""
    # What other programs draw of the world; pictures are taken with the lens itself.
    fovy = 2 * np.arctan(camera.lens.height / 2 / camera.lens.focal[1])
    body.add_camera(
        name=camera.name,
        pos=camera.pose[:3, 3],
        quat=quaternion(camera.pose[:3, :3] @ _MUJOCO_AXES),
        fovy=np.degrees(fovy),
        resolution=(camera.lens.width, camera.lens.height),
    )


def add_lights(spec: Any) -> None:
    """Light a MuJoCo specification evenly, so that what is white is not too bright anywhere."""
    headlight = spec.visual.headlight
    headlight.ambient, headlight.diffuse, headlight.specular = (0.35,) * 3, (0.2,) * 3, (0.0,) * 3
    spec.worldbody.add_light(pos=(0.3, -0.5, 2.5), dir=(0.1, 0.2, -1.0), diffuse=(0.25,) * 3, specular=(0.0,) * 3)


def camera_pose(data: Any, name: str) -> Array:
    """Return the pose (4, 4) in the world of a camera of a MuJoCo world, with the axes of a camera of a cell."""
    camera = data.camera(name)
    return homogeneous(camera.xmat.reshape(3, 3) @ _MUJOCO_AXES, camera.xpos)


class Photographer:
    """Takes the pictures of the cameras of a world.

    The same state and seed give the same bits, on one machine and with one OpenGL.

    Attributes:
        graphics: the OpenGL that draws, ``egl`` or ``osmesa``.
        model: the MjModel.
    """

    def __init__(self, model: Any, cameras: Mapping[str, Camera]) -> None:
        """Take a world and its cameras; nothing is drawn yet.

        Args:
            model: the MjModel, with all of the cameras in it.
            cameras: by name.

        Raises:
            MissingExtraError: OpenGL or OpenCV is missing.
        """
        mujoco = load_mujoco()
        self._mujoco, self._cv2, self.model = mujoco, opencv(PURPOSE), model
        self._views = {name: _View(camera) for name, camera in cameras.items()}
        self.graphics, context = graphics()
        self._scene = mujoco.MjvScene(model, _most_geometries(model))
        for flag in (mujoco.mjtRndFlag.mjRND_SHADOW, mujoco.mjtRndFlag.mjRND_REFLECTION):
            self._scene.flags[flag] = 0
        self._options = mujoco.MjvOption()
        self._options.geomgroup[:], self._options.sitegroup[:] = DRAWN_GROUPS, 0
        width, height = np.max([view.size for view in self._views.values()], axis=0).tolist()
        self._context = _opened(context, self.graphics, width, height)
        self._drawing = self._drawing_context(width, height)

    def picture(self, data: Any, name: str, seed: int | Sequence[int] = 0) -> Picture:
        """Return what a camera sees.

        Args:
            data: the MjData; the poses in it are those that are drawn.
            name: of the camera.
            seed: of the noise of the pixels.
        """
        view = self._views[name]
        pixels = self._draw(data, view)
        if view.maps is not None:
            pixels = self._cv2.remap(pixels, *view.maps, self._cv2.INTER_LINEAR)
        lens = view.camera.lens
        pixels = self._cv2.resize(pixels, (lens.width, lens.height), interpolation=self._cv2.INTER_AREA)
        return _exposed(pixels, view.camera, seed)

    def close(self) -> None:
        """Give back what the graphics hold; no picture can be taken any more."""
        self._context.make_current()
        self._drawing.free()
        self._context.free()

    def _drawing_context(self, width: int, height: int) -> Any:
        """Return what a drawing of MuJoCo needs, without shadows and smoothing of edges: pixels are averaged here."""
        quality = self.model.vis.quality
        before = quality.offsamples, quality.shadowsize
        quality.offsamples = quality.shadowsize = 0
        try:
            drawing = self._mujoco.MjrContext(self.model, self._mujoco.mjtFontScale.mjFONTSCALE_100.value)
        finally:
            quality.offsamples, quality.shadowsize = before
        self._mujoco.mjr_setBuffer(self._mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, drawing)
        self._mujoco.mjr_resizeOffscreen(width, height, drawing)
        return drawing

    def _draw(self, data: Any, view: _View) -> Picture:
        """Return a picture of the field of a lens, without distortion."""
        mujoco, scene = self._mujoco, self._scene
        camera = mujoco.MjvCamera()
        camera.type, camera.fixedcamid = mujoco.mjtCamera.mjCAMERA_FIXED, self.model.camera(view.camera.name).id
        self._context.make_current()
        mujoco.mjv_updateScene(self.model, data, self._options, None, camera, mujoco.mjtCatBit.mjCAT_ALL.value, scene)
        (left, top), (right, bottom) = view.field * _NEAREST
        for eye in scene.camera:
            eye.frustum_near, eye.frustum_far = _NEAREST, _FARTHEST
            eye.frustum_center, eye.frustum_width = (left + right) / 2, (right - left) / 2
            eye.frustum_bottom, eye.frustum_top = -bottom, -top
        width, height = view.size
        pixels = np.empty((height, width, 3), dtype=np.uint8)
        area = mujoco.MjrRect(0, 0, width, height)
        mujoco.mjr_render(area, scene, self._drawing)
        mujoco.mjr_readPixels(pixels, None, area, self._drawing)
        # Rows of OpenGL begin at the bottom.
        return pixels[::-1]


class _View:
    """What is drawn for a camera before its lens distorts it.

    Attributes:
        camera: the camera.
        field: (2, 2) least and largest x and y of the directions with z = 1 that are drawn.
        size: width and height of the drawing [px].
        maps: where each pixel of a picture that is finer than the one of the camera is in the drawing; None where
            nothing is distorted.
    """

    def __init__(self, camera: Camera) -> None:
        """Find the field of the lens of a camera."""
        self.camera, self.field = camera, camera.lens.field()
        span = np.ptp(self.field, axis=0) * camera.lens.focal * _FINER
        self.size = int(np.ceil(span[0] - _ROUNDING)), int(np.ceil(span[1] - _ROUNDING))
        self.maps: list[npt.NDArray[np.float32]] | None = None
        if camera.lens.distortion.any():
            scaled = zip(_directions(camera.lens), self.field[0], np.ptp(self.field, axis=0), self.size, strict=True)
            self.maps = [((x - least) / width * size - 0.5).astype(np.float32) for x, least, width, size in scaled]


@lru_cache(maxsize=8)
def _directions(lens: Lens) -> tuple[Array, Array]:
    """Return the x and the y of the directions with z = 1 of all pixels of a picture that is finer than that of a lens.

    A lens distorts smoothly, so that a spline through some of the pixels has the others.
    """
    from scipy.interpolate import RectBivariateSpline  # noqa: PLC0415 - few lenses distort

    sizes = lens.width, lens.height
    x, y = (np.linspace(-0.5, size - 0.5, max(8, size // _SPACING)) for size in sizes)
    known = lens.rays(np.stack(np.meshgrid(x, y), axis=-1))
    columns, rows = ((np.arange(size * _FINER) + 0.5) / _FINER - 0.5 for size in sizes)
    every = [RectBivariateSpline(y, x, known[..., axis])(rows, columns) for axis in range(2)]
    return every[0], every[1]


def _exposed(pixels: Picture, camera: Camera, seed: int | Sequence[int]) -> Picture:
    """Return a picture with the light and the noise of a camera."""
    if camera.light == 1 and camera.noise == 0:
        return pixels
    bright = pixels.astype(np.float32) * np.float32(camera.light)
    if camera.noise > 0:
        bright += np.float32(camera.noise) * np.random.default_rng(seed).standard_normal(pixels.shape, np.float32)
    return np.asarray(np.clip(np.rint(bright), 0, 255).astype(np.uint8))


def _opened(context: Any, name: str, width: int, height: int) -> Any:
    """Return a new context of OpenGL.

    Raises:
        MissingExtraError: the system has a library, but no driver.
    """
    try:
        opened = context(width, height)
        opened.make_current()
    except Exception as error:
        # Each OpenGL has errors of its own, and the caller can do the same about all of them.
        why = " ".join(str(error).split())
        raise MissingExtraError(
            f"drawing pictures by {name} fails: {why}; on Debian and Ubuntu the drivers are installed by: "
            "apt-get install libegl-mesa0 libgl1-mesa-dri"
        ) from error
    return opened


def _most_geometries(model: Any) -> int:
    """Return a bound of how many geometries are drawn: beside bodies, cameras and lights may be."""
    return min(_MOST_GEOMETRIES, 2 * int(model.ngeom) + 100)


def png(picture: Picture) -> bytes:
    """Return a picture as the content of a PNG file.

    Raises:
        MissingExtraError: OpenCV is missing.
    """
    made, content = opencv(PURPOSE).imencode(".png", picture[:, :, ::-1])
    assert made  # noqa: S101 - there is a writer of PNG in every OpenCV
    return bytes(content)
