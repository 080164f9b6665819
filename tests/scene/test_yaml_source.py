"""What the reader takes from YAML, and what it refuses, each with its place."""

import math
from pathlib import Path

import pytest

from taichi_tryon.errors import InputError
from taichi_tryon.scene.yaml_source import MAX_NODES, parse_yaml, read_yaml


def parse(text):
    return parse_yaml(text, "file.yaml", Path("folder"))


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1e-3", 1e-3),
        ("1E+3", 1000.0),
        ("-.5", -0.5),
        ("5.", 5.0),
        (".inf", math.inf),
        ("-.Inf", -math.inf),
        ("12", 12),
        ("-0", 0),
        ("012", 12),
        ("1_000", "1_000"),
        ("1:30", "1:30"),
        ("no", "no"),
        ("true", True),
        ("null", None),
        ("~", None),
        ("2024-01-31", "2024-01-31"),
        ("'12'", "12"),
        ('"true"', "true"),
        ("|\n  12\n", "12\n"),
        ("1e", "1e"),
        (".", "."),
        ("e5", "e5"),
    ],
)
def test_scalars(text, value):
    got = parse(f"key: {text}").plain()["key"]
    assert got == value and type(got) is type(value)


def test_places_of_keys_and_values():
    node = parse("first: 1\nsecond:\n  - {third: [4, 5]}\n")
    third = node.value["second"].value[0]
    assert str(node.value["first"].place) == "file.yaml:1:8"
    assert str(node.keys["second"]) == "file.yaml:2:1"
    assert str(third.keys["third"]) == "file.yaml:3:6"
    assert str(third.value["third"].value[1].place) == "file.yaml:3:17"
    assert node.plain() == {"first": 1, "second": [{"third": [4, 5]}]}


def test_alias_repeats_a_value():
    assert parse("a: &x [1, 2]\nb: *x\nc: &y 3\nd: *y").plain() == {"a": [1, 2], "b": [1, 2], "c": 3, "d": 3}


@pytest.mark.parametrize(
    ("text", "place", "words"),
    [
        ("", "1:1", "empty"),
        ("# nothing\n", "1:1", "empty"),
        ("a: 1\nb: 2\na: 3\n", "3:1", "a: this key stood before at file.yaml:1:1"),
        ("a: 1\n b: 2\n", "2:3", "not valid YAML"),
        ("a: [1, 2\n", "2:1", "not valid YAML"),
        ("a:\n\t- 1\n", "2:1", "not valid YAML"),
        ("a: !!python/object/apply:os.system [ls]\n", "1:4", "tags are not allowed"),
        ("a: 1\n---\nb: 2\n", "2:1", "second document"),
        ("a: &x [*x]\n", "1:8", "stands for nothing"),
        ("a: *y\n", "1:4", "stands for nothing"),
        ("? [1, 2]\n: 3\n", "1:3", "a key must be a name"),
        ("a: 1\nb: x\x00y\n", "2:5", "U+0000"),
    ],
)
def test_refused(text, place, words):
    with pytest.raises(InputError) as caught:
        parse(text)
    assert str(caught.value).startswith(f"file.yaml:{place}: ") and words in str(caught.value)


def test_alias_bomb_is_refused():
    lines = ["a0: &a0 [1, 1, 1, 1, 1, 1, 1, 1, 1, 1]"]
    lines += [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]" for i in range(1, 12)]
    with pytest.raises(InputError, match=rf"file.yaml:6:\d+: a5.\d+: more than {MAX_NODES} values"):
        parse("\n".join(lines))


@pytest.mark.parametrize("count", [50, 100_000])
def test_deep_nesting_is_refused(count):
    with pytest.raises(InputError, match="nested deeper"):
        parse("a: " + "[" * count + "]" * count)


def test_integers_too_long_for_python_stay_text():
    assert parse("a: " + "9" * 5000).plain()["a"] == "9" * 5000


def test_byte_order_mark_and_windows_lines(tmp_path):
    path = tmp_path / "file.yaml"
    path.write_bytes(b"\xef\xbb\xbfa: 1\r\nb: 2\r\n")
    node = read_yaml(path)
    assert node.plain() == {"a": 1, "b": 2} and node.keys["b"].line == 2


def test_not_utf8(tmp_path):
    path = tmp_path / "file.yaml"
    path.write_bytes(b"a: 1\nb: caf\xe9\n")
    with pytest.raises(InputError, match=r"file.yaml:2:7: not UTF-8 text \(byte 0xe9\)"):
        read_yaml(path)


def test_no_file(tmp_path):
    with pytest.raises(InputError, match="absent.yaml: no such file"):
        read_yaml(tmp_path / "absent.yaml")
    with pytest.raises(InputError, match="not a file"):
        read_yaml(tmp_path)
