"""Writes frames, pictures and film of a simulation while it runs, only those that the scene asks for."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from taichi_tryon import stage
from taichi_tryon.observe import Observer
from taichi_tryon.output.frames import FrameWriter, GarmentFrame
from taichi_tryon.output.observation import Observation
from taichi_tryon.units import MM
from taichi_tryon.view.appearance import Scale, skin, value_map

# the film shows the worn shape for so long at its end [s]
FINAL_HOLD = 1.5
MAPS = {
    "strain_warp": ("strain_warp_percent", "warp strain [%]", True),
    "strain_weft": ("strain_weft_percent", "weft strain [%]", True),
    "shear": ("shear_degree", "shear [degree]", True),
    "pressure": ("pressure_kPa", "pressure [kPa]", False),
    "body_pressure": ("body_pressure_kPa", "pressure on the body [kPa]", False),
    "gap": ("gap_mm", "gap [mm]", False),
}


class Recorder:
    """Output of one run into ``folder``, from frame number 0, or on from the ``state`` of an earlier recorder."""

    def __init__(self, observer: Observer, folder: Path, state: dict[str, np.ndarray] | None = None):
        self.observer, self.folder, self.index = observer, folder, 0
        # the pose in which the body was last written, and the frame that holds it
        self._skin_pose: np.ndarray | None = None
        self._skin_frame: int | None = None
        if state is not None:
            self.index, self._skin_pose = int(state["frame_index"]), state["skin_pose"]
            self._skin_frame = int(state["skin_frame"]) if state["skin_frame"] >= 0 else None
        self.setup = observer.simulation.setup
        self.options = self.setup.scene.output
        self.frames = FrameWriter(folder, self.options.formats, keep_before=self.index)
        self.pictures = self.film = self.renderer = self.last_picture = None
        self.renderer_name, self.message = "none", None
        if self.options.images or self.options.video or self.options.maps:
            # what draws is imported where it is needed: a run without pictures starts sooner
            from taichi_tryon.view.renderer import make_renderer

            self.renderer, self.message = make_renderer(tuple(self.options.image_size), self.options.renderer)
            self.renderer_name = self.renderer.name
        try:
            self._prepare_pictures()
        except BaseException:
            self.close()
            raise

    def _prepare_pictures(self) -> None:
        if self.renderer is not None:
            from taichi_tryon.view.pictures import Pictures

            views, bounds = self.options.views, stage.bounds(self.setup)
            self.pictures = Pictures(self.renderer, views, bounds, self.folder, images=self.options.images)
        if self.options.video:
            from taichi_tryon.output.video import VideoWriter

            self.film = VideoWriter(self.folder / "video.mp4", self.options.frames_per_s)
            for index in range(self.index):
                earlier = self.pictures.stored(index)
                if earlier is not None:
                    self._film(earlier)

    def _film(self, picture: np.ndarray) -> None:
        self.last_picture = picture
        self.film.add(picture)

    def record(self) -> None:
        """Write the present instant as the next frame."""
        simulation = self.observer.simulation
        seen = self.observer.observe()
        frames = [self._frame(part, index) for index, part in enumerate(seen)]
        skin, pose = self.observer.skin(), simulation.transforms
        pressed = self.options.body_pressure
        moved = pressed or self._skin_pose is None or not np.array_equal(pose, self._skin_pose)
        new_skin = skin if moved and len(skin[1]) else None
        on_skin = {"pressure_kPa": self.observer.skin_pressure() / 1000} if pressed else None
        self.frames.write(self.index, simulation.progress.time, frames, new_skin, self._skin_frame, on_skin)
        if moved:
            self._skin_pose, self._skin_frame = pose, self.index if new_skin else None
        if self.options.images or self.options.video:
            picture = self.pictures.take(self.index, stage.meshes(self.setup, simulation.stepper.x.to_numpy(), skin))
            if self.film is not None:
                self._film(picture)
        self.index += 1

    def state(self) -> dict[str, np.ndarray]:
        """What is needed to go on, as arrays."""
        return {
            "frame_index": np.array(self.index),
            "skin_pose": np.zeros((0, 4, 4)) if self._skin_pose is None else self._skin_pose,
            "skin_frame": np.array(-1 if self._skin_frame is None else self._skin_frame),
        }

    def _frame(self, seen: Observation, index: int) -> GarmentFrame:
        mesh = self.setup.garments[index].mesh
        points = {
            "velocity_m_s": seen.velocities,
            "pressure_kPa": seen.pressures / 1000,
            "contact_force_N": seen.contact_forces,
        }
        if seen.gaps is not None:
            points["gap_mm"] = seen.gaps / MM
        return GarmentFrame(
            seen.name,
            seen.positions,
            seen.triangles,
            points,
            {**seen.strains, "panel": mesh.panel.astype(np.int32)},
        )

    def finish(self) -> None:
        """Draw the maps of the worn shape and end the film on it."""
        if self.options.maps:
            seen = self.observer.observe()
            for name in self.options.maps:
                self._draw_map(name, seen)
        if self.film is not None:
            if self.last_picture is not None:
                for _ in range(int(FINAL_HOLD * self.options.frames_per_s)):
                    self.film.add(self.last_picture)
            self.film.close()

    def mark(self, spot: np.ndarray, outward: np.ndarray, caption: str) -> None:
        """Draw ``images/failed.png``, whatever the scene asks for: the cloth with a ring around ``spot`` (3,) [m], seen
        from where its normal ``outward`` (3,) points."""
        from taichi_tryon.view.pictures import write_png
        from taichi_tryon.view.renderer import make_renderer
        from taichi_tryon.view.spot import draw_spot

        renderer = self.renderer or make_renderer(tuple(self.options.image_size), self.options.renderer)[0]
        try:
            x = self.observer.simulation.stepper.x.to_numpy()
            low, high = stage.bounds(self.setup)
            bounds = np.minimum(low, x.min(axis=0)), np.maximum(high, x.max(axis=0))
            shapes = stage.meshes(self.setup, x, self.observer.skin())
            write_png(
                self.folder / "images" / "failed.png", draw_spot(renderer, shapes, bounds, spot, outward, caption)
            )
        finally:
            if renderer is not self.renderer:
                renderer.close()

    def close(self) -> None:
        """Keep the film so far and give the renderer back; may be called twice, and must be called in the end: Taichi
        crashes when it is started anew while GGUI is open."""
        try:
            if self.film is not None:
                self.film.close()
        finally:
            if self.renderer is not None:
                self.renderer.close()

    def _draw_map(self, name: str, seen: list[Observation]) -> None:
        key, title, diverging = MAPS[name]
        body = self.observer.skin()
        if name == "body_pressure":
            values = self.observer.skin_pressure() / 1000
            scale = Scale.from_zero(title, values)
            shapes = [skin(*body, scale.colors(values))]
        else:
            frames = [self._frame(part, index) for index, part in enumerate(seen)]
            per_triangle = key in frames[0].cell_data
            values = [(frame.cell_data if per_triangle else frame.point_data)[key] for frame in frames]
            every = np.concatenate(values)
            scale = Scale.from_zero(title, every) if name == "pressure" else Scale.fitting(title, every, diverging)
            shapes = [skin(*body)] if len(body[1]) else []
            for frame, value in zip(frames, values, strict=True):
                shapes.append(value_map(frame.positions, frame.triangles, value, scale, per_triangle))
        self.pictures.take_map(name, shapes, title, scale)
