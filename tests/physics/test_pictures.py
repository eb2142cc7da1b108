"""Pictures of a world: their geometry, light and noise, and what is missing to take them."""

import ctypes
import os
import sys

import attrs
import numpy as np
import pytest

from armwright.cell.scene import Camera
from armwright.errors import MissingExtraError
from armwright.mujoco_library import graphics, load_mujoco
from armwright.physics.pictures import Photographer, add_camera, camera_pose, png
from armwright.spatial.lens import Lens
from armwright.spatial.poses import homogeneous
from picture_worlds import ON_TOP, ROUND, SIMPLE, TOP, photographer, world

cv2 = pytest.importorskip("cv2")
pytestmark = pytest.mark.usefixtures("opengl")

CROOKED = Lens(width=320, height=200, focal=(300, 330), centre=(140, 120), distortion=(0.2, -0.1, -0.002, 0.003, 0.01))


@pytest.mark.parametrize("lens", [SIMPLE, ROUND, CROOKED], ids=["simple", "round", "crooked"])
def test_pictures_are_those_of_the_lens(lens: Lens, rng: np.random.Generator) -> None:
    """A white disc anywhere in the picture is where the rays of the lens meet it, to a twentieth of a pixel."""
    import mujoco

    spec, cameras = mujoco.MjSpec(), {}
    light = spec.visual.headlight
    light.ambient, light.diffuse, light.specular = (0.8,) * 3, (0.0,) * 3, (0.0,) * 3
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_CYLINDER, size=(0.02, 1e-5, 0), rgba=(1, 1, 1, 1))
    for number in range(10):
        across = lens.rays(rng.uniform((40, 40), (lens.width - 40, lens.height - 40)))
        camera = Camera(name=f"C{number}", lens=lens, pose=homogeneous(TOP.pose[:3, :3], across * (-0.8, 0.8, 0.8)))
        cameras[camera.name] = camera
        add_camera(spec.worldbody, camera)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    taking = Photographer(model, cameras)
    off = []
    for name, camera in cameras.items():
        np.testing.assert_allclose(camera_pose(data, name), camera.pose, atol=1e-12)
        bright = taking.picture(data, name)[:, :, 0].astype(float)
        rows, columns = np.mgrid[: lens.height, : lens.width]
        seen = np.array([(bright * columns).sum(), (bright * rows).sum()]) / bright.sum()
        pixels = seen + np.stack(np.meshgrid(*[np.linspace(-25, 25, 251)] * 2), axis=-1).reshape(-1, 2)
        met = camera.pose[:3, 3] + lens.rays(pixels) @ camera.pose[:3, :3].T * camera.pose[2, 3]
        off.append(seen - pixels[np.hypot(met[:, 0], met[:, 1]) < 0.02].mean(axis=0))
    taking.close()
    assert np.abs(off).max() < 0.05
    assert np.abs(np.mean(off, axis=0)).max() < 0.02


def test_the_same_bits() -> None:
    """The same state and seed give the same picture, in another world too; another seed gives other noise."""
    noisy = world(attrs.evolve(TOP, lens=ROUND, noise=2), marker=ON_TOP)
    with photographer(noisy) as taking:
        first, again, other = (taking.picture(noisy.data, "TOP", seed) for seed in ([1, 2], [1, 2], [1, 3]))
    another = world(attrs.evolve(TOP, lens=ROUND, noise=2), marker=ON_TOP)
    with photographer(another) as taking:
        there = taking.picture(another.data, "TOP", [1, 2])

    np.testing.assert_array_equal(first, again)
    np.testing.assert_array_equal(first, there)
    assert (first != other).mean() > 0.5


def test_noise_and_light(rng: np.random.Generator) -> None:
    """Noise has the standard deviation of the camera; with half the light everything is half as bright."""
    cameras = [
        attrs.evolve(TOP, name=name, noise=noise, light=light)
        for name, noise, light in (("CLEAR", 0, 1), ("NOISY", 4, 1), ("DIM", 0, 0.5), ("DARK", 0, 0))
    ]
    there = world(*cameras, marker=ON_TOP)
    with photographer(there) as taking:
        pictures = {
            name: taking.picture(there.data, name, int(rng.integers(1 << 30))).astype(float) for name in there.cameras
        }

    off = pictures["NOISY"] - pictures["CLEAR"]
    table = (pictures["CLEAR"] > 30) & (pictures["CLEAR"] < 220)
    assert off[table].std() == pytest.approx(4, rel=0.02)
    assert abs(off[table].mean()) < 0.05
    # Rounding to whole numbers.
    np.testing.assert_allclose(pictures["DIM"], pictures["CLEAR"] / 2, atol=0.501)
    assert not pictures["DARK"].any()


def test_what_is_for_contact_only_is_not_drawn() -> None:
    """Geometries of the groups from 3 on and sites do not show."""
    import mujoco

    spec = mujoco.MjSpec()
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=(0.1, 0, 0), group=3)
    spec.worldbody.add_site(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=(0.1, 0, 0))
    add_camera(spec.worldbody, TOP)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    taking = Photographer(model, {"TOP": TOP})

    assert not taking.picture(data, "TOP").any()
    taking.close()


def test_png(rng: np.random.Generator) -> None:
    """A PNG file has every pixel."""
    picture = rng.integers(0, 256, (40, 60, 3)).astype(np.uint8)

    back = cv2.imdecode(np.frombuffer(png(picture), np.uint8), cv2.IMREAD_COLOR)[:, :, ::-1]

    np.testing.assert_array_equal(back, picture)


def without(monkeypatch: pytest.MonkeyPatch, *libraries: str) -> None:
    """A system without some shared libraries."""
    there = ctypes.CDLL

    def load(name: str, *args: object, **kwargs: object) -> ctypes.CDLL:
        if any(library in str(name) for library in libraries):
            raise OSError(f"{name}: cannot open shared object file")
        return there(name, *args, **kwargs)

    monkeypatch.setattr(ctypes, "CDLL", load)


def test_a_system_without_opengl(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without EGL and OSMesa one line names the packages that bring them; the one that is asked for is looked for."""
    without(monkeypatch, "EGL", "OSMesa")
    for wanted, packages in (
        (None, "apt-get install libegl1 libgl1"),
        ("egl", "libegl1 libgl1"),
        ("osmesa", "libosmesa6"),
    ):
        monkeypatch.delenv("MUJOCO_GL", raising=False)
        if wanted:
            monkeypatch.setenv("MUJOCO_GL", wanted)
        with pytest.raises(MissingExtraError) as caught:
            graphics()
        assert str(caught.value).endswith(packages)
        assert "\n" not in str(caught.value)
    monkeypatch.setenv("MUJOCO_GL", "glfw")
    with pytest.raises(
        MissingExtraError, match="MUJOCO_GL: expected egl or osmesa, which draw without a screen, got 'glf"
    ):
        graphics()


def test_osmesa_where_there_is_no_egl(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without EGL, OSMesa draws, and the environment says so to what is loaded later."""
    without(monkeypatch, "EGL")
    monkeypatch.delenv("MUJOCO_GL", raising=False)
    there = ctypes.CDLL
    monkeypatch.setattr(ctypes, "CDLL", lambda name: None if "OSMesa" in name else there(name))
    mesa = type("mujoco.osmesa", (), {"GLContext": "a context"})
    monkeypatch.setitem(sys.modules, "mujoco.osmesa", mesa)

    assert graphics() == ("osmesa", "a context")
    assert os.environ["MUJOCO_GL"] == "osmesa"


def test_missing_packages(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without PyOpenGL or OpenCV one line says how to install them."""
    there = world(TOP)
    for module, name in (("OpenGL", "PyOpenGL"), ("cv2", "opencv-python-headless")):
        with monkeypatch.context() as patched:
            patched.setitem(sys.modules, module, None)
            with pytest.raises(MissingExtraError) as caught, photographer(there):
                pass
        assert str(caught.value).endswith(f"needs {name}; install it by: pip install 'armwright[physics]'")


def test_mujoco_that_cannot_be_loaded(monkeypatch: pytest.MonkeyPatch) -> None:
    """MuJoCo loads the OpenGL of the environment itself, and fails in many words where that is missing: one line."""
    monkeypatch.setenv("MUJOCO_GL", "osmesa")
    monkeypatch.setitem(sys.modules, "mujoco", None)
    without(monkeypatch, "OSMesa")

    with pytest.raises(MissingExtraError, match=r"needs OSMesa, which this system does not have; .* libosmesa6"):
        load_mujoco()
