"""Shaped punches once more, with pressures that end where contact does, inside the cells.

Found by cells, contact ends between them, and their pressures are constant where those of smooth
contact fall like the root of the distance to its edge. So that edge is drawn, the cells along it
take this law, see `LineWeights`, and the equations are solved again: collocation points in contact
settle as the punch does, cells whose point is out of contact carry in their part of it what their
neighbours do. Twice: the edge follows the better pressures.
"""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy import ndarray

from ..elements.edge_correction import EdgeCorrection
from ..elements.line_weights import LineWeights
from ..errors import ConvergenceError
from .footprint import Footprint
from .load import Constraints
from .problem import Contact
from .verify import Verification

#: solutions, and cells in contact from which on it has an edge along which pressures have the law
TIMES, FEWEST = 2, 60
#: up to so many cells it is cheap to solve between those in contact again
MOST = 3000


def on_line(footprint: Footprint, line: LineWeights | None) -> Footprint:
    """Cells that are weighted along a line of contact, if there is one."""
    return footprint if line is None else replace(footprint, weights=line)


def with_line_law(
    punch: Any, constraints: Constraints, contact: Contact, position: ndarray
) -> tuple[Contact, ndarray]:
    """Contact and position of a shaped rigid punch with the law of the line of contact.

    They are those found by cells where contact covers the plan or fewer than 60 cells, where the
    cells have another law or no matrix of up to 3000 of them, and where no contact on such a line
    obeys the equations: ``line`` of the contact tells.
    """
    cells, found = punch.footprint, (contact, position)
    small = isinstance(punch.operator, np.ndarray) and len(cells) <= MOST
    small = small and cells.collocation == "centroid"
    if punch.gap is None or cells.weights is not None or not small or not contact.success:
        return found
    pressure, gap = contact.pressure, np.where(contact.touching, 0.0, contact.gap.clip(0))
    for _ in range(TIMES):
        region = cells.triangles.region(pressure, gap, cells.substrate.surface.contact_modulus)
        if not region.edge or np.sum(pressure > 0) < FEWEST:
            return found
        line = LineWeights.from_lines(
            cells.partition, cells.fan, region.edge, cells.collocation_points, gap == 0
        )
        answer = _on_line(punch, on_line(cells, line), line, constraints)
        if answer is None:
            return found
        again, moved = answer
        gap = np.where(again.touching, 0.0, again.gap.clip(0))
        pressure = np.where(gap == 0, line.at_points(again.pressure), 0.0)
        found = replace(again, history=(*contact.history, *again.history), line=line), moved
    return found


def _on_line(
    punch: Any, cells: Footprint, line: LineWeights, constraints: Constraints
) -> tuple[Contact, ndarray] | None:
    """Contact of cells weighted along a line, and position; None if there is none."""
    x, carried = cells.collocation_points, line.carried()
    if cells.substrate.remainder is None:
        matrix = np.array(punch.operator)
        EdgeCorrection.from_weights(line, cells.substrate.singular_coefficient, x).add_to(matrix)
    else:
        matrix = cells.influence(x)
    system = replace(punch.system, matrix=matrix @ carried, resultants=cells.resultants @ carried)
    try:
        contact, position = system.unilateral(
            constraints, "active-set", line.in_contact.astype(float)
        )
    except ConvergenceError:
        return None
    contact = Verification(system, constraints, True)(contact, position)
    if not contact.success:
        return None
    return replace(contact, pressure=carried @ contact.pressure), position
