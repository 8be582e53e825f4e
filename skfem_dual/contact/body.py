"""What stands on a footprint, whatever it is."""

from abc import ABC, abstractmethod

import numpy as np
from numpy import ndarray

from ..elements.edge_correction import EdgeCorrection
from ..elements.edge_weights import EdgeWeights
from ..grids.fan import Fan
from ..grids.partition import Partition
from ..grids.polygons import readonly
from ..kernels.once import computed_once
from .footprint import Footprint
from .shapes import Gap, gap_values


class Body(ABC):
    """What stands on a footprint shows its cells."""

    gap: Gap | None

    @property
    @abstractmethod
    def footprint(self) -> Footprint:
        """The cells under the body, with all that pressures and gaps depend on."""

    @property
    def partition(self) -> Partition:
        """The cells, in the order of the DOFs of the basis."""
        return self.footprint.partition

    @property
    def fan(self) -> Fan:
        """Triangles that fill the cells."""
        return self.footprint.fan

    @property
    def weights(self) -> EdgeWeights | None:
        """How the pressure varies inside the cells; None if it does not."""
        return self.footprint.weights

    @property
    def collocation_points(self) -> ndarray:
        """Collocation point of each cell, shape (2, n)."""
        return self.footprint.collocation_points

    @computed_once
    def initial_gap(self) -> ndarray:
        """Gap between the unloaded body and the ground in the collocation points."""
        x = self.collocation_points
        return readonly(np.zeros(x.shape[1]) if self.gap is None else gap_values(self.gap, x))

    @property
    def acting(self) -> ndarray:
        """Point through which the pressure of each cell acts, shape (2, n)."""
        return self.footprint.acting

    @property
    def centre(self) -> ndarray:
        """Centroid of the plan, about which all is computed: no cancellation far from it."""
        return self.footprint.centre

    @property
    def resultants(self) -> ndarray:
        """Force and first moments about the plan's centroid of unit pressures, shape (3, n)."""
        return self.footprint.resultants

    @property
    def grid_description(self) -> str:
        """Number and kind of the cells and the collocation, for tables."""
        return self.footprint.description

    def planes(self, x: ndarray) -> ndarray:
        """Settlement at ``x`` by unit settlement of the plan's centroid and unit tilts."""
        return self.footprint.planes(x)

    def influence(self, x: ndarray) -> ndarray:
        """Settlement of points of shape (2, m) under unit pressure on each cell, (m, n)."""
        return self.footprint.influence(x)

    def edge_correction(self, x: ndarray) -> EdgeCorrection | None:
        """What the variation of the pressure inside the cells adds to settlements at ``x``."""
        return self.footprint.edge_correction(x)
