import numpy as np
import pytest

from taichi_tryon.errors import InputError
from taichi_tryon.view.annotate import annotate
from taichi_tryon.view.appearance import Scale, cloth, parse_color, value_map

POINTS = np.array([[0, 0, 0], [1.0, 0, 0], [0, 1, 0], [1, 1, 0]])
TRIANGLES = np.array([[0, 1, 2], [1, 3, 2]])


def test_colors_are_read_strictly():
    assert parse_color("#ff0080") == (1.0, 0.0, 128 / 255)
    for text in ("ff0080", "#ff008", "red", "#gg0000", "#ff008011"):
        with pytest.raises(InputError, match='write it as "#rrggbb"'):
            parse_color(text)


def test_plain_cloth_has_no_weave_and_checked_cloth_a_paler_second_yarn():
    rest = POINTS[TRIANGLES][:, :, :2]
    assert cloth(POINTS, TRIANGLES, rest, "#336699").weave is None
    weave = cloth(POINTS, TRIANGLES, rest, "#336699", 0.04).weave
    assert weave.size == 0.04
    assert all(second > first for first, second in zip(parse_color("#336699"), weave.color, strict=True))


def test_scale_runs_from_end_to_end_and_holds_outside():
    scale = Scale("pressure [kPa]", 0.0, 2.0)
    colors = scale.colors(np.array([-1, 0, 1, 2, 3.0]))
    np.testing.assert_array_equal(colors[0], colors[1])
    np.testing.assert_array_equal(colors[3], colors[4])
    assert (np.diff(scale.colors(np.linspace(0, 2, 50)).sum(axis=1)) > 0).all()


def test_fitting_scale_leaves_out_the_extremes_and_a_diverging_one_is_grey_at_zero():
    values = np.concatenate([np.linspace(-1, 3, 1000), [500.0]])
    scale = Scale.fitting("strain warp [%]", values, diverging=True)
    assert 2.5 < scale.high < 3.5
    assert scale.low == -scale.high
    assert np.ptp(scale.colors(np.zeros(1))) < 1e-9
    assert Scale.fitting("x", np.ones(5)).high > 1


def test_values_per_triangle_are_flat_and_per_vertex_smooth():
    scale = Scale("gap [mm]", 0.0, 1.0)
    flat = value_map(POINTS, TRIANGLES, np.array([0.0, 1.0]), scale, per_triangle=True).corner_colors
    assert np.ptp(flat, axis=1).max() == 0
    assert np.abs(flat[0] - flat[1]).max() > 0.3
    smooth = value_map(POINTS, TRIANGLES, np.array([0.0, 1.0, 0.5, 0.2]), scale).corner_colors
    np.testing.assert_array_equal(smooth[0, 1], smooth[1, 0])


def test_annotation_draws_title_and_bar_and_leaves_the_rest():
    image = np.full((240, 320, 3), 230, np.uint8)
    scale = Scale("pressure [kPa]", 0.0, 2.0)
    done = annotate(image, "top: pressure", scale)
    assert (image == 230).all()
    assert (done[:40, :160] < 120).any()
    np.testing.assert_array_equal(done[60:180], 230)
    bar = done[240 - 32 + 5, 90:230].astype(int)
    np.testing.assert_allclose(bar[0], scale.colors(np.array(10 / 160 * 2)) * 255, atol=12)
    assert bar[-1].sum() > bar[0].sum() + 150
