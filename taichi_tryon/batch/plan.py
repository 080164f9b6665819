"""What a batch consists of: every scene with every choice of its swept values, validated before the first one runs."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from taichi_tryon.batch.drape import Drape
from taichi_tryon.errors import InputError
from taichi_tryon.output.checkpoint import fingerprint
from taichi_tryon.scene.load import load_scene
from taichi_tryon.scene.resolved import to_yaml
from taichi_tryon.scene.sweep import Variant

# characters of a folder's name that tell the parameters, and of the fingerprint, which makes it unique
LABEL_LENGTH, FINGERPRINT_LENGTH = 60, 8


def plan(scenes: Iterable[Path], variants: Iterable[Variant]) -> list[Drape]:
    """The drapes of a batch, scene by scene. Raises InputError with every fault of all of them, each once."""
    variants, drapes, faults = list(variants), [], []
    for path in scenes:
        for variant in variants:
            try:
                scene = load_scene(path, variant.overrides)
            except InputError as error:
                faults += error.faults
                continue
            text = to_yaml(scene)
            drapes.append(Drape(_name(scene.scene, variant, text), str(path), variant.parameters, text))
    seen: dict[str, Drape] = {}
    for drape in drapes:
        if drape.text in seen:
            first = seen[drape.text]
            faults.append(f"{drape.scene}: {drape.name} is the same as {first.name}; name each scene and value once")
        seen[drape.text] = drape
    if faults:
        raise InputError(*dict.fromkeys(faults))
    return drapes


def _name(scene: str, variant: Variant, text: str) -> str:
    values = "".join(f"_{key.rpartition('.')[2]}={_short(value)}" for key, value in variant.parameters.items())
    label = re.sub(r"[^A-Za-z0-9_=.,+-]+", "-", values)
    return f"{scene}{label[:LABEL_LENGTH]}_{fingerprint(text)[:FINGERPRINT_LENGTH]}"


def _short(value: Any) -> str:
    return ",".join(map(_short, value)) if isinstance(value, list) else str(value)
