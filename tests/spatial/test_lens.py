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


def test_the_field_of_a_lens(rng: np.random.Generator) -> None:
    """No pixel shows a direction outside of the field, and pixels of the rim show its bounds."""
    lens = simple_lens(640, 480, np.radians(50), (-0.2, 0.03, 0.002, -0.001, 0.0))
    inner = lens.rays(rng.uniform([-0.5, -0.5], [639.5, 479.5], (500, 2)))[:, :2]

    least, most = lens.field()

    assert (inner > least).all()
    assert (inner < most).all()
    flat = simple_lens(640, 480, np.radians(90)).field()
    np.testing.assert_allclose(flat, [[-4 / 3, -1], [4 / 3, 1]], atol=ROUNDING)


def test_a_lens_that_folds_the_picture() -> None:
    """With k1 = -1, r (1 - r²) has its largest value at r = 0.577: pixels beyond that show nothing."""
    most = 0.5773 * (1 - 0.5773**2)

    for reach, whole in ((0.99 * most, True), (1.01 * most, False)):
        focal = np.hypot(320, 240) / reach
        lens = Lens(width=640, height=480, focal=(focal, focal), centre=(319.5, 239.5), distortion=(-1, 0, 0, 0, 0))
        assert lens.is_invertible() == whole


def test_derivatives_are_quotients_of_differences(rng: np.random.Generator) -> None:
    """The derivatives of a pixel by its point and by the lens are those that small steps show."""
    numbers = np.concatenate([[600, 590, 310, 250], rng.uniform(-1, 1, 5) * [0.2, 0.05, 0.003, 0.003, 0.01]])

    def lens(values: np.ndarray) -> Lens:
        return Lens(width=640, height=480, focal=values[:2], centre=values[2:4], distortion=values[4:])

    points = np.stack([rng.uniform(-0.4, 0.4, 20), rng.uniform(-0.3, 0.3, 20), rng.uniform(0.8, 2, 20)], axis=1)
    step = 1e-6
    by_point = [lens(numbers).project(points + s * np.eye(3)[:, None] * step) for s in (1, -1)]
    by_lens = [[lens(numbers + s * row).project(points) for row in np.eye(9) * step] for s in (1, -1)]

    found_point, found_lens = lens(numbers).derivatives(points)

    np.testing.assert_allclose(found_point, np.moveaxis(by_point[0] - by_point[1], 0, -1) / (2 * step), atol=1e-5)
    np.testing.assert_allclose(found_lens, np.moveaxis(np.subtract(*by_lens), 0, -1) / (2 * step), atol=1e-5)
