"""Two neighbouring footings: how much more they settle, and how they lean towards each other.

Square rigid footings of half-side a on one half-space, each under the force P at its centre. Far
apart, each settles additionally by what a point force causes there, P / (pi E* d) at the distance
d of the centres, and tilts by P / (pi E* d^2); close together, by more than that. Beside a
heavy neighbour the ground is curved so much that a light footing lifts off, above all at the side
of the neighbour.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from gallery import chart, run, sheet, without_axes
from skfem import CellBasis, ElementTriP1, MeshTri

from skfem_dual import DualMesh, HalfSpace, PunchSolution, RigidPunch
from skfem_dual.bodies.group import RigidPunches
from skfem_dual.contact.region import ContactRegion
from skfem_dual.grids.generate import rectangle
from skfem_dual.solutions.group_solution import PunchesSolution
from skfem_dual.visuals.style import BODY, CONTACT, OUTLINE

SOIL = HalfSpace(young=1.0, poisson=0.0)  # E* = 1, with a = P = 1
#: clear distance of the footings pictured, the forces on both, and levels of isobars
NEAR = 0.2
PICTURED = {
    "P and P": ((1.0, 1.0), [0.6, 0.7, 0.8, 1.0, 1.2, 1.5, 2.0, 3.0]),
    "P and 8 P": ((1.0, 8.0), [0.5, 1.0, 1.5, 2.0, 3.0, 5.0, 7.0, 10.0, 15.0]),
}


@dataclass(frozen=True)
class Result:
    """Interaction factors and tilts by clear distance; solutions to be pictured."""

    distances: np.ndarray
    factors: np.ndarray
    tilts: np.ndarray
    alone: PunchSolution
    pictured: dict[str, PunchesSolution]

    @property
    def far(self) -> tuple[np.ndarray, np.ndarray]:
        """Factors and tilts by point forces."""
        d = self.distances + 2
        return 1 + 1 / (np.pi * d) / self.alone.settlement, 1 / (np.pi * d**2)

    def __str__(self) -> str:
        rows = [f"{'clear distance / a':<20}{'factor':<9}{'far apart':<11}{'tilt':<9}far apart"]
        for row in zip(self.distances, self.factors, self.far[0], self.tilts, self.far[1]):
            rows.append("{:<20.2f}{:<9.4f}{:<11.4f}{:<9.4f}{:.4f}".format(*row))
        for name, pair in self.pictured.items():
            for side, s in zip(("left", "right"), pair.solutions, strict=True):
                share = s.contact_area / s.punch.partition.areas.sum()
                rows.append(
                    f"{name}, {side}: W0 = {s.settlement:.4f}, tilt {s.tilt[0]:+.4f}, in contact "
                    f"{share:.3f}"
                )
        return "\n".join(rows)


def side_by_side(distance: float, mesh: MeshTri) -> RigidPunches:
    """Two footings at a clear distance."""
    x = 1 + distance / 2
    return RigidPunches(
        [
            RigidPunch(SOIL, DualMesh.from_mesh(mesh.translated((c, 0.0))).basis(), origin=(c, 0))
            for c in (-x, x)
        ]
    )


def main(n=300, distances=(0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0)) -> Result:
    """Solve with about n dual cells under each footing."""
    mesh = rectangle(2.0, 2.0, n=n)
    loads = [{"force": 1.0}] * 2
    alone = RigidPunch(SOIL, DualMesh.from_mesh(mesh).basis()).solve(1.0)
    pairs = [side_by_side(d, mesh).solve(loads) for d in distances]
    return Result(
        np.array(distances),
        np.array([pair[0].settlement for pair in pairs]) / alone.settlement,
        np.array([pair[0].tilt[0] for pair in pairs]),
        alone,
        {
            name: side_by_side(NEAR, mesh).solve([{"force": p} for p in forces])
            for name, (forces, _) in PICTURED.items()
        },
    )


def visualize(result: Result):
    """Ground and footings in space; isobars of both; factor and tilt over the distance."""
    from skfem_dual.visuals.matplotlib import isobars

    name, pair = next(iter(result.pictured.items()))
    pictures = {"ground": draw_ground(pair)}
    for i, (name, (_, levels)) in enumerate(PICTURED.items()):
        basis, p, region = together(result.pictured[name].solutions)
        ax = pictures[f"isobars_{i}"] = sheet(2.9)
        isobars(basis, 4 * p, levels, contact=region, title="p / (P / 4a²)", ax=ax)
        without_axes(ax, name)
    labels = ("settlement over that alone", "tilt, in P / (E* a²)")
    found = (result.factors, result.tilts)
    for name, label, values, far in zip(("factor", "tilt"), labels, found, result.far):
        ax = pictures[name] = chart()
        ax.semilogx(result.distances, far, "--", color=OUTLINE, label="point force")
        ax.semilogx(result.distances, values, "-o", color=CONTACT, label="footings")
        ax.set_xlabel("clear distance / a")
        ax.set_ylabel(label)
        ax.legend()
    return pictures


def draw_ground(pair: PunchesSolution):
    """Its surface with both footings on it, settlements drawn larger."""
    from scenes import add, plate, shown, stage

    from skfem_dual.visuals.style import SETTLEMENT

    n, m = 151, 91
    x = np.array(np.meshgrid(np.linspace(-4.4, 4.4, n), np.linspace(-2.6, 2.6, m)))
    w = pair.ground_displacement(x.reshape(2, -1))
    i = np.arange(n * m).reshape(m, n)
    faces = np.stack([i[:-1, :-1], i[:-1, 1:], i[1:, 1:], i[1:, :-1]]).reshape(4, -1)
    plotter, limits, scale = stage(), (0.0, float(w.max())), 1.2 / w.max()
    surface = np.vstack([x.reshape(2, -1), -scale * w])
    look = {"scalars": w, "clim": limits, "cmap": SETTLEMENT, "smooth_shading": True}
    add(plotter, surface, faces, **look)
    for s in pair.solutions:
        corners = np.array([[-1, 1, 1, -1], [-1, -1, 1, 1]]) + np.c_[[*s.punch.origin]]
        add(
            plotter,
            *plate(corners, 0.03 - scale * s.punch_displacement(corners), 0.25),
            color=BODY,
        )
    label = "settlement, in P / (E* a)"
    return shown(plotter, label, SETTLEMENT, limits, (-0.5, -2, 1.1))


def together(solutions: Sequence[PunchSolution]):
    """Pressures of several punches as one field, and their regions of contact as one."""
    fields = [s.pressure_field() for s in solutions]
    region = ContactRegion.together([s.contact_region for s in solutions])
    mesh = MeshTri(*joined((basis.mesh.p, basis.mesh.t) for basis, _ in fields))
    return CellBasis(mesh, ElementTriP1()), np.concatenate([v for _, v in fields]), region


def joined(parts):
    """Points and triangles of several meshes as one."""
    points, triangles = zip(*parts, strict=True)
    first = np.cumsum([0, *(p.shape[1] for p in points)])
    return np.hstack(points), np.hstack([t + k for t, k in zip(triangles, first)])


if __name__ == "__main__":
    run(main, visualize)
