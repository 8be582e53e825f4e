"""How the pressure grows towards a corner of a rigid plan.

In a corner with the interior angle ``alpha`` it is ``r^(nu - 1) f(theta)``: far from other edges
the settlement of ``r^(nu - 1) f`` vanishes inside, and as the influence function is ``1 / r``, for
all theta0 in the corner

    int_0^alpha f(theta) P_nu(-cos(theta - theta0)) d theta = 0

with the Legendre function of degree nu, an equation for nu and f. Both are tabulated: the squared
sines of angles t with ``theta = alpha/2 (1 - cos t)`` have nearly polynomials for

    f(theta)^(-2) = alpha / 4 sin(t)^2 (1 + c1 sin(t)^2 + c2 sin(t)^4 + c3 sin(t)^6),

that is theta near the edge, and ``sin(theta)`` without a corner.

Source: J. A. Morrison and J. A. Lewis, Charge singularity at the corner of a flat plate, SIAM J.
Appl. Math. 31 (1976), for the exponents.
"""

import numpy as np
from numpy import ndarray

from ..grids.outline import Wedges
from ..kernels.compiled import compiled, inlined, inputs

#: points so much beside a corner, in radians, are in it
TOLERANCE = 0.3
#: a corner reaches so much of the way to the edge that faces it
REACH = 0.5
#: interior angle in degrees; nu; c1, c2, c3
TABLE = np.array(
    [
        (15, 0.14518031, 0.004308, 0.000007, 0.000000),
        (30, 0.18107635, 0.015832, 0.000098, 0.000000),
        (45, 0.21152311, 0.033168, 0.000429, 0.000003),
        (60, 0.24010020, 0.055221, 0.001188, 0.000014),
        (75, 0.26819448, 0.080996, 0.002548, 0.000043),
        (90, 0.29658439, 0.109483, 0.004629, 0.000106),
        (105, 0.32581928, 0.139565, 0.007461, 0.000215),
        (120, 0.35635481, 0.169905, 0.010933, 0.000379),
        (135, 0.38861358, 0.198817, 0.014748, 0.000589),
        (150, 0.42301606, 0.224064, 0.018387, 0.000812),
        (165, 0.45999569, 0.242574, 0.021120, 0.000997),
        (180, 0.50000000, 0.250006, 0.022158, 0.001075),
        (195, 0.54347249, 0.240054, 0.021201, 0.000953),
        (210, 0.59080005, 0.203361, 0.019935, 0.000306),
        (225, 0.64219762, 0.125799, 0.025735, -0.002381),
        (240, 0.69748457, -0.014020, 0.059847, -0.012998),
        (255, 0.75570768, -0.247548, 0.172692, -0.049984),
        (270, 0.81465526, -0.616883, 0.464201, -0.159315),
        (285, 0.87060865, -1.167356, 1.090635, -0.428417),
        (300, 0.91903878, -1.929697, 2.226436, -0.975271),
        (315, 0.95641098, -2.909591, 3.999550, -1.908509),
    ]
)


def exponent(angle: ndarray) -> ndarray:
    """nu, by the interior angle in radians; between 15 and 315 degrees."""
    return np.interp(np.degrees(angle), TABLE[:, 0], TABLE[:, 1])


def bends(angle: float | ndarray) -> list[ndarray]:
    """c1, c2 and c3, likewise."""
    return [np.interp(np.degrees(angle), TABLE[:, 0], column) for column in TABLE[:, 2:].T]


@inlined
def across(angle, near, c1, c2, c3):
    """``f^(-2)`` at an angle from the nearer edge."""
    square = 4 * near / angle * (1 - near / angle)
    return angle / 4 * square * (1 + square * (c1 + square * (c2 + square * c3)))


def wedge_factor(wedges: Wedges, x: ndarray, distance: ndarray) -> ndarray:
    """What corners make of the distance to the edge, so that ``phi^(-1/2)`` follows the pressure.

    Near a corner phi is ``r^(2 - 2 nu) f^(-2)``, from its reach on the distance.

    Parameters
    ----------
    wedges : Wedges
        The corners.
    x : (2, m) array of float
        Points of the plan.
    distance : (m,) array of float
        Theirs to the edge.
    """
    angle, factor = wedges.angle, np.ones(x.shape[1])
    law = np.array([angle, REACH * wedges.reach, 1 - 2 * exponent(angle), *bends(angle)])
    _multiply(*inputs(x, distance, wedges.x, wedges.bisector, law), factor)
    return factor


@compiled
def _multiply(x, distance, corners, bisectors, law, factor):
    """Multiply the factor by that of each corner at the points in its reach."""
    for k in range(corners.shape[0]):
        angle, reach, power, c1, c2, c3 = law[:, k]
        cx, cy, bx, by = corners[k, 0], corners[k, 1], bisectors[k, 0], bisectors[k, 1]
        for i in range(x.shape[1]):
            dx, dy, d = x[0, i] - cx, x[1, i] - cy, distance[i]
            if dx * dx + dy * dy > reach * reach or d <= 0.0:
                continue
            r = np.hypot(dx, dy)
            near = angle / 2 - abs(np.arctan2(bx * dy - by * dx, bx * dx + by * dy))
            if near <= -TOLERANCE:
                continue
            if near < np.pi / 2:  # sides may be curved
                near = np.arcsin(min(d / r, 1.0))
            own = across(angle, min(near, angle / 2), c1, c2, c3) * r / d
            s = r / reach
            factor[i] *= (own * s**power) ** (1 - s)
