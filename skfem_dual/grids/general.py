"""The general triangulation: nodes of a triangulation and of its dual grid taken together."""

from dataclasses import replace
from typing import Literal

import numpy as np
from numpy import ndarray
from skfem import MeshTri
from skfem.generic_utils import OrientedBoundary

from ..arguments import checked_choice, checked_instance
from ..errors import MeshError
from .checks import FLAT, check_type, crossing_condition, triangulation_conditions, user_tags
from .corners import Corners, signed_areas
from .dual_mesh import DualMesh
from .polygons import readonly
from .quality import smallest_angles
from .report import Condition, require


def general_triangulation(
    mesh: MeshTri | DualMesh, diagonal: Literal["best", "rib", "facet"] = "best"
) -> MeshTri:
    """The triangulation whose nodes are the nodes of both grids (Section 3, Figures 4c and 4f).

    Each inner facet and the barycentres on its two sides span a quadrilateral, cut in two along
    the facet or along its corresponded rib. Each boundary facet is cut in its middle. Triangles
    ``2 f`` and ``2 f + 1`` belong to facet ``f``.

    Parameters
    ----------
    mesh : MeshTri or DualMesh
        The triangulation, or the couple of grids. Its dual grid need not be valid: where the
        rib misses its facet the facet is kept.
    diagonal : {"best", "rib", "facet"}
        Cut along the ribs, along the facets, or in each quadrilateral along the one that leaves
        the larger smallest angle. Facets that are tagged or lie between subdomains are kept in
        any case.

    Returns
    -------
    MeshTri
        Nodes: those of the mesh, the barycentres in the order of the triangles, the middles of
        the boundary facets in the order of the facets; see `dual_nodes`. Tags carry over.

    Raises
    ------
    TypeError
        If ``mesh`` is neither a MeshTri nor a DualMesh.
    ValueError
        If ``diagonal`` is something else.
    MeshError
        If the mesh is not a triangulation.

    Examples
    --------
    >>> mesh = MeshTri().refined(2)
    >>> general = general_triangulation(mesh)
    >>> mesh.p.shape[1] + mesh.nelements + len(mesh.boundary_facets()), general.p.shape[1]
    (73, 73)
    """
    checked_choice("diagonal", diagonal, ("best", "rib", "facet"))
    if isinstance(mesh, DualMesh):
        mesh = mesh.mesh
        corners = Corners(mesh)
    else:
        check_type(mesh)
        corners = Corners(mesh)
        require(triangulation_conditions(corners))
    n, m = mesh.p.shape[1], mesh.nelements
    boundary = mesh.boundary_facets()
    p = np.hstack([mesh.p, corners.barycentres, mesh.p[:, mesh.facets[:, boundary]].mean(axis=1)])
    middle = np.full(mesh.nfacets, -1)
    middle[boundary] = n + m + np.arange(len(boundary))

    (a, b), (left, right) = mesh.facets, n + mesh.f2t
    right = np.where(mesh.f2t[1] == -1, left, right)
    along = np.stack([[a, b, left], [a, b, right]])
    across = np.stack([[a, left, right], [b, left, right]])
    cut = ~lasting_facets(mesh)
    cut[crossing_condition(corners).offending] = False
    if diagonal == "facet":
        cut[:] = False
    elif diagonal == "best":
        here = np.nonzero(cut)[0]
        kept, crossed = (
            smallest_angles(p, t[..., here].swapaxes(0, 1)).min(axis=0) for t in (along, across)
        )
        cut[here] = crossed > kept
    t = np.where(cut, across, along)
    t[0, 1, boundary] = t[1, 0, boundary] = middle[boundary]

    _require_area(p, t, mesh.f2t)
    general = MeshTri(p, np.ascontiguousarray(t.transpose(1, 2, 0).reshape(3, -1), np.int32))
    parent = np.where(mesh.f2t == -1, mesh.f2t[0], mesh.f2t).T.ravel()
    subdomains = {
        name: np.nonzero(np.isin(parent, tag))[0]
        for name, tag in user_tags(mesh.subdomains).items()
    }
    boundaries = carried_boundaries(mesh, general, middle)
    return replace(general, _boundaries=boundaries or None, _subdomains=subdomains or None)


def _require_area(p: ndarray, t: ndarray, f2t: ndarray) -> None:
    """Refuse triangles so flat that rounding of the barycentres folds those made of them."""
    flat = np.zeros(f2t.shape[1], dtype=bool)
    for half in t:
        longest = np.max(np.ptp(p[:, half], axis=1), axis=0)
        flat |= np.abs(signed_areas(p, half)) <= FLAT * longest**2
    if flat.any():
        raise MeshError(
            Condition(
                "triangles thicker than rounding errors",
                "triangle",
                np.setdiff1d(f2t[:, flat], -1),
                "remove or remesh them",
            ).message()
        )


def dual_nodes(dual: DualMesh) -> ndarray:
    """The node of the general triangulation at each node of the dual grid.

    Nodes of the triangulation keep their numbers and need no map.

    Parameters
    ----------
    dual : DualMesh
        The couple of grids.

    Returns
    -------
    (ndualnodes,) array of int
        ``general_triangulation(dual).p[:, dual_nodes(dual)]`` equals ``dual.p`` to rounding.

    Raises
    ------
    TypeError
        If ``dual`` is something else.
    """
    checked_instance("dual", dual, DualMesh, "DualMesh.from_mesh(mesh)")
    n = len(dual)
    nodes = n + np.arange(dual.p.shape[1])
    # the halves of boundary facets run between a boundary node and a middle numbered before it
    halves = slice(dual.mesh.nfacets, None)
    nodes[dual.facets[:, halves].max(axis=0)] = dual.f2c[0, halves]
    return readonly(nodes, np.int32)


def facet_numbers(mesh: MeshTri, a: ndarray, b: ndarray) -> ndarray:
    """The facets that join nodes ``a`` and ``b``, -1 where there is none."""
    # columns of facets are in lexicographic order, so their keys ascend
    n = mesh.p.shape[1]
    keys = mesh.facets[0].astype(np.int64) * n + mesh.facets[1]
    wanted = np.minimum(a, b).astype(np.int64) * n + np.maximum(a, b)
    place = np.searchsorted(keys, wanted).clip(max=len(keys) - 1)
    return np.where(keys[place] == wanted, place, -1)


def lasting_facets(mesh: MeshTri) -> ndarray:
    """Whether each facet must stay: on the boundary, tagged or between subdomains."""
    lasting = mesh.f2t[1] == -1
    for tag in user_tags(mesh.boundaries).values():
        lasting[np.asarray(tag)] = True
    for tag in user_tags(mesh.subdomains).values():
        within = np.zeros(mesh.nelements, dtype=bool)
        within[tag] = True
        lasting |= within[mesh.f2t[0]] != within[mesh.f2t[1]]
    return lasting


def carried_boundaries(
    mesh: MeshTri, other: MeshTri, middle: ndarray | None = None
) -> dict[str, ndarray]:
    """Boundaries of ``mesh`` as tags of ``other``, which has its nodes and tagged facets.

    ``middle`` is the node of ``other`` that halves each facet, -1 where it is whole.
    """
    if not (tags := user_tags(mesh.boundaries)):
        return {}
    middle = np.full(mesh.nfacets, -1) if middle is None else middle
    carried = {}
    for name, tag in tags.items():
        facets = np.asarray(tag)
        a, b = mesh.facets[:, facets]
        halved = middle[facets] != -1
        ends = np.where(halved, middle[facets], b)
        pieces = np.concatenate(
            [facet_numbers(other, a, ends), facet_numbers(other, b[halved], ends[halved])]
        )
        if isinstance(tag, OrientedBoundary):
            # the sides of a facet kept whole are told by geometry, a half has only one side
            turned = _first_on_left(mesh, facets) != _first_on_left(other, pieces[: len(facets)])
            ori = np.where(halved, tag.ori, tag.ori ^ turned)
            carried[name] = OrientedBoundary(pieces, np.concatenate([ori, tag.ori[halved]]))
        else:
            carried[name] = pieces
    return carried


def _first_on_left(mesh: MeshTri, facets: ndarray) -> ndarray:
    """Whether the first triangle of a facet lies to the left of it."""
    a, b = mesh.facets[:, facets]
    apex = mesh.t[:, mesh.f2t[0, facets]].sum(axis=0) - a - b
    return signed_areas(mesh.p, np.stack([a, b, apex])) > 0
