"""What a basis and its values look like: triangles, values on them, outline and ribs."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy import ndarray
from numpy.typing import ArrayLike
from scipy.sparse import eye
from scipy.spatial import cKDTree
from skfem import (
    CellBasis,
    ElementQuad0,
    ElementQuad1,
    ElementTriP0,
    ElementTriP1,
    MeshQuad,
    MeshTri,
)

from ..arguments import LARGEST, checked_array, checked_number
from ..contact.region import ContactRegion
from ..grids.corners import lone_first, quarters, signed_areas
from ..grids.fan import Fan
from ..messages import place, shown

FLAT = (ElementTriP0, ElementQuad0)
CONTINUOUS = (ElementTriP1, ElementQuad1)
#: how often elements of higher order are cut in four
HIGHER = 3


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
    plan : (npoints,) array of int, optional
        The plan of each point, where there are several: edges stay where two of them touch.
    """

    p: ndarray
    t: ndarray
    values: ndarray
    cells: ndarray
    flat: bool
    plan: ndarray | None = None

    @classmethod
    def from_basis(
        cls, basis: CellBasis, values: ArrayLike, elements: tuple[type, ...] = FLAT + CONTINUOUS
    ) -> "Field":
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
            raise TypeError(f"expected a skfem CellBasis, got {shown(basis)}")
        _require_straight(basis)
        jumps = isinstance(basis.elem, CONTINUOUS) and len(basis.nodal_dofs) == 0  # discontinuous
        if jumps or not isinstance(basis.elem, elements):
            name, names = type(basis.elem).__name__, ", ".join(e.__name__ for e in elements)
            if isinstance(basis.elem, FLAT):
                raise ValueError(
                    f"expected a continuous field, got one of {name}. Remedy: "
                    "solution.pressure_field() of pressures, or project it onto ElementTriP1 first"
                )
            raise ValueError(
                f"expected a basis of {names}, got {name}. Remedy: project onto one of these first"
            )
        values = _checked(basis, values)
        checked_number("size of values", np.abs(values).max(initial=0.0), at_most=LARGEST)
        mesh, flat = basis.mesh, isinstance(basis.elem, FLAT)
        p, t = mesh.p, mesh.t if basis.tind is None else mesh.t[:, basis.tind]
        cells = basis.element_dofs[0] if flat else np.arange(t.shape[1])
        values = values[cells] if flat else values[basis.nodal_dofs[0]]
        if len(t) == 4:
            values = np.tile(values, 4) if flat else np.append(values, values[t].mean(axis=0))
            p, t = quarters(p, t)
            cells = np.tile(cells, 4)
        return cls(p, t, values, cells, flat)

    @classmethod
    def together(cls, fields: Sequence["Field"]) -> "Field":
        """Those on several plans, all flat or none."""
        points = np.cumsum([0, *(field.p.shape[1] for field in fields)])
        cells = np.cumsum([0, *(field.cells.max() + 1 for field in fields)])
        return cls(
            np.hstack([field.p for field in fields]),
            np.hstack([field.t + first for field, first in zip(fields, points)]),
            np.concatenate([field.values for field in fields]),
            np.concatenate([field.cells + first for field, first in zip(fields, cells)]),
            fields[0].flat,
            np.repeat(np.arange(len(fields)), np.diff(points)),
        )

    def in_contact(self, region: ContactRegion) -> "Field":
        """The part in a contact region, with triangles cut along its edge.

        The values of a continuous field are zero on that edge, as pressures and gaps are.

        Raises
        ------
        TypeError
            If ``region`` is something else.
        ValueError
            If it has no area, or is that of another plan.
        """
        if not isinstance(region, ContactRegion):
            raise TypeError(f"expected a ContactRegion for contact, got {shown(region)}")
        level = _levels(region, self.p)
        inside = level[self.t] > 0
        if not inside.any():
            raise ValueError("expected some contact, got a contact region without area")
        kept, crossed = (np.nonzero(x)[0] for x in (inside.all(0), inside.any(0) & ~inside.all(0)))
        t = lone_first(self.t[:, crossed], inside[:, crossed])
        sides = np.sort([np.tile(t[0], 2), t[1:].ravel()], axis=0)
        n = self.p.shape[1]
        key, first, number = np.unique(
            sides[0] * np.int64(n) + sides[1], return_index=True, return_inverse=True
        )
        i, j = sides[:, first]
        share = level[i] / (level[i] - level[j])
        p = np.hstack([self.p, self.p[:, i] + share * (self.p[:, j] - self.p[:, i])])
        onward, back = n + number.reshape(2, -1)
        lone = level[t[0]] > 0
        corner = np.array([t[0], onward, back])[:, lone]
        a, b = (np.array(x)[:, ~lone] for x in ((onward, t[1], t[2]), (onward, t[2], back)))
        t = np.hstack([self.t[:, kept], corner, a, b])
        own = np.concatenate([kept, crossed[lone], crossed[~lone], crossed[~lone]])
        used, t = np.unique(t, return_inverse=True)
        if self.flat:
            values = self.values[own]
        else:
            values = np.append(self.values, np.zeros(len(key)))[used]
        plan = None if self.plan is None else np.append(self.plan, self.plan[i])[used]
        return Field(p[:, used], t.reshape(3, -1), values, self.cells[own], self.flat, plan)

    @cached_property
    def areas(self) -> ndarray:
        """Area of each triangle."""
        return np.abs(signed_areas(self.p, self.t))

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
        if self.plan is not None:
            _, first, place = np.unique(
                place * (self.plan.max() + 1) + self.plan, return_index=True, return_inverse=True
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


def continuous(basis: CellBasis, values: ArrayLike) -> Field:
    """The continuous field of any scalar basis, for lines of equal values.

    Elements of higher order are cut in triangles, on which they are taken as linear.

    Raises
    ------
    TypeError
        If ``basis`` is not a CellBasis.
    ValueError
        If the field is not a scalar or jumps between the elements, or the values are not finite
        or too many or too few.
    """
    if not isinstance(basis, CellBasis) or isinstance(basis.elem, FLAT):
        return Field.from_basis(basis, values, CONTINUOUS)  # which refuses it
    if isinstance(basis.elem, CONTINUOUS) and len(basis.nodal_dofs):
        return Field.from_basis(basis, values, CONTINUOUS)
    name = type(basis.elem).__name__
    if basis.elem.refdom.dim() != 2 or np.ndim(basis.basis[0][0]) != 2:
        raise ValueError(f"expected a plane basis of scalars, got one of {name}")
    _require_straight(basis)
    values = _checked(basis, values)
    kind = MeshTri if len(basis.mesh.t) == 3 else MeshQuad
    # not by `refinterp` of scikit-fem, which takes all elements of the mesh
    each = kind.init_refdom().refined(HIGHER)
    points = {"quadrature": (each.p, np.ones(each.nvertices)), "elements": basis.tind}
    finer = CellBasis(basis.mesh, basis.elem, basis.mapping, **points, dofs=basis.dofs)
    p, y = np.asarray(finer.global_coordinates()), np.ravel(finer.interpolate(values))
    begin = each.nvertices * np.arange(p.shape[1])
    p, t = p.reshape(2, -1), (each.t[:, None] + begin[:, None]).reshape(len(each.t), -1)
    # each element has points of its own: those in one place become one
    place = np.round((p - p.min(axis=1, keepdims=True)) / np.ptp(p, axis=1).max(), 9)
    _, first, number = np.unique(place[0] + 1j * place[1], return_index=True, return_inverse=True)
    if np.any(jump := abs(y - y[first][number]) > 1e-6 * np.ptp(y)):
        x = p[:, np.argmax(jump)]
        raise ValueError(
            f"expected a continuous field, got one of {name} that jumps at ({x[0]:.6g}, "
            f"{x[1]:.6g}). Remedy: project it onto ElementTriP1 first"
        )
    element = ElementTriP1() if kind is MeshTri else ElementQuad1()
    t = np.ascontiguousarray(number[t], dtype=np.int32)
    welded = kind(np.ascontiguousarray(p[:, first]), t)
    return Field.from_basis(CellBasis(welded, element), y[first], CONTINUOUS)


def _require_straight(basis: CellBasis) -> None:
    mesh = basis.mesh
    if mesh.elem not in CONTINUOUS:
        raise ValueError(
            f"expected straight elements that share their vertices, got a {type(mesh).__name__}. "
            f"Remedy: a basis on a {'MeshTri' if len(mesh.t) == 3 else 'MeshQuad'} of them"
        )


def _checked(basis: CellBasis, given: ArrayLike) -> ndarray:
    """One finite value for each DOF."""
    values = checked_array("values", given, None, each="DOF")
    if values.shape != (basis.N,):
        raise ValueError(
            f"expected values, one for each of the {basis.N} DOFs, got shape {values.shape}"
        )
    return values


def _levels(region: ContactRegion, x: ndarray) -> ndarray:
    """The level of a contact region at points of its plan."""
    if np.array_equal(x, region.p):
        return region.level
    areas = signed_areas(region.p, region.t)
    # quadrilaterals in the middle of a polar grid have sides without length
    t = region.t[:, areas > 1e-14 * areas.max()]
    whole = Fan(region.p, t, np.arange(t.shape[1]), eye(region.p.shape[1], format="csr"))
    triangle = whole.locate(x)
    if (missed := triangle < 0).any():  # some are on the boundary but for rounding
        middles = region.p[:, t].mean(axis=1)
        inwards = middles[:, cKDTree(middles.T).query(x[:, missed].T)[1]] - x[:, missed]
        x = x.copy()
        x[:, missed] += 1e-6 * inwards
        triangle[missed] = whole.locate(x[:, missed])
    if (triangle < 0).any():
        bad = np.argmax(triangle < 0)
        raise ValueError(
            f"expected the contact region of the plan drawn, got one without the point "
            f"{place(x[:, bad])}"
        )
    shares = whole.coordinates(triangle, x)
    return np.sum(shares * region.level[t[:, triangle]], axis=0)
