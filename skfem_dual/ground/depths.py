"""Influence functions of a point force below the surface, in tables over r at given depths.

The solution of the homogeneous half-space with the moduli of the surface is split off. What is
left is smooth over a length, the depth itself or, in a uniform top layer, the way to its bottom
and back; so the Hankel transforms end at a finite wave number. They are linear: one matrix takes
the amplitudes of some waves to all distances, for all depths.

Sources: D. M. Burmister, The general theory of stresses and displacements in layered systems, J.
Appl. Phys. 16 (1945); those of `hankel`.
"""

from functools import lru_cache
from typing import NamedTuple, Self

import numpy as np
from numpy import ndarray
from scipy.special import erfc, j0, j1

from ..errors import ConvergenceError
from .strata import Amplitudes, Strata
from .stratified import Stratified
from .substrates import HalfSpace
from .symbols import CUTOFF, FARTHEST, GAUSS, GAUSS_WEIGHTS, NODES

#: of tables: a panel is a part of an octave of r^2 + d^2 in which 2 to the power of BITS are
BITS, DEGREE = 2, 8
#: leading bits of their first panel
FIRST_PANEL = 1023 << BITS
#: waves count from the first over the longest distance or depth to the last over the length of
#: smoothness
FIRST, LAST = 1e-7, 40.0
#: largest error of tables, relative to a point force on homogeneous ground
TOLERANCE = 1e-6
#: what a table has
QUANTITIES = 6


class DepthTables(NamedTuple):
    """What the influence of a unit force has beyond that on the surface's half-space.

    At some depths, over the squares of distances: sigma_z, the sum of sigma_r and sigma_theta,
    their difference over r^2, tau_rz over r, u_z and u_r over r; stresses are compression
    positive.

    Attributes
    ----------
    depths : (ndepths,) array of float
        Ascending.
    coefficients : (ndepths, panels, DEGREE + 1, QUANTITIES) array of float
        Of the powers of t in [-1, 1] in each panel of r^2 + d^2.
    d : float
        Length over which all are smooth.
    error : float
        Estimated, relative to what a force does at the distance d on homogeneous ground.
    """

    depths: ndarray
    coefficients: ndarray
    d: float
    error: float

    @classmethod
    def from_ground(cls, ground: Stratified, depths: ndarray, farthest: float) -> Self:
        """Tables up to the distance ``farthest`` at depths that ascend.

        Raises
        ------
        ValueError
            If points lie beyond a million times the greatest length of the ground.
        ConvergenceError
            If the tables are not good, or the moduli vary so that amplitudes are not found.
        """
        strata, surface = ground.strata, ground.surface
        d = float(smoothness(strata, depths).min())
        longest, limit = max(farthest, float(depths[-1])), FARTHEST * ground.lengths[1]
        if not longest <= limit:
            raise ValueError(
                f"expected distances and depths up to {limit:.6g}, got {longest:.6g}. Remedy: "
                "the deep ground alone has that answer"
            )
        nodes = _waves(d, longest)
        panels = int(np.ceil(np.log2(1 + (farthest / d) ** 2) + 0.1)) << BITS
        symbols = _symbols(strata, surface, nodes.k, depths)
        edges = ((np.arange(panels + 1) + FIRST_PANEL) << (52 - BITS)).view(np.float64)
        x = _nodes(DEGREE + 1)
        v = edges[:-1, None] + np.diff(edges)[:, None] * (x + 1) / 2
        values = np.empty((panels, DEGREE + 1, QUANTITIES, len(depths)))
        for panel, r in enumerate(d * np.sqrt(v - 1)):
            values[panel] = _transforms(nodes, symbols, r)
        powers = np.linalg.solve(
            np.vander(x, increasing=True), np.moveaxis(values, 1, 0).reshape(DEGREE + 1, -1)
        ).reshape(DEGREE + 1, panels, QUANTITIES, len(depths))
        coefficients = np.ascontiguousarray(powers.transpose(3, 1, 0, 2)) / (2 * np.pi)
        error = _error(coefficients, symbols, d, surface)
        if not error < TOLERANCE:
            raise ConvergenceError(
                f"expected influence functions at depth {depths[0]:.6g} and below to "
                f"{TOLERANCE:g}, got an estimated error of {error:.2g}. Remedy: a profile of "
                "moduli without steps and noise; for steps layers"
            )
        return cls(depths, coefficients, d, error)


def smoothness(strata: Strata, depths: ndarray) -> ndarray:
    """Lengths over which the tables at some depths vary."""
    top = strata.layers[0]
    if not top.uniform:
        return depths
    return np.where(depths < top.thickness, 2 * top.thickness - depths, depths)


class _Waves(NamedTuple):
    """Wave numbers: the Chebyshev nodes of octaves."""

    edges: ndarray
    k: ndarray

    @property
    def octaves(self) -> int:
        return len(self.edges) - 1


def _waves(d: float, longest: float) -> _Waves:
    high = LAST / d
    octaves = int(np.ceil(np.log2(high * longest / FIRST)))
    edges = high * 2.0 ** np.arange(-octaves, 1)
    k = edges[:-1, None] + np.diff(edges)[:, None] * (_nodes(NODES) + 1) / 2
    return _Waves(edges, k.ravel())


def _symbols(strata: Strata, surface: HalfSpace, k: ndarray, depths: ndarray) -> ndarray:
    """Amplitudes of the quantities of tables, shape (QUANTITIES, ndepths, nwaves)."""
    ratio, nu = (m[:, None] for m in strata.moduli(depths))
    there = _quantities(strata.amplitudes(k, depths), k, ratio, nu)
    nu0 = np.full_like(nu, surface.poisson)
    alone = _quantities(uniform_amplitudes(k, depths, surface.poisson), k, np.ones_like(nu), nu0)
    rest = there - alone
    rest[4:] /= surface.young
    return rest


def uniform_amplitudes(k: ndarray, depths: ndarray, poisson: float) -> Amplitudes:
    """Of the homogeneous half-space, closed.

    Source: I. N. Sneddon, Fourier Transforms (1951), section 52.
    """
    x = k * depths[:, None]
    e = np.exp(-x)
    u = -(1 + poisson) * (1 - 2 * poisson - x) * e
    return Amplitudes(-x * e, -(1 + x) * e, u, (1 + poisson) * (2 * (1 - poisson) + x) * e)


def _quantities(a: Amplitudes, k: ndarray, ratio: ndarray, nu: ndarray) -> ndarray:
    """Of `DepthTables`, by Hooke's law, times k where they are stresses."""
    total = ratio / (1 - nu) * a.u + 2 * nu / (1 - nu) * a.s
    difference = -ratio / (1 + nu) * a.u
    return np.stack([-k * a.s, -k * total, -k * difference, -k * a.t, a.w, a.u])


def _transforms(nodes: _Waves, symbols: ndarray, r: ndarray) -> ndarray:
    """The quantities at distances of one panel, shape (len(r), QUANTITIES, ndepths)."""
    # far waves cancel each other: a smooth cut leaves an error below any power of 1 / CUTOFF
    cut = CUTOFF / r[:, None]
    edges = nodes.edges
    octaves = min(nodes.octaves, int(np.searchsorted(edges, 2 * cut.max())))
    matrix = np.empty((3, len(r), octaves, NODES))
    for i in range(octaves):
        pieces = int(np.ceil((edges[i + 1] - edges[i]) * r.max() / np.pi))
        t, w, to_nodes = _rule(pieces)
        k = edges[i] + (edges[i + 1] - edges[i]) * (t + 1) / 2
        part = w * (edges[i + 1] - edges[i]) / 2 * erfc(6 * (k / cut - 1.5)) / 2
        matrix[:, :, i] = np.stack(_bessel(k, r[:, None])) * part @ to_nodes
    to_distances = matrix.reshape(3, len(r), -1)
    values = symbols[:, :, : octaves * NODES]
    orders = [0, 0, 2, 1, 0, 1]
    out = np.stack([to_distances[o] @ f.T for o, f in zip(orders, values, strict=True)], axis=1)
    out[:, 4] += edges[0] * symbols[4, :, NODES - 1]  # the longest waves, without sway
    return out


@lru_cache(maxsize=128)
def _rule(pieces: int) -> tuple[ndarray, ndarray, ndarray]:
    """Gauss rule on [-1, 1] in pieces, and the matrix that takes values in nodes to its points."""
    begin = -1 + 2 * np.arange(pieces)[:, None] / pieces
    t = (begin + (GAUSS + 1) / pieces).ravel()
    series = np.polynomial.chebyshev.chebvander
    inverse = 2 / NODES * series(_nodes(NODES), NODES - 1).T
    inverse[0] /= 2
    return t, np.tile(GAUSS_WEIGHTS / pieces, pieces), series(t, NODES - 1) @ inverse


def _bessel(k: ndarray, r: ndarray) -> tuple[ndarray, ndarray, ndarray]:
    """J0(k r), J1(k r) / r and J2(k r) / r^2."""
    x = k * r
    zero, one = j0(x), j1(x)
    q = x * x
    small = q / 8 * (1 - q / 12 * (1 - q / 32 * (1 - q / 60 * (1 - q / 96))))
    two = np.where(x < 0.5, small, 2 * one / x - zero)
    return zero, one / r, two / r**2


def _error(coefficients: ndarray, symbols: ndarray, d: float, surface: HalfSpace) -> float:
    """What the next degrees would add, in r and in the wave number."""
    unit = np.array([1, 1, 1 / d**2, 1 / d, d**2, d]) / (2 * np.pi * d**2)
    unit[4:] /= surface.young
    largest = np.abs(coefficients[:, :, 0]).max(axis=(0, 1))
    # the singularity nearest to a panel lets coefficients fall by a factor of 18
    in_r = np.abs(coefficients[:, :, -1]).max(axis=(0, 1)) / 2 ** (DEGREE + 3)
    last = np.polynomial.chebyshev.chebvander(_nodes(NODES), NODES - 1)[:, -1] * 2 / NODES
    in_k = np.abs(symbols.reshape(QUANTITIES, -1, NODES) @ last).max(axis=1)
    size = np.maximum(unit, largest)
    scale = np.abs(symbols).max(axis=(1, 2)).clip(np.finfo(float).tiny)
    return float(max((in_r / size).max(), (in_k / scale * (largest / size)).max()))


def _nodes(n: int) -> ndarray:
    """Chebyshev's nodes in [-1, 1], descending."""
    return np.cos(np.pi * (np.arange(n) + 0.5) / n)
