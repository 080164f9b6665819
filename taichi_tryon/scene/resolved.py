"""A scene with all its parts and defaults as one YAML text: enough to repeat a run without any other file."""

from __future__ import annotations

from typing import Any

import yaml

from taichi_tryon.scene.models import SceneSpec
from taichi_tryon.scene.yaml_source import FLOAT


class _Dumper(getattr(yaml, "CSafeDumper", yaml.SafeDumper)):
    """Quotes texts that our reader, unlike PyYAML's, would take for numbers."""

    def ignore_aliases(self, data: Any) -> bool:
        return True


_Dumper.add_implicit_resolver("tag:yaml.org,2002:float", FLOAT, list("-+0123456789."))


def to_yaml(scene: SceneSpec) -> str:
    """The scene as YAML; ``load_scene`` reads the same scene from it."""
    values = _plain(scene.model_dump())
    return yaml.dump(values, Dumper=_Dumper, sort_keys=False, default_flow_style=None, allow_unicode=True, width=120)


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    return value
