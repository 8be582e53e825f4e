"""Random problems: equilibrium, and what turning, scaling and the like must not change."""

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from skfem import CellBasis, ElementTriP0, MeshTri

import skfem_dual as sd
from skfem_dual.grids import generate

GROUNDS = ("half-space", "graded", "layered", "incompressible")
WAYS = ("auto", "cg")


def ground(kind: str, unit: float = 1.0, stress: float = 1.0):
    """A ground whose lengths are multiplied by ``unit`` and moduli by ``stress``."""
    if kind == "graded":
        return sd.GradedHalfSpace.init_linear(stress, 0.3, 0.5 / unit)
    if kind == "layered":
        return sd.LayeredHalfSpace(
            [sd.Layer(1.5 * unit, stress, 0.3)], sd.HalfSpace(3 * stress, 0.2)
        )
    return sd.HalfSpace(stress, 0.5 if kind == "incompressible" else 0.3)


def plan(rng: np.random.Generator) -> MeshTri:
    """A plan of some shape with 60 to 160 nodes."""
    n = int(rng.integers(60, 160))
    return [
        lambda: generate.disc(n=n),
        lambda: generate.annulus(0.4, n=n + 40),
        lambda: generate.rectangle(2.0, 1.4, n=n),
        lambda: generate.polygon([[0, 2, 2, 1, 1, 0], [0, 0, 1, 1, 2, 2]], n=n),
    ][int(rng.integers(4))]()


def punch(mesh, kind: str, grid: str, unit: float = 1.0, stress: float = 1.0, **options):
    """A punch on a mesh."""
    if grid == "skfem":
        basis = CellBasis(mesh, ElementTriP0())
    else:
        dual = sd.DualMesh.from_mesh(mesh)
        basis = dual.basis() if grid == "dual" else dual.primal_basis()
    return sd.RigidPunch(ground(kind, unit, stress), basis, **options)


def trials(seed: int = 0, n: int = 40) -> Iterator[tuple[str, Callable[[], tuple[str, str]]]]:
    """Label and judged trial: ``n`` problems with what derives from each."""
    for number in range(n):
        for check in CHECKS:
            key = [seed, number]
            yield f"{check.__name__[1:]} {number}", lambda k=key, c=check: judged(c, k)


def judged(check: Callable, key: list[int]) -> tuple[str, str]:
    """How the solves of one trial ended; the same problem for all checks of one number."""
    rng = np.random.default_rng(key)
    mesh, kind = plan(rng), GROUNDS[int(rng.integers(len(GROUNDS)))]
    grid = ("dual", "primal", "skfem")[int(rng.integers(3))]
    middle = mesh.p.mean(axis=1)
    load = {
        "force": 1.0,
        "at": tuple(middle + rng.uniform(-0.45, 0.45, 2) * np.ptp(mesh.p, 1) / 2),
    }
    try:
        fault = check(mesh, kind, grid, load, rng)
    except (sd.MeshError, sd.ConvergenceError, ValueError) as error:
        return ("clear" if "expected" in str(error) else "unclear"), str(error)
    except Exception as error:  # noqa: BLE001
        return "unclear", repr(error)
    return ("wrong", f"{kind}, {grid}: {fault}") if fault else ("fine", "")


def _differ(one, other, settlement=1.0, tilt=1.0, pressure=1.0, tol=2e-6) -> str:
    """What differs beyond ``tol`` between two answers, the first multiplied by factors."""
    if not (one.success and other.success):
        return ""
    size = abs(other.settlement)
    if not abs(one.settlement * settlement - other.settlement) <= tol * size:
        return f"settlement {one.settlement * settlement:.9g} and {other.settlement:.9g}"
    if not np.allclose(
        one.pressure * pressure, other.pressure, 0, 20 * tol * other.pressure.max()
    ):
        return "pressures"
    return ""


def _balance(mesh, kind, grid, load, rng) -> str:
    """Force and moments, no tension, no gap under pressure."""
    it = punch(mesh, kind, grid)
    found = it.solve(**load)
    if not found.success:
        return ""
    cells = it.partition
    if not np.isclose(found.pressure @ cells.areas, 1.0, rtol=1e-8):
        return "the pressures do not carry the force"
    under = found.punch_displacement(np.reshape(load["at"], (2, 1)))[0]
    if (found.pressure < -1e-9 * found.pressure.max()).any() or under <= 0:
        return "tension, or a settlement upwards"
    plane = found.punch_displacement(cells.centroids, collocated=True)
    gap = found.displacement(cells.centroids) - plane
    pressed = found.pressure > 0
    if np.abs(gap[pressed]).max() > 1e-5 * under:
        return f"ground and punch apart by {np.abs(gap[pressed]).max():.2g} under pressure"
    return ""


def _scaled(mesh, kind, grid, load, rng) -> str:
    """Lengths and forces in other units."""
    unit, stress = 10 ** rng.uniform(-8, 8, 2)
    one = punch(mesh, kind, grid).solve(**load)
    big = MeshTri(mesh.p * unit, mesh.t)
    at = tuple(np.array(load["at"]) * unit)
    other = punch(big, kind, grid, unit, stress).solve(stress * unit**2, at=at)
    return _differ(one, other, unit, 1.0, stress)


def _moved(mesh, kind, grid, load, rng) -> str:
    """Turned, and moved with its origin."""
    a, by = rng.uniform(0, 2 * np.pi), rng.normal(0, 100, (2, 1))
    turn = np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]])
    one = punch(mesh, kind, grid).solve(**load)
    other = punch(MeshTri(turn @ mesh.p + by, mesh.t), kind, grid, origin=tuple(by[:, 0]))
    other = other.solve(1.0, at=tuple(turn @ load["at"]))
    return _differ(one, other)


def _renumbered(mesh, kind, grid, load, rng) -> str:
    """Nodes in another order."""
    order = rng.permutation(mesh.p.shape[1])
    other = MeshTri(mesh.p[:, order], np.argsort(order)[mesh.t].astype(np.int32))
    a, b = (punch(m, kind, "dual").solve(**load) for m in (mesh, other))
    return (
        _differ(a, b, pressure=1.0)
        if len(a.pressure) == 0
        else ("" if np.isclose(a.settlement, b.settlement, rtol=1e-7) else "settlement")
    )


def _ways(mesh, kind, grid, load, rng) -> str:
    """Active set and conjugate gradients; a load from its own position."""
    it = punch(mesh, kind, grid)
    one, other = (it.solve(**load, method=way) for way in WAYS)
    if fault := _differ(one, other, tol=1e-6):
        return f"by another method {fault}"
    if one.success:
        back = it.solve(settlement=one.settlement, tilt=tuple(one.tilt))
        if back.success and not np.isclose(back.resultant[0], 1.0, rtol=1e-5):
            return "the position gives another force"
    return ""


def _threads(mesh, kind, grid, load, rng) -> str:
    """Two threads share a punch."""
    x, y = load["at"]
    cases = [{"force": 1.0, "at": (x * s, y * s)} for s in np.linspace(0.8, 1, 6)]
    alone = [punch(mesh, kind, grid).solve(**case) for case in cases]
    shared = punch(mesh, kind, grid)
    with ThreadPoolExecutor(2) as pool:
        both = list(pool.map(lambda case: shared.solve(**case), cases))
    for one, other in zip(alone, both):
        if fault := _differ(one, other, tol=1e-9):
            return f"in threads {fault}"
    return ""


def _impossible(mesh, kind, grid, load, rng) -> str:
    """Reactions and loads off the plan are refused, or not called a success."""
    far = tuple(np.array(load["at"]) + 10.0)
    for given in ({"force": 1.0, "at": far}, {"settlement": 1.0, "at": far}):
        try:
            found = punch(mesh, kind, grid).solve(**given)
        except (ValueError, sd.ConvergenceError):
            continue
        if found.success:
            return f"success under {given}"
    found = punch(mesh, kind, grid).solve(settlement=1.0, tilt=(1e14, 0.0))
    if found.success:
        carried = found.pressure @ found.punch.partition.areas
        if not np.isclose(carried, found.resultant[0], rtol=1e-6):
            return "success of a huge tilt whose pressures do not carry the force"
    return ""


CHECKS = (_balance, _scaled, _moved, _renumbered, _ways, _threads, _impossible)
