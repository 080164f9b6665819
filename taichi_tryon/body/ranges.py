"""Whether a pose keeps within the ranges of the body's joints."""

from __future__ import annotations

from collections.abc import Iterator

from taichi_tryon.body.spec import BodySpec, PoseSpec


def beyond(pose: PoseSpec, body: BodySpec) -> Iterator[str]:
    """A line for each turn of the pose that lies beyond the range of its joint, where the body gives one.

    No fault: shape and dressing are found in any pose, and what cannot be worn in it is refused by name; but the body's
    maker does not answer for its shape there.
    """
    for name, turns in pose.rotations_degree.items():
        for axis, (least, greatest) in body.bones[name].range_degree.axes.items():
            turn = turns["xyz".index(axis)]
            if not least <= turn <= greatest:
                yield (
                    f"pose {pose.name}: {name} is turned by {turn:g} degrees about {axis}, beyond its range of "
                    f"{least:g} to {greatest:g} (range_degree of body {body.name})"
                )
