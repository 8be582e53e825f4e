"""What a ground and the structure on it yield together under the pressures between them."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy import ndarray
from scipy.sparse import csr_matrix

from ..kernels.once import computed_once
from .compliance import BalancedCompliance, Compliance, Structures
from .factors import Factors
from .flattened import FlattenedOperator
from .influence_operator import InfluenceOperator
from .preconditioner import approximate_inverse
from .small_compliance import SmallCompliance

#: columns of the structure's part of a dense matrix that are solved for together
TOGETHER = 64
#: samples of rounding errors, which differ by more than ten times
SAMPLES = 4
#: iterations need not be more accurate than this
ROUNDING = 1e-12
#: why they may not end, and what to do
TOO_SOFT = (
    "likely cause: a structure far softer than the ground, whose inverse alone guides them. "
    'Remedy: method="auto", which up to 4000 cells ends with an active set'
)


@dataclass(frozen=True, eq=False)
class YieldingOperator:
    """Settlement of the ground less deflection of the structure, by pressures on the cells.

    Of a structure with the compliance C it is ``A + T C L``: the pressures of the cells lift the
    structure from below as much as they press the ground down. Only products are made, each that
    of the ground and one solution with the factors of the stiffness.

    Attributes
    ----------
    ground : (n, n) array of float, InfluenceOperator or FlattenedOperator
        A, settlement of each collocation point under unit pressure on each cell.
    structure : Compliance, SmallCompliance, BalancedCompliance or Structures
        C, displacements under loads, N DOFs.
    trace : (n, N) csr_matrix
        T, deflection of each collocation point, positive into the ground.
    loads : (N, n) csr_matrix
        L, work of unit pressure on each cell against deflections.
    """

    ground: ndarray | InfluenceOperator | FlattenedOperator
    structure: Compliance | SmallCompliance | BalancedCompliance | Structures
    trace: csr_matrix
    loads: csr_matrix

    @property
    def shape(self) -> tuple[int, int]:
        """Shape of the matrix."""
        n = self.trace.shape[0]
        return n, n

    @property
    def rtol(self) -> float:
        """Accuracy of the products."""
        return ROUNDING if isinstance(self.ground, np.ndarray) else self.ground.rtol

    def __matmul__(self, pressure: ndarray) -> ndarray:
        """Product with pressures of shape (n,) or (n, k)."""
        lifted = self.structure.displacements(self.loads @ pressure)
        return self.ground @ pressure + self.trace @ lifted

    def rounding(self, pressure: ndarray) -> float:
        """How far deflections under the pressure are off by rounding: those under random parts of
        the loads make up those under all of them but for that; the largest of some samples."""
        loads = self.loads @ pressure
        parts = loads[:, None] * np.random.default_rng(0).random((len(loads), SAMPLES))
        columns = np.column_stack([loads, parts, loads[:, None] - parts])
        whole, one, other = np.split(
            self.structure.displacements(columns), [1, 1 + SAMPLES], axis=1
        )
        return float(np.abs(self.trace @ (whole - one - other)).max())

    def to_dense(self) -> ndarray:
        """The matrix."""
        ground = self.ground
        out = np.array(ground if isinstance(ground, np.ndarray) else ground.to_dense())
        for start in range(0, len(out), TOGETHER):
            columns = slice(start, min(start + TOGETHER, len(out)))
            loads = self.loads[:, columns].toarray()
            out[:, columns] += self.trace @ self.structure.displacements(loads)
        return out

    @computed_once
    def preconditioner(self) -> Any:
        """Approximate inverse: that of the ground alone, beside which a structure yields to few
        shapes of pressure only."""
        if isinstance(self.ground, InfluenceOperator):
            return approximate_inverse(self.ground)
        if isinstance(self.ground, FlattenedOperator):
            return self.ground.preconditioner
        # iterations end with what they make of a sum: it must be the sum of what they made
        return Factors.from_matrix(np.asarray(self.ground), single=False)
