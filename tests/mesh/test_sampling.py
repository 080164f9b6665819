import numpy as np
import pytest

from taichi_tryon.mesh.sampling import sample_edges
from taichi_tryon.pattern.panel import Pattern, Seam


def rectangle(polygon_panel, name, rights, height=0.3):
    """A rectangle whose right side is divided at these heights [m]: edges e1, e2 ... upwards."""
    heights = [0.0, *rights, height]
    return polygon_panel(name, [[0, 0], *([0.2, y] for y in heights), [0, height]])


def chain(panel: str, count: int) -> tuple[tuple[str, str], ...]:
    return tuple((panel, f"e{i}") for i in range(1, count + 1))


def heights(panel, samples, count):
    """Heights of the samples along the divided right side, upwards, and their knots."""
    points, knots = [], []
    for name in chain(panel.name, count):
        points.append(panel.edge(name[1]).at(samples[name].fractions)[:, 1])
        knots.append(samples[name].knots)
    return points, knots


def test_open_edges_are_divided_evenly_into_segments_no_longer_than_asked(polygon_panel):
    pattern = Pattern("p", {"a": polygon_panel("a", [[0, 0], [0.2, 0], [0.2, 0.3], [0, 0.3]])}, ())
    samples = sample_edges(pattern, 0.02)
    assert len(samples["a", "e0"].fractions) == 11
    assert len(sample_edges(pattern, 0.021)["a", "e0"].fractions) == 11
    assert len(sample_edges(pattern, 0.5)["a", "e0"].fractions) == 2
    assert samples["a", "e0"].seam is None


@pytest.mark.parametrize("reversed_", [True, False])
def test_the_longer_side_of_a_seam_decides(polygon_panel, reversed_):
    a, b = rectangle(polygon_panel, "a", [], 0.3), rectangle(polygon_panel, "b", [], 0.33)
    seam = Seam("s", chain("a", 1), chain("b", 1), reversed=reversed_, ease=0.03)
    samples = sample_edges(Pattern("p", {"a": a, "b": b}, (seam,)), 0.02)
    assert len(samples["a", "e1"].fractions) == len(samples["b", "e1"].fractions) == 18
    knots = samples["b", "e1"].knots
    assert np.array_equal(samples["a", "e1"].knots, knots[::-1] if reversed_ else knots)


def test_corners_near_each_other_meet_and_lone_ones_get_a_partner(polygon_panel):
    a, b = rectangle(polygon_panel, "a", [0.1, 0.2]), rectangle(polygon_panel, "b", [0.103])
    seam = Seam("s", chain("a", 3), chain("b", 2), reversed=False)
    samples = sample_edges(Pattern("p", {"a": a, "b": b}, (seam,)), 0.02)
    (a1, a2, a3), knots_a = heights(a, samples, 3)
    (b1, b2), knots_b = heights(b, samples, 2)
    assert [len(x) for x in (a1, a2, a3)] == [7, 6, 6]  # the longer side's first stretch takes six segments
    assert [len(x) for x in (b1, b2)] == [7, 11]
    assert b1[-1] == pytest.approx(0.103) and knots_a[0][-1] == knots_b[0][-1]
    partner = b2[list(knots_b[1]).index(knots_a[1][-1])]
    assert partner == pytest.approx(0.103 + 0.197 / 2)
    assert list(np.concatenate(knots_a)) == sorted(np.concatenate(knots_a))


def test_chains_against_each_other(polygon_panel):
    """b runs down while a runs up: a's first edge meets b's last."""
    a = rectangle(polygon_panel, "a", [0.05])
    b = polygon_panel("b", [[0, 0], [0.2, 0], [0.2, 0.3], [0, 0.3], [0, 0.18]])  # left side: e3 of 0.12, e4 of 0.18
    seam = Seam("s", chain("a", 2), (("b", "e3"), ("b", "e4")), reversed=True)
    samples = sample_edges(Pattern("p", {"a": a, "b": b}, (seam,)), 0.01)
    height_of: dict[int, set[float]] = {}
    for panel, names in ((a, ("e1", "e2")), (b, ("e3", "e4"))):
        for name in names:
            sample = samples[panel.name, name]
            for knot, y in zip(sample.knots.tolist(), panel.edge(name).at(sample.fractions)[:, 1], strict=True):
                height_of.setdefault(knot, set()).add(round(float(y), 9))
    assert all(len(found) == 1 for found in height_of.values())
    assert {0.05, 0.18} <= {y for found in height_of.values() for y in found}


def test_fractions_rise_from_0_to_1_in_all_shipped_patterns(load):
    for name in ("top_dart_9AR", "jumpsuit_9AR"):
        pattern = load(name)
        for edge, sample in sample_edges(pattern, 0.012).items():
            assert sample.fractions[0] == 0 and sample.fractions[-1] == 1
            assert np.diff(sample.fractions).min() > 0
            steps = np.diff(sample.fractions) * pattern.edge(edge).length
            assert steps.max() <= 0.012 + 1e-7 and np.ptp(steps) < 1e-9
