"""What stands on a footprint, whatever it is, and what it takes to move a rigid base and to let it
lift off."""

from abc import ABC, abstractmethod
from dataclasses import replace
from typing import Any, Self, cast

import numpy as np
from numpy import ndarray
from scipy.sparse import issparse
from skfem import CellBasis

from ..arguments import checked_flag
from ..contact.edges import EdgeBoundaries, grows_to_edge, presses_over, pulling
from ..contact.footprint import Edge, Footprint
from ..contact.motions import Motions, moving
from ..contact.shapes import Gap, gap_values
from ..contact.system import ContactSystem
from ..elements.edge_weights import EdgeWeights
from ..elements.resolution import bonded_too_coarse, has_crust, too_coarse
from ..errors import MeshError, ResolutionWarning, warn, warnings_kept
from ..grids.cellwise import CellwiseBasis
from ..grids.fan import Fan
from ..grids.mappings import with_own_mesh
from ..grids.partition import Partition
from ..grids.polygons import readonly
from ..ground.substrates import Substrate
from ..kernels.once import FromFields, computed_once, freeze
from .kern import kern, require_pressing

#: shapes farther from the ground than so many times what they vary by lose their digits
OFFSET = 3e4


class Unchosen(str):
    """An ``edge`` that follows from shape and ground, which it does anew where others are given:
    `dataclasses.replace` hands on what stands in the fields."""


def owned(value: Any) -> Any:
    """What a body is made of, copied where it could be changed in place: pickles and variants are
    made of it again."""
    if isinstance(value, np.ndarray) or issparse(value):
        value = value.copy()
        if hasattr(value, "sum_duplicates"):  # which scipy does in place, as for abs
            value.sum_duplicates()
        freeze(value)
        return value
    if isinstance(value, CellBasis) and not isinstance(value, CellwiseBasis):
        return with_own_mesh(value)
    if type(value) in (list, tuple):
        return type(value)(map(owned, value))
    if isinstance(value, dict):
        return {name: owned(each) for name, each in value.items()}
    return value


class Body(FromFields, ABC):
    """What stands on a footprint shows its cells."""

    substrate: Substrate
    basis: CellBasis
    edge: Edge | None
    edge_boundaries: EdgeBoundaries | None
    gap: Gap | None
    #: whether it was left to the contact what edge there is
    edge_by_contact: bool

    def _own(self, *names: str) -> None:
        """Keep copies of these fields."""
        for name in names:
            object.__setattr__(self, name, owned(getattr(self, name)))

    def _choose_edge(self, flat: bool, by_contact: bool) -> None:
        """That of a flat body or of another, where it was left to shape and ground, and whether
        the contact has a say."""
        if self.edge is None or isinstance(self.edge, Unchosen):
            grows = self.edge_boundaries is not None or grows_to_edge(self.substrate, self.basis)
            edge = "singular" if flat and grows else "constant"
            object.__setattr__(self, "edge", Unchosen(edge))
            object.__setattr__(self, "edge_by_contact", by_contact and grows)

    @property
    def sharp_edge(self) -> bool:
        """Whether pressures grow to the edge of the plan, whether or not they do inside cells; of
        shaped bodies whether they were chosen to."""
        return self.edge == "singular" or (
            self.gap is None and grows_to_edge(self.substrate, self.basis)
        )

    @property
    @abstractmethod
    def footprint(self) -> Footprint:
        """The cells under the body, with all that pressures and gaps depend on."""

    @property
    def partition(self) -> Partition:
        """The cells, in the order of the DOFs of the basis."""
        return self.footprint.partition

    @property
    def fan(self) -> Fan:
        """Triangles that fill the cells."""
        return self.footprint.fan

    @property
    def weights(self) -> EdgeWeights | None:
        """How the pressure varies inside the cells; None if it does not."""
        return self.footprint.weights

    @property
    def collocation_points(self) -> ndarray:
        """Collocation point of each cell, shape (2, n)."""
        return self.footprint.collocation_points

    @computed_once
    def initial_gap(self) -> ndarray:
        """Gap between the unloaded body and the ground in the collocation points."""
        x = self.collocation_points
        return readonly(np.zeros(x.shape[1]) if self.gap is None else gap_values(self.gap, x))

    def _warn(self) -> None:
        """Warn of cells too coarse for the ground and of a shape far above it, when a body is
        made: copies of it are the same body."""
        gap = self.initial_gap
        if self._coarse:
            warn(self._coarse, ResolutionWarning)
        if gap.min() > OFFSET * np.ptp(gap) > 0:
            warn(
                f"the shape begins {gap.min():.3g} above the ground and varies by "
                f"{np.ptp(gap):.3g} only, of which hardly a digit is left in what is solved. "
                "Remedy: less its least value, which then is part of the settlement",
                ResolutionWarning,
            )

    @computed_once
    def _coarse(self) -> str:
        """Why its cells are too coarse for the ground; empty if they are not."""
        cells = self.footprint
        return too_coarse(cells.substrate, cells.partition, cells.edge == "singular") or ""

    @computed_once
    def sharp(self) -> Self:
        """The same with the edge of a flat punch."""
        self._same_shape()
        with warnings_kept():  # told when this one was made
            return replace(cast(Any, self), edge="singular")

    @computed_once
    def _pressing_over(self) -> Self:
        """The same, where it is what answers: told if cells are too coarse for that edge."""
        if self.sharp._coarse and not self._coarse:
            warn(self.sharp._coarse, ResolutionWarning)
        return self.sharp

    @property
    def _may_press_over(self) -> bool:
        return self.edge_by_contact and not self.footprint.regular

    def _same_shape(self) -> Any:
        """The shape, if it is not a function that tells another than when the body was made."""
        gap, x = self.gap, self.collocation_points
        if callable(gap) and not np.array_equal(gap_values(gap, x), self.initial_gap):
            raise ValueError(
                "expected a shape that stays as it was when the body was made, got a function "
                "that tells other gaps now; likely cause: a variable of a loop. Remedy: its value "
                "as a default, lambda x, k=k: ..."
            )
        return gap

    def over_edge(self, pressure: ndarray, ribs: ndarray | None = None) -> Self | None:
        """The same with the edge of a flat punch, where a shaped one whose edge was not chosen
        presses over that of its plan, all of it or some ribs; None where it does not."""
        over = self._may_press_over and presses_over(self.partition, pressure, ribs)
        return self._pressing_over if over else None

    @property
    def pressed_down(self) -> Self:
        """The same while the whole base touches, and pressures grow to its edge."""
        return self._pressing_over if self._may_press_over else self

    @property
    def acting(self) -> ndarray:
        """Point through which the pressure of each cell acts, shape (2, n)."""
        return self.footprint.acting

    @property
    def centre(self) -> ndarray:
        """Centroid of the plan, about which all is computed: no cancellation far from it."""
        return self.footprint.centre

    @property
    def resultants(self) -> ndarray:
        """Force and first moments about the plan's centroid of unit pressures, shape (3, n)."""
        return self.footprint.resultants

    @property
    def grid_description(self) -> str:
        """Number and kind of the cells and the collocation, for tables."""
        return self.footprint.description

    def planes(self, x: ndarray) -> ndarray:
        """Settlement at ``x`` by unit settlement of the plan's centroid and unit tilts."""
        return self.footprint.planes(x)

    def influence(self, x: ndarray) -> ndarray:
        """Settlement of points of shape (2, m) under unit pressure on each cell, (m, n)."""
        return self.footprint.influence(x)


class Movable(Body):
    """A rigid base that touches everywhere, what it takes to move it, and where a force leaves it
    there."""

    origin: Any
    gap: Any
    work: Any

    @property
    @abstractmethod
    def system(self) -> ContactSystem:
        """The equations for pressures and the position of the plan's centroid."""

    def stiffness(self, *, full: bool = False, rough: bool = False) -> ndarray:
        """Force and moments by unit settlement and unit tilts, or by all six motions, while the
        whole base touches.

        Parameters
        ----------
        full : bool
            Whether the base also slides and twists; not on layers on a smooth rigid base.
        rough : bool
            Whether the base is bonded to the ground everywhere, so that pressures and shear
            tractions are coupled; ``full`` only. Otherwise it is relaxed: horizontal motions are
            carried by shear tractions alone, vertical ones by pressures alone.

        Returns
        -------
        (3, 3) or (6, 6) array of float
            Maps ``(W0, Lx, Ly)`` of (3) to the integrals of ``p``, ``p x`` and ``p y`` with the
            coordinates from ``origin``; under a flat punch with a singular edge by the work of
            the pressures, which is closer, as positions under loads are.
            If ``full``, ``(W0, Lx, Ly, Ux, Uy, twist)`` to these and ``(Hx, Hy, T)``: horizontal
            displacements of the origin along x and y, and the rotation about the vertical, from x
            towards y; the force on the base and its moment likewise. Symmetric, the first three
            rows and columns up to the error of the discretisation if not ``full``.

        Warns
        -----
        ResolutionWarning
            If cells are too long and thin for the law of the edge; or if they are too coarse for
            a base bonded to a thin layer that keeps its volume, or nearly so.

        Raises
        ------
        MeshError
            If they are so coarse that such a base would move against forces.
        ValueError
            If ``rough`` without ``full``, or if ``full`` and the ground does not hold horizontal
            forces or there are more than 4000 cells.
        TypeError
            If one is neither True nor False.

        Examples
        --------
        >>> from skfem import MeshTri
        >>> from skfem_dual import DualMesh, HalfSpace, RigidPunch
        >>> dual = DualMesh.from_mesh(MeshTri.init_circle(4))
        >>> K = RigidPunch(HalfSpace(1.0, 0.0), dual.basis()).stiffness()
        >>> [round(float(k), 2) for k in K.diagonal()]  # exact for the circle: 2, 4/3, 4/3
        [2.0, 1.33, 1.33]
        """
        if self.pressed_down is not self:
            return self.pressed_down.stiffness(full=full, rough=rough)
        if checked_flag("full", full):
            return self._full_stiffness(checked_flag("rough", rough))
        if checked_flag("rough", rough):
            raise ValueError("expected full=True with rough=True: a smooth base moves vertically")
        shift = np.eye(3)
        shift[0, 1:] = self.centre - self.origin
        return shift.T @ self._vertical_stiffness @ shift

    def kern(self) -> ndarray:
        """Where a force may act without the punch lifting off.

        Returns
        -------
        (2, k) array of float
            Vertices of a convex polygon, counter-clockwise, from ``origin``.

        Raises
        ------
        ValueError
            If the punch is not flat: it lifts off depending on the force.
        ConvergenceError
            If pure settlement does not press on every cell: on a stiff crust there may be no kern,
            elsewhere improve the mesh. Or if so few cells resist no tilt.

        Warns
        -----
        ResolutionWarning
            If it presses only slightly on some cell, as on stiff crusts, so that the kern may be
            too large.

        Examples
        --------
        A third of the radius of a circle:

        >>> from skfem import MeshTri
        >>> from skfem_dual import DualMesh, HalfSpace, RigidPunch
        >>> dual = DualMesh.from_mesh(MeshTri.init_circle(4))
        >>> corners = RigidPunch(HalfSpace(1.0, 0.0), dual.basis()).kern()
        >>> print(f"{np.hypot(*corners).mean():.2f}")
        0.33
        """
        if self.gap is not None:
            raise ValueError(
                "expected a flat punch, got one with a gap, whose contact depends on the force"
            )
        require_pressing(self.system, self.partition)
        return readonly(self._kern - np.array(self.origin)[:, None])

    @computed_once
    def _kern(self) -> ndarray:
        """The same in the coordinates of the plan."""
        return kern(self.system, self.partition, self.acting, self.centre)

    def _full_stiffness(self, rough: bool) -> ndarray:
        shift = moving(self.centre - self.origin)
        if rough:
            return shift.T @ self._bonded_stiffness() @ shift
        stiffness = np.zeros((6, 6))
        stiffness[3:, 3:] = self.relaxed_motions.stiffness
        vertical = self._vertical_stiffness
        stiffness[:3, :3] = (vertical + vertical.T) / 2
        return shift.T @ stiffness @ shift

    def _bonded_stiffness(self) -> ndarray:
        """By motions of the plan's centroid."""
        cells = self.footprint
        stiffness = Motions(cells, True, np.ones(len(cells), dtype=bool)).stiffness
        coarse = bonded_too_coarse(cells.substrate, cells.partition)
        sizes = np.sqrt(np.abs(stiffness.diagonal()))
        if np.linalg.eigvalsh(stiffness / np.outer(sizes, sizes))[0] <= 0:
            raise MeshError(
                "expected cells fine enough for a base bonded to this ground, got a stiffness by "
                f"which it moves against forces: {coarse or f'{len(cells)} cells'}"
            )
        if coarse:
            warn(coarse, ResolutionWarning)
        return stiffness

    def warn_of_pulling(self, name: str = "") -> None:
        """Warn where pressures under a mere settlement show that the law of the edge fails; with
        a ``name`` said first."""
        if self.weights is None:
            return
        areas, pressure = self.partition.areas, self.system.unit_pressures[:, 0]
        message = pulling(areas, pressure)
        if message and has_crust(self.footprint.substrate, self.partition):
            plain = replace(cast(Any, self), edge="constant", edge_boundaries=None)
            constant = plain.system.unit_pressures[:, 0]
            message = pulling(areas, pressure, constant)
        if message:
            warn(name + message, ResolutionWarning)

    @property
    def _vertical_stiffness(self) -> ndarray:
        """By motions of the plan's centroid."""
        self.warn_of_pulling()
        by_work = self.gap is None and self.weights is not None and self.footprint.resisting
        return self.work.stiffness if by_work else self.system.stiffness

    @computed_once
    def relaxed_motions(self) -> Motions:
        """Horizontal ones while the whole base touches."""
        return Motions(self.footprint, False, np.ones(len(self.footprint), dtype=bool))
