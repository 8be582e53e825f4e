"""Positions that the usual roads miss: without contact, and imposed where no reaction acts."""

from collections.abc import Callable

import numpy as np
import scipy
from numpy import ndarray
from scipy.linalg import lstsq, null_space

from .load import Constraints
from .problem import Contact, ContactProblem

#: without contact the gaps are larger than so many times the largest, and how well that is met
CLEAR, FEASIBLE = 1e-8, 1e-10
#: forces between which a settlement is looked for, in steps of their ratio, up and down
RATIO, STEPS = 4.0, 16
#: forces that are tried at most
MOST = 100
#: ratio of forces that are not told apart, and change of a component that is none
CLOSE, SAME = 1.02, 1e-6

Solve = Callable[[Constraints], tuple[Contact, ndarray]]


def apart(problem: ContactProblem, still: bool = False) -> Contact | None:
    """A position without contact, if the load allows for one, by the least motions or by none."""
    if problem.given.any():
        return None
    k = len(problem.planes)
    motion = np.zeros(k)
    if problem.gap.min() < 0:
        if still or not k:
            return None
        scale = np.abs(problem.gap).max()
        # in terms of both signs of the motions, none negative
        planes = np.vstack([problem.planes, -problem.planes]).T
        room, options = problem.gap / scale - CLEAR, {"primal_feasibility_tolerance": FEASIBLE}
        found = scipy.optimize.linprog(np.ones(2 * k), planes, room, options=options)
        if not found.success:
            return None
        motion = scale * (found.x[:k] - found.x[k:])
    return Contact.nowhere(problem, motion)


def by_force(
    constraints: Constraints, stiffness: ndarray, height: float, solve: Solve, rtol: float
) -> tuple[Contact, ndarray] | None:
    """Contact and position where one component is imposed and the reaction acts on another.

    The force is found under which the component comes out as imposed. With the force given the
    problem is one of least energy, which the usual methods solve.

    Parameters
    ----------
    constraints : Constraints
        Of one body or more; the force on the first is found that is not where its reaction acts,
        and ``solve`` is left with those on others.
    stiffness : (m, m) array of float
        Resultants by unit components of the position, all cells in contact.
    height : float
        About how far the body is pressed.
    solve : callable
        Contact and position for constraints that give all resultants of that body.
    rtol : float
        Accuracy of the component.

    Returns
    -------
    Contact, position
        None if no force leads there.
    """
    own = _elsewhere(constraints)
    if own is None or height == 0:
        return None
    rows, columns = own
    motions, balance = constraints.motions[rows, columns], constraints.balance[columns, rows]
    along, across = null_space(balance), null_space(motions.T)
    if along.shape[1] != 1 or across.shape[1] != 1:
        return None
    stiffness = stiffness[rows, rows]
    along = along[:, 0] * np.sign(along[:, 0] @ stiffness[:, 0])
    across = across[:, 0] * (-1.0 if across[0, 0] < 0 else 1.0)
    first = lstsq(balance, constraints.given[columns])[0]
    if along[0]:  # by the force itself, whatever the unit of length
        along = along / along[0]
        first = first - first[0] * along
    answers: dict[float, tuple[Contact, ndarray, float]] = {}

    def missed(force: float) -> float:
        """How far the component is off; NaN if there is no answer."""
        if force in answers:  # from other pressures to begin with it might have another sign
            contact, _, off = answers[force]
            return off if contact.success else np.nan
        contact, position = solve(_loaded(constraints, own, first + force * along))
        off = float(across @ (position - constraints.fixed)[rows])
        answers[force] = contact, position, off
        return off if contact.success else np.nan

    # in full contact
    moved, offset = across @ lstsq(stiffness, np.column_stack([along, first]))[0]
    if moved == 0:
        return None
    guess = (height - offset) / moved
    bracket = _bracket(missed, guess if guess > 0 else height / abs(moved))
    if bracket is None:
        return None
    force = scipy.optimize.brentq(missed, *bracket, xtol=1e-300, rtol=max(rtol, 1e-15), disp=False)
    contact, position, off = min(answers.values(), key=lambda answer: abs(answer[2]))
    if not contact.success or not np.isfinite(force):
        return None
    position = position.copy()
    position[rows] -= off * across
    return contact, position


def _elsewhere(constraints: Constraints) -> tuple[slice, slice] | None:
    """Components of the first body whose reaction does not act where its position is imposed, and
    its conditions, which follow each other; None if there is none."""
    motions, balance = constraints.motions, constraints.balance
    for begin in range(0, len(motions), 3):
        rows = slice(begin, begin + 3)
        some = np.nonzero(motions[rows].any(axis=0) | balance[:, rows].any(axis=1))[0]
        columns = slice(some.min(initial=len(balance)), some.max(initial=-1) + 1)
        if not np.array_equal(motions[rows, columns], balance[columns, rows].T):
            return rows, columns
    return None


def _loaded(constraints: Constraints, own: tuple[slice, slice], forces: ndarray) -> Constraints:
    """The same with forces on the components of a body and no other conditions on it."""
    rows, columns = own
    unit = np.eye(len(constraints.fixed))
    fixed = constraints.fixed.copy()
    fixed[rows] = 0.0
    return Constraints(
        np.hstack([np.delete(constraints.motions, columns, axis=1), unit[:, rows]]),
        fixed,
        np.vstack([np.delete(constraints.balance, columns, axis=0), unit[rows]]),
        np.append(np.delete(constraints.given, columns), forces),
    )


def _bracket(missed: Callable[[float], float], guess: float) -> tuple[float, float] | None:
    """Two forces between which ``missed`` changes its sign, not far from the guess."""
    known = {guess: missed(guess)}
    while len(known) < MOST:
        forces = np.array(sorted(known))
        values = np.array([known[force] for force in forces])
        between = np.nonzero(values[:-1] * values[1:] <= 0)[0]
        if len(between):
            away = np.abs(np.log(forces[between] * forces[between + 1] / guess**2))
            i = between[np.argmin(away)]
            return float(forces[i]), float(forces[i + 1])
        force = _untried(forces, values, guess)
        if force is None:
            return None
        known[force] = missed(force)
    return None


def _untried(forces: ndarray, values: ndarray, guess: float) -> float | None:
    """The force to try next: where answers end, where they come near, or farther out."""
    answered, off = np.isfinite(values), np.abs(values)
    apart = forces[1:] > CLOSE * forces[:-1]
    # up to some force, or from it on, loads turn the body over
    ends = np.nonzero(apart & (answered[:-1] != answered[1:]))[0]
    if len(ends):
        return float(np.sqrt(forces[ends[0]] * forces[ends[0] + 1]))
    # the component may turn before it comes out as imposed
    least = 1 + np.nonzero((off[1:-1] <= off[:-2]) & (off[1:-1] <= off[2:]))[0]
    for i in least:
        wide = np.log(forces[i - 1 : i + 2])
        k = i - 1 if wide[1] - wide[0] > wide[2] - wide[1] else i
        if apart[k]:
            return float(np.sqrt(forces[k] * forces[k + 1]))
    # far out it is proportional to the force, and near none it is what is left without
    ahead = not (answered[-1] and (off[-2:] > 2 * off[-3:-1]).sum() == 2)
    alike = len(off) > 1 and abs(off[0] - off[1]) < SAME * off[0]
    back = (answered[0] and not alike) or not answered.any()
    steps = np.log(np.array([guess / forces[0], forces[-1] / guess])) / np.log(RATIO)
    steps[~np.array([back, ahead])] = np.inf
    if steps.min() > STEPS - 0.5:
        return None
    return float(forces[0] / RATIO if steps[0] <= steps[1] else forces[-1] * RATIO)


def noise(problem: ContactProblem, contact: Contact) -> bool:
    """Whether the ground settles by rounding errors only, where a force might be found."""
    if problem.conjugate and problem.given.any():
        return False
    settled = contact.gap - problem.gap + contact.motion @ problem.planes
    return bool(np.abs(settled).max() <= 1e-12 * np.abs(problem.gap).max())
