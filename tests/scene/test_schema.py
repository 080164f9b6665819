"""The published formats: complete, up to date, and the same as what the reader takes."""

from pathlib import Path
from typing import get_args

from taichi_tryon.output.frames import FORMATS
from taichi_tryon.scene import models
from taichi_tryon.scene.schema import json_schema, markdown
from taichi_tryon.view.camera import VIEWS

DOCUMENT = Path(__file__).parents[2] / "configs" / "SCHEMA.md"


def test_document_is_up_to_date():
    assert DOCUMENT.read_text(encoding="utf-8") == markdown(), "run: taichi-tryon schema --markdown > configs/SCHEMA.md"


def test_every_field_is_described():
    schema = json_schema()
    for name, mapping in {"Scene": schema, **schema["$defs"]}.items():
        assert mapping.get("description"), name
        for key, field in mapping["properties"].items():
            assert field.get("description"), f"{name}.{key}"


def test_parts_are_paths_or_mappings():
    schema = json_schema()
    path, mapping, none = schema["properties"]["body"]["anyOf"]
    assert path["type"] == "string" and mapping == {"$ref": "#/$defs/BodySpec"} and none == {"type": "null"}


def test_choices_are_those_of_their_owners():
    assert set(get_args(models.View)) == set(VIEWS)
    assert set(get_args(models.FrameFormat)) == set(FORMATS)
