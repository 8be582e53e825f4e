import numpy as np
import pytest
from scipy.integrate import quad

from skfem_dual.contact import exact


def test_circle():
    # references: P = E a^2, nu = 1/4 gives W/a = 0.46875
    assert exact.circle_settlement(4.0, 2.0, 1.0, 0.25) / 2.0 == pytest.approx(0.46875)
    force, _ = quad(
        lambda s: 2 * np.pi * 2 * s * 2 * exact.circle_pressure([2 * s, 0.0], 3.0, 2.0),
        0,
        1,
    )
    assert force == pytest.approx(3.0)
    assert exact.circle_pressure([[0.0, 2.0, 3.0], [0.0, 0.0, 0.0]], 1.0, 2.0) == pytest.approx(
        [1 / (8 * np.pi), np.inf, 0.0]
    )


def test_moment_of_the_circle():
    """Lift-off starts at e = a/3, and M is the first moment of the pressure."""
    at_edge = exact.circle_pressure([-0.999999, 0.0], 1.0, 1.0, (1 / 3, 0.0))
    assert at_edge < 1e-3 * exact.circle_pressure([0.0, 0.0], 1.0, 1.0)

    def ring(s):  # r = sin(s) takes the singularity away
        r, t = np.sin(s), np.linspace(0, 2 * np.pi, 33)[:-1]
        x = np.stack([r * np.cos(t), r * np.sin(t)])
        return np.mean(exact.circle_pressure(x, 1.0, 1.0, (0.2, 0.0)) * x[0]) * np.cos(s) * r

    moment, _ = quad(lambda s: 2 * np.pi * ring(s), 0, np.pi / 2)
    assert moment == pytest.approx(0.2)
    assert exact.circle_tilt(0.2, 1.0, 1.0, 0.0) == pytest.approx(0.15)


def test_ellipse():
    circle = exact.circle_settlement(1.0, 2.0, 3.0, 0.2)
    assert exact.ellipse_settlement(1.0, (2.0, 2.0), 3.0, 0.2) == pytest.approx(circle)
    assert exact.ellipse_settlement(1.0, (1.0, 2.0), 3.0, 0.2) == pytest.approx(
        exact.ellipse_settlement(1.0, (2.0, 1.0), 3.0, 0.2)
    )
    assert exact.ellipse_pressure([[0.0, 0.5], [0.0, 0.5]], 1.0, (2.0, 2.0)) == pytest.approx(
        exact.circle_pressure([[0.0, 0.5], [0.0, 0.5]], 1.0, 2.0)
    )
    assert exact.ellipse_pressure([0.0, 1.5], 1.0, (2.0, 1.0)) == 0.0


def test_one_load():
    with pytest.raises(TypeError, match="a number for force"):
        exact.circle_pressure([0.0, 0.5], [1.0, 2.0, 3.0], 2.0)
    with pytest.raises(TypeError, match="a number for pressure"):
        exact.uniform_circle_displacement([0.0, 0.5], [], 1.0, 1.0, 0.0)


def test_uniform_circle():
    """Centre 2 q a / E*, edge 4 q a / (pi E*), far away a force."""
    w = exact.uniform_circle_displacement([0.0, 2.0, 2e3], 3.0, 2.0, 1.0, 0.0)
    assert w[:2] == pytest.approx([12.0, 24 / np.pi])
    assert w[2] == pytest.approx(3 * 4 * np.pi / (np.pi * 2e3), rel=1e-5)


def test_sphere_and_cone_carry_their_load():
    """Pressures integrate to the force; radius and approach are those of Johnson."""
    force, young, poisson = 2.0, 3.0, 0.3
    modulus = young / (1 - poisson**2)
    for name, shape in (("hertz", 1.7), ("cone", 0.4)):
        radius = getattr(exact, f"{name}_radius")(force, shape, young, poisson)
        pressure = getattr(exact, f"{name}_pressure")
        r = np.linspace(0, 1.2 * radius, 200001)[1:]
        p = pressure(np.stack([r, 0 * r]), force, shape, young, poisson)
        assert np.trapezoid(2 * np.pi * r * p, r) == pytest.approx(force, rel=1e-5)
        assert (p[r > radius] == 0).all()
        approach = getattr(exact, f"{name}_approach")(force, shape, young, poisson)
        if name == "hertz":
            assert radius**3 == pytest.approx(3 * force * shape / (4 * modulus))
            assert approach == pytest.approx(radius**2 / shape)
        else:
            assert force == pytest.approx(np.pi * radius**2 * modulus * np.tan(shape) / 2)
            assert approach == pytest.approx(np.pi * radius * np.tan(shape) / 2)


@pytest.mark.parametrize("name", ["hertz", "cone"])
def test_no_pressure_without_a_force(name):
    with pytest.raises(ValueError, match=r"force above 0|positive force"):
        getattr(exact, f"{name}_pressure")([[0.0, 1.0], [0.0, 0.0]], 0.0, 0.1, 1.0, 0.0)


def test_far_from_a_circle_and_of_slender_ellipses():
    """A point force, and the logarithm of the aspect ratio, to all digits."""
    r = np.geomspace(1e3, 1e9, 7)
    far = exact.uniform_circle_displacement(r, 1.0, 1.0, young=1.0, poisson=0.0)
    np.testing.assert_allclose(far, (1 + 1 / (8 * r**2)) / r, rtol=1e-11)
    near = exact.uniform_circle_displacement([1.0, 1.0 + 1e-9], 1.0, 1.0, young=1.0, poisson=0.0)
    assert near[1] == pytest.approx(near[0], rel=1e-7)
    for ratio in (1e-5, 1e-9, 1e-12):
        found = exact.ellipse_settlement(1.0, (1.0, ratio), 1.0, 0.0)
        assert found == pytest.approx(np.log(4 / ratio) / np.pi, rel=1e-9)
