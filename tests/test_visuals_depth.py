"""Pictures of the ground in depth show the numbers they are given."""

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
import pytest
from plans import disc

from skfem_dual import (
    DualMesh,
    HalfSpace,
    Layer,
    LayeredHalfSpace,
    RigidPunch,
    vertical_profile,
    vertical_section,
)
from skfem_dual.visuals.matplotlib import draw_interfaces, isobars, plot_profile


@pytest.fixture(scope="module")
def solution():
    ground = LayeredHalfSpace([Layer(0.7, 5.0, 0.2)], HalfSpace(1.0, 0.45))
    return RigidPunch(ground, DualMesh.from_mesh(disc(2)).basis()).solve(1.0)


@pytest.fixture(autouse=True)
def closed():
    yield
    plt.close("all")


def test_profile_by_layers(solution):
    depths = [1.5, 0.3, 0.7, 0.7001]
    profile = vertical_profile(solution, (0.2, 0.1), depths)
    axes = plot_profile(profile, title="below a footing").figure.axes
    values = [np.array(profile.stresses)[2], profile.strain, profile.displacement[2]]
    for ax, expected in zip(axes, values, strict=True):
        upper, lower = ax.lines[0], ax.lines[1]
        assert (upper.get_ydata() == [0.3, 0.7]).all()
        assert (upper.get_xdata() == expected[[1, 2]]).all()
        assert (lower.get_ydata() == [0.7001, 1.5]).all()
        assert (lower.get_xdata() == expected[[3, 0]]).all()
        assert any(list(line.get_ydata()) == [0.7, 0.7] for line in ax.lines[2:])
    assert axes[0].get_ylim() == (1.5, 0.0)


def test_interfaces_in_a_section(solution):
    basis, values = vertical_section(solution, (-1.0, 0.0), (1.0, 0.0), 1.0, n=8)
    ax = isobars(basis, values)
    before = len(ax.lines)
    draw_interfaces(ax, np.array([0.7, 2.0]))
    (line,) = ax.lines[before:]
    assert (np.array(line.get_ydata()) == -0.7).all()


def test_errors(solution):
    with pytest.raises(TypeError, match=r"Profile for profile, got .*Remedy: make one"):
        plot_profile(solution)
    with pytest.raises(ValueError, match="at least 2 depths to plot, got 1"):
        plot_profile(vertical_profile(solution, (0.0, 0.0), [1.0]))
    with pytest.raises(TypeError, match="Axes for ax, got None"):
        draw_interfaces(None, [1.0])


def test_layers_with_one_depth_have_a_point(solution):
    """A line of one point would not be seen."""
    profile = vertical_profile(solution, (0.2, 0.1), [0.3, 1.5, 2.0])
    axes = plot_profile(profile).figure.axes
    pieces = [line for line in axes[1].lines if profile.strain[0] in line.get_xdata()]
    assert [line.get_marker() for line in pieces] == ["."]
