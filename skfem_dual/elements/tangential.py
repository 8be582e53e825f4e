"""Displacements of the surface of a half-space by shear and normal tractions on cells.

A tangential force Q along x on the surface moves it, with G the shear modulus and z down::

    ux = Q / (2 pi G) [(1 - nu) / r + nu x^2 / r^3],    uy = Q / (2 pi G) nu x y / r^3,
    uz = Q / (4 pi G) (1 - 2 nu) x / r^2,

and a normal force by the same coupling with the opposite sign. Over a polygon all of it follows
from integrals along its ribs: with the outward normal n and the distances r of the source from
the field point, by Gauss's theorem::

    integral of (delta_ij / r - x_i x_j / r^3) = sum over ribs of n_j integral of x_i / r,
    integral of x_i / r^2 = sum over ribs of n_i integral of log r,

and likewise those by tractions with slopes, which have one more factor x_k.

Sources: V. Cerruti's solution in K. L. Johnson, Contact Mechanics (1985), equations (3.75); the
sums over ribs are this project's own.
"""

from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np
from numpy import ndarray
from scipy.sparse import csr_matrix

from ..grids.fan import Fan
from ..grids.partition import Partition
from ..grids.polygons import readonly
from ..ground.stratified import Stratified
from ..ground.substrates import HalfSpace
from ..kernels.compiled import compiled, inputs
from ..kernels.once import computed_once
from ..kernels.threads import Threads
from .edge_weights import EdgeWeights, load_centroids
from .ribs import rib_integral
from .slopes import Slopes
from .strips import CellLoads, area_of, weighted_strips
from .tangential_remainder import ShearedCells, tangential_remainder

#: points nearer to a weighted cell than so many of its radii see its strips, others its
#: triangles; no point of a regular mesh is just there
IN_STRIPS = 3.03
#: strips in a triangle that reaches from the edge on
STRIPS = 32
#: numbers computed at a time
CHUNK = 2**24


class LoadedRibs(NamedTuple):
    """Ribs of uniformly loaded polygons, those of a cell one after the other.

    Attributes
    ----------
    begin, along : (2, k) array of float
        Where ribs begin and their directions, of unit length.
    length : (k,) array of float
    density : (k,) array of float
        Load per area on the left by unit mean traction on the cell; by unit slopes of the traction
        as often as the arm from the centre of the cell.
    starts : (ncells + 1,) array of int
        The first rib of each cell.
    """

    begin: ndarray
    along: ndarray
    length: ndarray
    density: ndarray
    starts: ndarray

    @classmethod
    def from_polygons(cls, corners: ndarray, density: ndarray, cell: ndarray, ncells: int) -> Self:
        """Of polygons (2, c, k) with their densities and cells."""
        order = np.argsort(cell, kind="stable")
        corners, density, cell = corners[..., order], density[order], cell[order]
        along = np.roll(corners, -1, axis=1) - corners
        length = np.hypot(*along)
        begin, direction = (
            np.swapaxes(a, 1, 2).reshape(2, -1)
            for a in (corners, along / np.where(length > 0, length, 1.0))
        )
        density = np.repeat(density, corners.shape[1])
        starts = corners.shape[1] * np.searchsorted(cell, np.arange(ncells + 1))
        return cls(*inputs(begin, direction, length.T.ravel(), density, starts))


@dataclass(frozen=True, eq=False)
class Tractions:
    """Tractions of cells, as ribs for points near by and far away.

    Parameters
    ----------
    partition : Partition
        The n cells.
    fan : Fan
        Triangles that fill all of them.
    weights : EdgeWeights, optional
        How all tractions vary inside the cells; uniform without.
    slopes : Slopes, optional
        How they follow the cells around, too.
    """

    partition: Partition
    fan: Fan
    weights: EdgeWeights | None = None
    slopes: Slopes | None = None

    @property
    def _centres(self) -> ndarray:
        """Where mean tractions act."""
        return load_centroids(self.partition, self.weights)

    @property
    def _weighted(self) -> ndarray:
        """Triangles of the fan of the weights that are in weighted cells."""
        if self.weights is None:
            return np.empty(0, dtype=int)
        return np.nonzero(self.weights.weighted[self.weights.fan.cell])[0]

    @computed_once
    def far(self) -> LoadedRibs:
        """Of triangles, where they are weighted moved to where their loads act."""
        fan, weights, own = self.fan, self.weights, self._weighted
        if weights is None:
            corners, density, cell = fan.p[:, fan.t], np.ones(len(fan.cell)), fan.cell
        else:
            plain = ~weights.weighted[fan.cell]
            mean, off = weights.of_triangles
            loaded = weights.fan.cell[own]
            moved = weights.fan.p[:, weights.fan.t[:, own]] + off[:, None, own]
            corners = np.concatenate([fan.p[:, fan.t[:, plain]], moved], axis=2)
            density = np.append(np.ones(plain.sum()), mean[own] / weights.mean[loaded])
            cell = np.append(fan.cell[plain], loaded)
        return LoadedRibs.from_polygons(corners, density, cell, len(self.partition))

    @computed_once
    def near(self) -> LoadedRibs:
        """Of strips between levels of the distance to the edge, in weighted cells only."""
        if self.weights is None or not len(self._weighted):
            empty = np.empty((2, 4, 0)), np.empty(0), np.empty(0, dtype=int)
            return LoadedRibs.from_polygons(*empty, len(self.partition))
        unit = CellLoads(self.partition, np.ones(len(self.partition)), self.weights)
        cells = np.nonzero(self.weights.weighted)[0]
        corners, density, cell = weighted_strips(unit, self.weights, cells, STRIPS)
        density *= np.sign(area_of(corners))
        return LoadedRibs.from_polygons(corners, density, cell, len(self.partition))

    @computed_once
    def radius(self) -> ndarray:
        """Points nearer than that to the centroid of a cell see its strips."""
        radius = np.zeros(len(self.partition))
        if self.weights is not None:
            fan, own = self.weights.fan, self._weighted
            corners, cell = fan.p[:, fan.t[:, own]], fan.cell[own]
            spokes = np.hypot(*(corners - self.partition.centroids[:, None, cell])).max(axis=0)
            np.maximum.at(radius, cell, IN_STRIPS * spokes)
        return readonly(radius)

    def integrals(self, x: ndarray, *, coupling: bool = True) -> ndarray:
        """Integrals over all cells by unit mean tractions at points of shape (2, m).

        Without ``coupling`` the first three only.

        Returns
        -------
        (5, m, n) or (3, m, n) array of float
            Of 1 / r, x^2 / r^3, x y / r^3, x / r^2 and y / r^2, with r and (x, y) from the field
            point to the source.

        Examples
        --------
        In the centre of the square of sides 2, x^2 and y^2 have the same share of 1 / r:

        >>> from skfem import MeshQuad
        >>> mesh = MeshQuad.init_tensor([-1.0, 1.0], [-1.0, 1.0])
        >>> square = Tractions(Partition.from_mesh(mesh), Fan.from_mesh(mesh))
        >>> found = square.integrals(np.zeros((2, 1)))
        >>> bool(np.isclose(found[1, 0, 0], 4 * np.arcsinh(1), rtol=1e-14))
        True
        """
        n, far, near = len(self.partition), self.far, self.near
        densities, kinds = 1 if self.slopes is None else 3, 5 if coupling else 3
        sums = np.zeros((densities, kinds, x.shape[1], n))
        at = inputs(self.partition.centroids, self.radius, self._centres)

        def work(rows: slice) -> None:
            points, part = inputs(x[:, rows]), sums[:, :, rows]
            _add(*points, *at, far, False, part)
            _add(*points, *at, near, True, part)

        with Threads() as run:
            run(work, x.shape[1])
        out = self._with_slopes(sums)
        out[1:3] = out[0] - out[1], -out[2]
        return out

    def _with_slopes(self, sums: ndarray) -> ndarray:
        """Integrals by mean tractions from those by them and, (3, ..., n), by slopes."""
        out = sums[0]
        if self.slopes is not None:
            for part, slope in zip(sums[1:], self.slopes.along, strict=True):
                flat = part.reshape(-1, part.shape[-1])
                out += (csr_matrix(slope.T) @ flat.T).T.reshape(out.shape)
        return out

    @computed_once
    def _sheared(self) -> ShearedCells:
        return ShearedCells.from_cells(self.partition, self.weights, self.slopes is not None)

    def _add_remainder(self, ground: Stratified, x: ndarray, out: ndarray) -> None:
        """What the ground has beyond the homogeneous half-space, to displacements."""
        sums = tangential_remainder(ground, self._sheared, x)
        even, odd, across, *coupling, down = self._with_slopes(sums) / ground.surface.young
        out[0, :, 0] += even + odd
        out[1, :, 1] += even - odd
        out[0, :, 1] += across
        out[1, :, 0] += across
        if len(out) > 2:
            out[2, :, 2] += down
            for i, part in enumerate(coupling):
                out[2, :, i] += part
                out[i, :, 2] -= part

    def displacements(
        self, ground: HalfSpace | Stratified, x: ndarray, *, normal: bool = False
    ) -> ndarray:
        """Displacements of the surface by unit mean tractions on each cell.

        Parameters
        ----------
        ground : HalfSpace, GradedHalfSpace or LayeredHalfSpace
            Not on a smooth rigid base.
        x : (2, m) array of float
            Field points anywhere on the surface.
        normal : bool
            Whether normal tractions and displacements are wanted too.

        Returns
        -------
        (2, m, 2, n) or (3, m, 3, n) array of float
            Displacements along x, y and, downwards, z, by tractions on the ground along x, y and
            z.
        """
        young, nu = ground.surface.young, ground.surface.poisson
        size, n = 3 if normal else 2, len(self.partition)
        out = np.empty((size, x.shape[1], size, n))
        step = max(1, CHUNK // (24 * n))
        for first in range(0, x.shape[1], step):
            rows = slice(first, first + step)
            part = out[:, rows]
            at = np.ascontiguousarray(x[:, rows])
            found = self.integrals(at, coupling=normal) * ((1 + nu) / (np.pi * young))
            one, xx, xy = found[:3]
            part[0, :, 0] = (1 - nu) * one + nu * xx
            part[1, :, 1] = one - nu * xx
            part[0, :, 1] = part[1, :, 0] = nu * xy
            if normal:
                part[2, :, 2] = (1 - nu) * one
                for i, coupling in enumerate(found[3:]):
                    # the ground moves towards a normal force, and down before a tangential one
                    part[i, :, 2] = (0.5 - nu) * coupling
                    part[2, :, i] = -part[i, :, 2]
            if isinstance(ground, Stratified):
                self._add_remainder(ground, at, part)
        return out


@compiled
def _log_integral(h, t1, t2, r1, r2):
    """Integral of log r along a rib at distance h."""
    value = t1 - t2
    if r2 > 0.0:
        value += t2 * np.log(r2)
    if r1 > 0.0:
        value -= t1 * np.log(r1)
    if h != 0.0:
        value += h * (np.arctan(t2 / h) - np.arctan(t1 / h))
    return value


@compiled
def _moment_of_log(r1, r2, rise):
    """Integral of t log r along a rib from the foot of the field point on it."""
    value = -rise * (r1 + r2) / 4
    if r2 > 0.0:
        value += r2 * r2 * np.log(r2) / 2
    if r1 > 0.0:
        value -= r1 * r1 * np.log(r1) / 2
    return value


@compiled
def _add(x, centroids, radius, centres, ribs, close, out):
    """Add 1/r, y^2/r^3, -x y/r^3, x/r^2 and y/r^2 over cells at the points within their radius if
    ``close``, else at the others: by unit mean tractions and, if ``out`` has room for them on its
    first axis, by unit slopes along x and y from the centres."""
    begin, along, length, density, starts = ribs
    kinds, sloped = out.shape[1], out.shape[0] > 1
    values, by_x, by_y = np.zeros(5), np.zeros(5), np.zeros(5)
    for i in range(x.shape[1]):
        x0, y0 = x[0, i], x[1, i]
        for k in range(len(radius)):
            inside = np.hypot(x0 - centroids[0, k], y0 - centroids[1, k]) < radius[k]
            if inside != close:
                continue
            arm_x, arm_y = x0 - centres[0, k], y0 - centres[1, k]
            for f in range(starts[k], starts[k + 1]):
                tx, ty, size = along[0, f], along[1, f], length[f]
                if size == 0.0:
                    continue
                ax, ay = begin[0, f], begin[1, f]
                dx, dy = ax - x0, ay - y0
                ex, ey = dx + size * tx, dy + size * ty
                r1, r2 = np.sqrt(dx * dx + dy * dy), np.sqrt(ex * ex + ey * ey)
                t1, h = dx * tx + dy * ty, dx * ty - dy * tx
                rise = (2 * t1 + size) * size / (r1 + r2)  # r2 - r1
                v = rib_integral(x0, y0, ax, ay, size * tx, size * ty, size, r1, r2)
                nx, ny = ty, -tx  # outwards
                values[0] = v
                values[1] = nx * (nx * v + tx * rise)
                values[2] = (nx * nx - ny * ny) * rise / 2 + nx * ny * v
                g = 0.0
                if kinds > 3:
                    g = _log_integral(h, t1, t1 + size, r1, r2)
                    values[3] = nx * g
                    values[4] = ny * g
                for c in range(kinds):
                    out[0, c, i, k] += density[f] * values[c]
                if not sloped:
                    continue
                # along the rib: of r, and of t^2 / r
                ends = (t1 + size) * r2 - t1 * r1
                mean, square = (ends + h * v) / 2, (ends - h * v) / 2
                xx = nx * nx * h * v + 2 * nx * tx * h * rise + tx * tx * square
                yy = ny * ny * h * v + 2 * ny * ty * h * rise + ty * ty * square
                xy = nx * ny * h * v + (nx * ty + ny * tx) * h * rise + tx * ty * square
                by_x[0], by_y[0] = nx * mean, ny * mean
                by_x[1], by_y[1] = nx * (xx - mean), nx * xy
                by_x[2], by_y[2] = ny * xx, nx * yy
                if kinds > 3:
                    q = _moment_of_log(r1, r2, rise)
                    inner = h * (2 * g - size) / 4  # of log r over the triangle to the rib
                    by_x[3], by_y[3] = (
                        nx * (h * nx * g + tx * q) - inner,
                        nx * (h * ny * g + ty * q),
                    )
                    by_x[4], by_y[4] = (
                        ny * (h * nx * g + tx * q),
                        ny * (h * ny * g + ty * q) - inner,
                    )
                for c in range(kinds):
                    out[1, c, i, k] += density[f] * (by_x[c] + arm_x * values[c])
                    out[2, c, i, k] += density[f] * (by_y[c] + arm_y * values[c])
