"""Distance to the edge of a plan, and weights that grow like its inverse square root.

Under a rigid edge the pressure grows like ``1 / sqrt(d)`` with the distance ``d``. Inside a cell
it is taken as ``q w / mean(w)`` with ``w = phi^(-1/2)``, where ``phi`` interpolates the distance
linearly on triangles that fill the cell and ``q`` remains the mean pressure of the cell. Next to
corners of the plan phi passes into what makes w follow the pressure there, see `wedge_law`, and
triangles are halved. On ground that is not homogeneous w has a factor besides, a function of phi:
what the pressure under a rigid disc of the plan's area is over that on homogeneous ground, see
`EdgeLaw`.

Sources: K. L. Johnson, Contact Mechanics (1985), section 5.1, for the pressure near a rigid edge;
C. de Boor, Divided differences, Surveys in Approximation Theory 1 (2005), for the formula of
Hermite and Genocchi, by which means over triangles are divided differences.
"""

from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np
from numpy import ndarray
from scipy.spatial import cKDTree
from skfem import CellBasis

from ..grids.cellwise import CellwiseBasis, nodal_mesh
from ..grids.fan import Fan, side_keys
from ..grids.outline import MANY, Wedges, distance_to_segments, wedges
from ..grids.partition import Partition
from ..grids.polygons import readonly
from ..ground.rigid_disc import EdgeLaw, edge_law
from ..ground.seen import Seen
from ..ground.substrates import Substrate
from ..kernels.compiled import compiled, inputs
from ..kernels.once import ReadOnly, computed_once, remember
from ..kernels.threads import threads_for
from .graded_rule import graded
from .law_moments import LawFactors, Triangles, factor_at, law_moments
from .law_polynomials import law_polynomials
from .law_strips import Strips
from .wedge_law import exponent, wedge_factor

#: cells over which w varies by less than this factor are left constant
VARIATION = 1.1
#: degree of the rule for means of w with a factor, and triangles at a time
ORDER, CHUNK = 6, 2**14
#: sides of triangles nearer to a corner than so many lengths, more than 4 as that is a distance in
#: even grids, are halved where phi in the middle is off by more than so much of it, more than
#: 0.04 as that comes about in even grids, too; so often
BESIDE, BENT, HALVES = 4.000001, 0.0400001, 4
#: how far off a point may be in parts of its coordinates
ROUNDING = 8 * np.finfo(float).eps


@dataclass(frozen=True, eq=False)
class EdgeWeights(ReadOnly):
    """The weight ``w = phi^(-1/2)``, times the factor of the ground's law, on some cells.

    Parameters
    ----------
    partition : Partition
        The cells.
    fan : Fan
        Triangles that fill them, or those near the edge: the others are not weighted.
    ribs : (k,) array of int
        The ribs on the edge where the pressure is singular, k > 0; see `edge_ribs`.
    law : EdgeLaw, optional
        That of the ground; by default the factor is 1.
    corners : Wedges, optional
        Those of the edge; by default it has none.
    """

    partition: Partition
    fan: Fan
    ribs: ndarray
    law: EdgeLaw | None = field(default=None, kw_only=True)
    corners: Wedges | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        object.__setattr__(self, "ribs", readonly(self.ribs, np.int32))

    @classmethod
    def from_basis(
        cls,
        basis: CellBasis,
        partition: Partition,
        ribs: ndarray,
        substrate: Substrate | None = None,
    ) -> Self:
        """Of a basis and its partition, with a fan of the cells that may be weighted.

        ``substrate`` is the ground, homogeneous by default. What a thin skin, which `Seen` ground
        has, does to the law ends before the middle of a cell.
        """
        mesh = nodal_mesh(basis)
        a, b = partition.ends(ribs)
        law = None
        if substrate is not None and not isinstance(substrate, Seen):
            size = float(np.sqrt(partition.areas.sum() / np.pi))
            # of cells at the edge, which decides how far the law falls inside them
            width = float(np.sqrt(np.median(partition.areas[partition.f2c[0, ribs]])))
            law = edge_law(substrate, size, width)
        # phi varies by less than that where w does not vary by VARIATION; so it is around a node
        # farther from the edge than so many diameters of the largest triangle
        corners = wedges(mesh, np.unique(partition.boundary[ribs]))
        steepness = 2 * (1 - exponent(corners.angle)).max(initial=0.5)
        ratio = VARIATION ** (1 / ((0.5 if law is None else law.steepness) * steepness))
        far = (ratio + 1) / (ratio - 1)
        v = mesh.p.take(mesh.t, axis=1)
        diameters = np.max([np.hypot(*(w - v)).max(axis=0) for w in _rolled(v)], axis=0)
        around = np.zeros(mesh.p.shape[1])
        np.maximum.at(around, mesh.t.ravel(), np.tile(diameters, len(mesh.t)))
        # the nearest end of a rib is not farther than the hypotenuse of the distance to the
        # edge and half the length of a rib
        reach = 1.000001 * np.hypot(far * around, np.hypot(*(b - a)).max() / 2)
        ends = cKDTree(partition.polygons.p[:, np.unique(partition.facets[:, ribs])].T)
        workers = threads_for(mesh.p.shape[1], MANY)
        nearest, _ = ends.query(mesh.p.T, distance_upper_bound=reach.max(), workers=workers)
        near = nearest < reach
        if not (isinstance(basis, CellwiseBasis) and basis.grid == "dual"):
            near = near[mesh.t].any(axis=0)
        fan = Fan.from_basis(basis, np.nonzero(near)[0])
        return cls(partition, fan, ribs, law=law, corners=corners).with_fan(fan)

    def with_fan(self, fan: Fan) -> Self:
        """On other triangles that fill the cells, halved next to corners, and where a side leads
        across the plan from edge to edge."""
        if self.corners is None:
            return replace(self, fan=fan)
        corners, phi = self.corners.x, np.empty(0)

        def bent(p: ndarray, t: ndarray) -> ndarray:
            """Keys of such sides of triangles along which phi is far from linear."""
            nonlocal phi
            phi = np.append(phi, self.phi_at(p[:, len(phi) :]))
            beside, n = np.zeros(t.shape[1], dtype=bool), p.shape[1]
            _next_to(*inputs(p, t, corners), beside)
            beside |= (phi[t] == 0).sum(axis=0) >= 2
            keys = np.unique(side_keys(t[:, beside], n))
            a, b = np.divmod(keys, n)
            middle = self.phi_at((p.take(a, axis=1) + p.take(b, axis=1)) / 2)
            return keys[np.abs(2 * middle - phi[a] - phi[b]) > 2 * BENT * middle]

        out = replace(self, fan=fan.halved(bent, HALVES))
        phi = np.append(phi, self.phi_at(out.fan.p[:, len(phi) :]))
        remember(out, "root", out._root_of(phi))
        return out

    @property
    def facets(self) -> ndarray:
        """Facets of the mesh on the edge, ascending."""
        return np.unique(self.partition.boundary[self.ribs])

    @computed_once
    def _edge(self) -> tuple[ndarray, ndarray, float]:
        """Ends of the ribs, and how far points on the edge are from it, at most."""
        p = self.partition.polygons.p[:, self.partition.facets[:, self.ribs]]
        # by rounding, more at site coordinates
        off = 1e-12 * np.sqrt(self.partition.areas.sum()) + ROUNDING * np.abs(p).max()
        return p[:, 0], p[:, 1], float(off)

    def phi_at(self, x: ndarray) -> ndarray:
        """phi in points of shape (2, m): their distance to the edge, but next to corners."""
        a, b, off = self._edge
        distance = distance_to_segments(x, a, b)
        distance[distance <= off] = 0.0
        if self.corners is None or len(self.corners.node) == 0:
            return distance
        return distance * wedge_factor(self.corners, x, distance)

    @computed_once
    def root(self) -> ndarray:
        """Square root of phi at the points of the fan.

        phi is exact there and linear in the triangles: between the nodes of the mesh alone it
        would miss how far the sides of a curved plan's polygon lie from its corners.
        """
        return self._root_of(self.phi_at(self.fan.p))

    def _root_of(self, phi: ndarray) -> ndarray:
        """Never zero: means are sums of positive terms, and a tiny root is as good."""
        size = np.sqrt(self.partition.areas.sum())
        return readonly(np.sqrt(phi).clip(1e-20 * np.sqrt(size)))

    def roots_in(self, fan: Fan, triangle: ndarray) -> ndarray:
        """The same at the vertices of triangles in weighted cells, shape (3, m), which another
        fan may have too."""
        return self.root[self.fan.t[:, fan.same(triangle, self.fan)]]

    @computed_once
    def factors(self) -> LawFactors:
        """The law of each cell over ``phi^(-1/2)``."""
        own = np.zeros(len(self.partition), dtype=np.int32)
        if self.law is None:
            return LawFactors(np.ones((1, 2)), np.zeros(1), own)
        per_root = (len(self.law.factors) - 1) / np.sqrt(self.law.reach)
        return LawFactors(self.law.factors[None], np.array([per_root]), own)

    def factor(self, cells: ndarray, root: ndarray) -> ndarray:
        """The factor in some cells where the square root of phi is ``root``.

        ``cells`` has the shape of ``root``, or its first dimensions.
        """
        values, per_root, own = self.factors
        if not np.ptp(values):
            return np.full(root.shape, values[0, 0])
        law = own[cells].reshape(cells.shape + (1,) * (root.ndim - cells.ndim))
        last = values.shape[1] - 1
        place = np.minimum(root * per_root[law], last)
        step = np.minimum(place.astype(int), last - 1)
        value = values[law, step]
        return value + (place - step) * (values[law, step + 1] - value)

    @computed_once
    def weighted(self) -> ndarray:
        """Whether each cell is weighted; over the others w hardly varies."""
        least, most = self.roots
        if np.ptp(self.factors.values):
            root = self.root[self.fan.t]
            root = root / self.factor(np.broadcast_to(self.fan.cell, root.shape), root)
            least, most = self.extremes(root)
        return readonly(most > VARIATION * least)

    @property
    def roots(self) -> ndarray:
        """Least and greatest root of phi over each cell, see `extremes`; soon found, not kept."""
        return self.extremes(self.root[self.fan.t])

    @computed_once
    def cells(self) -> ndarray:
        """The weighted cells, ascending."""
        return readonly(np.nonzero(self.weighted)[0], np.int32)

    @computed_once
    def number(self) -> ndarray:
        """The number of each weighted cell among them, -1 of the others."""
        return readonly(np.where(self.weighted, np.cumsum(self.weighted) - 1, -1), np.int32)

    def extremes(self, values: ndarray) -> ndarray:
        """Least and greatest values over each cell of what is given in the corners of triangles,
        (3, m); shape (2, n), inf and -inf where the fan has no triangles."""
        first, end = self.fan.starts[:-1], self.fan.starts[1:]
        (cells,) = np.nonzero(first < end)
        found, starts = np.tile([[np.inf], [-np.inf]], len(self.partition)), first[cells]
        found[0, cells] = np.minimum.reduceat(values.min(axis=0), starts)
        found[1, cells] = np.maximum.reduceat(values.max(axis=0), starts)
        return found

    @computed_once
    def of_triangles(self) -> tuple[ndarray, ndarray]:
        """Mean of w over each triangle of the fan, and where its load acts, from the centroid."""
        mean, shares = self._means()
        v = self.fan.p.take(self.fan.t, axis=1)
        return readonly(mean), readonly(np.sum(v * (shares / mean - 1 / 3), axis=1))

    def _means(self) -> tuple[ndarray, ndarray]:
        """Means of w over each triangle, and of its products with the barycentric coordinates."""
        if np.ptp(self.factors.values):
            return self._means_with_factor()
        root = self.root[self.fan.t]
        return mean_weight(*root), _mean_share(root, root[[1, 2, 0]], root[[2, 0, 1]])

    def _means_with_factor(self) -> tuple[ndarray, ndarray]:
        square, factors = self.root[self.fan.t] ** 2, LawFactors(*inputs(*self.factors))
        shares = np.zeros_like(square)
        for begin in range(0, square.shape[1], CHUNK):
            some = slice(begin, begin + CHUNK)
            cell, own = inputs(self.fan.cell[some], square[:, some])
            whole = np.repeat(np.eye(3)[..., None], len(cell), axis=2)
            for at, load in graded(whole, own, ORDER):
                _add_shares(factors, cell, own, at, load, shares[:, some])
        return shares.sum(axis=0), shares

    @computed_once
    def mean(self) -> ndarray:
        """Mean of w over each cell, NaN where the fan has no triangles."""
        total = self._sums(self.fan.areas * self.of_triangles[0])
        return readonly(np.where(total > 0, total / self.partition.areas, np.nan))

    def _sums(self, values: ndarray) -> ndarray:
        """Sums over the triangles of each cell."""
        return np.bincount(self.fan.cell, values, minlength=len(self.partition))

    @property
    def moment(self) -> ndarray:
        """First moment of ``w / mean(w) - 1`` about the centroid of each cell, shape (2, n)."""
        fan = self.fan
        mean, off = self.of_triangles
        arm = fan.p.take(fan.t, axis=1).mean(axis=1) + off
        arm -= self.partition.centroids.take(fan.cell, axis=1)
        first = np.stack([self._sums(fan.areas * mean * a) for a in arm])
        return np.where(self.weighted, first / self.mean, 0.0)

    @computed_once
    def triangles(self) -> Triangles:
        """The fan and the law on it."""
        fan, factors = self.fan, LawFactors(*inputs(*self.factors))
        p, t, root, starts, mean = inputs(fan.p, fan.t, self.root, fan.starts, self.mean)
        return Triangles(p, t, root, starts, mean, factors)

    @computed_once
    def strips(self) -> Strips:
        """What weighted cells are cut into near by."""
        return Strips.of(self.triangles, self.partition.centroids, self.cells)

    @computed_once
    def moments(self) -> ndarray:
        """Moments of ``w / mean(w) - 1`` about the centroids of the weighted cells, ascending, see
        `law_moments`."""
        centroids = self.partition.centroids
        return readonly(law_moments(self.triangles, centroids, self.cells))

    @computed_once
    def polynomials(self) -> ndarray:
        """Those that stand for ``w / mean(w) - 1`` in weighted cells, see `law_polynomials`."""
        return readonly(law_polynomials(self.partition.polygons, self.moments, self.cells))

    @computed_once
    def centroids(self) -> ndarray:
        """Centroids of the weighted cells, shape (2, n)."""
        return readonly(self.partition.centroids + self.moment / self.partition.areas)

    @computed_once
    def second_moments(self) -> ndarray:
        """Integrals of ``w / mean(w)`` over all cells times products of the coordinates from the
        centroids of w, shape (2, 2, n)."""
        cells, m = self.cells, self.moments
        out = self.partition.polygons.second_moments[[0, 1, 1, 2]].reshape(2, 2, -1)
        off = (self.centroids - self.partition.centroids).take(cells, axis=1)
        out[..., cells] += np.array([[2 * m[2, 0], m[1, 1]], [m[1, 1], 2 * m[0, 2]]])
        out[..., cells] -= self.partition.areas[cells] * off[:, None] * off
        return readonly(out)

    @computed_once
    def in_cells(self) -> ndarray:
        """Mean of w over weighted cells, w in the centroids of the others, shape (n,)."""
        root = np.sqrt(self.phi_at(self.partition.centroids))
        at_centroids = self.factor(np.arange(len(root)), root) / root
        return readonly(np.where(self.weighted, self.mean, at_centroids))

    def relative(self, cells: ndarray, root: ndarray) -> ndarray:
        """``w / mean(w)`` in some cells where the square root of phi is ``root``; 1 where the
        cell is not weighted."""
        with np.errstate(divide="ignore"):
            factor = self.factor(np.broadcast_to(cells, root.shape), root)
            return np.where(self.weighted[cells], factor / (root * self.mean[cells]), 1.0)


@compiled
def _add_shares(factors, cell, square, at, load, shares):
    """Add the means over triangles of w times the barycentric coordinates, by a rule on them."""
    for k in range(load.shape[0]):
        for q in range(load.shape[1]):
            a, b, c = at[0, k, q], at[1, k, q], at[2, k, q]
            root = np.sqrt(a * square[0, k] + b * square[1, k] + c * square[2, k])
            value = load[k, q] * factor_at(factors, cell[k], root)
            shares[0, k] += a * value
            shares[1, k] += b * value
            shares[2, k] += c * value


@compiled
def _next_to(p, t, corners, beside):
    """Mark triangles with a vertex nearer to a corner than `BESIDE` times their longest side."""
    for k in range(t.shape[1]):
        longest, nearest = 0.0, np.inf
        for i in range(3):
            x, y, onward = p[0, t[i, k]], p[1, t[i, k]], t[(i + 1) % 3, k]
            longest = max(longest, (p[0, onward] - x) ** 2 + (p[1, onward] - y) ** 2)
            for c in range(corners.shape[0]):
                nearest = min(nearest, (corners[c, 0] - x) ** 2 + (corners[c, 1] - y) ** 2)
        beside[k] = nearest < BESIDE**2 * longest


def _rolled(v: ndarray) -> list[ndarray]:
    """Vertices of shape (2, k, m), each replaced by the next, the one after it and so on."""
    return [np.roll(v, -i, axis=1) for i in range(1, v.shape[1] // 2 + 1)]


def load_centroids(partition: Partition, weights: EdgeWeights | None) -> ndarray:
    """Where mean pressures on the cells act, shape (2, n); without weights they are constant."""
    return partition.centroids if weights is None else weights.centroids


def mean_weight(a: ndarray, b: ndarray, c: ndarray) -> ndarray:
    """Mean of phi^(-1/2) over a triangle with sqrt(phi) = a, b, c at its vertices."""
    return 8 / 3 * (a * b + b * c + c * a) / ((a + b) * (b + c) * (c + a))


def _mean_share(a: ndarray, b: ndarray, c: ndarray) -> ndarray:
    """Mean of phi^(-1/2) times the barycentric coordinate of the vertex of a.

    By Hermite and Genocchi it is twice the divided difference of ``8/15 phi^(5/2)`` at the four
    points a^2, a^2, b^2, c^2; all terms are positive.
    """
    s = b + c
    top = a**3 * s + 2 * a**2 * s**2 + 4 * a * b * c * s + 2 * b**2 * c**2
    return 8 / 15 * top / ((a + b) ** 2 * (a + c) ** 2 * s)
