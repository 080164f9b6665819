"""Values given as lists on the command line, ``mesh.edge_length_mm=[10, 20]``: a scene for each of their product."""

from __future__ import annotations

import inspect
import json
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, Union, get_args, get_origin

from pydantic import BaseModel

from taichi_tryon.errors import InputError
from taichi_tryon.scene.models import SceneSpec
from taichi_tryon.scene.yaml_source import Node, parse_yaml


@dataclass(frozen=True)
class Variant:
    """One scene of a sweep: ``overrides`` in the order in which they are set, and what each swept key has here."""

    overrides: tuple[str, ...]
    parameters: dict[str, Any] = field(default_factory=dict)


def spread(overrides: Iterable[str]) -> list[Variant]:
    """All that ``overrides``, texts ``key.path=value``, stand for: one variant where nothing is swept, else the product
    of the swept keys, the last one changing fastest.

    A list that is nested deeper than its key takes is swept over: ``mesh.edge_length_mm=[10, 20]`` are two lengths,
    ``gravity_m_s2=[0, -9.81, 0]`` is one gravity, ``gravity_m_s2=[[0, -9.81, 0], [0, 0, 0]]`` are two. Raises
    InputError where a swept list is empty or its key is set twice.
    """
    choices: list[tuple[str, list[Any] | str]] = []
    for text in overrides:
        key, _, value = text.partition("=")
        choices.append((key, swept if (swept := _swept(key, value, text)) is not None else text))
    for key, swept in choices:
        if isinstance(swept, list) and sum(other == key for other, _ in choices) > 1:
            raise InputError(f"--set {key}: is swept and set twice; give the key once, with all its values")
    variants = []
    for chosen in product(*(values if isinstance(values, list) else [values] for _, values in choices)):
        texts, parameters = [], {}
        for (key, values), value in zip(choices, chosen, strict=True):
            if isinstance(values, list):
                parameters[key] = value
                value = f"{key}={json.dumps(value, ensure_ascii=False)}"
            texts.append(value)
        variants.append(Variant(tuple(texts), parameters))
    return variants


def _swept(key: str, value: str, text: str) -> list[Any] | None:
    """The values that a key is swept over, None where it has one."""
    takes = _takes(key)
    if takes is None or not value.lstrip().startswith("["):
        return None
    node = parse_yaml(value, f"--set {text}", Path(), numbered=False)
    if _depth_of_value(node) <= takes:
        return None
    if not node.value:
        raise InputError(f"--set {text}: an empty list sweeps over nothing; give at least one value")
    return [child.plain() for _, child in node.children()]


def _takes(path: str) -> int | None:
    """How deep a list may be nested at ``key.path`` of a scene, 0 where it takes none; None where there is no such
    key."""
    kinds: list[Any] = [SceneSpec]
    for key in path.split("."):
        kinds = [inner for kind in kinds for inner in _below(kind, key)]
    return max(map(_depth, kinds), default=None)


def _members(annotation: Any) -> Iterator[Any]:
    """What an annotation allows, each without marks."""
    if get_origin(annotation) is Annotated:
        yield from _members(get_args(annotation)[0])
    elif get_origin(annotation) in (Union, UnionType):
        for member in get_args(annotation):
            yield from _members(member)
    else:
        yield annotation


def _below(annotation: Any, key: str) -> Iterator[Any]:
    """What an annotation allows at ``key``."""
    for member in _members(annotation):
        if get_origin(member) in (list, tuple) and key.isdecimal():
            yield get_args(member)[0]
        elif get_origin(member) is dict:
            yield get_args(member)[1]
        elif inspect.isclass(member) and issubclass(member, BaseModel) and key in member.model_fields:
            yield member.model_fields[key].annotation


def _depth(annotation: Any) -> int:
    lists = [member for member in _members(annotation) if get_origin(member) in (list, tuple)]
    return max((1 + max(map(_depth, get_args(member))) for member in lists), default=0)


def _depth_of_value(node: Node) -> int:
    if not isinstance(node.value, list):
        return 0
    return 1 + max((_depth_of_value(child) for _, child in node.children()), default=0)
