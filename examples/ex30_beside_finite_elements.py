"""Beside finite elements: an elastic block of scikit-fem stands on the half-space.

Example 11 of scikit-fem, linear elasticity on hexahedra, with ground under it: a block 2 a x 2 a
of height 2 a carries a uniform load q on its top and stands without friction on a half-space,
which no mesh has to fill. The facets of its base are the cells, the influence operator A couples
them, and pressures p join the displacements u:

    a(u, v) - (p, v_z) = -(q, v_z)_top,        -u_z = A p on the base, in the mean of each cell.

Three lines make ground of it; they are marked. However stiff the block is, by Betti's theorem its
top settles by q h / E_b more than its base in the mean. A stiff one stands like a rigid punch, a
soft one hands its load on to the ground as it is.
"""

from dataclasses import dataclass

import numpy as np
from gallery import chart, run
from numpy import ndarray
from scipy.sparse import csr_matrix, diags
from scipy.sparse.linalg import splu
from skfem import (
    Basis,
    BilinearForm,
    CellBasis,
    ElementHex0,
    ElementHex1,
    ElementQuad0,
    ElementVector,
    FacetBasis,
    LinearForm,
    MeshHex,
    MeshQuad,
    condense,
    solve,
)
from skfem.helpers import sym_grad
from skfem.models.elasticity import lame_parameters, linear_elasticity, linear_stress

from skfem_dual import HalfSpace, InfluenceOperator, PunchSolution, RigidPunch, flexible_settlement

SOIL = HalfSpace(young=1.0, poisson=0.3)
HEIGHT, POISSON = 2.0, 0.2  # of the block, a = q = 1
RATIOS = (0.01, 0.1, 1.0, 10.0, 100.0, 1e3, 1e4)  # E_b / E


@dataclass(frozen=True)
class Block:
    """Displacements of a block of stiffness ``ratio``, pressures under it."""

    ratio: float
    basis: Basis
    ground: InfluenceOperator
    u: ndarray
    pressure: ndarray

    @property
    def base(self) -> ndarray:
        """Settlement of the cells of the base."""
        return self.ground @ self.pressure

    @property
    def compression(self) -> float:
        """Mean settlement of the top less that of the base."""
        sums = [
            down.assemble(FacetBasis(self.basis.mesh, self.basis.elem, facets=name))
            for name in ("top", "base")
        ]
        return float((sums[0] - sums[1]) @ self.u) / 4

    @property
    def stress(self) -> ndarray:
        """Vertical stress in the elements, compression positive."""
        e = sym_grad(self.basis.interpolate(self.u))
        sigma = linear_stress(*lame_parameters(self.ratio, POISSON))(e)[2, 2]
        return -np.sum(sigma * self.basis.dx, axis=1) / self.basis.dx.sum(axis=1)


@LinearForm
def down(v, _):
    return -v[2]


@BilinearForm
def up(p, v, _):
    """Work of pressures on the base."""
    return p * v[2]


def block(n: int) -> MeshHex:
    """n x n columns of elements, drawn to edges and base."""
    x = np.sin(np.pi / 2 * np.linspace(-1, 1, n + 1))
    x[n // 2] = 0.0
    z = HEIGHT * (1 - np.sin(np.pi / 2 * np.linspace(1, 0, n // 2 + 2)))
    return MeshHex.init_tensor(x, x, z).with_boundaries(
        {"base": lambda x: x[2] < 1e-9, "top": lambda x: x[2] > HEIGHT - 1e-9}
    )


def stand(mesh: MeshHex, ratio: float) -> Block:
    """Solve for one stiffness of the block."""
    basis = Basis(mesh, ElementVector(ElementHex1()), intorder=2)  # exact for bricks
    K = linear_elasticity(*lame_parameters(ratio, POISSON)).assemble(basis)
    f = down.assemble(FacetBasis(mesh, basis.elem, facets="top"))

    # pressures on the facets of the base: their load vectors, and mean settlements
    facets = mesh.boundaries["base"]
    below = FacetBasis(mesh, ElementHex0(), facets=facets)
    B = up.assemble(below, below.with_element(basis.elem))[:, mesh.f2t[0, facets]]
    means = -diags(1 / below.dx.sum(axis=1)) @ B.T

    cells = CellBasis(mesh.trace(facets, MeshQuad, lambda p: p[:2])[0], ElementQuad0())  # one
    ground = InfluenceOperator(SOIL, cells, rtol=0)  # two
    springs = np.linalg.solve(ground.to_dense(), means.toarray())  # three

    # the planes of symmetry do not move sideways
    fixed = [
        basis.nodal_dofs[axis, mesh.nodes_satisfying(lambda x, axis=axis: np.isclose(x[axis], 0))]
        for axis in (0, 1)
    ]
    K -= B @ csr_matrix(springs)
    u = solve(*condense(K, f, D=np.concatenate(fixed)), solver=factorised)
    return Block(ratio, basis, ground, u, springs @ u)


def factorised(A, b):
    """Without pivoting, which elasticity on springs does not need: many times faster."""
    return splu(A.tocsc(), "MMD_AT_PLUS_A", 0.0, options={"SymmetricMode": True}).solve(b)


@dataclass(frozen=True)
class Result:
    """Blocks from soft to stiff; the rigid punch on the same cells, and the bare load."""

    blocks: list[Block]
    rigid: PunchSolution
    bare: ndarray

    def __str__(self) -> str:
        rows = [
            "settlement of the base over q a / E, compression of the block less q h / E_b",
            f"{'E_b / E':<14}{'centre':<9}{'corner':<9}{'p / q in the centre':<21}compression",
        ]
        middle, corner = self.cells
        for b in self.blocks:
            w, p = b.base, b.pressure[middle]
            off = b.compression - HEIGHT / b.ratio
            rows.append(f"{b.ratio:<14g}{w[middle]:<9.4f}{w[corner]:<9.4f}{p:<21.4f}{off:+.1e}")
        w, p = self.bare, self.rigid.pressure[middle]
        rows.insert(2, f"{'bare load':<14}{w[middle]:<9.4f}{w[corner]:<9.4f}{1:<21.4f}")
        rows.append(f"{'rigid punch':<14}{self.rigid.settlement:<9.4f}{'':<9}{p:<21.4f}")
        return "\n".join(rows)

    @property
    def cells(self) -> tuple[int, int]:
        """One beside the centre and one in a corner of the base."""
        x = self.rigid.punch.partition.centroids
        return int(np.hypot(*x).argmin()), int(x.sum(axis=0).argmax())


def main(n=16, ratios=RATIOS) -> Result:
    """Blocks of n x n columns of elements."""
    mesh = block(n)
    blocks = [stand(mesh, ratio) for ratio in ratios]
    base, _ = mesh.trace("base", mtype=MeshQuad, project=lambda p: p[:2])
    cells = CellBasis(base, ElementQuad0())
    rigid = RigidPunch(SOIL, cells).solve(4.0)
    return Result(blocks, rigid, flexible_settlement(SOIL, cells, 1.0))


def visualize(result: Result):
    """Section through a block on its ground, exaggerated; pressures; settlements."""
    block = min(result.blocks, key=lambda b: abs(np.log(b.ratio)))
    return {
        "section": draw_section(block),
        "pressures": draw_pressures(result),
        "settlements": draw_settlements(result),
    }


def draw_pressures(result: Result):
    """Along the row of cells beside the middle."""
    from skfem_dual.visuals.curves import LINES

    ax = chart()
    x, y = result.rigid.punch.partition.centroids
    row = np.nonzero((y > 0) & (y < 1.01 * y[y > 0].min()))[0]
    row = row[np.argsort(x[row])]
    shown = [b for b in result.blocks if b.ratio in (0.1, 1.0, 10.0)]
    curves = [(f"$E_b / E$ = {b.ratio:g}", b.pressure) for b in shown]
    curves.append(("rigid punch", result.rigid.pressure))
    for (color, style), (name, p) in zip(LINES, curves, strict=True):
        ax.plot(x[row], p[row], style, color=color, marker=".", ms=7, label=name)
    ax.set_xlim(-1, 1)
    ax.set_xticks([-1, -0.5, 0, 0.5, 1])
    ax.set_ylim(0, 2.5)
    ax.set_xlabel("x / a")
    ax.set_ylabel("mean pressure of cells p / q")
    ax.legend(loc="upper center")
    return ax


def draw_settlements(result: Result):
    """Between the bare load and the rigid punch."""
    from skfem_dual.visuals.style import CONTACT, OUTLINE

    ax, ratios = chart(3.6), [b.ratio for b in result.blocks]
    w = np.array([b.base for b in result.blocks])
    for cell, marker, name in zip(result.cells, "os", ("centre", "corner"), strict=True):
        look = {"color": CONTACT, "mfc": "white", "marker": marker}
        ax.semilogx(ratios, w[:, cell], label=f"cell in the {name}", **look)
        ax.axhline(result.bare[cell], color=OUTLINE, lw=1, ls=":")
        end = {"va": "bottom", "ha": "right", "fontsize": 11}
        ax.text(ratios[-1], result.bare[cell], f"bare load, {name}", **end)
    ax.axhline(result.rigid.settlement, color=OUTLINE, lw=1, ls=":")
    ax.text(ratios[0], result.rigid.settlement, "rigid punch", va="bottom", fontsize=11)
    ax.set_xlabel(r"$E_b / E$")
    ax.set_ylabel(r"settlement $w\,E / (q\,a)$")
    ax.legend(loc="center right", bbox_to_anchor=(1, 0.65))
    return ax


def draw_section(b: Block, scale: float = 0.15):
    """The plane y = 0 of block and ground, displacements drawn so many times q a / E."""
    from skfem_dual.visuals.style import GROUND, OUTLINE, STRESS

    ax, mesh = chart(3.9), b.basis.mesh
    plane = mesh.nodes_satisfying(lambda x: np.isclose(x[1], 0))
    plane = plane[np.lexsort(mesh.p[::2, plane])]  # row by row
    x, z = (mesh.p[i, plane] + scale * b.u[b.basis.nodal_dofs[i, plane]] for i in (0, 2))
    middles = mesh.p[:, mesh.t].mean(axis=1)
    beside = np.nonzero(np.isclose(middles[1], middles[1][middles[1] > 0].min()))[0]
    beside = beside[np.lexsort(middles[::2, beside])]
    columns = np.count_nonzero(np.isclose(mesh.p[2, plane], 0))
    stress = b.stress[beside].reshape(-1, columns - 1)
    colored = ax.pcolormesh(
        *(c.reshape(-1, columns) for c in (x, z)),
        stress,
        cmap=STRESS,
        vmin=0.5,
        vmax=1.5,
        edgecolor="white",
        linewidth=0.5,
        antialiased=True,
    )
    ax.figure.colorbar(
        colored, ax=ax, label=r"$\sigma_z / q$", extend="both", aspect=30, shrink=0.8
    )
    r = np.linspace(-2.2, 2.2, 400)
    w = scale * (b.ground.at(np.stack([r, np.zeros_like(r)])) @ b.pressure)
    ax.fill_between(r, -w, -1.0, color=GROUND, lw=0)
    ax.plot(r, -w, color=OUTLINE, lw=1.2)
    ax.set_title(f"$E_b / E$ = {b.ratio:g}, displaced x {scale:g} q a / E")
    ax.set_aspect("equal")
    ax.set_xlim(-2.2, 2.2)
    ax.set_ylim(-1, HEIGHT)
    ax.set_xlabel("x / a")
    ax.set_ylabel("z / a")
    ax.spines[:].set_visible(False)
    return ax


if __name__ == "__main__":
    run(main, visualize)
