"""Taichi is started once for the whole session, in f64 and with a cache of its own: compiling is what costs.

Here is also what several folders need: sheets of the paper's fabric, a body with exact surfaces, a scene of seconds.
"""

from __future__ import annotations

import math
import os
from types import SimpleNamespace

import numpy as np
import pytest
from xdist.scheduler import LoadScopeScheduling

from taichi_tryon import runtime
from taichi_tryon.body.model import Body
from taichi_tryon.body.spec import BodySpec
from taichi_tryon.cloth.model import Cloth
from taichi_tryon.fabric import Moduli
from taichi_tryon.mesh.bands import Tapes
from taichi_tryon.mesh.topology import Topology
from taichi_tryon.mesh.triangulate import triangulate


class ByKernels(LoadScopeScheduling):
    """Files whose tests share simulations stay in one process, which compiles these once; others come as they are."""

    def _split_scope(self, nodeid: str) -> str:
        file = nodeid.partition("::")[0]
        return "tests/solver" if file.startswith("tests/solver/") else file


def pytest_xdist_make_scheduler(config, log):
    return ByKernels(config, log)


def pytest_collection_modifyitems(items):
    """What takes long first, so that processes end together: whole runs, then what the solver's files share."""
    items.sort(key=lambda item: (len(item.path.parts), item.path.parent.name != "solver"))


@pytest.fixture(scope="session", autouse=True)
def _taichi(tmp_path_factory):
    # where pytest's own processes share the cores, threads of one would only be in the way of the other's
    threads = max(1, 2 // int(os.environ.get("PYTEST_XDIST_WORKER_COUNT", "1")))
    runtime.start(arch="cpu", precision="f64", threads=threads, cache=tmp_path_factory.mktemp("kernels"))


@pytest.fixture(scope="session")
def moduli() -> Moduli:
    """The fabric of the paper's Table 1, without internal friction."""
    return Moduli(
        stretch=np.array([2392.8, 2373.2, 0.0, 77.54]),
        bend=np.array([1.4416e-5, 1.0591e-5, 0.0, 3.751e-6]),
        mass=0.29,
        damping_time=0.0,
    )


@pytest.fixture(scope="session")
def make_sheet():
    """Makes a flat rectangle [m], unstructured as the product meshes it, its grain along +x."""

    def make(width: float, height: float, edge: float) -> SimpleNamespace:
        nx, ny = round(width / edge), round(height / edge)
        x, y = np.linspace(0, width, nx + 1), np.linspace(0, height, ny + 1)
        outline = np.concatenate(
            [
                np.column_stack([x[:-1], np.zeros(nx)]),
                np.column_stack([np.full(ny, width), y[:-1]]),
                np.column_stack([x[:0:-1], np.full(nx, height)]),
                np.column_stack([np.zeros(ny), y[:0:-1]]),
            ]
        )
        points, triangles = triangulate(outline, edge, "sheet")
        rest = points[triangles]
        a, b = rest[:, 1] - rest[:, 0], rest[:, 2] - rest[:, 0]
        return SimpleNamespace(
            name="sheet",
            points=points,
            triangles=triangles,
            rest=rest,
            areas=(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / 2,
            vertex_count=len(points),
            topology=Topology.of(triangles, len(points)),
            tapes=Tapes.none(),
        )

    return make


@pytest.fixture(scope="session")
def sheet(make_sheet):
    return make_sheet(0.12, 0.1, 0.012)


@pytest.fixture(scope="session")
def cloth(sheet, moduli):
    return Cloth.join([(sheet, moduli)])


@pytest.fixture(scope="session")
def floor_and_ball() -> Body:
    """A floor whose skin is the plane y = 0, and a ball of radius 0.1 m around (0, 1, 0).

    The skin of a ball of weight 8 alone lies at sqrt(1/2) of its radii, exactly.
    """
    reach = 10 * math.sqrt(2)
    flat, round_ = [math.inf, reach, math.inf], [reach] * 3
    shared = {"weight": 8, "bones": {"root": 1}}
    data = {
        "name": "floor and ball",
        "bones": {"root": {"parent": None, "head_cm": [0, 0, 0]}},
        "groups": ["floor", "ball"],
        "balls": {
            "floor": {"center_cm": [0, -10, 0], "radii_cm": flat, "groups": ["floor"], **shared},
            "ball": {"center_cm": [0, 100, 0], "radii_cm": round_, "groups": ["ball"], **shared},
        },
    }
    return Body.from_spec(BodySpec.model_validate(data))


@pytest.fixture(scope="session")
def floor_and_ball_field(floor_and_ball):
    """The same in Taichi."""
    from taichi_tryon.body.field import BodyField

    field = BodyField(floor_and_ball)
    field.set_pose(np.eye(4)[None])
    return field


def _cone_panel(inner: float, outer: float, degrees: float) -> dict:
    """A sector of a ring [cm], symmetric to the y axis, its wide side below."""

    def at(radius: float, share: float) -> list[float]:
        angle = math.radians((share - 0.5) * degrees)
        return [round(radius * math.sin(angle), 6), round(-radius * math.cos(angle), 6)]

    return {
        "edges": [
            {"name": "hem", "arc": [at(outer, 0), at(outer, 0.5), at(outer, 1)]},
            {"name": "right", "line": [at(outer, 1), at(inner, 1)]},
            {"name": "top", "arc": [at(inner, 1), at(inner, 0.5), at(inner, 0)]},
            {"name": "left", "line": [at(inner, 0), at(outer, 0)]},
        ]
    }


@pytest.fixture(scope="session")
def make_cone_scene():
    """Makes a scene of seconds, as YAML would give it: a cone of cloth hung on a ball of radius 15 cm."""
    return _cone_scene


def _cone_scene() -> dict:
    reach = 15 * math.sqrt(2)
    panel = _cone_panel(13.5, 25.5, 127)
    disk = {"at": "top", "turns_with": "root", "normal": [0, -1, 0], "start": [0, 0, 1], "groups": ["trunk"]}
    return {
        "scene": "cone",
        "body": {
            "name": "ball",
            "bones": {"root": {"parent": None, "head_cm": [0, 100, 0]}},
            "groups": ["trunk"],
            "balls": {
                "ball": {
                    "center_cm": [0, 100, 0],
                    "radii_cm": [reach] * 3,
                    "weight": 8,
                    "groups": ["trunk"],
                    "bones": {"root": 1},
                }
            },
            "landmarks": {"top": {"bone": "root", "position_cm": [0, 112, 0]}},
        },
        "pose": {"name": "still"},
        "garments": [
            {
                "name": "cone",
                "pattern": {
                    "pattern": "cone",
                    "panels": {"front": panel, "back": panel},
                    "seams": [
                        {"name": "side_l", "a": [["front", "right"]], "b": [["back", "left"]]},
                        {"name": "side_r", "a": [["front", "left"]], "b": [["back", "right"]]},
                    ],
                },
                "dressing": {
                    "dressing": "cone",
                    "disks": {
                        "upper": {**disk, "ease_cm": 1.0},
                        "lower": {**disk, "offset_cm": [0, -8, 0], "ease_cm": 4.0},
                    },
                    "surfaces": {"around": ["upper", "lower"]},
                    "panels": {
                        "front": {"surface": "around", "around": [0, 0.5], "top": ["top"], "bottom": ["hem"]},
                        "back": {"surface": "around", "around": [0.5, 1], "top": ["top"], "bottom": ["hem"]},
                    },
                    "lines": {"hem": "lower"},
                },
                "fabric": {
                    "fabric": "table1",
                    "tensile_warp_gf_per_cm": 2440.0,
                    "tensile_weft_gf_per_cm": 2420.0,
                    "shear_gf_per_cm_degree": 1.38,
                    "bending_warp_gf_cm2_per_cm": 0.147,
                    "bending_weft_gf_cm2_per_cm": 0.108,
                    "bending_bias_gf_cm2_per_cm": 0.102,
                    "weight_gf_per_cm2": 0.029,
                },
            }
        ],
        "mesh": {"edge_length_mm": 30},
        "drape": {"duration_s": 0.1},
        "output": {"images": False, "video": False},
    }
