"""Waves of load on layers by Love's stress function, one linear system for each wave number.

Of Burmister (1945): ``phi = f(z) J0(k r)`` with ``f = (A + B x) e^-x + (C + D y) e^-y`` in each
layer, x and y k times the distances from its top and bottom.
"""

from itertools import pairwise

import numpy as np


def _layer(z, k, thickness, young, nu):
    """Rows s, t, u, w (as in `Amplitudes`, E0 = 1), columns A, B, C, D; k = 1 scales lengths."""
    x = k * z
    e = np.exp(-x)
    f = np.array([e, x * e])
    d1, d2, d3 = np.array([[-e, (1 - x) * e], [e, (x - 2) * e], [-e, (3 - x) * e]])
    if np.isfinite(thickness):
        y = k * (thickness - z)
        e = np.exp(-y)
        f = np.append(f, [e, y * e])
        # d/dz = -k d/dy
        d1 = np.append(d1, [e, -(1 - y) * e])
        d2 = np.append(d2, [e, (y - 2) * e])
        d3 = np.append(d3, [e, -(3 - y) * e])
    two_g = young / (1 + nu)
    return np.array(
        [
            (1 - nu) * d3 - (2 - nu) * d1,
            nu * d2 + (1 - nu) * f,
            d1 / two_g,
            ((1 - 2 * nu) * d2 - 2 * (1 - nu) * f) / two_g,
        ]
    )


def amplitudes(layers, base, k, depth):
    """t, s, u, w at one depth and wave number under a unit pressure, times k for displacements.

    ``layers`` has (thickness, young, nu) from the top, the last infinite without a rigid base.
    """
    tops = np.cumsum([0.0] + [layer[0] for layer in layers[:-1]])
    sizes = [4 if np.isfinite(layer[0]) else 2 for layer in layers]
    at = np.cumsum([0, *sizes])
    rows, right = [], []

    def row(*parts):
        out = np.zeros(at[-1])
        for i, values in parts:
            out[at[i] : at[i + 1]] += values
        rows.append(out)
        right.append(0.0)

    surface = _layer(0.0, k, *layers[0])
    row((0, surface[0]))
    right[-1] = -1.0
    row((0, surface[1]))
    for i, (upper, lower) in enumerate(pairwise(layers)):
        above, below = _layer(upper[0], k, *upper), _layer(0.0, k, *lower)
        for q in range(4):
            row((i, above[q]), (i + 1, -below[q]))
    if base is not None:
        bottom = _layer(layers[-1][0], k, *layers[-1])
        row((len(layers) - 1, bottom[3]))
        row((len(layers) - 1, bottom[2 if base == "bonded" else 1]))
    constants = np.linalg.solve(np.array(rows), np.array(right))
    i = int(np.searchsorted(tops, depth)) - 1  # the layer above an interface
    own = constants[at[i] : at[i + 1]]
    s, t, u, w = _layer(depth - tops[i], k, *layers[i]) @ own
    return np.array([t, s, u, w])
