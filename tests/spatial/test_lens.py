"""A pinhole with distortion."""

import numpy as np

from armwright.spatial.lens import Lens, simple_lens

ROUNDING = 1e-10


def test_the_axis_meets_the_middle() -> None:
    """A point straight ahead is in the middle of the picture, one at half the field of view on its edge."""
    lens = simple_lens(640, 480, np.radians(40))

    np.testing.assert_allclose(lens.project([0, 0, 2]), [319.5, 239.5], atol=ROUNDING)
    np.testing.assert_allclose(lens.project([0, np.tan(np.radians(20)), 1]), [319.5, 479.5], atol=ROUNDING)


def test_rays_undo_projection(rng: np.random.Generator) -> None:
    """The ray of the pixel of a point goes through the point, whatever the lens does."""
    lens = Lens(
        width=640,
        height=480,
        focal=(600, 590),
        centre=(310, 250),
        distortion=rng.uniform(-1, 1, 5) * [0.2, 0.05, 0.003, 0.003, 0.01],
    )
    points = np.stack([rng.uniform(-0.4, 0.4, 200), rng.uniform(-0.3, 0.3, 200), rng.uniform(0.8, 2, 200)], axis=1)

    rays = lens.rays(lens.project(points))

    np.testing.assert_allclose(rays, points / points[:, 2:], atol=ROUNDING)
