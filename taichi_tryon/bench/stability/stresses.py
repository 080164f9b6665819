"""What the grid tries: scenes of a few hundred vertices, and what each of them is put through, one thing at a time."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

HANG, BALL, HEAP, WORN = "hanging sheet", "sheet on a ball", "heap of folds", "worn top"
SCENES = {
    HANG: ("validation/hang.yaml", ("mesh.edge_length_mm=50", "drape.duration_s=1")),
    BALL: ("validation/drop_on_sphere.yaml", ("mesh.edge_length_mm=62.5", "drape.duration_s=1")),
    HEAP: ("validation/heap.yaml", ()),
    WORN: ("scenes/quick.yaml", ("mesh.edge_length_mm=40", "drape.duration_s=0.2", "output.images=false")),
}
"""Name: file below ``configs``, and values set as by ``--set``."""

TENSILE = ("tensile_warp_gf_per_cm", "tensile_weft_gf_per_cm", "shear_gf_per_cm_degree")
BENDING = ("bending_warp_gf_cm2_per_cm", "bending_weft_gf_cm2_per_cm", "bending_bias_gf_cm2_per_cm")
WEIGHT = ("weight_gf_per_cm2",)
CROSSING, CRAMPED = ("folded", 0.0), (("squashed", 0.01),)
"""Starts that are refused before they begin where cloth feels cloth, and those in which it may find no room: layers 1
mm thick, all within 2 mm."""


@dataclass(frozen=True)
class Change:
    """What makes a stress of a scene: values set as by ``--set``, factors of figures of the fabric, and a start that no
    key of a scene can express: a function of ``starts`` with its arguments. ``may_refuse``: where physics may say no,
    so that the run may end as failed, with a reason and all that was good kept."""

    settings: tuple[str, ...] = ()
    fabric: Mapping[str, float] = field(default_factory=dict)
    start: tuple = ()
    may_refuse: bool = False


@dataclass(frozen=True)
class Cell:
    """A scene under a stress of a level."""

    scene: str
    stress: str
    level: str
    change: Change
    quick: bool


def cells(quick: bool) -> Iterator[Cell]:
    """All cells, the scenes of a stress in turn; where ``quick``, the mildest and the harshest level of each stress on
    the two cheapest scenes."""
    for stress, levels in STRESSES.items():
        names = list(levels)
        for level, by_scene in levels.items():
            for scene in SCENES:
                change = by_scene.get(scene) if isinstance(by_scene, dict) else by_scene
                brief = scene in (HANG, BALL) and level in (names[0], names[-1]) and stress not in SLOW
                if change is not None and (brief or not quick):
                    yield Cell(scene, stress, level, change, brief)


def _set(*settings: str, **others) -> Change:
    return Change(settings, **others)


def _times(keys: tuple[str, ...], *factors: float) -> dict[str, Change]:
    return {f"x {factor:g}": Change(fabric=dict.fromkeys(keys, factor)) for factor in factors}


def _sheets(**starts: tuple) -> dict[str, dict[str, Change]]:
    """Starts of all scenes of a sheet. Where cloth feels cloth, it may be said that there is no room for it."""
    return {
        name.replace("_", " "): {
            scene: Change(start=start, may_refuse=scene == HEAP and start in CRAMPED)
            for scene in (HANG, BALL, HEAP)
            if (scene, start) != (HEAP, CROSSING)
        }
        for name, start in starts.items()
    }


def _led(pose: str, path: str, seconds: float, after: float = 0.3) -> dict[str, Change]:
    """Body, or where there is none the hold, led somewhere, where it then rests."""

    def steps(step: str) -> str:
        return f"[{{{step}, duration_s: {seconds:g}}}, {{{step}, duration_s: {after:g}}}]"

    body = _set("drape.duration_s=0.3", f"motion={steps(f'pose: {{name: there, {pose}}}')}", may_refuse=True)
    hold = _set("drape.duration_s=0.3", f"garments.0.holds.corners.path={steps(path)}", may_refuse=True)
    return {HANG: hold, BALL: body, HEAP: body, WORN: body}


def _faster(*speeds: float) -> dict[str, dict[str, Change]]:
    """Half a metre to the front, with this peak speed [m/s], which is 1.5 times the mean."""
    way = "translation_cm: [0, 0, 50]"
    return {f"{speed:g} m/s": _led(way, way, 0.75 / speed) for speed in speeds}


def _gravity(x: float, y: float) -> Change:
    return _set(f"gravity_m_s2=[{x:g}, {y:g}, 0]")


def _shape(size: str, edge_mm: float, *settings: str, mesh: str = "delaunay") -> dict[str, Change]:
    """Another sheet: lying over the ball, standing on the floor, hanging by the same corners."""
    plain = ("size_cm=null", "outline_cm=null", f"mesh={mesh}", "waves=null", size)
    sheet = (f"mesh.edge_length_mm={edge_mm:g}", *(f"garments.0.sheet.{part}" for part in plain), *settings)
    return {
        HANG: _set(*sheet),
        BALL: _set(*sheet, "garments.0.sheet.origin_cm=[-5, 26, 5]"),
        HEAP: _set(*sheet),
    }


def _two_sheets(size: float, at: tuple[str, str], more: str) -> Change:
    sheets = (
        f"{{name: sheet_{n}, fabric: configs/fabrics/table1.yaml, {more.format(n=n)}"
        f"sheet: {{size_cm: [{size}, {size}], mesh: regular, {place}}}}}"
        for n, place in enumerate(at)
    )
    return _set(f"garments=[{', '.join(sheets)}]")


_FLAT = "rotation_degree: [-90, 0, 0]"
_TWO = {
    HANG: _two_sheets(50, (_FLAT, f"{_FLAT}, origin_cm: [0, -5, 0]"), "holds: {{top_{n}: {{edge: top}}}}, "),
    BALL: _two_sheets(30, (f"{_FLAT}, origin_cm: [-15, 26, 15]", f"{_FLAT}, origin_cm: [20, 30, 15]"), ""),
    HEAP: _two_sheets(15, (f"{_FLAT}, origin_cm: [0, 1, 0]", f"{_FLAT}, origin_cm: [5, 3, 5]"), ""),
}
_THREE = "outline_cm=[[0, 0], [20, 0], [15, 8.66], [5, 8.66]]"
_SLIVER = "outline_cm=[[0, 0], [50, 0], [50, 0.8727]]"
_LARGE = ("drape.duration_s=0.05",)

SLOW = ("mesh",)
"""Stresses that are left out where it shall be quick."""
STRESSES: dict[str, dict[str, Change | dict[str, Change]]] = {
    "none": {"": Change()},
    "step": {f"{step:g} s": _set(f"solver.step_s={step:g}") for step in (0.001, 0.033, 0.1)},
    "scheme": {"tr_bdf2": _set("solver.scheme=tr_bdf2")},
    "stretch": _times(TENSILE, 0.01, 10, 1000),
    "bending": _times(BENDING, 0.001, 1000),
    "density": _times(WEIGHT, 0.01, 100),
    "friction": {f"{value:g}": _set(f"contact.friction={value:g}") for value in (0, 2)},
    "start": _sheets(
        crushed_to_1_degree=("crushed", 1.0), squashed=("squashed", 0.01), inverted=("inverted",),
        folded=("folded", 0.002), folded_on_itself=("folded", 0.0),
    ),
    "first stretch": _sheets(**{f"x_{f:g}": ("stretched", f) for f in (0.1, 2, 20)}),
    "jump": {
        "45 degree": {
            **_led("rotations_degree: {root: [0, 0, 45]}", "rotation_degree: [45, 0, 0]", 0.001),
            WORN: _set("motion=[{pose: configs/poses/standing.yaml, duration_s: 0.001}]", may_refuse=True),
        }
    },
    "speed": _faster(3, 10),
    "gravity": {
        "x 0": _gravity(0, 0), "x 100": _gravity(0, -981), "sideways": _gravity(9.81, 0),
    },
    "precision": {"f32": _set("solver.precision=f32")},
    "nothing beneath": {
        "": {
            HANG: _set("garments.0.holds={}"),
            BALL: _set("garments.0.sheet.origin_cm=[200, 30, 50]"),
            HEAP: _set("body=null"),
        }
    },
    "mesh": {
        "3 triangles": _shape(_THREE, 100),
        "slivers of 1 degree": _shape(_SLIVER, 100),
        "strip": _shape("size_cm=[40, 2]", 20, mesh="regular"),
        "two pieces": _TWO,
        "200 000 triangles": {
            HANG: _set("mesh.edge_length_mm=1.5823", *_LARGE), BALL: _set("mesh.edge_length_mm=3.1646", *_LARGE),
        },
    },
}  # fmt: skip
"""Stress, level: the change, the same for all scenes or one for each that can be put through it."""
