"""Sequences of loads."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from inspect import signature
from typing import Any

import numpy as np
from numpy import ndarray
from scipy.spatial import ConvexHull

from ..arguments import (
    Pair,
    checked_flag,
    checked_instance,
    checked_integer,
    checked_number,
    checked_pair,
    checked_sequence,
)
from ..contact.load import Load, load_of
from ..contact.unilateral import How
from ..errors import ConvergenceError
from ..grids.polygons import readonly
from ..kernels.once import ReadOnly
from ..messages import shown
from ..solutions.elastic_solution import ElasticSolution
from ..solutions.punch_solution import PunchSolution
from .cases import solve_cases
from .elastic import ElasticPunch
from .punch import RigidPunch

#: steps of the longest curve
MOST = 10**6


@dataclass(frozen=True, eq=False, repr=False)
class LoadPath(ReadOnly):
    """Solutions along a path of loads.

    Attributes
    ----------
    solutions : tuple of PunchSolution or ElasticSolution
        In the order of the loads.
    """

    solutions: tuple[Any, ...]

    def __len__(self) -> int:
        return len(self.solutions)

    def __getitem__(self, i: int) -> Any:
        return self.solutions[i]

    def __repr__(self) -> str:
        converged = sum(s.success for s in self.solutions)
        bends = any(isinstance(s, ElasticSolution) for s in self.solutions)
        head = "deflection" if bends else "settlement   tilt"
        rows = [f"  {s.force:<12.5g} {_position(s)}" for s in self.solutions]
        head = f"<skfem_dual {type(self).__name__} object>\n  force        {head}"
        return "\n".join([head, *rows, f"  {converged} of {len(self)} found"])

    @property
    def force(self) -> ndarray:
        """Forces, shape (k,)."""
        return np.array([s.force for s in self.solutions])

    @property
    def moments(self) -> ndarray:
        """First moments of the pressure from the origin, shape (2, k)."""
        return np.array([s.resultant[1:] for s in self.solutions]).reshape(-1, 2).T

    @property
    def settlement(self) -> ndarray:
        """Settlements of the origin of a rigid punch, shape (k,); a TypeError of a structure."""
        return np.array([s.settlement for s in self._rigid])

    @property
    def tilt(self) -> ndarray:
        """Inclinations of a rigid punch, shape (2, k); a TypeError of a structure."""
        return np.array([s.tilt for s in self._rigid]).reshape(-1, 2).T

    @property
    def contact_area(self) -> ndarray:
        """Areas in contact, shape (k,)."""
        return np.array([s.contact_area for s in self.solutions])

    @property
    def success(self) -> bool:
        """Whether every contact region was found."""
        return all(s.success for s in self.solutions)

    @property
    def messages(self) -> tuple[str, ...]:
        """What the solver says of each."""
        return tuple(s.message for s in self.solutions)

    @property
    def _rigid(self) -> tuple[PunchSolution, ...]:
        if any(isinstance(s, ElasticSolution) for s in self.solutions):
            raise TypeError(
                "expected a rigid punch for settlements and tilts, got a structure that bends. "
                "Remedy: [s.deflection(x) for s in path.solutions]"
            )
        return self.solutions


def _position(solution: PunchSolution | ElasticSolution) -> str:
    """Settlement and tilt in a row, or deflections from the least to the greatest."""
    if isinstance(solution, ElasticSolution):
        return " to ".join(f"{w:.5g}" for w in solution.deflection_range)
    return f"{solution.settlement:<12.5g} ({solution.tilt[0]:.5g}, {solution.tilt[1]:.5g})"


def load_path(
    punch: RigidPunch | ElasticPunch, loads: Iterable[Load | Mapping | ndarray], **options: Any
) -> LoadPath:
    """Solve for one load after the other, each from the contact found nearby.

    Parameters
    ----------
    punch : RigidPunch or ElasticPunch
        What stands on the ground.
    loads : iterable of Load, mapping or array
        What is imposed in each step: of a rigid punch a `Load` or its arguments, of a structure
        keyword arguments of its ``solve`` or its load vector.
    options
        Further arguments of ``solve`` for all steps; of a rigid punch ``unilateral``, ``method``,
        ``gap_rtol`` and ``progress``.

    Returns
    -------
    LoadPath

    Raises
    ------
    TypeError, ValueError
        If a load is no load, has a key that is not known or is given twice, or is impossible; says
        which.
        If an option is not known.

    Examples
    --------
    >>> from skfem import MeshTri
    >>> from skfem_dual import DualMesh, HalfSpace
    >>> dual = DualMesh.from_mesh(MeshTri.init_circle(3))
    >>> punch = RigidPunch(HalfSpace(1.0, 0.0), dual.basis())
    >>> path = load_path(punch, [{"force": 1.0, "at": (e, 0.0)} for e in (0.2, 0.4, 0.6)])
    >>> [round(float(area), 1) for area in path.contact_area]
    [3.1, 2.9, 1.7]
    """
    checked_instance("punch", punch, (RigidPunch, ElasticPunch))
    loads = checked_sequence("loads", loads)
    if isinstance(punch, RigidPunch):
        _require_known("the options", options, ["progress", *How._fields])
        return _together(punch, loads, options) if loads else LoadPath(())
    steps = []
    for number, load in enumerate(loads):
        step = {"f": load} if isinstance(load, np.ndarray) else load
        _require_keys(f"load {number}", checked_instance(f"load {number}", step, Mapping), options)
        steps.append(step)
    solutions: list[ElasticSolution] = []
    for number, step in enumerate(steps):
        # from full contact the next step is found at once; a failed one is no beginning
        last = solutions[-1] if solutions else None
        start = last if last is not None and last.iterations and last.success else None
        try:
            solutions.append(punch.solve(**step, start=start, **options))
        except (TypeError, ValueError) as error:
            raise type(error)(f"load {number}: {error}") from error
    return LoadPath(tuple(solutions))


def _require_keys(name: str, load: Mapping, options: Mapping) -> None:
    """Refuse what a structure's ``solve`` does not take, or would get twice."""
    known = sorted(signature(ElasticPunch.solve).parameters.keys() - {"self", "start"})
    for what, keys in ((name, load), ("the options", options)):
        _require_known(what, keys, known)
    if twice := [key for key in load if key in options]:
        raise TypeError(f"expected {twice[0]} in {name} or for all loads, got both")
    if "f" not in load and "f" not in options:
        raise TypeError(f"expected f in {name}, got {shown(sorted(load))}")


def _require_known(what: str, keys: Mapping, known: list[str]) -> None:
    if unknown := [key for key in keys if key not in known]:
        raise TypeError(f"expected keys of {what} among {known}, got {shown(unknown[0])}")


def _together(
    punch: RigidPunch, loads: Sequence[Load | Mapping], options: dict[str, Any]
) -> LoadPath:
    """Of a rigid punch, whose loads share what they can."""
    names = tuple(f"load {number}" for number in range(len(loads)))
    progress = checked_flag("progress", options.pop("progress", False))
    how = How.checked(**How()._asdict() | options)
    own = zip(names, loads, strict=True)
    given = [(punch.acted_on(load_of(*pair), how.unilateral, pair[0]),) for pair in own]
    found = solve_cases(punch, names, given, how, progress)
    for name, answer, message in zip(names, found.answers, found.messages, strict=True):
        if answer is None:
            raise ValueError(f"{name}: {message}")
    found.warn()
    return LoadPath(tuple(answer[0] for answer in found.answers if answer is not None))


@dataclass(frozen=True, eq=False, repr=False)
class MomentRotation(LoadPath):
    """A footing under a constant force and a growing moment.

    Attributes
    ----------
    solutions : tuple of PunchSolution
        In the order of the eccentricities.
    direction : (2,) array of float
        Unit vector along which the force moves out.
    eccentricity : (k,) array of float
        Its distances from the origin.
    lift_off : float
        Distance at which the footing begins to lift off; 0 if it has already, as the origin is
        outside of the kern; NaN for a shaped punch and on ground that may pull.
    overturning : float
        Distance at which it turns over: the edge of the plan's convex hull.
    """

    direction: ndarray
    eccentricity: ndarray
    lift_off: float
    overturning: float

    @property
    def moment(self) -> ndarray:
        """Force times eccentricity, shape (k,)."""
        return self.force * self.eccentricity

    @property
    def rotation(self) -> ndarray:
        """Inclination along ``direction``, shape (k,)."""
        return self.direction @ self.tilt


def moment_rotation(
    punch: RigidPunch, force: float, direction: Pair = (1.0, 0.0), steps: int = 24, **options: Any
) -> MomentRotation:
    """Moment-rotation curve of a footing up to 97 % of the overturning moment.

    On coarse meshes it ends before, where the pressure would act beyond the outermost cells.

    Parameters
    ----------
    punch : RigidPunch
        The footing; its origin must lie inside the convex hull of its plan.
    force : float
        The constant force.
    direction : pair of float
        Along which the force moves out.
    steps : int
        Number of solutions, closer to each other towards overturning.
    options
        As of `load_path`.

    Returns
    -------
    MomentRotation

    Raises
    ------
    ValueError
        If force or direction are zero, there are less than 2 steps, or the origin is outside, or
        farther out than the outermost cells act.
    TypeError
        If an argument is of another kind.
    ConvergenceError
        If so few cells resist no tilt.
    """
    checked_instance("punch", punch, RigidPunch)
    force = checked_number("force", force)
    if force == 0:
        raise ValueError("expected a force that has a moment where it moves out, got force=0")
    along = np.array(checked_pair("direction", direction))
    if not along.any():
        raise ValueError("expected a direction, got (0, 0)")
    steps = checked_integer("steps", steps, at_least=2, at_most=MOST)
    along /= np.hypot(*along)
    corners = punch.footprint.hull - np.array(punch.origin)[:, None]
    overturning = _reach(ConvexHull(corners.T).equations, along)
    if overturning <= 0:
        raise ValueError("expected the origin of the punch inside the convex hull of its plan")
    lift_off = np.nan
    if punch.gap is None and options.get("unilateral", True):
        lift_off = 0.0  # before it moves, as on crusts that bend away and outside of the kern
        if (punch.system.unit_pressures[:, 0] > 0).all():
            kern = ConvexHull(punch.kern().T).equations
            outside = kern[:, 2].max() > 1e-9 * overturning
            lift_off = 0.0 if outside else max(_reach(kern, along), 0.0)
    outermost = 0.97 * overturning
    if options.get("unilateral", True):
        outermost = min(outermost, 0.999 * _reach_of_cells(punch, along))
        if outermost <= 0:
            raise ValueError(
                "expected the origin of the punch inside where the pressures of its outermost "
                "cells act, got one beyond. Remedy: smaller cells at the edge"
            )
    eccentricity = outermost * (1 - (1 - np.linspace(0, 1, steps)) ** 2)
    loads = [{"force": force, "at": tuple(e * along)} for e in eccentricity.tolist()]
    path = load_path(punch, loads, **options)
    given = readonly(along), readonly(eccentricity)
    return MomentRotation(path.solutions, *given, lift_off, overturning)


def _reach_of_cells(punch: RigidPunch, along: ndarray) -> float:
    """How far from the origin pressures that do not pull may act in a direction."""
    normals, offsets = punch.footprint.hulls[0].sides
    if not len(normals):
        raise ConvergenceError("cells in a row resist no tilt. Remedy: more of them side by side")
    offsets = offsets + normals @ (np.array(punch.origin) - punch.centre)
    return _reach(np.column_stack([normals, offsets]), along)


def _reach(half_planes: ndarray, along: ndarray) -> float:
    """How far from the origin a direction leads out of a convex polygon."""
    rate = half_planes[:, :2] @ along
    ahead = rate > 1e-12
    return float((-half_planes[ahead, 2] / rate[ahead]).min())
