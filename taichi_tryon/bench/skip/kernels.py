"""Kernels that a scene does not use are not compiled: a sheet on a floor, plain and with all that it can ask for.

Time from Taichi's start to the first step, nothing taken from an earlier compilation. Limit: at least one kernel fewer.
"""

from collections.abc import Iterator

from taichi_tryon.bench.apart import apart
from taichi_tryon.bench.record import Record, at_least, told
from taichi_tryon.bench.skip.course import run

SCENE = "validation/incline.yaml"
PLAIN = ("contact.friction=0", "mesh.bending=constant", "solver.preconditioner=block_jacobi")
ASKED = {
    "friction": ("contact.friction=0.3",),
    "layers": ("contact.layers={}",),
    "fabric's friction": (
        "garments.0.fabric.shear_hysteresis_gf_per_cm=1",
        "garments.0.fabric.bending_hysteresis_warp_gf_cm_per_cm=0.05",
    ),
    "nodal membrane": ("mesh.membrane=nodal",),
    "coarse space": ("solver.preconditioner=coarse",),
}


def records(quick: bool) -> Iterator[Record]:
    """The plain scene, one with everything, and in the whole suite with each."""
    everything = sum(ASKED.values(), ())
    options = {"nothing": (), **({} if quick else ASKED), "all of it": everything}
    found = {}
    for name, more in options.items():
        found[name] = course = apart(run, SCENE, PLAIN + more, 0, 1, True)
        yield told("kernels", {"asked for": name}, "kernels", "1", course.kernels, course.compile_s)
        yield told("kernels", {"asked for": name}, "start", "s", course.compile_s, course.compile_s)
    plain, full = found["nothing"], found["all of it"]
    fewer, wall = full.kernels - plain.kernels, plain.compile_s + full.compile_s
    yield at_least("kernels", {"asked for": "nothing"}, "kernels_fewer", "1", fewer, 1, wall)
    yield told(
        "kernels", {"asked for": "nothing"}, "start_over_that_with_all", "1", plain.compile_s / full.compile_s, wall
    )
