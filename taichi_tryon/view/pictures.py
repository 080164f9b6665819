"""The pictures of a run: each frame from several views, as PNG files and side by side for the film."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image

from taichi_tryon.errors import RunError
from taichi_tryon.output.files import replace_atomically
from taichi_tryon.view.annotate import annotate
from taichi_tryon.view.appearance import Scale
from taichi_tryon.view.camera import view_cameras
from taichi_tryon.view.mesh import Mesh
from taichi_tryon.view.renderer import Renderer


class Pictures:
    """Takes ``images/VIEW_NNNN.png``.

    Args:
        renderer: draws pictures of one size.
        views: names from ``camera.VIEWS``, in the order in which the film shows them.
        bounds: (lowest, highest) corner of all that is ever seen, m: the cameras stand still.
        folder: the run's output folder.
        images: write PNG files; without them pictures go to the film only.
    """

    def __init__(
        self,
        renderer: Renderer,
        views: Sequence[str],
        bounds: tuple[np.ndarray, np.ndarray],
        folder: Path | str,
        images: bool = True,
    ):
        self.renderer = renderer
        width, height = renderer.size
        self.cameras = view_cameras(views, bounds, width / height)
        self.folder = Path(folder) / "images"
        self.images = images

    def take(self, index: int, meshes: Sequence[Mesh], caption: str = "") -> np.ndarray:
        """Draw one instant from all views; the picture for the film, uint8 (h, views * w, 3)."""
        draw = self.renderer.prepare(meshes)
        pictures = []
        for view, camera in self.cameras.items():
            picture = self.renderer.render(draw, camera)
            if self.images:
                write_png(self.folder / f"{view}_{index:04d}.png", picture)
            pictures.append(picture)
        return annotate(np.hstack(pictures), caption)

    def take_map(self, name: str, meshes: Sequence[Mesh], title: str, scale: Scale) -> None:
        """Draw meshes coloured by a quantity from all views as ``images/NAME_VIEW.png``, with title and colour bar."""
        draw = self.renderer.prepare(meshes)
        for view, camera in self.cameras.items():
            write_png(self.folder / f"{name}_{view}.png", annotate(self.renderer.render(draw, camera), title, scale))

    def stored(self, index: int, caption: str = "") -> np.ndarray | None:
        """The film's picture of an earlier ``take``, from the PNG files; None where one is missing (a resumed run)."""
        paths = [self.folder / f"{view}_{index:04d}.png" for view in self.cameras]
        if not all(path.exists() for path in paths):
            return None
        pictures = [read_png(path) for path in paths]
        if any(picture.shape[:2] != self.renderer.size[::-1] for picture in pictures):
            return None
        return annotate(np.hstack(pictures), caption)


def write_png(path: Path, image: np.ndarray) -> None:
    """Write uint8 (h, w, 3); folders are made, nobody meets half a file.

    Raises:
        RunError: the disk refuses.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as fault:
        raise RunError(f"{path.parent}: cannot make the folder: {fault.strerror}") from fault
    replace_atomically(path, lambda part: Image.fromarray(image).save(part, compress_level=4))


def read_png(path: Path) -> np.ndarray:
    """uint8 (h, w, 3).

    Raises:
        RunError: not a picture.
    """
    try:
        with Image.open(path) as picture:
            return np.asarray(picture.convert("RGB"))
    except OSError as fault:
        raise RunError(f"{path}: cannot be read as a picture: {fault}") from fault
