"""Finite elements against boundary elements: a rigid circle on homogeneous and graded ground.

The settlement of a smooth rigid circular punch, radius a = 1 and force 1, is computed a second
time by other means: axisymmetric finite elements of scikit-fem on a cylinder of ground of radius
and depth R, whose modulus E = 1 + gradient z varies with the depth z and whose sides and bottom
are smooth. They know nothing of influence functions. Biquadratic quadrilaterals grow from the
edge of the punch, with sides of a / 4096 there, to sides of R / 5.

The cylinder is too stiff. What it misses of the far field of a force is, near the punch, a uniform
settlement in proportion to 1 / R on homogeneous ground; where the modulus grows with depth, like
R, it is in proportion to 1 / R^2. Two cylinders with equal meshes near the punch give the
settlement for R to infinity, to 1e-4.
"""

from dataclasses import dataclass

import numpy as np
from gallery import chart, run
from numpy import ndarray
from scipy.sparse.linalg import splu
from skfem import Basis, BilinearForm, ElementQuad2, ElementVector, MeshQuad, condense

from skfem_dual import DualMesh, GradedHalfSpace, HalfSpace, PunchSolution, RigidPunch
from skfem_dual.grids.generate import disc
from skfem_dual.visuals.style import GROUND

POISSON = 0.25
GRADIENTS = {"homogeneous": 0.0, "graded": 1.0}


@dataclass(frozen=True)
class FiniteElements:
    """Settlements under the force 1 in two cylinders of ground and extrapolated."""

    gradient: float
    sizes: tuple[float, float]
    r: ndarray
    truncated: ndarray
    """Of the surface at the radii ``r``, a row for each cylinder."""

    @property
    def displacement(self) -> ndarray:
        """Of the surface at the radii ``r``, for an infinite cylinder."""
        near, far = self.truncated
        power = 2 if self.gradient else 1
        return far + (far - near) / ((self.sizes[1] / self.sizes[0]) ** power - 1)

    @property
    def settlement(self) -> float:
        """Of the punch, for an infinite cylinder."""
        return float(self.displacement[0])


@dataclass(frozen=True)
class Result:
    """Both solutions by the names of the grounds."""

    finite: dict[str, FiniteElements]
    boundary: dict[str, PunchSolution]

    def __str__(self) -> str:
        rows = ["settlement of a rigid circle, E a W / P"]
        for name, finite in self.finite.items():
            truncated = (
                f"R = {size:g} a: {w:.6f}"
                for size, w in zip(finite.sizes, finite.truncated[:, 0], strict=True)
            )
            w = self.boundary[name].settlement
            rows += [
                f"{name}, finite elements: {', '.join(truncated)}, "
                f"extrapolated: {finite.settlement:.6f}",
                f"{name}, boundary elements: {w:.6f}, "
                f"relative difference {w / finite.settlement - 1:+.1e}",
            ]
        return "\n".join(rows)


def cylinder(octaves: int, finest: int = 12, per_octave: int = 3) -> MeshQuad:
    """Mesh in (r, z) of radius and depth ``2**octaves``.

    Its lines have distances to the edge of the punch that grow in proportion to themselves.
    """
    d = 2.0 ** (np.arange(-finest * per_octave, octaves * per_octave + 1) / per_octave)
    inner, outer = 1 - d[d <= 1], 1 + d[:-1]
    return MeshQuad.init_tensor(np.concatenate([inner[::-1], [1], outer, d[-1:]]), np.append(0, d))


@BilinearForm
def stiffness(u, v, w):
    """Twice the elastic energy of displacements (u_r, u_z) per radian."""
    r, z = w.x
    shear = (1 + w.gradient * z) / (2 * (1 + w.poisson))
    lame = 2 * shear * w.poisson / (1 - 2 * w.poisson)

    def strains(u):
        return u.grad[0, 0], u[0] / r, u.grad[1, 1]

    normal, virtual = strains(u), strains(v)
    sliding = (u.grad[0, 1] + u.grad[1, 0]) * (v.grad[0, 1] + v.grad[1, 0])
    direct = sum(e * f for e, f in zip(normal, virtual, strict=True))
    return (lame * sum(normal) * sum(virtual) + shear * (2 * direct + sliding)) * r


def in_cylinder(mesh: MeshQuad, gradient: float, poisson: float) -> tuple[ndarray, ndarray]:
    """Radii of the points of the surface, and their settlements under the force 1."""
    basis = Basis(mesh, ElementVector(ElementQuad2()), intorder=5)
    (radius, depth), (r, z) = mesh.p.max(axis=1), basis.doflocs
    radial, vertical = np.zeros((2, basis.N), dtype=bool)
    for dofs in (basis.nodal_dofs, basis.facet_dofs, basis.interior_dofs):
        radial[dofs[0]] = vertical[dofs[1]] = True
    punch = vertical & (z == 0) & (r <= 1)
    fixed = punch | (radial & ((r == 0) | (r == radius))) | (vertical & (z == depth))
    K = stiffness.assemble(basis, gradient=gradient, poisson=poisson)
    A, b, u, free = condense(K, x=punch.astype(float), D=np.flatnonzero(fixed))
    # positive definite: no pivoting, a third of the time
    factors = splu(
        A.tocsc(),
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )
    u[free] = factors.solve(b)
    force = 2 * np.pi * (K @ u)[punch].sum()
    surface = np.flatnonzero(vertical & (z == 0))
    surface = surface[np.argsort(r[surface])]
    return r[surface], u[surface] / force


def finite_elements(
    gradient: float, poisson: float = POISSON, octaves: tuple[int, int] = (5, 6)
) -> FiniteElements:
    """Solve in two cylinders; their meshes agree up to the sides of the smaller one."""
    (r, near), (_, far) = (in_cylinder(cylinder(n), gradient, poisson) for n in octaves)
    sizes = (2.0 ** octaves[0], 2.0 ** octaves[1])
    inner = np.count_nonzero(r < sizes[0] / 2)
    return FiniteElements(gradient, sizes, r[:inner], np.stack([near[:inner], far[:inner]]))


def main(n: int = 600, octaves: tuple[int, int] = (5, 6)) -> Result:
    """Solve on both grounds by both methods."""
    grounds = {
        "homogeneous": HalfSpace(young=1.0, poisson=POISSON),
        "graded": GradedHalfSpace.init_linear(
            young=1.0, poisson=POISSON, gradient=GRADIENTS["graded"]
        ),
    }
    basis = DualMesh.from_mesh(disc(n=n)).basis()
    return Result(
        {name: finite_elements(g, octaves=octaves) for name, g in GRADIENTS.items()},
        {name: RigidPunch(ground, basis).solve(1.0) for name, ground in grounds.items()},
    )


def visualize(result: Result):
    """The trough beside the punch, by both methods on both grounds."""
    from skfem_dual.visuals.curves import LINES

    reach, pictures = 4.0, {}
    young = {"homogeneous": "E_0", "graded": r"E_0\,(1 + z / a)"}
    (line, style), (marks, _) = LINES[:2]
    for name, finite in result.finite.items():
        ax = pictures[name] = chart(3.5)
        r = np.linspace(0, reach, 321)
        w = result.boundary[name].ground_displacement(np.stack([r, np.zeros_like(r)]))
        ax.fill_between(r, w, 0.5, color=GROUND, lw=0)
        ax.plot(r, w, style, color=line, label="boundary elements")
        # a choice of the nodes, which are dense at the edge
        i = np.unique(np.abs(finite.r[:, None] - np.arange(0, reach, 0.2)).argmin(axis=0))
        look = {"color": marks, "mfc": "white", "ms": 8, "mew": 2, "zorder": 3, "clip_on": False}
        ax.plot(finite.r[i], finite.displacement[i], "o", label="finite elements", **look)
        ax.set_title(f"{name} ground, $E = {young[name]}$")
        ax.set_xlim(0, reach)
        ax.set_ylim(0.5, 0)
        ax.set_xlabel("r / a")
        ax.set_ylabel(r"settlement $w\,E_0\,a / P$")
        ax.legend(loc="lower right")
    return pictures


if __name__ == "__main__":
    run(main, visualize)
