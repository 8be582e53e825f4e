"""Compliance of stratified half-spaces by wave number, and its inversion to tables over r.

With z down, wave number k and the surface modulus E0, the compliance Q = k E0 P of everything
below a depth, ``(u, w) = -P (t, s)``, obeys a Riccati equation that contracts upwards:

    Q' = k [A Q + Q A^T - (E0/E) D + (E/E0) Q B Q],  A = [[0, 1], [-nu/(1-nu), 0]],
    D = diag(2(1+nu), (1+nu)(1-2nu)/(1-nu)),  B = diag(1/(1-nu^2), 0).

It has no derivative of E, is regular at nu = 1/2, and Q is continuous across interfaces.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy import ndarray
from scipy.integrate import solve_ivp
from scipy.special import erfc, gamma, j0, kv

from ..errors import ConvergenceError

#: depth over 1/k from which on a compliance has forgotten what lies below
FORGOTTEN = 24.0
#: Chebyshev nodes of the symbol in an octave of k, and of tables in a panel of ln r
NODES, DEGREE = 20, 7
#: tables reach from the first to the last of these times the least and the greatest length
NEAREST, FARTHEST = 1e-8, 1e6
#: wave numbers up to this over r count; beyond, the smooth symbol is cut off smoothly
CUTOFF = 150.0


def homogeneous(ratio, poisson) -> ndarray:
    """Q11, Q12, Q22 of a homogeneous half-space with E = ratio E0; shape (3, ...)."""
    ratio, nu = np.broadcast_arrays(np.asarray(ratio, float), poisson)
    normal = 2 * (1 - nu**2) / ratio
    return np.stack([normal, -(1 + nu) * (1 - 2 * nu) / ratio, normal])


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
) -> ndarray:
    """Q on top of a homogeneous layer of thickness ``depth / k``, exact; shape (3, n).

    The linear system behind the Riccati equation has the matrix M with (M^2 - 1)^2 = 0, so its
    exponential is closed; scaled by exp(-depth) it cannot overflow.
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
    q = top[:, 2:] @ np.linalg.inv(top[:, :2])
    return np.stack([q[:, 0, 0], (q[:, 0, 1] + q[:, 1, 0]) / 2, q[:, 1, 1]])


def through_graded(
    q: ndarray, k: ndarray, top, bottom: ndarray, moduli: Callable[[ndarray], tuple]
) -> ndarray:
    """Q at depth ``top`` from Q at the depths ``bottom``, one for each wave number.

    ``moduli(z)`` gives E/E0 and nu.
    """
    n, height = len(k), bottom - top

    def rate(s, flat):
        a, b, c = flat.reshape(3, n)
        ratio, nu = moduli(bottom - s * height)
        m = nu / (1 - nu)
        f = ratio / (1 - nu**2)
        dz = np.stack(
            [
                2 * b - 2 * (1 + nu) / ratio + f * a * a,
                c - m * a + f * a * b,
                -2 * m * b - (1 + nu) * (1 - 2 * nu) / (1 - nu) / ratio + f * b * b,
            ]
        )
        return (-k * height * dz).ravel()

    found = solve_ivp(rate, (0.0, 1.0), q.ravel(), "DOP853", rtol=1e-11, atol=1e-13)
    if not found.success:
        raise ConvergenceError(f"the compliance could not be integrated: {found.message}")
    return found.y[:, -1].reshape(3, n)


@dataclass(frozen=True, eq=False)
class RadialTable:
    """What the influence function has beyond c/r: omega_rem(r), and the integral of it times r.

    Piecewise polynomials in ln r; ``omega`` and ``primitive_over_r`` have the coefficients of
    the powers of t in [-1, 1], shape (panels, DEGREE + 1).

    Attributes
    ----------
    start : float
        Logarithm of the smallest distance.
    width : float
        Width of a panel of ln r.
    omega, primitive_over_r : (panels, DEGREE + 1) array of float
        Coefficients.
    error : float
        Estimated error of omega times r, relative to c.
    """

    start: float
    width: float
    omega: ndarray
    primitive_over_r: ndarray
    error: float

    @property
    def nearest(self) -> float:
        """Smallest distance of the table; below, the primitive is what it is there."""
        return float(np.exp(self.start))

    @property
    def farthest(self) -> float:
        """Largest distance of the table."""
        return float(np.exp(self.start + self.width * len(self.omega)))

    def evaluate(self, coefficients: ndarray, r) -> ndarray:
        """A table at distances ``r``.

        Raises
        ------
        ValueError
            If a distance lies beyond the table.
        """
        r = np.asarray(r, dtype=float)
        if np.any(far := ~(r <= self.farthest * (1 + 1e-12))):
            raise ValueError(
                f"expected distances up to {self.farthest:.6g}, the range of the substrate's "
                f"table, got {r[far].max():.6g}. Remedy: the plan is too large for the "
                "thinnest length of this ground; take the deep ground alone"
            )
        s = (np.log(np.maximum(r, self.nearest)) - self.start) / self.width
        panel = np.clip(s.astype(int), 0, len(coefficients) - 1)
        t = 2 * (s - panel) - 1
        out = np.zeros_like(t)
        for power in range(DEGREE, -1, -1):
            out = out * t + coefficients[panel, power]
        return out


def build_table(
    symbol: Callable[[ndarray], ndarray], lengths: tuple[float, float], algebraic: bool
) -> RadialTable:
    """Invert ``F(k) = k E0 Omega - c0`` to omega_rem E0 and its primitive.

    Parameters
    ----------
    symbol : callable
        F at wave numbers.
    lengths : pair of float
        The least and the greatest length of the ground.
    algebraic : bool
        Whether F decays like powers of 1/k, as above a gradient, and not exponentially.
    """
    least, greatest = lengths
    low, high = 1e-3 / (FARTHEST * greatest), 100 / least
    octaves = int(np.ceil(np.log2(high / low)))
    edges = low * 2.0 ** np.arange(octaves + 1)
    x = np.cos(np.pi * (np.arange(NODES) + 0.5) / NODES)
    k = (edges[:-1, None] + edges[1:, None]) / 2 + np.diff(edges)[:, None] / 2 * x
    f = symbol(k.ravel()).reshape(k.shape)
    # the tail by functions with closed transforms
    b, powers = 3 / least, np.arange(6) if algebraic else np.empty(0, int)
    terms = [k * (k**2 + b**2) ** (-1 - m / 2) for m in powers]
    weights = np.zeros(len(powers))
    if algebraic:
        tail = k > 10 / least
        scale = k[tail]
        matrix = np.stack([t[tail] * scale for t in terms], axis=1)
        norm = np.abs(matrix).max(axis=0)
        weights = np.linalg.lstsq(matrix / norm, f[tail] * scale, rcond=None)[0] / norm
        f = f - sum(w * t for w, t in zip(weights, terms, strict=True))
    coefficients = np.polynomial.chebyshev.chebvander(x, NODES - 1)
    coefficients = np.linalg.solve(coefficients, f.T).T
    size = np.abs(f).max()
    here = np.nonzero(np.abs(f).max(axis=1) > 1e-14 * max(size, 1e-300))[0]
    last = edges[here[-1] + 1] if len(here) else edges[1]

    gauss, gauss_weights = np.polynomial.legendre.leggauss(12)

    def rest(r: ndarray) -> ndarray:
        """Integrals of what is left of F times J0(k r), for distances of one panel."""
        # far waves cancel each other: a smooth cut leaves an error below any power of 1 / CUTOFF
        cut = CUTOFF / r[:, None]
        ends = edges[: np.searchsorted(edges, min(last, 2 * cut.max())) + 1]
        pieces = np.ceil(np.diff(ends) * r.max() / np.pi).astype(int)
        octave = np.repeat(np.arange(len(pieces)), pieces)
        step = (np.diff(ends) / pieces)[octave]
        position = np.arange(len(octave)) - np.repeat(np.cumsum(pieces) - pieces, pieces)
        begin = ends[octave] + position * step
        q = begin[:, None] + step[:, None] * (gauss + 1) / 2
        t = 2 * (q - ends[octave][:, None]) / np.diff(ends)[octave][:, None] - 1
        values = _clenshaw(coefficients[octave], t) * gauss_weights * step[:, None] / 2
        q, values = q.ravel(), values.ravel()
        waves = j0(q * r[:, None]) * erfc(6 * (q / cut - 1.5)) / 2
        return waves @ values + ends[0] * coefficients[0] @ (-1.0) ** np.arange(NODES)

    width = np.log(2) / 3
    start = np.log(NEAREST * least)
    panels = int(np.ceil((np.log(FARTHEST * greatest) - start) / width))
    nodes = np.cos(np.pi * (np.arange(DEGREE + 1) + 0.5) / (DEGREE + 1))
    r = np.exp(start + width * (np.arange(panels)[:, None] + (nodes + 1) / 2))
    flat = r.ravel()
    omega = np.concatenate([rest(panel) for panel in r])
    for w, m in zip(weights, powers, strict=True):
        omega += w * (flat / (2 * b)) ** (m / 2) * kv(m / 2, b * flat) / gamma(1 + m / 2)
    omega = (omega / (2 * np.pi)).reshape(r.shape)
    omega_powers = np.linalg.solve(np.vander(nodes, increasing=True), omega.T).T
    # the primitive panel by panel; below the first it is half of omega r^2, up to a logarithm
    t, wt = np.polynomial.legendre.leggauss(12)
    phi_nodes = np.empty_like(r)
    total = omega[0, -1] * np.exp(2 * start) / 2
    for i in range(panels):
        left = start + i * width
        for j, node in enumerate(nodes):
            phi_nodes[i, j] = total + _integral(omega_powers[i], left, width, -1, node, t, wt)
        total += _integral(omega_powers[i], left, width, -1, 1, t, wt)
    over_r = np.linalg.solve(np.vander(nodes, increasing=True), (phi_nodes / r).T).T
    # the last coefficients tell what a higher degree would add
    error = float(np.max(np.abs(omega_powers[:, -1]) / 2**DEGREE * r[:, 0]))
    return RadialTable(float(start), float(width), omega_powers, over_r, error)


def _clenshaw(coefficients: ndarray, t: ndarray) -> ndarray:
    """Chebyshev series, one for each row of ``t``."""
    b1 = b2 = np.zeros_like(t)
    for c in coefficients.T[:0:-1]:
        b1, b2 = c[:, None] + 2 * t * b1 - b2, b1
    return coefficients[:, :1] + t * b1 - b2


def _integral(powers, left, width, begin, end, t, weights) -> float:
    """Integral of omega r over a part of a panel of ln r."""
    s = begin + (end - begin) * (t + 1) / 2
    r = np.exp(left + width * (s + 1) / 2)
    values = np.polynomial.polynomial.polyval(s, powers)
    return float(np.sum(weights * values * r * r) * width / 2 * (end - begin) / 2)
