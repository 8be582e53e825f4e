"""Exact solutions for the homogeneous half-space, pure functions of numbers.

Compression and settlement are positive, ``young`` and ``poisson`` are those of the half-space.
Numbers out of their range raise a ValueError, what is no number a TypeError.
Sources: K. L. Johnson, Contact Mechanics (1985), sections 3.4-3.5, 4.2 (Hertz) and 5.2 (cone);
Gladwell, Contact Problems in the Classical Theory of Elasticity (1980).
"""

from typing import Any, TypeVar

import numpy as np
from numpy import ndarray
from numpy.typing import ArrayLike
from scipy.special import ellipe, ellipkm1, hyp2f1

from ..arguments import checked_array, checked_number, checked_pair, checked_size

#: one number, or many
_Numbers = TypeVar("_Numbers", float, ndarray)


def contact_modulus(young: float, poisson: float) -> float:
    """E* = E / (1 - nu^2).

    Parameters
    ----------
    young, poisson : float
        Moduli of the half-space: E above 0, nu from 0 to 1/2.

    Returns
    -------
    float
        In the unit of ``young``.

    Raises
    ------
    TypeError, ValueError
        If something is no number, or out of its range.
    """
    young = checked_size("young", young)
    return young / (1 - checked_number("poisson", poisson, at_least=0, at_most=0.5) ** 2)


def circle_settlement(force: _Numbers, radius: float, young: float, poisson: float) -> _Numbers:
    """Settlement of a rigid flat circle under a central force, P / (2 a E*).

    Parameters
    ----------
    force : float, or array of float
        P, positive into the ground.
    radius : float
        a, positive.
    young, poisson : float
        Moduli of the half-space: E above 0, nu from 0 to 1/2.

    Returns
    -------
    float, or array of the shape of ``force``
        Positive into the ground.

    Raises
    ------
    TypeError, ValueError
        If something is no number, or out of its range.

    Examples
    --------
    >>> circle_settlement(1.0, 1.0, young=1.0, poisson=0.0)
    0.5
    """
    force, radius = _numbers("force", force), checked_size("radius", radius)
    return force / (2 * radius * contact_modulus(young, poisson))


def circle_tilt(moment: _Numbers, radius: float, young: float, poisson: float) -> _Numbers:
    """Tilt of a rigid flat circle in full contact under a moment, 3 M / (4 a^3 E*).

    Parameters
    ----------
    moment : float, or array of float
        M, the integral of ``p x``; over that of ``p y`` the tilt is Ly.
    radius : float
        a, positive.
    young, poisson : float
        Moduli of the half-space: E above 0, nu from 0 to 1/2.

    Returns
    -------
    float, or array of the shape of ``moment``
        Lx: the circle settles by ``Lx x``.

    Raises
    ------
    TypeError, ValueError
        If something is no number, or out of its range.
    """
    moment, radius = _numbers("moment", moment), checked_size("radius", radius)
    return 3 * moment / (4 * radius**3 * contact_modulus(young, poisson))


def circle_pressure(
    x: ArrayLike, force: float, radius: float, moments: tuple[float, float] = (0.0, 0.0)
) -> ndarray:
    """Pressure under a rigid flat circle around the origin.

    Parameters
    ----------
    x : (2, ...) array of float
        Points; outside the circle the pressure is zero, on its edge infinite.
    force : float
        Resultant of the pressure.
    radius : float
        Radius a of the circle.
    moments : pair of float
        First moments of the pressure, its integrals times x and times y.

    Returns
    -------
    (...) array of float
        Compression positive. Of moments that would lift the circle off, tension too: minus
        infinity on a part of the edge, NaN in its points between.

    Raises
    ------
    TypeError, ValueError
        If something is no number, or out of its range.
    """
    x = _places(x)
    force, radius = checked_number("force", force), checked_size("radius", radius)
    moments = checked_pair("moments", moments)
    d2 = radius**2 - x[0] ** 2 - x[1] ** 2
    lever = 3 * (moments[0] * x[0] + moments[1] * x[1]) / radius**2
    with np.errstate(divide="ignore", invalid="ignore"):
        p = (force + lever) / (2 * np.pi * radius * np.sqrt(d2))
    return np.where(d2 < 0, 0.0, p)


def ellipse_settlement(
    force: float, semiaxes: tuple[float, float], young: float, poisson: float
) -> float:
    """Settlement of a rigid flat ellipse under a central force, P K(m) / (pi E* a).

    Parameters
    ----------
    force : float
        P, positive into the ground.
    semiaxes : pair of float
        In either order; a is the longer, b the shorter one, ``m = 1 - (b / a)^2``.
    young, poisson : float
        Moduli of the half-space: E above 0, nu from 0 to 1/2.

    Returns
    -------
    float
        Positive into the ground.

    Raises
    ------
    TypeError, ValueError
        If something is no number, or out of its range.
    """
    force = checked_number("force", force)
    b, a = sorted(_semiaxes(semiaxes))
    modulus = contact_modulus(young, poisson)
    return float(force * ellipkm1((b / a) ** 2) / (np.pi * modulus * a))


def ellipse_pressure(x: ArrayLike, force: float, semiaxes: tuple[float, float]) -> ndarray:
    """Pressure under a rigid flat ellipse with its axes along x and y, central force.

    Parameters
    ----------
    x : (2, ...) array of float
        Points from the centre; outside the ellipse the pressure is zero, on its edge infinite.
    force : float
        Resultant of the pressure.
    semiaxes : pair of float
        Along x and along y.

    Returns
    -------
    (...) array of float
        Compression positive.

    Raises
    ------
    TypeError, ValueError
        If something is no number, or out of its range.
    """
    x, force, semiaxes = _places(x), checked_number("force", force), _semiaxes(semiaxes)
    d2 = 1 - (x[0] / semiaxes[0]) ** 2 - (x[1] / semiaxes[1]) ** 2
    with np.errstate(divide="ignore", invalid="ignore"):
        p = force / (2 * np.pi * semiaxes[0] * semiaxes[1] * np.sqrt(d2))
    return np.where(d2 < 0, 0.0, p)


def hertz_radius(force: float, radius: float, young: float, poisson: float) -> float:
    """Contact radius of a sphere, a^3 = 3 P R / (4 E*).

    Parameters
    ----------
    force : float
        P, into the ground, not negative.
    radius : float
        R of the sphere, positive.
    young, poisson : float
        Moduli of the half-space: E above 0, nu from 0 to 1/2.

    Returns
    -------
    float
        a.

    Raises
    ------
    TypeError, ValueError
        If something is no number, or out of its range.

    Examples
    --------
    >>> hertz_radius(4 / 3, 1.0, young=1.0, poisson=0.0)
    1.0
    """
    force = checked_number("force", force, at_least=0)
    radius = checked_size("radius", radius)
    return float(np.cbrt(3 * force * radius / (4 * contact_modulus(young, poisson))))


def hertz_approach(force: float, radius: float, young: float, poisson: float) -> float:
    """Settlement of a sphere, a^2 / R.

    Parameters
    ----------
    force, radius, young, poisson : float
        As of `hertz_radius`.

    Returns
    -------
    float
        Positive into the ground.

    Raises
    ------
    TypeError, ValueError
        If something is no number, or out of its range.
    """
    return hertz_radius(force, radius, young, poisson) ** 2 / radius


def hertz_pressure(
    x: ArrayLike, force: float, radius: float, young: float, poisson: float
) -> ndarray:
    """Pressure under a sphere whose lowest point is the origin.

    Parameters
    ----------
    x : (2, ...) array of float
        Points; outside the contact the pressure is zero.
    force : float
        P, positive.
    radius, young, poisson : float
        As of `hertz_radius`.

    Returns
    -------
    (...) array of float
        Compression positive.

    Raises
    ------
    TypeError, ValueError
        If something is no number, or out of its range.
    """
    x, force = _places(x), checked_number("force", force, above=0)
    a = hertz_radius(force, radius, young, poisson)
    r2 = np.sum(x**2, axis=0)
    return 3 * force / (2 * np.pi * a**2) * np.sqrt((1 - r2 / a**2).clip(0))


def cone_radius(force: float, angle: float, young: float, poisson: float) -> float:
    """Contact radius of a cone whose flanks rise at ``angle``, P = pi a^2 E* tan(angle) / 2.

    Parameters
    ----------
    force : float
        P, into the ground, not negative.
    angle : float
        Between flanks and ground, in radians, between 0 and pi / 2.
    young, poisson : float
        Moduli of the half-space: E above 0, nu from 0 to 1/2.

    Returns
    -------
    float
        a.

    Raises
    ------
    TypeError, ValueError
        If something is no number, or out of its range.
    """
    force = checked_number("force", force, at_least=0)
    angle = checked_number("angle", angle, above=0, below=np.pi / 2)
    return float(np.sqrt(2 * force / (np.pi * contact_modulus(young, poisson) * np.tan(angle))))


def cone_approach(force: float, angle: float, young: float, poisson: float) -> float:
    """Settlement of a cone, pi a tan(angle) / 2.

    Parameters
    ----------
    force, angle, young, poisson : float
        As of `cone_radius`.

    Returns
    -------
    float
        Positive into the ground.

    Raises
    ------
    TypeError, ValueError
        If something is no number, or out of its range.
    """
    radius = cone_radius(force, angle, young, poisson)
    return float(np.pi / 2 * np.tan(angle) * radius)


def cone_pressure(
    x: ArrayLike, force: float, angle: float, young: float, poisson: float
) -> ndarray:
    """Pressure under a cone whose tip is the origin.

    Parameters
    ----------
    x : (2, ...) array of float
        Points; outside the contact the pressure is zero, in the tip infinite.
    force, angle, young, poisson : float
        As of `cone_radius`.

    Returns
    -------
    (...) array of float
        Compression positive.

    Raises
    ------
    TypeError, ValueError
        If something is no number, or out of its range.
    """
    force = checked_number("force", force, above=0)
    x, a = _places(x), cone_radius(force, angle, young, poisson)
    r = np.sqrt(np.sum(x**2, axis=0))
    with np.errstate(divide="ignore"):
        ratio = np.arccosh((a / r).clip(1))
    return contact_modulus(young, poisson) * np.tan(angle) / 2 * ratio


def uniform_circle_displacement(
    r: ArrayLike, pressure: float, radius: float, young: float, poisson: float
) -> ndarray:
    """Settlement at distance ``r`` from the centre of a uniformly loaded circle.

    Parameters
    ----------
    r : (...) array of float
        Distances along the surface, inside the circle or beyond; signs do not count.
    pressure : float
        Positive into the ground.
    radius : float
        Of the circle, positive.
    young, poisson : float
        Moduli of the half-space: E above 0, nu from 0 to 1/2.

    Returns
    -------
    (...) array of float
        Positive into the ground.

    Raises
    ------
    TypeError, ValueError
        If something is no number, or out of its range.

    Examples
    --------
    >>> float(uniform_circle_displacement(0.0, 1.0, 1.0, young=1.0, poisson=0.0))
    2.0
    """
    pressure = checked_number("pressure", pressure)
    radius = checked_size("radius", radius)
    s = np.abs(checked_array("r", r, None)) / radius
    inside, outside = np.minimum(s, 1.0), np.maximum(s, 1.0)
    # E(m) - (1 - m) K(m), of which far away all digits would cancel
    beyond = np.pi / 4 * hyp2f1(0.5, 0.5, 2.0, 1 / outside**2) / outside
    w = np.where(s <= 1, ellipe(inside**2), beyond)
    return 4 * pressure * radius / (np.pi * contact_modulus(young, poisson)) * w


def _numbers(name: str, value: Any) -> Any:
    """A number, or an array of them."""
    if isinstance(value, (list, tuple, ndarray)):
        return checked_array(name, value, None)
    return checked_number(name, value)


def _places(x: ArrayLike) -> ndarray:
    return checked_array("x", x, (2, "..."), each="point")


def _semiaxes(value: tuple[float, float]) -> tuple[float, float]:
    one, other = checked_pair("semiaxes", value)
    return checked_size("semiaxes[0]", one), checked_size("semiaxes[1]", other)
