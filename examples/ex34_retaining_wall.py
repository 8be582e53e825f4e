"""A retaining wall of tetrahedra on the ground: a solid that bends, turns and lifts off its heel.

Base slab and wall are one block of tetrahedra. Backfill loads the heel, its thrust pushes at the
wall, and the ground below resists by pressures alone. What keeps the wall from sliding is named: a
key along its toe holds the displacement x there, and the reactions tell its force. Statics give
the resultant of the pressures whatever the concrete does; a block too stiff to bend stands on the
ground like the rigid punch of the same cells.
"""

from dataclasses import dataclass

import numpy as np
from gallery import run
from skfem import CellBasis, ElementTetP2, ElementVector, FacetBasis, LinearForm, MeshTet
from skfem.models.elasticity import lame_parameters, linear_elasticity

from skfem_dual import (
    DualMesh,
    ElasticPunch,
    ElasticSolution,
    HalfSpace,
    Layer,
    LayeredHalfSpace,
    PunchSolution,
    RigidPunch,
    trace,
)

#: in m, kN, kPa: base from the heel at x = 0 to the toe, wall above it, length along y
BASE, SLAB, HEIGHT, LENGTH, WALL = 4.0, 1.0, 5.0, 4.0, (2.0, 3.0)
GROUND = LayeredHalfSpace([Layer(1.5, 20e3, 0.35)], HalfSpace(young=60e3, poisson=0.3))
#: on the heel and against the wall at its foot, of the backfill; its thrust grows with depth
FILL, THRUST = 80.0, 70.0
CONCRETE, POISSON, STIFF = 30e6, 0.2, 1e12


@LinearForm
def down(v, w):
    return -FILL * v[2]


@LinearForm
def push(v, w):
    return THRUST * (HEIGHT - w.x[2]) / (HEIGHT - SLAB) * v[0]


def wall(n: int) -> MeshTet:
    """Tetrahedra of about BASE / n, the boundaries named."""
    h = BASE / n
    x, y = np.linspace(0, BASE, n + 1), np.linspace(0, LENGTH, round(LENGTH / h) + 1)
    box = MeshTet.init_tensor(x, y, np.linspace(0, HEIGHT, round(HEIGHT / h) + 1))
    centre = box.p[:, box.t].mean(axis=1)
    keep = (centre[2] < SLAB) | ((WALL[0] < centre[0]) & (centre[0] < WALL[1]))
    eps = 1e-9
    return box.restrict(np.nonzero(keep)[0]).with_boundaries(
        {
            "base": lambda x: x[2] < eps,
            "heel": lambda x: (np.abs(x[2] - SLAB) < eps) & (x[0] < WALL[0]),
            "back": lambda x: (np.abs(x[0] - WALL[0]) < eps) & (x[2] > SLAB),
        }
    )


@dataclass(frozen=True)
class Result:
    """The wall of concrete, one too stiff to bend, and the rigid punch under its resultant."""

    wall: ElasticSolution
    stiff: ElasticSolution
    rigid: PunchSolution

    @property
    def key(self) -> float:
        """Force of the key along the toe, against the thrust: the reactions along x."""
        along_x = self.wall.punch.structure.split_indices()[0]
        return float(-self.wall.reactions[along_x].sum())

    def __str__(self) -> str:
        rows = [f"{'':<16}{'heel [mm]':<12}{'toe [mm]':<12}{'in contact':<13}resultant at x [m]"]
        x = np.array([[0.02, BASE - 0.02], [LENGTH / 2] * 2])
        for name, s, w in (
            ("concrete", self.wall, self.wall.deflection(x)),
            ("stiff", self.stiff, self.stiff.deflection(x)),
            ("rigid punch", self.rigid, self.rigid.punch_displacement(x)),
        ):
            rows.append(
                f"{name:<16}{1e3 * w[0]:<12.3f}{1e3 * w[1]:<12.3f}"
                f"{f'{100 * s.contact_area / BASE / LENGTH:.1f} %':<13}"
                f"{s.punch.origin[0] + s.centre_of_pressure[0]:.4f}"
            )
        return "\n".join([*rows, f"horizontal force on the key: {self.key:.1f} kN"])


def main(n=8) -> Result:
    """Elements of second order; held along the toe, and at its ends against sliding along y."""
    mesh = wall(n)
    basis = CellBasis(mesh, ElementVector(ElementTetP2()))
    f = down.assemble(FacetBasis(mesh, basis.elem, facets="heel"))
    f = f + push.assemble(FacetBasis(mesh, basis.elem, facets="back"))
    x = basis.doflocs
    toe = (np.abs(x[0] - BASE) < 1e-9) & (np.abs(x[2]) < 1e-9)
    along = np.arange(basis.N) % 3  # components of a node follow each other
    held = np.nonzero(toe & (along == 0))[0]
    middle = np.nonzero(toe & (along == 1) & (np.abs(x[1] - LENGTH / 2) < 1e-9))[0]
    cells = DualMesh.from_mesh(trace(mesh, "base")).basis()
    found = []
    for young in (CONCRETE, STIFF):
        K = linear_elasticity(*lame_parameters(young, POISSON)).assemble(basis)
        options = {"boundary": "base", "D": np.append(held, middle)}
        found.append(ElasticPunch(GROUND, cells, basis, K, **options).solve(f))
    s = found[1]
    rigid = RigidPunch(GROUND, cells).solve(s.force, tuple(s.centre_of_pressure))
    return Result(*found, rigid)


def visualize(result: Result):
    """The wall displaced, and the pressures below it."""
    from scenes import bent, pressed

    return {
        "retaining_wall": bent(result.wall, "displacement [m]"),
        "pressure_below": pressed(result.wall, "pressure [kPa]"),
    }


if __name__ == "__main__":
    run(main, visualize)
