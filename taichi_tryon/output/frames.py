"""Frames of a run as mesh files: VTU for ParaView with all arrays, OBJ, PLY and STL with the positions only.

Every file is written under a temporary name and then renamed, so that a reader never meets half a frame.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree import ElementTree

import meshio
import numpy as np

from taichi_tryon.errors import InputError, RunError
from taichi_tryon.output.files import replace_atomically

FORMATS = ("vtu", "obj", "ply", "stl")
GARMENT = "garment"  # cell array that tells the garments of one file apart, by their order
_OPTIONS = {
    "vtu": {"binary": True, "compression": "zlib"},
    "obj": {},
    "ply": {"binary": True},
    "stl": {"binary": True},
}


@dataclass(frozen=True)
class GarmentFrame:
    """One garment at one instant.

    Attributes:
        name: the garment's name in the scene.
        positions: (nv, 3) m.
        triangles: (nt, 3) vertex numbers, outward.
        point_data: arrays (nv,) or (nv, 3) by name, the unit in the name (``pressure_kPa``).
        cell_data: arrays (nt,) by name (``strain_warp_percent``).
    """

    name: str
    positions: np.ndarray
    triangles: np.ndarray
    point_data: Mapping[str, np.ndarray] = field(default_factory=dict)
    cell_data: Mapping[str, np.ndarray] = field(default_factory=dict)


class FrameWriter:
    """Writes ``frames/frame_NNNN.vtu`` (and ``body_NNNN.vtu``) and ``frames.pvd``, ParaView's list of frames and times.

    Args:
        folder: the run's output folder; made where it does not exist.
        formats: any of ``FORMATS``; other formats than VTU hold positions only.
        keep_before: frames of an earlier run with a smaller index stay in ``frames.pvd`` (a resumed run).

    Raises:
        InputError: a format is unknown.
    """

    def __init__(self, folder: Path | str, formats: Sequence[str] = ("vtu",), keep_before: int = 0):
        for name in formats:
            if name not in FORMATS:
                raise InputError(f"formats: unknown frame format {name!r}; allowed are {', '.join(FORMATS)}")
        self.folder = Path(folder)
        self.formats = tuple(formats)
        self.collection = self.folder / "frames.pvd"
        self._entries = _entries_before(self.collection, keep_before)
        try:
            (self.folder / "frames").mkdir(parents=True, exist_ok=True)
        except OSError as fault:
            raise RunError(f"{self.folder}: cannot make the folder of frames: {fault.strerror}") from fault

    def write(
        self,
        index: int,
        time_s: float,
        garments: Sequence[GarmentFrame],
        body: tuple[np.ndarray, np.ndarray] | None = None,
        body_of: int | None = None,
        body_data: Mapping[str, np.ndarray] | None = None,
    ) -> list[Path]:
        """Write one frame and return its files.

        Args:
            index: number of the frame, from 0.
            time_s: simulated time.
            garments: all garments, in the scene's order; all with the same arrays.
            body: (vertices (n, 3) m, triangles (m, 3)), or None.
            body_data: arrays over the body's vertices by name, as a garment's ``point_data``.
            body_of: without a ``body``, the earlier frame whose body is still the one to show.

        Raises:
            RunError: a value is not finite, an array has the wrong length, or the disk refuses.
        """
        for garment in garments:
            _check(index, garment)
        parts = {"frame": _merge(index, garments)}
        if body is not None:
            surface = GarmentFrame("body", *body, body_data or {})
            _check(index, surface)
            cells = [("triangle", np.asarray(body[1], np.int32))]
            parts["body"] = meshio.Mesh(np.asarray(body[0]), cells, point_data=dict(surface.point_data))

        written = []
        for stem, mesh in parts.items():
            for kind in self.formats:
                path = self.folder / "frames" / f"{stem}_{index:04d}.{kind}"
                _write(path, kind, mesh if kind == "vtu" else meshio.Mesh(mesh.points, mesh.cells))
                written.append(path)
        if "vtu" in self.formats:
            self._entries = [entry for entry in self._entries if entry[0] < index]
            shown = [f"{stem}_{index:04d}" for stem in parts]
            if body is None and body_of is not None:
                shown.append(f"body_{body_of:04d}")
            self._entries += [(index, float(time_s), part, stem) for part, stem in enumerate(shown)]
            self._write_collection()
        return written

    def _write_collection(self) -> None:
        root = ElementTree.Element("VTKFile", type="Collection", version="0.1", byte_order="LittleEndian")
        collection = ElementTree.SubElement(root, "Collection")
        for _, time_s, part, stem in self._entries:
            ElementTree.SubElement(
                collection,
                "DataSet",
                timestep=repr(time_s),
                group="",
                part=str(part),
                file=f"frames/{stem}.vtu",
            )
        ElementTree.indent(root)
        text = ElementTree.tostring(root, encoding="unicode", xml_declaration=True)
        replace_atomically(self.collection, lambda path: path.write_text(text + "\n", encoding="utf-8"))


def read_frame(path: Path | str) -> tuple[GarmentFrame, ...]:
    """The garments of a ``frame_NNNN.vtu``, in the order in which they were written; a VTU keeps no names: "0", "1" ...

    Raises:
        RunError: the file cannot be read.
    """
    try:
        mesh = meshio.vtu.read(str(path))  # meshio.read would end the program at a broken file
    except (OSError, ValueError, meshio.ReadError, ElementTree.ParseError) as fault:
        raise RunError(f"{path}: cannot be read as a frame: {fault}") from fault
    triangles = mesh.cells_dict["triangle"]
    cells = {name: values[0] for name, values in mesh.cell_data.items()}
    which = cells.pop(GARMENT, np.zeros(len(triangles), np.int32))
    points = mesh.point_data
    owner = points.pop(GARMENT, np.zeros(len(mesh.points), np.int32))
    frames = []
    for number in range(int(owner.max(initial=-1)) + 1):
        inside, here = owner == number, which == number
        renumber = np.cumsum(inside) - 1
        frames.append(
            GarmentFrame(
                str(number),
                mesh.points[inside],
                renumber[triangles[here]].astype(np.int32),
                {name: values[inside] for name, values in points.items()},
                {name: values[here] for name, values in cells.items()},
            )
        )
    return tuple(frames)


def _write(path: Path, kind: str, mesh: meshio.Mesh) -> None:
    replace_atomically(path, lambda part: meshio.write(part, mesh, file_format=kind, **_OPTIONS[kind]))


def _check(index: int, garment: GarmentFrame) -> None:
    """Refuse what no reader could make sense of, naming frame, garment and array."""
    points, triangles = len(garment.positions), len(garment.triangles)
    arrays = [("positions", garment.positions, points)]
    arrays += [(name, values, points) for name, values in garment.point_data.items()]
    arrays += [(name, values, triangles) for name, values in garment.cell_data.items()]
    for name, values, length in arrays:
        values = np.asarray(values)
        if len(values) != length:
            raise RunError(f"frame {index}: {garment.name}: {name}: {len(values)} values where {length} belong")
        bad = np.flatnonzero(~np.isfinite(values.reshape(length, -1)).all(axis=1))
        if bad.size:
            raise RunError(
                f"frame {index}: {garment.name}: {name}: not a finite number at {bad.size} of {length} places, "
                f"first at {bad[0]}; the frame is not written"
            )


def _merge(index: int, garments: Sequence[GarmentFrame]) -> meshio.Mesh:
    """All garments as one mesh; the array ``garment`` on points and cells tells them apart."""
    first = garments[0]
    for other in garments[1:]:
        for one, two in ((first.point_data, other.point_data), (first.cell_data, other.cell_data)):
            if set(one) != set(two):
                names = ", ".join(sorted(set(one) ^ set(two)))
                raise RunError(f"frame {index}: {first.name} and {other.name} do not both have the arrays {names}")
    starts = np.cumsum([0] + [len(garment.positions) for garment in garments[:-1]])
    triangles = np.concatenate([np.asarray(g.triangles) + start for g, start in zip(garments, starts, strict=True)])
    owner = [np.full(len(g.positions), number, np.int32) for number, g in enumerate(garments)]
    which = [np.full(len(g.triangles), number, np.int32) for number, g in enumerate(garments)]

    def joined(kind: str, name: str) -> np.ndarray:
        return np.concatenate([np.asarray(getattr(garment, kind)[name]) for garment in garments])

    point_data = {name: joined("point_data", name) for name in first.point_data}
    cell_data = {name: [joined("cell_data", name)] for name in first.cell_data}
    return meshio.Mesh(
        np.concatenate([garment.positions for garment in garments]),
        [("triangle", triangles.astype(np.int32))],
        point_data={GARMENT: np.concatenate(owner), **point_data},
        cell_data={GARMENT: [np.concatenate(which)], **cell_data},
    )


def _entries_before(collection: Path, index: int) -> list[tuple[int, float, int, str]]:
    """(frame, time, part, file's stem) of the data sets in an existing ``frames.pvd`` of frames before ``index``."""
    if index <= 0 or not collection.exists():
        return []
    entries = []
    try:
        for item in ElementTree.parse(collection).getroot().iter("DataSet"):
            stem, part = Path(item.attrib["file"]).stem, int(item.attrib["part"])
            # part 0 is the garments' own file; the body's may be that of an earlier frame
            frame = int(stem.rpartition("_")[2]) if part == 0 else entries[-1][0]
            entries.append((frame, float(item.attrib["timestep"]), part, stem))
    except (ElementTree.ParseError, KeyError, ValueError, IndexError) as fault:
        raise RunError(f"{collection}: is not a list of frames ({fault}); remove it to go on") from fault
    return [entry for entry in entries if entry[0] < index]
