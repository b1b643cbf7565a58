"""A source that says what a test tells it to say, and canned snapshots."""

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import NoReturn

import numpy as np

from imucal_wizard.acquire.setup import StreamSetup
from imucal_wizard.core.description import Description
from imucal_wizard.core.poses import DIRECTIONS, EDGES, FACES
from imucal_wizard.diagnose.benches import Benches
from imucal_wizard.diagnose.diagnosis import Diagnosis
from imucal_wizard.diagnose.grade import Graded, graded
from imucal_wizard.diagnose.recheck import Recheck
from imucal_wizard.diagnose.verdict import Verdict
from imucal_wizard.estimate.comparison import MethodRow, method_rows
from imucal_wizard.estimate.result import AxisComparison, FitReport, Parameter, SensorFit
from imucal_wizard.guide.instruction import present
from imucal_wizard.guide.kinds import Act, EventKind, StepKind
from imucal_wizard.guide.state import (
    AxisMotion,
    AxisStart,
    Event,
    RotationStatus,
    Status,
    StillStatus,
)
from imucal_wizard.measurement.holds import Collected, Hold, Rotation
from imucal_wizard.report.calibration_file import Calibration
from imucal_wizard.report.exports import Exported, ExportErrors, ExportTarget, targets
from imucal_wizard.run.snapshot import Snapshot, StreamStatus
from imucal_wizard.sessions.bench_draft import BenchDraft
from imucal_wizard.sessions.history import DeviceHistory, KnownDevice
from imucal_wizard.tui.services import Saved
from imucal_wizard.tui.sources import SampleSource, SourceChoice

GRAVITY = 9.80665
STREAM = StreamStatus(
    source="virtual IMU",
    format="text",
    connected=True,
    rate=100.0,
    samples=1234,
    temperature=24.6,
    accelerometer=(0.12, -0.31, 9.79),
    gyroscope=(0.01, -0.002, 0.003),
    gravity=9.795,
    digits=6,
)
_NAMES = [*FACES, *EDGES]


@dataclass
class FakeHand:
    """Notes the commands that it gets."""

    trembling: bool = False
    following: bool = False
    commands: list[tuple[str, object]] = field(default_factory=list)

    def turn(self, axis: str, degrees: float) -> None:
        """A turn."""
        self.commands.append((axis, degrees))

    def snap_to(self, target: str) -> None:
        """A pose."""
        self.commands.append(("snap", target))

    def tremble(self, on: bool) -> None:
        """Held, or laid down."""
        self.trembling = on

    def pass_steel(self) -> None:
        """Steel."""
        self.commands.append(("steel", ""))


class FakeSource:
    """Shows the snapshots it is given; notes the commands it gets."""

    live = True

    def __init__(self, status: Status | None = None, stream: StreamStatus = STREAM) -> None:
        self._serial = itertools.count(1)
        self.commands: list[tuple[str, str]] = []
        self.running = False
        self.finished = False
        self.events: tuple[Event, ...] = ()
        self.setups: list[StreamSetup] = []
        self.description = Description()
        self.stream = stream
        self.say(status or Status())

    def say(self, status: Status) -> None:
        """From now on this is the state of the procedure."""
        self.status = status
        self._serial_now = next(self._serial)

    def happen(self, *events: Event) -> None:
        """These events happen now."""
        self.events += events
        self.say(replace(self.status, last_event=events[-1]))

    def start(self) -> None:
        """It runs."""
        self.running = True

    def stop(self) -> None:
        """It rests."""
        self.running = False

    def command(self, name: str, argument: str = "") -> None:
        """Some commands move the procedure on at once."""
        self.commands.append((name, argument))
        following = {
            "start": StepKind.SETTLE,
            "validate": StepKind.VALIDATE,
            "save": StepKind.SAVE,
            "measure": StepKind.MORE,
        }
        if name in following:
            self.say(replace(self.status, step=following[name]))

    def describe(self, description: Description) -> None:
        """Noted."""
        self.description = description

    def set_setup(self, setup: StreamSetup) -> None:
        """Noted; then nothing must be asked any more."""
        self.setups.append(setup)
        self.stream = replace(self.stream, needs=())
        self.say(self.status)

    def rescue(self, path: Path) -> None:
        """Noted."""
        self.commands.append(("rescue", str(path)))

    def collected(self) -> Collected:
        """Nothing."""
        return Collected((), ())

    def snapshot(self) -> Snapshot:
        """The newest."""
        return Snapshot(
            serial=self._serial_now,
            stream=self.stream,
            status=present(self.status, None, self.stream.flow(ended=self.finished)),
            events=self.events[-50:],
            event_count=len(self.events),
            traces=traces(),
            attitude=None,
            finished=self.finished,
        )


def traces(n: int = 400, phase: float = 0.0) -> "np.ndarray[tuple[int, int], np.dtype[np.float64]]":
    """Six sines."""
    t = np.linspace(phase, phase + 10, n)[:, None]
    return np.hstack([9.8 * np.sin(0.5 * t + np.arange(3)), 2 * np.cos(t + np.arange(3))])


def motions(worst: float = 0.3) -> tuple[AxisMotion, ...]:
    """Six axes, of which the last turns at ``worst`` °/s against 0.8."""
    quiet = [AxisMotion(f"a{axis}", 1.3, 4.0, "mg") for axis in "xyz"]
    turning = [AxisMotion(f"g{axis}", 0.2, 0.8, "°/s") for axis in "xy"]
    return (*quiet, *turning, AxisMotion("gz", worst, 0.8, "°/s"))


def moving() -> StillStatus:
    """Not still: z turns at 2.9 °/s."""
    all_axes = motions(2.9)
    says = "z turns at 2.9 °/s, limit 0.8"
    return StillStatus(motions=all_axes, worst=all_axes[-1], needed=2.0, waiting=3.0, reason=says)


def still(held: float = 1.3) -> StillStatus:
    """Still for ``held`` of 2 s."""
    return StillStatus(still=True, motions=motions(), worst=motions()[-1], held=held, needed=2.0)


def poses_status(done: int = 7) -> Status:
    """In the 18 poses, on the way to +x−y."""
    names = [n for n in _NAMES if n != "+x-y"]
    return Status(
        step=StepKind.POSES,
        elapsed=252.0,
        instruction="TURN +X −Y UP",
        detail="the edge between the +x and −y faces on top",
        act=Act.POSE,
        aim=(0.7071, -0.7071, 0.0),
        still=moving(),
        up=(0.5, -0.3, math.sqrt(1 - 0.34)),
        wanted="+x-y",
        recognised=None,
        off_by=23.0,
        done=tuple(names[:done]),
        missing=("+x-y", *names[done:]),
        progress=(done, 18),
        noise="1.2 mg, 0.06 °/s",
        last_event=Event(EventKind.HOLD_TAKEN, 250.0, "−y taken, 23° from the corner of nothing"),
        holds=13,
    )


def up_down_status() -> Status:
    """In the up/down step, with one axis complete."""
    return Status(
        step=StepKind.UP_DOWN,
        elapsed=45.0,
        instruction="HOLD STILL",
        detail="the −y face on top",
        act=Act.HOLD,
        aim=(0.0, -1.0, 0.0),
        still=still(),
        up=(0.0, 0.05, 0.998),
        wanted="-y",
        off_by=88.0,
        done=("+x", "-x", "+z"),
        missing=("+y", "-y", "-z"),
        progress=(3, 6),
        start_values=(
            AxisStart("x", 9.93, -9.71, 0.11, 9.82),
            AxisStart("y"),
            AxisStart("z", 9.71, None),
        ),
        noise="1.2 mg, 0.06 °/s",
        holds=3,
    )


def settle_status() -> Status:
    """Measuring the noise."""
    return Status(
        step=StepKind.SETTLE,
        elapsed=4.0,
        act=Act.LAY_DOWN,
        instruction="LAY IT DOWN",
        detail="on something solid, hands off",
        still=still(4.0),
        up=(0.0, 0.05, 0.998),
        progress=(4.0, 10.0),
    )


def rotations_status() -> Status:
    """In the rotations about x."""
    return Status(
        step=StepKind.ROTATIONS,
        elapsed=400.0,
        instruction="ROTATE ABOUT X",
        act=Act.ROTATE,
        detail="stop anywhere, then hold still for 3 s",
        still=moving(),
        up=(0.0, 0.7, 0.7),
        progress=(3, 18),
        rotation=RotationStatus(
            "x", "+z", 87.0, 104.0, 131.0, 250.0, (92.0, -78.0, 140.0), 6, True, 2, -120.0, 50.0
        ),
        noise="1.2 mg, 0.06 °/s",
        holds=30,
        rotations=3,
    )


def hold(pose: str = "+x", scale: float = 1.0) -> Hold:
    """A hold in a pose."""
    mean = GRAVITY * scale * DIRECTIONS[pose]
    return Hold(0.0, 2.0, mean, np.eye(3) * 1e-8, np.zeros(3), np.eye(3) * 1e-10, 200, 24.6, pose)


LEFT, CLOSURE = 0.00108, 0.0091
"""Rms error of the fitted holds, m/s², and rotations, rad."""
RATE_SCALE, RATE_BIAS = 0.9752, 0.0101


def rotation(axis: str, sense: float, holds: Sequence[Hold]) -> Rotation:
    """A second of 90 °/s about a body axis, and ``CLOSURE`` more, between two of these holds."""
    third = "xyz".index(axis)
    ends = [f"+{'xyz'[(third + 2) % 3]}", f"+{'xyz'[(third + 1) % 3]}"][:: int(sense)]
    before, after = (next(one for one in holds if one.pose == name) for name in ends)
    time = np.linspace(0.0, 1.0, 101)
    rate = np.full((101, 3), RATE_BIAS)
    rate[:, third] += sense * (np.pi / 2.0 + CLOSURE) / RATE_SCALE
    return Rotation(before, after, time, rate, axis)


def report(validated: bool = False) -> FitReport:
    """A fit with something missing in the gyroscope: each figure follows from the others."""
    eye, bias = np.eye(3), np.array([0.1, -0.2, 0.05])
    holds = [hold(name) for name in (*FACES, *FACES, *EDGES)]
    left = LEFT * np.resize([1.0, -1.0], len(holds))
    for place, one in enumerate(holds):
        mean = 0.991 * one.accelerometer * (1.0 + left[place] / GRAVITY) + bias
        start = 5.0 * place
        holds[place] = replace(one, start=start, end=start + 2.0, accelerometer=mean)
    accelerometer = SensorFit(
        "accelerometer", ("bias", "scale", "non-orthogonality"), "least_squares", "own",
        eye / 0.991, bias, "m/s^2",
        (
            Parameter("bias_x", 0.1, 0.0004, "m/s^2", True, 0.0006),
            Parameter("sensitivity_x", 0.991, 0.00005, "1"),
            Parameter("theta_yz", 0.0, 0.00007, "rad"),
            Parameter("theta_zy", 0.0, None, "rad", carried=False),
        ),
        "m/s^2", 0.308, LEFT, 0.00157, 0.0009, left,
        validation_rms=0.00187 if validated else None,
        validation=(0.001, -0.003, 0.0012, -0.0016) if validated else (),
    )  # fmt: skip
    rotations = tuple(rotation(axis, sense, holds) for axis in "xyz" for sense in (1.0, -1.0) * 3)
    gyroscope = SensorFit(
        "gyroscope", ("bias", "scale", "non-orthogonality"), "vector", "accelerometer",
        RATE_SCALE * eye, np.full(3, RATE_BIAS), "rad/s",
        (Parameter("bias_x", RATE_BIAS, 0.0001, "rad/s"),),
        "rad", 0.0838, CLOSURE, 0.0108, 0.0018, np.full(18, CLOSURE),
    )  # fmt: skip
    comparison = tuple(
        AxisComparison(axis, 6, 0.0101, 0.975, 0.004, 0.0102, 0.0003, 0.976, 0.002,
                       RATE_BIAS, RATE_SCALE, 0.0006)
        for axis in "xyz"
    )  # fmt: skip
    return FitReport(
        GRAVITY,
        {"accelerometer": 100.0, "gyroscope": 100.0},
        tuple(holds),
        rotations,
        {"accelerometer": accelerometer, "gyroscope": gyroscope},
        comparison,
        warnings=("the stream lost 3 samples",),
    )


def diagnoses(
    gyroscope: Verdict = Verdict.UNEXPLAINED, accelerometer: Verdict = Verdict.COMPLETE
) -> dict[str, Diagnosis]:
    """An accelerometer that is usually complete, and a gyroscope, which usually lacks something."""
    good = "As good as its noise allows: 0.16 mg on directions not seen."
    bad = "The closure is 6 times what the noise makes: something is missing."
    return {
        "accelerometer": Diagnosis("accelerometer", accelerometer, good),
        "gyroscope": Diagnosis("gyroscope", gyroscope, bad),
    }


def exported() -> Exported:
    """What an export says of itself."""
    lost = ("the gyroscope",)
    errors = {"accelerometer": ExportErrors(0.3, 0.001, 0.001, "m/s^2")}
    path = Path("a.yaml")
    fields = ("ros-imu-calib", path, "a = SM · (b − y)", lost, 0.3, 0.001, 0.001)
    return Exported(*fields, files=(path,), sensors=errors)


def unreachable(*_: object) -> NoReturn:
    """What no test here calls."""
    raise AssertionError


@dataclass
class FakeServices:
    """Services that a test replaces one by one."""

    open_source: Callable[[SourceChoice], SampleSource]
    fit: Callable[[Collected, Snapshot], FitReport]
    save: Callable[[FitReport, Benches | None, Path | None], Saved]
    compare: Callable[[FitReport, Collected, Snapshot], Sequence[MethodRow]]
    ports: Callable[[], Sequence[SourceChoice]] = tuple
    earlier: Callable[[], Sequence[SourceChoice]] = tuple
    devices: Callable[[], Sequence[KnownDevice]] = tuple
    history: Callable[[KnownDevice], DeviceHistory] = lambda device: DeviceHistory(
        device, (), (), ()
    )
    exercise: bool = False
    description: Description = field(default_factory=Description)
    benches: Callable[[FitReport, Benches | None], Benches] = lambda report, before: Benches(
        report, before=before
    )
    draft: Callable[[], BenchDraft] = lambda: BenchDraft(())
    diagnose: Callable[[Benches], Mapping[str, Diagnosis]] = lambda _benches: diagnoses()
    grades: Callable[[FitReport, Mapping[str, Diagnosis]], Mapping[str, Graded]] = graded
    targets: Callable[[], Sequence[ExportTarget]] = lambda: tuple(targets().values())
    export: Callable[[Path, str], Exported] = lambda _saved, _target: exported()
    session_elsewhere: Callable[[], Path | None] = lambda: None
    moved: Callable[[Path], None] = lambda _path: None
    loaded: Callable[[], None] = lambda: None
    calibrations: Callable[[], Sequence[SourceChoice]] = tuple
    given_recheck: SourceChoice | None = None
    recheck_with: Callable[[Path | None], None] = lambda _calibration: None
    recheck: Callable[[Collected, Snapshot], tuple[Recheck, Calibration, Saved]] = field(
        default=unreachable
    )

    def describe(self, description: Description) -> None:
        """State device, place and operator."""
        self.description = description


def services(source: FakeSource, path: Path = Path("calibration.json")) -> FakeServices:
    """Services around one fake source."""

    def save(fitted: FitReport, benches: Benches | None = None, place: Path | None = None) -> Saved:
        found = fitted if benches is None else benches.fitted()
        return Saved(place or path, (f"saved {path}",), found)

    def open_source(_choice: SourceChoice) -> FakeSource:
        return source

    def compare(
        found: FitReport, _collected: Collected, _snapshot: Snapshot
    ) -> Sequence[MethodRow]:
        return method_rows(found, "rad/s", None, None)

    return FakeServices(open_source, lambda _collected, _snapshot: report(), save, compare)
