"""How a structure moves without resistance of its own: what the ground resists, and what nothing
does."""

from dataclasses import dataclass

import numpy as np
from numpy import ndarray
from scipy.sparse import csr_matrix, diags
from scipy.sparse.csgraph import connected_components

from ..grids.partition import Partition
from ..grids.polygons import readonly
from ..kernels.once import computed_once
from ..messages import place
from ..operators.compliance import Compliance

#: deflections of the ground's surface below so many times the largest are none, and below so many
#: times what motions make of the structure, but for parts that are so many times as stiff
AT_REST, IDLE, ALIKE = 1e-8, 1e-6, 1e3
#: motions that move a cell by less of what they move others are rounding there
STILL = 1e-8
#: and so are parts less than that of shapes of unit length
SLIGHT = 1e-7


@dataclass(frozen=True, eq=False)
class FreeMotions:
    """Of a structure of N DOFs on n cells.

    Attributes
    ----------
    compliance : Compliance
        What it yields, and all its motions without resistance.
    trace : (n, N) sparse matrix
        Deflection of each collocation point.
    partition : Partition
        The cells.
    """

    compliance: Compliance
    trace: csr_matrix
    partition: Partition

    @property
    def resisted(self) -> ndarray:
        """Displacements that move it against the ground, shape (N, m)."""
        return self._split[0]

    @property
    def idle(self) -> ndarray:
        """Displacements that leave the collocation points where they are, shape (N, k), as
        sliding does."""
        return self._split[1]

    @computed_once
    def _split(self) -> tuple[ndarray, ndarray]:
        """Motions that the ground resists, and those that nothing resists."""
        all_motions = self.compliance.motions
        deflections = self.trace @ all_motions
        # each over what it makes of the ground: deflections are no slopes, which have other units
        reach, usual = np.linalg.norm(deflections, axis=0), self._moved(all_motions)
        size = np.where(reach > IDLE * usual, reach, usual)
        size[size == 0.0] = 1.0
        reached = np.linalg.svd(np.linalg.qr(deflections / size, mode="r"))[1]
        least = max(AT_REST * reached.max(initial=0.0), IDLE * (usual / size).max(initial=0.0))
        count = int(np.sum(reached > least))
        # not as many rows as cells
        rows = np.linalg.svd(np.linalg.qr(deflections, mode="r"))[2]
        split = all_motions @ rows.T
        return readonly(split[:, :count]), readonly(split[:, count:])

    @computed_once
    def parts(self) -> tuple[ndarray, ndarray]:
        """Numbers of the parts of the structure that hang together: of each DOF, shape (N,), and
        of each cell, shape (n,). DOFs that are held move none, and are parts of their own."""
        moving = diags((self.compliance.units > 0).astype(float))
        linked = csr_matrix(moving @ self.compliance.stiffness @ moving)
        linked.eliminate_zeros()
        _, part = connected_components(linked, directed=False)
        # a cell is of the part it moves with: DOFs may be held by entries of their own
        share = np.abs(self.resisted).max(axis=1, initial=0.0)
        weight = diags(share) if share.any() else moving
        most = np.asarray(abs(self.trace @ moving @ weight).argmax(axis=1)).ravel()
        return readonly(part), readonly(part[most])

    def require_load(self, loads: ndarray) -> None:
        """Refuse loads, with a ValueError, that leave out a part of the structure of which nothing
        else tells the position. Without any load all of it stays where it is."""
        part, cells = self.parts
        load = np.bincount(part, np.abs(loads), part.max() + 1)
        moved = np.abs(self.trace @ self.resisted).max(axis=1, initial=0.0)
        lost = (load == 0.0)[cells] & (moved > STILL * moved.max())
        if loads.any() and lost.any():
            raise ValueError(
                f"expected loads on all of the structure, got none on {self._with_cells(lost)}, "
                "and nothing else tells its position. Remedy: its weight, or hold it, D="
            )

    def untold(self, pressing: ndarray) -> str:
        """What presses nowhere, where some cells do, (n,) array of bool, and moves without
        resistance while these stay where they are, in words; none if nothing does."""
        shapes, _ = np.linalg.qr(self.trace @ self.resisted)
        _, sizes, rows = np.linalg.svd(np.linalg.qr(shapes[pressing], mode="r"))
        moved = shapes @ rows[np.count_nonzero(sizes > SLIGHT) :].T
        size = np.abs(moved).max(axis=1, initial=0.0)
        lost = size > SLIGHT
        part = self.partition.parts(lost)
        plane = np.column_stack([np.ones(len(lost)), self.partition.centroids.T])
        plane[:, 1:] -= plane[:1, 1:]
        for own in (lost & (part == number) for number in np.unique(part[lost])):
            level = np.linalg.lstsq(plane[own], moved[own], rcond=None)[0]
            off = np.abs(plane @ level - moved).max(axis=1)
            still = off <= IDLE * size[own].max()
            # one that turns on a few cells that press moves as a plane through these
            if not (still[own].all() and still[pressing].any()):
                return self._with_cells(own)
        return ""

    def _with_cells(self, cells: ndarray) -> str:
        """A part of the structure by some of the cells under it, in words."""
        cell = int(cells.argmax())
        at = place(self.partition.centroids[:, cell])
        whole = "the structure"
        return whole if cells.all() else f"the part of {whole} with cell {cell} at {at}"

    def _moved(self, motions: ndarray) -> ndarray:
        """Deflection of the ground's surface if each motion moved its DOFs as far as any others,
        in their units: where structures only slide and turn, that which they cause is rounding."""
        units, on_ground = self.compliance.units, np.diff(self.trace.tocsc().indptr) > 0
        usual = units[on_ground & (units > 0)]
        if not len(usual):
            return np.zeros(motions.shape[1])
        some = units > np.median(usual) / ALIKE
        reach = np.linalg.norm(abs(self.trace) @ units)
        return reach * np.abs(motions[some] / units[some, None]).max(axis=0, initial=0.0)

    def steadied(self, displacement: ndarray) -> ndarray:
        """Without the part along motions that nothing resists, such as sliding on the ground."""
        idle, _ = np.linalg.qr(self.idle)
        return displacement - idle @ (idle.T @ displacement)
