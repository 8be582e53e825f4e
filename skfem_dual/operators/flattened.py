"""An operator for cells some of which have lost the slopes of their pressures."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy import ndarray

from ..elements.slope_correction import SlopeCorrection
from ..elements.slopes import Slopes
from ..kernels.once import computed_once
from .influence_operator import InfluenceOperator
from .preconditioner import Preconditioner


@dataclass(frozen=True, eq=False)
class FlattenedOperator:
    """Settlements under pressures, less what slopes make in some cells.

    Attributes
    ----------
    operator : InfluenceOperator
        With the slopes of all cells.
    sloping : SlopeCorrection
        Of the same points.
    left_out : Slopes
        Those of the cells that have lost theirs.
    """

    operator: InfluenceOperator
    sloping: SlopeCorrection
    left_out: Slopes

    @property
    def shape(self) -> tuple[int, int]:
        """Shape of the matrix."""
        return self.operator.shape

    @property
    def rtol(self) -> float:
        """Accuracy of the products."""
        return self.operator.rtol

    def __matmul__(self, pressure: ndarray) -> ndarray:
        """Product with pressures of shape (n,) or (n, k)."""
        if self.operator.summation is not None and self._left is not None:
            return self.operator.with_slopes(pressure, self._left.of_rows)
        if pressure.ndim == 2:
            return np.stack([self @ column for column in pressure.T], axis=1)
        return self.operator @ pressure - self.sloping.apply(self.left_out.of(pressure))

    @computed_once
    def _left(self) -> Slopes | None:
        """The slopes of the other cells."""
        slopes = self.operator.slopes
        return None if slopes is None else slopes.without(self.left_out.sloped)

    def to_dense(self) -> ndarray:
        """The matrix."""
        matrix = np.array(self.operator.to_dense())
        self.sloping.add_to(matrix, self.left_out, -1.0)
        return matrix

    @computed_once
    def preconditioner(self) -> Any:
        """Approximate inverse: that of the whole operator."""
        return Preconditioner.from_operator(self.operator)
