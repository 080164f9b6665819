"""Values set from the command line: ``garments.0.fabric.weight_gf_per_cm2=0.02``."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from taichi_tryon.errors import InputError
from taichi_tryon.scene.yaml_source import Node, Place, parse_yaml


def apply_override(root: Node, text: str) -> None:
    """Set one value in a tree whose references are resolved; a path in it starts at the working directory.

    Mappings that are missing on the way are made; whether their keys exist is left to the validation. Raises InputError
    where the way leads through something else.
    """
    label = f"--set {text}"
    keys, equals, value = text.partition("=")
    if not equals or not all(keys.split(".")):
        raise InputError(f"{label}: write KEY.PATH=VALUE, for example garments.0.fabric.weight_gf_per_cm2=0.02")
    place = Place(label, None, None, Path())
    new = parse_yaml(value, label, Path(), numbered=False) if value.strip() else Node(None, place)
    *way, last = keys.split(".")
    node = root
    for depth, key in enumerate(way):
        if node.faults:
            return
        child = _child(node, key, ".".join(way[:depth]), place)
        # A copy, since an alias may have put the same node elsewhere too.
        node = _put(node, key, replace(child, value=_copied(child.value), keys=dict(child.keys)), place)
    if not node.faults:
        _child(node, last, ".".join(way), place)
        _put(node, last, new, place)


def _copied(value: object) -> object:
    return value.copy() if isinstance(value, (dict, list)) else value


def _child(node: Node, key: str, path: str, place: Place) -> Node:
    """What stands at ``key`` in ``node``, an empty mapping where nothing does."""
    where = f"{path}: " if path else ""
    if isinstance(node.value, list):
        if not (key.isdecimal() and int(key) < len(node.value)):
            raise InputError(f"{place}: {where}a list of {len(node.value)}, counted from 0, has no entry {key}")
        return node.value[int(key)]
    if node.value is None:
        node.value = {}
    if not isinstance(node.value, dict):
        raise InputError(f"{place}: {where}has no key {key}: it is {node.value!r}")
    return node.value.get(key, Node(None, place))


def _put(node: Node, key: str, child: Node, place: Place) -> Node:
    if isinstance(node.value, list):
        node.value[int(key)] = child
    else:
        if key not in node.value:
            node.keys[key] = place
        node.value[key] = child
    return child
