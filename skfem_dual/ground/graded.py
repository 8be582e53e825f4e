"""Half-spaces whose moduli vary smoothly with depth."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy import ndarray

from ..arguments import called, checked_number, checked_size, checked_text
from ..errors import ConvergenceError
from ..kernels.once import computed_once
from ..messages import shown
from .strata import Strata, Stratum
from .stratified import Stratified
from .substrates import HalfSpace, checked_moduli
from .symbols import off_tail

#: lengths that are tried, each a quarter of that before, and what waves that are shorter may have
#: beside the tail of a symbol
SHORTER, NEGLIGIBLE = 16, 1e-7


@dataclass(frozen=True, repr=False)
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
    TypeError
        If an argument is of another kind, or a function returns something else than numbers.
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

    def __post_init__(self) -> None:
        object.__setattr__(self, "length", checked_size("length", self.length))
        _require_profile(self.young, self.poisson)
        checked_text("description", self.description)
        depth = self._depths(2001)
        self._require(depth, *self._moduli(depth))
        _ = self._first

    @classmethod
    def init_linear(cls, young: float, poisson: float, gradient: float) -> Self:
        """``E = young (1 + gradient z)``; the paper's B / h is ``gradient``.

        Parameters
        ----------
        young, poisson : float
            Young's modulus at the surface, Poisson's ratio.
        gradient : float
            What the modulus grows by over a unit of depth, as a part of ``young``: one over a
            length, positive.

        Raises
        ------
        TypeError, ValueError
            If an argument is no such number.
        """
        young, poisson = checked_moduli(young, poisson)
        gradient = checked_size("gradient", gradient)
        return cls(
            _Linear(young, gradient),
            poisson,
            1 / gradient,
            f"E = {young:g} (1 + {gradient:g} z), nu = {poisson:g}",
        )

    @classmethod
    def init_exponential(cls, young: float, poisson: float, ratio: float, length: float) -> Self:
        """``E = young (ratio + (1 - ratio) exp(-z / length))``.

        Parameters
        ----------
        young, poisson : float
            Young's modulus at the surface, Poisson's ratio.
        ratio : float
            The modulus in great depth over ``young``, positive.
        length : float
            Depth over which the difference falls to 1 / e of itself, positive.

        Raises
        ------
        TypeError, ValueError
            If an argument is no such number.
        """
        young, poisson = checked_moduli(young, poisson)
        ratio, length = checked_size("ratio", ratio), checked_size("length", length)
        return cls(
            _Exponential(young, ratio, length),
            poisson,
            length / max(1.0, ratio - 1.0),  # by the slope at the surface
            f"E from {young:g} to {ratio * young:g} over {length:g}, nu = {poisson:g}",
        )

    @classmethod
    def init_power(cls, young: float, poisson: float, exponent: float, offset: float) -> Self:
        """``E = young (1 + z / offset)^exponent``, positive at the surface.

        Parameters
        ----------
        young, poisson : float
            Young's modulus at the surface, Poisson's ratio.
        exponent : float
            Between 0 and 2, neither of them.
        offset : float
            A length, positive.

        Raises
        ------
        TypeError, ValueError
            If an argument is no such number.
        """
        young, poisson = checked_moduli(young, poisson)
        offset = checked_size("offset", offset)
        exponent = checked_number("exponent", exponent, above=0, below=2)
        return cls(
            _Power(young, exponent, offset),
            poisson,
            offset,
            f"E = {young:g} (1 + z / {offset:g})^{exponent:g}, nu = {poisson:g}",
        )

    @classmethod
    def init_profile(
        cls, young: Callable, poisson: float | Callable, length: float | None = None
    ) -> Self:
        """Any smooth moduli.

        Kinks and steps, as of measured values between which a function interpolates, make its
        table take tens of seconds: as `Layer`, with gradients, the same ground takes one.

        Parameters
        ----------
        young, poisson : callable, float or callable
            As of the class.
        length : float, optional
            Depth over which they vary by a sizeable part; found by default. What one that is too
            long leaves out, `error` tells; above 1e-4 the ground is refused where it is used.

        Raises
        ------
        TypeError, ValueError
            If a profile is no function that returns a number for each depth, or out of range.
        """
        _require_profile(young, poisson)
        if length is not None:
            return cls(young, poisson, length)
        longest = cls(young, poisson, _length(young, poisson))
        for power in range(SHORTER):  # short waves see what varies by little near the surface
            found = replace(longest, length=longest.length / 4**power)
            try:
                if off_tail(found._rest, found.length) <= NEGLIGIBLE:
                    return found
            except ConvergenceError:  # of steps, which is told where the ground is used
                break
        return longest

    def __repr__(self) -> str:
        return f"GradedHalfSpace({self.description})"

    def __hash__(self) -> int:
        return hash((self.length, self.description))  # functions need not have a hash

    def _moduli(self, z: ndarray) -> tuple[ndarray, ndarray]:
        """E / E0 and nu at depths."""
        nu = _values("poisson", self.poisson, z)
        young = _values("young", self.young, z)
        return young / self._at_surface, nu

    def _acting(self, z: ndarray) -> tuple[ndarray, ndarray]:
        """The same where integrals ask for them, which may be between depths looked at."""
        ratio, nu = self._moduli(z)
        self._require(z, ratio, nu)
        return ratio, nu

    def _require(self, depth: ndarray, ratio: ndarray, nu: ndarray) -> None:
        """Refuse moduli out of range."""
        young = ratio * self._at_surface
        for what, values, good, span in (
            ("young", young, np.isfinite(young) & (young > 0), "positive"),
            ("poisson", nu, (nu >= 0) & (nu <= 0.5), "from 0 to 0.5"),
        ):
            if not good.all():
                i = np.argmin(good)
                raise ValueError(
                    f"expected {what} {span} at all depths, got {values[i]:g} at depth "
                    f"{depth[i]:g}. Remedy: a profile that ends in a constant, such as "
                    "np.interp(z, depths, values)"
                )

    def _depths(self, n: int) -> ndarray:
        """The surface and n depths."""
        return self.length * np.concatenate([[0.0], np.logspace(-6, 6, n)])

    @computed_once
    def _first(self) -> tuple[ndarray, ndarray]:
        """What they were at some depths when the ground was made."""
        return self._moduli(self._depths(49))

    @computed_once
    def _at_surface(self) -> float:
        """Young's modulus at the surface."""
        young = float(_values("young", self.young, np.zeros(1))[0])
        if not young > 0:
            raise ValueError(
                f"expected a positive Young's modulus at the surface, got {young:g}: without "
                "it the settlement under a force is not finite. Remedy: a small positive value"
            )
        return young

    @computed_once
    def surface(self) -> HalfSpace:
        return HalfSpace(self._at_surface, float(self._moduli(np.zeros(1))[1][0]))

    @property
    def lengths(self) -> tuple[float, float]:
        return self.length, self.length

    @property
    def strata(self) -> Strata:
        if not np.array_equal(self._moduli(self._depths(49)), self._first, equal_nan=True):
            raise ValueError(
                "expected moduli that stay as they were when the ground was made, got functions "
                "that tell others now; likely cause: a variable of a loop. Remedy: its value as a "
                "default, lambda z, k=k: ..."
            )
        return Strata((Stratum(np.inf, self._acting, False),), None)


def _require_profile(young: Callable, poisson: float | Callable) -> None:
    """Refuse moduli that are no functions of depth."""
    if not callable(young) or isinstance(young, type):
        raise TypeError(
            f"expected a function of depths for young, got {shown(young)}. Remedy: HalfSpace for "
            "a modulus that does not vary"
        )
    if not callable(poisson) or isinstance(poisson, type):
        checked_number("poisson", poisson)


def _values(name: str, profile: float | Callable, z: ndarray) -> ndarray:
    """A modulus at depths, which are the function's to read, also where it is not finite."""
    z = z.view()
    z.flags.writeable = False
    values = np.asarray(called(name, profile, z) if callable(profile) else profile)
    if values.dtype.kind not in "iuf" or values.shape not in ((), z.shape):
        raise TypeError(
            f"expected {name} as a function that returns one number for each depth, got "
            f"{shown(values)} for {len(z)} depths"
        )
    if values.dtype.kind == "f" and values.dtype.itemsize < 8:
        raise TypeError(
            f"expected {name} in double precision, got {values.dtype}, by whose rounding it would "
            "take minutes. Remedy: astype(float) of what the function interpolates, before it does"
        )
    values = np.asarray(values, dtype=float)
    return values if values.shape == z.shape else np.full(z.shape, values)


def _length(young: Callable, poisson: float | Callable) -> float:
    """Twice the depth at which the moduli have changed by half of all they do, or a half."""
    depth = np.concatenate([[0.0], np.logspace(-9, 9, 2001)])
    with np.errstate(all="ignore"):  # moduli out of range are refused later
        modulus, nu = _values("young", young, depth), _values("poisson", poisson, depth)
        change = np.abs(np.log(modulus) - np.log(modulus[0]))
        change = change + 2 * np.abs(nu - nu[0])
        change[np.isnan(change)] = 0.0
    most = change.max()
    return 2 * float(depth[np.argmax(change >= min(0.4, most / 2))]) if most > 1e-12 else 1.0


# objects with numbers, not functions: grounds that are made twice or pickled are equal
@dataclass(frozen=True)
class _Linear:
    young: float
    gradient: float

    def __call__(self, z: ndarray) -> ndarray:
        return self.young * (1 + self.gradient * z)


@dataclass(frozen=True)
class _Exponential:
    young: float
    ratio: float
    length: float

    @np.errstate(under="ignore")
    def __call__(self, z: ndarray) -> ndarray:
        return self.young * (self.ratio + (1 - self.ratio) * np.exp(-z / self.length))


@dataclass(frozen=True)
class _Power:
    young: float
    exponent: float
    offset: float

    def __call__(self, z: ndarray) -> ndarray:
        return self.young * (1 + z / self.offset) ** self.exponent
