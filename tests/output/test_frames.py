from pathlib import Path
from xml.etree import ElementTree

import meshio
import numpy as np
import pytest

from taichi_tryon.errors import InputError, RunError
from taichi_tryon.output.frames import FrameWriter, GarmentFrame, read_frame


def sheet(name, height=0.0, **changes):
    positions = np.array([[0, 0, height], [1, 0, height], [1, 1, height], [0, 1, height + 0.1]])
    values = dict(
        positions=positions,
        triangles=np.array([[0, 1, 2], [0, 2, 3]]),
        point_data={"velocity": positions * 2, "gap_mm": positions[:, 2] * 1e3},
        cell_data={"strain_warp_percent": np.array([0.5, height])},
    )
    return GarmentFrame(name, **(values | changes))


def test_garments_come_back_as_written(tmp_path):
    garments = [sheet("top"), sheet("trousers", 3.0)]
    FrameWriter(tmp_path).write(0, 0.0, garments)
    for written, read in zip(garments, read_frame(tmp_path / "frames" / "frame_0000.vtu"), strict=True):
        np.testing.assert_array_equal(read.positions, written.positions)
        np.testing.assert_array_equal(read.triangles, written.triangles)
        for kind in ("point_data", "cell_data"):
            assert set(getattr(read, kind)) == set(getattr(written, kind))
            for name, values in getattr(written, kind).items():
                np.testing.assert_array_equal(getattr(read, kind)[name], values)


def test_cells_tell_the_garments_apart(tmp_path):
    FrameWriter(tmp_path).write(0, 0.0, [sheet("top"), sheet("trousers", 3.0)])
    mesh = meshio.read(tmp_path / "frames" / "frame_0000.vtu")
    np.testing.assert_array_equal(mesh.cell_data["garment"][0], [0, 0, 1, 1])
    assert mesh.cells_dict["triangle"][2:].min() == 4


def test_collection_names_existing_files_and_times_after_every_frame(tmp_path):
    writer = FrameWriter(tmp_path)
    for index in range(3):
        writer.write(index, index / 30, [sheet("top")], body=(np.eye(3), np.array([[0, 1, 2]])))
        entries = list(ElementTree.parse(tmp_path / "frames.pvd").getroot().iter("DataSet"))
        assert len(entries) == 2 * (index + 1)
        assert all((tmp_path / entry.attrib["file"]).exists() for entry in entries)
        assert float(entries[-1].attrib["timestep"]) == index / 30


def test_the_body_carries_its_pressure(tmp_path):
    body, writer = (np.eye(3), np.array([[0, 1, 2]])), FrameWriter(tmp_path)
    writer.write(0, 0.0, [sheet("top")], body, body_data={"pressure_kPa": np.array([0.0, 0.5, 2.0])})
    found = meshio.read(tmp_path / "frames" / "body_0000.vtu").point_data
    np.testing.assert_array_equal(found["pressure_kPa"], [0, 0.5, 2])
    with pytest.raises(RunError, match="body: pressure_kPa: 2 values where 3 belong"):
        writer.write(1, 0.0, [sheet("top")], body, body_data={"pressure_kPa": np.zeros(2)})


def test_resumed_run_keeps_earlier_frames_and_replaces_later_ones(tmp_path):
    writer = FrameWriter(tmp_path)
    for index in range(4):
        writer.write(index, float(index), [sheet("top")])
    FrameWriter(tmp_path, keep_before=2).write(2, 2.5, [sheet("top")])
    entries = ElementTree.parse(tmp_path / "frames.pvd").getroot().iter("DataSet")
    assert [float(entry.attrib["timestep"]) for entry in entries] == [0.0, 1.0, 2.5]


def test_other_formats_hold_the_positions(tmp_path):
    written = FrameWriter(tmp_path, ("obj", "ply", "stl")).write(7, 0.0, [sheet("top")])
    assert [path.name for path in written] == ["frame_0007.obj", "frame_0007.ply", "frame_0007.stl"]
    for path in written:
        mesh = meshio.read(path)
        corners = mesh.points[mesh.cells_dict["triangle"]]
        np.testing.assert_allclose(corners, sheet("top").positions[sheet("top").triangles], atol=1e-6)
    assert not (tmp_path / "frames.pvd").exists()


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("where", ["positions", "velocity", "strain_warp_percent"])
def test_what_is_not_finite_is_refused_by_name_and_leaves_nothing(tmp_path, where, bad):
    garment = sheet("top")
    arrays = {"positions": garment.positions, **garment.point_data, **garment.cell_data}
    arrays[where].reshape(-1)[1] = bad
    with pytest.raises(RunError, match=f"frame 3: top: {where}: not a finite number at 1 of"):
        FrameWriter(tmp_path).write(3, 0.0, [garment])
    assert list((tmp_path / "frames").iterdir()) == []


def test_arrays_of_wrong_length_or_missing_in_a_garment_are_refused(tmp_path):
    writer = FrameWriter(tmp_path)
    with pytest.raises(RunError, match="gap_mm: 3 values where 4 belong"):
        writer.write(0, 0.0, [sheet("top", point_data={"gap_mm": np.zeros(3)})])
    with pytest.raises(RunError, match="top and trousers do not both have the arrays strain_warp_percent"):
        writer.write(0, 0.0, [sheet("top"), sheet("trousers", cell_data={})])


def test_a_write_that_fails_keeps_the_old_frame_and_leaves_no_temporary_file(tmp_path, monkeypatch):
    writer = FrameWriter(tmp_path)
    writer.write(0, 0.0, [sheet("top")])
    before = (tmp_path / "frames" / "frame_0000.vtu").read_bytes()

    def half(path, *_, **__):
        Path(path).write_bytes(b"half")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(meshio, "write", half)
    with pytest.raises(RunError, match=r"frame_0000.vtu: cannot be written: No space left on device"):
        writer.write(0, 0.0, [sheet("top", 1.0)])
    assert (tmp_path / "frames" / "frame_0000.vtu").read_bytes() == before
    assert [path.name for path in (tmp_path / "frames").iterdir()] == ["frame_0000.vtu"]


def test_unknown_format_and_unreadable_frame_are_said(tmp_path):
    with pytest.raises(InputError, match="unknown frame format 'fbx'; allowed are vtu, obj, ply, stl"):
        FrameWriter(tmp_path, ("fbx",))
    (tmp_path / "broken.vtu").write_text("<VTKFile")
    with pytest.raises(RunError, match="broken.vtu: cannot be read"):
        read_frame(tmp_path / "broken.vtu")
