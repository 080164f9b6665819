"""Files broken as text: what editors, disks and malice do to YAML before it is any data.

Each mutation takes a random generator and the text of a file and gives the new bytes, and whether no reading of them
can be right; None where the text offers nothing to break so.
"""

from __future__ import annotations

import numpy as np

Broken = tuple[bytes, bool]


def empty(rng: np.random.Generator, text: str) -> Broken:
    return [b"", b"\n\n", b"# nothing\n", b"\xef\xbb\xbf", b"---\n", b"null\n"][rng.integers(6)], True


def other_root(rng: np.random.Generator, text: str) -> Broken:
    return [b"- 1\n- 2\n", b"42\n", b"text\n", b"[]\n", b"true\n", b".nan\n"][rng.integers(6)], True


def truncated(rng: np.random.Generator, text: str) -> Broken:
    return text.encode()[: rng.integers(1, len(text))], False


def line_gone(rng: np.random.Generator, text: str) -> Broken:
    lines = text.splitlines(keepends=True)
    del lines[rng.integers(len(lines))]
    return "".join(lines).encode(), False


def line_twice(rng: np.random.Generator, text: str) -> Broken:
    lines = text.splitlines(keepends=True)
    line = rng.integers(len(lines))
    return "".join(lines[: line + 1] + lines[line:]).encode(), False


def lines_swapped(rng: np.random.Generator, text: str) -> Broken:
    lines = text.splitlines(keepends=True)
    one, other = rng.integers(len(lines), size=2)
    lines[one], lines[other] = lines[other], lines[one]
    return "".join(lines).encode(), False


def character(rng: np.random.Generator, text: str) -> Broken:
    at = rng.integers(len(text))
    new = rng.choice(list("{}[]:,-#&*!|>'\"%@`?~\t\\ 0é\u2028"))
    return (text[:at] + str(new) + text[at + 1 :]).encode(), False


def tabs(rng: np.random.Generator, text: str) -> Broken | None:
    """Every indentation by tabs."""
    lines = text.splitlines(keepends=True)
    indented = [line for line in lines if line.startswith("  ") and not line.lstrip().startswith("#")]
    if not indented:
        return None
    return "".join(line.replace("  ", "\t") if line.startswith("  ") else line for line in lines).encode(), True


def binary(rng: np.random.Generator, text: str) -> Broken:
    data, at = text.encode(), rng.integers(len(text))
    return data[:at] + [b"\xff", b"\x00", b"\x1b", b"\xc3\x28", b"\xed\xa0\x80"][rng.integers(5)] + data[at:], True


def noise(rng: np.random.Generator, text: str) -> Broken:
    return rng.bytes(int(rng.integers(8, 4096))), True


def key_twice(rng: np.random.Generator, text: str) -> Broken | None:
    """The file's first key again at its end."""
    keys = [line for line in text.splitlines() if line[:1].isalpha() and ":" in line]
    if not keys:
        return None
    return (text.rstrip("\n") + f"\n{keys[0].partition(':')[0]}: 1\n").encode(), True


def _appended(text: str, more: str) -> Broken:
    return (text.rstrip("\n") + "\n" + more).encode(), True


def bomb_of_aliases(rng: np.random.Generator, text: str) -> Broken:
    width, depth = rng.integers(4, 12), rng.integers(8, 30)
    lines = [f"bomb0: &b0 [{', '.join(['1'] * width)}]"]
    lines += [f"bomb{i}: &b{i} [{', '.join([f'*b{i - 1}'] * width)}]" for i in range(1, depth)]
    return _appended(text, "\n".join(lines) + "\n")


def bomb_of_depth(rng: np.random.Generator, text: str) -> Broken:
    depth, (opening, closing) = 10 ** int(rng.integers(2, 6)), [("[", "]"), ("{a: ", "}")][rng.integers(2)]
    return _appended(text, f"bomb: {opening * depth}{closing * depth}\n")


def bomb_of_width(rng: np.random.Generator, text: str) -> Broken:
    return _appended(text, f"bomb: [{'1, ' * 10 ** int(rng.integers(5, 7))}]\n")


def bomb_of_text(rng: np.random.Generator, text: str) -> Broken:
    """One long scalar: as a key, a value, or a number of as many digits."""
    long = "9" * 10 ** int(rng.integers(4, 8))
    return _appended(text, [f"bomb: {long}\n", f"? {long}\n: 1\n", f"bomb: '{long}'\n"][rng.integers(3)])


def recursive_alias(rng: np.random.Generator, text: str) -> Broken:
    return _appended(text, ["bomb: &a [*a]\n", "bomb: &a {b: *a}\n", "bomb: *nowhere\n"][rng.integers(3)])


def tag(rng: np.random.Generator, text: str) -> Broken:
    choices = ["!!python/object/apply:os.system ['true']", "!!python/name:os.system", "!!binary aGk=", "!own {a: 1}"]
    return _appended(text, f"tagged: {choices[rng.integers(len(choices))]}\n")


def merge_key(rng: np.random.Generator, text: str) -> Broken:
    return _appended(text, "<<: {merged: 1}\n")


def two_documents(rng: np.random.Generator, text: str) -> Broken:
    return _appended(text, "---\n" + text)


def unclosed(rng: np.random.Generator, text: str) -> Broken:
    return _appended(text, ['open: "text\n', "open: [1, 2\n", "open: {a: 1\n", "open: 'it\n"][rng.integers(4)])


def odd_key(rng: np.random.Generator, text: str) -> Broken:
    """Keys that would make a message of several lines, of colours or of no end."""
    return _appended(text, ['"a\\nb": 1\n', '"\\e[31mred": 1\n', f"{'k' * 900}: 1\n", '"": 1\n'][rng.integers(4)])


def directive(rng: np.random.Generator, text: str) -> Broken:
    return ("%YAML 9.9\n---\n" + text).encode(), False


MUTATIONS = (
    empty, other_root, truncated, line_gone, line_twice, lines_swapped, character, tabs, binary, noise, key_twice,
    bomb_of_aliases, bomb_of_depth, bomb_of_width, bomb_of_text, recursive_alias, tag, merge_key, two_documents,
    unclosed, odd_key, directive,
)  # fmt: skip
