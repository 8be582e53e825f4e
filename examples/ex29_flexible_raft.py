"""Flexible rafts: a plate of scikit-fem on the ground, between a rigid footing and a bare load.

A raft foundation bends. It is a thin plate with free edges here, of Morley's element of scikit-fem
on the common refinement of both grids, on which an `ElasticPunch` finds the pressures of the
ground: one unknown on each dual cell, by virtual work on the plate, so that a raft too stiff to
bend is the rigid punch of the same cells.

For a circular raft of radius a and thickness t under a uniform load the relative stiffness is that
of Brown (Geotechnique 19, 1969),

    K = (E_r / E) (1 - nu^2) (t / a)^3,       D = K E* a^3 / (12 (1 - nu_r^2)),

from a flexible load, K = 0, to a rigid punch. An axisymmetric solution in Legendre polynomials,
which shares nothing with the cells, stands beside it. A square raft under nine columns shows what
only cells can do. Raft and ground stay in touch everywhere here.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from gallery import chart, run, sheet, without_axes
from numpy import ndarray
from scipy.sparse import csr_matrix
from scipy.special import eval_jacobi, gammaln
from skfem import BilinearForm, CellBasis, ElementTriMorley, ElementTriP1, LinearForm, MeshTri
from skfem.helpers import dd, ddot, eye, trace

from skfem_dual import (
    DualMesh,
    ElasticPunch,
    ElasticSolution,
    HalfSpace,
    PunchSolution,
    RigidPunch,
    flexible_settlement,
)
from skfem_dual.grids.generate import disc
from skfem_dual.visuals.curves import LINES
from skfem_dual.visuals.style import CONTACT, MOMENT, OUTLINE, SETTLEMENT

POISSON = 0.2  # of the raft
RATIOS = 10.0 ** np.arange(-3, 3.1, 0.5)
PICTURED = (0.01, 0.1, 1.0, 10.0)  # relative stiffnesses whose pressures are drawn

#: the square raft: concrete on clay under three rows of columns, in m, N
SIDE, COLUMN, SPACING, CONCRETE = 10.5, 0.5, 4.0, 30e9
CLAY = HalfSpace(young=25e6, poisson=0.35)
FORCES = {"centre": 2.4e6, "side": 1.4e6, "corner": 0.8e6}
THICKNESSES = (0.4, 1.0)
#: isobars of all square rafts, in kPa and kNm/m
PRESSURES = (60, 70, 80, 90, 100, 120, 150, 250)
MOMENTS = (-400, -200, -100, -50, 0, 50, 100, 200, 400)


def moments(w, poisson=POISSON):
    """Bending moments of a plate of rigidity one, positive where its lower side is pulled."""
    return -((1 - poisson) * dd(w) + poisson * eye(trace(dd(w)), 2))


@BilinearForm
def bending(u, v, _):
    """Twice the energy of a plate of rigidity one."""
    return -ddot(moments(u), dd(v))


@LinearForm
def load(v, w):
    return w.q * v


@dataclass(frozen=True)
class Raft:
    """A plate with free edges on the cells and the ground of a punch."""

    punch: RigidPunch

    @cached_property
    def rigid(self) -> PunchSolution:
        """The raft too stiff to bend, under a central force of one."""
        return self.punch.solve(1.0)

    @cached_property
    def plate(self) -> CellBasis:
        """Deflections."""
        return self.punch.basis.with_element(ElementTriMorley())

    @cached_property
    def stiffness(self) -> csr_matrix:
        """Of the plate of rigidity one."""
        return bending.assemble(self.plate)

    def solve(self, rigidity: float, load: ndarray, **options) -> "RaftSolution":
        """Deflection and pressures under a load vector of the plate; options as of its punch."""
        punch = self.punch
        elastic = ElasticPunch(
            punch.substrate, punch.basis, self.plate, rigidity * self.stiffness, edge=punch.edge
        )
        return RaftSolution(self, rigidity, elastic.solve(load, **options))


@dataclass(frozen=True)
class RaftSolution:
    """What an elastic punch answers, with the moments of its plate."""

    raft: Raft
    rigidity: float
    elastic: ElasticSolution

    @property
    def pressure(self) -> ndarray:
        """Mean pressures of the cells."""
        return self.elastic.pressure

    @property
    def deflection(self) -> ndarray:
        """At the nodes of the common refinement, of which those of the mesh are the first."""
        return self.elastic.displacement[self.raft.plate.nodal_dofs[0]]

    @cached_property
    def moments(self) -> ndarray:
        """Means over the cells, shape (2, 2, n)."""
        cells, field = (
            self.raft.punch.basis,
            self.raft.plate.interpolate(self.elastic.displacement),
        )
        m = self.rigidity * moments(field)
        sums = [[load.assemble(cells, q=m[i, j]) for j in range(2)] for i in range(2)]
        return np.array(sums) / self.raft.punch.partition.areas


@dataclass(frozen=True)
class CircularRaft:
    """Uniformly loaded circular raft with q = a = E* = 1, without any cells.

    The pressure ``c_k P_2k(t) / t``, t = sqrt(1 - r^2), settles the circle by ``l_k c_k P_2k(t)``
    with ``l_k = (Gamma(k + 1/2) / k!)^2``, a polynomial in r^2. With deflections of this kind the
    energy of plate and ground has a least value (Ritz). For K = 1 ten terms give six digits.
    """

    ratio: float
    poisson: float = POISSON
    terms: int = 40

    @property
    def rigidity(self) -> float:
        """D / (E* a^3)."""
        return self.ratio / 12 / (1 - self.poisson**2)

    @cached_property
    def coefficients(self) -> ndarray:
        """Of the settlement, ``l_k c_k``."""
        z, weights = np.polynomial.legendre.leggauss(4 * self.terms)  # 2 pi r dr = pi dz / 2
        weights = np.pi / 2 * weights
        once = 2 * self.modes(z, 1)  # w' / r
        twice = once + 2 * (1 + z) * self.modes(z, 2)  # w''
        mixed = (once * weights) @ twice.T
        whole = ((once + twice) * weights) @ (once + twice).T
        K = self.rigidity * (whole - (1 - self.poisson) * (mixed + mixed.T))
        ground = 2 * np.pi / (4 * np.arange(self.terms) + 1) / self.eigenvalues
        return np.linalg.solve(K + np.diag(ground), self.modes(z) @ weights)

    @property
    def eigenvalues(self) -> ndarray:
        k = np.arange(self.terms)
        return np.exp(2 * (gammaln(k + 0.5) - gammaln(k + 1)))

    def modes(self, z, m: int = 0) -> ndarray:
        """m-th derivatives by r^2 of all P_2k(t), Jacobi polynomials in 1 - 2 r^2 = -z."""
        rows = [np.zeros_like(z)] * m
        for k in range(m, self.terms):
            factor = np.prod(-(k + 0.5 + np.arange(m)))
            rows.append(factor * eval_jacobi(k - m, m, m - 0.5, -z))
        return np.array(rows)

    def settlement(self, r) -> ndarray:
        return self.coefficients @ self.modes(2 * np.asarray(r, dtype=float) ** 2 - 1)

    def pressure(self, r) -> ndarray:
        c, r = self.coefficients / self.eigenvalues, np.asarray(r, dtype=float)
        return c @ self.modes(2 * r**2 - 1) / np.sqrt(1 - r**2)

    @property
    def moment(self) -> float:
        """At the centre."""
        slope = 2 * self.coefficients @ self.modes(np.array([-1.0]), 1)
        return float(-self.rigidity * (1 + self.poisson) * slope[0])


@dataclass(frozen=True)
class Result:
    """Circular rafts by relative stiffness, of cells and exact; square rafts by thickness."""

    circles: dict[float, RaftSolution]
    exact: dict[float, CircularRaft]
    squares: dict[float, RaftSolution]

    @property
    def raft(self) -> Raft:
        """The circular one."""
        return next(iter(self.circles.values())).raft

    @cached_property
    def found(self) -> ndarray:
        """Settlement in the centre and at the edge, moment in the centre of all; shape (k, 3)."""
        mesh, centroids = self.raft.plate.mesh, self.raft.punch.partition.centroids
        middle, cell = np.hypot(*mesh.p).argmin(), np.hypot(*centroids).argmin()
        rows = []
        for s in self.circles.values():
            w = s.deflection
            moment = np.trace(s.moments[:, :, cell]) / 2
            rows.append([w[middle], w[mesh.boundary_nodes()].mean(), moment])
        return np.array(rows)

    @cached_property
    def known(self) -> ndarray:
        """The same of the exact ones."""
        return np.array([[*c.settlement([0, 1]), c.moment] for c in self.exact.values()])

    def __str__(self) -> str:
        punch = self.raft.punch
        loose = flexible_settlement(punch.substrate, punch.basis, 1.0, [[0.0, 1.0], [0.0, 0.0]])
        stiff = [self.raft.rigid.settlement * np.pi] * 2
        limits = [[2.0, 4 / np.pi, 0.0], [np.pi / 2, np.pi / 2, rigid_moment(POISSON)]]
        names = ["flexible", *(f"{ratio:.3g}" for ratio in self.circles), "rigid"]
        found = np.vstack([[*loose, 0.0], self.found, [*stiff, np.nan]])
        known = np.vstack([limits[:1], self.known, limits[1:]])
        rows = [
            f"Circular raft under a uniform load, {punch.basis.N} cells, nu_r = {POISSON}:",
            "settlement over q a / E* and moment in the centre over q a^2, with cells and exact",
            f"{'K':<10}{'centre':<18}{'edge':<18}{'difference':<20}moment",
        ]
        for name, (w0, w1, m), (v0, v1, n) in zip(names, found, known, strict=True):
            rows.append(
                f"{name:<10}{w0:<8.4f}{v0:<10.4f}{w1:<8.4f}{v1:<10.4f}{w0 - w1:<9.5f}"
                f"{v0 - v1:<11.5f}{m:<10.6f}{n:.6f}"
            )
        cells = len(next(iter(self.squares.values())).pressure)
        rows += [
            "",
            f"Square raft, sides of {SIDE:g} m, nine columns, {cells} cells",
            f"{'t [m]':<8}{'settlement [mm]':<18}{'pressure of cells [kPa]':<26}M_x [kNm/m]",
        ]
        for t, s in self.squares.items():
            values = 1e3 * s.deflection, s.pressure / 1e3, s.moments[0, 0] / 1e3
            w, p, m = (f"{v.min():.1f} to {v.max():.1f}" for v in values)
            rows.append(f"{t:<8}{w:<18}{p:<26}{m}")
        return "\n".join(rows)


def rigid_moment(poisson: float) -> float:
    """Moment over q a^2 in the centre of a circular raft too stiff to bend.

    Its shear force ``r / 2 - (1 - sqrt(1 - r^2)) / (2 r)``, that of q = 1 and the pressure of a
    rigid punch, integrated with and without the factor ``(1 - r^2) / 2``.
    """
    return (2 * np.log(2) - 1) / 4 - (1 - poisson) * (np.log(2) / 4 - 7 / 48)


def circle(n: int) -> Raft:
    """Of about n dual cells, a = E* = 1."""
    dual = DualMesh.from_mesh(disc(n=n))
    return Raft(RigidPunch(HalfSpace(young=1.0, poisson=0.0), dual.basis(intorder=4)))


def square() -> Raft:
    """With the columns as subdomains of the mesh, where cells are half as large as elsewhere."""
    axes = SPACING * np.array([-1, 0, 1])
    columns = np.array(np.meshgrid(axes, axes)).reshape(2, 9)
    away = np.count_nonzero(columns, axis=0)  # the corners lie off both axes

    def under(some: ndarray):
        return lambda x: (np.abs(x[:, :, None] - some[:, None]).max(0) < COLUMN / 2).any(axis=1)

    lines = np.linspace(-SIDE / 2, SIDE / 2, round(SIDE / COLUMN) + 1)
    mesh = MeshTri.init_tensor(lines, lines).with_subdomains(
        {name: under(columns[:, away == k]) for k, name in enumerate(FORCES)}
    )
    mesh = mesh.refined(np.concatenate(list(mesh.subdomains.values())))
    return Raft(RigidPunch(CLAY, DualMesh.from_mesh(mesh).basis(intorder=4)))


def main(n=600, ratios=RATIOS) -> Result:
    """Circles of about n dual cells and all relative stiffnesses; squares of two thicknesses."""
    raft = circle(n)
    uniform = load.assemble(raft.plate, q=1.0)
    exact = {float(ratio): CircularRaft(float(ratio)) for ratio in sorted({*ratios, *PICTURED})}
    circles = {ratio: raft.solve(c.rigidity, uniform) for ratio, c in exact.items()}

    raft = square()
    columns = sum(
        load.assemble(raft.plate.with_elements(name), q=force / COLUMN**2)
        for name, force in FORCES.items()
    )
    rigidity = {t: CONCRETE * t**3 / 12 / (1 - POISSON**2) for t in THICKNESSES}
    return Result(circles, exact, {t: raft.solve(d, columns) for t, d in rigidity.items()})


def visualize(result: Result):
    """The thinner square raft in space; isobars of both; what stiffness does to a circular one."""
    return draw_squares(result) | {
        "settlements": draw_settlements(result),
        "moments": draw_moments(result),
        "pressures": draw_pressures(result),
    }


def draw_settlements(result: Result):
    """Dots for cells, a line for the exact ones."""
    ax = chart(3.8)
    draw_series(result, ax, 0, "o", "centre")
    draw_series(result, ax, 1, "s", "edge")
    limit(ax, 2.0, "uniform load, centre", right=True)
    limit(ax, 4 / np.pi, "uniform load, edge", right=True)
    limit(ax, np.pi / 2, "rigid punch")
    ax.set_ylabel(r"settlement $w\,E^* / (q\,a)$")
    ax.set_ylim(1.2, 2.1)
    ax.legend(loc="center right", bbox_to_anchor=(1, 0.65))
    return ax


def draw_moments(result: Result):
    ax = chart()
    draw_series(result, ax, 2, "o", "cells")
    limit(ax, rigid_moment(POISSON), "rigid punch")
    ax.set_ylabel(r"moment in the centre $M / (q\,a^2)$")
    ax.set_ylim(0, 0.085)
    ax.legend(loc="center right")
    return ax


def draw_series(result: Result, ax, column: int, marker: str, name: str) -> None:
    """One of the answers over the stiffness, exact ones named once."""
    ratios = np.array(list(result.circles))
    fine = np.geomspace(ratios[0], ratios[-1], 61)
    exact = np.array([[*c.settlement([0, 1]), c.moment] for c in map(CircularRaft, fine)])
    label = None if name == "edge" else "Legendre series"
    ax.semilogx(fine, exact[:, column], color=OUTLINE, lw=1.6, label=label)
    look = {"color": CONTACT, "mfc": "white", "zorder": 3}
    ax.semilogx(ratios, result.found[:, column], marker, label=name, **look)
    ax.set_xlabel("relative stiffness K")


def limit(ax, value: float, name: str, right: bool = False) -> None:
    """What is approached for very soft rafts, or for very stiff ones."""
    ax.axhline(value, color=OUTLINE, lw=1, ls=":")
    low, high = ax.get_xlim()
    place = {"x": high, "ha": "right"} if right else {"x": 1.3 * low}
    ax.text(y=value, s=name, va="bottom", fontsize=11, **place)


def draw_pressures(result: Result):
    """Of three circular rafts along the radius."""
    ax = chart()
    r = np.linspace(0, 1, 400, endpoint=False)
    for (color, style), ratio in zip(LINES, PICTURED, strict=True):
        ax.plot(r, result.exact[ratio].pressure(r), style, color=color, label=f"K = {ratio:g}")
        nodal, found = result.circles[ratio].elastic.nodal_pressure()
        inner = nodal.mesh.interior_nodes()
        some = inner[np.argsort(np.hypot(*nodal.mesh.p[:, inner]))][:: max(1, len(inner) // 50)]
        x, p = np.hypot(*nodal.mesh.p[:, some]), found[nodal.nodal_dofs[0, some]]
        ax.plot(x, p, "o", color=color, mfc="white", zorder=3)
    ax.set_xlim(0, 1)
    ax.set_ylim(0.4, 2.5)
    ax.set_xlabel("r / a")
    ax.set_ylabel("contact pressure p / q")
    ax.legend(loc="upper left")
    return ax


def draw_squares(result: Result) -> dict:
    """The thinner one bent under its columns; settlement, pressure and moment of both."""
    from matplotlib.patches import Rectangle
    from scenes import bent

    from skfem_dual.visuals.matplotlib import isobars

    thin = result.squares[min(result.squares)].elastic
    pictures = {"bent": bent(thin, "settlement [m]", eye=(-0.8, -2, 1.5))}
    for thickness, s in result.squares.items():
        mesh = s.raft.punch.basis.dual.mesh
        nodal = CellBasis(mesh, ElementTriP1())
        # a node of the mesh takes over the mean of its cell
        w, p, m = 1e3 * s.deflection[: mesh.nvertices], s.pressure / 1e3, s.moments[0, 0] / 1e3
        for what, unit, values, levels, more in (
            ("settlement", "[mm]", w, range(26, 42, 2), {"cmap": SETTLEMENT}),
            ("pressure", "[kPa]", p, PRESSURES, {}),
            ("moment", "$M_x$ [kNm/m]", m, MOMENTS, {"cmap": MOMENT}),
        ):
            ax = pictures[f"{what}_{1e3 * thickness:.0f}_mm"] = sheet(3.6)
            isobars(nodal, values, list(levels), title=f"{what} {unit}", ax=ax, **more)
            without_axes(ax, f"raft {thickness:g} m thick")
            for x, y in np.ndindex(3, 3):
                corner = SPACING * np.array([x - 1, y - 1]) - COLUMN / 2
                ax.add_patch(Rectangle(corner, COLUMN, COLUMN, fill=False, ec=OUTLINE))
    return pictures


if __name__ == "__main__":
    run(main, visualize)
