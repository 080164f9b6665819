"""How far along straight paths two pieces of cloth can go before they meet.

Additive continuous collision detection (Li, Kaufman, Jiang 2021, "Codimensional incremental potential contact",
alg. 1): with the common motion taken off, the distance of a pair cannot shrink by more than its two fastest corners go;
so as much is gone as is surely free, the distance measured anew, and so on until little of it is left.
"""

import taichi as ti

from taichi_tryon.contact.distance import FACE, distance

# part of its distance that a pair keeps at least, and of what is surely free that is gone at a time
KEPT, STRIDE = 0.2, 0.9
ITERATIONS = 60


@ti.func
def free_part(kind: int, a, b, c, d, da, db, dc, dd):
    """Part, 0 to 1, of the paths da, db, dc, dd that corners a, b, c, d can go and keep KEPT of their distance."""
    most = reach(kind, da, db, dc, dd)
    start = distance(kind, a, b, c, d)
    least = KEPT * start
    gone = ti.cast(1.0, float)
    if start - most < least:
        gone = (start - least) / most
        going = 1
        count = 0
        while going == 1 and count < ITERATIONS:
            now = distance(kind, a + gone * da, b + gone * db, c + gone * dc, d + gone * dd)
            stride = STRIDE * (now - least) / most
            if gone + stride >= 1.0:
                gone, going = ti.cast(1.0, float), 0
            elif stride < 1e-3 * gone:
                going = 0
            else:
                gone += stride
            count += 1
    return gone


@ti.func
def reach(kind: int, da, db, dc, dd):
    """By how much the paths can change the distance of the pair at most [m]."""
    mean = 0.25 * (da + db + dc + dd)
    a, b, c, d = (da - mean).norm(), (db - mean).norm(), (dc - mean).norm(), (dd - mean).norm()
    result = a + ti.max(b, c, d)
    if kind != FACE:
        result = ti.max(a, b) + ti.max(c, d)
    return result
