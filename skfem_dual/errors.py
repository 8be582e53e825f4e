"""Errors and warnings of the package."""


class MeshError(ValueError):
    """A mesh or partition that cannot be used; names the first offenders and the remedy."""


class MeshWarning(UserWarning):
    """Something in a mesh file was left out or changed on reading."""


class ConvergenceError(RuntimeError):
    """A system of equations that could not be solved, with the likely cause."""


class ConvergenceWarning(UserWarning):
    """An answer that is returned with ``success=False``."""


class ResolutionWarning(UserWarning):
    """Cells too coarse for the ground or for the contact; the answer is returned all the same."""
