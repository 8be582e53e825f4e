"""Cells on a regular grid: products with the matrix of settlements by Fourier transforms.

What a cell does to another depends on the offset between their places alone: the matrix is block
Toeplitz with Toeplitz blocks. One table of settlements by offsets tells all entries, and is the
part of a block circulant matrix, whose products are those of transforms.

Sources: C. R. Vogel, Computational Methods for Inverse Problems (2002), section 5.3, for the
embedding; S. Liu, Q. Wang and G. Liu, A versatile method of discrete convolution and FFT (DC-FFT)
for contact analyses, Wear 243 (2000), for contact.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np
import scipy
from numpy import ndarray
from numpy.lib.stride_tricks import as_strided

from ..elements.influence import influence_matrix
from ..grids.lattice import Lattice
from ..grids.partition import Partition
from ..grids.polygons import Polygons
from ..ground.periodic import PeriodicGround
from ..ground.substrates import Substrate
from ..kernels.once import computed_once
from ..kernels.threads import threads_for

#: the grid of the approximate inverse is so many times as long as the cells: what leaves it on
#: one side must not come back on the other (1.25 as good as 2, 1 takes half as many iterations
#: more)
ROOM = 1.25
#: a symbol that is dear is computed so many times an octave of wave numbers (to 1e-10) for
#: products, and for approximate inverses
FINE, COARSE = 256, 8
#: cells up to which a matrix multiplies sooner than transforms do
FEW = 256


@dataclass(frozen=True, eq=False)
class Convolution:
    """Sums over the cells of a lattice whose terms depend on offsets, even in both directions.

    Attributes
    ----------
    lattice : Lattice
        Places of the n cells.
    shape : tuple of int
        Lengths of the transforms, none less than those of the lattice.
    spectrum : (shape[0], shape[1] // 2 + 1) array of float
        Transform of the terms by offsets.
    """

    lattice: Lattice
    shape: tuple[int, int]
    spectrum: ndarray

    @computed_once
    def _few(self) -> ndarray | None:
        """The matrix, if it multiplies sooner than transforms do."""
        if len(self.lattice) > FEW:
            return None
        (nx, ny), terms = self.lattice.shape, scipy.fft.irfft2(self.spectrum, self.shape)
        return _matrix(terms[:nx, :ny], self.lattice)

    def __matmul__(self, q: ndarray) -> ndarray:
        """Sums under values ``q`` of the cells, shape (n,) or (n, k)."""
        if self._few is not None:
            return self._few @ q
        if q.ndim == 2:
            sums = np.empty(q.shape)  # of no columns, too
            for column in range(q.shape[1]):
                sums[:, column] = self.by_transforms(q[:, column])
            return sums
        return self.by_transforms(q)

    def by_transforms(self, q: ndarray) -> ndarray:
        """Sums under values ``q`` of shape (n,), however few they are."""
        (nx, ny), (mx, my) = self.lattice.shape, self.shape
        if self.lattice.full:
            grid = np.asarray(q, dtype=float).reshape(nx, ny)
        else:
            grid = np.zeros((nx, ny))
            grid.ravel()[self.lattice.places] = q
        threads = threads_for(mx * my)
        # only rows and columns that are not zero, or asked for, are transformed
        waves = scipy.fft.rfft(grid, my, axis=1, workers=threads)
        waves = scipy.fft.fft(waves, mx, axis=0, workers=threads, overwrite_x=True)
        waves *= self.spectrum
        waves = scipy.fft.ifft(waves, axis=0, workers=threads, overwrite_x=True)[:nx]
        sums = scipy.fft.irfft(waves, my, axis=1, workers=threads)[:, :ny].ravel()
        return sums if self.lattice.full else sums[self.lattice.places]


@dataclass(frozen=True, eq=False)
class BlockToeplitz:
    """Settlements of the centroids of cells on a regular grid under pressures on the cells.

    Attributes
    ----------
    lattice : Lattice
        Places of the n cells.
    entries : (nx, ny) array of float
        Settlement of a centroid under unit pressure on the cell so many places away along x and
        along y, on either side.
    convolution, inverse : Convolution
        What multiplies, and an approximate inverse of it: that of the symbol.
    """

    lattice: Lattice
    entries: ndarray
    convolution: Convolution
    inverse: Convolution

    @classmethod
    def from_substrate(cls, substrate: Substrate, lattice: Lattice) -> Self:
        """By the exact entries of a rectangle for all offsets."""
        (nx, ny), (dx, dy) = lattice.shape, lattice.spacing
        x = np.array([np.repeat(dx * np.arange(nx), ny), np.tile(dy * np.arange(ny), nx)])
        entries = influence_matrix(substrate, _rectangle(dx, dy), x).reshape(nx, ny)
        shape = _fast(2 * nx - 1), _fast(2 * ny - 1)
        threads = threads_for(shape[0] * shape[1])
        spectrum = scipy.fft.rfft2(_even(entries, shape), workers=threads, overwrite_x=True).real
        products = Convolution(lattice, shape, np.ascontiguousarray(spectrum))
        inverse = _inverse(substrate, lattice)
        entries.setflags(write=False)
        return cls(lattice, entries, products, inverse)

    @classmethod
    def from_period(cls, ground: PeriodicGround, lattice: Lattice) -> Self:
        """By the symbol of the ground at the wave numbers of the grid, which covers a period."""
        k = wave_numbers(lattice.shape, lattice.spacing)
        k[0, 0] = np.min(k[k > 0], initial=1 / max(lattice.spacing))
        symbol = symbol_on(ground.ground, k)
        inverse = Convolution(lattice, lattice.shape, 1 / symbol)
        symbol[0, 0] = 0.0
        entries = scipy.fft.irfft2(symbol, lattice.shape)
        entries.setflags(write=False)
        return cls(lattice, entries, Convolution(lattice, lattice.shape, symbol), inverse)

    @property
    def shape(self) -> tuple[int, int]:
        """Shape of the matrix."""
        return len(self.lattice), len(self.lattice)

    @property
    def singular(self) -> bool:
        """Whether uniform pressure on all cells settles nothing, by convention on a period."""
        return bool(self.convolution.spectrum[0, 0] == 0)

    @property
    def nbytes(self) -> int:
        """Bytes that are kept."""
        spectra = self.convolution.spectrum.nbytes + self.inverse.spectrum.nbytes
        return self.entries.nbytes + spectra + self.lattice.places.nbytes

    def __matmul__(self, q: ndarray) -> ndarray:
        """Settlements under pressures of shape (n,) or (n, k)."""
        return self.convolution @ q

    def rows(self, i: ndarray) -> ndarray:
        """Exact rows of the matrix, shape (len(i), n)."""
        x, y = np.divmod(self.lattice.places, self.lattice.shape[1])
        return self.entries[np.abs(x[i, None] - x), np.abs(y[i, None] - y)]

    def diagonal(self) -> ndarray:
        """Settlement of each cell under unit pressure on it, shape (n,)."""
        return np.full(len(self.lattice), self.entries[0, 0])

    def to_dense(self) -> ndarray:
        """The matrix."""
        return _matrix(self.entries, self.lattice)


def _matrix(terms: ndarray, lattice: Lattice) -> ndarray:
    """Matrix of ``terms`` by offsets, (nx, ny), between the cells of a lattice."""
    nx, ny = lattice.shape
    x, y = np.abs(np.arange(1 - nx, nx)), np.abs(np.arange(1 - ny, ny))
    offsets = terms[x[:, None], y]
    # places of cells, then of points
    dx, dy = offsets.strides
    every = as_strided(
        offsets[nx - 1 :, ny - 1 :], (nx, ny, nx, ny), (-dx, -dy, dx, dy), writeable=False
    )
    if lattice.full:
        return every.reshape(nx * ny, nx * ny)
    x, y = np.divmod(lattice.places, ny)
    return every[x[:, None], y[:, None], x, y]


def _rectangle(dx: float, dy: float) -> Partition:
    """One cell about the origin."""
    x, y = dx / 2, dy / 2
    p, offsets = np.array([[-x, x, x, -x], [-y, -y, y, y]]), np.array([0, 4])
    square = Polygons(p, np.arange(4), offsets)
    inside, outside = np.zeros(4, np.int32), np.full(4, -1, np.int32)
    facets, nodes = np.array([[0, 1, 2, 3], [1, 2, 3, 0]]), np.zeros((2, 1))
    return Partition(square, facets, np.stack([inside, outside]), nodes, outside)


def _fast(n: int) -> int:
    """Length of a fast transform of at least ``n`` values."""
    return int(scipy.fft.next_fast_len(n, real=True))


def _even(entries: ndarray, shape: tuple[int, int]) -> ndarray:
    """Entries by offsets of both signs, negative ones from the end."""
    (nx, ny), out = entries.shape, np.zeros(shape)
    out[:nx, :ny] = entries
    out[:nx, shape[1] - ny + 1 :] = entries[:, :0:-1]
    out[shape[0] - nx + 1 :] = out[nx - 1 : 0 : -1]
    return out


def _inverse(substrate: Substrate, lattice: Lattice) -> Convolution:
    """Pressures by which waves of settlements die away in a larger grid."""
    shape = tuple(_fast(int(ROOM * n)) for n in lattice.shape)
    k = wave_numbers(shape, lattice.spacing)
    k[0, 0] = np.min(k[k > 0], initial=1 / max(lattice.spacing))
    return Convolution(lattice, (shape[0], shape[1]), 1 / symbol_on(substrate, k, COARSE))


def wave_numbers(shape: tuple[int, ...], spacing: tuple[float, float]) -> ndarray:
    """Wave numbers of the real transform of a grid, shape (shape[0], shape[1] // 2 + 1)."""
    (nx, ny), (dx, dy) = shape, spacing
    return 2 * np.pi * np.hypot(scipy.fft.fftfreq(nx, dx)[:, None], scipy.fft.rfftfreq(ny, dy))


def symbol_on(substrate: Substrate, k: ndarray, density: int = FINE) -> ndarray:
    """Symbol of the ground at many positive wave numbers, by so many values an octave."""
    if substrate.remainder is None:
        return substrate.symbol(k)
    low, high = np.log2(k.min()) - 0.01, np.log2(k.max()) + 0.01
    nodes = np.linspace(low, high, max(int(density * (high - low)), 4))
    # times k it varies little
    smooth = scipy.interpolate.CubicSpline(nodes, 2**nodes * substrate.symbol(2**nodes))
    return smooth(np.log2(k)) / k


def require_period(ground: PeriodicGround, lattice: Lattice | None) -> None:
    """Refuse what is not the whole period of a ground, cut into equal rectangles."""
    if lattice is None:
        raise ValueError(
            "expected constant pressures on a regular grid of rectangles, and their centroids, on "
            'a PeriodicGround, got other cells or points. Remedy: edge="constant" and a uniform '
            "MeshQuad over a period; nothing is known off its centroids"
        )
    sides, places = np.array(lattice.shape) * lattice.spacing, int(np.prod(lattice.shape))
    if len(lattice) < places or not np.allclose(sides, ground.period, 1e-9 + lattice.blur, 0):
        raise ValueError(
            # as many digits as are compared
            "expected cells that cover the period {:.10g} x {:.10g} of the ground, got {} of {} "
            "cells on {:.10g} x {:.10g}".format(*ground.period, len(lattice), places, *sides)
        )
