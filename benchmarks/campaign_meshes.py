"""Random meshes: checks and dual grids, and what must not change them.

A verdict of `check_mesh` keeps when the mesh is turned, moved, scaled, renumbered or mirrored; a
valid dual grid passes `check_dual`, its cells fill the domain, and `general_triangulation` is a
triangulation of the same area.
"""

from collections.abc import Callable, Iterator

import numpy as np
from skfem import MeshTri
from skfem.mesh import MeshTri1

from skfem_dual import (
    DualMesh,
    MeshError,
    check_dual,
    check_mesh,
    general_triangulation,
    maximal_couple,
    minimal_couple,
    repair,
)
from skfem_dual.grids import generate


def _delaunay(rng: np.random.Generator) -> MeshTri1:
    from scipy.spatial import Delaunay

    p = rng.uniform(-1, 1, (2, int(rng.integers(4, 60))))
    return MeshTri(p, np.ascontiguousarray(Delaunay(p.T).simplices.T))


def _structured(rng: np.random.Generator) -> MeshTri1:
    n, m = rng.integers(2, 9, 2)
    return MeshTri.init_tensor(
        np.sort(rng.uniform(0, 1, n + 1)), np.sort(rng.uniform(0, 1, m + 1))
    )


def _generated(rng: np.random.Generator) -> MeshTri1:
    n = int(rng.integers(30, 120))
    return [
        lambda: generate.disc(n=n),
        lambda: generate.annulus(0.4, n=n + 60),
        lambda: generate.rectangle(2.0, rng.uniform(0.5, 2), n=n),
        lambda: generate.polygon([[0, 2, 2, 1, 1, 0], [0, 0, 1, 1, 2, 2]], n=n),
        lambda: generate.disc(n=n, graded="sine"),
    ][int(rng.integers(5))]()


def _refined(rng: np.random.Generator) -> MeshTri1:
    mesh = MeshTri.init_sqsymmetric().refined(1)
    for _ in range(int(rng.integers(1, 5))):
        mesh = mesh.refined(rng.choice(mesh.nelements, 3))
    return mesh


def _perturbed(rng: np.random.Generator) -> MeshTri1:
    mesh = _generated(rng)
    p, inner = mesh.p.copy(), mesh.interior_nodes()
    p[:, inner] += rng.normal(0, 10 ** rng.uniform(-3, -0.7), (2, len(inner)))
    return MeshTri(p, mesh.t)


def _stretched(rng: np.random.Generator) -> MeshTri1:
    mesh = _structured(rng)
    return MeshTri(mesh.p * [[1.0], [10 ** rng.uniform(-12, 0)]], mesh.t)


def _two_parts(rng: np.random.Generator) -> MeshTri1:
    mesh = _generated(rng)
    away = mesh.translated((rng.uniform(0, 5), 0.0))
    return MeshTri(np.hstack([mesh.p, away.p]), np.hstack([mesh.t, mesh.t + mesh.p.shape[1]]))


def _broken(rng: np.random.Generator) -> MeshTri1:
    """Something wrong with a mesh that was right."""
    mesh = _generated(rng)
    p, t = mesh.p.copy(), mesh.t.copy()
    j = int(rng.integers(t.shape[1]))
    what = int(rng.integers(7))
    if what == 0:
        p[:, int(rng.integers(p.shape[1]))] = rng.choice([np.nan, np.inf, 1e308])
    elif what == 1:
        t[1, j] = t[0, j]
    elif what == 2:
        t = np.hstack([t, t[:, [j]]])
    elif what == 3:
        p = np.hstack([p, rng.uniform(-1, 1, (2, 1))])
    elif what == 4:
        p[:, t[0, j]] = p[:, t[1, j]]
    elif what == 5:
        t = np.delete(t, j, axis=1)
    else:
        p[:, int(rng.integers(p.shape[1]))] += rng.normal(0, 1, 2)
    return MeshTri(p, t)


MAKERS = (
    *(_delaunay, _structured, _generated, _refined, _perturbed, _stretched, _two_parts, _broken),
)
#: how each mesh is changed without changing what is true of it
CHANGES = (
    "as it is",
    "turned",
    "moved",
    "scaled",
    "far away",
    "tiny",
    "huge",
    "renumbered",
    "mirrored",
)


def changed(mesh: MeshTri1, how: str, rng: np.random.Generator) -> MeshTri1:
    """The mesh in another place, size or numbering."""
    p, t = mesh.p, mesh.t
    if how == "turned":
        a = rng.uniform(0, 2 * np.pi)
        p = np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]]) @ p
    elif how == "moved":
        p = p + rng.normal(0, 10, (2, 1))
    elif how == "scaled":
        p = p * 10 ** rng.uniform(-6, 6)
    elif how == "far away":
        p = p + rng.choice([-1, 1], (2, 1)) * 10 ** rng.uniform(3, 6)
    elif how == "tiny":
        p = p * 1e-80
    elif how == "huge":
        p = p * 1e78
    elif how == "mirrored":
        p = p * [[-1.0], [1.0]]
    elif how == "renumbered":
        order = rng.permutation(p.shape[1])
        number = np.argsort(order)
        p, t = p[:, order], number[t[:, rng.permutation(t.shape[1])]]
    return MeshTri(np.ascontiguousarray(p), np.ascontiguousarray(t, dtype=np.int32))


def trials(seed: int = 0, n: int = 120) -> Iterator[tuple[str, Callable[[], tuple[str, str]]]]:
    """Label and judged trial: each of ``n`` meshes of each kind, with its changes."""
    for number in range(n):
        for maker in MAKERS:
            key = [seed, number, MAKERS.index(maker)]
            yield f"{maker.__name__[1:]} {number}", lambda k=key, m=maker: judged(m, k)


def judged(maker: Callable, key: list[int]) -> tuple[str, str]:
    """How the trials with one mesh ended."""
    rng = np.random.default_rng(key)
    try:
        mesh = maker(rng)
        verdict = check_mesh(mesh).ok
    except (MeshError, TypeError, ValueError) as error:
        return ("clear" if "expected" in str(error) else "unclear"), str(error)
    except Exception as error:  # noqa: BLE001
        return "unclear", repr(error)
    try:
        margin = _margin(mesh) if verdict or maker is not _broken else 0.0
        for how in CHANGES:
            # rounding of the coordinates may decide where the mesh itself nearly does
            if margin < 1e-5 and how != "as it is":
                break
            other = changed(mesh, how, rng)
            if check_mesh(other).ok != verdict:
                return "wrong", f"{how}: another verdict than {verdict}"
            if verdict and (fault := _fault(other)):
                return "wrong", f"{how}: {fault}"
        if not verdict:
            DualMesh.from_mesh(mesh)
            return "wrong", "a dual grid of a mesh that is refused"
    except MeshError as error:
        return ("clear" if not verdict else "wrong"), str(error)
    except Exception as error:  # noqa: BLE001
        return "unclear", repr(error)
    return "fine", ""


def _margin(mesh: MeshTri1) -> float:
    """How far a mesh is from faults that rounding could make or mend."""
    from skfem_dual.grids.corners import Corners, signed_areas

    s = Corners(mesh).crossing_parameters
    longest = np.max(np.ptp(mesh.p[:, mesh.t], axis=1), axis=0)
    flat = np.abs(signed_areas(mesh.p, mesh.t)) / longest**2
    return float(min(np.abs(s).min(), np.abs(1 - s).min(), flat.min()))


def _fault(mesh: MeshTri1) -> str:
    """What is wrong with the dual grids of a valid mesh, if anything."""
    dual = DualMesh.from_mesh(mesh)
    area = dual.primal_partition.areas.sum()
    if not np.isclose(dual.areas.sum(), area, rtol=1e-9):
        return "cells that do not fill the domain"
    if not check_dual(dual).ok:
        return "check_dual refuses the dual grid"
    for couple in (minimal_couple, maximal_couple):
        try:
            found = couple(dual)
        except MeshError:
            continue
        if not check_dual(found).ok:
            return f"check_dual refuses {couple.__name__}"
    from skfem_dual.grids.corners import signed_areas

    general = general_triangulation(dual)
    if not np.isclose(np.abs(signed_areas(general.p, general.t)).sum(), area, rtol=1e-9):
        return "a general triangulation of another area"
    same, report = repair(mesh)
    return "" if same is mesh and report.success else "a valid mesh is repaired"
