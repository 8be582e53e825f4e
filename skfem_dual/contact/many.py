"""Contact of the same bodies under many loads.

While all cells stay in contact the pressures of any load are a superposition of those by the unit
motions. A load under which bodies lift off begins with the contact found under the load nearest to
it, and all share one inverse V of the matrix D: with gaps g of the cells O out of contact and the
slopes ``h = L p`` that some cells have lost, which made settlements ``S h``, the pressures are
``p = V (planes' s - gap + g + S h)``, where ``p_O = 0`` and ``h = L p`` are fewer equations than
those of the cells in contact wherever contact is the greater part.
"""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy import ndarray
from scipy.sparse import csr_matrix

from ..elements.slopes import Slopes
from ..errors import ConvergenceError
from ..kernels.once import computed_once
from .load import Constraints
from .loaded_cells import ExactRows, LoadedCells
from .methods import find_contact
from .problem import Contact
from .system import ContactSystem
from .unilateral import How, solve_scaled

#: so many contacts found are kept to begin others with
KEPT = 256
#: sets of contact tried, and how often they may not come nearer, before a load is solved alone
TRIES, PATIENCE = 20, 3
#: tension and overlap that count as nothing, over the largest pressure and settlement
ROUNDING = 1e-12


class Law(NamedTuple):
    """How pressures act where some cells have lost their slopes.

    Attributes
    ----------
    acting : (m, n) array of float
        Forces on the unit motions by unit pressures.
    lost : (2 n, n) csr_matrix
        The slopes that are lost, likewise.
    """

    acting: ndarray
    lost: csr_matrix


class Responses(NamedTuple):
    """Pressures and gaps of all cells while some are in contact.

    Attributes
    ----------
    contact : (n,) array of bool
        The cells in contact.
    pressure, gap : (n, m + 1) array of float
        By each unit motion, and in the last column without any.
    """

    contact: ndarray
    pressure: ndarray
    gap: ndarray


@dataclass(frozen=True, eq=False)
class ManyLoads:
    """The equations of `ContactSystem` under many loads.

    Attributes
    ----------
    system : ContactSystem
        The equations.
    cells : LoadedCells
        The cells.
    constraints : sequence of Constraints
        What is imposed in each of k cases.
    how : How
        How contact is found, of loads that are solved alone.
    """

    system: ContactSystem
    cells: LoadedCells
    constraints: Sequence[Constraints]
    how: How

    def solve(self) -> list[tuple[Contact, ndarray]]:
        """Contact and position in each case.

        Raises
        ------
        ConvergenceError
            If a body can move without resistance.
        """
        unilateral = self.how.unilateral
        together = self._loaded if self.how.method == "auto" else np.zeros_like(self._loaded)
        if not together.any():
            return [
                find_contact(self.system, constraints, self.how)
                for constraints in self.constraints
            ]
        moved = self._balanced(self._whole, self._full, self._given[:, together])
        pressure = self._full.pressure @ _and_one(moved)
        tension = -pressure.min(axis=0, initial=0.0) / np.abs(pressure).max(axis=0, initial=1e-300)
        full = tension <= ROUNDING if unilateral else np.ones(len(tension), dtype=bool)
        gap = self.system.matrix @ pressure - self._motions @ _and_one(moved)
        found: dict[int, tuple[Contact, ndarray]] = {}
        cases = np.nonzero(together)[0]
        failure = self.system.failure
        for i in np.nonzero(full)[0].tolist():
            p = pressure[:, i].clip(0) if unilateral else pressure[:, i]
            touching = np.ones(len(p), dtype=bool)
            contact = Contact(p, moved[:, i], gap[:, i], touching, not failure, failure)
            found[int(cases[i])] = contact, moved[:, i] * self._units
        # the less they pull in full contact, the sooner
        lifting = np.nonzero(~full)[0]
        found |= self._lifting_off(cases[lifting[np.argsort(tension[lifting], kind="stable")]])
        for k in np.nonzero(~together)[0].tolist():
            found[k] = find_contact(self.system, self.constraints[k], self.how)
        return [found[k] for k in range(len(self.constraints))]

    @computed_once
    def _units(self) -> ndarray:
        """Motions that move the bodies by about one, shape (m,)."""
        moved = np.abs(self.system.planes).max(axis=1)
        return 1 / np.where(moved > 0, moved, 1.0)

    @computed_once
    def _loaded(self) -> ndarray:
        """The cases in which forces and moments are imposed, and nothing else; mask."""
        return np.array([c.of_forces for c in self.constraints], dtype=bool)

    @computed_once
    def _given(self) -> ndarray:
        """Their forces and moments on the unit motions, shape (m, k); zero in other cases."""
        given = np.zeros((len(self._units), len(self.constraints)))
        for k in np.nonzero(self._loaded)[0].tolist():
            given[:, k] = self.constraints[k].given * self._units
        return given

    @computed_once
    def _motions(self) -> ndarray:
        """Settlement of the cells by the unit motions, and less the gap, shape (n, m + 1)."""
        planes = self.system.planes * self._units[:, None]
        return np.column_stack([planes.T, -self.system.gap])

    @computed_once
    def _full(self) -> Responses:
        """Those of contact everywhere."""
        by_motion = self.system.unit_pressures * self._units
        pressure = np.column_stack([by_motion, -self.system.shape_pressures])
        return Responses(np.ones(len(pressure), dtype=bool), pressure, np.zeros(pressure.shape))

    @computed_once
    def _columns(self) -> ndarray:
        """Settlements of the collocation points by unit pressures, those of a cell together."""
        return np.ascontiguousarray(np.asarray(self.system.matrix).T)

    @computed_once
    def _inverse(self) -> ndarray:
        """Pressures by unit settlements of the collocation points, those of a point together."""
        return np.ascontiguousarray(self.system.factors.solve(np.eye(len(self._columns))).T)

    @computed_once
    def _sloping(self) -> ndarray:
        """Settlements by unit slopes, those of a slope together, shape (2 n, n)."""
        return np.ascontiguousarray(self.cells.unit_slopes().T)

    @computed_once
    def _spread(self) -> ndarray:
        """Pressures by these settlements, shape (2 n, n)."""
        return self._sloping @ self._inverse

    @computed_once
    def _whole(self) -> Law:
        """That with all slopes."""
        n = len(self.system.areas)
        return Law(self.system.resultants * self._units[:, None], csr_matrix((2 * n, n)))

    @property
    def _slopes(self) -> Slopes:
        if self.cells.slopes is None:
            raise ValueError("expected cells with slopes, got none")
        return self.cells.slopes

    @computed_once
    def _arms(self) -> ndarray:
        """Moments on the tilts of the bodies by unit slopes, shape (m, 2 n)."""
        m, n = self.system.planes.shape
        moments, arms = self._slopes.second_moments.reshape(2, 2, n), np.zeros((m, 2, n))
        for body in range(0, m, 3):
            own = self.system.planes[body] != 0
            arms[body + 1 : body + 3, :, own] = moments[..., own]
        return arms.reshape(m, 2 * n)

    def without(self, flat: ndarray) -> tuple[ContactSystem, csr_matrix]:
        """The forces and moments where some cells are flat, in a system, and the slopes that are
        lost."""
        lost = self._slopes.without(~flat).matrix
        return replace(self.system, resultants=self.system.resultants - self._arms @ lost), lost

    def _responses(self, law: Law, contact: ndarray) -> Responses:
        """Those of some cells in contact, by the lesser number of equations."""
        inside, outside = np.nonzero(contact)[0], np.nonzero(~contact)[0]
        pressure, gap = np.zeros((2, *self._motions.shape))
        felt, lost, k = inside[:0], law.lost, len(outside)
        if law.lost.nnz:
            felt = np.nonzero(abs(law.lost) @ contact.astype(float))[0]
            lost = law.lost[felt]
        if k + len(felt) <= len(inside):
            full, spread = self._full.pressure, self._inverse[outside]
            transposed, known = spread.take(outside, axis=1), full[outside]
            if len(felt):
                spread = np.vstack([spread, self._spread[felt]])
                transposed = np.hstack([spread.take(outside, axis=1), (lost @ spread.T).T])
                transposed[k:, k:] -= np.eye(len(felt))
                known = np.vstack([known, lost @ full])
            unknown = np.linalg.solve(transposed.T, -known)
            pressure = full + spread.T @ unknown
            pressure[outside], gap[outside] = 0.0, unknown[:k]
        else:
            settled = self._columns[inside]
            if len(felt):
                settled -= lost[:, inside].T @ self._sloping[felt]
            pressure[inside] = np.linalg.solve(settled[:, inside].T, self._motions[inside])
            gap = settled.T @ pressure[inside] - self._motions
            gap[inside] = 0.0
        return Responses(contact, pressure, gap)

    def _balanced(self, law: Law, responses: Responses, given: ndarray) -> ndarray:
        """Motions under forces and moments, shapes (m, ...)."""
        stiffness, held = np.hsplit(law.acting @ responses.pressure, [-1])
        return solve_scaled(stiffness, given - held.reshape(-1, *[1] * (given.ndim - 1)))

    def flattened(
        self, k: int, flat: ndarray, start: ndarray
    ) -> tuple[Contact, ndarray, ContactSystem, csr_matrix] | None:
        """Contact and position in a case where some cells are flat, from pressures to begin with,
        and `without`; None if the case is to be solved alone."""
        if self.how.method != "auto" or not self._loaded[k] or not self.dense:
            return None
        system, lost = self.without(flat)
        law = Law(system.resultants * self._units[:, None], lost)
        answer = self._pivoted(law, self._responses(law, start > 0), self._given[:, k])
        if answer is None:
            return None
        return answer[0], answer[0].motion * self._units, system, lost

    def flattened_rows(self, exact: ExactRows, lost: csr_matrix) -> ExactRows:
        """Exact rows where some slopes are lost."""
        return ExactRows(exact.numbers, exact.rows - (lost.T @ self._sloping[:, exact.numbers]).T)

    @property
    def dense(self) -> bool:
        """Whether the equations have a matrix whose inverse serves all."""
        return isinstance(self.system.matrix, np.ndarray)

    def _lifting_off(self, cases: ndarray) -> dict[int, tuple[Contact, ndarray]]:
        """Contact and position in some cases, each from that of the load nearest to it."""
        found: dict[int, tuple[Contact, ndarray]] = {}
        size = np.linalg.norm(self._given, axis=0)
        size[size == 0] = 1.0
        place = self._given / size
        if self.system.gap.any():  # the contact of shaped bodies depends on more than proportions
            place = np.vstack([place, np.log(size)])
        kept: deque[tuple[int, Responses]] = deque(maxlen=KEPT)
        last = None
        for k in cases.tolist():
            nearby = self._full
            if kept:
                others = place[:, [i for i, _ in kept]]
                nearby = kept[int(np.argmin(np.abs(others.T - place[:, k]).sum(axis=1)))][1]
            answer = self._pivoted(self._whole, nearby, self._given[:, k]) if self.dense else None
            if answer is None:
                start = None if self.dense else last
                found[k] = find_contact(self.system, self.constraints[k], self.how, start)
                last = found[k][0].pressure if found[k][0].success else None
                continue
            found[k] = answer[0], answer[0].motion * self._units
            kept.append((k, answer[1]))
        return found

    def _pivoted(
        self, law: Law, responses: Responses, given: ndarray
    ) -> tuple[Contact, Responses] | None:
        """Contact from that of another load; wrong cells change side until there is none.

        None if they do not become fewer, or too few cells are left to resist tilts.
        """
        history: list[int] = []
        for _ in range(TRIES):
            try:
                moved = self._balanced(law, responses, given)
            except ConvergenceError:
                return None
            motion = np.append(moved, 1.0)
            pressure, gap = responses.pressure @ motion, responses.gap @ motion
            settled = gap + self._motions @ motion
            tension = pressure < -ROUNDING * np.abs(pressure).max()
            overlap = gap < -ROUNDING * np.abs(settled).max()
            wrong = np.where(responses.contact, tension, overlap)
            history.append(int(wrong.sum()))
            if not wrong.any():
                touching, steps = responses.contact, tuple(map(float, history))
                unit = responses.pressure[:, :-1] / self._units
                contact = Contact(
                    pressure.clip(0), moved, gap, touching, history=steps, unit_pressures=unit
                )
                return contact, responses
            if len(history) > PATIENCE and history[-1] >= max(history[-1 - PATIENCE : -1]):
                return None
            contact = responses.contact ^ wrong
            if contact.sum() < len(moved):
                return None
            responses = self._responses(law, contact)
        return None


def _and_one(moved: ndarray) -> ndarray:
    """Motions of k cases above a row of ones."""
    return np.vstack([moved, np.ones((1, moved.shape[1]))])
