"""Layers of ground, bonded to each other, on a half-space or a rigid base."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Literal

import numpy as np
from numpy import ndarray

from ..arguments import checked_number, checked_sequence, checked_size
from ..kernels.once import computed_once
from ..messages import shown
from .compliance import Moduli
from .graded import GradedHalfSpace
from .strata import Strata, Stratum
from .stratified import Stratified
from .substrates import HalfSpace, checked_moduli


@dataclass(frozen=True)
class Layer:
    """A layer of ground.

    Parameters
    ----------
    thickness : float
        Its thickness.
    young, poisson : float
        Moduli at its top.
    gradient : float
        Young's modulus at depth z below its top is ``young (1 + gradient z)``; negative where
        the layer softens downwards.

    Raises
    ------
    TypeError
        If something is no number.
    ValueError
        If a value is out of range, or the modulus is not positive at the bottom.
    """

    thickness: float
    young: float
    poisson: float
    gradient: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "thickness", checked_size("thickness", self.thickness))
        young, poisson = checked_moduli(self.young, self.poisson)
        object.__setattr__(self, "young", young)
        object.__setattr__(self, "poisson", poisson)
        gradient = checked_number("gradient", self.gradient)
        if gradient:
            checked_size("gradient or its negative", abs(gradient))
        object.__setattr__(self, "gradient", gradient)
        if not 0 < 1 + gradient * self.thickness < np.inf:
            raise ValueError(
                f"expected a positive Young's modulus at the bottom of the layer, got the "
                f"gradient {self.gradient:g} over the thickness {self.thickness:g}"
            )


@dataclass(frozen=True)
class LayeredHalfSpace(Stratified):
    """Layers, bonded to each other, on a base.

    Parameters
    ----------
    layers : sequence of Layer
        From the surface down.
    base : HalfSpace, GradedHalfSpace, LayeredHalfSpace, "bonded" or "smooth"
        What lies below: another ground, or a rigid base to which the last layer is bonded or on
        which it slides.

    Raises
    ------
    TypeError
        If layers or base are something else.
    ValueError
        If there are no layers, or the last one has a gradient on a smooth rigid base.

    Examples
    --------
    >>> rock = LayeredHalfSpace([Layer(1.0, 1.0, 0.25)], "bonded")
    >>> print(f"{rock.influence(0.5):.5f}")
    0.23967
    """

    layers: Sequence[Layer]
    base: HalfSpace | GradedHalfSpace | Literal["bonded", "smooth"]

    def __post_init__(self) -> None:
        layers = tuple(checked_sequence("layers", self.layers))
        if not layers:
            raise ValueError(
                "expected at least one layer, got none. Remedy: what lies below alone"
            )
        if not all(isinstance(layer, Layer) for layer in layers):
            raise TypeError(f"expected a sequence of Layer for layers, got {shown(self.layers)}")
        object.__setattr__(self, "layers", layers)
        if not (
            isinstance(self.base, (HalfSpace, Stratified))
            or (isinstance(self.base, str) and self.base in ("bonded", "smooth"))
        ):
            raise TypeError(
                f'expected a substrate, "bonded" or "smooth" as the base, got {shown(self.base)}'
            )
        if self.base == "smooth" and layers[-1].gradient:
            raise ValueError(
                "expected a layer without gradient on a smooth rigid base, got gradient "
                f"{layers[-1].gradient:g}. Remedy: a thin homogeneous layer at the bottom"
            )

    @computed_once
    def surface(self) -> HalfSpace:
        return HalfSpace(self.layers[0].young, self.layers[0].poisson)

    @property
    def algebraic(self) -> bool:
        return self.layers[0].gradient != 0

    @property
    def lengths(self) -> tuple[float, float]:
        scales = [layer.thickness for layer in self.layers]
        scales += [1 / abs(layer.gradient) for layer in self.layers if layer.gradient]
        deep = sum(layer.thickness for layer in self.layers)
        if isinstance(self.base, Stratified):
            scales.append(self.base.lengths[0])
            deep = max(deep, self.base.lengths[1])
        return min(scales), deep

    @property
    def strata(self) -> Strata:
        young = self.surface.young
        layers = [
            Stratum(layer.thickness, partial(_of_layer, layer, young), layer.gradient == 0)
            for layer in self.layers
        ]
        if isinstance(self.base, str):
            return Strata(tuple(layers), self.base)
        below = self.base.strata
        ratio = self.base.surface.young / young
        layers += [s._replace(moduli=partial(_scaled, s.moduli, ratio)) for s in below.layers]
        return Strata(tuple(layers), below.base)


def _of_layer(layer: Layer, young: float, z: ndarray) -> tuple[ndarray, ndarray]:
    """E / ``young`` and nu at depths below the top of a layer."""
    ratio = layer.young / young * (1 + layer.gradient * z)
    return ratio, np.broadcast_to(layer.poisson, z.shape)


def _scaled(moduli: Moduli, ratio: float, z: ndarray) -> tuple[ndarray, ndarray]:
    young, nu = moduli(z)
    return ratio * young, nu
