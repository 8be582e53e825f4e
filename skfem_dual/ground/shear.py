"""Influence of horizontal forces on the surface of stratified ground, in tables over r.

Waves of horizontal traction consist of a part along their way, with the compliance Q11, and one
across it, with S; Q12 couples the first to vertical motions. A unit force along x displaces, t
being the direction from it and all kernels over 2 pi E0::

    ux = A + B cos 2t,    uy = B sin 2t,    uz = C cos t,
    A = int (Q11 + S) / 2 J0(kr) dk,    B = int (S - Q11) / 2 J2(kr) dk,    C = -int Q12 J1(kr) dk.

As in `stratified` the homogeneous half-space with the moduli of the surface is split off. Bessel
functions of higher order follow from the first one, with G the integral of F J0(kr)::

    int F J2(kr) dk = 2 / r^2 int_0^r G r dr - G,    int F / k J1(kr) dk = 1 / r int_0^r G r dr.

Source: E. Kausel, Fundamental Solutions in Elastodynamics (2006), chapter 10, for horizontal
loads on layers by waves of two kinds.
"""

from collections.abc import Callable
from typing import NamedTuple, Self

import numpy as np
from numpy import ndarray

from .compliance import homogeneous, homogeneous_across
from .hankel import RadialTable, SquareTable
from .symbols import wave_numbers

#: compliances Q11, Q12, Q22 and S at wave numbers, (4, n)
Compliances = Callable[[ndarray], ndarray]


class ShearTable(NamedTuple):
    """What kernels have beyond those of the surface's half-space, times E0, over r^2.

    Attributes
    ----------
    coefficients : (panels, SQUARES + 1, 4) array of float
        As of `SquareTable`: of A, B, C and the settlement under a vertical force.
    first : int
        Leading bits of the first panel.
    nearest, farthest : float
        The range of distances.
    """

    coefficients: ndarray
    first: int
    nearest: float
    farthest: float

    @classmethod
    def from_compliances(
        cls,
        compliances: Compliances,
        settlement: RadialTable,
        poisson: float,
        lengths: tuple[float, float],
        algebraic: bool,
    ) -> Self:
        """Of a ground with this Poisson's ratio at the surface.

        ``settlement`` is its table for vertical forces; other arguments as of
        `RadialTable.from_values`.
        """
        k = wave_numbers(lengths)
        alone = np.append(homogeneous(1.0, poisson), homogeneous_across(1.0, poisson))
        q11, q12, _, s = compliances(k) - alone[:, None]
        even = RadialTable.from_values((q11 + s) / 2, lengths, algebraic)
        odd = RadialTable.from_values((s - q11) / 2, lengths, algebraic)
        coupling = RadialTable.from_values(-k * q12, lengths, algebraic, -1)

        def second(r: ndarray) -> ndarray:
            return 2 * odd.evaluate(odd.primitive_over_r, r) / r - odd.evaluate(odd.omega, r)

        kernels: list[Callable[[ndarray], ndarray]] = [
            lambda r: even.evaluate(even.omega, r),
            second,
            lambda r: coupling.evaluate(coupling.primitive_over_r, r),
        ]
        ends = settlement.nearest, settlement.farthest
        found = [SquareTable.from_function(f, *ends) for f in kernels]
        found.append(settlement.squares[0])
        coefficients = np.stack([f.coefficients for f in found], axis=-1)
        return cls(np.ascontiguousarray(coefficients), found[0].first, *ends)
