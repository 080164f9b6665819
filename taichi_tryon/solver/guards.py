"""Newton directions that bring no cloth to cloth: solved anew with springs between what would meet on the way."""

from collections.abc import Callable

# how often a direction is corrected, and the stiffness of the springs over the matrix's own
ROUNDS, STIFFNESS = 4, 10.0
# no vertex goes further at a time than this part of an edge, lest the lines turn along which the springs stand
NEAR = 0.5


def stay_apart(layers, linear, clock, longest_move: float, aim: Callable[[float, bool], bool]) -> bool:
    """Put springs between what would meet and aim anew, until nothing would or too often; whether that can be gone.

    aim(longest [m], anew): aims along the direction of ``linear``, solved ``anew`` or as it is; whether it is finite.
    The ``clock`` counts to contact what ``layers`` take, the solving not.
    """
    with clock("contact"):
        if not layers.would_meet().any():
            return True
    longest = min(longest_move, NEAR * layers.edge_length)
    finite = aim(longest, False)
    stiffness = STIFFNESS * float(linear.matrix.stiffness.to_numpy().mean())
    for _ in range(ROUNDS):
        with clock("contact"):
            first = layers.count
            if not finite or not layers.guard(stiffness):
                break
            layers.push(linear.b, first)
        finite = aim(longest, True)
    return finite
