"""A frame on three footings: its girder hands load from the one that settles most to the others.

Three footings share one ground and one structure. Each is a plate; columns in their middles carry
a girder of two spans, continuous and hinged at the columns, whose stiffness against settlements d,

    K_f = 6 E I / l^3 c c',        c = (-1/2, 1, -1/2),

is added to that of the plates where the columns stand: K + Q' K_f Q, with Q d the values of the
deflection there. The ground below one footing settles under the others too, so that of three equal
ones the middle one settles most, and a stiff girder relieves it. Contact is found under each.
"""

from dataclasses import dataclass

import numpy as np
from gallery import chart, run
from numpy import ndarray
from skfem import BilinearForm, ElementTriMorley, MeshTri
from skfem.helpers import dd, ddot, eye, trace

from skfem_dual import DualMesh, ElasticPunch, ElasticSolution, HalfSpace

#: in m, N: sides of the footings, their thickness and distances, the force of each column
SIDE, THICKNESS, SPAN, FORCE = 2.0, 0.5, 4.0, np.array([0.8e6, 1.0e6, 0.8e6])
SOIL = HalfSpace(young=20e6, poisson=0.3)
YOUNG, POISSON = 30e9, 0.2
MIDDLE = np.array([-0.5, 1.0, -0.5])
#: E I of the girder in N m^2
GIRDERS = (0.0, *10.0 ** np.arange(6.0, 11.1, 0.5))


@BilinearForm
def bending(u, v, _):
    """Twice the energy of the plates."""
    stiffness = YOUNG * THICKNESS**3 / 12 / (1 - POISSON**2)
    return stiffness * ddot((1 - POISSON) * dd(u) + POISSON * eye(trace(dd(u)), 2), dd(v))


def footings(n: int) -> MeshTri:
    """Three squares of n x n pairs of triangles, as one mesh."""
    lines = SIDE / 2 * np.sin(np.pi / 2 * np.linspace(-1, 1, n + 1))
    lines[n // 2] = 0.0
    square = MeshTri.init_tensor(lines, lines)
    left, right = square.translated((-SPAN, 0.0)), square.translated((SPAN, 0.0))
    return left + square + right


@dataclass(frozen=True)
class Result:
    """Solutions by the stiffness E I of the girder."""

    frames: dict[float, ElasticSolution]

    @property
    def feet(self) -> ndarray:
        """Where the columns stand."""
        return np.array([[-SPAN, 0.0, SPAN], [0.0, 0.0, 0.0]])

    def settlements(self, stiffness: float) -> ndarray:
        """Of the three columns."""
        return self.frames[stiffness].deflection(self.feet)

    def forces(self, stiffness: float) -> ndarray:
        """Resultant under each footing."""
        s = self.frames[stiffness]
        x = s.punch.partition.centroids[0]
        forces = s.pressure * s.punch.partition.areas
        return np.array([forces[np.abs(x - at) < SPAN / 2].sum() for at in self.feet[0]])

    def __str__(self) -> str:
        rows = [f"{'E I [MN m2]':<14}{'settlements [mm]':<30}forces of the footings [kN]"]
        for stiffness in self.frames:
            w, forces = 1e3 * self.settlements(stiffness), self.forces(stiffness) / 1e3
            rows.append(
                f"{stiffness / 1e6:<14.4g}{'  '.join(f'{v:8.3f}' for v in w):<30}"
                f"{'  '.join(f'{v:8.2f}' for v in forces)}"
            )
        return "\n".join(rows)


def main(n=8, girders=GIRDERS) -> Result:
    """Girders from none to one that hardly bends."""
    dual = DualMesh.from_mesh(footings(n))
    cells = dual.basis()
    plates = cells.with_element(ElementTriMorley())
    K, feet = bending.assemble(plates), np.array([[-SPAN, 0.0, SPAN], [0.0, 0.0, 0.0]])
    Q = plates.probes(feet)
    frames = {}
    for stiffness in girders:
        frame = 6 * stiffness / SPAN**3 * np.outer(MIDDLE, MIDDLE)
        punch = ElasticPunch(SOIL, cells, plates, K + Q.T @ frame @ Q)
        frames[stiffness] = punch.solve(Q.T @ FORCE)
    return Result(frames)


def visualize(result: Result):
    """The footings in space; settlements and forces against the stiffness of the girder."""
    from scenes import pressed

    from skfem_dual.visuals.curves import LINES

    stiffest = result.frames[max(result.frames)]
    pictures = {"footings": pressed(stiffest, "pressure [kPa]", 1e3, eye=(-0.4, -2, 1.8))}
    stiffness = [k for k in result.frames if k > 0]
    for picture, values, unit in (
        ("settlements", lambda k: 1e3 * result.settlements(k), "settlement of the column [mm]"),
        ("forces", lambda k: result.forces(k) / 1e3, "force of the footing [kN]"),
    ):
        ax = pictures[picture] = chart(3.6)
        rows = np.array([values(k) for k in stiffness])
        for (color, style), i, name in zip(LINES, (0, 1), ("outer", "middle"), strict=False):
            ax.semilogx(np.array(stiffness) / 1e6, rows[:, i], style, color=color, label=name)
            if 0.0 in result.frames:
                ax.axhline(values(0.0)[i], color=color, lw=1.2, ls=":")
        ax.set_xlabel("$E\\,I$ of the girder [MN m²]; dotted without one")
        ax.set_ylabel(unit)
        ax.legend()
    return pictures


if __name__ == "__main__":
    run(main, visualize)
