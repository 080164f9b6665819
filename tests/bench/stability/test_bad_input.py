"""Broken files of a small scene: every one is accepted rightly or refused by file, line and field."""

from pathlib import Path

import pytest

from taichi_tryon.bench.stability import bad_input, garment_mutations, text_mutations, value_mutations
from taichi_tryon.bench.stability.judge import Verdict, is_placed, judge
from taichi_tryon.bench.stability.mutants import Mutant, laid_out, mutants
from taichi_tryon.bench.stability.watch import Crashed, Hung, Watched


def test_the_sound_scenes_are_accepted(scenes):
    for scene in scenes:
        assert judge(scene, build=True) == Verdict("accepted", "built")


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_broken_files_are_refused_by_name(scenes, seed):
    made = list(mutants(scenes, 60, seed))
    found = [fault for mutant in made for fault in bad_input.tried(mutant, judge)[1]]
    assert len(made) >= 50 and not found, "\n".join(map(str, found))


def test_mutants_are_the_same_for_the_same_seed_and_every_file_is_sound_again(scenes):
    first, again = (list(mutants(scenes, 30)) for _ in range(2))
    assert first == again and len({mutant.kind for mutant in first}) > 15
    assert {mutant.path.name for mutant in first} >= {"cone.yaml", "body.yaml", "pattern.yaml", "fabric.yaml"}
    for mutant in first:
        before = mutant.path.read_bytes()
        with laid_out(mutant) as scene:
            assert scene in scenes and mutant.path.read_bytes() == mutant.data != before
        assert mutant.path.read_bytes() == before
    assert first != list(mutants(scenes, 30, seed=1))


def test_no_mutation_is_listed_twice():
    parts = [mutation for part in garment_mutations.MUTATIONS.values() for mutation in part]
    everything = [*text_mutations.MUTATIONS, *value_mutations.MUTATIONS, *parts]
    assert len(set(everything)) == len(everything) > 70


def test_what_is_wrong_and_accepted_is_found(scenes):
    scene = scenes[0]
    mutant = Mutant(0, scene, scene, "sound", scene.read_bytes() + b"# more\n", wrong=True)
    assert bad_input.tried(mutant, judge)[1] == [("wrong_data_accepted", "as built")]
    assert bad_input.tried(mutant, lambda *_: Verdict("broken", "read", ("x was accepted",)))[1][0][0] == (
        "wrong_data_accepted"
    )
    broken = Verdict("broken", "read", ("Traceback (most recent call last): ...",))
    assert bad_input.tried(mutant, lambda *_: broken)[1][0][0] == "tracebacks"
    refused = Verdict("refused", "read", ("a.yaml:1:2: mesh: bad", "somewhere: bad"))
    assert bad_input.tried(mutant, lambda *_: refused)[1] == [("messages_without_a_place", "somewhere: bad")]


@pytest.mark.parametrize(
    ("message", "placed"),
    [
        ("dir/a.yaml:3:4: mesh.edge_length_mm: must be a finite number (got NaN)", True),
        ("a.yaml:3:4: bending_warp_:f_cm2: unknown key", True),
        ("a.yaml:3:4: not valid YAML: found a tab", True),
        ("a.yaml:3:4: something is wrong", False),
        ("a.yaml: mesh: something is wrong", False),
        ("a.yaml:3:4: mesh: red \x1b[31m", False),
        ("a.yaml:3:4: mesh: two\nlines", False),
        ("a.yaml:3:4: mesh: " + "x" * 2000, False),
    ],
)
def test_places_of_messages(message, placed):
    assert is_placed(message) == placed


def test_hanging_and_crashing_calls_are_ended():
    # what the other process calls must be found there by its name, as nothing in tests need be
    with Watched(eval, limit_s=0.3) as watched:
        assert watched("6 * 7") == 42
        with pytest.raises(Hung):
            watched("sum(iter(int, 1))")  # for ever
        with pytest.raises(Crashed, match="exit code 7"):
            watched("__import__('os')._exit(7)")
        assert watched("6 * 7") == 42


def test_the_shipped_scenes_are_there():
    for name in bad_input.SCENES:
        assert (Path(__file__).parents[3] / "configs" / f"{name}.yaml").is_file()
