"""Graded and layered ground: tables, evaluations, assembly, and punches against exact numbers.

python benchmarks/substrates.py           all
python benchmarks/substrates.py --small   small sizes
"""

import argparse
from time import perf_counter

import numpy as np
from edge_time import best
from eight_plans import make
from quiet import warn_beside_other_work

from skfem_dual import (
    DualMesh,
    GradedHalfSpace,
    HalfSpace,
    Layer,
    LayeredHalfSpace,
    RigidPunch,
)
from skfem_dual.elements.influence import influence_matrix

HOMOGENEOUS = HalfSpace(1.0, 0.25)


def grounds():
    """Fresh substrates with W0 E0 a / P and tilt E0 a^3 / M of a rigid circle, trusted."""
    layer = [Layer(1.0, 1.0, 0.25)]
    return {
        "E0 (1 + 0.1 z)": (GradedHalfSpace.init_linear(1.0, 0.25, 0.1), 0.3884265445, 0.668060194),
        "E0 (1 + 0.5 z)": (GradedHalfSpace.init_linear(1.0, 0.25, 0.5), 0.2794736165, 0.571777662),
        "E0 (1 + z)": (GradedHalfSpace.init_linear(1.0, 0.25, 1.0), 0.2212284989, 0.496333765),
        "same, nu = 1/2": (GradedHalfSpace.init_linear(1.0, 0.5, 1.0), 0.1498643676, 0.362765675),
        "layer, bonded": (LayeredHalfSpace(layer, "bonded"), 0.195493007289, 0.566018026363),
        "layer, smooth": (LayeredHalfSpace(layer, "smooth"), 0.2132017851, 0.5940602539),
        "layer on E/10": (
            LayeredHalfSpace(layer, HalfSpace(0.1, 0.25)),
            2.18606607872,
            1.16856340458,
        ),
    }


def tables(n=2000):
    """Print times; return {ground: (build, assembly over homogeneous)}."""
    partition = DualMesh.from_mesh(make("disc", "uniform", n)).partition
    x = partition.centroids
    base = best(lambda: influence_matrix(HOMOGENEOUS, partition, x))
    r = np.random.default_rng(0).uniform(0.01, 2, 10**6)
    print(f"Assembly of {len(partition)} cells on homogeneous ground: {base * 1e3:.0f} ms")
    print(f"{'ground':<18}{'table s':>9}{'1e6 omega s':>13}{'assembly ratio':>16}{'error':>9}")
    found = {}
    for name, (ground, _, _) in grounds().items():
        start = perf_counter()
        ground.remainder  # noqa: B018
        build = perf_counter() - start
        values = best(lambda: ground.influence(r), 2)  # noqa: B023
        influence_matrix(ground, partition, x)
        ratio = best(lambda: influence_matrix(ground, partition, x), 3) / base  # noqa: B023
        found[name] = build, ratio
        print(f"{name:<18}{build:>9.3f}{values:>13.3f}{ratio:>16.2f}{ground.error:>9.0e}")
    return found


def punches(sizes=(300, 600, 1200, 2400)):
    """Print relative errors of settlement and tilt; return {(ground, kind, grid): errors}."""
    print(f"\nRelative errors of settlement / tilt; n: {', '.join(map(str, sizes))}; order in h")
    found = {}
    for kind, grid in (("uniform", "dual"), ("sine", "dual"), ("sine", "triangles")):
        for name, (ground, settlement, tilt) in grounds().items():
            rows = []
            for n in sizes:
                dual = DualMesh.from_mesh(make("disc", kind, n))
                basis = dual.basis() if grid == "dual" else dual.primal_basis()
                c = np.linalg.inv(RigidPunch(ground, basis).stiffness()).diagonal()
                rows.append((len(dual), c[0] / settlement - 1, c[1] / tilt - 1))
            errors = np.array(rows)
            found[name, kind, grid] = errors
            with np.errstate(invalid="ignore"):  # one size has no order
                ratio = np.log(np.abs(errors[0, 1] / errors[-1, 1]))
                order = 2 * ratio / np.log(errors[-1, 0] / errors[0, 0])
            cells = "  ".join(f"{w:+.1e}/{t:+.1e}" for _, w, t in rows)
            print(f"{grid:<10}{kind:<8}{name:<16}{cells}  {order:.1f}", flush=True)
    return found


if __name__ == "__main__":
    warn_beside_other_work()
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--small", action="store_true")
    small = parser.parse_args().small
    tables(300 if small else 2000)
    punches((150, 300) if small else (300, 600, 1200, 2400))
