"""Starts of a plain sheet that no scene can ask for: other positions than those where it was placed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from taichi_tryon.holds.held import Holds
from taichi_tryon.setup import Setup


def started(setup: Setup, shape: str, *arguments: float) -> Setup:
    """The setup of a single plain sheet, its vertices moved as the function called ``shape`` says; what is held is held
    where it is then."""
    flat = setup.garments[0].mesh.pattern_points
    axes = np.linalg.lstsq(flat - flat.mean(axis=0), setup.positions - setup.positions.mean(axis=0), rcond=None)[0]
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    moved = SHAPES[shape](flat, setup.scene.mesh.edge_length_mm / 1000, *arguments)
    shift = moved[:, :2] - flat
    positions = setup.positions + shift @ axes + moved[:, 2:] * np.cross(*axes)
    return replace(setup, positions=positions, holds=Holds.of(list(setup.holds.holds), positions))


def crushed(flat: np.ndarray, edge: float, degrees: float) -> np.ndarray:
    """Every other column of triangles as narrow as makes their least angle this; the columns between them wider."""
    first, narrow = flat[:, 0] // (2 * edge) * 2 * edge, edge * np.tan(np.radians(degrees))
    offset = np.interp(flat[:, 0] - first, [0, edge, 2 * edge], [0, narrow, 2 * edge])
    return np.column_stack([first + offset, flat[:, 1], np.zeros(len(flat))])


def squashed(flat: np.ndarray, edge: float, share: float) -> np.ndarray:
    """As narrow as this share of the width."""
    middle = flat[:, 0].mean()
    return np.column_stack([middle + share * (flat[:, 0] - middle), flat[:, 1], np.zeros(len(flat))])


def inverted(flat: np.ndarray, edge: float) -> np.ndarray:
    """The middle third turned over in its place, so that its triangles lie the wrong way round."""
    x, (low, high) = flat[:, 0], np.quantile(flat[:, 0], [1 / 3, 2 / 3])
    within = (x > low + 0.5 * edge) & (x < high - 0.5 * edge)
    return np.column_stack([np.where(within, low + high - x, x), flat[:, 1], np.zeros(len(flat))])


def folded(flat: np.ndarray, edge: float, gap: float) -> np.ndarray:
    """Folded by 180 degrees along the vertices next to the middle, its halves a ``gap`` [m] apart."""
    x = flat[:, 0]
    crease = x[np.abs(x - x.mean()).argmin()]
    return np.column_stack([crease + np.abs(x - crease), flat[:, 1], gap * (x > crease)])


def stretched(flat: np.ndarray, edge: float, factor: float) -> np.ndarray:
    """This many times as large, about its middle."""
    return np.column_stack([flat.mean(axis=0) + factor * (flat - flat.mean(axis=0)), np.zeros(len(flat))])


SHAPES = {shape.__name__: shape for shape in (crushed, squashed, inverted, folded, stretched)}
"""Each takes ``flat`` (nv, 2) [m], the length of an edge [m] and arguments of its own, and gives (nv, 3) [m]: where the
vertices go in the sheet's own x and y, and how high above it."""
