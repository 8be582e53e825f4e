"""The Preprocessor: better nodes for a triangulation, so that it has a good dual grid."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy import ndarray
from numpy.typing import ArrayLike
from skfem import MeshTri

from ..arguments import (
    checked_choice,
    checked_flag,
    checked_indices,
    checked_integer,
    checked_number,
)
from ..errors import ConvergenceWarning, MeshError, warn
from ..kernels.progress import progress_bar
from .checks import check_type, crossing_condition, triangulation_conditions
from .corners import Corners
from .flips import flipped
from .general import lasting_facets
from .quality import MeshQuality
from .relocation import Show, to_centroids, to_means
from .report import Condition, require

MEANING = {"neighbours": "means of the neighbours", "cells": "barycentres of the cells"}

Progress = bool | Callable[[int, float], None]


def silent(iteration: int, distance: float) -> None:
    """Show nothing."""


@dataclass(frozen=True)
class Quality:
    """How good a triangulation is for its dual grid.

    Attributes
    ----------
    smallest_angle : float
        In degrees.
    uncrossed : int
        Number of facets not crossed by their corresponded ribs; the dual grid is valid if 0.
    from_means : float
        Largest distance of an inner node to the mean of its neighbours, over the mean length of
        its facets.
    """

    smallest_angle: float
    uncrossed: int
    from_means: float

    @classmethod
    def of(cls, mesh: MeshTri) -> "Quality":
        """The quality of a triangulation."""
        quality = MeshQuality(mesh)
        return cls(
            float(quality.smallest_angles.min()),
            len(crossing_condition(Corners(mesh)).offending),
            float(np.fmax.reduce(quality.from_means, initial=0.0)),
        )

    def better(self, other: "Quality") -> bool:
        """Whether fewer facets are uncrossed or, if as many, the smallest angle is larger."""
        gain = self.smallest_angle - other.smallest_angle
        return self.uncrossed < other.uncrossed or (
            self.uncrossed == other.uncrossed and gain > 1e-9
        )


@dataclass(frozen=True, repr=False)
class PreprocessReport:
    """What the Preprocessor did.

    Attributes
    ----------
    before, after : Quality
        The triangulation given and the one returned.
    iterations : int
        Sparse systems solved.
    flips : int
        Facets flipped.
    success : bool
        Whether the aim was reached.
    message : str
        How it ended.
    """

    before: Quality
    after: Quality
    iterations: int
    flips: int
    success: bool
    message: str

    def __repr__(self) -> str:
        rows = (
            ("Smallest angle, degrees", "smallest_angle", ".2f"),
            ("Facets not crossed by their ribs", "uncrossed", "d"),
            ("Distance to the mean of the neighbours, facet lengths", "from_means", ".3g"),
        )
        lines = [
            f"  {title}: {getattr(self.before, name):{form}} -> {getattr(self.after, name):{form}}"
            for title, name, form in rows
        ]
        return (
            "<skfem_dual PreprocessReport object>\n"
            + "\n".join(lines)
            + f"\n  Iterations: {self.iterations}, flips: {self.flips}\n"
            f"  {'Success' if self.success else 'FAILURE'}: {self.message}"
        )


def relocate(
    mesh: MeshTri,
    to: Literal["neighbours", "cells"] = "neighbours",
    *,
    fixed: ArrayLike = (),
    tol: float = 1e-6,
    maxiter: int = 100,
    progress: Progress = False,
) -> tuple[MeshTri, PreprocessReport]:
    """Move the inner nodes to the mean of their neighbours or to the barycentre of their cells.

    Nodes on the boundary, on tagged facets and between subdomains stay where they are. No
    triangle flips; neither is the mesh sure to get better, see `improve`.

    Parameters
    ----------
    mesh : MeshTri
        The triangulation; its dual grid need not be valid.
    to : {"neighbours", "cells"}
        The arithmetic mean of the neighbours: one sparse system. Nodes of triangles that would
        flip, as happens in domains that are not convex, keep their places, and the others
        are found anew. Or the area centroid of the cell of the dual grid: a fixed point,
        found by Anderson's acceleration preconditioned with the same system.
    fixed : sequence of int
        More nodes that stay.
    tol : float
        With "cells": ends when no node is farther from the centroid of its cell than ``tol``
        times the square root of the cell's area.
    maxiter : int
        Largest number of systems solved.
    progress : bool or callable
        Whether to show a bar (tqdm), or ``progress(iteration, distance)`` called after each
        iteration, with the distance that ``tol`` limits or the number of nodes that stayed.

    Returns
    -------
    mesh : MeshTri
        The same triangles and tags on the relocated nodes.
    report : PreprocessReport
        Before and after; ``success`` is False if some node could not be placed as asked.

    Raises
    ------
    TypeError
        If ``mesh`` is not a MeshTri.
    ValueError
        If ``to``, ``fixed``, ``tol`` or ``maxiter`` is wrong.
    MeshError
        If the mesh is not a triangulation.

    Warns
    -----
    ConvergenceWarning
        If ``success`` is False.

    Notes
    -----
    Section 3 of the paper, Figs. 4 and 5.

    Examples
    --------
    >>> mesh, report = relocate(MeshTri.init_circle(3), "cells")
    >>> report.success, report.after.uncrossed
    (True, 0)
    """
    checked_choice("to", to, ("neighbours", "cells"))
    tol = checked_number("tol", tol, above=0)
    maxiter = checked_integer("maxiter", maxiter, at_least=1)
    _check(mesh)
    with _shown(progress) as show:
        moved, report = relocated(mesh, to, _free_nodes(mesh, fixed), tol, maxiter, show)
    if not report.success:
        warn(report.message, ConvergenceWarning)
    return moved, report


def improve(mesh: MeshTri, *, fixed: ArrayLike = ()) -> tuple[MeshTri, PreprocessReport]:
    """The best of a mesh and its relocations to means and to barycentres of cells.

    Better is the mesh with fewer facets not crossed by their corresponded ribs or, if they are
    as many, the one with the larger smallest angle. So no mesh gets worse.

    Parameters
    ----------
    mesh : MeshTri
        The triangulation; its dual grid need not be valid.
    fixed : sequence of int
        Nodes that stay besides those on the boundary, on tagged facets and between subdomains.

    Returns
    -------
    mesh : MeshTri
        The same triangles and tags.
    report : PreprocessReport
        Before and after. ``success`` is always True.

    Raises
    ------
    TypeError, ValueError, MeshError
        As `relocate`.
    """
    _check(mesh)
    return _improve(mesh, _free_nodes(mesh, fixed))


def repair(
    mesh: MeshTri, *, fixed: ArrayLike = (), rounds: int = 10
) -> tuple[MeshTri, PreprocessReport]:
    """A triangulation of the same domain and nodes whose dual grid is valid.

    A mesh whose dual grid is valid is returned as it is. Otherwise `improve` and flips of facets
    take turns. A facet is flipped if then fewer facets nearby are not crossed by their ribs or,
    if they are as many, the smallest angle on its two sides is larger: first near facets not
    crossed, then anywhere. Boundary facets, tagged facets and those between subdomains are not.

    Parameters
    ----------
    mesh : MeshTri
        The triangulation.
    fixed : sequence of int
        Nodes that stay besides those on the boundary, on tagged facets and between subdomains.
    rounds : int
        Largest number of turns.

    Returns
    -------
    mesh : MeshTri
        The nodes keep their numbers, the triangles their subdomains; tags are kept.
    report : PreprocessReport
        Before and after, with the number of flips.

    Raises
    ------
    TypeError, ValueError
        As `relocate`.
    MeshError
        If the mesh is not a triangulation, or it cannot be repaired: the message tells where.
    """
    _check(mesh)
    rounds = checked_integer("rounds", rounds, at_least=0)
    free = _free_nodes(mesh, fixed)
    before = after = Quality.of(mesh)
    iterations = flips = 0
    for turn in range(rounds):
        if after.uncrossed == 0:
            break
        mesh, report = _improve(mesh, free)
        iterations += report.iterations
        after = report.after
        if after.uncrossed:
            mesh, count = flipped(mesh, everywhere=turn > 0)
            flips += count
            after = Quality.of(mesh)
            if count == 0 and turn > 0:
                break
    if after.uncrossed:
        ends = mesh.facets[:, crossing_condition(Corners(mesh)).offending]
        a = ends[0, 0]
        raise MeshError(
            Condition(
                "every facet to be crossed by the segment between the barycentres of its "
                "triangles, after relocation and flips",
                "node",
                np.unique(ends),
                "move or add nodes there",
                f"node {a} is at {mesh.p[0, a]:.6g}, {mesh.p[1, a]:.6g}",
            ).message()
        )
    return mesh, PreprocessReport(before, after, iterations, flips, True, "the dual grid is valid")


def _check(mesh: MeshTri) -> None:
    check_type(mesh)
    require(triangulation_conditions(Corners(mesh)))


def _free_nodes(mesh: MeshTri, fixed: ArrayLike) -> ndarray:
    """Nodes that may move."""
    n = mesh.p.shape[1]
    fixed = checked_indices("fixed", fixed, n)
    free = np.ones(n, dtype=bool)
    free[fixed] = False
    free[mesh.facets[:, lasting_facets(mesh)]] = False
    return free


def _improve(mesh: MeshTri, free: ndarray) -> tuple[MeshTri, PreprocessReport]:
    before = best = Quality.of(mesh)
    chosen, message = mesh, "kept as it was"
    iterations = 0
    for to in ("neighbours", "cells"):
        moved, report = relocated(mesh, to, free)
        iterations += report.iterations
        if report.after.better(best):
            chosen, best, message = moved, report.after, f"relocated to the {MEANING[to]}"
    return chosen, PreprocessReport(before, best, iterations, 0, True, message)


def relocated(
    mesh: MeshTri,
    to: str,
    free: ndarray,
    tol: float = 1e-3,
    maxiter: int = 30,
    show: Show = silent,
) -> tuple[MeshTri, PreprocessReport]:
    """`relocate` of the nodes where ``free``, without checks and warnings."""
    if to == "neighbours":
        p, iterations, failure = to_means(mesh, free, maxiter, show)
    else:
        p, iterations, failure = to_centroids(mesh, free, tol, maxiter, show)
    # the caches of a mesh belong to its places: a new one
    moved = replace(mesh, doflocs=np.ascontiguousarray(p), t=mesh.t.copy())
    message = failure or f"inner nodes are at the {MEANING[to]}"
    if not free.any():
        message = "all nodes are fixed"
    return moved, PreprocessReport(
        Quality.of(mesh), Quality.of(moved), iterations, 0, not failure, message
    )


@contextmanager
def _shown(progress: Progress) -> Iterator[Show]:
    """A function of iteration and distance that shows them, or not."""
    if callable(progress):
        yield progress
    elif checked_flag("progress", progress):
        with progress_bar(True, "relocation", "it") as bar:
            done = 0

            def show(iteration: int, distance: float) -> None:
                nonlocal done
                bar.update(iteration - done)
                bar.set_postfix_str(f"{distance:.1e}")
                done = iteration

            yield show
    else:
        yield silent
