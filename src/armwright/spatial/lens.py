"""What a camera makes of points: a pinhole, and the distortion of its lens.

Source:
    Brown (1971), Close-range camera calibration; with the coefficients and pixels of OpenCV: x to the right, y down,
    z forward, the centre of the first pixel at (0, 0).
"""

import attrs
import numpy as np

from armwright.arrays import Array, ArrayLike, exact_shape, floats

# Numbers of distortion: k1, k2, p1, p2, k3.
_COEFFICIENTS = 5
# Steps by which distortion is taken away, and when no more are needed.
_STEPS, _SETTLED = 50, 1e-13
# Pixels along each side of a picture by which a lens is checked, and how far from itself one may come back [px].
_GRID, _SAME_PIXEL = 33, 1e-6


def _as_pair(value: ArrayLike) -> Array:
    return exact_shape(value, (2,), "focal and centre", 1e7)


def _as_distortion(value: ArrayLike) -> Array:
    return exact_shape(value, (_COEFFICIENTS,), "distortion", 1e3)


@attrs.frozen(kw_only=True, eq=False)
class Lens:
    """A pinhole camera with a lens.

    Attributes:
        width: of its pictures [px].
        height: of its pictures [px].
        focal: (2,) focal lengths along x and y [px].
        centre: (2,) the pixel on the optical axis.
        distortion: (5,) radial k1, k2, tangential p1, p2, radial k3.
    """

    width: int
    height: int
    focal: Array = attrs.field(converter=_as_pair)
    centre: Array = attrs.field(converter=_as_pair)
    distortion: Array = attrs.field(factory=lambda: np.zeros(_COEFFICIENTS), converter=_as_distortion)

    @property
    def matrix(self) -> Array:
        """The camera matrix (3, 3)."""
        (fx, fy), (cx, cy) = self.focal, self.centre
        return np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])

    @property
    def numbers(self) -> Array:
        """The numbers of the lens (9,): focal lengths, centre, distortion."""
        return np.concatenate([self.focal, self.centre, self.distortion])

    def with_numbers(self, numbers: Array) -> "Lens":
        """Return a lens of the same pictures with other numbers (9,), as ``numbers`` has them."""
        return attrs.evolve(self, focal=numbers[:2], centre=numbers[2:4], distortion=numbers[4:])

    def project(self, points: ArrayLike) -> Array:
        """Return the pixels (..., 2) of points (..., 3) in the frame of the camera, which lie before it (z > 0)."""
        points = floats(points, "points")
        return self._distorted(points[..., :2] / points[..., 2:]) * self.focal + self.centre

    def rays(self, pixels: ArrayLike) -> Array:
        """Return the directions (..., 3) with z = 1 in which the camera sees pixels (..., 2)."""
        seen = (floats(pixels, "pixels") - self.centre) / self.focal
        flat = seen.copy()
        if self.distortion.any():
            # Newton's steps with the derivative of what the lens does.
            for _ in range(_STEPS):
                (a, b), (c, d) = np.moveaxis(self._derivative(flat), (-2, -1), (0, 1))
                x, y = np.moveaxis(seen - self._distorted(flat), -1, 0)
                step = np.stack([d * x - b * y, a * y - c * x], axis=-1) / (a * d - b * c)[..., None]
                flat = flat + step
                if np.abs(step).max(initial=0.0) < _SETTLED:
                    break
        return np.concatenate([flat, np.ones((*flat.shape[:-1], 1))], axis=-1)

    def field(self) -> Array:
        """Return the least and the largest x and y, (2, 2), of the directions with z = 1 that its pictures show."""
        x, y = np.arange(self.width + 1) - 0.5, np.arange(self.height + 1) - 0.5
        rim = [np.stack(np.broadcast_arrays(x, edge), axis=-1) for edge in (y[0], y[-1])]
        rim += [np.stack(np.broadcast_arrays(edge, y), axis=-1) for edge in (x[0], x[-1])]
        seen = self.rays(np.concatenate(rim))[:, :2]
        return np.array([seen.min(axis=0), seen.max(axis=0)])

    def is_invertible(self) -> bool:
        """Whether every pixel of its pictures shows one direction; a lens that distorts much can fold the picture."""
        x, y = (np.linspace(-0.5, size - 0.5, _GRID) for size in (self.width, self.height))
        pixels = np.stack(np.meshgrid(x, y), axis=-1)
        with np.errstate(all="ignore"):
            rays = self.rays(pixels)
            back = np.abs(self.project(rays) - pixels).max() if np.isfinite(rays).all() else np.inf
            return bool(back < _SAME_PIXEL and (np.linalg.det(self._derivative(rays[..., :2])) > 0).all())

    def derivatives(self, points: ArrayLike) -> tuple[Array, Array]:
        """Return the derivatives of the pixels of points (..., 3) in the frame of the camera.

        Returns:
            By the coordinates of the point, (..., 2, 3) [px/m]; by the numbers of the lens, which are focal lengths,
            centre and distortion, (..., 2, 9).
        """
        points = floats(points, "points")
        flat, depth = points[..., :2] / points[..., 2:], points[..., 2:, None]
        slope = self.focal[:, None] * self._derivative(flat)
        by_point = np.concatenate([slope, -np.einsum("...ij,...j->...i", slope, flat)[..., None]], axis=-1) / depth
        x, y = flat[..., 0], flat[..., 1]
        r2 = x * x + y * y
        xy2, x2, y2 = 2 * x * y, r2 + 2 * x * x, r2 + 2 * y * y
        shape = np.stack(
            [
                np.stack([x * r2, x * r2**2, xy2, x2, x * r2**3], -1),
                np.stack([y * r2, y * r2**2, y2, xy2, y * r2**3], -1),
            ],
            axis=-2,
        )
        seen = self._distorted(flat)
        by_focal = seen[..., None] * np.eye(2)
        by_centre = np.broadcast_to(np.eye(2), by_focal.shape)
        return by_point, np.concatenate([by_focal, by_centre, self.focal[:, None] * shape], axis=-1)

    def _distorted(self, flat: Array) -> Array:
        """Return where points of the plane z = 1 (..., 2) are seen, in that plane."""
        k1, k2, p1, p2, k3 = self.distortion
        x, y = flat[..., 0], flat[..., 1]
        r2 = x * x + y * y
        radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
        return np.stack(
            [
                x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
                y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y,
            ],
            axis=-1,
        )

    def _derivative(self, flat: Array) -> Array:
        """Return the derivatives (..., 2, 2) of the distorted point by the point."""
        k1, k2, p1, p2, k3 = self.distortion
        x, y = flat[..., 0], flat[..., 1]
        r2 = x * x + y * y
        radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
        slope = 2 * (k1 + r2 * (2 * k2 + r2 * 3 * k3))
        cross = x * y * slope + 2 * p1 * x + 2 * p2 * y
        return np.stack(
            [
                np.stack([radial + x * x * slope + 2 * p1 * y + 6 * p2 * x, cross], axis=-1),
                np.stack([cross, radial + y * y * slope + 6 * p1 * y + 2 * p2 * x], axis=-1),
            ],
            axis=-2,
        )


def simple_lens(width: int, height: int, fovy: float, distortion: ArrayLike = (0.0,) * _COEFFICIENTS) -> Lens:
    """Return a lens with square pixels whose axis goes through the middle of the picture.

    Args:
        width: of the picture [px].
        height: of the picture [px].
        fovy: vertical field of view without distortion [rad].
        distortion: (5,) k1, k2, p1, p2, k3.
    """
    focal = height / 2 / np.tan(fovy / 2)
    # The centre of the first pixel is at (0, 0), so the middle lies half a pixel before half the size.
    centre = (width - 1) / 2, (height - 1) / 2
    return Lens(width=width, height=height, focal=(focal, focal), centre=centre, distortion=distortion)
