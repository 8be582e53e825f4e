"""Where a structure faces the ground: its deflections there, and the work of pressures on them."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy import ndarray
from scipy.sparse import csr_matrix, diags
from skfem import CellBasis, FacetBasis

from ..arguments import checked_instance
from ..contact.footprint import Footprint
from ..elements.load_matrix import load_matrix
from ..elements.point_values import values_inside
from ..elements.shape_functions import ShapeFunctions, require_places, settling
from ..grids.mappings import inverting
from ..grids.polygons import readonly
from ..grids.trace import checked_facets
from ..kernels.once import computed_once


def require_facing(structure: Any, boundary: Any) -> None:
    """Refuse what is no basis on elements, a solid of which it is not told where it faces the
    ground, and a plate of which it is.

    Raises
    ------
    TypeError, ValueError
        That.
    """
    remedy = "name the facets of a solid by boundary="
    checked_instance("structure", structure, CellBasis, remedy)
    require_places("structure", structure)
    solid = structure.mesh.dim() == 3
    if solid == (boundary is None):
        raise ValueError(
            "expected the boundary of a 3-D solid that faces the ground, boundary=, got none"
            if solid
            else "expected a boundary of a 3-D solid only, got one of a plate"
        )


@dataclass(frozen=True, eq=False)
class Interface:
    """Between a structure of N DOFs and the n cells under it.

    Attributes
    ----------
    structure, boundary, component
        As of `ElasticPunch`.
    footprint : Footprint
        The cells.
    """

    structure: CellBasis
    boundary: Any
    component: int | None
    footprint: Footprint

    @computed_once
    def basis(self) -> CellBasis | FacetBasis:
        """The basis of the structure where it faces the ground: its own, or on the facets."""
        if self.boundary is None:
            return self.structure
        basis, mesh = self.structure, self.structure.mesh
        facets = checked_facets(mesh, self.boundary)
        try:
            if basis.tind is None:
                # not by basis.boundary(), which numbers DOFs anew
                return FacetBasis(
                    mesh, basis.elem, inverting(basis.mapping), facets=facets, dofs=basis.dofs
                )
        except NotImplementedError:  # by scikit-fem, of prisms
            pass
        raise TypeError(
            "expected a solid of tetrahedra or hexahedra and a basis on all of them, got a "
            f"basis on {basis.nelems} of {mesh.nelements} elements of a "
            f"{type(mesh).__name__}. Remedy: a basis on mesh.restrict(elements), or "
            "tetrahedra for prisms"
        )

    @property
    def upward(self) -> bool:
        """Whether pressures work on a displacement out of the ground."""
        return self.boundary is not None and self.component is None

    @computed_once
    def _work(self) -> csr_matrix:
        """Work of unit mean pressures and of unit slopes along x and y, shape (N, 3 n)."""
        matrix = self.footprint.load_matrix(self.basis, component=self.component)
        return -matrix if self.upward else matrix

    @computed_once
    def loads(self) -> csr_matrix:
        """L, work of unit mean pressure on each cell against deflections, shape (N, n)."""
        return self.loads_of(self.footprint)

    def loads_of(self, cells: Footprint) -> csr_matrix:
        """Work of unit mean pressures with their slopes, if cells may be flat; shape (N, n)."""
        return cells.with_slopes(self._work)

    @computed_once
    def trace(self) -> csr_matrix:
        """T, deflection of each collocation point, positive into the ground, shape (n, N).

        Where that of a cell around a re-entrant corner lies outside of the structure it is the
        mean over the cell, the same for linear deflections.
        """
        basis, cells = self.basis, self.footprint
        matrix, outside = values_inside(basis, cells.collocation_points, self.component)
        if len(outside):
            uniform = cells.partition, None, cells.fan
            share = np.bincount(outside, minlength=len(cells)) / cells.partition.areas
            loads = load_matrix(*uniform, basis, component=self.component)
            matrix = matrix + (loads @ diags(share)).T
        return -matrix if self.upward else matrix

    @computed_once
    def settling(self) -> ndarray:
        """DOFs of a settlement of the whole structure by one, shape (N,)."""
        return readonly(self.sense * settling(self.structure, self.component))

    @computed_once
    def sense(self) -> float:
        """1 if what the pressure works on is positive into the ground, -1 if it is out of it."""
        work = self.loads.T @ settling(self.structure, self.component)
        return float(np.sign(work.sum()))

    @computed_once
    def up(self) -> float:
        """1, or -1 under a solid whose z is downwards: the direction of z away from the ground."""
        up = ShapeFunctions.of(self.basis, self.component).up
        return 1.0 if up is None else float(up[0])

    def bent_within(self, displacement: ndarray, touching: ndarray) -> tuple[float, int]:
        """How far the mean deflection of a cell in contact is from that in its middle, over the
        largest of these, and of which cell: where that is much the cells are too large for how
        the structure bends. On the edge of the plan pressures act elsewhere."""
        partition = self.footprint.partition
        inner = touching.copy()
        inner[partition.f2c[0, partition.f2c[1] < 0]] = False
        middle = self.trace @ displacement
        mean = (self._work[:, : len(partition)].T @ displacement) / partition.areas
        off = np.where(inner, np.abs(mean - middle), 0.0)
        largest = np.abs(middle[touching]).max(initial=0.0)
        cell = int(off.argmax())
        return (float(off[cell] / largest) if largest > 0 else 0.0), cell
