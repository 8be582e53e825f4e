"""Force and moments of the three fields of a couple."""

from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from ..elements.balance import LEFT, can_balance
from ..errors import ConvergenceError
from ..grids.corners import signed_areas
from ..kernels.once import computed_once
from .regular import RegularCouple

#: Newton's steps after which to give up, and errors of resultants that are rounding
STEPS, ROUNDING = 60, 1e-14


@dataclass(frozen=True, eq=False)
class Balance:
    """Force and moments of the three fields of a couple, and what they should be.

    Attributes
    ----------
    couple : RegularCouple
        The couple of grids and the fields of its regular parts.
    loads : (3, n) and (3, m) array of float
        Force and first moments of unit pressures on dual cells and on triangles.
    resultants : (2, 3) array of float
        Force and first moments of the pressures on dual cells and on triangles. The field on the
        general triangulation takes their mean.
    centre : (2,) array of float
        The point the moments refer to, the centroid of the plan.
    """

    couple: RegularCouple
    loads: tuple[ndarray, ndarray]
    resultants: ndarray
    centre: ndarray

    @computed_once
    def wanted(self) -> ndarray:
        """Resultants on dual cells, on triangles and of the field, moments over a length."""
        scaled = self.resultants / [1, self._size, self._size]
        return np.vstack([scaled, scaled.mean(axis=0)])

    @computed_once
    def _size(self) -> float:
        return float(np.sqrt(self.couple.areas[: len(self.couple.dual)].sum()))

    def _planes(self, x: ndarray) -> ndarray:
        """1, x and y of one unit at points."""
        return np.vstack([np.ones(x.shape[1]), (x - self.centre[:, None]) / self._size])

    @computed_once
    def _integrals(self) -> list[ndarray]:
        """Integrals of 1, x and y times the functions of each field, shape (3, ...)."""
        scale = np.array([[1.0], [self._size], [self._size]])
        p, t = self.couple.general.p, self.couple.general.t
        return [*(load / scale for load in self.loads), _hat_integrals(p, t, self._planes(p))]

    def completed(self, which: int, values: ndarray) -> ndarray:
        """Dual cells, triangles or the field (0, 1, 2) changed by a small linear function times
        their absolute values.

        That is the least change, in the sum of squares over the values; zero stays zero. Where
        it would change their sign, as on few cells in contact, they are multiplied by an
        exponential of a linear function if one does, so that pressures keep theirs. Those
        on a singular edge alone are multiplied, so that those inside remain the pressure in the
        points: the field is finite there where the pressure is not.

        Raises
        ------
        ConvergenceError
            If hardly any pressures are left to be multiplied.
        """
        couple, n = self.couple, len(self.couple.dual)
        points = [couple.x[:, :n], couple.x[:, n:], couple.general.p][which]
        part = [*couple.outer(2), couple.edge_nodes][which]
        if not can_balance(points, part & (values != 0)):
            part = np.ones(len(values), dtype=bool)
        integrals = self._integrals[which]
        # not with their signs: of pressures that are odd in x those times x have no moment left
        shares = self._planes(points[:, part]) * np.abs(values[part])
        missing = self.wanted[which] - integrals @ values
        out = values.copy()
        if not missing.any():
            return out
        matrix = integrals[:, part] @ shares.T
        change = np.linalg.lstsq(matrix, missing, rcond=None)[0]
        if np.abs(matrix @ change - missing).max() > LEFT * np.abs(integrals * values).sum():
            raise ConvergenceError(
                "too few pressures are left to carry force and moments. Remedy: smaller cells "
                "where contact is; or conserve=False"
            )
        out[part] += shares.T @ change
        if (out * values < 0).any():
            planes, resultants = self._planes(points), integrals * values
            for own in (part, values != 0):
                factor = _positive(resultants[:, own], planes[:, own], missing)
                if factor is not None:
                    out = values.copy()
                    out[own] *= factor
                    break
        return out


def _positive(resultants: ndarray, planes: ndarray, missing: ndarray) -> ndarray | None:
    """Exponentials of linear functions by which values have the resultants they miss, (n,).

    ``resultants``, (3, n), are those of the values at points where ``planes``, (3, n), are 1, x
    and y. None if there are none.
    """
    c, left = np.zeros(3), missing
    for _ in range(STEPS):
        factor = np.exp(c @ planes)
        try:
            step = np.linalg.solve((resultants * factor) @ planes.T, left)
        except np.linalg.LinAlgError:
            return None
        step *= min(1.0, 1.0 / np.abs(step @ planes).max())
        c = c + step
        left = missing - resultants @ np.expm1(c @ planes)
        if np.abs(left).max() <= ROUNDING * np.abs(resultants).sum():
            return np.exp(c @ planes)
    return None


def _hat_integrals(p: ndarray, t: ndarray, planes: ndarray) -> ndarray:
    """Integrals of hat functions times linear functions given at the nodes, shape (k, nodes)."""
    area = np.abs(signed_areas(p, t))
    return np.stack(
        [np.bincount(t.ravel(), (area / 12 * (g[t].sum(axis=0) + g[t])).ravel()) for g in planes]
    )
