"""YAML text to a tree that remembers where each key and value stands.

A stricter and safer YAML than PyYAML's own: plain scalars follow YAML 1.2 (``1e-3`` is a number, ``no`` is a text),
keys may not repeat, there are no tags, and depth and size are bounded, with aliases counted as often as they are used.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml

from taichi_tryon.errors import InputError

MAX_NODES = 200_000
MAX_DEPTH = 40
TOO_DEEP = f"nested deeper than {MAX_DEPTH} levels"
MAX_BYTES = 16 * 2**20
LONGEST_KEY = 200
# keys of a place in a message on how a file is written
SHOWN_DEPTH = 6

FLOAT = re.compile(r"[-+]?(?:\d+\.\d*|\.\d+|\d+(?=[eE]))(?:[eE][-+]?\d+)?|[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN)")
_INTEGER = re.compile(r"[-+]?\d{1,300}")
_CONSTANTS = {"": None, "~": None, "null": None, "true": True, "True": True, "false": False, "False": False}
_LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


@dataclass(frozen=True)
class Place:
    """Where something was written. ``folder`` is where relative paths written there start."""

    label: str
    line: int | None
    column: int | None
    folder: Path

    def __str__(self) -> str:
        return self.label if self.line is None else f"{self.label}:{self.line}:{self.column}"


@dataclass
class Node:
    """A value with its place: a scalar, or a list or mapping of Nodes, whose ``keys`` have places of their own.

    ``is_file`` marks the root of a file. ``faults`` say why there is no value where it could not be read.
    """

    value: Any
    place: Place
    keys: dict[str, Place] = field(default_factory=dict)
    is_file: bool = False
    faults: tuple[str, ...] = ()

    def children(self) -> Iterator[tuple[str | int, Node]]:
        if isinstance(self.value, dict):
            yield from self.value.items()
        elif isinstance(self.value, list):
            yield from enumerate(self.value)

    def plain(self) -> Any:
        """The value as plain Python dicts, lists and scalars."""
        if isinstance(self.value, dict):
            return {key: child.plain() for key, child in self.value.items()}
        if isinstance(self.value, list):
            return [child.plain() for child in self.value]
        return self.value


def read_yaml(path: Path, label: str | None = None) -> Node:
    """The tree of a YAML file; ``label`` names the file in messages. Raises InputError."""
    label = label or str(path)
    # os.path, as Path asks the system for names that it refuses to look at
    if not os.path.isfile(path):
        raise InputError(f"{label}: {'not a file' if os.path.exists(path) else 'no such file'}")
    try:
        with path.open("rb") as file:
            data = file.read(MAX_BYTES + 1)
    except OSError as error:
        raise InputError(f"{label}: cannot be read: {error.strerror}") from None
    if len(data) > MAX_BYTES:
        raise InputError(f"{label}:1:1: must not be larger than {MAX_BYTES // 2**20} MiB")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line, column = _line_and_column(data[: error.start].decode("utf-8", errors="replace"))
        raise InputError(f"{label}:{line}:{column}: not UTF-8 text (byte 0x{data[error.start]:02x})") from None
    node = parse_yaml(text, label, path.parent)
    if node.value is None:
        raise InputError(f"{node.place}: empty, but a mapping of keys to values is needed")
    node.is_file = True
    return node


def parse_yaml(text: str, label: str, folder: Path, numbered: bool = True) -> Node:
    """The tree of a YAML text. Without ``numbered`` (one-line texts), places are the label alone. Raises InputError."""
    reader = _Reader(label, folder, numbered)
    control = yaml.reader.Reader.NON_PRINTABLE.search(text)
    if control:
        place = reader.place(*_line_and_column(text[: control.start()]))
        raise InputError(f"{place}: the character U+{ord(control.group()):04X} is not allowed")
    try:
        for event in yaml.parse(text, Loader=_LOADER):
            reader.take(event)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        place = reader.place(mark.line + 1, mark.column + 1) if mark else label
        if "nesting depth" in (error.problem or ""):
            # libyaml's own bound, met where it reads ahead of its events
            raise reader.fault(place, TOO_DEEP) from None
        context = f" ({error.context})" if error.context else ""
        raise reader.fault(place, f"not valid YAML: {error.problem}{context}") from None
    except yaml.YAMLError as error:
        raise InputError(f"{label}: not valid YAML: {error}") from None
    if reader.root is None:
        raise InputError(f"{reader.place(1, 1)}: empty, but a value is needed")
    return reader.root


def _line_and_column(before: str) -> tuple[int, int]:
    return before.count("\n") + 1, len(before) - (before.rfind("\n") + 1) + 1


def _scalar(event: yaml.ScalarEvent) -> Any:
    """The value of a scalar: quoted and block ones are texts, plain ones may be numbers, true, false or null."""
    text = event.value
    if event.style:
        return text
    if text in _CONSTANTS:
        return _CONSTANTS[text]
    if _INTEGER.fullmatch(text):
        return int(text)
    if FLOAT.fullmatch(text):
        return float(re.sub(r"\.(?=inf|nan)", "", text.lower()))
    return text


@dataclass
class _Open:
    """A list or mapping whose end has not been read; ``key`` is the last one, which may wait for its value."""

    node: Node
    anchor: str | None
    size_before: int
    key: str | None = None
    waits: bool = False

    def at(self, innermost: bool) -> str | None:
        """The key or index of what is being read; None where a mapping's next key is. What is read further inside,
        where this is not the ``innermost``, has been put in already."""
        if isinstance(self.node.value, list):
            return str(len(self.node.value) - (not innermost))
        return self.key if self.waits or not innermost else None


class _Reader:
    """Builds the tree from parser events with a stack of its own, so that depth cannot exhaust the interpreter's."""

    def __init__(self, label: str, folder: Path, numbered: bool):
        self.root: Node | None = None
        self._label, self._folder, self._numbered = label, folder, numbered
        self._stack: list[_Open] = []
        self._anchors: dict[str, tuple[Node, int]] = {}
        self._size = 0

    def place(self, line: int, column: int) -> Place:
        return Place(self._label, *((line, column) if self._numbered else (None, None)), self._folder)

    def fault(self, place: Place | str, message: str) -> InputError:
        """What is wrong at a place, with the keys that lead to where the reader is."""
        keys = [part.at(innermost=part is self._stack[-1]) for part in self._stack[:SHOWN_DEPTH]]
        where = ".".join(key for key in keys if key is not None)
        return InputError(f"{place}: {where}: {message}" if where else f"{place}: {message}")

    def take(self, event: yaml.Event) -> None:
        place = self.place(event.start_mark.line + 1, event.start_mark.column + 1)
        if isinstance(event, yaml.DocumentStartEvent) and self.root is not None:
            raise InputError(f"{place}: a second document begins here, but a file holds one")
        if isinstance(event, yaml.NodeEvent):
            self._take_node(event, place)
        elif isinstance(event, yaml.CollectionEndEvent):
            done = self._stack.pop()
            self._remember(done.anchor, done.node, done.size_before)

    def _take_node(self, event: yaml.NodeEvent, place: Place) -> None:
        if getattr(event, "tag", None) not in (None, "!"):
            raise self.fault(place, f"tags are not allowed (got {event.tag})")
        parent = self._stack[-1] if self._stack else None
        if parent and isinstance(parent.node.value, dict) and not parent.waits:
            self._take_key(event, place, parent)
            return
        size_before = self._size
        if isinstance(event, yaml.AliasEvent):
            if event.anchor not in self._anchors:
                raise self.fault(place, f"*{event.anchor} stands for nothing that was complete before it")
            node, size = self._anchors[event.anchor]
        else:
            scalar = isinstance(event, yaml.ScalarEvent)
            node = Node(_scalar(event) if scalar else {} if isinstance(event, yaml.MappingStartEvent) else [], place)
            size = 1
        self._size += size
        if self._size > MAX_NODES:
            raise self.fault(place, f"more than {MAX_NODES} values, aliases counted as often as they are used")
        if isinstance(event, yaml.CollectionStartEvent) and len(self._stack) >= MAX_DEPTH:
            raise self.fault(place, TOO_DEEP)
        self._attach(node, parent)
        if isinstance(event, yaml.CollectionStartEvent):
            self._stack.append(_Open(node, event.anchor, size_before))
        elif isinstance(event, yaml.ScalarEvent):
            self._remember(event.anchor, node, size_before)

    def _take_key(self, event: yaml.NodeEvent, place: Place, parent: _Open) -> None:
        if not isinstance(event, yaml.ScalarEvent) or event.value == "":
            raise self.fault(place, "a key must be a name")
        if len(event.value) > LONGEST_KEY:
            raise self.fault(place, f"a key must be a name of at most {LONGEST_KEY} characters")
        parent.key, parent.waits = event.value, True
        if event.value in parent.node.keys:
            raise self.fault(place, f"this key stood before at {parent.node.keys[event.value]}")
        parent.node.keys[event.value] = place

    def _attach(self, node: Node, parent: _Open | None) -> None:
        if parent is None:
            self.root = node
        elif isinstance(parent.node.value, list):
            parent.node.value.append(node)
        else:
            parent.node.value[parent.key] = node
            parent.waits = False

    def _remember(self, anchor: str | None, node: Node, size_before: int) -> None:
        if anchor:
            self._anchors[anchor] = (node, self._size - size_before)
