import imageio.v3 as iio
import numpy as np
import pytest

from taichi_tryon.errors import RunError
from taichi_tryon.output.video import VideoWriter


def picture(level, height=64, width=96):
    image = np.full((height, width, 3), 40, np.uint8)
    image[:, : width // 2] = level
    return image


def test_film_holds_the_pictures_in_order(tmp_path):
    with VideoWriter(tmp_path / "video.mp4", fps=25) as film:
        for level in (60, 120, 180, 240):
            film.add(picture(level))
        assert not (tmp_path / "video.mp4").exists()
    frames = iio.imread(tmp_path / "video.mp4", plugin="pyav")
    assert frames.shape == (4, 64, 96, 3)
    np.testing.assert_allclose(frames[:, 32, 10].mean(axis=1), [60, 120, 180, 240], atol=6)
    np.testing.assert_allclose(frames[:, 32, 80].mean(axis=1), 40, atol=6)
    assert iio.immeta(tmp_path / "video.mp4", plugin="pyav")["codec"] == "h264"
    assert iio.immeta(tmp_path / "video.mp4", plugin="pyav")["fps"] == 25
    assert [path.name for path in tmp_path.iterdir()] == ["video.mp4"]


def test_odd_sizes_are_made_even(tmp_path):
    with VideoWriter(tmp_path / "video.mp4") as film:
        film.add(picture(100, 63, 97))
    assert iio.imread(tmp_path / "video.mp4", plugin="pyav").shape[1:] == (64, 98, 3)


def test_wrong_pictures_are_refused_and_no_picture_gives_no_film(tmp_path):
    film = VideoWriter(tmp_path / "video.mp4")
    with pytest.raises(RunError, match="uint8"):
        film.add(np.zeros((4, 4, 3)))
    film.close()
    assert list(tmp_path.iterdir()) == []
    film.add(picture(10))
    with pytest.raises(RunError, match="picture 1 is"):
        film.add(picture(10, 32, 32))
    film.close()
