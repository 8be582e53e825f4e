"""Time and memory of dual grids, checks, general triangulations and relocation.

    python benchmarks/grids.py                        1e3 to 1e6 triangles
    python benchmarks/grids.py --small                1e3 and 1e4
    python benchmarks/grids.py --peer PATH/TO/python  beside the package dualmesh

Side by side: scipy's Voronoi diagram of the same nodes. The peer dualmesh 0.14 needs an
environment of its own, ``pip install dualmesh "meshio<5" "numpy<1.24"``: with meshio 5 it fails.
"""

import argparse
import subprocess
import tracemalloc
from pathlib import Path
from time import perf_counter

import numpy as np
from quiet import warn_beside_other_work
from scipy.spatial import Voronoi
from skfem import MeshTri

from skfem_dual import DualMesh, check_mesh
from skfem_dual.grids.general import general_triangulation
from skfem_dual.grids.preprocess import relocate

SIZES = (10**3, 10**4, 10**5, 10**6)


def random_square(ntriangles: int) -> MeshTri:
    """A unit square of about so many triangles, inner nodes moved at random."""
    k = max(2, round(np.sqrt(ntriangles / 2)))
    mesh = MeshTri.init_tensor(np.linspace(0, 1, k + 1), np.linspace(0, 1, k + 1))
    p, inner = mesh.p.copy(), mesh.interior_nodes()
    p[:, inner] += np.random.default_rng(0).uniform(-0.12 / k, 0.12 / k, (2, len(inner)))
    return MeshTri(p, mesh.t)


def dual_with_geometry(mesh: MeshTri) -> tuple:
    dual = DualMesh.from_mesh(mesh)
    return dual, dual.areas, dual.centroids


WORK = {
    "dual grid": dual_with_geometry,
    "check_mesh": check_mesh,
    "general": general_triangulation,
    "relocation": lambda mesh: relocate(mesh, "neighbours"),
    "Voronoi": lambda mesh: Voronoi(mesh.p.T),
}


def seconds(work, mesh: MeshTri, repeat: int) -> float:
    """Least time on fresh copies of a mesh, because meshes keep what they have computed."""
    times = []
    for _ in range(repeat):
        copy = MeshTri(mesh.p.copy(), mesh.t.copy())
        start = perf_counter()
        work(copy)
        times.append(perf_counter() - start)
    return min(times)


def main(sizes=SIZES, peer: str | None = None) -> dict[tuple[int, str], float]:
    """Print the tables; return seconds by number of triangles and work."""
    names = [*WORK, *(["dualmesh"] if peer else [])]
    print("Seconds (microseconds for each triangle)")
    print(f"{'triangles':>10}" + "".join(f"{name:>19}" for name in names) + f"{'peak MB':>9}")
    found = {}
    for n in sizes:
        mesh = random_square(n)
        cells = []
        for name in names:
            if name == "dualmesh":
                t = peer_seconds(peer, mesh.nelements)
            else:
                t = seconds(WORK[name], mesh, 3 if n < 10**6 else 1)
            found[n, name] = t
            cells.append(f"{t:.4f} ({t / mesh.nelements * 1e6:.2f})")
        tracemalloc.start()
        dual_with_geometry(MeshTri(mesh.p.copy(), mesh.t.copy()))
        peak = tracemalloc.get_traced_memory()[1] / 1e6
        tracemalloc.stop()
        print(f"{mesh.nelements:>10}" + "".join(f"{c:>19}" for c in cells) + f"{peak:>9.0f}")
    return found


def peer_seconds(python: str, ntriangles: int) -> float:
    """Time of dualmesh.get_dual in its own environment; its cost grows with the square."""
    if ntriangles > 12_000:
        return float("nan")
    script = Path(__file__).with_name("peer_dualmesh.py")
    done = subprocess.run(
        [python, "-W", "ignore", str(script), str(ntriangles)],
        capture_output=True,
        text=True,
        check=True,
    )
    return float(done.stdout)


if __name__ == "__main__":
    warn_beside_other_work()
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--small", action="store_true")
    parser.add_argument("--peer", help="python of an environment with dualmesh")
    options = parser.parse_args()
    main(SIZES[:2] if options.small else SIZES, options.peer)
