"""Conditions a triangulation must meet to have a dual grid, each with its offenders and remedy."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy import ndarray
from skfem import ElementTriP1, MeshQuad, MeshQuad1, MeshTri
from skfem.mesh import MeshTri1

from ..arguments import LARGEST, SMALLEST
from ..errors import MeshError
from ..messages import shown
from .corners import Corners, signed_areas
from .planar import covered_twice, hanging
from .polygons import readonly
from .quality import MeshQuality
from .report import Condition, Report

#: a crossing nearer to a node than this part of the facet counts as missed
CROSSING_MARGIN = 1e-10
#: a triangle of this area over the square of its longest side, or less, counts as a line
FLAT = 1e-14


@dataclass(frozen=True, eq=False, repr=False)
class MeshReport(Report):
    """What `check_mesh` found; ``ok`` if the mesh has a dual grid.

    Attributes
    ----------
    conditions : tuple of Condition
        First the required conditions: testing ends with the first one that makes the later ones
        meaningless. Then those that are sufficient or desirable, ``required=False``.
    measures : tuple of Measure
        Smallest angles and aspect ratios of the triangles.
    """


def check_mesh(mesh: MeshTri) -> MeshReport:
    """Test whether a triangulation has a 1-type dual grid (Definition 2), and how good it is.

    Parameters
    ----------
    mesh : MeshTri
        Straight triangles in either orientation.

    Returns
    -------
    MeshReport
        Each condition with its offenders and a remedy: the structure of the mesh, that facets
        and corresponded ribs cross, which is exact; and, as information, the sufficient
        conditions of Section 3, the quality of the triangles and of the dual cells.

    Raises
    ------
    TypeError
        If ``mesh`` is not a MeshTri.
    MeshError
        If it is curved or discontinuous, an array of it has another shape, or a tag is no array of
        integers.

    Examples
    --------
    >>> from skfem import MeshTri
    >>> check_mesh(MeshTri().refined(2)).ok
    True
    """
    check_type(mesh)
    corners, conditions = Corners(mesh), []
    for condition in triangulation_conditions(corners):
        conditions.append(condition)
        if not condition.ok:
            return MeshReport(tuple(conditions))
    quality = MeshQuality(mesh)
    return MeshReport(
        (*conditions, crossing_condition(corners), *quality.conditions()),
        tuple(quality.measures()),
    )


def check_type(mesh: object) -> None:
    """Accept straight, continuous triangulations only."""
    if not isinstance(mesh, MeshTri1):
        remedy = ""
        if isinstance(mesh, MeshQuad):
            straight = "mesh" if type(mesh) is MeshQuad1 else "MeshQuad.from_mesh(mesh)"
            remedy = f". Remedy: {straight}.to_meshtri(), or a CellBasis of its quadrilaterals"
        raise TypeError(f"expected a skfem MeshTri, got {shown(mesh)}{remedy}")
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
            turned = a.ndim == 2 and a.shape[1] == rows
            remedy = "transpose the array" if turned else f"a mesh with {cell}s"
            raise MeshError(
                f"expected mesh.{name} of shape ({rows}, n) with n > 0, got {a.shape}. "
                f"Remedy: {remedy}"
            )
    if not np.issubdtype(t.dtype, np.integer):
        raise MeshError(f"expected integer connectivity mesh.t, got {t.dtype}")
    yield Condition(
        "finite coordinates",
        "node",
        np.nonzero(~np.isfinite(p).all(axis=0))[0],
        "mend the coordinates (NaN or infinity) in the mesh file",
    )
    size = np.ptp(p, axis=1).max()
    yield Condition(
        f"coordinates up to {LARGEST:g} and a domain wider than {SMALLEST:g}",
        "node",
        np.nonzero((np.abs(p) > LARGEST).any(axis=0) | (size < SMALLEST))[0],
        "choose units in which sizes are near 1",
    )
    yield Condition(
        f"vertex indices from 0 to {p.shape[1] - 1}",
        cell,
        np.nonzero(((t < 0) | (t >= p.shape[1])).any(axis=0))[0],
        f"mend the connectivity mesh.t (found {t.min()} to {t.max()})",
    )


def cell_conditions(mesh: MeshTri) -> Iterator[Condition]:
    """The same, and that all nodes are those of cells."""
    yield from array_conditions(mesh)
    yield _used_condition(mesh)


def _used_condition(mesh: MeshTri) -> Condition:
    used = np.zeros(mesh.p.shape[1], dtype=bool)
    used[mesh.t] = True
    return Condition(
        f"every node to belong to a {'triangle' if len(mesh.t) == 3 else 'quadrilateral'}",
        "node",
        np.nonzero(~used)[0],
        "remove the nodes, e.g. mesh.remove_unused_nodes()",
    )


def triangulation_conditions(corners: Corners) -> Iterator[Condition]:
    """What makes a MeshTri a triangulation of a domain; later ones build on earlier ones."""
    yield from array_conditions(corners.mesh)
    yield from _structure_conditions(corners)


def _structure_conditions(corners: Corners) -> Iterator[Condition]:
    """What is asked of a triangulation beside `array_conditions`."""
    mesh = corners.mesh
    p, t = mesh.p, mesh.t
    yield Condition(
        "three different vertices in every triangle",
        "triangle",
        np.nonzero((t[0] == t[1]) | (t[1] == t[2]) | (t[0] == t[2]))[0],
        "remove these triangles",
    )
    yield _used_condition(mesh)
    longest = np.max(np.ptp(p.take(t, axis=1), axis=1), axis=0)
    yield Condition(
        "triangles of positive area",
        "triangle",
        np.nonzero(np.abs(signed_areas(p, t)) <= FLAT * longest**2)[0],
        "remove or remesh the triangles whose vertices lie on one line",
    )
    yield from _tag_conditions(mesh)
    yield from _surface_conditions(corners)


def _surface_conditions(corners: Corners) -> Iterator[Condition]:
    """What makes triangles of positive area a part of the plane: no place is covered twice."""
    mesh, p, t = corners.mesh, corners.mesh.p, corners.mesh.t
    counts = np.bincount(mesh.t2f.ravel())
    yield Condition(
        "facets shared by at most two triangles",
        "facet",
        crowded := np.nonzero(counts > 2)[0],
        "remove the triangles lying on top of others",
        _facet_detail(mesh, crowded),
    )
    same_side = (corners.twin != -1) & (corners.node == corners.node[corners.twin])
    yield Condition(
        "the two triangles of a facet on different sides of it",
        "facet",
        folded := np.unique(corners.facet[same_side]),
        "the mesh folds over itself there: remove or remesh the triangles",
        _facet_detail(mesh, folded),
    )
    starts = np.nonzero(corners.twin == -1)[0]
    ends = corners.node.reshape(3, -1)[[1, 2, 0]].ravel()[starts]
    boundary = np.stack([corners.node[starts], ends])
    yield Condition(
        "no hanging nodes, which lie on a facet of a triangle beside",
        "node",
        hanging(p, boundary, corners.triangle[starts]),
        "cut the triangle there, from the node to the corner opposite, or remove the node; the "
        "two sides of a slit need the same nodes",
    )
    yield Condition(
        "the triangles around a node to form one fan",
        "node",
        np.unique(corners.node[corners.rank == -1]),
        "parts that touch in a single node need a node each: duplicate it",
    )
    # a fan that goes round its node once has one triangle in any direction: that of x
    y = p[1, corners.node.reshape(t.shape)]
    across = (y[[1, 2, 0]] <= y) & (y[[2, 0, 1]] > y)
    yield Condition(
        "the triangles around a node to go round it once",
        "node",
        np.nonzero(np.bincount(corners.node, weights=across.ravel()) > 1.5)[0],
        "the mesh covers itself there: remove or remesh the triangles",
    )
    # now one-to-one near every point; and everywhere, unless the boundary tells otherwise
    inside = corners.barycentres.take(corners.triangle[starts], axis=1)
    twice = covered_twice(p, boundary, inside)
    yield Condition(
        "no place to be covered twice",
        "facet",
        twice := np.unique(corners.facet[starts[twice]]),
        "parts of the mesh with these boundary facets overlap: remove or move one",
        _facet_detail(mesh, twice),
    )


def dual_conditions(corners: Corners) -> Iterator[Condition]:
    """What is asked of a mesh with a dual grid beside `array_conditions`."""
    yield from _structure_conditions(corners)
    yield crossing_condition(corners)


def crossing_condition(corners: Corners) -> Condition:
    """That every facet is crossed by its corresponded rib.

    The quadrilateral of an inner facet and the barycentres on its two sides must be convex;
    this is exact, (2) of the paper is sufficient only.
    """
    s = corners.crossing_parameters
    return Condition(
        "every facet to be crossed by the segment between the barycentres of its triangles "
        "(Definition 1, condition 4)",
        "facet",
        missed := np.nonzero((s <= CROSSING_MARGIN) | (s >= 1 - CROSSING_MARGIN))[0],
        "flip the facet or improve the triangles there (mesh.smoothed(), remeshing), "
        "a^2 + b^2 < 5 c^2 for the sides a > b > c of every triangle suffices",
        _facet_detail(corners.mesh, missed),
    )


def _facet_detail(mesh: MeshTri, facets: ndarray) -> str:
    if len(facets) == 0:
        return ""
    a, b = mesh.facets[:, facets[0]]
    return f"the first joins nodes {a} and {b}"


def user_tags(tags: dict[str, ndarray] | None) -> dict[str, ndarray]:
    """Tags of a mesh without the curve numbers that meshio files under cell sets of Gmsh."""
    return {name: tag for name, tag in (tags or {}).items() if not str(name).startswith("gmsh:")}


def _tag_conditions(mesh: MeshTri) -> Iterator[Condition]:
    for kind, tags, entity, n in (
        ("boundary", mesh.boundaries, "facet", mesh.facets.shape[1]),
        ("subdomain", mesh.subdomains, "triangle", mesh.t.shape[1]),
    ):
        for name, tag in user_tags(tags).items():
            index = np.asarray(tag)
            if index.size == 0:  # an empty list is an array of floats
                continue
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
