"""One picture for each sheet."""

from taichi_tryon.bench.pareto.plot import plot_pareto
from taichi_tryon.bench.record import told

QUANTITIES = ("cpu_ms", "wall_ms", "position_error", "strain_p99_at_end", "penetration_worst_frame")


def run(vertices, setting, quantities=QUANTITIES):
    where = {"vertices": vertices, "fabric": "table1", "simulator": "ours", "setting": setting}
    return [told("hang", where, quantity, "ms a frame", 0.5 + k, 0.0) for k, quantity in enumerate(quantities)]


def test_a_picture_for_each_sheet_without_what_failed(tmp_path):
    records = [*run(25, "a"), *run(25, "b"), *run(36, "a"), *run(49, "a", ("failed",))]
    written = plot_pareto([told("hang", {"than": "x"}, "times_faster_cpu", "1", 2.0, 0.0), *records], tmp_path)
    assert sorted(path.name for path in written) == ["hang_25_table1.png", "hang_36_table1.png"]
    assert all(path.stat().st_size > 10_000 for path in written)
    assert plot_pareto([], tmp_path) == []
