"""Compliance of stratified ground by wave number.

With z down, wave number k and the surface modulus E0, the compliance Q = k E0 P of everything
below a depth, ``(u, w) = -P (t, s)``, obeys a Riccati equation that contracts upwards:

    Q' = k [A Q + Q A^T - (E0/E) D + (E/E0) Q B Q],  A = [[0, 1], [-nu/(1-nu), 0]],
    D = diag(2(1+nu), (1+nu)(1-2nu)/(1-nu)),  B = diag(1/(1-nu^2), 0).

It has no derivative of E, is regular at nu = 1/2, and Q is continuous across interfaces.

Waves of shear across their way, ``v = -R t``, are by themselves: ``S = k E0 R`` obeys

    S' = k [(E/E0) S^2 / (2(1+nu)) - 2(1+nu) E0/E].

It follows from the linear equations of the amplitudes (u, w, t, s) of displacements and tractions,
by eliminating the tractions. Sources: N. A. Haskell, The dispersion of surface waves on
multilayered media, Bull. Seism. Soc. Am. 43 (1953), and F. Gilbert and G. E. Backus, Propagator
matrices in elastic wave and vibration problems, Geophysics 31 (1966), for those equations and
their solution layer by layer; E. Kausel and J. M. Roesset, Stiffness matrices for layered soils,
Bull. Seism. Soc. Am. 71 (1981), for stiffness in place of propagators; R. Bellman and G. M. Wing,
An Introduction to Invariant Imbedding (1975), for Riccati equations of such ratios of amplitudes.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import scipy
from numpy import ndarray
from numpy.typing import ArrayLike

from ..errors import ConvergenceError

#: E/E0 and nu at depths
Moduli = Callable[[ndarray], tuple[ndarray, ndarray]]

#: depth over 1/k from which on a compliance has forgotten what lies below
FORGOTTEN = 20.0
#: tolerance of compliances at the surface
RTOL = 3e-11
#: the longest step of 1 with fewer wave numbers than so many, or over a smaller range: they would
#: pass over thin seams between moduli that hardly vary, which some of many wave numbers do not
STEP, MANY, WIDE = 1 / 512, 250, 1000.0


def homogeneous(ratio: ArrayLike, poisson: ArrayLike) -> ndarray:
    """Q11, Q12, Q22 of a homogeneous half-space with E = ratio E0; shape (3, ...)."""
    ratio, nu = np.broadcast_arrays(np.asarray(ratio, float), poisson)
    normal = 2 * (1 - nu**2) / ratio
    return np.stack([normal, -(1 + nu) * (1 - 2 * nu) / ratio, normal])


def homogeneous_across(ratio: ArrayLike, poisson: ArrayLike) -> ndarray:
    """S of a homogeneous half-space with E = ratio E0."""
    return 2 * (1 + np.asarray(poisson)) / np.asarray(ratio)


def across_homogeneous(s: ndarray, depth: ndarray, ratio: float, poisson: float) -> ndarray:
    """S on top of a homogeneous layer of thickness ``depth / k`` from S at its bottom."""
    own, tanh = homogeneous_across(ratio, poisson), np.tanh(depth)
    return own * (s + own * tanh) / (own + s * tanh)


def rigid(smooth: bool, n: int) -> tuple[ndarray, ndarray]:
    """X, Y of a rigid base, Q = Y X^-1: bonded u = w = 0, smooth t = w = 0; shape (n, 2, 2)."""
    x = np.zeros((n, 2, 2)) if smooth else np.tile(np.eye(2), (n, 1, 1))
    y = np.zeros((n, 2, 2))
    if smooth:
        x[:, 1, 0] = 1.0
        y[:, 0, 1] = 1.0
    return x, y


def as_pair(q: ndarray) -> tuple[ndarray, ndarray]:
    """X = I and Y = Q of a finite compliance."""
    y = np.moveaxis(np.stack([[q[0], q[1]], [q[1], q[2]]]), -1, 0)
    return np.tile(np.eye(2), (q.shape[1], 1, 1)), y


def through_homogeneous(
    pair: tuple[ndarray, ndarray], depth: ndarray, ratio: float, poisson: float
) -> tuple[ndarray, ndarray]:
    """Through a homogeneous layer of thickness ``depth / k``, exact.

    The linear system behind the Riccati equation has the matrix M with (M^2 - 1)^2 = 0, so its
    exponential is closed; scaled by exp(-depth) it cannot overflow.

    Parameters
    ----------
    pair : tuple of (n, 2, 2) array of float
        X and Y at the bottom.
    depth : (n,) array of float
    ratio, poisson : float
        E/E0 and nu.

    Returns
    -------
    q : (3, n) array of float
        Q on top.
    down : (n, 2, 2) array of float
        Takes the tractions on top to the multiples of the columns of X and Y at the bottom.
    """
    nu, n = poisson, poisson / (1 - poisson)
    a = np.array([[0.0, 1.0], [-n, 0.0]])
    d = np.diag([2 * (1 + nu), (1 + nu) * (1 - 2 * nu) / (1 - nu)]) / ratio
    b = np.diag([ratio / (1 - nu**2), 0.0])
    m = np.block([[-a.T, -b], [-d, a]])
    nil = m @ m - np.eye(4)
    x = depth[:, None, None]
    e = np.exp(-2 * x)
    cosh, sinh = (1 + e) / 2, -np.expm1(-2 * x) / 2
    # x cosh x - sinh x cancels for small x
    small = np.exp(-x) * x**3 / 3 * (1 + x**2 / 10 * (1 + x**2 / 28 * (1 + x**2 / 54)))
    odd = np.where(x < 0.2, small, x * cosh - sinh)
    step = cosh * np.eye(4) + x / 2 * sinh * nil - m @ (sinh * np.eye(4) + odd / 2 * nil)
    top = step @ np.concatenate(pair, axis=1)
    inverse = np.linalg.inv(top[:, :2])
    q = top[:, 2:] @ inverse
    q = np.stack([q[:, 0, 0], (q[:, 0, 1] + q[:, 1, 0]) / 2, q[:, 1, 1]])
    return q, np.exp(-x) * inverse


class WayUp(NamedTuple):
    """How depths z rise from the bottom to the surface as s goes from 0 to 1.

    So that moduli that vary over some lengths, and all waves, are passed in even steps: by as
    much of ``k z + ln(1 + z / least)`` everywhere. ``at`` is that logarithm.

    Attributes
    ----------
    k, bottom : (n,) array of float
        Wave numbers, and where each begins.
    least : float
        A length of the shortest wave.
    start : (n,) array of float
        ``at`` at the bottom.
    """

    k: ndarray
    bottom: ndarray
    least: float
    start: ndarray

    @classmethod
    def of(cls, k: ndarray, bottom: ndarray) -> "WayUp":
        """From the bottoms of all waves."""
        least = 1 / k.max()
        return cls(k, bottom, least, np.log1p(bottom / least))

    def at(self, at: ndarray) -> tuple[ndarray, ndarray, ndarray]:
        """Derivative of ``at`` by s, z, and the derivative of ``k z``."""
        reach = self.least * np.exp(at)
        climb = -(self.k * self.bottom + self.start) / (1 + self.k * reach)
        # rounding leads out of the ground
        z = np.minimum(np.maximum(reach - self.least, 0.0), self.bottom)
        return climb, z, self.k * reach * climb


@np.errstate(under="ignore")
def through_graded(
    q: ndarray, k: ndarray, bottom: ndarray, moduli: Moduli, *, down: bool = False
) -> tuple[ndarray, ndarray]:
    """Q on top from Q at the depths ``bottom`` below it, one for each wave number.

    Parameters
    ----------
    q : (3, n) array of float
    k : (n,) array of float
    bottom : (n,) array of float
    moduli : callable
    down : bool
        Whether the second array is wanted.

    Returns
    -------
    q : (3, n) array of float
    down : (n, 2, 2) array of float
        Takes the tractions on top to those at the bottom, which decay downwards; zero if not
        wanted.

    Raises
    ------
    ConvergenceError
        If the moduli vary so that the equation cannot be integrated.
    """
    if not len(k):
        return q, np.zeros((0, 2, 2))
    up = WayUp.of(k, bottom)

    def rate(_: float, flat: ndarray) -> ndarray:
        at, a, b, c, *rest = flat.reshape(-1, len(k))
        climb, z, way = up.at(at)
        ratio, nu = moduli(z)
        m = nu / (1 - nu)
        f = ratio / (1 - nu**2)
        dz = [
            2 * b - 2 * (1 + nu) / ratio + f * a * a,
            c - m * a + f * a * b,
            -2 * m * b - (1 + nu) * (1 - 2 * nu) / (1 - nu) / ratio + f * b * b,
        ]
        if rest:  # t' = -k (f Q11 t + (f Q12 - m) s), s' = -k t, of the tractions on the way
            t1, s1, t2, s2 = rest
            dz += [t1 * f * a + s1, t1 * (f * b - m), t2 * f * a + s2, t2 * (f * b - m)]
        return np.concatenate([climb, *(way * d for d in dz)])

    start = [up.start, *q]
    if down:
        start += [value * np.ones(len(k)) for value in (1.0, 0.0, 0.0, 1.0)]
    # below the surface nothing is known better than the integrals over waves
    rtol = 1e-9 if down else RTOL
    end = _integrated(rate, np.concatenate(start), k, rtol)
    out = end[len(k) :].reshape(-1, len(k))
    tractions = out[3:].T.reshape(-1, 2, 2) if down else np.zeros((len(k), 2, 2))
    return out[:3], tractions


@np.errstate(under="ignore")
def across_graded(s: ndarray, k: ndarray, bottom: ndarray, moduli: Moduli) -> ndarray:
    """S at the surface from S at the depths ``bottom``, one for each wave number.

    Raises
    ------
    ConvergenceError
        As `through_graded`.
    """

    up = WayUp.of(k, bottom)

    def rate(_: float, flat: ndarray) -> ndarray:
        at, s = flat.reshape(2, -1)
        climb, z, way = up.at(at)
        own = homogeneous_across(*moduli(z))
        return np.concatenate([climb, way * (s * s / own - own)])

    start = np.concatenate([up.start, s])
    return _integrated(rate, start, k, RTOL)[len(k) :]


def _integrated(
    rate: Callable[[float, ndarray], ndarray], start: ndarray, k: ndarray, rtol: float
) -> ndarray:
    """What a value at 0 has become at 1, for some wave numbers."""
    step = STEP if len(k) < MANY or k.max() < WIDE * k.min() else np.inf
    limits = {"rtol": rtol, "atol": rtol / 100, "max_step": step}
    path = scipy.integrate.solve_ivp(rate, (0.0, 1.0), start, "DOP853", **limits)
    if not path.success:
        raise ConvergenceError(f"the compliance could not be integrated: {path.message}")
    return path.y[:, -1]
