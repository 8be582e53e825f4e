"""Conditions a triangulation must meet to have a dual grid, each with its offenders and remedy."""

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy import ndarray
from skfem import ElementTriP1, MeshTri
from skfem.mesh import MeshTri1

from ..errors import MeshError
from .corners import Corners, signed_areas
from .polygons import readonly, some

#: a crossing nearer to a node than this part of the facet counts as missed
CROSSING_MARGIN = 1e-10


@dataclass(frozen=True, eq=False)
class Condition:
    """One condition and where it is not met.

    Attributes
    ----------
    expected : str
        The condition in words.
    entity : str
        What the indices count: ``"node"``, ``"triangle"`` or ``"facet"``.
    offending : array of int
        Indices of the entities that violate the condition; empty if it is met.
    remedy : str
        What the user can do.
    detail : str
        More about the first offender.
    """

    expected: str
    entity: str
    offending: ndarray
    remedy: str
    detail: str = ""

    @property
    def ok(self) -> bool:
        """Whether the condition is met."""
        return len(self.offending) == 0

    def message(self) -> str:
        """The condition, the first offenders and the remedy in one line."""
        n = len(self.offending)
        noun = self.entity + ("" if n == 1 else "s")
        detail = f" ({self.detail})" if self.detail else ""
        return (
            f"expected {self.expected}; {n} {noun} violate{'s' if n == 1 else ''} this: "
            f"{some(self.offending)}{detail}. Remedy: {self.remedy}"
        )


@dataclass(frozen=True, eq=False, repr=False)
class MeshReport:
    """What `check_mesh` found.

    Attributes
    ----------
    conditions : tuple of Condition
        The conditions tested, in order; testing ends with the first one that is not met,
        because the later ones build on it.
    """

    conditions: tuple[Condition, ...] = field(default=())

    @property
    def ok(self) -> bool:
        """Whether the mesh has a dual grid."""
        return all(c.ok for c in self.conditions)

    def __repr__(self) -> str:
        lines = [f"  {'ok  ' if c.ok else 'FAIL'}  {c.expected}" for c in self.conditions]
        lines += [f"  {c.message()}" for c in self.conditions if not c.ok]
        return "<skfem_dual MeshReport object>\n" + "\n".join(lines)


def check_mesh(mesh: MeshTri) -> MeshReport:
    """Test whether a triangulation has a 1-type dual grid (Definition 2).

    Raises
    ------
    TypeError
        If ``mesh`` is not a MeshTri.
    MeshError
        If it is curved or discontinuous.

    Examples
    --------
    >>> from skfem import MeshTri
    >>> check_mesh(MeshTri().refined(2)).ok
    True
    """
    check_type(mesh)
    found = []
    for condition in dual_conditions(mesh):
        found.append(condition)
        if not condition.ok:
            break
    return MeshReport(tuple(found))


def require(conditions: Iterator[Condition]) -> None:
    """Raise MeshError for the first condition that is not met."""
    for condition in conditions:
        if not condition.ok:
            raise MeshError(condition.message())


def check_type(mesh) -> None:
    """Accept straight, continuous triangulations only."""
    if not isinstance(mesh, MeshTri1):
        raise TypeError(f"expected a skfem MeshTri, got {type(mesh).__name__}")
    if not (mesh.elem is ElementTriP1 and mesh.affine):
        raise MeshError(
            f"expected straight triangles sharing their nodes (MeshTri), got "
            f"{type(mesh).__name__}. Remedy: MeshTri.from_mesh(mesh), or refine a curved "
            "boundary with straight facets"
        )


def array_conditions(mesh: MeshTri) -> Iterator[Condition]:
    """What the arrays of a mesh of any shape of cell must be before they are used."""
    p, t = np.asarray(mesh.p), np.asarray(mesh.t)
    cell, k = {3: ("triangle", 3), 4: ("quadrilateral", 4)}[mesh.elem.refdom.nnodes]
    for name, a, rows in (("p", p, 2), ("t", t, k)):
        if a.ndim != 2 or a.shape[0] != rows or a.shape[1] == 0:
            raise MeshError(
                f"expected mesh.{name} of shape ({rows}, n) with n > 0, got {a.shape}. "
                "Remedy: transpose the array"
            )
    if not np.issubdtype(t.dtype, np.integer):
        raise MeshError(f"expected integer connectivity mesh.t, got {t.dtype}")
    yield Condition(
        "finite coordinates",
        "node",
        np.nonzero(~np.isfinite(p).all(axis=0))[0],
        "mend the coordinates (NaN or infinity) in the mesh file",
    )
    yield Condition(
        f"vertex indices from 0 to {p.shape[1] - 1}",
        cell,
        np.nonzero(((t < 0) | (t >= p.shape[1])).any(axis=0))[0],
        f"mend the connectivity mesh.t (found {t.min()} to {t.max()})",
    )


def triangulation_conditions(mesh: MeshTri) -> Iterator[Condition]:
    """What makes a MeshTri a triangulation of a domain; later ones build on earlier ones."""
    yield from array_conditions(mesh)
    p, t = mesh.p, mesh.t
    yield Condition(
        "three different vertices in every triangle",
        "triangle",
        np.nonzero((t[0] == t[1]) | (t[1] == t[2]) | (t[0] == t[2]))[0],
        "remove these triangles",
    )
    used = np.zeros(p.shape[1], dtype=bool)
    used[t] = True
    yield Condition(
        "every node to belong to a triangle",
        "node",
        np.nonzero(~used)[0],
        "remove the nodes, e.g. mesh.remove_unused_nodes()",
    )
    longest = np.max(np.ptp(p[:, t], axis=1), axis=0)
    yield Condition(
        "triangles of positive area",
        "triangle",
        np.nonzero(np.abs(signed_areas(p, t)) <= 1e-14 * longest**2)[0],
        "remove or remesh the triangles whose vertices lie on one line",
    )
    yield from _tag_conditions(mesh)
    counts = np.bincount(mesh.t2f.ravel())
    yield Condition(
        "facets shared by at most two triangles",
        "facet",
        crowded := np.nonzero(counts > 2)[0],
        "remove the triangles lying on top of others",
        _facet_detail(mesh, crowded),
    )
    corners = Corners.from_mesh(mesh)
    same_side = (corners.twin != -1) & (corners.node == corners.node[corners.twin])
    yield Condition(
        "the two triangles of a facet on different sides of it",
        "facet",
        folded := np.unique(corners.facet[same_side]),
        "the mesh folds over itself there: remove or remesh the triangles",
        _facet_detail(mesh, folded),
    )
    yield Condition(
        "the triangles around a node to form one fan",
        "node",
        np.unique(corners.node[corners.rank == -1]),
        "parts that touch in a single node need a node each: duplicate it",
    )
    turns = np.bincount(corners.node, weights=_angles(p, t, corners)) / (2 * np.pi)
    yield Condition(
        "the triangles around a node to go round it once",
        "node",
        np.nonzero(turns > 1.5)[0],
        "the mesh covers itself there: remove or remesh the triangles",
    )


def dual_conditions(mesh: MeshTri) -> Iterator[Condition]:
    """`triangulation_conditions`, and that every facet is crossed by its corresponded rib.

    The quadrilateral of an inner facet and the barycentres on its two sides must be convex;
    this is exact, (2) of the paper is sufficient only.
    """
    yield from triangulation_conditions(mesh)
    s = crossing_parameters(mesh)
    yield Condition(
        "every facet to be crossed by the segment between the barycentres of its triangles "
        "(Definition 1, condition 4)",
        "facet",
        missed := np.nonzero((s <= CROSSING_MARGIN) | (s >= 1 - CROSSING_MARGIN))[0],
        "flip the facet or improve the triangles there (mesh.smoothed(), remeshing), "
        "a^2 + b^2 < 5 c^2 for the sides a > b > c of every triangle suffices",
        _facet_detail(mesh, missed),
    )


def crossing_parameters(mesh: MeshTri) -> ndarray:
    """Where the line through the barycentres of a facet's triangles meets it.

    0 at the first node of the facet, 1 at the second; 1/2 on the boundary.
    """
    a = mesh.p[:, mesh.facets[0]]
    along = mesh.p[:, mesh.facets[1]] - a
    inner = mesh.f2t[1] != -1
    left, right = barycentres(mesh)[:, mesh.f2t[:, inner]].swapaxes(0, 1) - a[:, inner]
    d = along[:, inner]
    height_left = np.abs(d[0] * left[1] - d[1] * left[0])
    height_right = np.abs(d[0] * right[1] - d[1] * right[0])
    met = (height_right * left + height_left * right) / (height_left + height_right)
    s = np.full(along.shape[1], 0.5)
    s[inner] = np.sum(met * d, axis=0) / np.sum(d * d, axis=0)
    return s


def barycentres(mesh: MeshTri) -> ndarray:
    """Barycentre of each triangle, shape (2, ntriangles)."""
    a, b, c = mesh.t
    return mesh.p[:, a] + ((mesh.p[:, b] - mesh.p[:, a]) + (mesh.p[:, c] - mesh.p[:, a])) / 3


def _angles(p: ndarray, t: ndarray, corners: Corners) -> ndarray:
    """Angle at each corner."""
    v = p[:, corners.node.reshape(t.shape)]
    onward, back = np.roll(v, -1, axis=1) - v, np.roll(v, 1, axis=1) - v
    cross = onward[0] * back[1] - onward[1] * back[0]
    return np.arctan2(cross, np.sum(onward * back, axis=0)).ravel()


def _facet_detail(mesh: MeshTri, facets: ndarray) -> str:
    if len(facets) == 0:
        return ""
    a, b = mesh.facets[:, facets[0]]
    return f"the first joins nodes {a} and {b}"


def user_tags(tags: dict[str, ndarray] | None) -> dict[str, ndarray]:
    """Tags of a mesh without the curve numbers that meshio files under cell sets of Gmsh."""
    return {name: tag for name, tag in (tags or {}).items() if not name.startswith("gmsh:")}


def _tag_conditions(mesh: MeshTri) -> Iterator[Condition]:
    for kind, tags, entity, n in (
        ("boundary", mesh.boundaries, "facet", mesh.facets.shape[1]),
        ("subdomain", mesh.subdomains, "triangle", mesh.t.shape[1]),
    ):
        for name, tag in user_tags(tags).items():
            index = np.asarray(tag)
            if not np.issubdtype(index.dtype, np.integer):
                raise MeshError(
                    f"expected integer {entity} indices in {kind} {name!r}, got {index.dtype}"
                )
            yield Condition(
                f"{entity} indices from 0 to {n - 1} in {kind} {name!r}",
                entity,
                readonly(index[(index < 0) | (index >= n)]),
                f"name existing {entity}s in the {kind} tags of the mesh",
            )
