"""What two limbs that close on the cloth do to it: with no room left, they give way to each other and hold it.

As flesh does: of cloth deep below both offsets, at depths d1 and d2, the depth common to both counts for less and less.
Both are reduced by c = h^2 / (m + h), where h = sqrt(2) d1 d2 / sqrt(d1^2 + d2^2) is d where both are d and 0 where one
is: what is left of d is d / (1 + d / m), m at most. So cloth is kept half-way between the skins, at a pressure that is
bounded, and goes free as they part; else it would be crushed by two barriers, and shot out from between them.
"""

import taichi as ti

# m over the contact thickness
COMMON = 0.5
# skins face each other from this cosine on, and wholly from that one on: flesh gives way to what comes against it, and
# two groups that make one surface hold cloth both
FACING, AGAINST = 0.0, 0.8


@ti.func
def facing(normal, beside) -> float:
    """How much two skins with these outward unit normals face each other, 0 to 1."""
    share = ti.math.clamp((-normal.dot(beside) - FACING) / (AGAINST - FACING), 0.0, 1.0)
    return share * share * (3.0 - 2.0 * share)


@ti.func
def relief(one: float, other: float, t: float):
    """The depth c [m] that does not count of two depths > 0 [m], and its derivatives with respect to both; t: contact
    thickness [m]."""
    m, size = COMMON * t, ti.sqrt(one * one + other * other)
    common, share = ti.sqrt(2.0) * one * other / size, ti.sqrt(2.0) / (size * size * size)
    rate = common * (common + 2.0 * m) / ((m + common) * (m + common))
    cube = ti.Vector([other * other * other, one * one * one])
    return ti.Vector([common * common / (m + common), rate * share * cube[0], rate * share * cube[1]])
