"""Threads of a CPU that share one loop after the other within a launch, without going to sleep in between.

Waking a thread takes some 0.1 ms, as long as a loop over ten thousand vertices takes. Here a loop is a phase of so many
parts. Every thread has a range of them, the same in each phase, so that it finds in its cache what it left there, and
when it is through takes what is left of the others'. Whoever ends the last part opens the next phase; until then the
others look on. A thread that comes late, or never, is waited for only in parts that it has taken, so that one alone
comes to an end, too. Who looks on for long, as where a core has been given to another program in the middle of a part,
retires: somebody is at that part and will go on. What comes out does not depend on who does what.
"""

import taichi as ti

from taichi_tryon import fields

# numbers that fill a line of a cache, and how often is looked before retiring: some tenths of a millisecond
APART, PATIENCE = 16, 20_000


@ti.data_oriented
class Crew:
    """Counters of so many ``phases`` in a launch, each of so many ``parts``, for ``threads`` threads."""

    def __init__(self, threads: int, phases: int, parts: int):
        self.threads, self.phases, self.parts = threads, phases, parts
        # Taichi gives every thread this many turns of a loop
        self.turns = threads * fields.LEAST_TURNS
        # apart in memory, that threads do not wait for each other's
        self.taken = ti.Vector.field(APART, ti.i32, shape=(phases, threads))
        self.ended, self.open = (ti.field(ti.i32, shape=phases) for _ in range(2))

    @ti.func
    def begin(self, phase: int):
        """Nothing of the phase is done; for all phases before a launch."""
        for thread in range(self.threads):
            self.taken[phase, thread][0] = thread * self.parts // self.threads
        self.ended[phase], self.open[phase] = 0, 0

    @ti.func
    def take(self, phase: int, owner: int) -> int:
        """The next part of those of a thread; ``parts`` where all are taken."""
        part = ti.atomic_add(self.taken[phase, owner][0], 1)
        return part if part < (owner + 1) * self.parts // self.threads else self.parts

    @ti.func
    def ends(self, phase: int) -> bool:
        """Whether the part that has just been done was the last; then what follows from all of them may be done, and
        ``leave`` opens the next phase."""
        return ti.atomic_add(self.ended[phase], 1) == self.parts - 1

    @ti.func
    def leave(self, phase: int):
        """All of the phase is done."""
        ti.atomic_add(self.open[phase], 1)

    @ti.func
    def wait(self, phase: int) -> int:
        """Look on until all of the phase is done; 0 where that takes too long, and this thread must do no more."""
        looks, opened = 0, 0
        while opened == 0 and looks < PATIENCE:
            # to add nothing is to read what others have written
            opened = ti.atomic_add(self.open[phase], 0)
            looks += 1
        return opened
