"""A small sheet that steps over a floor and a ball, made once; every test gets it lying flat in free air, at rest."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import scipy.sparse as sp
import taichi as ti

from taichi_tryon import fields
from taichi_tryon.cloth.model import Cloth
from taichi_tryon.solver.implicit import ImplicitStep, StepSettings
from taichi_tryon.solver.matrix import ORDER
from taichi_tryon.timing import Stopwatch

GRAVITY = np.array([0.0, -9.81, 0.0])
EXACT = StepSettings(
    tolerance=1e-7, max_newton_iterations=60, linear_tolerance=1e-6, max_linear_iterations=2000, longest_move=0.1
)
CONTACT = SimpleNamespace(stiffness=1e7, thickness=5e-4, friction=0.3)
LAYERS = SimpleNamespace(stiffness=1e8, thickness=1e-3, friction=0.3)


@pytest.fixture(scope="session")
def contact():
    return CONTACT


@pytest.fixture(scope="session")
def level(sheet):
    """Makes positions (nv, 3) of the sheet lying level at a height [m], its middle over the origin."""
    points = sheet.points - sheet.points.mean(axis=0)
    return lambda height: np.column_stack([points[:, 0], np.full(len(points), height), -points[:, 1]])


@pytest.fixture(scope="session")
def _stepper(cloth, level, floor_and_ball_field):
    laws = (CONTACT.stiffness, CONTACT.thickness, CONTACT.friction)
    return ImplicitStep(cloth, floor_and_ball_field, level(5.0), laws, GRAVITY, EXACT, Stopwatch())


def at_rest(step, positions, **others) -> dict[str, np.ndarray]:
    """State of a stepper before its first step, ``others`` being not as at rest."""
    zero = {name: np.zeros_like(values) for name, values in step.state().items()}
    return {**zero, "along": np.ones_like(zero["along"]), "positions": positions, **others}


@pytest.fixture(scope="session", name="at_rest")
def _at_rest():
    return at_rest


@pytest.fixture
def stepper(_stepper, level, cloth):
    """The sheet at rest 5 m up, all vertices free, its linear and Newton's tolerances tight."""
    s, nv = _stepper, cloth.vertex_count
    s.restore(at_rest(s, level(5.0)))
    s.gravity[None] = GRAVITY
    s.contact.friction[None] = CONTACT.friction
    s.settings = EXACT
    fields.upload(s.free, np.ones((nv, 3)))
    return s


@ti.data_oriented
class Forces:
    """Forces of the laws on the vertices of a stepper, gathered anew."""

    def __init__(self, stepper):
        self.elastic, self.contact, self.x = stepper.elastic, stepper.contact, stepper.x
        self.f = ti.Vector.field(3, float, shape=stepper.nv)

    @ti.kernel
    def _gather(self):
        for i in self.f:
            self.f[i] = self.elastic.force(i) + self.contact.force(i)

    def at(self, positions) -> np.ndarray:
        self.x.from_numpy(positions)
        self.elastic.evaluate(0.0)
        self.contact.evaluate()
        self._gather()
        return self.f.to_numpy()


@pytest.fixture(scope="session")
def forces(_stepper):
    return Forces(_stepper)


@pytest.fixture(scope="session")
def make_forces():
    """Makes the ``Forces`` of a stepper."""
    return Forces


@pytest.fixture(scope="session")
def settings():
    return EXACT


@pytest.fixture(scope="session")
def unpacked():
    """Takes the 3x3 blocks (n, 3, 3) out of a field of packed ones."""
    place = [ORDER.index((k, m)) for k in range(3) for m in range(3)]
    return lambda field: field.to_numpy().astype(float)[:, place].reshape(-1, 3, 3)


@pytest.fixture(scope="session")
def as_sparse(unpacked):
    """Turns an assembled Matrix into one of SciPy's (3 nv, 3 nv), held vertices included."""

    def convert(matrix) -> sp.csr_matrix:
        nv = matrix.nv
        rows, columns = (np.r_[part, np.arange(nv)] for part in matrix.pattern())
        blocks = np.concatenate([unpacked(matrix.block), unpacked(matrix.diagonal)])
        if matrix.bending.constant:
            rows, columns = np.r_[rows, matrix.far_rows], np.r_[columns, matrix.far_columns]
            far = matrix.far_value.to_numpy()[: len(matrix.far_rows), None, None]
            blocks = np.concatenate([blocks, far * np.eye(3)])
        i = 3 * rows[:, None, None] + np.arange(3)[:, None] + np.zeros((3, 3), int)
        j = 3 * columns[:, None, None] + np.arange(3)[None, :] + np.zeros((3, 3), int)
        return sp.csr_matrix((blocks.ravel(), (i.ravel(), j.ravel())), shape=(3 * nv, 3 * nv))

    return convert


@pytest.fixture
def on_the_floor(stepper, level):
    """Positions of the sheet stretched by 2 and 3 % on the floor, 0.1 mm deep in the contact, part of it slipping."""
    positions = level(CONTACT.thickness - 1e-4) * [1.02, 1, 1.03]
    stepper.x.from_numpy(positions)
    stepper.x_start.from_numpy(positions - np.array([1, 0, 1]) * 5e-4 * positions[:, :1])
    stepper.elastic.begin_step()
    stepper.elastic.evaluate(0.0)
    stepper.contact.evaluate()
    stepper.contact.bind(0, 0.0)
    return positions


@pytest.fixture(scope="session")
def two_sheets(make_sheet, moduli, floor_and_ball_field):
    """Two strips of 10 by 6 cm, high over floor and ball, that feel each other, and their common stepper; names of the
    kernels that were compiled after its start, when they met first."""
    sheet = make_sheet(0.1, 0.06, 0.02)
    cloth = Cloth.join([(sheet, moduli)] * 2)
    flat = sheet.points - 0.5 * sheet.points.max(axis=0)
    flat = np.column_stack([flat[:, 0], np.full(len(flat), 5.0), -flat[:, 1]])
    positions = np.concatenate([flat, flat + [0, 0.5, 0]])
    laws = (CONTACT.stiffness, CONTACT.thickness, CONTACT.friction)
    layers = (LAYERS.stiffness, LAYERS.thickness, LAYERS.friction)
    settings = replace(EXACT, linear_tolerance=1e-2, max_newton_iterations=3)
    step = ImplicitStep(cloth, floor_and_ball_field, positions, laws, GRAVITY, settings, Stopwatch(), layers=layers)
    step.compile()
    step.restore(step.state())
    late = compiled_in(lambda: meet(step, flat))
    return SimpleNamespace(step=step, cloth=cloth, flat=flat, thickness=LAYERS.thickness, late=late)


def meet(step, flat) -> None:
    """Throw the sheets against each other for a step."""
    upper = flat @ np.diag([0.9, 1, 0.9]) + [1e-3, 3e-3, 1e-3]
    velocities = np.repeat([[0, 0.5, 0], [0, -0.5, 0]], len(flat), axis=0)
    step.restore(at_rest(step, np.concatenate([flat, upper]), velocities=velocities))
    assert step.step(1 / 60).accepted and step.flight.touched.all()


def compiled_in(action) -> list[str]:
    """Names of the kernels that an action compiles, those aside that copy fields."""
    compiled, kernel = [], ti.lang.kernel_impl.Kernel
    materialize = kernel.materialize

    def spy(self, key=None, *arguments, **named):
        if key not in self.compiled_kernels and not self.func.__module__.startswith("taichi._kernels"):
            compiled.append(self.func.__qualname__)
        return materialize(self, key, *arguments, **named)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(kernel, "materialize", spy)
        action()
    return compiled


@pytest.fixture
def start(two_sheets):
    """Puts the sheets somewhere, with velocities (nv, 3), what is not ``free`` (nv, 1 or 3) held."""

    def put(positions, velocities=0.0, free=None, gravity=GRAVITY, **settings):
        step, shape = two_sheets.step, positions.shape
        step.settings = replace(EXACT, **settings)
        step.gravity[None] = gravity
        fields.upload(step.free, np.ones(shape) if free is None else np.broadcast_to(free, shape) * 1.0)
        step.place_held(positions)
        step.restore(at_rest(step, positions, velocities=np.broadcast_to(velocities, shape)))
        return step

    return put


@pytest.fixture(scope="session")
def assert_no_softer():
    """Compares a matrix with the force it stands for where level cloth at ``x`` is moved up and down by ``eps`` [m]."""

    def check(matrix, forces, x, eps, sweeps):
        for seed in range(3):
            w = np.zeros_like(x)
            w[:, 1] = np.random.default_rng(seed).normal(size=len(w))
            for _ in range(sweeps):  # the edge rotations' iteration goes on from call to call
                force = forces.at(x + eps * w)
            true = -(force * w).sum() / eps
            assembled = w.ravel() @ (matrix @ w.ravel())
            assert true <= assembled * (1 + 1e-4)
            assert assembled < 6 * true

    return check
