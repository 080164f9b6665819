"""Files whose data is broken: keys, values and numbers anywhere in the tree, and paths of other files.

Each mutation changes a tree of plain dicts, lists and scalars in place and says whether no reading of it can be right;
None where the tree offers nothing to break so.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

REFERENCES = ("body", "pose", "pattern", "dressing", "fabric")
LINK_TO_ITSELF, CYCLE = "ring.yaml", "cycle.yaml"
"""Files that lie beside every mutated scene: a symbolic link to itself, and a part that names itself as all its
parts."""


@dataclass
class Spot:
    """A value in a tree: that of ``key`` in ``parent``; ``path`` leads there."""

    parent: dict | list
    key: str | int
    path: tuple[str | int, ...]

    @property
    def value(self) -> Any:
        return self.parent[self.key]

    @value.setter
    def value(self, new: Any) -> None:
        self.parent[self.key] = new


def spots(tree: Any, path: tuple[str | int, ...] = ()) -> Iterator[Spot]:
    """Every value below the root."""
    children = tree.items() if isinstance(tree, dict) else enumerate(tree) if isinstance(tree, list) else ()
    for key, child in list(children):
        yield Spot(tree, key, (*path, key))
        yield from spots(child, (*path, key))


def pick(rng: np.random.Generator, tree: Any, wanted: Callable[[Spot], bool]) -> Spot | None:
    """A random spot that is ``wanted``, of whatever depth."""
    found = [spot for spot in spots(tree) if wanted(spot)]
    return found[rng.integers(len(found))] if found else None


def is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _number(rng: np.random.Generator, tree: Any) -> Spot | None:
    return pick(rng, tree, lambda spot: is_number(spot.value))


def key_gone(rng: np.random.Generator, tree: Any) -> bool | None:
    spot = pick(rng, tree, lambda spot: isinstance(spot.parent, dict))
    if spot is None:
        return None
    del spot.parent[spot.key]
    return False


def key_misspelt(rng: np.random.Generator, tree: Any) -> bool | None:
    spot = pick(rng, tree, lambda spot: isinstance(spot.parent, dict))
    if spot is None:
        return None
    spot.parent[f"{spot.key}x"] = spot.parent.pop(spot.key)
    return False


def key_more(rng: np.random.Generator, tree: Any) -> bool | None:
    tree["unheard_of"] = 1
    return True


def number_of_wrong_type(rng: np.random.Generator, tree: Any) -> bool | None:
    spot = _number(rng, tree)
    if spot is None:
        return None
    spot.value = [f"{spot.value}", "ten", {}, {"a": 1}, [], [spot.value] * 7, True, f"{spot.value} cm"][rng.integers(8)]
    return True


def value_of_wrong_type(rng: np.random.Generator, tree: Any) -> bool | None:
    spot = pick(rng, tree, lambda spot: not is_number(spot.value))
    if spot is None:
        return None
    spot.value = [3, -1.5, "ten", {}, {"a": 1}, [], [1, 2], ["a", "b"], True, None, ""][rng.integers(11)]
    return False


def not_a_number(rng: np.random.Generator, tree: Any) -> bool | None:
    spot = _number(rng, tree)
    if spot is None:
        return None
    spot.value = float("nan")
    return True


def infinite(rng: np.random.Generator, tree: Any) -> bool | None:
    """Only radii of balls may be infinite: of cylinders and slabs."""
    spot = _number(rng, tree)
    if spot is None:
        return None
    spot.value = [float("inf"), float("-inf")][rng.integers(2)]
    return "radii_cm" not in spot.path or spot.value < 0


def huge(rng: np.random.Generator, tree: Any) -> bool | None:
    """No length, force or count of a garment has twelve digits."""
    spot = _number(rng, tree)
    if spot is None:
        return None
    power = int(rng.integers(12, 308))
    spot.value = [10**power, -(10**power), 10.0**power, -(10.0**power)][rng.integers(4)]
    return True


def large(rng: np.random.Generator, tree: Any) -> bool | None:
    spot = _number(rng, tree)
    if spot is None:
        return None
    spot.value = spot.value * 10.0 ** int(rng.integers(2, 9))
    return False


def tiny(rng: np.random.Generator, tree: Any) -> bool | None:
    spot = _number(rng, tree)
    if spot is None:
        return None
    spot.value = spot.value * 10.0 ** -int(rng.integers(3, 308))
    return False


def negative(rng: np.random.Generator, tree: Any) -> bool | None:
    spot = _number(rng, tree)
    if spot is None:
        return None
    spot.value = -spot.value
    return False


def zero(rng: np.random.Generator, tree: Any) -> bool | None:
    spot = _number(rng, tree)
    if spot is None:
        return None
    spot.value = [0, 0.0, -0.0][rng.integers(3)]
    return False


def list_shorter_or_longer(rng: np.random.Generator, tree: Any) -> bool | None:
    spot = pick(rng, tree, lambda spot: isinstance(spot.value, list) and spot.value)
    if spot is None:
        return None
    spot.value = [spot.value[1:], spot.value + spot.value[:1], [], spot.value * 1000][rng.integers(4)]
    return False


def values_swapped(rng: np.random.Generator, tree: Any) -> bool | None:
    """Two values of the same kind, from anywhere."""
    one = pick(rng, tree, lambda spot: not isinstance(spot.value, dict | list))
    if one is None:
        return None
    other = pick(rng, tree, lambda spot: type(spot.value) is type(one.value))
    one.value, other.value = other.value, one.value
    return False


def name_unknown(rng: np.random.Generator, tree: Any) -> bool | None:
    spot = pick(rng, tree, lambda spot: isinstance(spot.value, str))
    if spot is None:
        return None
    spot.value = ["nobody", "", "a b", "é" * 300, "../..", "a\x00b", "a\nb"][rng.integers(7)]
    return False


REFERENCES = ("body", "pose", "pattern", "dressing", "fabric")


def path_wrong(rng: np.random.Generator, tree: Any) -> bool | None:
    """A reference to what is no part: nothing, a folder, a device, a link to itself, a name that no file has, or a file
    that refers to itself."""
    spot = _reference(rng, tree)
    if spot is None:
        return None
    spot.value = ["none.yaml", ".", "/dev/zero", LINK_TO_ITSELF, "x" * 5000, "a\x00.yaml", "~/x.yaml",
                  "https://example.com/x.yaml", CYCLE][rng.integers(9)]  # fmt: skip
    return True


def path_of_another_kind(rng: np.random.Generator, tree: Any) -> bool | None:
    """A part of another kind."""
    spot = _reference(rng, tree)
    others = [other.value for other in spots(tree) if is_reference(other) and spot and other.key != spot.key]
    if not others:
        return None
    spot.value = others[rng.integers(len(others))]
    return True


def is_reference(spot: Spot) -> bool:
    return spot.key in REFERENCES and isinstance(spot.value, str) and spot.value.endswith(".yaml")


def _reference(rng: np.random.Generator, tree: Any) -> Spot | None:
    return pick(rng, tree, is_reference)


MUTATIONS = (
    key_gone, key_misspelt, key_more, number_of_wrong_type, value_of_wrong_type, not_a_number, infinite, huge, large,
    tiny, negative, zero, list_shorter_or_longer, values_swapped, name_unknown, path_wrong, path_of_another_kind,
)  # fmt: skip
