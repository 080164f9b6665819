"""Writes frames, pictures and film of a simulation while it runs, only those that the scene asks for."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from taichi_tryon.observe import Observer
from taichi_tryon.output.frames import FrameWriter, GarmentFrame
from taichi_tryon.output.observation import Observation
from taichi_tryon.output.video import VideoWriter
from taichi_tryon.units import MM
from taichi_tryon.view.appearance import Scale, cloth, skin, value_map
from taichi_tryon.view.camera import bounds_of
from taichi_tryon.view.pictures import Pictures
from taichi_tryon.view.renderer import make_renderer

# the film shows the worn shape for so long at its end [s]
FINAL_HOLD = 1.5
MAPS = {
    "strain_warp": ("strain_warp_percent", "warp strain [%]", True),
    "strain_weft": ("strain_weft_percent", "weft strain [%]", True),
    "shear": ("shear_degree", "shear [degree]", True),
    "pressure": ("pressure_kPa", "pressure [kPa]", False),
    "gap": ("gap_mm", "gap [mm]", False),
}


class Recorder:
    """Output of one run into ``folder``; ``first`` is the number of the first frame still to be written."""

    def __init__(self, observer: Observer, folder: Path, first: int = 0):
        self.observer, self.folder, self.index = observer, folder, first
        self.setup = observer.simulation.setup
        self.options = self.setup.scene.output
        self.frames = FrameWriter(folder, self.options.formats, keep_before=first)
        self.pictures = self.film = None
        self.renderer_name, self.message = "none", None
        if self.options.images or self.options.video or self.options.maps:
            renderer, self.message = make_renderer(tuple(self.options.image_size))
            self.renderer_name = renderer.name
            self.pictures = Pictures(
                renderer, self.options.views, self._bounds(), folder, images=self.options.images
            )
        if self.options.video:
            self.film = VideoWriter(folder / "video.mp4", self.options.frames_per_s)
            for index in range(first):
                earlier = self.pictures.stored(index)
                if earlier is not None:
                    self.film.add(earlier)

    def _bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """A box around the body in all poses of the motion, and the garments' start."""
        motion, body = self.setup.motion, self.setup.body
        reach = []
        for time in np.linspace(0, motion.end_time, 5 if motion.end_time else 1):
            balls = body.posed(motion.transforms(float(time)))
            bounded = np.isfinite(balls.radii).all(axis=1)
            # the skin lies well within the balls' supports
            extent = 0.6 * balls.extents[bounded]
            reach += [balls.centers[bounded] - extent, balls.centers[bounded] + extent]
        return bounds_of([*reach, self.setup.positions])

    def record(self) -> np.ndarray | None:
        """Write the present instant as the next frame; returns the film's picture."""
        simulation = self.observer.simulation
        seen = self.observer.observe()
        frames = [self._frame(part, index) for index, part in enumerate(seen)]
        self.frames.write(self.index, simulation.progress.time, frames, self.observer.skin())
        picture = None
        if self.options.images or self.options.video:
            picture = self.pictures.take(self.index, self.meshes(seen))
            if self.film is not None:
                self.film.add(picture)
        self.index += 1
        return picture

    def _frame(self, seen: Observation, index: int) -> GarmentFrame:
        mesh = self.setup.garments[index].mesh
        return GarmentFrame(
            seen.name,
            seen.positions,
            seen.triangles,
            {
                "velocity_m_s": seen.velocities,
                "pressure_kPa": seen.pressures / 1000,
                "gap_mm": seen.gaps / MM,
            },
            {**seen.strains, "panel": mesh.panel.astype(np.int32)},
        )

    def meshes(self, seen: list[Observation]) -> list:
        """What a picture shows: the body's skin and every garment with its weave."""
        shapes = [skin(*self.observer.skin())]
        for part, garment in zip(seen, self.setup.garments, strict=True):
            look = garment.spec.appearance
            checker = None if look.checker_mm is None else look.checker_mm * MM
            shapes.append(cloth(part.positions, part.triangles, garment.mesh.rest, look.color, checker))
        return shapes

    def finish(self, last_picture: np.ndarray | None) -> None:
        """Draw the maps of the worn shape and close the film on it."""
        if self.options.maps:
            seen = self.observer.observe()
            for name in self.options.maps:
                self._draw_map(name, seen)
        if self.film is not None:
            if last_picture is not None:
                for _ in range(int(FINAL_HOLD * self.options.frames_per_s)):
                    self.film.add(last_picture)
            self.film.close()

    def _draw_map(self, name: str, seen: list[Observation]) -> None:
        key, title, diverging = MAPS[name]
        frames = [self._frame(part, index) for index, part in enumerate(seen)]
        per_triangle = key in frames[0].cell_data
        values = [(frame.cell_data if per_triangle else frame.point_data)[key] for frame in frames]
        scale = Scale.fitting(title, np.concatenate(values), diverging)
        shapes = [skin(*self.observer.skin())]
        for frame, value in zip(frames, values, strict=True):
            shapes.append(value_map(frame.positions, frame.triangles, value, scale, per_triangle))
        self.pictures.take_map(name, shapes, title, scale)
