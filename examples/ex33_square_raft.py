"""A square raft under columns on layered ground: uplift, pressures and bending moments.

Nine columns stand on a raft of concrete; wind loads those on one side more and pulls at the
others. The raft, a plate of Morley elements, lies on a soft layer over a stiffer ground. It leaves
the ground at its windward edge as far as equilibrium asks for, and the moments that a designer
needs are those of the plate's own curvatures.
"""

from dataclasses import dataclass

import numpy as np
from gallery import run, sheet, without_axes
from numpy import ndarray
from skfem import BilinearForm, CellBasis, ElementTriMorley, ElementTriP1, LinearForm, MeshTri
from skfem.helpers import dd, ddot, eye, trace

from skfem_dual import DualMesh, ElasticPunch, ElasticSolution, HalfSpace, Layer, LayeredHalfSpace

#: in m, N: sides of raft and columns, their spacing, thickness
SIDE, COLUMN, SPACING, THICKNESS = 10.5, 0.5, 4.0, 0.6
YOUNG, POISSON, WEIGHT = 30e9, 0.2, 25e3
RIGIDITY = YOUNG * THICKNESS**3 / 12 / (1 - POISSON**2)
GROUND = LayeredHalfSpace([Layer(3.0, 15e6, 0.35)], HalfSpace(young=60e6, poisson=0.3))
#: forces of the columns at x = -4, 0, 4 m without and with wind
FORCES = {"calm": (0.8e6, 0.8e6, 0.8e6), "wind": (-0.45e6, 0.8e6, 2.05e6)}
#: isobars, in kPa and kNm/m
PRESSURES = [25, 50, 60, 65, 70, 75, 100, 125, 150, 200, 300]
MOMENTS = [-400, -200, -100, -50, 0, 50, 100, 200, 400]


def moments(w):
    """Bending moments over the rigidity, positive where the lower side is pulled."""
    return -((1 - POISSON) * dd(w) + POISSON * eye(trace(dd(w)), 2))


@BilinearForm
def bending(u, v, _):
    """Twice the energy of the plate."""
    return -RIGIDITY * ddot(moments(u), dd(v))


@LinearForm
def load(v, w):
    return w.q * v


def mesh() -> MeshTri:
    """Half as large elements under the columns, which are subdomains by their x."""
    lines = np.linspace(-SIDE / 2, SIDE / 2, round(SIDE / COLUMN) + 1)
    rows = SPACING * np.array([-1, 0, 1])

    def under(x, column):
        near_y = (np.abs(x[1] - rows[:, None]) < COLUMN / 2).any(axis=0)
        return (np.abs(x[0] - column) < COLUMN / 2) & near_y

    raft = MeshTri.init_tensor(lines, lines).with_subdomains(
        {f"{c:g}": lambda x, c=c: under(x, c) for c in rows}
    )
    return raft.refined(np.concatenate(list(raft.subdomains.values())))


@dataclass(frozen=True)
class Result:
    """Solutions by the weather."""

    rafts: dict[str, ElasticSolution]

    def moments(self, name: str) -> ndarray:
        """Means over the cells, shape (2, 2, n)."""
        s = self.rafts[name]
        cells = s.punch.basis
        m = RIGIDITY * moments(s.punch.structure.interpolate(s.displacement))
        sums = [[load.assemble(cells, q=m[i, j]) for j in range(2)] for i in range(2)]
        return np.array(sums) / s.punch.partition.areas

    def __str__(self) -> str:
        head = f"{'':<8}{'deflection [mm]':<20}{'pressure [kPa]':<18}{'in contact':<13}"
        rows = [head + f"{'resultant':<22}M_x [kNm/m]"]
        for name, s in self.rafts.items():
            w = 1e3 * s.deflection(s.punch.partition.centroids)
            m, e = self.moments(name)[0, 0] / 1e3, s.centre_of_pressure
            rows.append(
                f"{name:<8}{f'{w.min():.1f} to {w.max():.1f}':<20}"
                f"{f'{s.pressure.min() / 1e3:.0f} to {s.pressure.max() / 1e3:.0f}':<18}"
                f"{f'{100 * s.contact_area / SIDE**2:.1f} %':<13}"
                f"{f'{s.force / 1e6:.2f} MN at {e[0]:.3f} m':<22}{m.min():.0f} to {m.max():.0f}"
            )
        return "\n".join(rows)


def main() -> Result:
    """The raft in calm weather and in wind; its factors serve both."""
    dual = DualMesh.from_mesh(mesh())
    plate = dual.basis(intorder=4).with_element(ElementTriMorley())
    raft = ElasticPunch(GROUND, dual.basis(intorder=4), plate, bending.assemble(plate))
    own = load.assemble(plate, q=WEIGHT * THICKNESS)
    columns = [
        load.assemble(plate.with_elements(f"{x:g}"), q=1 / COLUMN**2)
        for x in (-SPACING, 0.0, SPACING)
    ]
    loads = [own + np.array(forces) @ columns for forces in FORCES.values()]
    return Result(dict(zip(FORCES, raft.solve_many(loads), strict=True)))


def visualize(result: Result):
    """The raft in wind in space with its moments; isobars of both rafts."""
    from matplotlib.patches import Rectangle

    from skfem_dual.visuals.matplotlib import isobars
    from skfem_dual.visuals.style import MOMENT, OUTLINE, SETTLEMENT

    pictures = {"moments_in_wind": draw_moments(result)}
    for name, s in result.rafts.items():
        nodal = CellBasis(s.punch.basis.dual.mesh, ElementTriP1())
        deflection = 1e3 * s.deflection(nodal.mesh.p)
        basis, p = s.pressure_field()
        # a node of the mesh takes over the mean of its cell
        m = result.moments(name)[0, 0] / 1e3
        pressed = {"contact": s.contact_region}
        for what, unit, field, more in (
            ("deflection", "[mm]", (nodal, deflection), {"cmap": SETTLEMENT}),
            ("contact pressure", "[kPa]", (basis, p.clip(0) / 1e3, PRESSURES), pressed),
            ("bending moment", "$M_x$ [kNm/m]", (nodal, m, MOMENTS), {"cmap": MOMENT}),
        ):
            ax = pictures[f"{what.replace(' ', '_')}_{name}"] = sheet(3.6)
            isobars(*field, title=f"{what} {unit}", ax=ax, **more)
            without_axes(ax, name)
            for x, y in np.ndindex(3, 3):
                corner = SPACING * np.array([x - 1, y - 1]) - COLUMN / 2
                ax.add_patch(Rectangle(corner, COLUMN, COLUMN, fill=False, ec=OUTLINE))
    return pictures


def draw_moments(result: Result):
    """The ground is seen where the raft has left it."""
    from scenes import bent

    from skfem_dual.visuals.relief import Relief
    from skfem_dual.visuals.style import MOMENT, OUTLINE

    s = result.rafts["wind"]
    nodal = CellBasis(s.punch.basis.dual.mesh, ElementTriP1())
    plate = Relief.of(s).structure
    m = nodal.interpolator(result.moments("wind")[0, 0] / 1e3)(plate.p[:2])
    label, bar = "bending moment $M_x$ [kNm/m]", {"extend": "both"}
    return bent(s, label, m, MOMENT, (-300, 300), bar, (-0.8, -2, 1.5), OUTLINE)


if __name__ == "__main__":
    run(main, visualize)
