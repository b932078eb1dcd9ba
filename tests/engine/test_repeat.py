"""What is repeated in a frame until it says itself that it is done."""

import warp as wp

from particlesim.engine.execution import launch
from particlesim.engine.execution.executors import EagerExecutor, GraphExecutor, ThreadExecutor
from particlesim.engine.execution.frame import Frame
from particlesim.engine.execution.launch import Program


@wp.kernel
def add_one(first: int, values: wp.array(dtype=float)):
    i = first + wp.tid()
    values[i] = values[i] + 1.0


@wp.kernel
def count_down(first: int, left: wp.array(dtype=int)):
    left[0] = left[0] - 1


def test_what_repeats_ends_by_its_own_flag():
    """As often as the flag says, none included, and so whenever what was recorded is run."""
    values, left = wp.zeros(5, dtype=float, device="cpu"), wp.zeros(1, dtype=int, device="cpu")

    def work():
        with launch.repeat(left):
            launch.launch(add_one, 5, [values], values.device)
            launch.launch(count_down, 1, [left], values.device)

    with launch.record(Program()) as program:
        work()
    frame = Frame(repeat=2, substep=program)
    made = EagerExecutor(frame), GraphExecutor(frame, values.device), ThreadExecutor(frame, 2)
    for run in (work, *(each.run for each in made)):
        for times in (3, 0):
            values.zero_()
            left.fill_(times)
            run()
            assert (values.numpy() == times).all(), run
    for each in made:
        each.close()
