"""Threads that share loops within a launch."""

import numpy as np
import pytest
import taichi as ti

from taichi_tryon import fields
from taichi_tryon.solver.crew import Crew

PHASES, PARTS = 7, 13


@ti.data_oriented
class Sums:
    """Each phase adds to every number what the phase before has left in its neighbour; the last part adds them up."""

    def __init__(self, threads: int):
        self.crew = Crew(threads, PHASES, PARTS)
        self.numbers = ti.field(ti.i32, shape=(PHASES + 1, PARTS))
        self.total = ti.field(ti.i32, shape=PHASES)
        self.done = ti.field(ti.i32, shape=(PHASES, PARTS))

    @ti.kernel
    def run(self):
        for phase in range(PHASES):
            self.crew.begin(phase)
        for turn in range(self.crew.turns):
            if turn % fields.LEAST_TURNS == 0:
                for phase in range(PHASES):
                    self._share(turn // fields.LEAST_TURNS, phase)

    @ti.func
    def _share(self, thread: int, phase: int):
        for n in range(self.crew.threads):
            owner = (thread + n) % self.crew.threads
            part = self.crew.take(phase, owner)
            while part < PARTS:
                neighbour = self.numbers[phase, (part + 1) % PARTS]
                self.numbers[phase + 1, part] = self.numbers[phase, part] + neighbour
                ti.atomic_add(self.done[phase, part], 1)
                if self.crew.ends(phase):
                    for other in range(PARTS):
                        self.total[phase] += self.numbers[phase + 1, other]
                    self.crew.leave(phase)
                part = self.crew.take(phase, owner)
        self.crew.wait(phase)


# more than Taichi has, which come when the first have done everything
@pytest.mark.parametrize("threads", [1, 2, 5])
def test_every_part_is_done_once_and_after_all_of_the_phase_before(threads):
    sums = Sums(threads)
    for launch in range(20):
        sums.done.fill(0)
        sums.total.fill(0)
        first = np.zeros((PHASES + 1, PARTS), np.int32)
        first[0] = np.arange(PARTS) + launch
        sums.numbers.from_numpy(first)
        sums.run()
        assert np.all(sums.done.to_numpy() == 1)
        assert sums.total.to_numpy().tolist() == [first[0].sum() * 2 ** (phase + 1) for phase in range(PHASES)]
