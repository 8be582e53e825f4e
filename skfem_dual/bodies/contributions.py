"""What each of several bodies of any kind brings along: loads that fit it and that pressures under
it balance, its part of the equations, and warnings of its contact."""

from collections.abc import Mapping
from typing import Any

from numpy import ndarray

from ..contact.load import Load, load_of, require_compression, require_vertical
from ..contact.problem import Contribution
from ..contact.system import ContactSystem
from ..messages import shown
from ..operators.yielding import YieldingOperator
from .elastic import ElasticPunch
from .punch import RigidPunch
from .resisted import NO_BALANCE


def checked_load(name: str, punch: RigidPunch | ElasticPunch, load: Any) -> Any:
    """A load of a rigid punch; load vector and held values of an elastic one."""
    if isinstance(punch, RigidPunch):
        load = load_of(name, load)
        require_vertical(name, load)
        return load
    if isinstance(load, Load):
        raise TypeError(
            f"expected a load vector of the structure for {name}, got a Load. Remedy: assemble it "
            "on the basis of the structure, or plate.probes(x).T @ forces for forces at points"
        )
    if not isinstance(load, Mapping):
        load = {"f": load}
    if "f" not in load or set(load) - {"f", "x"}:
        raise TypeError(f"expected keys f and x of {name}, got {shown(list(load))}")
    try:
        return punch.checked_loads(load["f"], load.get("x"))
    except (TypeError, ValueError) as error:
        raise type(error)(f"{name}: {error}") from None


def contribution(punch: RigidPunch | ElasticPunch, load: Any, flat: ndarray) -> Contribution:
    """What a body under its load brings into the equations of all, some of its cells flat."""
    if isinstance(punch, ElasticPunch):
        f, held = load
        return punch.share(f, held, flat)
    return Contribution(
        punch.planes(punch.collocation_points),
        punch.footprint.flattened(flat).resultants,
        punch.initial_gap,
        load.constraints(punch.origin - punch.centre),
    )


def require_balanced(
    punch: RigidPunch | ElasticPunch, load: Any, own: Contribution, operator: YieldingOperator
) -> None:
    """Refuse a load of a body, with a ValueError, that pressures under it cannot balance;
    ``operator`` is that of all."""
    planes, resultants, gap, constraints = own
    alone = ContactSystem(operator, planes, resultants, gap, punch.partition.areas)
    loaded = constraints.fixed.any() or constraints.given.any()
    if len(planes) and not loaded and len(constraints.given) == len(constraints.fixed):
        raise ValueError(
            "expected a force, got none. Remedy: leave out bodies without a load, or "
            "give them their weight"
        )
    if isinstance(punch, RigidPunch):
        origin, flat = punch.origin - punch.centre, punch.gap is None
        require_compression(load, origin, punch.footprint.hulls, flat)
    else:
        punch.require_load(*load)
        if not alone.can_balance(constraints):
            raise ValueError(NO_BALANCE)
