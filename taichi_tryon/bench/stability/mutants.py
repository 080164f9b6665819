"""Scenes of which one file is broken in one way: which file, how, and whether anything could still be right."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from taichi_tryon.bench.stability import garment_mutations, text_mutations, value_mutations
from taichi_tryon.bench.stability.value_mutations import CYCLE, LINK_TO_ITSELF, REFERENCES, is_reference, spots
from taichi_tryon.scene.yaml_source import read_yaml


@dataclass(frozen=True)
class Mutant:
    """``data`` for the file ``path``, which ``scene`` reads; ``wrong``: no reading of it can be right."""

    number: int
    scene: Path
    path: Path
    kind: str
    data: bytes
    wrong: bool

    @property
    def name(self) -> str:
        return f"{self.number}: {self.kind} of {self.path.name}, read by {self.scene.name}"


def mutants(scenes: list[Path], count: int, seed: int = 0) -> Iterator[Mutant]:
    """``count`` mutants of the files of ``scenes``, the same for the same seed: each is of a kind of part, and of a
    family of mutations, that are drawn before the mutation, so that none is rare."""
    parts = {scene: _parts(scene) for scene in scenes}
    for number in range(count):
        rng = np.random.default_rng([seed, number])
        made = None
        while made is None:
            scene = scenes[rng.integers(len(scenes))]
            part = list(parts[scene])[rng.integers(len(parts[scene]))]
            path = parts[scene][part][rng.integers(len(parts[scene][part]))]
            families = (text_mutations.MUTATIONS, value_mutations.MUTATIONS, garment_mutations.MUTATIONS[part])
            family = families[rng.choice(3, p=[0.25, 0.45, 0.3])]
            mutation = family[rng.integers(len(family))]
            made = _mutated(rng, mutation, path, as_text=family is text_mutations.MUTATIONS)
        data, wrong = made
        if data != path.read_bytes():
            yield Mutant(number, scene, path, mutation.__name__, data, wrong)


@contextmanager
def laid_out(mutant: Mutant) -> Iterator[Path]:
    """The mutant's scene, while its file is in the place of the sound one."""
    sound = mutant.path.read_bytes()
    try:
        mutant.path.write_bytes(mutant.data)
        yield mutant.scene
    finally:
        mutant.path.write_bytes(sound)


def lay_traps(scene: Path) -> None:
    """The files that mutated references name, beside a scene."""
    link, cycle = scene.parent / LINK_TO_ITSELF, scene.parent / CYCLE
    if not link.is_symlink():
        link.symlink_to(link.name)
        cycle.write_text("".join(f"{key}: {CYCLE}\n" for key in ("scene", *REFERENCES)))


def _parts(scene: Path) -> dict[str, list[Path]]:
    """The files of a scene by the kind of part."""
    files = {"scene": [scene]}
    for spot in spots(read_yaml(scene).plain()):
        if is_reference(spot):
            path = Path(os.path.normpath(scene.parent / spot.value))
            files.setdefault(str(spot.key), []).append(path)
    return files


def _mutated(rng: np.random.Generator, mutation: Any, path: Path, as_text: bool) -> tuple[bytes, bool] | None:
    if as_text:
        return mutation(rng, path.read_text(encoding="utf-8"))
    tree = read_yaml(path).plain()
    wrong = mutation(rng, tree)
    if wrong is None:
        return None
    return _dump(tree), wrong


def _dump(tree: Any) -> bytes:
    """YAML of a tree, every value written out."""
    return yaml.dump(tree, Dumper=_Plain, sort_keys=False, allow_unicode=True, default_flow_style=None).encode()


class _Plain(getattr(yaml, "CSafeDumper", yaml.SafeDumper)):
    def ignore_aliases(self, data: Any) -> bool:
        return True
