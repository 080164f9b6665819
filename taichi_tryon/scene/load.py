"""From a YAML file to a validated scene, or to everything that is wrong with it."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Generic, TypeVar

from pydantic import BaseModel, ValidationError

from taichi_tryon.body.spec import BodySpec, PoseSpec
from taichi_tryon.errors import InputError
from taichi_tryon.scene.agreement import Disagreement, disagreements, unknown_bones
from taichi_tryon.scene.faults import describe
from taichi_tryon.scene.models import SceneSpec
from taichi_tryon.scene.overrides import apply_override
from taichi_tryon.scene.references import resolve
from taichi_tryon.scene.yaml_source import Node, read_yaml

Part = TypeVar("Part", bound=BaseModel)


@dataclass(frozen=True)
class Read(Generic[Part]):
    """A part, and the ``root`` of the tree that remembers where each of its values stands."""

    part: Part
    root: Node

    @contextmanager
    def naming_places(self) -> Iterator[None]:
        """Input that is found at fault in here is told with the places of the files it was read from."""
        try:
            yield
        except InputError as error:
            if not error.at:
                raise
            faults = [{"type": "fault", "loc": error.at, "msg": message} for message in error.faults]
            raise InputError(*(describe(fault, self.root, type(self.part)) for fault in faults)) from error


def read_scene(path: Path | str, overrides: Iterable[str] = ()) -> Read[SceneSpec]:
    """The scene of a YAML file with all its parts and their places. Raises InputError with every fault of every
    file."""
    return read_part(path, SceneSpec, overrides, disagreements)


def load_scene(path: Path | str, overrides: Iterable[str] = ()) -> SceneSpec:
    """The scene of a YAML file with all its parts. Raises InputError with every fault of every file."""
    return read_scene(path, overrides).part


def load_body_and_pose(body: Path | str, pose: Path | str | None) -> tuple[BodySpec, PoseSpec | None]:
    """A body and a pose that turns only bones it has. Raises InputError."""
    body_spec = load_part(body, BodySpec)
    return body_spec, load_part(pose, PoseSpec, check=lambda found: unknown_bones(found, body_spec)) if pose else None


def load_part(
    path: Path | str, model: type[Part], check: Callable[[Part], Iterable[Disagreement]] = lambda part: ()
) -> Part:
    """One part (a body, a pose, ...) of a YAML file, see ``read_part``. Raises InputError."""
    return read_part(path, model, (), check).part


def read_part(
    path: Path | str,
    model: type[Part],
    overrides: Iterable[str] = (),
    check: Callable[[Part], Iterable[Disagreement]] = lambda part: (),
) -> Read[Part]:
    """One part (a body, a pose, ...) of a YAML file; ``overrides``, texts ``key.path=value``, are set in turn.

    ``check`` gives further faults of a part that is valid by itself, each with its location. Raises InputError.
    """
    root = read_yaml(Path(path))
    resolve(root, model)
    faults = []
    for override in overrides:
        try:
            apply_override(root, override)
        except InputError as error:
            faults += error.faults
        resolve(root, model)
    faults += _unread(root)
    try:
        # As JSON, since strict models take a list for a tuple and a text for an enum only from there.
        part = model.model_validate_json(json.dumps(root.plain()))
        further = [{"type": "fault", "loc": location, "msg": message} for location, message in check(part)]
    except ValidationError as error:
        further = error.errors(include_url=False)
    faults += [describe(detail, root, model) for detail in further]
    # A file used twice has each fault once.
    if found := [*dict.fromkeys(filter(None, faults))]:
        raise InputError(*found)
    return Read(part, root)


def _unread(node: Node) -> Iterator[str]:
    yield from node.faults
    for _, child in node.children():
        yield from _unread(child)
