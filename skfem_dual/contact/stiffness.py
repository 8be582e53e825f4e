"""Forces and moments that move a rigid base: vertical motions and tilts, sliding and twist."""

from abc import abstractmethod
from typing import Any

import numpy as np
from numpy import ndarray

from ..arguments import checked_flag
from ..kernels.once import computed_once
from .body import Body
from .motions import Motions, moving
from .system import ContactSystem
from .work import Work


class Movable(Body):
    """A rigid base that touches everywhere, and what it takes to move it."""

    origin: Any
    gap: Any

    @property
    @abstractmethod
    def system(self) -> ContactSystem:
        """The equations for pressures and the position of the plan's centroid."""

    @property
    @abstractmethod
    def work(self) -> Work:
        """Positions by the work of the pressures."""

    def stiffness(self, *, full: bool = False, rough: bool = False) -> ndarray:
        """Force and moments by unit settlement and unit tilts, or by all six motions.

        Parameters
        ----------
        full : bool
            Whether the base also slides and twists; not on layers on a smooth rigid base.
        rough : bool
            Whether the base is bonded to the ground everywhere, so that pressures and shear
            tractions are coupled; ``full`` only. Otherwise it is relaxed: horizontal motions are
            carried by shear tractions alone, vertical ones by pressures alone.

        Returns
        -------
        (3, 3) or (6, 6) array of float
            Maps ``(W0, Lx, Ly)`` of (3) to the integrals of ``p``, ``p x`` and ``p y`` with the
            coordinates from ``origin``. Symmetric up to the error of the discretisation.
            If ``full``, ``(W0, Lx, Ly, Ux, Uy, twist)`` to these and ``(Hx, Hy, T)``: horizontal
            displacements of the origin along x and y, and the rotation about the vertical, from x
            towards y; the force on the base and its moment likewise. Under a flat punch with a
            singular edge by the work of the tractions, which is closer; symmetric.

        Raises
        ------
        ValueError
            If ``rough`` without ``full``, or if ``full`` and the ground does not hold horizontal
            forces or there are more than 4000 cells.

        Examples
        --------
        >>> from skfem import MeshTri
        >>> from skfem_dual import DualMesh, HalfSpace, RigidPunch
        >>> dual = DualMesh.from_mesh(MeshTri.init_circle(4))
        >>> K = RigidPunch(HalfSpace(1.0, 0.0), dual.basis()).stiffness()
        >>> [round(float(k), 2) for k in K.diagonal()]  # exact for the circle: 2, 4/3, 4/3
        [2.0, 1.33, 1.33]
        """
        if checked_flag("full", full):
            return self._full_stiffness(checked_flag("rough", rough))
        if checked_flag("rough", rough):
            raise ValueError("expected full=True with rough=True: a smooth base moves vertically")
        shift = np.eye(3)
        shift[0, 1:] = self.centre - self.origin
        return shift.T @ self.system.stiffness @ shift

    def _full_stiffness(self, rough: bool) -> ndarray:
        shift = moving(self.centre - self.origin)
        if rough:
            whole = np.ones(len(self.footprint), dtype=bool)
            return shift.T @ Motions(self.footprint, True, whole).stiffness @ shift
        stiffness = np.zeros((6, 6))
        stiffness[3:, 3:] = self.relaxed_motions.stiffness
        by_work = self.gap is None and self.weights is not None
        vertical = self.work.stiffness if by_work else self.system.stiffness
        stiffness[:3, :3] = (vertical + vertical.T) / 2
        return shift.T @ stiffness @ shift

    @computed_once
    def relaxed_motions(self) -> Motions:
        """Horizontal ones while the whole base touches."""
        return Motions(self.footprint, False, np.ones(len(self.footprint), dtype=bool))
