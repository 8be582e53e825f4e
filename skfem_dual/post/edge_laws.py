"""How pressures vary towards the edges of plan and contact, on a refinement of the mesh."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy import ndarray
from skfem import CellBasis, ElementTriP2, MeshTri

from ..elements.edge_weights import mean_weight
from ..elements.graded_rule import graded
from ..errors import MeshError
from ..grids.cellwise import nodal_mesh
from ..grids.corners import signed_areas
from ..grids.fan import Fan
from ..grids.general import facet_numbers
from ..grids.outline import distance_to_segments
from ..grids.planar import cross
from ..grids.refinement import Refinement
from ..solutions.pressures import CellPressures
from .regular import torsion

#: where the square root of the distance to the line of contact levels off, over the greatest
FAR = 0.25
#: degree of products with the laws that are integrated over cells
ORDER = 4
#: root of phi on the edge, over its greatest
TINY = 1e-20
#: barycentric coordinates, and depths over the greatest, that are zero
ROUNDING = 1e-8


@dataclass(frozen=True, eq=False)
class EdgeLaws:
    """How the pressure varies towards the edges of plan and contact, on a refinement.

    Attributes
    ----------
    refined : Refinement
        Of the mesh, quadrilaterals cut around their middles.
    kept : (m,) array of int
        Triangles of the contact region that the base of the refinement has.
    phi : (n,) array of float
        Coefficients, of Bernstein, of the torsion function: one at each node and one at each
        facet of the base. Zero on the singular edge; ones without one.
    depth : (n,) array of float or None
        The same for the distance to the line where contact ends smoothly, negative without
        contact; None if there is no such line.
    """

    refined: Refinement
    kept: ndarray
    phi: ndarray
    depth: ndarray | None

    @classmethod
    def of(cls, solution: CellPressures, refine: int, facets: ndarray) -> "EdgeLaws":
        """Towards some facets of the mesh, and towards where contact ends inside."""
        region, cells = solution.contact_region, solution.punch.footprint
        areas = signed_areas(region.p, region.t)
        # quadrilaterals in the middle of a polar grid have sides without length
        kept = np.nonzero(areas > 1e-14 * areas.max())[0]
        base = MeshTri(region.p, np.ascontiguousarray(region.t[:, kept]))
        singular = np.zeros(base.nfacets, dtype=bool)
        kept_ones = facet_numbers(base, *nodal_mesh(cells.basis).facets[:, facets])
        singular[kept_ones[kept_ones >= 0]] = True
        depth = None
        if region.edge:
            a = np.hstack([line[:, :-1] for line in region.edge])
            b = np.hstack([line[:, 1:] for line in region.edge])
            x = np.hstack([base.p, base.p[:, base.facets].mean(axis=1)])
            level = np.append(region.level, region.level[base.facets].mean(axis=0))
            depth = _bernstein(base, np.copysign(distance_to_segments(x, a, b), level))
        refined, phi = Refinement.towards(base, singular, refine), _torsion(base, singular)
        inside = phi[np.vstack([base.t, base.p.shape[1] + base.t2f])].any(axis=0)
        if not inside.all():
            raise MeshError(
                "expected parts of a plan of several triangles, got triangle "
                f"{kept[np.argmin(inside)]} alone, where pressures have no value inside. Remedy: "
                "a finer mesh, mesh.refined()"
            )
        return cls(refined, kept, phi, depth)

    def _closing(self, parent: ndarray, shares: ndarray) -> ndarray | float:
        """Square root of the distance to the line where contact ends, levelling off far from
        it, where the distance has ridges."""
        if self.depth is None:
            return 1.0
        depth = _quadratic(self.refined.base, self.depth, parent, shares)
        return np.sqrt(np.tanh(depth.clip(0.0) / (FAR * self.depth.max())))

    @cached_property
    def at_nodes(self) -> ndarray:
        """The laws at the nodes."""
        return self.edge_at_nodes * self._closing(self.refined.parent, self.refined.shares)

    @cached_property
    def edge_at_nodes(self) -> ndarray:
        """That of the edge at the nodes, such that between them triangles have their load in the
        mean: a little less than its values, and finite on a singular edge."""
        parent, shares, edge = self.refined.parent, self.refined.shares, self.refined.edge
        mesh = self.refined.mesh
        root = np.sqrt(_quadratic(self.refined.base, self.phi, parent, shares))
        w = np.divide(1.0, root, out=np.zeros_like(root), where=~edge)
        root = root.clip(TINY * root.max())
        load = mean_weight(*root[mesh.t])
        area = np.abs(signed_areas(mesh.p, mesh.t))
        # what is left is made good by the nodes inside first, then by those on the edge
        at_edge = edge[mesh.t]
        beside = at_edge.any(axis=0)
        for part, nodes in ((~beside, ~at_edge), (beside, at_edge)):
            left = (load - w[mesh.t].mean(axis=0)) * area * part / nodes.sum(axis=0).clip(1)
            share = area * part / 3
            total, areas = (
                np.bincount(mesh.t.ravel(), (x * nodes).ravel(), len(w)) for x in (left, share)
            )
            w += np.divide(total, areas, out=np.zeros_like(w), where=areas > 0)
        return w

    def of_cells(self, cells: Any) -> tuple[ndarray, ndarray, ndarray, ndarray]:
        """Integral of the laws over each cell, where it acts, how far it spreads around there,
        (3, n) along xx, xy and yy, and the integral of that of the edge alone."""
        fan, base = cells.fan, self.refined.base
        parent, corners, phi = self._in_fan(fan, cells.basis)
        grade = phi
        if self.depth is not None:
            # cut where contact ends; away from a singular edge the root of the distance to that
            # line is all that varies
            deep = np.empty(fan.p.shape[1])
            deep[fan.t] = _quadratic(base, self.depth, parent, corners)
            deep[np.abs(deep) < ROUNDING * deep.max()] = 0.0
            fan, deep = fan.cut_at_zero(deep)
            parent, corners, phi = self._in_fan(fan, cells.basis)
            grade = np.where((phi > 0).all(axis=0), np.abs(deep[fan.t]), phi)
        whole = np.repeat(np.eye(3)[..., None], len(parent), axis=2)
        sums = np.zeros((7, len(cells.partition)))
        centre = cells.partition.centroids[:, fan.cell]  # there is no cancellation near it
        for at, load in graded(whole, grade, ORDER):
            shares = np.einsum("ivk,vkq->ikq", corners, at)
            linear = np.einsum("vk,vkq->kq", grade, at)
            exact = _quadratic(base, self.phi, parent[:, None], shares)
            ratio = np.divide(linear, exact, out=np.zeros_like(exact), where=exact > 0)
            load = load * np.sqrt(ratio) * fan.areas[:, None]
            sums[6] += np.bincount(fan.cell, load.sum(axis=1), sums.shape[1])
            load = load * self._closing(parent[:, None], shares)
            x, y = np.einsum("dvk,vkq->dkq", fan.p[:, fan.t] - centre[:, None], at)
            for row, factor in zip(sums, (1.0, x, y, x * x, x * y, y * y), strict=False):
                row += np.bincount(fan.cell, (load * factor).sum(axis=1), sums.shape[1])
        total = np.where(sums[0] > 0, sums[0], 1.0)
        (x, y), squares = sums[1:3] / total, sums[3:6] / total
        acting = np.stack([x, y]) + cells.partition.centroids
        return sums[0], acting, squares - [x * x, x * y, y * y], sums[6]

    def _in_fan(self, fan: Fan, basis: CellBasis) -> tuple[ndarray, ndarray, ndarray]:
        """Of each triangle of a fan that of the base it is in, the coordinates there, first axis,
        of its vertices, second axis, and phi in these."""
        mesh, base = nodal_mesh(basis), self.refined.base
        # quadrilaterals were cut around their middles in the same order
        element = fan.part if len(mesh.t) == 4 else fan.part % mesh.nelements
        parent = np.searchsorted(self.kept, element)
        corners = _coordinates(base.p[:, base.t[:, parent]], fan.p[:, fan.t])
        return parent, corners, _quadratic(base, self.phi, parent, corners)

    def between(self, planes: ndarray) -> ndarray:
        """Values at the nodes from values and slopes at those of the base, shape (3, n).

        The cubic of Bazeley, Cheung, Irons and Zienkiewicz (1965) in each triangle, exact for
        polynomials of the second degree.
        """
        shares, base = self.refined.shares, self.refined.base
        t = base.t[:, self.refined.parent]
        p, (s, sx, sy) = base.p[:, t], planes[:, t]
        out = np.sum(s * shares**2 * (3 - 2 * shares), axis=0)
        bubble = np.prod(shares, axis=0)
        out += 2 * bubble * s.sum(axis=0)
        for i in range(3):
            for j in range(3):
                if i != j:
                    step = p[:, j] - p[:, i]
                    slope = sx[i] * step[0] + sy[i] * step[1]
                    out += slope * (shares[i] ** 2 * shares[j] + bubble / 2)
        return out


def _coordinates(triangles: ndarray, x: ndarray) -> ndarray:
    """Barycentric coordinates, first axis, of points (2, k, m) in m triangles that have them."""
    a, b, c = triangles.swapaxes(0, 1)
    twice = cross(b - a, c - a)
    second = cross(x - a[:, None], (c - a)[:, None]) / twice
    third = cross((b - a)[:, None], x - a[:, None]) / twice
    shares = np.stack([1 - second - third, second, third])
    return np.where(shares > ROUNDING, shares, 0.0)


def _torsion(base: MeshTri, singular: ndarray) -> ndarray:
    """Coefficients of the torsion function of the plan, positive inside."""
    basis = CellBasis(base, ElementTriP2())
    if not singular.any():
        return np.ones(basis.N)
    n, held = base.p.shape[1], np.zeros(basis.N, dtype=bool)
    held[base.facets[:, singular]] = True
    held[n:] = singular
    values = torsion(basis, held)
    out = _bernstein(base, values)
    least = np.maximum(out[base.facets].mean(axis=0) / 2, values[n:] / 2)
    out[n:] = np.where(singular, 0.0, np.maximum(out[n:], least))
    return out


def _bernstein(base: MeshTri, values: ndarray) -> ndarray:
    """Coefficients of second degree from values at nodes and middles of facets."""
    n = base.p.shape[1]
    ends = values[base.facets].mean(axis=0)
    return np.append(values[:n], 2 * values[n:] - ends)


def _quadratic(base: MeshTri, c: ndarray, parent: ndarray, shares: ndarray) -> ndarray:
    """Values of a function of second degree at points in triangles of the base.

    Sums of products of what is not negative: zero or positive if the coefficients are.
    """
    n, (a, b, d) = base.p.shape[1], shares
    at, beside = c[base.t[:, parent]], 2 * c[n + base.t2f[:, parent]]
    out = at[0] * a**2 + at[1] * b**2 + at[2] * d**2
    return out + beside[0] * a * b + beside[1] * b * d + beside[2] * a * d
