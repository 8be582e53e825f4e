"""Meshes refined where contact ends."""

from collections.abc import Callable, Mapping
from dataclasses import asdict
from typing import Any

import numpy as np
from skfem import MeshTri

from ..arguments import checked_instance, checked_integer, checked_text
from ..contact.load import Load
from ..grids.cellwise import nodal_mesh
from ..grids.checks import check_type
from ..grids.outline import edge_facets
from ..grids.polygons import some
from ..grids.preprocess import repair
from ..messages import shown
from ..solutions.punch_solution import PunchSolution
from .punch import RigidPunch

#: each refinement makes cells half as large: more cannot be told apart
MOST = 50


def refine_to_contact(
    make: Callable[[MeshTri], RigidPunch],
    mesh: MeshTri,
    load: Load | Mapping,
    refinements: int = 3,
    **options: Any,
) -> list[PunchSolution]:
    """Solve on meshes that are refined around the edge of contact, each from the last contact.

    Parameters
    ----------
    make : callable
        Makes the punch on a mesh.
    mesh : MeshTri
        The first mesh; its tags are lost by refinement.
    load : Load or mapping
        What is imposed; a mapping has keyword arguments of `RigidPunch.solve`.
    refinements : int
        How often to refine.
    options
        Further arguments of `RigidPunch.solve`, without ``start``: each solution starts from the
        one before.

    Returns
    -------
    list of PunchSolution
        On the first mesh, then on each refined one; fewer if contact is full or none.

    Raises
    ------
    TypeError, ValueError
        If ``make`` makes no `RigidPunch` on the mesh that it is given, ``start`` is given, or the
        mesh has seams, where facets lie on others with nodes of their own.

    Examples
    --------
    >>> from skfem_dual import DualMesh, HalfSpace
    >>> from skfem_dual.contact.shapes import Paraboloid
    >>> def sphere(mesh):
    ...     basis = DualMesh.from_mesh(mesh).basis()
    ...     return RigidPunch(HalfSpace(1.0, 0.0), basis, gap=Paraboloid(1.0))
    >>> found = refine_to_contact(sphere, MeshTri.init_circle(3), {"force": 1 / 6}, 2)
    >>> [round(s.settlement, 2) for s in found]  # exact: 0.25
    [0.25, 0.25, 0.25]
    """
    if not callable(make) or isinstance(make, type):
        raise TypeError(f"expected a function of a mesh for make, got {shown(make)}")
    check_type(mesh)
    if isinstance(load, Load):  # what it leaves free may stand in the options
        load = {key: value for key, value in asdict(load).items() if value is not None}
    for key in checked_instance("load", load, Mapping):
        if checked_text("a key of load", key) in options:
            raise TypeError(f"expected {key} in the load or beside it, got it in both")
    if "start" in {**load, **options}:
        raise TypeError("expected no start: each solution starts from the one before")
    refinements = checked_integer("refinements", refinements, at_least=0, at_most=MOST)
    punch = _on(make, mesh)
    if refinements:
        _require_no_seams(punch)
    solutions = [punch.solve(**load, **options)]
    for _ in range(refinements):
        last = solutions[-1]
        mesh = nodal_mesh(last.punch.basis)
        marked = last.contact_region.crossed(mesh)
        if len(marked) == 0:
            break
        # with the triangles around: the edge moves a little
        around = np.isin(mesh.t, mesh.t[:, marked]).any(axis=0)
        # refined triangles at the seam can be too long for a dual grid
        mesh, _report = repair(MeshTri(mesh.p, mesh.t).refined(np.nonzero(around)[0]))
        solutions.append(_on(make, mesh).solve(**load, start=last, **options))
    return solutions


def _on(make: Callable[[MeshTri], RigidPunch], mesh: MeshTri) -> RigidPunch:
    """The punch on a mesh, refused if it is on another."""
    punch = checked_instance("make(mesh)", make(mesh), RigidPunch)
    own = nodal_mesh(punch.basis)
    if own.p.shape != mesh.p.shape or own.t.shape != mesh.t.shape:
        raise ValueError(
            f"expected a punch on the mesh that make is given, of {mesh.nvertices} nodes and "
            f"{mesh.nelements} triangles, got one on {own.nvertices} nodes and {own.nelements} "
            "cells. Remedy: make its basis of the argument"
        )
    return punch


def _require_no_seams(punch: RigidPunch) -> None:
    """Refuse parts that meet node to node: their triangles would be cut on one side only."""
    seams = np.setdiff1d(nodal_mesh(punch.basis).boundary_facets(), edge_facets(punch.partition))
    if len(seams):
        raise ValueError(
            "expected a mesh without seams, got facets that lie on others but have nodes of their "
            f"own: {some(seams)}, which refinement would take apart. Remedy: "
            "mesh.remove_duplicate_nodes(), if they are to be one"
        )
