"""Paths that grow while an arm runs along them."""

from itertools import pairwise

import numpy as np
import pytest

from armwright.arm import Arm, load_arm
from armwright.arrays import Array
from armwright.compiled.arm import planning_arm
from armwright.dynamics import inverse_dynamics
from armwright.kinematics import forward
from armwright.motion.frame_queue import NEAR, FrameQueue, Pace
from armwright.motion.limited import limited_motion
from armwright.motion.obstruction import PathError
from armwright.motion.trajectory import Trajectory
from armwright.spatial.rotations import rotation_from_vector
from samples import Sample

PERIOD = 1e-3
STARTS = {
    "ur5": np.array([0.3, -1.9, 1.9, -1.6, -1.5, 0.2]),
    "stanford": np.array([0.2, 0.9, 0.5, 0.3, 1.0, 0.4]),
}


class Runner:
    """An arm that runs along a queue, and what it has done so far."""

    def __init__(self, name: str, pace: Pace) -> None:
        self.arm: Arm = load_arm(name)
        self.solver = planning_arm(self.arm)
        self.queue = FrameQueue.at(self.solver, STARTS[name], pace, 0.0)
        self.start = forward(self.arm, STARTS[name])
        self.now, self.since, self.running = 0.0, 0.0, None
        self.done: list[Trajectory] = []
        self.frames = [self.start]

    def put(self, X: Array) -> bool:
        """Put a frame in; whether the arm can go there."""
        try:
            queue = self.queue.put(self.solver, X, self.now)
        except PathError:
            return False
        self.run_on(queue)
        self.frames.append(X)
        return True

    def run_on(self, queue: FrameQueue) -> None:
        """Let the arm run along another queue from now on."""
        motion = queue.trajectory(self.now, PERIOD)
        if self.running is not None:
            self.cut(motion)
        self.queue, self.running, self.since = queue, motion, self.now

    def cut(self, motion: Trajectory) -> None:
        """End what runs; what comes goes on without a jump of positions, speeds and accelerations."""
        assert self.running is not None
        local = min(self.now - self.since, self.running.duration)
        for order, jump in enumerate((1e-9, 1e-7, 1e-5)):
            assert np.abs(self.running(local, order) - motion(0.0, order)).max() <= jump, order
        self.done.append(self.running.until(local))

    def wait(self, seconds: float) -> None:
        """Let time go by."""
        self.now = round((self.now + seconds) / PERIOD) * PERIOD

    def finish(self) -> None:
        """Let the arm come to its end."""
        assert self.running is not None
        self.done.append(self.running)
        assert np.abs(self.running(self.running.duration, 1)).max() <= 1e-9
        assert np.abs(self.running(self.running.duration, 2)).max() <= 1e-6

    def sampled(self) -> tuple[Array, Array]:
        """Joints (k, n) and their speeds at many times."""
        parts = [(run, np.arange(round(run.duration / PERIOD)) * PERIOD) for run in self.done]
        return tuple(np.concatenate([run(t, order) for run, t in parts]) for order in (0, 1))  # type: ignore[return-value]

    def check_limits(self) -> None:
        """Speeds, accelerations and efforts keep their limits, between ticks too."""
        limits = self.arm.all_limits
        for run in self.done:
            motion, t = limited_motion(self.arm, run), np.linspace(0.0, run.duration, 300)
            assert (motion.peaks(1) <= limits.speed * (1 + 1e-6)).all()
            assert (motion.peaks(2) <= limits.acceleration * (1 + 1e-6)).all()
            assert (np.abs(inverse_dynamics(self.arm, run(t), run(t, 1), run(t, 2))) <= limits.effort * 1.001).all()

    def check_path(self, blend: float) -> None:
        """The tool is on the straight legs but for the corners, which it misses by no more than their rule says."""
        p = forward(self.arm, self.sampled()[0])[:, :3, 3]
        corners = np.array([X[:3, 3] for X in self.frames])
        off = np.min([_off(p, A, B) for A, B in pairwise(corners)], axis=0)
        apart = np.min([np.linalg.norm(p - corner, axis=1) for corner in corners], axis=0)
        assert off[apart > blend * (1 + 1e-9)].max(initial=0.0) <= NEAR
        assert off.max() <= 3 / 8 * blend + NEAR
        # All of the legs is gone along: every corner is passed no farther off than that.
        for corner in corners:
            assert np.linalg.norm(p - corner, axis=1).min() <= 3 / 8 * blend + NEAR


def _off(p: Array, A: Array, B: Array) -> Array:
    """Distances of positions (k, 3) from a straight segment."""
    along = (B - A) / max(float((B - A) @ (B - A)), 1e-30)
    s = np.clip((p - A) @ along, 0.0, 1.0)
    return np.asarray(np.linalg.norm(p - A - s[:, None] * (B - A), axis=1))


def drawn(random: np.random.Generator, X: Array) -> Array:
    """A pose near another one."""
    Y = X.copy()
    Y[:3, 3] += random.uniform(-0.1, 0.1, 3)
    Y[:3, :3] = Y[:3, :3] @ rotation_from_vector(random.uniform(-0.3, 0.3, 3) * random.integers(0, 2))
    return Y


@pytest.mark.share(0.04)
@pytest.mark.parametrize("name", STARTS)
def test_frames_at_random_times(name: str, sample: Sample) -> None:
    """Whenever frames come, the arm keeps its limits and its path, and stops nowhere but at frames."""
    dry = 0
    for random in sample.cases(30):
        blend = float(random.uniform(0.003, 0.03))
        velocity = None if random.integers(0, 2) else float(random.uniform(0.05, 0.6))
        runner = Runner(name, Pace(float(random.uniform(20, 120)), velocity, blend))
        for _ in range(8):
            runner.put(drawn(random, runner.start))
            runner.wait(float(random.choice([0.0, 0.01, random.uniform(0, 0.4), random.uniform(0, 2)])))
        runner.finish()
        runner.check_limits()
        runner.check_path(blend)
        dry += runner.queue.stop_count
    sample.record(f"queues of {name}", sample.count(30), 0, run_dry=dry)


def test_braking_at_random_times(sample: Sample) -> None:
    """Braked at any time, the arm stands on its path; what comes meanwhile is gone to when it is resumed."""
    for random in sample.cases(20):
        blend = float(random.uniform(0.003, 0.03))
        runner = Runner("ur5", Pace(100.0, None, blend))
        for _ in range(7):
            runner.put(drawn(random, runner.start))
            runner.wait(float(random.choice([0.0, random.uniform(0, 0.4), random.uniform(0, 1)])))
            if random.integers(0, 2):
                runner.run_on(runner.queue.braked(runner.now))
                held = runner.queue.end
                assert held <= runner.now + 2.0
                runner.wait(held - runner.now + float(random.choice([0.0, 0.3])))
                runner.wait(PERIOD)
                assert runner.queue.rests(runner.now)
                if random.integers(0, 2):
                    runner.put(drawn(random, runner.start))
                assert runner.queue.end <= runner.now
                runner.run_on(runner.queue.resumed(runner.now))
        runner.wait(runner.queue.end - runner.now + PERIOD)
        assert runner.queue.passed(runner.now) == len(runner.frames) - 1
        runner.finish()
        runner.check_limits()
        runner.check_path(blend)
    sample.record("queues braked", sample.count(20), 0)


@pytest.mark.share(0.04)
@pytest.mark.parametrize("name", STARTS)
def test_no_stop_while_it_is_fed(name: str, sample: Sample) -> None:
    """With two frames ahead the arm never stops, whatever the corners are but for those straight back."""
    for random in sample.cases(20):
        runner = Runner(name, Pace(100.0, None, 0.02))
        while len(runner.frames) < 9:
            # No corner goes nearly straight back, whose rounding may be passed no faster than a stop.
            X, last = drawn(random, runner.start), np.diff([Y[:3, 3] for Y in runner.frames[-2:]], axis=0).ravel()
            leg = X[:3, 3] - runner.frames[-1][:3, 3]
            turned = leg @ last / max(np.linalg.norm(leg) * np.linalg.norm(last), 1e-30) if len(last) else 1.0
            if turned < -0.9 or np.linalg.norm(leg) < 0.03 or not runner.put(X):
                continue
            while len(runner.queue.marks) - runner.queue.passed(runner.now) > 2:
                runner.wait(0.005)
        assert runner.queue.stop_count == 0
        runner.finish()
        runner.check_limits()
        p = forward(runner.arm, runner.sampled()[0])
        t = np.arange(len(p))
        moving = np.linalg.norm(np.diff(p[:, :3, 3], axis=0), axis=1) / PERIOD > 1e-4
        # From the first to the last metre it is under way.
        assert moving[(t[:-1] > 100) & (t[:-1] < len(t) - 100)].all()


def test_the_rest_between_two_legs() -> None:
    """A frame that comes too late is gone to from rest: exactly past the one that was the last before."""
    runner = Runner("ur5", Pace(100.0, None, 0.02))
    A, B = runner.start.copy(), runner.start.copy()
    A[:3, 3] += (0.08, 0, 0)
    B[:3, 3] += (0.08, 0.08, 0)
    assert runner.put(A)
    runner.wait(runner.queue.end - 0.03)
    assert runner.put(B)
    runner.finish()
    runner.check_limits()

    q, qd = runner.sampled()
    at = np.linalg.norm(forward(runner.arm, q)[:, :3, 3] - A[:3, 3], axis=1)
    assert runner.queue.stop_count == 1
    assert at.min() <= NEAR
    assert np.abs(qd[at.argmin()]).max() <= 1e-3


def test_what_is_ahead() -> None:
    """Frames are passed in order, at the times that are told before."""
    runner = Runner("ur5", Pace(100.0, 0.2, 0.01))
    for number in range(1, 5):
        X = runner.start.copy()
        X[:3, 3] += (0.04 * number, 0.02 * (number % 2), 0)
        runner.put(X)
    told = [runner.queue.when_passed(number, runner.now) for number in range(4)]
    assert told == sorted(told)
    assert told[-1] == runner.queue.end
    for number, time in enumerate(told):
        assert runner.queue.passed(time - 5e-3) == number
        assert runner.queue.passed(time + 5e-3) == number + 1
    assert runner.queue.travelled(told[0] / 2) > 0


def test_the_same_frame_twice() -> None:
    """A frame that is where the last one is adds no path; one that is only turned is turned to."""
    runner = Runner("ur5", Pace(100.0, None, 0.01))
    X = runner.start.copy()
    X[:3, 3] += (0, 0.05, 0)
    turned = X.copy()
    turned[:3, :3] = X[:3, :3] @ rotation_from_vector(np.array([0.0, 0.0, 0.5]))
    assert runner.put(X)
    end = runner.queue.end
    assert runner.put(X)
    assert runner.queue.end == end
    assert runner.put(turned)
    runner.finish()
    runner.check_limits()
    assert np.abs(forward(runner.arm, runner.done[-1](runner.done[-1].duration)) - turned).max() <= 1e-5
    assert runner.queue.passed(runner.queue.end) == 3


def test_out_of_reach() -> None:
    """A frame that cannot be gone to is refused, and the queue is what it was."""
    runner = Runner("ur5", Pace(100.0, None, 0.01))
    far = runner.start.copy()
    far[:3, 3] += (0, 3.0, 0)
    before = runner.queue
    assert not runner.put(far)
    assert runner.queue is before
    assert before.rests(0.0)
