"""Shapes of punches that are not flat: the gap to the ground before they press on each other."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy import ndarray
from numpy.typing import ArrayLike
from skfem import CellBasis

from ..arguments import (
    Pair,
    called,
    checked_array,
    checked_number,
    checked_pair,
    checked_size,
)
from ..elements.transfer import evaluate
from ..messages import apart, place, shown
from ..numeric import require_unmasked

Gap = Callable[[ndarray], ndarray] | ndarray | tuple[CellBasis, ndarray]


def gap_values(gap: Gap, x: ndarray) -> ndarray:
    """Gap at points of shape (2, n).

    Raises
    ------
    TypeError
        If ``gap`` is neither a function nor values nor a scalar field.
    ValueError
        If there is not one finite value for each point, some are masked, or a field does not
        cover the points.
    """
    if isinstance(gap, tuple):
        if len(gap) != 2 or not isinstance(gap[0], CellBasis):
            raise TypeError("expected a pair of a skfem CellBasis and its vector for gap")
        return _field_values(*gap, x)
    if isinstance(gap, type):
        raise TypeError(f"expected a function of x or numbers for gap, got {shown(gap)}")
    values = called("gap", gap, x) if callable(gap) else gap
    require_unmasked("gap", values)
    values = checked_array("gap", values, None) if isinstance(values, list) else np.asarray(values)
    if values.dtype.kind not in "iuf":
        whence = " from the function" if callable(gap) else ""
        raise TypeError(
            f"expected a function of x or numbers for gap, got {shown(values[()])}{whence}"
        )
    values = np.asarray(values, dtype=float)
    if values.shape != x.shape[1:]:
        grid = values.ndim == 2 and not callable(gap)
        remedy = ". Remedy: MeasuredProfile.from_heights for heights on a grid" if grid else ""
        raise ValueError(
            f"expected a gap for each of the {x.shape[1]} collocation points, got shape "
            f"{values.shape}{remedy}"
        )
    if not np.isfinite(values).all():
        bad = np.nonzero(~np.isfinite(values))[0]
        raise ValueError(
            f"expected finite gaps; the first that is not: collocation point {bad[0]} at "
            f"{place(x[:, bad[0]])}"
        )
    return values


def _field_values(basis: CellBasis, vector: ndarray, x: ndarray) -> ndarray:
    """Gap at points of a field that covers them."""
    vector = checked_array("gap[1]", vector, (basis.N,), each="DOF")
    try:
        values = evaluate(basis, vector, x)
    except TypeError as error:
        raise TypeError(
            "expected a scalar field on a 2-D mesh for gap, got a basis of "
            f"{type(basis.elem).__name__} on a {type(basis.mesh).__name__}"
        ) from error
    if np.isnan(values).any():
        bad = np.nonzero(np.isnan(values))[0]
        raise ValueError(
            "expected a field that covers the plan for gap; the first collocation point outside "
            f"its mesh is {bad[0]} at {place(x[:, bad[0]])}, {len(bad)} in all. Remedy: a mesh of "
            "the whole plan"
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
        Radius R.
    centre : pair of float
        Where its axis meets the ground.

    Raises
    ------
    TypeError, ValueError
        If the radius is not positive, or something is no number.
    """

    radius: float
    centre: Pair = (0.0, 0.0)

    def __post_init__(self) -> None:
        object.__setattr__(self, "radius", checked_size("radius", self.radius))
        object.__setattr__(self, "centre", checked_pair("centre", self.centre))

    def __call__(self, x: ArrayLike) -> ndarray:
        """Gap at points of shape (2, ...).

        Raises
        ------
        TypeError, ValueError
            If they are none, or not finite.
        """
        return _distance(x, self.centre) ** 2 / (2 * self.radius)


@dataclass(frozen=True)
class Sphere(Paraboloid):
    """``R - sqrt(R^2 - r^2)``: a sphere of radius R; parameters and errors as `Paraboloid`."""

    def __call__(self, x: ArrayLike) -> ndarray:
        """Gap at points of shape (2, ...), none farther from the axis than the radius.

        Raises
        ------
        TypeError, ValueError
            If one is; if they are no points, or not finite.
        """
        r = _distance(x, self.centre)
        if (far := np.max(r, initial=0.0)) > self.radius:
            radius, got = apart(self.radius, far)
            raise ValueError(
                f"expected a plan within the radius {radius} of the sphere, got points at "
                f"{got} from its axis. Remedy: Paraboloid, or a smaller plan"
            )
        # on plans far smaller than the radius a difference of both would have no digits
        return r**2 / (self.radius + np.sqrt((self.radius - r) * (self.radius + r)))


@dataclass(frozen=True)
class Cone:
    """``r tan(angle)``: a cone.

    Parameters
    ----------
    angle : float
        At which its flanks rise from the ground, in radians, below pi / 2.
    centre : pair of float
        Where its axis meets the ground.

    Raises
    ------
    TypeError, ValueError
        If the angle is not between 0 and pi / 2, or something is no number.
    """

    angle: float
    centre: Pair = (0.0, 0.0)

    def __post_init__(self) -> None:
        angle = checked_number("angle", self.angle, above=0, below=np.pi / 2)
        object.__setattr__(self, "angle", angle)
        object.__setattr__(self, "centre", checked_pair("centre", self.centre))

    def __call__(self, x: ArrayLike) -> ndarray:
        """Gap at points of shape (2, ...).

        Raises
        ------
        TypeError, ValueError
            If they are none, or not finite.
        """
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

    Raises
    ------
    TypeError, ValueError
        If a radius is not positive, or something is no number.
    """

    flat: float
    rounding: float
    centre: Pair = (0.0, 0.0)

    def __post_init__(self) -> None:
        object.__setattr__(self, "flat", checked_size("flat", self.flat))
        object.__setattr__(self, "rounding", checked_size("rounding", self.rounding))
        object.__setattr__(self, "centre", checked_pair("centre", self.centre))

    def __call__(self, x: ArrayLike) -> ndarray:
        """Gap at points of shape (2, ...).

        Raises
        ------
        TypeError, ValueError
            If they are none, or not finite.
        """
        return (_distance(x, self.centre) - self.flat).clip(0) ** 2 / (2 * self.rounding)
