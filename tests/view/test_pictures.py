import numpy as np
import pytest

from taichi_tryon.errors import RunError
from taichi_tryon.view.appearance import Scale, value_map
from taichi_tryon.view.camera import bounds_of
from taichi_tryon.view.mesh import Mesh
from taichi_tryon.view.pictures import Pictures, read_png

VERTICES = np.array([[0, 0, 0], [1.0, 0, 0.1], [0.2, 1.4, 0], [0.3, 0.2, 0.8]])
TRIANGLES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
MESH = Mesh(VERTICES, TRIANGLES, (0.8, 0.3, 0.2), two_sided=False)


def pictures(raster, folder, **options):
    return Pictures(raster, ["front", "right"], bounds_of([VERTICES]), folder, **options)


def test_each_view_becomes_a_file_and_the_film_shows_them_side_by_side(raster, tmp_path):
    film = pictures(raster, tmp_path).take(12, [MESH])
    assert sorted(path.name for path in (tmp_path / "images").iterdir()) == ["front_0012.png", "right_0012.png"]
    front, right = (read_png(tmp_path / "images" / f"{view}_0012.png") for view in ("front", "right"))
    np.testing.assert_array_equal(film, np.hstack([front, right]))
    assert np.abs(front.astype(int) - right).max() > 50


def test_film_of_a_resumed_run_comes_from_the_files(raster, tmp_path):
    film = pictures(raster, tmp_path).take(0, [MESH], "t = 0 s")
    again = pictures(raster, tmp_path)
    np.testing.assert_array_equal(again.stored(0, "t = 0 s"), film)
    assert again.stored(1) is None
    (tmp_path / "images" / "right_0000.png").write_bytes(b"no picture")
    with pytest.raises(RunError, match="right_0000.png: cannot be read"):
        again.stored(0)


def test_without_images_only_the_film_is_fed(raster, tmp_path):
    assert pictures(raster, tmp_path, images=False).take(0, [MESH]).shape == (120, 320, 3)
    assert not (tmp_path / "images").exists()


def test_map_pictures_have_title_and_bar(raster, tmp_path):
    scale = Scale("height [m]", 0.0, 1.4)
    heights = value_map(VERTICES, TRIANGLES, VERTICES[:, 1], scale)
    pictures(raster, tmp_path).take_map("height", [heights], "height", scale)
    image = read_png(tmp_path / "images" / "height_front.png")
    assert image.shape == (120, 160, 3)
    assert (image[-34:-24].astype(int).max(axis=2) - image[-34:-24].min(axis=2)).max() > 100
