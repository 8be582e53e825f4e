"""A circular raft that lifts off: deflections, contact and pressures beside references.

A load P on the middle of a raft bends it until its rim leaves the ground. The raft is a thin plate
of Morley elements, the ground an elastic half-space, and where they touch is found. With the
relative stiffness of example 29,

    K = (E_r / E) (1 - nu^2) (t / a)^3,       D = K E* a^3 / (12 (1 - nu_r^2)),

the raft is in full contact from about K = 1 on. The reference values are those of an axisymmetric
method that shares nothing with the cells, for P spread over r < 0.2 a.
"""

from dataclasses import dataclass

import numpy as np
from gallery import chart, legend_below, run
from skfem import BilinearForm, CellBasis, ElementTriMorley
from skfem.helpers import dd, ddot, eye, trace

from skfem_dual import DualMesh, ElasticPunch, ElasticSolution, HalfSpace, evaluate
from skfem_dual.grids.generate import disc

POISSON, PATCH = 0.2, 0.2
#: by K: deflection of centre and edge over P / (E* a), radius of contact over a, pressure in the
#: middle over P / a^2
REFERENCES = {
    0.01: (2.36406, -0.65500, 0.3984, 5.2499),
    0.1: (1.381462, 0.193612, 0.7114, 1.93021),
    1.0: (0.73723, 0.42253, 1.0, 0.55146),
}


@BilinearForm
def bending(u, v, w):
    """Twice the energy of a plate."""
    return w.D * ddot((1 - POISSON) * dd(u) + POISSON * eye(trace(dd(u)), 2), dd(v))


def patch(plate: CellBasis) -> np.ndarray:
    """Load vector of a force of one over r < PATCH, whatever elements its edge cuts."""
    s, w = np.polynomial.legendre.leggauss(12)
    r = PATCH * np.sqrt((s + 1) / 2)  # equal areas
    angle = 2 * np.pi * (np.arange(48) + 0.5) / 48
    x = np.array([np.outer(r, np.cos(angle)).ravel(), np.outer(r, np.sin(angle)).ravel()])
    return plate.probes(x).T @ np.repeat(w / 2, 48) / 48


@dataclass(frozen=True)
class Result:
    """Solutions by relative stiffness."""

    rafts: dict[float, ElasticSolution]

    def found(self, ratio: float) -> tuple[float, float, float, float]:
        """What the references have."""
        s = self.rafts[ratio]
        angle = np.linspace(0, 2 * np.pi, 60, endpoint=False)
        rim = s.punch.basis.dual.mesh.boundary_nodes()
        edge = s.deflection(s.punch.basis.dual.mesh.p[:, rim]).mean()
        middle = s.pressure_at(0.02 * np.array([np.cos(angle), np.sin(angle)])).mean()
        return (
            float(s.deflection(np.zeros((2, 1)))[0]),
            float(edge),
            float(np.sqrt(s.contact_area / np.pi)),
            float(middle),
        )

    def __str__(self) -> str:
        rows = [f"{'K':<7}{'':<12}{'centre':<10}{'edge':<10}{'radius':<10}pressure in the middle"]
        for ratio, known in REFERENCES.items():
            if ratio in self.rafts:
                for name, values in (("cells", self.found(ratio)), ("reference", known)):
                    head = f"{ratio:<7g}" if name == "cells" else " " * 7
                    rows.append(f"{head}{name:<12}" + "".join(f"{v:<10.5f}" for v in values))
        return "\n".join(rows)


def main(n=600, ratios=tuple(REFERENCES)) -> Result:
    """Rafts on about n dual cells."""
    dual = DualMesh.from_mesh(disc(n=n))
    plate = CellBasis(dual.refinement.refined(), ElementTriMorley())
    soil, f = HalfSpace(young=1.0, poisson=0.0), patch(plate)
    rafts = {}
    for ratio in ratios:
        K = bending.assemble(plate, D=ratio / 12 / (1 - POISSON**2))
        rafts[ratio] = ElasticPunch(soil, dual.basis(), plate, K).solve(f)
    return Result(rafts)


def visualize(result: Result):
    """The softest raft in space; deflections and pressures along a radius."""
    from scenes import bent

    first = bent(
        next(iter(result.rafts.values())), r"deflection $w\,E^* a / P$", eye=(-0.6, -2, 1.5)
    )
    return {"raft_lifting_off": first} | draw_radii(result)


def draw_radii(result: Result) -> dict:
    """Dots for references."""
    from skfem_dual.visuals.curves import LINES

    below, pressed = chart(3.8), chart()
    r = np.linspace(0, 0.995, 200)
    angles = 2 * np.pi * (np.arange(8) + 0.5) / 8
    for (color, style), (ratio, s) in zip(LINES, result.rafts.items(), strict=False):
        x = np.array([np.outer(r, np.cos(angles)), np.outer(r, np.sin(angles))])
        name = f"K = {ratio:g}"
        below.plot(r, s.deflection(x).mean(axis=1), style, color=color, label=name)
        below.plot(r, s.ground_displacement(x).mean(axis=1), ":", color=color, lw=1.2)
        p = evaluate(*s.pressure_field(), x.reshape(2, -1), outside="zero").reshape(x.shape[1:])
        pressed.plot(r, p.mean(axis=1), style, color=color, label=name)
        centre, edge, radius, middle = REFERENCES[ratio]
        dots = {"color": color, "mfc": "white", "ms": 8, "ls": "none", "zorder": 3}
        below.plot([0, 1], [centre, edge], "o", clip_on=False, **dots)
        pressed.plot([0], [middle], "o", clip_on=False, **dots)
        if radius < 1:
            pressed.plot([radius], [0], "s", clip_on=False, **dots)
    below.plot([], [], ":", color="k", lw=1.2, label="ground")
    below.plot([], [], "o", color="k", mfc="white", label="reference")
    below.set_ylabel(r"deflection $w\,E^* a / P$, downwards")
    below.invert_yaxis()
    legend_below(below, 3, columnspacing=1)
    pressed.set_ylabel(r"contact pressure $p\,a^2 / P$")
    pressed.set_ylim(0, 6)
    pressed.legend()
    for ax in (below, pressed):
        ax.set_xlabel("r / a")
        ax.set_xlim(0, 1)
    return {"deflections": below, "pressures": pressed}


if __name__ == "__main__":
    run(main, visualize)
