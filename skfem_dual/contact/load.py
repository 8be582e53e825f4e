"""What is imposed on a rigid punch: a load, a position, or a mixture of both."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace

import numpy as np
from numpy import ndarray
from scipy.linalg import block_diag

from ..arguments import Pair, checked_instance, checked_number, checked_pair
from ..messages import place, shown
from .hull import Hull


@dataclass(frozen=True)
class Load:
    """What is imposed on a rigid punch.

    Parameters
    ----------
    force : float
        Vertical force P, positive into the ground. Not together with ``settlement``.
    at : pair of float
        Where the force acts, (epsilon_x, epsilon_y) from the punch's origin; default (0, 0). Not
        together with ``tilt``.
    moments : pair of float
        M1, M2 of (4): the first moments of the pressure are ``P epsilon_x - M1`` and
        ``P epsilon_y + M2``; default (0, 0). Not together with ``tilt``. Of moments about x and
        y, as of `column_load` and tables of load cases, they are ``-my, mx``.
    settlement : float
        Settlement W0 of the origin instead of the force, positive into the ground.
    tilt : pair of float
        Inclinations Lx, Ly instead of the moments. With ``force`` the punch is guided; with
        ``settlement`` its position is given wholly. A given settlement alone leaves the
        punch free to tilt under the reaction, which acts ``at`` the given point. If that is not
        the origin, several reactions may give this settlement: usually the one closest to that of
        full contact is found, or none where the punch need not touch.
    horizontal : pair of float
        Force (Hx, Hy) on the base, in the plane of the ground. Cells in contact carry it by shear
        tractions, which neither slip nor change the pressures. On a `HalfSpace`,
        `GradedHalfSpace` or `LayeredHalfSpace`, and not beside other punches.
    torsion : float
        Moment about the vertical through the origin, positive from x towards y, likewise.

    Raises
    ------
    ValueError
        If the load is incomplete, contradictory or not finite.
    TypeError
        If something is not a number, or a pair of them.

    Examples
    --------
    >>> Load(force=1.2e6, at=(0.10, 0.05)).point
    (0.1, 0.05)
    """

    force: float | None = None
    at: Pair | None = None
    moments: Pair | None = None
    settlement: float | None = None
    tilt: Pair | None = None
    horizontal: Pair | None = None
    torsion: float | None = None

    def __post_init__(self) -> None:
        if (self.force is None) == (self.settlement is None):
            raise ValueError(
                "expected either a force or a settlement, got "
                + ("neither" if self.force is None else "both")
            )
        if self.tilt is not None and (self.at is not None or self.moments is not None):
            raise ValueError("expected either a tilt or a load point with moments, got both")
        if isinstance(self.force, Load):
            raise TypeError(
                "expected a number for force, got a Load. Remedy: its fields, force=, at= and so "
                "on, or solve_many([load])"
            )
        for name in ("force", "settlement", "torsion"):
            if (value := getattr(self, name)) is not None:
                value = checked_number(name, value)
                if value:  # by denormal numbers nothing can be divided
                    checked_number(f"the size of {name}", abs(value), above=0)
                object.__setattr__(self, name, value)
        for name in ("at", "moments", "tilt", "horizontal"):
            if (value := getattr(self, name)) is not None:
                object.__setattr__(self, name, checked_pair(name, value))

    @property
    def shear(self) -> ndarray | None:
        """(Hx, Hy, T), zero where they are not imposed; None if none is."""
        if self.horizontal is None and self.torsion is None:
            return None
        return np.array([*(self.horizontal or (0.0, 0.0)), self.torsion or 0.0])

    @property
    def upright(self) -> "Load":
        """The same without what pushes and twists, which changes neither pressures nor
        positions."""
        return replace(self, horizontal=None, torsion=None)

    @property
    def first_moments(self) -> ndarray:
        """First moments of the pressure beyond those of its resultant acting ``at`` its point."""
        m1, m2 = self.moments or (0.0, 0.0)
        return np.array([-m1, m2])

    def moments_of(self, force: float) -> ndarray:
        """First moments, from the origin, of a resultant of this force where it must act."""
        return force * np.array(self.at or (0.0, 0.0)) + self.first_moments

    @property
    def point(self) -> Pair | None:
        """Where the resultant must act, from the origin; None if that is not imposed, or turns
        on a reaction that is not known."""
        at = self.at or (0.0, 0.0)
        if self.tilt is not None or self.force == 0:
            return None
        if self.force is None:
            return None if self.first_moments.any() else at
        x, y = np.array(at) + self.first_moments / self.force
        return float(x), float(y)

    def constraints(self, origin: ndarray) -> "Constraints":
        """The equations for the position of a point of the punch.

        ``origin`` is the punch's origin as seen from that point.
        """
        lever = origin + np.array(self.at or (0.0, 0.0))
        if self.settlement is not None and self.tilt is not None:
            motions = balance = np.empty((3, 0))
            fixed = [self.settlement - np.dot(self.tilt, origin), *self.tilt]
            given = np.empty(0)
        elif self.settlement is not None:
            # free to turn about the origin, balanced about the point of the reaction
            motions = np.vstack([-origin, np.eye(2)])
            balance = np.vstack([-lever, np.eye(2)])
            fixed = [self.settlement, 0.0, 0.0]
            given = self.first_moments
        elif self.tilt is not None:
            motions = balance = np.eye(3)[:, :1]
            fixed, given = [0.0, *self.tilt], np.array([self.force])
        else:
            motions = balance = np.eye(3)
            with np.errstate(over="ignore"):  # refused by whoever solves
                moments = self.force * lever + self.first_moments
            fixed, given = [0.0, 0.0, 0.0], np.array([self.force, *moments])
        return Constraints(motions, np.array(fixed), balance.T, given)


@dataclass(frozen=True)
class Share(Load):
    """Of a punch that is joined to others or under a frame: the position it has, which is found,
    not imposed.

    Attributes
    ----------
    body : Load
        What was imposed on its body.
    names : tuple of str
        The punches that are that body.
    origin : pair of float
        To which it refers, in the coordinates of the mesh.
    """

    body: Load = field(kw_only=True)
    names: tuple[str, ...] = field(kw_only=True)
    origin: Pair = field(kw_only=True)


def require_vertical(name: str, load: Load) -> None:
    """Refuse horizontal loads, with a ValueError, of bodies beside others."""
    if load.shear is not None and load.shear.any():
        raise ValueError(
            f"expected a vertical load and moments for {name}, got a horizontal force or torsion: "
            "how bases beside each other slide is not known. Remedy: RigidPunch.solve for each "
            "by itself"
        )


def load_of(name: str, value: Load | Mapping) -> Load:
    """A load, given as such or by its keyword arguments."""
    if isinstance(value, Load):
        return value
    remedy = "row.load(origin) of a row of a table" if hasattr(value, "load") else ""
    checked_instance(name, value, (Load, Mapping), remedy)
    known = {f.name for f in fields(Load)}
    if unknown := [key for key in value if key not in known]:
        raise TypeError(f"expected keys of {name} among {sorted(known)}, got {shown(unknown[0])}")
    try:
        return Load(**value)
    except (TypeError, ValueError) as error:
        raise type(error)(f"{name}: {error}") from None


@dataclass(frozen=True, eq=False)
class Constraints:
    """Linear conditions on a position s of m components and the resultants r conjugate to it.

    Attributes
    ----------
    motions, fixed : (m, k) and (m,) array of float
        ``s = fixed + motions @ y`` with k unknowns y.
    balance, given : (k, m) and (k,) array of float
        ``balance @ r = given``.
    frame : (m, m) array of float or None
        Stiffness of a frame that resists the position beside the ground; `r` has its forces, too.
    ground : (m,) array of float or None
        About how stiff the ground is there, beside which some of the frame is nothing.
    """

    motions: ndarray
    fixed: ndarray
    balance: ndarray
    given: ndarray
    frame: ndarray | None = None
    ground: ndarray | None = None

    @classmethod
    def forces(cls, given: ndarray) -> "Constraints":
        """Forces on all components, none of which is held."""
        unit = np.eye(len(given))
        return cls(unit, np.zeros(len(given)), unit, given)

    @classmethod
    def together(cls, parts: "Sequence[Constraints]") -> "Constraints":
        """The conditions on several bodies, one after the other."""
        return cls(
            block_diag(*(part.motions for part in parts)),
            np.concatenate([part.fixed for part in parts]),
            block_diag(*(part.balance for part in parts)),
            np.concatenate([part.given for part in parts]),
        )

    def keeping(self, positions: ndarray) -> ndarray:
        """The nearest to some positions, (k, m), that keep what is imposed."""
        free = np.linalg.lstsq(self.motions, (positions - self.fixed).T)[0]
        return self.fixed + (self.motions @ free).T

    @property
    def of_forces(self) -> bool:
        """Whether forces are imposed on all components of the position, and nothing else."""
        return len(self.given) == len(self.fixed) and self.frame is None

    @property
    def conjugate(self) -> bool:
        """Whether the forces given do work on the free motions, and on no other."""
        return bool(np.array_equal(self.motions, self.balance.T))


def require_compression(load: Load, origin: ndarray, hulls: tuple[Hull, Hull], flat: bool) -> None:
    """Refuse loads that no pressures can balance.

    Parameters
    ----------
    load : Load
        The load of one punch.
    origin : (2,) array of float
        Its origin, in the coordinates of the hulls.
    hulls : pair of Hull
        Of where the pressures of its cells act, and of the plan.
    flat : bool
        Whether it is flat.

    Raises
    ------
    ValueError
        If the load pulls or turns the punch over, or the reaction to an imposed settlement would
        have to act beside the plan.
    """
    if load.force is None:
        if load.tilt is None:
            _require_reaction(load, origin, hulls)
        return
    if load.force < 0:
        raise ValueError(
            f"expected a force into the ground, which does not pull, got force={load.force:g}. "
            "Remedy: unilateral=False for ground that does"
        )
    if load.force == 0:
        if load.tilt is not None or load.first_moments.any() or not flat:
            raise ValueError(
                "expected a positive force: without one the ground balances no moments, and the "
                "position of a punch that is tilted or shaped is undetermined"
            )
        return
    if load.point is not None and not hulls[0].holds(origin + load.point):
        beyond, off = hulls[0].inwards(origin + load.point), hulls[1].beyond(origin)
        there = f", or the origin, which is {off:.3g} off the plan, origin=" if off > 0 else ""
        raise ValueError(
            f"expected a resultant within the plan, got one at {place(load.point)} from the "
            f"origin, {_where(hulls[1].beyond(origin + load.point))}: the punch turns over. "
            f"Remedy: move the load by more than {beyond:.3g} towards the middle{there}, or "
            "unilateral=False for ground that pulls"
        )


def _require_reaction(load: Load, origin: ndarray, hulls: tuple[Hull, Hull]) -> None:
    """The reaction acts ``at`` its point or, with moments, on the side of it they turn to."""
    x, y = load.at or (0.0, 0.0)
    point, moved = origin + np.array([x, y]), load.first_moments
    beyond = hulls[0].beyond_ray(point, moved)
    if moved.any() and not hulls[0].sides[1].size:
        return  # pressures on one line: no contact is found, which tells why
    if beyond > 0:
        beyond = beyond if moved.any() else hulls[0].inwards(point)
        raise ValueError(
            f"expected the reaction to a settlement within the plan, got one at {place((x, y))} "
            f"from the origin{' and moments' * bool(moved.any())}, "
            f"{_where(hulls[1].beyond_ray(point, moved))}: no pressures can balance it. Remedy: "
            f"move it by more than {beyond:.3g} towards the middle, at= or origin=, or impose "
            "the tilt instead of where it acts, tilt="
        )


def _where(beyond_plan: float) -> str:
    if beyond_plan > 0:
        return "outside the convex hull of the plan"
    return "nearer to the edge of the plan's convex hull than its outermost cells"


def between_waves(load: Load, unilateral: bool, name: str) -> Load:
    """A load on periodic ground, which neither tilts nor has a place of its own."""
    central = all(own in (None, (0.0, 0.0)) for own in (load.tilt, load.at, load.moments))
    if load.force is None or load.shear is not None or not central or not unilateral:
        given = [f.name for f in fields(Load) if getattr(load, f.name) is not None]
        raise ValueError(
            f"{name}: expected a force alone on a PeriodicGround, and unilateral contact, got "
            f"{', '.join(given)}{'' if unilateral else ', unilateral=False'}: a tilt is not "
            "periodic, and a settlement relative to the mean of the surface imposes no force"
        )
    if load.force < 0:
        raise ValueError(
            f"{name}: expected a force into the ground, which does not pull on a PeriodicGround, "
            f"got force={load.force:g}"
        )
    return Load(force=load.force, tilt=(0.0, 0.0))
