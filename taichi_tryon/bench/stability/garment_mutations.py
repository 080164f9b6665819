"""Parts that are sound as data and wrong as what they are: patterns that cannot be sewn, bodies that cannot stand.

Each mutation changes the tree of one kind of part in place and says whether no reading of it can be right; None where
this part offers nothing to break so.
"""

from __future__ import annotations

from copy import deepcopy
from typing import Any

import numpy as np


def _any(rng: np.random.Generator, names: Any) -> Any:
    names = list(names)
    return names[rng.integers(len(names))] if names else None


def _panel(rng: np.random.Generator, pattern: dict) -> dict:
    return pattern["panels"][_any(rng, pattern["panels"])]


def seam_of_a_missing_edge(rng: np.random.Generator, pattern: dict) -> bool | None:
    _any(rng, pattern["seams"])["a"][0][rng.integers(2)] = "missing"
    return True


def seam_twice(rng: np.random.Generator, pattern: dict) -> bool | None:
    seam = deepcopy(_any(rng, pattern["seams"]))
    seam["name"] += ["", "_again"][rng.integers(2)]
    pattern["seams"].append(seam)
    return True


def seam_to_itself(rng: np.random.Generator, pattern: dict) -> bool | None:
    seam = _any(rng, pattern["seams"])
    seam["b"] = deepcopy(seam["a"])
    return True


def seam_turned(rng: np.random.Generator, pattern: dict) -> bool | None:
    seam = _any(rng, pattern["seams"])
    seam["direction"] = "reverse" if seam.get("direction") == "same" else "same"
    return True


def area_zero(rng: np.random.Generator, pattern: dict) -> bool | None:
    """All points of a panel on one line, or all in one place."""
    panel, flat = _panel(rng, pattern), bool(rng.integers(2))
    for point in panel.get("points_cm", {}).values():
        point[:] = [point[0], 0] if flat else [1, 1]
    for edge in panel["edges"]:
        for shape in {"line", "curve", "arc"} & set(edge):
            for point in edge[shape]:
                if isinstance(point, list):
                    point[:] = [point[0], 0] if flat else [1, 1]
    return True


def points_swapped(rng: np.random.Generator, pattern: dict) -> bool | None:
    """Two corners of an outline change places: most outlines cross themselves then."""
    points = _panel(rng, pattern).get("points_cm", {})
    if len(points) < 4:
        return None
    one, other = rng.choice(list(points), size=2, replace=False)
    points[one], points[other] = points[other], points[one]
    return False


def outline_open(rng: np.random.Generator, pattern: dict) -> bool | None:
    edges = _panel(rng, pattern)["edges"]
    del edges[rng.integers(len(edges))]
    return True


def edges_in_disorder(rng: np.random.Generator, pattern: dict) -> bool | None:
    edges = _panel(rng, pattern)["edges"]
    if len(edges) < 4:
        return None
    edges[0], edges[2] = edges[2], edges[0]
    return True


def outline_as_a_bow(rng: np.random.Generator, pattern: dict) -> bool | None:
    """A loop that crosses itself once, its two halves of the same area."""
    corners = [[0, 0], [20, 20], [20, 0], [0, 20]]
    sides = zip(corners, corners[1:] + corners[:1], strict=True)
    edges = [{"name": f"side_{i}", "line": [list(a), list(b)]} for i, (a, b) in enumerate(sides)]
    _panel(rng, pattern).update(edges=edges)
    return True


def grain_without_direction(rng: np.random.Generator, pattern: dict) -> bool | None:
    _panel(rng, pattern)["grain"] = [0, 0]
    return True


def bones_in_a_loop(rng: np.random.Generator, body: dict) -> bool | None:
    """The root hangs on the last bone, or a bone on itself."""
    names = list(body["bones"])
    bone = _any(rng, names)
    if rng.integers(2):
        bone, body["bones"][bone]["parent"] = names[0], names[-1]
        body["bones"][names[0]]["parent"] = names[-1]
    else:
        body["bones"][bone]["parent"] = bone
    return True


def two_roots(rng: np.random.Generator, body: dict) -> bool | None:
    if len(body["bones"]) < 2:
        return None
    body["bones"][list(body["bones"])[-1]]["parent"] = None
    return True


def group_without_balls(rng: np.random.Generator, body: dict) -> bool | None:
    body["groups"].append("ghost")
    return True


def group_twice(rng: np.random.Generator, body: dict) -> bool | None:
    body["groups"].append(body["groups"][0])
    return True


def ball_of_no_size(rng: np.random.Generator, body: dict) -> bool | None:
    body["balls"][_any(rng, body["balls"])]["radii_cm"][rng.integers(3)] = [0, -5.0, 1e-9][rng.integers(3)]
    return True


def ball_of_a_missing_bone(rng: np.random.Generator, body: dict) -> bool | None:
    body["balls"][_any(rng, body["balls"])]["bones"] = {"missing": 1}
    return True


def ball_half_carried(rng: np.random.Generator, body: dict) -> bool | None:
    ball = body["balls"][_any(rng, body["balls"])]
    ball["bones"] = {name: 0.3 * share for name, share in ball["bones"].items()}
    return True


def ball_in_a_missing_group(rng: np.random.Generator, body: dict) -> bool | None:
    body["balls"][_any(rng, body["balls"])]["groups"] = ["missing"]
    return True


def landmark_of_a_missing_bone(rng: np.random.Generator, body: dict) -> bool | None:
    if not body.get("landmarks"):
        return None
    body["landmarks"][_any(rng, body["landmarks"])]["bone"] = "missing"
    return True


def joint_missing(rng: np.random.Generator, pose: dict) -> bool | None:
    pose.setdefault("rotations_degree", {})["missing"] = [0, 10, 0]
    return True


def landmark_missing(rng: np.random.Generator, dressing: dict) -> bool | None:
    disk = dressing["disks"][_any(rng, dressing["disks"])]
    disk[["at", "turns_with", "bisects_with"][rng.integers(3)]] = "missing"
    return True


def disk_group_missing(rng: np.random.Generator, dressing: dict) -> bool | None:
    dressing["disks"][_any(rng, dressing["disks"])]["groups"] = ["missing"]
    return True


def disk_missing(rng: np.random.Generator, dressing: dict) -> bool | None:
    dressing["surfaces"][_any(rng, dressing["surfaces"])][0] = "missing"
    return True


def disk_without_direction(rng: np.random.Generator, dressing: dict) -> bool | None:
    disk = dressing["disks"][_any(rng, dressing["disks"])]
    if rng.integers(2):
        disk["start"] = list(disk["normal"])
    else:
        disk[["start", "normal"][rng.integers(2)]] = [0, 0, 0]
    return True


def surface_turned(rng: np.random.Generator, dressing: dict) -> bool | None:
    dressing["surfaces"][_any(rng, dressing["surfaces"])].reverse()
    return True


def panel_missing(rng: np.random.Generator, dressing: dict) -> bool | None:
    name = _any(rng, dressing["panels"])
    dressing["panels"]["missing"] = dressing["panels"][name]
    if rng.integers(2):
        del dressing["panels"][name]
    return True


def edge_missing(rng: np.random.Generator, dressing: dict) -> bool | None:
    dressing["panels"][_any(rng, dressing["panels"])][["top", "bottom"][rng.integers(2)]] = ["missing"]
    return True


def panel_turned(rng: np.random.Generator, dressing: dict) -> bool | None:
    dressing["panels"][_any(rng, dressing["panels"])]["around"].reverse()
    return True


def fabric_without_twist(rng: np.random.Generator, fabric: dict) -> bool | None:
    fabric["bending_bias_gf_cm2_per_cm"] = 1e-4
    return True


def fabric_of_no_mass(rng: np.random.Generator, fabric: dict) -> bool | None:
    fabric["weight_gf_per_cm2"] = [0, -0.03, 1e-300][rng.integers(3)]
    return True


def nobody_wears(rng: np.random.Generator, scene: dict) -> bool | None:
    scene["garments"] = []
    return True


def garment_twice(rng: np.random.Generator, scene: dict) -> bool | None:
    scene["garments"] = scene["garments"] * 2
    return True


def body_missing(rng: np.random.Generator, scene: dict) -> bool | None:
    if "body" not in scene or "sheet" in scene["garments"][0]:
        return None
    del scene["body"]
    return True


def sheet_of_no_area(rng: np.random.Generator, scene: dict) -> bool | None:
    if "sheet" not in scene["garments"][0]:
        return None
    shapes = [{"size_cm": [0, 10]}, {"diameter_cm": -3}, {"outline_cm": [[0, 0], [10, 0], [20, 0]]},
              {"outline_cm": [[0, 0], [10, 10], [10, 0], [0, 10]]}, {"size_cm": [10, 1e-9]}]  # fmt: skip
    scene["garments"][0] = {**scene["garments"][0], "sheet": shapes[rng.integers(len(shapes))], "holds": {}}
    return True


def hold_of_a_missing_edge(rng: np.random.Generator, scene: dict) -> bool | None:
    scene["garments"][0]["holds"] = {"h": [{"edge": "missing"}, {"panel": "missing", "edge": "top"}][rng.integers(2)]}
    return True


def hold_of_nothing(rng: np.random.Generator, scene: dict) -> bool | None:
    if "sheet" not in scene["garments"][0]:
        return None
    scene["garments"][0]["holds"] = {"h": {"disk_cm": [-900, 0, 1]}}
    return True


MUTATIONS = {
    "pattern": (
        seam_of_a_missing_edge, seam_twice, seam_to_itself, seam_turned, area_zero, points_swapped, outline_open,
        edges_in_disorder, outline_as_a_bow, grain_without_direction,
    ),
    "body": (
        bones_in_a_loop, two_roots, group_without_balls, group_twice, ball_of_no_size, ball_of_a_missing_bone,
        ball_half_carried, ball_in_a_missing_group, landmark_of_a_missing_bone,
    ),
    "pose": (joint_missing,),
    "dressing": (
        landmark_missing, disk_group_missing, disk_missing, disk_without_direction, surface_turned, panel_missing,
        edge_missing, panel_turned,
    ),
    "fabric": (fabric_without_twist, fabric_of_no_mass),
    "scene": (
        nobody_wears, garment_twice, body_missing, sheet_of_no_area, hold_of_a_missing_edge, hold_of_nothing,
    ),
}  # fmt: skip
"""By the kind of part."""
