"""Weights given by hand or found from the data: generalised cross-validation."""

from collections.abc import Callable

import numpy as np
from numpy import ndarray
from scipy.linalg import eigvalsh

from ..arguments import LARGEST, checked_number, checked_pair
from ..messages import shown
from .functional import LAST, CoupleFunctional, Neighbours, Weights

#: weights by hand, the paper's pair (W1, W2) with B = 16, or the name of a rule
Choice = Weights | tuple[float, float] | str
#: ratios D : A that are tried, from hardly any smoothing to an almost harmonic field
RATIOS = 2.0 ** np.arange(-6, 13)
#: up to so many values the trace is that of eigenvalues; of more it is estimated
EXACT = 1_500
#: random signs used for the estimate, at least this many
SIGNS = 4_000


def smoothing_weights(ratio: float) -> Weights:
    """The one-parameter family A1 = A2 = 1, D1 = D2 = ``ratio``."""
    return Weights(1.0, 1.0, D1=ratio, D2=ratio)


def gcv_weights(neighbours: Neighbours, F: ndarray, G: ndarray) -> Weights:
    """The weights that generalised cross-validation chooses for values with random errors.

    In the family A1 = A2 = 1, D1 = D2 = t the score ``|y - S y|^2 / (1 - tr(S)/n)^2`` is
    minimised, where ``y`` holds the n old values and ``S`` takes them to the new ones (Golub,
    Heath and Wahba, Technometrics 21 (1979) 215-223). The errors should be independent, with
    one spread on both grids. Of more than `EXACT` values the trace is estimated with random signs
    (Hutchinson), the same ones for every t: their error then hardly moves the minimum. They are
    given out in the order of smoothed values, so that the numbers of the nodes do not matter.

    Parameters
    ----------
    neighbours : Neighbours
        The couple of grids.
    F, G : (M,) and (N,) array of float, or (M, k) and (N, k)
        Old values; k couples of them share one choice.

    Returns
    -------
    Weights
    """
    F, G = np.asarray(F, dtype=float), np.asarray(G, dtype=float)
    n = sum(neighbours.alpha.shape)
    size = max(np.abs(F).max(initial=0.0), np.abs(G).max(initial=0.0))
    if size > 0:  # squares neither vanish nor grow beyond all numbers
        F, G = F / size, G / size
    trace = _trace(neighbours) if n <= EXACT else _estimate(neighbours, F, G)

    def score(log_ratio: float) -> float:
        functional = CoupleFunctional(neighbours, smoothing_weights(2.0**log_ratio))
        residual = sum(
            np.sum((old - new) ** 2)
            for old, new in zip((F, G), functional.minimise(F, G), strict=True)
        )
        return float(residual / (1 - trace(functional) / n) ** 2)

    logs = np.log2(RATIOS)
    scores = [score(x) for x in logs]
    best = int(np.argmin(scores))
    if 0 < best < len(logs) - 1:  # the vertex of the parabola through three scores
        below, least, above = scores[best - 1 : best + 2]
        shift = (below - above) / (2 * (below - 2 * least + above)) if below > least else 0.0
        return smoothing_weights(2.0 ** float(logs[best] + shift))
    return smoothing_weights(2.0 ** float(logs[best]))


def _trace(neighbours: Neighbours) -> Callable[[CoupleFunctional], float]:
    # S is the inverse of 1 + t L with one matrix L for all t
    unit = CoupleFunctional(neighbours, smoothing_weights(1.0)).matrix.toarray()
    values = eigvalsh(unit, overwrite_a=True, check_finite=False) - 1
    return lambda functional: float(np.sum(1 / (1 + functional.weights.D1 * values)))


def _estimate(
    neighbours: Neighbours, F: ndarray, G: ndarray
) -> Callable[[CoupleFunctional], float]:
    # values as smooth as they may become: without contact many are equal before
    most = CoupleFunctional(neighbours, smoothing_weights(float(RATIOS[-1])))
    values = np.abs(np.concatenate(most.minimise(F, G)))
    n = len(values)
    signs = np.empty((n, -(-SIGNS // n) + 3))
    order = np.lexsort(values.reshape(n, -1).T)
    signs[order] = np.random.default_rng(0).choice([-1.0, 1.0], signs.shape)

    def trace(functional: CoupleFunctional) -> float:
        first = functional.neighbours.alpha.shape[0]
        smoothed = np.concatenate(functional.minimise(signs[:first], signs[first:]))
        return float(np.sum(signs * smoothed) / signs.shape[1])

    return trace


def chosen(weights: Choice, neighbours: Neighbours, F: ndarray, G: ndarray) -> tuple[Weights, str]:
    """Weights given or found, and how, for old values F and G.

    Raises
    ------
    TypeError, ValueError
        If they are neither `Weights` nor a pair nor ``"gcv"``, or one is out of range.
    """
    if isinstance(weights, Weights):
        return weights, "weights given"
    if isinstance(weights, str):
        if weights == "gcv":
            return gcv_weights(neighbours, F, G), "generalised cross-validation"
        raise ValueError(
            f'expected the name of a rule for weights, such as "gcv", got {shown(weights)}'
        )
    try:
        old, new = checked_pair("weights", weights)
    except (TypeError, ValueError):
        raise TypeError(
            f"expected weights as a pair W1, W2 or Weights, got {shown(weights)}"
        ) from None
    checked_number("weights[0]", old, above=0, at_most=LARGEST)
    checked_number("weights[1]", new, at_least=0, at_most=LARGEST / LAST["sums"])
    return Weights.init_paper(old, new), "W1, W2 given, B = 16, D = 16 W2"
