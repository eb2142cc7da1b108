"""Films: bodies are drawn where a camera at their place sees them, the near ones in front of the far ones."""

import io
from typing import Any

import numpy as np
import pytest

from armwright.arrays import Array
from armwright.report.animation import Animation, Body, MovedPart
from armwright.report.movie import render_gif
from armwright.report.shape_table import ShapeTable
from armwright.spatial.poses import homogeneous, to_noap
from armwright.spatial.shapes import Box

# Slow: a half of its tests is drawn.
pytestmark = pytest.mark.part(0.1)

pillow = pytest.importorskip("PIL.Image")
pytest.importorskip("matplotlib")


def film(animation: Animation) -> list[Array]:
    """The images of the film of an animation, as numbers."""
    content: Any = pillow.open(io.BytesIO(render_gif(animation, lambda _done, _all: None)))
    images = []
    for i in range(content.n_frames):
        content.seek(i)
        images.append(np.asarray(content.convert("RGB")).astype(float))
    return images


def blue(image: Array) -> Array:
    """The pixels (k, 2), across and down below the clock, that have the hue of the first part."""
    red, green, hue = np.moveaxis(image[40:], 2, 0)
    return np.argwhere((hue > 1.3 * green) & (green > 1.3 * red))[:, ::-1]


def moved_part(shapes: ShapeTable, size: Array, places: Array) -> MovedPart:
    """A box that is at one place after the other, a second each."""
    return MovedPart(
        name="BOX",
        shape=shapes.number(Box(size=size)),
        times=list(map(float, range(len(places)))),
        arms=[None] * len(places),
        poses=[to_noap(homogeneous(np.eye(3), p)) for p in places],
    )


def test_where_bodies_are_drawn() -> None:
    """Boxes of one size look smaller the farther they are from the camera, in proportion to their distance."""
    shapes = ShapeTable()
    # The camera looks along this direction, from above.
    along = np.array([np.cos(-0.95), np.sin(-0.95), 0.0])
    places = np.array([0.5 * k * along for k in (-1, 0, 1)])
    part = moved_part(shapes, np.full(3, 0.2), places)
    ground = homogeneous(np.eye(3), np.array([0.0, 0.0, -0.5]))
    plate = Body(name="PLATE", shape=shapes.number(Box(size=[2.0, 2.0, 0.02])), pose=to_noap(ground))
    t = np.arange(0.0, 2.96, 0.05)
    images = film(Animation(fps=20.0, t=t, parts=[part], fixtures=[plate], shapes=shapes.as_data()))

    heights = []
    for image, time in ((images[5], 0), (images[25], 1), (images[45], 2)):
        rows = blue(image)[:, 1]
        heights.append(float(np.ptp(rows)) + 1)
        assert len(rows) > 50, time
    # 1 / height is linear in the depth, and the places are evenly spaced along it.
    inverse = 1 / np.array(heights)
    assert inverse[0] > inverse[1] > inverse[2]
    assert inverse[1] == pytest.approx((inverse[0] + inverse[2]) / 2, rel=0.06)


def test_what_is_hidden() -> None:
    """Nothing is seen of a box that stands behind a wall, and all of it before the wall."""
    shapes = ShapeTable()
    towards = np.array([np.cos(-0.95) * np.cos(0.4), np.sin(-0.95) * np.cos(0.4), np.sin(0.4)])
    across = np.array([-np.sin(-0.95), np.cos(-0.95), 0.0])
    wall = homogeneous(np.stack([across, np.cross(towards, across), towards], axis=1), np.array([0.0, 0.0, 0.5]))
    fixture = Body(name="WALL", shape=shapes.number(Box(size=[0.8, 0.8, 0.02])), pose=to_noap(wall))
    places = np.array([0.0, 0.0, 0.5]) + np.array([0.3, -0.3])[:, None] * towards
    part = moved_part(shapes, np.full(3, 0.1), places)
    t = np.arange(0.0, 1.96, 0.05)
    images = film(Animation(fps=20.0, t=t, parts=[part], fixtures=[fixture], shapes=shapes.as_data()))

    assert len(blue(images[5])) > 100
    assert len(blue(images[-5])) == 0
