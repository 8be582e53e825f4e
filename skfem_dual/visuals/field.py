"""What a basis and its values look like: triangles, values on them, outline and ribs."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy import ndarray
from skfem import CellBasis, ElementQuad0, ElementQuad1, ElementTriP0, ElementTriP1

FLAT = (ElementTriP0, ElementQuad0)
CONTINUOUS = (ElementTriP1, ElementQuad1)


@dataclass(frozen=True, eq=False)
class Field:
    """Values on triangles, ready to be drawn.

    Attributes
    ----------
    p : (2, npoints) array of float
        Coordinates of the points.
    t : (3, ntriangles) array of int
        Points of each triangle.
    values : array of float
        One value per triangle if ``flat``, else one per point.
    cells : (ntriangles,) array of int
        The cell each triangle is part of.
    flat : bool
        Whether the field is constant on each triangle.
    """

    p: ndarray
    t: ndarray
    values: ndarray
    cells: ndarray
    flat: bool

    @classmethod
    def from_basis(cls, basis: CellBasis, values, elements=FLAT + CONTINUOUS) -> "Field":
        """The field of ``basis`` with ``values`` of its DOFs.

        Cells of a dual grid come as their triangles in the common refinement, because
        renderers fill concave polygons wrongly; quadrilaterals as four triangles around their
        middle, where a bilinear function is the mean of its corners.

        Raises
        ------
        TypeError
            If ``basis`` is not a CellBasis.
        ValueError
            If its element is none of ``elements``, or the values are not finite or too many or
            too few.
        """
        if not isinstance(basis, CellBasis):
            raise TypeError(f"expected a skfem CellBasis, got {type(basis).__name__}")
        if not isinstance(basis.elem, elements):
            names = ", ".join(e.__name__ for e in elements)
            remedy = (
                "solution.nodal_pressure() gives nodal values"
                if isinstance(basis.elem, FLAT)
                else "project onto one of these first"
            )
            raise ValueError(
                f"expected a basis of {names}, got {type(basis.elem).__name__}. Remedy: {remedy}"
            )
        values = np.asarray(values, dtype=float)
        if values.shape != (basis.N,):
            raise ValueError(
                f"expected one value for each of the {basis.N} DOFs, got shape {values.shape}"
            )
        if bad := int(np.sum(~np.isfinite(values))):
            raise ValueError(f"expected finite values, got {bad} that are NaN or infinite")

        mesh, flat = basis.mesh, isinstance(basis.elem, FLAT)
        p, t = mesh.p, mesh.t if basis.tind is None else mesh.t[:, basis.tind]
        cells = basis.element_dofs[0] if flat else np.arange(t.shape[1])
        values = values[cells] if flat else values[basis.nodal_dofs[0]]
        if len(t) == 4:
            middle = p.shape[1] + np.arange(t.shape[1])
            p = np.hstack([p, p[:, t].mean(axis=1)])
            values = np.tile(values, 4) if flat else np.append(values, values[t].mean(axis=0))
            t = np.hstack([[t[i], t[(i + 1) % 4], middle] for i in range(4)])
            cells = np.tile(cells, 4)
        return cls(p, t, values, cells, flat)

    @cached_property
    def areas(self) -> ndarray:
        """Area of each triangle."""
        (ax, ay), (bx, by) = (self.p[:, self.t[i]] - self.p[:, self.t[0]] for i in (1, 2))
        return abs(ax * by - ay * bx) / 2

    @property
    def outline(self) -> ndarray:
        """Sides with triangles on one side only, shape (2, n): outer boundary and holes."""
        return self._sides[0]

    @property
    def ribs(self) -> ndarray:
        """Sides between triangles of different cells, shape (2, n)."""
        return self._sides[1]

    @cached_property
    def _sides(self) -> tuple[ndarray, ndarray]:
        # points in one place count as one: the cells of a polar grid each have their own middle
        _, first, place = np.unique(
            self.p[0] + 1j * self.p[1], return_index=True, return_inverse=True
        )
        sides = np.sort(place[np.hstack([self.t[[0, 1]], self.t[[1, 2]], self.t[[2, 0]]])], axis=0)
        cells = np.tile(self.cells, 3)
        keep = sides[0] != sides[1]
        sides, cells = sides[:, keep], cells[keep]
        key, start, side, count = np.unique(
            sides[0] * len(first) + sides[1],
            return_index=True,
            return_inverse=True,
            return_counts=True,
        )
        parted = np.zeros(len(key), dtype=bool)
        parted[side[cells != cells[start[side]]]] = True
        ends = first[sides[:, start]]
        return ends[:, count == 1], ends[:, parted]
