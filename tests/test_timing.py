"""Where the time goes."""

import pytest

from taichi_tryon import timing
from taichi_tryon.timing import Stopwatch


@pytest.fixture
def pass_time(monkeypatch):
    """Makes seconds pass on the stopwatch's clock."""
    now = [0.0]
    monkeypatch.setattr(timing.time, "perf_counter", lambda: now[0])

    def more(seconds):
        now[0] += seconds

    return more


@pytest.mark.parametrize("whole, outer, inner", [(False, 5.0, 2.0), (True, 7.0, 0.0)])
def test_a_stage_inside_another_counts_once(pass_time, whole, outer, inner):
    clock = Stopwatch()
    with clock("solve", whole=whole):
        pass_time(1.0)
        with clock("contact"):
            pass_time(2.0)
        pass_time(4.0)
    with clock("contact"):
        pass_time(8.0)
    assert clock.seconds == {"solve": outer, "contact": inner + 8.0}


def test_a_fault_ends_its_stages(pass_time):
    clock = Stopwatch()
    with pytest.raises(ValueError), clock("compile", whole=True), clock("contact"):
        pass_time(1.0)
        raise ValueError
    with clock("solve"), clock("contact"):
        pass_time(2.0)
    assert clock.seconds == {"compile": 1.0, "contact": 2.0, "solve": 0.0}
