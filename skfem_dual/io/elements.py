"""The order of the vertices of elements in VTU files.

VTK integrates with signed areas and volumes, and normals of surfaces follow from that order;
scikit-fem sorts the vertices of simplices, which leaves half of them turned over.
"""

import numpy as np
from numpy import ndarray

#: by the dimension and the number of points: those beside the first in positive order, and what
#: turns an element over
ORDERS = {
    (2, 3): ([1, 2], [0, 2, 1]),
    (2, 6): ([1, 2], [0, 2, 1, 5, 4, 3]),
    (2, 4): ([1, 3], [0, 3, 2, 1]),
    (3, 4): ([1, 2, 3], [0, 2, 1, 3]),
    (3, 8): ([1, 3, 4], [4, 5, 6, 7, 0, 1, 2, 3]),
}


def positive(p: ndarray, cells: ndarray) -> ndarray:
    """Elements of which none is turned over.

    Parameters
    ----------
    p : (d, npoints) array of float
        Points.
    cells : (k, n) array of int
        Numbers of the points of each element, in the order of VTK or turned over.

    Returns
    -------
    (k, n) array of int

    Examples
    --------
    >>> p = np.array([[0.0, 1.0, 0.0, 1.0], [0.0, 0.0, 1.0, 1.0]])
    >>> positive(p, np.array([[0, 1], [1, 2], [2, 3]])).T.tolist()
    [[0, 1, 2], [1, 3, 2]]
    """
    beside, over = ORDERS[len(p), len(cells)]
    sides = p[:, cells[beside]] - p[:, cells[:1]]
    turned = np.linalg.det(np.moveaxis(sides, -1, 0)) < 0
    return np.where(turned, cells[over], cells)
