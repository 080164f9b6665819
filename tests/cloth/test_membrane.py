"""One triangle of membrane: energy, gradient and Hessian against finite differences."""

import numpy as np
import pytest
import taichi as ti

from taichi_tryon.cloth import membrane

STRETCH = np.array([2392.8, 2373.2, 400.0, 77.54])
REST = np.array([[0.0, 0.0], [0.012, 0.002], [0.003, 0.011]])
HATS = np.linalg.inv(np.hstack([REST, np.ones((3, 1))]))[:2].T  # gradients of the three hats


def energy(x: np.ndarray) -> float:
    f = np.einsum("ik,ia->ak", x, HATS)
    e = np.array([(f[0] @ f[0] - 1) / 2, (f[1] @ f[1] - 1) / 2, f[0] @ f[1]])
    c = STRETCH
    return 0.5 * (c[0] * e[0] ** 2 + c[1] * e[1] ** 2 + 2 * c[2] * e[0] * e[1] + c[3] * e[2] ** 2)


@ti.kernel
def derivatives(
    x: ti.types.ndarray(), hats: ti.types.ndarray(), c: ti.types.ndarray(), clamp: int,
    gradient: ti.types.ndarray(), hessian: ti.types.ndarray(),
):  # fmt: skip
    for _ in range(1):
        f1, f2 = ti.Vector([0.0, 0.0, 0.0]), ti.Vector([0.0, 0.0, 0.0])
        for i in ti.static(range(3)):
            point = ti.Vector([x[i, 0], x[i, 1], x[i, 2]])
            f1 += point * hats[i, 0]
            f2 += point * hats[i, 1]
        stretch = ti.Vector([c[0], c[1], c[2], c[3]])
        s = membrane.stress(stretch, membrane.strain(f1, f2))
        tension = membrane.tension_only(s) if clamp == 1 else s
        for i in ti.static(range(3)):
            gi = ti.Vector([hats[i, 0], hats[i, 1]])
            g = membrane.gradient(s, f1, f2, gi)
            for k in ti.static(range(3)):
                gradient[i, k] = g[k]
            for j in ti.static(range(3)):
                block = membrane.hessian(stretch, tension, f1, f2, gi, ti.Vector([hats[j, 0], hats[j, 1]]))
                for k in ti.static(range(3)):
                    for m in ti.static(range(3)):
                        hessian[3 * i + k, 3 * j + m] = block[k, m]


def evaluate(x, clamp=0):
    gradient, hessian = np.zeros((3, 3)), np.zeros((9, 9))
    derivatives(x, HATS, STRETCH, clamp, gradient, hessian)
    return gradient, hessian


def deformed(seed: int, scale: float = 1.0) -> np.ndarray:
    noise = np.random.default_rng(seed).normal(size=(3, 3)) * 1e-3
    return np.hstack([REST, np.zeros((3, 1))]) * scale + noise


@pytest.mark.parametrize("seed", range(4))
def test_gradient(seed):
    x, eps = deformed(seed), 1e-7
    gradient, _ = evaluate(x)
    for i in range(3):
        for k in range(3):
            d = np.zeros((3, 3))
            d[i, k] = eps
            assert gradient[i, k] == pytest.approx((energy(x + d) - energy(x - d)) / (2 * eps), rel=1e-5, abs=1e-3)


@pytest.mark.parametrize("seed", range(4))
def test_hessian(seed):
    x, eps = deformed(seed), 1e-7
    _, hessian = evaluate(x)
    for i in range(9):
        d = np.zeros(9)
        d[i] = eps
        slope = (evaluate(x + d.reshape(3, 3))[0] - evaluate(x - d.reshape(3, 3))[0]).ravel() / (2 * eps)
        assert hessian[i] == pytest.approx(slope, rel=1e-5, abs=1e-6 * np.abs(hessian).max())


@pytest.mark.parametrize("scale", [0.3, 0.8, 1.0, 1.5])
def test_clamped_hessian_is_positive_semidefinite_and_exact_in_tension(scale):
    x = deformed(1, scale)
    hessian = evaluate(x, clamp=1)[1]
    eigenvalues = np.linalg.eigvalsh(hessian)
    assert eigenvalues.min() > -1e-9 * eigenvalues.max()
    if scale > 1.2:
        assert hessian == pytest.approx(evaluate(x)[1], rel=1e-12)


def test_rigid_motion_stores_nothing():
    angle = 0.7
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    gradient, _ = evaluate(np.hstack([REST, np.zeros((3, 1))]) @ turn.T + 0.3)
    assert np.abs(gradient).max() < 1e-7
