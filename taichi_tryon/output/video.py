"""The film of a run: H.264 in MP4, playable everywhere."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import imageio.v3 as iio
import numpy as np
from av.error import FFmpegError

from taichi_tryon.errors import RunError


class VideoWriter:
    """Writes an MP4 (H.264, yuv420p) picture by picture; a context manager.

    The film grows under a temporary name and gets its own at ``close``; without a picture no file appears.

    Args:
        path: the film, ``*.mp4``; an older one is replaced at ``close``.
        fps: pictures per second of film.
    """

    def __init__(self, path: Path | str, fps: float = 30):
        self.path = Path(path)
        self.fps = fps
        self.count = 0
        self._temporary = self.path.with_name(f".{self.path.stem}.part{self.path.suffix}")
        self._file = None
        self._shape: tuple[int, int] | None = None

    def add(self, rgb: np.ndarray) -> None:
        """Append a picture, uint8 (h, w, 3); all of one size.

        H.264 wants even sizes: an odd last row or column is doubled.

        Raises:
            RunError: wrong type or size, or the encoder refuses.
        """
        if rgb.dtype != np.uint8 or rgb.ndim != 3 or rgb.shape[2] != 3:
            raise RunError(f"{self.path}: a film's picture is uint8 (h, w, 3), not {rgb.dtype} {rgb.shape}")
        if self._shape is None:
            self._open(rgb.shape[:2])
        if rgb.shape[:2] != self._shape:
            raise RunError(f"{self.path}: picture {self.count} is {rgb.shape[:2]}, the ones before {self._shape}")
        height, width = self._shape
        if height % 2 or width % 2:
            rgb = np.pad(rgb, ((0, height % 2), (0, width % 2), (0, 0)), mode="edge")
        with self._refusals():
            self._file.write_frame(np.ascontiguousarray(rgb))
        self.count += 1

    def close(self) -> None:
        """Finish the file; may be called twice. Raises RunError where the disk refuses."""
        if self._file is not None:
            file, self._file = self._file, None
            with self._refusals():
                file.close()
                self._temporary.replace(self.path)

    def __enter__(self) -> VideoWriter:
        return self

    def __exit__(self, *_) -> None:
        self.close()

    def _open(self, shape: tuple[int, int]) -> None:
        with self._refusals():
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._file = iio.imopen(self._temporary, "w", plugin="pyav")
            self._file.init_video_stream("libx264", fps=self.fps, pixel_format="yuv420p")
        self._shape = shape

    @contextmanager
    def _refusals(self) -> Iterator[None]:
        """What disk and encoder refuse, as one line."""
        try:
            yield
        except (OSError, ValueError, FFmpegError) as fault:
            raise RunError(f"{self.path}: the film cannot be written: {fault}") from fault
