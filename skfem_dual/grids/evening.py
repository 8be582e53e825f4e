"""Stretched cells, mapped onto such as are about as long as wide.

What is near on a grid is so by cells: the nearest by plain distance lie in a row of them.
"""

import numpy as np
from numpy import ndarray

from .polygons import Polygons, readonly

#: cells up to so many times as long as wide are as good as even ones; those of a regular mesh are
#: seldom just that, where rounding would tell
EVEN = 2.07
#: the map of those
UNIT = readonly(np.eye(2))


def evening(polygons: Polygons) -> ndarray:
    """The linear map of determinant one, (2, 2), under which cells on average are as long as wide.

    It turns nothing, and is the unit where they are less than about twice as long as wide.
    """
    xx, xy, yy = (polygons.second_moments / polygons.areas**2).sum(axis=1)
    moments, axes = np.linalg.eigh(np.array([[xx, xy], [xy, yy]]))
    if not moments[1] > EVEN**2 * moments[0]:
        return UNIT
    lengths = (moments / np.sqrt(moments.prod())) ** 0.5
    return readonly((axes / lengths) @ axes.T)
