"""What a scene does not need and a run leaves out, and why: known before the run, and counted after it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from taichi_tryon.body.field import WALK
from taichi_tryon.body.reach import Reach
from taichi_tryon.fabric import Moduli
from taichi_tryon.setup import Setup
from taichi_tryon.simulation import Simulation

Entry = tuple[str, str]


def skipped(setup: Setup, simulation: Simulation | None = None) -> list[dict[str, str]]:
    """``what`` is left out of a run, and ``why``; with the counts of a ``simulation`` where it has run."""
    entries = [*_body(setup, simulation), *_laws(setup), *_output(setup)]
    return [{"what": what, "why": why} for what, why in entries]


def _body(setup: Setup, simulation: Simulation | None) -> Iterator[Entry]:
    skip = setup.scene.skip
    if setup.scene.body is None:
        yield "contact of cloth with the body", "the scene has no body"
        return
    if skip.far_balls:
        yield from _far_balls(setup, simulation)
    contact = simulation and simulation.stepper.contact
    looked, known = (int(contact.looked.to_numpy().sum()), int(contact.known.to_numpy().sum())) if contact else (0, 0)
    if skip.far_samples:
        why = "samples far off sleep until they, or the body, could have come near"
        if contact and contact.evaluations:
            asleep = 1 - (looked + known) / (contact.evaluations * contact.count)
            why += f": in the mean {100 * asleep:.1f} % of {contact.count}"
        yield "far contact samples", why
    if skip.still_body:
        why = "what is where it was last, the body too, keeps depth and normal"
        if looked + known:
            why += f": {100 * known / (looked + known):.1f} % of the looks of samples awake"
        yield "repeated looks at the body", why
        if setup.motion.end_time == 0:
            yield "motion of the body", "the scene has no motion: the body is posed once"


def _far_balls(setup: Setup, simulation: Simulation | None) -> Iterator[Entry]:
    """Balls that were never near, or before a run those that are not at its start, and groups that have no others."""
    balls = setup.body.posed(setup.motion.transforms(0.0))
    if simulation is None:
        reach = Reach(WALK)
        reach.hold(setup.positions.min(axis=0), setup.positions.max(axis=0))
        near, when = reach.meets(balls), "at the start"
    else:
        near, when = simulation.field.ever_near, "in the whole run"
    if near.all():
        return
    groups = [name for name, of in zip(setup.body.group_names, balls.membership.T, strict=True) if not near[of].any()]
    why = f"{(~near).sum()} of {len(near)} do not reach to the cloth {when}"
    yield "balls out of reach", why + (f"; groups without others: {', '.join(groups)}" if groups else "")


def _laws(setup: Setup) -> Iterator[Entry]:
    scene = setup.scene
    if scene.contact.friction == 0:
        yield "friction", "contact.friction is 0"
    if scene.contact.layers is None:
        yield "contact of cloth with cloth", "contact.layers does not ask for it"
    elif scene.contact.layers.friction == 0:
        yield "friction between layers", "contact.layers.friction is 0"
    moduli = [Moduli.from_spec(garment.spec.fabric) for garment in setup.garments]
    if not any(np.any(m.shear_friction) for m in moduli):
        yield "dry friction in shear", "no fabric has shear_hysteresis_gf_per_cm"
    bends = not any(np.any(m.bend_friction) for m in moduli)
    if bends:
        yield "dry friction in bending", "no fabric has a bending hysteresis"
    if scene.mesh.bending == "constant":
        if bends and not any(m.damping_time for m in moduli):
            yield "hinges", "mesh.bending is constant, and no fabric rubs or damps in bending"
        if scene.skip.constant_matrices:
            yield "assembly of constant matrices", "mesh.bending is constant: its blocks are written once"


def _output(setup: Setup) -> Iterator[Entry]:
    for what, key in (("pictures", "images"), ("film", "video"), ("maps", "maps")):
        if not getattr(setup.scene.output, key):
            yield what, f"output.{key} asks for none"
