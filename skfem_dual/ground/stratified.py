"""Substrates whose moduli depend on depth: graded and layered half-spaces."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from math import isfinite
from typing import Literal

import numpy as np
from numpy import ndarray

from .hankel import (
    FORGOTTEN,
    RadialTable,
    as_pair,
    build_table,
    homogeneous,
    rigid,
    through_graded,
    through_homogeneous,
)
from .substrates import HalfSpace, checked_moduli


class Stratified:
    """What graded and layered half-spaces have in common.

    The influence function is split into ``c / r`` of the surface moduli, closed on polygons, and
    a remainder with a logarithm at ``r = 0``, kept in a table that is built when first needed.
    """

    @property
    def surface(self) -> HalfSpace:
        """The homogeneous half-space with the moduli of the surface."""
        raise NotImplementedError

    def compliance(self, k: ndarray) -> ndarray:
        """``k E0 P`` at the surface: Q11, Q12, Q22 of shape (3, n)."""
        raise NotImplementedError

    @property
    def lengths(self) -> tuple[float, float]:
        """The least and the greatest length over which the moduli vary."""
        raise NotImplementedError

    @property
    def singular_coefficient(self) -> float:
        """c of the part c / r of the influence function, closed on polygons."""
        return self.surface.singular_coefficient

    @property
    def algebraic(self) -> bool:
        """Whether the moduli vary at the surface, so that the symbol decays like powers."""
        return True

    @cached_property
    def remainder(self) -> RadialTable:
        """The influence function less c / r, times the surface modulus E0, and its primitive."""
        surface = self.surface
        c0 = 2 * (1 - surface.poisson**2)
        return build_table(lambda k: self.compliance(k)[2] - c0, self.lengths, self.algebraic)

    @property
    def error(self) -> float:
        """Estimated error of the influence function, relative to that of the surface moduli."""
        return self.remainder.error / (self.singular_coefficient * self.surface.young)

    @property
    def farthest(self) -> float:
        """Largest distance for which the influence function is known."""
        return self.remainder.farthest

    def influence(self, r) -> ndarray:
        """Settlement of the surface at distance ``r`` from a unit vertical force.

        Raises
        ------
        ValueError
            Beyond ``farthest``.
        """
        r = np.abs(np.asarray(r, dtype=float))
        table = self.remainder
        rest = table.evaluate(table.omega, r) / self.surface.young
        return self.surface.influence(r) + rest

    def symbol(self, k) -> ndarray:
        """Fourier transform of the influence function."""
        k = np.abs(np.asarray(k, dtype=float))
        q = self.compliance(np.atleast_1d(k).ravel())[2].reshape(k.shape)
        return q / (k * self.surface.young)

    def primitive(self, radius) -> ndarray:
        """Integral of ``influence(r) r`` from 0 to ``radius``."""
        radius = np.asarray(radius, dtype=float)
        table = self.remainder
        rest = radius * table.evaluate(table.primitive_over_r, radius) / self.surface.young
        return self.surface.primitive(radius) + rest


@dataclass(frozen=True, eq=False, repr=False)
class GradedHalfSpace(Stratified):
    """Elastic half-space whose moduli vary smoothly with depth.

    Build it with `init_linear`, `init_exponential`, `init_power` or `init_profile`.

    Parameters
    ----------
    young : callable
        Young's modulus at depths z >= 0, given as an array; positive, also at the surface.
    poisson : float or callable
        Poisson's ratio, from 0 to 1/2.
    length : float
        Depth over which the moduli vary by a sizeable part.
    description : str
        For tables.

    Raises
    ------
    ValueError
        If a modulus is out of range, as for a modulus that vanishes at the surface.

    Examples
    --------
    >>> soil = GradedHalfSpace.init_linear(young=1.0, poisson=0.25, gradient=1.0)
    >>> print(f"{soil.influence(1.0):.8f}")
    0.08705058
    """

    young: Callable[[ndarray], ndarray]
    poisson: float | Callable[[ndarray], ndarray]
    length: float
    description: str = "profile"

    def __post_init__(self):
        if not (isfinite(self.length) and self.length > 0):
            raise ValueError(f"expected a positive length, got {self.length!r}")
        depth = self.length * np.concatenate([[0.0], np.logspace(-6, 6, 49)])
        ratio, nu = self._moduli(depth)
        young = ratio * float(self.young(np.zeros(1))[0])
        for what, values, good, span in (
            ("young", young, np.isfinite(young) & (young > 0), "positive"),
            ("poisson", nu, (nu >= 0) & (nu <= 0.5), "from 0 to 0.5"),
        ):
            if not good.all():
                i = np.argmin(good)
                raise ValueError(
                    f"expected {what} {span} at all depths, got {values[i]:g} at depth "
                    f"{depth[i]:g}. Remedy: start the profile with a positive modulus at z = 0"
                )

    @classmethod
    def init_linear(cls, young: float, poisson: float, gradient: float) -> "GradedHalfSpace":
        """``E = young (1 + gradient z)``; the paper's B / h is ``gradient`` > 0."""
        young, poisson = checked_moduli(young, poisson)
        gradient = _positive("gradient", gradient)
        return cls(
            partial(_linear, young, gradient),
            poisson,
            1 / gradient,
            f"E = {young:g} (1 + {gradient:g} z), nu = {poisson:g}",
        )

    @classmethod
    def init_exponential(
        cls, young: float, poisson: float, ratio: float, length: float
    ) -> "GradedHalfSpace":
        """``E = young (ratio + (1 - ratio) exp(-z / length))``, from young to ratio young."""
        young, poisson = checked_moduli(young, poisson)
        ratio, length = _positive("ratio", ratio), _positive("length", length)
        return cls(
            partial(_exponential, young, ratio, length),
            poisson,
            length,
            f"E from {young:g} to {ratio * young:g} over {length:g}, nu = {poisson:g}",
        )

    @classmethod
    def init_power(
        cls, young: float, poisson: float, exponent: float, offset: float
    ) -> "GradedHalfSpace":
        """``E = young (1 + z / offset)^exponent``, 0 < exponent < 2; positive at the surface."""
        young, poisson = checked_moduli(young, poisson)
        offset = _positive("offset", offset)
        exponent = float(exponent)
        if not 0 < exponent < 2:
            raise ValueError(f"expected an exponent between 0 and 2, got {exponent:g}")
        return cls(
            partial(_power, young, exponent, offset),
            poisson,
            offset,
            f"E = {young:g} (1 + z / {offset:g})^{exponent:g}, nu = {poisson:g}",
        )

    @classmethod
    def init_profile(
        cls, young: Callable, poisson: float | Callable, length: float | None = None
    ) -> "GradedHalfSpace":
        """Any smooth moduli, functions of the depth z as an array.

        ``length`` is the depth over which they vary by a sizeable part; found by default.
        """
        return cls(young, poisson, _length(young, poisson) if length is None else float(length))

    def __repr__(self) -> str:
        return f"GradedHalfSpace({self.description})"

    def _moduli(self, z: ndarray) -> tuple[ndarray, ndarray]:
        """E / E0 and nu at depths."""
        nu = self.poisson(z) if callable(self.poisson) else self.poisson
        young = np.asarray(self.young(z), dtype=float)
        surface = float(np.asarray(self.young(np.zeros(1)))[0])
        if not surface > 0:
            raise ValueError(
                f"expected a positive Young's modulus at the surface, got {surface:g}: without "
                "it the settlement under a force is not finite. Remedy: a small positive value"
            )
        return young / surface, np.broadcast_to(np.asarray(nu, dtype=float), np.shape(z))

    @cached_property
    def surface(self) -> HalfSpace:
        young = float(np.asarray(self.young(np.zeros(1)))[0])
        return HalfSpace(young, float(self._moduli(np.zeros(1))[1][0]))

    @property
    def lengths(self) -> tuple[float, float]:
        return self.length, self.length

    def compliance(self, k: ndarray) -> ndarray:
        bottom = FORGOTTEN / k
        start = homogeneous(*self._moduli(bottom))
        return through_graded(start, k, 0.0, bottom, self._moduli)


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
        Young's modulus at depth z below its top is ``young (1 + gradient z)``.

    Raises
    ------
    ValueError
        If a value is out of range, or the modulus is not positive at the bottom.
    """

    thickness: float
    young: float
    poisson: float
    gradient: float = 0.0

    def __post_init__(self):
        object.__setattr__(self, "thickness", _positive("thickness", self.thickness))
        young, poisson = checked_moduli(self.young, self.poisson)
        object.__setattr__(self, "young", young)
        object.__setattr__(self, "poisson", poisson)
        object.__setattr__(self, "gradient", float(self.gradient))
        if not (isfinite(self.gradient) and 1 + self.gradient * self.thickness > 0):
            raise ValueError(
                f"expected a positive Young's modulus at the bottom of the layer, got the "
                f"gradient {self.gradient:g} over the thickness {self.thickness:g}"
            )


@dataclass(frozen=True, eq=False)
class LayeredHalfSpace(Stratified):
    """Layers, bonded to each other, on a base.

    Parameters
    ----------
    layers : sequence of Layer
        From the surface down.
    base : HalfSpace, GradedHalfSpace, "bonded" or "smooth"
        What lies below: another ground, or a rigid base to which the last layer is bonded or on
        which it slides.

    Raises
    ------
    TypeError, ValueError
        If there are no layers or the base is something else.

    Examples
    --------
    >>> rock = LayeredHalfSpace([Layer(1.0, 1.0, 0.25)], "bonded")
    >>> print(f"{rock.influence(0.5):.5f}")
    0.23967
    """

    layers: Sequence[Layer]
    base: HalfSpace | GradedHalfSpace | Literal["bonded", "smooth"]

    def __post_init__(self):
        layers = tuple(self.layers)
        if not layers or not all(isinstance(layer, Layer) for layer in layers):
            raise TypeError(f"expected a sequence of Layer, got {self.layers!r}")
        object.__setattr__(self, "layers", layers)
        if not (
            isinstance(self.base, (HalfSpace, Stratified)) or self.base in ("bonded", "smooth")
        ):
            raise TypeError(
                f'expected a substrate, "bonded" or "smooth" as the base, got {self.base!r}'
            )
        if self.base == "smooth" and layers[-1].gradient:
            raise ValueError(
                "expected a layer without gradient on a smooth rigid base, got gradient "
                f"{layers[-1].gradient:g}. Remedy: a thin homogeneous layer at the bottom"
            )

    @cached_property
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

    def compliance(self, k: ndarray) -> ndarray:
        young = self.surface.young
        if isinstance(self.base, HalfSpace):
            q = homogeneous(np.full(len(k), self.base.young / young), self.base.poisson)
            pair = as_pair(q)
        elif isinstance(self.base, Stratified):
            pair = as_pair(self.base.compliance(k) * young / self.base.surface.young)
        else:
            pair = rigid(self.base == "smooth", len(k))
        for layer in reversed(self.layers):
            ratio = layer.young / young
            if layer.gradient == 0:
                depth = k * layer.thickness
                q = through_homogeneous(pair, depth, ratio, layer.poisson)
            else:
                q = self._through(pair, k, layer, ratio)
            pair = as_pair(q)
        return q

    @staticmethod
    def _through(pair, k: ndarray, layer: Layer, ratio: float) -> ndarray:
        """Q on top of a layer with a gradient; deep waves begin inside it."""

        def moduli(z):
            return ratio * (1 + layer.gradient * z), np.broadcast_to(layer.poisson, z.shape)

        x, y = pair
        q = y @ np.linalg.inv(x)
        below = np.stack([q[:, 0, 0], q[:, 0, 1], q[:, 1, 1]])
        bottom = np.minimum(layer.thickness, FORGOTTEN / k)
        inside = homogeneous(*moduli(bottom))
        return through_graded(
            np.where(bottom < layer.thickness, inside, below), k, 0.0, bottom, moduli
        )


def _length(young: Callable, poisson: float | Callable) -> float:
    """Twice the depth at which the moduli have changed by half of all they do, or a half."""
    depth = np.concatenate([[0.0], np.logspace(-9, 9, 2001)])
    with np.errstate(all="ignore"):  # moduli out of range are refused later
        change = np.abs(np.log(np.asarray(young(depth), dtype=float)) - np.log(young(depth[:1])))
    if callable(poisson):
        change = change + 2 * np.abs(poisson(depth) - poisson(depth[:1]))
    most = np.nanmax(change)
    return 2 * float(depth[np.argmax(change >= min(0.4, most / 2))]) if most > 1e-12 else 1.0


# functions of a module, for grounds to be pickled with them
def _linear(young: float, gradient: float, z: ndarray) -> ndarray:
    return young * (1 + gradient * z)


def _exponential(young: float, ratio: float, length: float, z: ndarray) -> ndarray:
    return young * (ratio + (1 - ratio) * np.exp(-z / length))


def _power(young: float, exponent: float, offset: float, z: ndarray) -> ndarray:
    return young * (1 + z / offset) ** exponent


def _positive(name: str, value) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise TypeError(f"expected a number for {name}, got {value!r}") from None
    if not (isfinite(number) and number > 0):
        raise ValueError(f"expected a positive {name}, got {number:g}")
    return number
