"""The cone on its ball, with its parts in files of their own, and a sheet of the same fabric."""

from __future__ import annotations

import pytest
import yaml

from taichi_tryon.bench.stability.mutants import lay_traps


@pytest.fixture
def scenes(make_cone_scene, tmp_path):
    """Paths of two scenes: a dressed garment, a sheet."""
    cone = make_cone_scene()
    garment = cone["garments"][0]
    (tmp_path / "parts").mkdir()
    for whole, key in [(cone, "body"), (cone, "pose"), *((garment, k) for k in ("pattern", "dressing", "fabric"))]:
        (tmp_path / "parts" / f"{key}.yaml").write_text(yaml.safe_dump(whole[key], sort_keys=False))
        whole[key] = f"parts/{key}.yaml"
    strip = {"name": "strip", "sheet": {"size_cm": [30, 10]}, "fabric": "parts/fabric.yaml"}
    sheet = {"scene": "sheet", "garments": [{**strip, "holds": {"top": {"edge": "top"}}}], "mesh": cone["mesh"]}
    paths = [tmp_path / "cone.yaml", tmp_path / "sheet.yaml"]
    for path, scene in zip(paths, (cone, sheet), strict=True):
        path.write_text(yaml.safe_dump(scene, sort_keys=False))
    lay_traps(paths[0])
    return paths
