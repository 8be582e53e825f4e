"""The fast multipole method put together; the package tells which step is which function."""

from dataclasses import dataclass, replace

import numpy as np
from numpy import ndarray

from ...elements.cell_dipoles import Circles, Fall
from ...elements.edge_weights import EdgeWeights
from ...elements.moments import Multipoles, pressure_moments
from ...elements.near import NearField
from ...grids.partition import Partition
from ...ground.hankel import RadialTable
from ...ground.substrates import Substrate
from ...kernels.compiled import inputs
from ...kernels.limits import limited_threads
from ...kernels.once import computed_once
from ...kernels.threads import Threads
from .assembly import (
    MultipoleToLocal,
    first_columns,
    first_rows,
    l2l_translation,
    m2l_translations,
    m2m_translation,
    m2p_blocks,
    p2l_blocks,
)
from .chebyshev import Chebyshev, Kernel, compressed
from .dipoles import DipoleSummation
from .expansions import CellExpansions, Moments, degree_of
from .families import FamilyTranslation
from .linear_maps import Run, SparseBlocks, Translation
from .lists import near_lists
from .loops import l2p, look_up
from .near_entries import NearEntries
from .quadtree import Quadtree

#: cells, or points, of a box that is not divided
LEAF = 22
#: boxes have sides of at least twice this times the radius of their cells
SLACK = 1.3
#: mean number of cells in a leaf of a uniform mesh
OCCUPANCY = 11.0
#: from this tolerance on entries are kept in single precision
SINGLE = 1e-7
#: and from this one on, in centroids on homogeneous ground, near ones in short integers
SHORT = 5e-7
#: tolerance of M2L over that of the summation
ROUGHER = 2.5

#: least order of expansions
LEAST = 4


def order_for(rtol: float) -> int:
    """Order of expansions for a relative error of settlements under pressures of one sign."""
    return max(LEAST, int(np.ceil(-2 * np.log10(rtol) - 3 - 1e-9)))


@dataclass(frozen=True, eq=False)
class FarField:
    """What depends on the kernel and the loads that act through it.

    Attributes
    ----------
    p2m : CellExpansions
        From cells to multipole expansions of their boxes.
    m2l : tuple of FamilyTranslation
        From multipole to local expansions of each level.
    m2p : SparseBlocks
        From multipole expansions to single points.
    """

    p2m: CellExpansions
    m2l: tuple[FamilyTranslation, ...]
    m2p: SparseBlocks

    @property
    def nbytes(self) -> int:
        """Memory."""
        return self.p2m.nbytes + self.m2p.nbytes + sum(t.nbytes for t in self.m2l)


@dataclass(frozen=True, eq=False)
class FastSummation:
    """What multiplies by the matrix of settlements without forming it.

    A product writes nothing here: any number of threads may ask for one at a time.

    Attributes
    ----------
    tree : Quadtree
    x : (2, m) array of float
        Field points, in the order of the tree.
    rtol : float
        Tolerance for which it was made.
    chebyshev : Chebyshev
    m2m, l2l : tuple of Translation
        Of multipole expansions to larger boxes, of local expansions to smaller ones.
    p2p : NearEntries
        Entries of near cells, exact, and their dipoles.
    p2l : SparseBlocks
        From cells to local expansions of boxes too near to theirs.
    far_fields : tuple of FarField
        For c / r, and for the remainder; they share the local expansions.
    dipoles : DipoleSummation
        From dipoles of cells to local expansions, beside their pressures.
    """

    tree: Quadtree
    x: ndarray
    rtol: float
    chebyshev: Chebyshev
    m2m: tuple[Translation, ...]
    l2l: tuple[Translation, ...]
    p2p: NearEntries
    p2l: SparseBlocks
    far_fields: tuple[FarField, ...]
    dipoles: DipoleSummation

    @classmethod
    def from_partition(
        cls,
        substrate: Substrate,
        partition: Partition,
        x: ndarray,
        weights: EdgeWeights | None,
        rtol: float,
    ) -> "FastSummation":
        """Of a relative error of about ``rtol``; see `InfluenceOperator`."""
        radius = partition.polygons.radii
        usual = np.quantile(radius, 0.9)  # few cells of a uniform mesh stay in larger boxes
        unit = max(np.sqrt(OCCUPANCY * np.median(partition.areas)), 2 * SLACK * usual)
        tree = Quadtree.from_circles(partition.centroids, radius, x, LEAF, SLACK, unit)
        return cls._of(tree, substrate, partition, x, weights, rtol)

    def at(
        self, substrate: Substrate, partition: Partition, x: ndarray, weights: EdgeWeights | None
    ) -> "FastSummation":
        """From the same cells to other points, with the expansions of the cells that are known."""
        tree = self.tree.at(x)
        if tree is None:
            return self.from_partition(substrate, partition, x, weights, self.rtol)
        return self._of(tree, substrate, partition, x, weights, self.rtol, self)

    @classmethod
    def _of(
        cls,
        tree: Quadtree,
        substrate: Substrate,
        partition: Partition,
        x: ndarray,
        weights: EdgeWeights | None,
        rtol: float,
        known: "FastSummation | None" = None,
    ) -> "FastSummation":
        dtype = np.float32 if rtol >= SINGLE else np.float64
        # beside the middles of cells entries differ little from those of charges
        regular = substrate.remainder is None and np.array_equal(x, partition.centroids)
        near_dtype = np.int16 if rtol >= SHORT and regular else dtype
        chebyshev, cells = Chebyshev(order_for(rtol)), tree.cells
        if known is None:
            circles = Circles.of(partition.centroids[:, cells], partition.areas[cells])
        else:
            circles = known.p2p.circles
        (x,) = inputs(x[:, tree.points])
        x = circles.middles if np.array_equal(x, circles.middles) else x  # once will do
        reach = partition.polygons.radii
        lists = near_lists(tree, circles.middles, reach[cells], chebyshev.terms)
        used = np.zeros(len(cells), dtype=bool)
        used[lists.p2p.items] = used[lists.p2l.items] = True
        place = np.cumsum(used, dtype=np.int32) - 1
        near = NearField.from_partition(substrate, partition, weights, cells[used], 10 * rtol)
        rows = tree.targets[:, lists.p2p.boxes]
        fall = Fall.from_substrate(substrate)
        p2p = NearEntries.from_lists(near, x, rows, lists.p2p, place, circles, fall, near_dtype)
        p2l = p2l_blocks(tree, chebyshev, near, lists.p2l, place, dtype)
        del near, place  # gives back its memory first
        laws = _laws(substrate, partition, x, weights, chebyshev, ROUGHER * rtol)
        if known is None:
            own = tree, chebyshev.order, circles
            p2m = tuple(CellExpansions.of(*own, moments, dtype) for moments, *_ in laws)
        else:
            p2m = tuple(far.p2m for far in known.far_fields)
        levels = range(len(tree.levels) - 1)
        families = [tree.families(level) for level in levels]
        return cls(
            tree,
            x,
            rtol,
            chebyshev,
            tuple(m2m_translation(tree, chebyshev, level) for level in levels[-2::-1]),
            tuple(l2l_translation(tree, chebyshev, level) for level in levels[1:]),
            p2p,
            p2l,
            tuple(
                FarField(
                    expansions,
                    m2l_translations(tree, families, factors),
                    m2p_blocks(tree, chebyshev, kernel, x, lists.m2p, dtype),
                )
                for expansions, (_, kernel, factors) in zip(p2m, laws, strict=True)
            ),
            DipoleSummation.from_tree(tree, chebyshev, lists.p2l, circles, fall),
        )

    @computed_once
    def coarse(self) -> "FastSummation":
        """By the first terms of the expansions, those of the least order: to percents."""
        chebyshev = Chebyshev(LEAST)
        terms, few = self.chebyshev.terms, chebyshev.terms
        return replace(
            self,
            chebyshev=chebyshev,
            m2m=tuple(t.cut(few) for t in self.m2m),
            l2l=tuple(t.cut(few) for t in self.l2l),
            p2l=first_rows(self.p2l, terms, few),
            far_fields=tuple(
                FarField(
                    far.p2m.cut(LEAST),
                    tuple(t.cut(chebyshev.parities) for t in far.m2l),
                    first_columns(far.m2p, terms, few),
                )
                for far in self.far_fields
            ),
            dipoles=self.dipoles.cut(few),
        )

    @property
    def nbytes(self) -> int:
        """Memory of what is kept."""
        translations = sum(t.nbytes for t in (*self.m2m, *self.l2l))
        far = sum(field.nbytes for field in self.far_fields)
        near = self.p2p.nbytes + self.p2l.nbytes
        return near + translations + far + self.dipoles.nbytes

    def add(
        self, q: ndarray, dipoles: ndarray | None, settled: ndarray, rough: bool = False
    ) -> None:
        """Add what several loads do at the points to settlements, shape (s, m).

        Mean pressures ``q`` are of shape (s, n), and dipoles of the cells, in the order of the
        tree, (s, 2, n). They are summed in single precision if ``rough``.
        """
        tree, q = self.tree, q.take(self.tree.cells, axis=1)
        for row in settled:  # in place: a second array would be large
            row[:] = row[tree.points]
        # threads of BLAS would wait for each other longer than the products take
        with limited_threads(1, "blas"), Threads() as run:
            dtype = np.float32 if rough else float
            self._add_expansions(q, dipoles, settled, dtype, run)
            self.p2p.add(q, dipoles, settled, dtype, run)
        for row in settled:
            row[tree.points] = row.copy()

    def _add_expansions(
        self, q: ndarray, dipoles: ndarray | None, out: ndarray, dtype: type, run: Run
    ) -> None:
        """Add what acts through expansions."""
        tree, sets = self.tree, len(q)
        local: ndarray = np.zeros((sets, len(tree), self.chebyshev.terms), dtype)
        multipoles = [local, *(np.zeros_like(local) for _ in self.far_fields[1:])]
        for far, multipole in zip(self.far_fields, multipoles, strict=True):
            far.p2m.add(q, dipoles, multipole, run)
            for translation in self.m2m:
                translation.add(multipole, multipole, run)
            far.m2p.add_product(multipole.reshape(sets, -1), out, run)
        # local expansions are where the multipole ones were, level by level
        done = 0
        for level in zip(*(far.m2l for far in self.far_fields), strict=True):
            turned = [step.turned(*given, run) for step, *given in zip(level, multipoles)]
            begin, done = done, level[0].boxes.stop
            local[:, begin:done] = 0.0
            for step in level:
                step.add(turned.pop(0), local, run)
        local[:, done:] = 0.0
        self.p2l.add_product(q, local.reshape(sets, -1), run)
        if dipoles is not None:
            self.dipoles.add_to(local, dipoles, run)
        for translation in self.l2l:
            translation.add(local, local, run)
        args = tree.leaves, tree.boxes, self.x, self.chebyshev.order, local, out
        run(lambda k: l2p(k.start, k.stop, *args), len(tree.leaves))


def _laws(
    substrate: Substrate,
    partition: Partition,
    x: ndarray,
    weights: EdgeWeights | None,
    chebyshev: Chebyshev,
    tolerance: float,
) -> list[tuple[Moments, Kernel, MultipoleToLocal]]:
    """The moments, the kernel and the M2L of c / r, and of the remainder if there is one."""
    degree, c = degree_of(chebyshev.order), substrate.singular_coefficient

    def singular(r: ndarray) -> ndarray:
        return c / r

    known = compressed(chebyshev.m2l(singular, 1.0), chebyshev.parities, tolerance)
    # it scales with the boxes
    laws: list[tuple[Moments, Kernel, MultipoleToLocal]] = [
        (
            lambda cells: Multipoles.about_centroids(partition, weights, degree, cells).moments,
            singular,
            lambda h: known._replace(core=known.core / h),
        )
    ]
    if (table := substrate.remainder) is not None:
        reached = np.hypot(*np.ptp(np.hstack([partition.polygons.p, x]), axis=1))
        table.evaluate(table.omega, reached)  # refuses what is beyond the table
        kernel = _remainder(table, substrate.surface.young)
        of_pieces = pressure_moments(partition, weights, degree)
        laws.append(
            (
                lambda cells: of_pieces[..., cells],
                kernel,
                lambda h: compressed(chebyshev.m2l(kernel, h), chebyshev.parities, tolerance),
            )
        )
    return laws


def _remainder(table: RadialTable, young: float) -> Kernel:
    """The influence function beyond c / r."""

    def kernel(r: ndarray) -> ndarray:
        # corners of boxes may lie beyond the plan
        flat = np.minimum(r, table.farthest).ravel()
        out = np.empty_like(flat)
        look_up(table.omega / young, table.start, table.width, flat, out)
        return out.reshape(r.shape)

    return kernel
