"""Parts of a scene that stand in files of their own: a text is a path, relative to the file that names it.

Which fields may be references is declared with the field: ``body: Annotated[BodySpec, REFERENCE]``. The part's own
model says which references it may hold in turn, and no model holds itself, so references cannot form a cycle.
"""

from __future__ import annotations

import difflib
import os
from pathlib import Path
from typing import Any, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from taichi_tryon.errors import InputError
from taichi_tryon.scene.yaml_source import Node, read_yaml


class Reference:
    """Marks a field whose value is a mapping or the path of a file that holds it."""

    def __get_pydantic_json_schema__(self, core_schema: Any, handler: Any) -> dict[str, Any]:
        path = {"type": "string", "description": "path of a YAML file, relative to this one"}
        part = handler(core_schema)
        return {"anyOf": [path, *part.get("anyOf", [part])]}


REFERENCE = Reference()


def is_reference(field: FieldInfo) -> bool:
    return any(isinstance(mark, Reference) for mark in field.metadata)


def resolve(node: Node, model: type[BaseModel], path: str = "") -> None:
    """Replace, in place, every reference below ``node`` (read for ``model``) by the tree of its file.

    A reference that cannot be read becomes a Node with ``faults``.
    """
    if not isinstance(node.value, dict):
        return
    for key, field in model.model_fields.items():
        child = node.value.get(key)
        if child is None:
            continue
        where = f"{path}{key}"
        if is_reference(field) and isinstance(child.value, str):
            node.value[key] = child = _follow(child, where)
        inside = "" if child.is_file else f"{where}."
        if part := _model_of(field):
            resolve(child, part, inside)
        elif (part := _model_of_items(field)) and isinstance(child.value, list):
            # a list that is too long is refused whatever is in the rest
            for index, item in enumerate(child.value[: _longest(field)]):
                resolve(item, part, f"{inside}{index}.")


def _model_of(field: FieldInfo) -> type[BaseModel] | None:
    candidates = [field.annotation, *get_args(field.annotation)] if not _is_list(field.annotation) else []
    return next((kind for kind in candidates if isinstance(kind, type) and issubclass(kind, BaseModel)), None)


def _model_of_items(field: FieldInfo) -> type[BaseModel] | None:
    candidates = get_args(field.annotation) if _is_list(field.annotation) else ()
    return next((kind for kind in candidates if isinstance(kind, type) and issubclass(kind, BaseModel)), None)


def _longest(field: FieldInfo) -> int | None:
    """How many items a list may have, None where there is no limit."""
    return next((mark.max_length for mark in field.metadata if hasattr(mark, "max_length")), None)


def _is_list(annotation: Any) -> bool:
    return get_origin(annotation) in (list, tuple)


def _follow(node: Node, where: str) -> Node:
    path = Path(os.path.normpath(node.place.folder / node.value))
    if not os.path.isfile(path):
        what = "not a file" if os.path.exists(path) else "no such file"
        reason = f"{what}: {path}{_similar(path)} (a path starts at the folder of the file that names it)"
        return Node(None, node.place, faults=InputError(f"{node.place}: {where}: {reason}").faults)
    try:
        return read_yaml(path)
    except InputError as error:
        return Node(None, node.place, faults=error.faults)


def _similar(path: Path) -> str:
    """A hint at files of nearly this name in the same folder."""
    if not os.path.isdir(path.parent):
        return ""
    close = difflib.get_close_matches(path.name, sorted(os.listdir(path.parent)), n=1)
    return f"; did you mean {close[0]}?" if close else ""
