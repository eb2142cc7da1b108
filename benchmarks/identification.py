"""Identification on measured data: the UR10e of Mamedov & Mikhel, the TX40 of FIGAROH's examples; nothing is shipped.

    python benchmarks/identification.py --data DIR

DIR holds ``ur10e/`` and ``tx40/`` with the files as their authors publish them. Filter, friction and prior are chosen
by folds of the training files; the held-out file is opened once, after everything is chosen.
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import resource
import time
from collections.abc import Iterator
from pathlib import Path

import attrs
import numpy as np

from armwright.arm.load import load_arm
from armwright.arm.model import Arm, Link
from armwright.arm.urdf.reader import load_urdf
from armwright.identification import (
    DynamicModel,
    Identification,
    MotionLimits,
    drive_gains,
    identify,
    identify_payload,
    plan_excitation,
    summed,
    weighted,
)
from armwright.identification.equations import Equations, equations
from armwright.identification.friction import predicted
from armwright.identification.identify import hold_out
from armwright.identification.log import Log, with_gains
from armwright.identification.signals import Motion, low_pass, motions

# Gains of the UR10e that its authors take from De Luca [N m/A].
GAINS = np.array([14.87, 13.26, 11.13, 10.62, 11.03, 11.47])
TRAINING = ("20_02_10-30sec_12harm", "20_02_12-40sec_12harm", "20_02_12-50sec_12harm", "20_02_10-20sec_7harm")
HELD_OUT, REMAINING = "20_01_17-ptp_10_points", ("20_02_19_14harm50sec", "20_02_19_14harm50secLoad")
# The best row of what others reached on the held-out file [N m].
BEST = np.array([2.14, 3.53, 1.54, 0.31, 0.52, 1.35])
PUBLISHED_LOAD = 2.805


def main() -> None:
    """Measure all that there is data for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=Path, required=True, help="folder with ur10e/ and tx40/")
    data = parser.parse_args().data
    excitation(data)
    found = ur10e(data / "ur10e")
    payload(data / "ur10e", found)
    speed(data / "ur10e")
    tx40(data / "tx40")
    memory()


def ur10e_log(folder: Path, name: str, rows: slice = slice(None)) -> Log:
    """Return a log of the UR10e; a reading that repeats the time of the one before is left out."""
    table = np.loadtxt(folder / f"ur-{name}.csv", delimiter=",", usecols=range(19))[rows]
    table = table[np.concatenate([[True], np.diff(table[:, 0]) > 0])]
    log = Log(name=name, t=table[:, 0] - table[0, 0], q=table[:, 1:7], qd=table[:, 7:13], effort=table[:, 13:19])
    return with_gains(log, GAINS)


def ur10e(folder: Path) -> Identification:
    """Print the table of the UR10e."""
    arm = load_urdf(folder / "ur10e.urdf")
    print(f"UR10e: {len(DynamicModel(arm=arm, terms=('rotor',)).base.names)} base parameters with rotors (40)")
    found = identify(arm, [ur10e_log(folder, name) for name in TRAINING])
    for choice in found.choices:
        print(f"  {choice.what:9} {choice.option:46} {choice.error:.4f} {'chosen' if choice.chosen else ''}")
    if found.standard is None:
        raise SystemExit(found.warnings[-1])
    print(f"  {found.law}; delay {found.preparation.delay * 1e3:.2f} ms; friction at rest {found.held:.2f}")
    print(f"  least eigenvalue of a pseudo-inertia, by the drawing: {found.standard.smallest:.3g}")
    rows = {"base parameters": found.fit.values, "arm file": found.standard.base}
    # Rows 700 to 4200, efforts filtered as those of the table are: 20 % of half the sampling rate.
    held_out = ur10e_log(folder, HELD_OUT, slice(699, 4200))
    for name, values in rows.items():
        rms = _rms(found, held_out, values)
        print(f"  held out, {name:16}", rms.round(3), "by the best row", (rms / BEST).round(3))
    for name in REMAINING:
        print(f"  {name:26}", _rms(found, ur10e_log(folder, name), found.fit.values).round(3))
    return found


def _rms(found: Identification, log: Log, values: np.ndarray) -> np.ndarray:
    """Return the root mean squares (n,) of what is not predicted, at every reading."""
    even = log.even()
    smooth = attrs.evolve(even, effort=low_pass(even.effort, 0.2 / (2 * even.period), 1 / even.period))
    errors = [
        motion.tau - predicted(found.model, values, motion, found.preparation.slow, found.held)
        for motion in motions([smooth], attrs.evolve(found.preparation, border=0.2))
    ]
    return np.sqrt((np.concatenate(errors) ** 2).mean(axis=0))


def payload(folder: Path, found: Identification) -> None:
    """Print the load of the loaded log, with the gains of the table and with those that its mass gives."""
    if found.arm is None:
        raise SystemExit(found.warnings[-1])
    loaded, unloaded = ur10e_log(folder, REMAINING[1]), ur10e_log(folder, REMAINING[0])
    load = identify_payload(found.arm, [loaded], found.preparation)
    centre = ", ".join(f"{x * 1e3:.1f} ± {e * 1e3:.1f}" for x, e in zip(load.load.com, load.com_errors, strict=True))
    print(f"Payload: {load.load.mass:.3f} ± {load.mass_error:.3f} kg at ({centre}) mm; published {PUBLISHED_LOAD} kg")
    currents = [with_gains(log, 1 / GAINS) for log in (unloaded, loaded)]
    gains = drive_gains(found.model, currents[:1], currents[1:], Link(mass=PUBLISHED_LOAD), mass_alone=True)
    print("  gains by that mass:", gains.values.round(2), "±", gains.errors.round(2), "; De Luca's:", GAINS)


def speed(folder: Path) -> None:
    """Print the time of 4000 rows end to end."""
    arm, log = load_urdf(folder / "ur10e.urdf"), ur10e_log(folder, TRAINING[1], slice(400, 4400))
    identify(arm, [log])
    wall, cpu = time.perf_counter(), time.process_time()
    identify(arm, [log])
    wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
    print(f"4000 rows end to end: {wall:.2f} s, {cpu:.2f} s of the processor")


def excitation(data: Path) -> None:
    """Print the condition of a motion of the UR10e within the limits of the table."""
    path = data / "ur10e" / "ur10e.urdf"
    arm = load_urdf(path) if path.exists() else load_arm("ur5")
    model = DynamicModel(arm=arm, terms=("rotor", "viscous", "coulomb"))
    n = np.ones(6)
    limits = MotionLimits(lower=-2.2 * n, upper=2.2 * n, speed=2 * n, acceleration=4 * n, effort=arm.limits.effort)
    for seed in range(4):
        wall, cpu = time.perf_counter(), time.process_time()
        plan = plan_excitation(model, limits=limits, seed=seed)
        wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
        print(f"Excitation: condition {plan.condition:.1f} in {wall:.2f} s, {cpu:.2f} s of the processor")


def tx40_log(folder: Path, arm: Arm) -> tuple[DynamicModel, Log]:
    """Return the model of the TX40 with its coupled wrist, and its log at the joints."""
    ratios = np.array([32.0, 32.0, 45.0, -48.0, 45.0, 32.0])
    coupling = np.eye(6)
    coupling[5, 4] = 1.0
    model = DynamicModel(arm=arm, coupling=coupling)
    current = np.loadtxt(folder / "curr_data.csv", delimiter=",", skiprows=1)
    motor = np.loadtxt(folder / "pos_read_data.csv", delimiter=",", skiprows=1)
    q = motor / ratios @ np.linalg.inv(coupling).T
    q[:, 1] -= np.pi / 2
    q[:, 2] += np.pi / 2
    return model, Log(name="TX40", t=np.arange(len(q)) * 2e-4, q=q, effort=model.joint_efforts(current * ratios))


def tx40(folder: Path) -> None:
    """Print base parameters and correlations of the TX40, with blocks and with the last part held out."""
    arm = load_urdf(folder / "tx40_mdh_modified.urdf")
    model, log = tx40_log(folder, arm)
    print(f"TX40: {len(model.base.names)} base parameters of {len(model.names)} (61 of 87)")
    for how, share in (("blocks", 0.25), ("last", 0.3)):
        kept, held = hold_out(log, how, share=share, seconds=0.2)
        found = identify(arm, kept, check=held, coupling=model.coupling, cutoff=100.0, decimation=50, folds=3)
        measured, told = (
            np.concatenate([getattr(x, name) for x in found.validation]) for name in ("measured", "predicted")
        )
        rms = np.sqrt(((measured - told) ** 2).mean(axis=0))
        correlation = [np.corrcoef(measured[:, j], told[:, j])[0, 1] for j in range(6)]
        print(f"  {how} held out: {found.law}; rms", rms.round(2), "correlation", np.round(correlation, 3))


class _Rows:
    """Equations of ten million readings, made anew as they are gone through."""

    def __init__(self, model: DynamicModel, count: int) -> None:
        self._model, self._count = model, count

    def __iter__(self) -> Iterator[Equations]:
        size, n = 100_000, self._model.arm.n
        for k in range(self._count // size):
            t = np.arange(size) / 1000 + k
            phase = np.outer(t, np.arange(1, n + 1) * 0.7)
            q, qd, qdd = np.sin(phase), np.cos(phase), -np.sin(phase)
            tau = self._model.columns(q[:10], qd[:10], qdd[:10]).sum(axis=2).mean() + qd
            motion = Motion("rows", t, q, qd, qdd, tau, np.ones((size, n), dtype=bool))
            yield from equations(self._model, [motion], 10)


def memory() -> None:
    """Print the memory of a fit to ten million readings."""
    start = time.perf_counter()
    weighted(summed(_Rows(DynamicModel(arm=load_arm("ur5")), 10_000_000)))
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"10^7 readings: {time.perf_counter() - start:.0f} s, {peak:.0f} MB at most")


if __name__ == "__main__":
    main()
