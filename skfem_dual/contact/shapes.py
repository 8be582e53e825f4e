"""Shapes of punches that are not flat: the gap to the ground before they press on each other."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy import ndarray
from numpy.typing import ArrayLike
from scipy.interpolate import LinearNDInterpolator
from skfem import CellBasis

from ..arguments import Pair, checked_array, checked_number, checked_pair, checked_size
from ..grids.polygons import readonly
from ..messages import shown

Gap = Callable[[ndarray], ndarray] | ndarray | tuple[CellBasis, ndarray]


def gap_values(gap: Gap, x: ndarray) -> ndarray:
    """Gap at points of shape (2, n).

    Raises
    ------
    TypeError
        If ``gap`` is neither a function nor values nor a field.
    ValueError
        If there is not one finite value for each point.
    """
    if isinstance(gap, tuple):
        if len(gap) != 2 or not isinstance(gap[0], CellBasis):
            raise TypeError("expected a pair of a skfem CellBasis and its vector for gap")
        basis, vector = gap
        gap = basis.interpolator(checked_array("gap[1]", vector, (basis.N,), each="DOF"))
    if isinstance(gap, type):
        raise TypeError(f"expected a function of x or numbers for gap, got {shown(gap)}")
    values = np.asarray(gap(x) if callable(gap) else gap)
    if values.dtype.kind not in "iuf":
        raise TypeError(f"expected a function of x or numbers for gap, got {shown(gap)}")
    values = np.asarray(values, dtype=float)
    if values.shape != x.shape[1:]:
        raise ValueError(
            f"expected a gap for each of the {x.shape[1]} collocation points, got shape "
            f"{values.shape}"
        )
    if not np.isfinite(values).all():
        bad = np.nonzero(~np.isfinite(values))[0]
        raise ValueError(
            f"expected finite gaps; the first that is not: collocation point {bad[0]} at "
            f"({x[0, bad[0]]:.6g}, {x[1, bad[0]]:.6g})"
        )
    return values


def _distance(x: ArrayLike, centre: Pair) -> ndarray:
    x = checked_array("x", x, (2, "..."), each="point")
    return np.hypot(x[0] - centre[0], x[1] - centre[1])


@dataclass(frozen=True)
class Paraboloid:
    """``r^2 / (2 R)``: a sphere of radius R near its lowest point (Hertz).

    Parameters
    ----------
    radius : float
        R.
    centre : pair of float
        Where its axis meets the ground.
    """

    radius: float
    centre: Pair = (0.0, 0.0)

    def __post_init__(self) -> None:
        object.__setattr__(self, "radius", checked_size("radius", self.radius))
        object.__setattr__(self, "centre", checked_pair("centre", self.centre))

    def __call__(self, x: ArrayLike) -> ndarray:
        """Gap at points of shape (2, ...)."""
        return _distance(x, self.centre) ** 2 / (2 * self.radius)


@dataclass(frozen=True)
class Sphere(Paraboloid):
    """``R - sqrt(R^2 - r^2)``: a sphere of radius R; parameters as `Paraboloid`."""

    def __call__(self, x: ArrayLike) -> ndarray:
        """Gap at points of shape (2, ...), none farther from the axis than the radius."""
        r = _distance(x, self.centre)
        if (far := np.max(r, initial=0.0)) > self.radius:
            raise ValueError(
                f"expected a plan within the radius {self.radius:g} of the sphere, got points at "
                f"{far:.6g} from its axis. Remedy: Paraboloid, or a smaller plan"
            )
        return self.radius - np.sqrt(self.radius**2 - r**2)


@dataclass(frozen=True)
class Cone:
    """``r tan(angle)``: a cone.

    Parameters
    ----------
    angle : float
        At which its flanks rise from the ground, in radians, below pi / 2.
    centre : pair of float
        Where its axis meets the ground.
    """

    angle: float
    centre: Pair = (0.0, 0.0)

    def __post_init__(self) -> None:
        object.__setattr__(self, "angle", checked_number("angle", self.angle, above=0))
        object.__setattr__(self, "centre", checked_pair("centre", self.centre))
        if self.angle >= np.pi / 2:
            raise ValueError(f"expected an angle below pi / 2, got {self.angle:g}")

    def __call__(self, x: ArrayLike) -> ndarray:
        """Gap at points of shape (2, ...)."""
        return _distance(x, self.centre) * np.tan(self.angle)


@dataclass(frozen=True)
class RoundedCylinder:
    """``(r - b)^2 / (2 R)`` beyond the flat end of a cylinder whose edge is rounded.

    Parameters
    ----------
    flat : float
        Radius b of the flat end.
    rounding : float
        Radius R of the rounded edge.
    centre : pair of float
        Where its axis meets the ground.
    """

    flat: float
    rounding: float
    centre: Pair = (0.0, 0.0)

    def __post_init__(self) -> None:
        object.__setattr__(self, "flat", checked_size("flat", self.flat))
        object.__setattr__(self, "rounding", checked_size("rounding", self.rounding))
        object.__setattr__(self, "centre", checked_pair("centre", self.centre))

    def __call__(self, x: ArrayLike) -> ndarray:
        """Gap at points of shape (2, ...)."""
        return (_distance(x, self.centre) - self.flat).clip(0) ** 2 / (2 * self.rounding)


@dataclass(frozen=True, eq=False)
class MeasuredProfile:
    """Heights measured at scattered points, linear between them.

    Parameters
    ----------
    x : (2, m) array of float
        The points; their convex hull must cover the plan.
    height : (m,) array of float
        Heights of the punch's surface above any level, positive away from the ground.
    """

    x: ndarray
    height: ndarray

    def __post_init__(self) -> None:
        x = checked_array("x", self.x, (2, "m"), least=3, each="point")
        height = checked_array("height", self.height, x.shape[1:], each="point")
        object.__setattr__(self, "x", readonly(x))
        object.__setattr__(self, "height", readonly(height))

    def __call__(self, x: ArrayLike) -> ndarray:
        """Gap at points of shape (2, ...)."""
        x = checked_array("x", x, (2, "..."), each="point")
        height = LinearNDInterpolator(self.x.T, self.height)(x[0], x[1])
        if np.isnan(height).any():
            bad = np.argmax(np.isnan(height))
            raise ValueError(
                f"expected points measured around the whole plan; ({x[0].flat[bad]:.6g}, "
                f"{x[1].flat[bad]:.6g}) is outside them"
            )
        return height
