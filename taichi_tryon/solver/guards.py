"""Newton directions that bring no cloth to cloth: solved anew with springs between what would meet on the way."""

# how often a direction is corrected, and the stiffness of the springs over the matrix's own
ROUNDS, STIFFNESS = 4, 10.0
# no vertex goes further at a time than this part of an edge, lest the lines turn along which the springs stand
NEAR = 0.5


def stay_apart(layers, linear, way, settings, reach: float) -> int:
    """Put springs between what would meet and aim anew, until nothing would or too often; iterations of ``linear``."""
    if not layers.would_meet().any():
        return 0
    longest = min(settings.longest_move, NEAR * layers.edge_length)
    way.aim(linear.d, longest)
    iterations = 0
    stiffness = STIFFNESS * float(linear.stiffness_sum.to_numpy().sum()) / linear.nv
    for _ in range(ROUNDS):
        first = layers.count
        if not layers.guard(stiffness):
            break
        layers.push(linear.b, first)
        iterations += aim(linear, way, settings, longest, reach)
    return iterations


def aim(linear, way, settings, longest_move: float, reach: float) -> int:
    """Solve for the direction of the right-hand side as it is, and aim along it; iterations of ``linear``."""
    iterations = linear.solve(settings.linear_tolerance, settings.max_linear_iterations, reach, refresh=False)[0]
    way.aim(linear.d, longest_move)
    return iterations
