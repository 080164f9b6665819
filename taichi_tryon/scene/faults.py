"""Validation errors as lines to read: ``file:line:column: field: what is wrong and what is allowed (got ...)``."""

from __future__ import annotations

import difflib
import json
from typing import Any, get_args, get_origin

from pydantic import BaseModel
from pydantic_core import ErrorDetails

from taichi_tryon.scene.references import is_reference
from taichi_tryon.scene.yaml_source import Node

_PLAIN_WORDS = {
    "float_type": "must be a plain number; its unit is in the key's name",
    "int_type": "must be a whole number",
    "bool_type": "must be true or false",
    "string_type": "must be a text",
    "model_type": "must be a mapping of keys to values",
    "dict_type": "must be a mapping of keys to values",
    "tuple_type": "must be a list",
    "list_type": "must be a list",
    "finite_number": "must be a finite number",
}


def describe(error: ErrorDetails | dict[str, Any], root: Node, model: type[BaseModel]) -> str | None:
    """One line for one pydantic error, or None where the value is missing only because its file could not be read."""
    location = [*error["loc"], *error.get("ctx", {}).get("location", ())]
    node, place, path = root, root.place, []
    kind: Any = model
    may_be_path = False
    for index, key in enumerate(location):
        if node.faults:
            return None
        child = _child(node, key)
        if child is not None:
            place = child.place
            if error["type"] == "extra_forbidden" and index == len(location) - 1:
                place = node.keys[str(key)]
            else:
                may_be_path = _may_be_path(kind, key)
                kind = _step(kind, key)
            node, path = child, [] if child.is_file else [*path, str(key)]
        elif error["type"] in ("missing", "fault") and index == len(location) - 1 and isinstance(key, str):
            path = [*path, str(key)]
        else:  # the name of a union's member, which stands in no file
            kind = _step(kind, key)
    if node.faults:
        return None
    field = ".".join(path)
    return ": ".join(part for part in (str(place), field, _message(error, location, kind, may_be_path)) if part)


def _child(node: Node, key: str | int) -> Node | None:
    if isinstance(node.value, dict):
        return node.value.get(str(key))
    if isinstance(node.value, list) and isinstance(key, int) and key < len(node.value):
        return node.value[key]
    return None


def _models(annotation: Any) -> list[type[BaseModel]]:
    """The models among an annotation and its arguments."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [model for argument in get_args(annotation) for model in _models(argument)]


def _step(kind: Any, key: str | int) -> Any:
    """The annotation below ``key`` of an annotation; where it cannot be told, the annotation itself."""
    if isinstance(key, int):
        return kind
    if get_origin(kind) is dict:
        return get_args(kind)[1]
    models = _models(kind)
    named = [model for model in models if model.__name__ == key or _tag(model) == key]
    if named:
        return named[0]
    fields = [model.model_fields[key].annotation for model in models if key in model.model_fields]
    return fields[0] if fields else kind


def _may_be_path(kind: Any, key: str | int) -> bool:
    return any(key in model.model_fields and is_reference(model.model_fields[key]) for model in _models(kind))


def _tag(model: type[BaseModel]) -> Any:
    """The value of a model's first field where it is a constant, as in a union told apart by it."""
    first = next(iter(model.model_fields.values()), None)
    values = get_args(first.annotation) if first else ()
    return values[0] if len(values) == 1 else None


def _message(error: ErrorDetails, location: list[str | int], kind: Any, may_be_path: bool) -> str:
    if error["type"] == "fault":
        return error["msg"]
    if error["type"] == "missing":
        return f"this key is required{_description(kind, location[-1])}"
    if error["type"] == "extra_forbidden":
        return _unknown_key(str(location[-1]), kind)
    if error["type"] == "model_type" and may_be_path:
        return f"must be a mapping, or the path of a file that holds it (got {_short(error['input'])})"
    text = _PLAIN_WORDS.get(error["type"], error["msg"].replace("Input should", "must").removeprefix("Value error, "))
    return text if error["type"] == "value_error" else f"{text} (got {_short(error['input'])})"


def _description(kind: Any, key: str | int) -> str:
    for model in _models(kind):
        if key in model.model_fields and model.model_fields[key].description:
            return f" ({model.model_fields[key].description})"
    return ""


def _unknown_key(key: str, kind: Any) -> str:
    allowed = [name for model in _models(kind) for name in model.model_fields]
    close = difflib.get_close_matches(key, allowed, n=1, cutoff=0.5)
    if close:
        return f"unknown key; did you mean {close[0]}?"
    return f"unknown key; allowed here: {', '.join(dict.fromkeys(allowed))}" if allowed else "unknown key"


def _short(value: Any) -> str:
    if isinstance(value, dict):
        return f"a mapping with {', '.join(list(value)[:3])}" if value else "an empty mapping"
    text = json.dumps(value, ensure_ascii=False)
    if len(text) <= 60:
        return text
    return f"a list of {len(value)}" if isinstance(value, list) else f"{text[:57]}..."
