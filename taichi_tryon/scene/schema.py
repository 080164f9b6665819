"""The scene format as JSON Schema for editors, and as Markdown for readers; both come from the models alone."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

from pydantic.json_schema import GenerateJsonSchema

from taichi_tryon.scene.models import SceneSpec

_HEADER = """\
# The scene format

Written by `taichi-tryon schema --markdown` from the code; a test keeps it up to date.

A scene is one YAML file. A value marked *part* is a mapping, or the path of a YAML file that holds it, relative to the
file that names it. Keys end in the unit of their value. Numbers may be written as `0.001`, `1e-3` or `1.0e-3`; texts
need quotes only where they would read as something else. Unknown and repeated keys are faults.
"""


def json_schema() -> dict[str, Any]:
    """The JSON Schema (2020-12) of a scene file."""
    schema = SceneSpec.model_json_schema(ref_template="#/$defs/{model}")
    return {"$schema": GenerateJsonSchema.schema_dialect, **schema}


def markdown() -> str:
    """A table of the keys of every mapping, the scene first."""
    schema = json_schema()
    sections = [_section("Scene", schema)]
    sections += [_section(_title(name), mapping) for name, mapping in _in_order(schema)]
    return "\n".join([_HEADER, *sections])


def _in_order(schema: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    """The definitions in the order in which a reader meets them."""
    definitions, seen = schema["$defs"], []
    waiting = _references(schema["properties"])
    while waiting:
        name = waiting.pop(0)
        if name not in seen:
            seen.append(name)
            waiting = _references(definitions[name]) + waiting
    for name in seen:
        yield name, definitions[name]


def _references(schema: Any) -> list[str]:
    if isinstance(schema, dict):
        here = [_definition(schema["$ref"])] if "$ref" in schema else []
        return here + [name for value in schema.values() for name in _references(value)]
    return [name for value in schema for name in _references(value)] if isinstance(schema, list) else []


def _definition(reference: str) -> str:
    return reference.removeprefix("#/$defs/")


def _title(name: str) -> str:
    """A heading from a definition's name, which holds the module where two models have one name."""
    *modules, name = name.split("__")
    words = name.removesuffix("Spec")
    heading = "".join(f" {letter.lower()}" if letter.isupper() else letter for letter in words).strip().capitalize()
    return f"{heading} ({modules[-2]})" if len(modules) > 1 else heading


def _anchor(name: str) -> str:
    return _title(name).lower().replace(" ", "-").replace("(", "").replace(")", "")


def _section(title: str, schema: dict[str, Any]) -> str:
    lines = [f"## {title}", "", schema.get("description", "").replace("\n", " "), ""]
    lines += ["| key | value | default | meaning |", "|---|---|---|---|"]
    required = schema.get("required", [])
    for key, field in schema["properties"].items():
        default = "required" if key in required else _default(field)
        cells = [f"`{key}`", _kind(field), default, field.get("description", "")]
        lines.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    return "\n".join([*lines, ""])


def _default(field: dict[str, Any]) -> str:
    if "default" not in field:  # made anew by a factory, so empty
        return "`{}`" if field.get("type") == "object" else "`[]`"
    value = field["default"]
    return "each key's own" if value and isinstance(value, dict) else f"`{json.dumps(value)}`"


def _kind(schema: dict[str, Any]) -> str:
    """What a value may be, in words."""
    if "$ref" in schema:
        name = _definition(schema["$ref"])
        return f"[{_title(name).lower()}](#{_anchor(name)})"
    if "anyOf" in schema:
        if schema["anyOf"][0].get("description", "").startswith("path of"):
            return "*part*: " + " or ".join(_kind(option) for option in schema["anyOf"][1:])
        return " or ".join(_kind(option) for option in schema["anyOf"])
    if "enum" in schema:
        return ", ".join(f"`{value}`" for value in schema["enum"])
    if "const" in schema:
        return f"`{schema['const']}`"
    return _of_type(schema)


def _of_type(schema: dict[str, Any]) -> str:
    match schema.get("type"):
        case "array":
            low, high = schema.get("minItems"), schema.get("maxItems")
            count = f"{low} " if low == high and low else f"at least {low} " if low and high is None else ""
            items = _kind(schema["items"])
            return f"list of {count}({items})" if " or " in items else f"list of {count}{items}"
        case "object":
            patterns = list(schema.get("patternProperties", {}).values())
            return f"mapping of names to {_kind(patterns[0] if patterns else schema['additionalProperties'])}"
        case "number" | "integer" as kind:
            noun = {"number": "number", "integer": "whole number"}[kind]
            signs = {"minimum": ">=", "exclusiveMinimum": ">", "maximum": "<=", "exclusiveMaximum": "<"}
            if schema.get("maximum") and schema.get("minimum") == -schema["maximum"]:
                return f"{noun} within ±{schema['maximum']:g}"
            bounds = [f"{sign} {schema[key]:g}" for key, sign in signs.items() if key in schema]
            return " ".join([noun, ", ".join(bounds)]).strip()
        case "string":
            return f"text like `{schema['pattern']}`" if "pattern" in schema else "text"
        case "boolean":
            return "true or false"
        case "null":
            return "null"
    return "any value"
