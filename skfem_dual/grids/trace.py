"""The plan of a solid: the mesh of its boundary that faces the ground."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy import ndarray
from skfem import MeshHex, MeshQuad, MeshTet, MeshTri

from ..arguments import checked_indices
from ..messages import shown
from .polygons import some

#: heights of a horizontal plane may differ by so many times the size of the plan
LEVEL = 1e-9


def trace(mesh: MeshTet | MeshHex, boundary: Any) -> MeshTri | MeshQuad:
    """The plan of a solid, as a mesh whose cells are facets of the solid.

    Parameters
    ----------
    mesh : MeshTet or MeshHex
        The solid.
    boundary : str, array of int or any other form that scikit-fem takes
        Its facets that face the ground, in a plane z = const.

    Returns
    -------
    MeshTri or MeshQuad
        Coordinates x and y. Tags are kept: cells are in the subdomains of the elements above
        them, and facets of other named boundaries among them become subdomains too; where another
        named boundary meets the plan's edge, its name is that of the facets there.

    Raises
    ------
    TypeError
        If the mesh is no solid of tetrahedra or hexahedra.
    ValueError
        If the boundary is unknown, has no facets, or some inside the solid, or is not horizontal.

    Examples
    --------
    >>> from skfem import MeshTet
    >>> block = MeshTet().refined(2).with_boundaries({"base": lambda x: x[2] == 0})
    >>> trace(block, "base").nelements
    32
    """
    if not isinstance(mesh, (MeshTet, MeshHex)):
        raise TypeError(f"expected a MeshTet or MeshHex, got {type(mesh).__name__}")
    facets = checked_facets(mesh, boundary)
    p = mesh.p[:, mesh.facets[:, facets]]
    height, size = float(p[2].mean()), float(np.ptp(p[:2], axis=(1, 2)).max())
    off = np.abs(p[2] - height).max(axis=0)
    if len(bad := np.nonzero(~(off <= LEVEL * size))[0]):
        raise ValueError(
            f"expected facets in one plane z = const, got facets {some(facets[bad])} off "
            f"z = {height:g} by up to {off.max():.3g}"
        )
    kind = MeshTri if isinstance(mesh, MeshTet) else MeshQuad
    plan, _ = mesh.trace(facets, mtype=kind, project=lambda p: p[:2])
    nodes = np.unique(mesh.facets[:, facets])  # in the order of the plan's
    outer = plan.boundary_facets()
    edges = _numbers(mesh, nodes[plan.facets[:, outer]])
    boundaries, subdomains = {}, {}
    for name, tagged in (mesh.subdomains or {}).items():
        below = np.nonzero(np.isin(mesh.f2t[0, facets], tagged))[0]
        if len(below):
            subdomains[name] = below
    for name, tagged in (mesh.boundaries or {}).items():
        inside = np.nonzero(np.isin(facets, tagged))[0]
        if 0 < len(inside) < len(facets):
            subdomains[name] = inside
        meets = np.isin(edges, mesh.f2e[:, np.setdiff1d(tagged, facets)])
        if meets.any():
            boundaries[name] = outer[meets]
    return plan.with_boundaries(boundaries).with_subdomains(subdomains)


def checked_facets(mesh: MeshTet | MeshHex, boundary: Any) -> ndarray:
    """Numbers of the facets of a boundary.

    Raises
    ------
    TypeError, ValueError
        If the boundary is unknown, in no form that scikit-fem takes, has no facets, or some that
        lie inside the solid.
    """
    known = mesh.boundaries or {}
    if isinstance(boundary, str) and boundary not in known:
        raise ValueError(
            f"expected the name of a boundary of the mesh, {sorted(known)}, got {boundary!r}"
        )
    if isinstance(boundary, type) or boundary is None:
        raise TypeError(f"expected a boundary by its name or facets, got {shown(boundary)}")
    facets = boundary
    if callable(boundary):
        boundary = _on_each(boundary)
    if not isinstance(boundary, (list, tuple)) or boundary:  # which scikit-fem would concatenate
        try:
            facets = mesh.normalize_facets(boundary)
        except (NotImplementedError, ValueError) as error:  # of scikit-fem, the first without text
            if callable(boundary):
                raise
            raise ValueError(
                f"expected a boundary by its name, one of {sorted(known)}, or facets, got "
                f"{shown(boundary)}"
            ) from error
    facets = np.unique(checked_indices("boundary", facets, mesh.nfacets, each="place"))
    if len(facets) == 0:
        raise ValueError("expected facets that face the ground, got none")
    inside = facets[mesh.f2t[1, facets] != -1]
    if len(inside):
        raise ValueError(
            f"expected facets on the boundary of the solid, facets {some(inside)} lie inside. "
            "Remedy: mesh.facets_satisfying(..., boundaries_only=True), or mesh.restrict to what "
            "stands on the ground"
        )
    return facets


def _on_each(boundary: Callable) -> Callable:
    """A function of places that tells of each whether it is meant."""

    def checked(x: ndarray) -> ndarray:
        told = np.asarray(boundary(x))
        if told.shape != x.shape[1:]:
            raise ValueError(
                f"expected {x.shape[1]} values of boundary(x), one for each facet, got "
                f"{shown(told)}. Remedy: compare coordinates, as lambda x: x[2] == 0"
            )
        return told

    return checked


def _numbers(mesh: MeshTet | MeshHex, ends: ndarray) -> ndarray:
    """Numbers of edges of a solid with the given ends, shape (2, k)."""

    def key(pairs: ndarray) -> ndarray:
        low, high = np.sort(pairs.astype(np.int64), axis=0)
        return low * mesh.p.shape[1] + high

    known = key(mesh.edges)
    order = np.argsort(known)
    return order[np.searchsorted(known, key(ends), sorter=order)]
