"""Seconds of dualmesh.get_dual on a square; run by grids.py in an environment that has it."""

import sys
from time import perf_counter

import dualmesh
import meshio
import numpy as np

k = max(2, round(np.sqrt(int(sys.argv[1]) / 2)))
x, y = np.meshgrid(np.linspace(0, 1, k + 1), np.linspace(0, 1, k + 1), indexing="ij")
points = np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], axis=1)
i, j = np.meshgrid(np.arange(k), np.arange(k), indexing="ij")
a = (i * (k + 1) + j).ravel()
triangles = np.vstack([np.c_[a, a + k + 1, a + 1], np.c_[a + k + 1, a + k + 2, a + 1]])
sides = np.sort(np.vstack([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]))
lines, count = np.unique(sides, axis=0, return_counts=True)
corners = np.array([[0], [k], [(k + 1) * k], [(k + 1) ** 2 - 1]])
mesh = meshio.Mesh(
    points, [("triangle", triangles), ("line", lines[count == 1]), ("vertex", corners)]
)
start = perf_counter()
dualmesh.get_dual(mesh, order=True)
print(perf_counter() - start)
