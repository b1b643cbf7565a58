"""A physical effect: by how much each parameter changes the reading, and its description.

The model equation of a sensor is ``y = S·(x + ε) + b + noise``; an effect is one term of ``ε``,
linear in its parameters, on top of bias, scale and non-orthogonality. ``AxisEffect`` is the base of
effects with one parameter per axis, ``BiasEffect`` of those that move the zero, ``ForceEffect`` of
those by which the specific force moves the rate.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from copy import copy
from dataclasses import field, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from imucal_wizard.core.poses import AXES
from imucal_wizard.core.readings import FloatArray, distinct
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.units import ACCELERATION_UNITS, RATE_UNITS, STANDARD_GRAVITY


@dataclass(frozen=True)
class Story:
    """What an author writes about an effect, for a student.

    Attributes:
        what: what happens in the sensor.
        equation: the equation in words.
        signature: what it looks like in the residuals.
        needs: what data reveal it.
        remedy: what to do about it.
        confirm: a test that shows it without this program's fit.
        source: where to read about it.
    """

    what: str
    equation: str
    signature: str
    needs: str
    remedy: str = ""
    confirm: str = ""
    source: str = ""


ACCELEROMETER = "accelerometer"
GYROSCOPE = "gyroscope"
MAGNETOMETER = "magnetometer"
INPUT_OF = {ACCELEROMETER: "force", GYROSCOPE: "rate", MAGNETOMETER: "magnetic"}
"""Which of the circumstances a sensor measures."""
SENSORS = tuple(INPUT_OF)
"""In the order in which they are judged."""

Kind = Literal["orientation", "time", "hold"]
Against = Literal["input", "force", "temperature", "time", "previous", "vibration", "current"]
Grades = Mapping[str, tuple[float, float]]
Rows = NDArray[np.bool_] | NDArray[np.intp] | slice


@dataclass(frozen=True)
class FieldUnit:
    """The unit in which a magnetic field is shown.

    Attributes:
        name: ``uT``, or ``count`` where the field's size is not known.
        size: one µT in it, of counts about.
    """

    name: str = "uT"
    size: float = 1.0


WARMING_CELL = 45.0
"""Temperatures are averaged over so many seconds before they are differentiated: a thermometer's
steps of a sixteenth of a degree make a slope of some 0.0003 °C/s then, a warming device one of
0.02 °C/s."""


def spline_slope(x: FloatArray, y: FloatArray, at: FloatArray) -> FloatArray:
    """Slope of the cubic spline through n points, n ≥ 2, at some places.

    At either end it has the slope of the polynomial through the four points there.
    """
    step = np.diff(x)
    secant = np.diff(y) / step
    ends = min(len(x), 4)
    first = np.polynomial.Polynomial.fit(x[:ends], y[:ends], ends - 1).deriv()(x[0])
    last = np.polynomial.Polynomial.fit(x[-ends:], y[-ends:], ends - 1).deriv()(x[-1])
    # its second derivative is continuous: a tridiagonal system in the slopes, by elimination
    diagonal = 2.0 * (1.0 / step[:-1] + 1.0 / step[1:])
    right = 3.0 * (secant[:-1] / step[:-1] + secant[1:] / step[1:])
    slope, above, known = np.empty(len(x)), np.zeros(len(x)), np.empty(len(x))
    slope[0], slope[-1], known[0] = first, last, first
    for k in range(1, len(x) - 1):
        pivot = diagonal[k - 1] - above[k - 1] / step[k - 1]
        above[k] = 1.0 / (step[k] * pivot)
        known[k] = (right[k - 1] - known[k - 1] / step[k - 1]) / pivot
    for k in range(len(x) - 2, 0, -1):
        slope[k] = known[k] - above[k] * slope[k + 1]
    own = np.clip(np.searchsorted(x, at, side="right") - 1, 0, len(step) - 1)
    s = (at - x[own]) / step[own]
    before, after = slope[own], slope[own + 1]
    bend = 6.0 * s * (1.0 - s) * secant[own]
    return np.asarray(bend + (3.0 * s - 1.0) * (s - 1.0) * before + s * (3.0 * s - 2.0) * after)


@dataclass(frozen=True, eq=False)
class Circumstances:
    """All that an effect may depend on, one row per hold or per sample.

    Temperature and drift are relative to a reference, so that the bias keeps its meaning. The
    reference belongs to the session: rows selected from it, or the samples of one of its rotations,
    are given the same one.

    Attributes:
        force: true specific force in the body frame, m/s², shape (n, 3).
        rate: true angular rate in the body frame, rad/s, shape (n, 3); zeros at rest.
        temperature: °C, shape (n,); NaN where it is unknown.
        time: s since the session's first sample, shape (n,).
        previous: specific force of the hold before, m/s², shape (n, 3); NaN before the first.
        vibration: mean square vibration, sum over the axes, (m/s²)², shape (n,).
        magnetic: true flux density in the body frame, in ``field_unit``, shape (n, 3); NaN where
            none is given.
        current: what the board's motors draw, A, or their throttle, %, shape (n,); NaN unknown.
        current_unit: ``A`` or ``%``.
        seconds: length of time of which a row is the mean, s, shape (n,); 0 of a sample.
        history: time, s, and temperature, °C, of the whole session, in any order; that of the rows
            when none is given.
        gravity: local gravity, m/s².
        field_unit: of ``magnetic``.
        reference_temperature: mean temperature of the session, °C; NaN takes the mean of the rows.
        reference_time: middle of the session, s; NaN takes the middle of the rows.
    """

    force: FloatArray
    rate: FloatArray
    temperature: FloatArray
    time: FloatArray
    previous: FloatArray
    vibration: FloatArray
    magnetic: FloatArray = field(default_factory=lambda: np.zeros((0, 3)))
    current: FloatArray = field(default_factory=lambda: np.zeros(0))
    current_unit: str = "A"
    seconds: FloatArray = field(default_factory=lambda: np.zeros(0))
    history: tuple[FloatArray, FloatArray] = (np.zeros(0), np.zeros(0))
    gravity: float = STANDARD_GRAVITY
    field_unit: FieldUnit = field(default_factory=FieldUnit)
    reference_temperature: float = np.nan
    reference_time: float = np.nan

    def __post_init__(self) -> None:
        if len(self.magnetic) != len(self):
            object.__setattr__(self, "magnetic", np.full((len(self), 3), np.nan))
        if len(self.current) != len(self):
            object.__setattr__(self, "current", np.full(len(self), np.nan))
        if len(self.seconds) != len(self):
            object.__setattr__(self, "seconds", np.zeros(len(self)))
        if not len(self.history[0]):
            object.__setattr__(self, "history", (self.time, self.temperature))
        known = self.temperature[np.isfinite(self.temperature)]
        if np.isnan(self.reference_temperature) and len(known):
            object.__setattr__(self, "reference_temperature", float(known.mean()))
        if np.isnan(self.reference_time) and len(self):
            middle = 0.5 * float(self.time.min() + self.time.max())
            object.__setattr__(self, "reference_time", middle)

    def __len__(self) -> int:
        return len(self.time)

    @property
    def warming(self) -> FloatArray:
        """Rate of change of the temperature, °C/s, shape (n,); 0 where it is unknown.

        Of a cubic spline through the history's means over ``WARMING_CELL`` seconds: with straight
        lines an exponential course would differ by a tenth from its own slope.
        """
        time, temperature = self.history
        known = np.isfinite(temperature)
        then, warmth = time[known], temperature[known]
        if not len(then):
            return np.zeros(len(self))
        order = np.argsort(then, kind="stable")
        then, warmth = then[order], warmth[order]
        cell = np.floor((then - then[0]) / WARMING_CELL)
        first = np.flatnonzero(np.diff(cell, prepend=-1.0))
        count = np.diff(first, append=len(then))
        middle, mean = (np.add.reduceat(one, first) / count for one in (then, warmth))
        if len(middle) < 2:
            return np.zeros(len(self))
        return spline_slope(middle, mean, self.time)

    def share_after(self, moment: float) -> FloatArray:
        """Which part of each row lies after a moment, from 0 to 1, shape (n,)."""
        part = (self.time + 0.5 * self.seconds - moment) / np.maximum(self.seconds, 1e-9)
        return np.where(self.seconds > 0.0, np.clip(part, 0.0, 1.0), self.time >= moment)

    def sensing(self, sensor: str, values: FloatArray) -> "Circumstances":
        """The same with other true inputs of a sensor, SI, shape (n, 3)."""
        made = copy(self)  # what is completed in __post_init__ stays as it is
        object.__setattr__(made, INPUT_OF[sensor], values)
        return made

    def select(self, rows: Rows) -> "Circumstances":
        """These rows, with the reference of the whole."""
        return replace(
            self,
            force=self.force[rows],
            rate=self.rate[rows],
            temperature=self.temperature[rows],
            time=self.time[rows],
            previous=self.previous[rows],
            vibration=self.vibration[rows],
            magnetic=self.magnetic[rows],
            current=self.current[rows],
            seconds=self.seconds[rows],
        )

    def joined(self, other: "Circumstances") -> "Circumstances":
        """These rows and then the other's, with the reference of these."""
        return replace(
            self,
            force=np.concatenate([self.force, other.force]),
            rate=np.concatenate([self.rate, other.rate]),
            temperature=np.concatenate([self.temperature, other.temperature]),
            time=np.concatenate([self.time, other.time]),
            previous=np.concatenate([self.previous, other.previous]),
            vibration=np.concatenate([self.vibration, other.vibration]),
            magnetic=np.concatenate([self.magnetic, other.magnetic]),
            current=np.concatenate([self.current, other.current]),
            seconds=np.concatenate([self.seconds, other.seconds]),
        )


@dataclass(frozen=True)
class EffectParameter:
    """One number of an effect.

    Attributes:
        name: output axis, then what moves it: ``x``, ``xy`` (x feels y), ``xyz`` (x feels y·z).
        unit: the unit in which it is shown, ``mg/g²``.
        typical: standard deviation of the prior, that of a consumer part, in ``unit``.
        grades: realistic magnitudes (low, high) by sensor grade, in ``unit``.
        chosen: the grades whose range is a typical choice and stands in no data sheet.
    """

    name: str
    unit: str
    typical: float
    grades: Grades = field(default_factory=dict)
    chosen: tuple[str, ...] = ()


class Effect(ABC):
    """One physical effect: a term of ``ε``, linear in its parameters.

    Attributes:
        name: as in the contract, ``second-order``.
        sensors: which sensors may have it.
        family: the family that 1 g cannot split, or None.
        kind: what its size follows: the orientation, the time (or temperature), or the hold.
        title: its name in plain words.
        equation: its formula on axis ``i``, ``x`` being the true input.
        order: place in lists; the plainest of a family first.
        against: what to draw the residuals over, to see it.
        field_unit: in which its error of a magnetic field is shown, see ``suited``.
        graded: whether what lies between two of its ``variants`` is a setting, too.
        sudden: its setting is a moment, at any place between two of its ``variants``.
        paired: whether pairs with all other effects are looked for, at all its settings. If not,
            every second setting is paired with effects that have none: the moments of a second
            step would be most of the pairs.
        aliases: effects of its family that no data of a still sensor at 1 g, or of rotations from
            rest to rest, distinguish from it, where their sizes are chosen for that.
        aliases_while_settling: effects of its family that make the same error while the temperature
            settles exponentially; whether it does is seen from the data.
        free: it is a free curve: its parameters are coefficients of one course, which is shown
            by its rms.
        hides: where it acts, readings do not show the input, so that they remain wrong with it.
        bounded: its size is never far above the typical one, unlike that of a faulty sensor.
        gauge: combinations of its parameters that add up to nothing, whatever the input. They are
            zero by convention, and the sizes and their standard errors are of the rest.
        stories: its lesson, by sensor.
    """

    name: str
    sensors: tuple[str, ...]
    family: str | None = None
    kind: Kind
    title: str
    equation: str
    order: int = 100
    against: Against = "input"
    graded: bool = False
    sudden: bool = False
    paired: bool = True
    aliases: tuple[str, ...] = ()
    aliases_while_settling: tuple[str, ...] = ()
    free: bool = False
    hides: bool = False
    bounded: bool = False
    gauge: tuple[tuple[float, ...], ...] = ()
    field_unit: FieldUnit = FieldUnit()
    stories: Mapping[str, Story] = {}

    @abstractmethod
    def parameters(self, sensor: str) -> tuple[EffectParameter, ...]:
        """Its parameters on this sensor, p of them."""

    def stored_units(self, sensor: str) -> tuple[str, ...]:
        """Units that the first of them may have, as the recording allows."""
        return (self.parameters(sensor)[0].unit,)

    @abstractmethod
    def columns(self, sensor: str, c: Circumstances, variant: float | None = None) -> FloatArray:
        """Error ``ε`` of the input per shown unit of each parameter.

        Args:
            sensor: ``accelerometer``, ``gyroscope`` or ``magnetometer``.
            c: n rows of circumstances.
            variant: one of ``variants``, or None for the usual one.

        Returns:
            m/s², rad/s or µT per shown unit, shape (n, 3, p).
        """

    def axis_columns(
        self, sensor: str, c: Circumstances, variant: float | None = None
    ) -> FloatArray | None:
        """Error of each axis by its own k parameters, where every parameter moves one axis only.

        Returns:
            The other entries of ``columns`` are zero and left out: m/s², rad/s or µT per shown
            unit, shape (n, 3, k), the parameters of x coming first. None for any other effect.
        """
        del sensor, c, variant
        return None

    def typical(self, sensor: str, variant: float | None = None) -> FloatArray:
        """Prior standard deviation of each parameter at a setting, shown unit, shape (p,)."""
        del variant
        return np.array([parameter.typical for parameter in self.parameters(sensor)])

    def suited(self, c: Circumstances) -> "Effect":
        """The effect in the units of what these data have recorded.

        Args:
            c: all the session's rows.
        """
        del c
        return self

    def variants(self, c: Circumstances) -> tuple[float | None, ...]:
        """Settings of what is not linear in it (a time constant, a moment), tried one by one.

        Args:
            c: one row per hold, in the order of time.
        """
        del c
        return (None,)

    def lacking(self, sensor: str, c: Circumstances) -> str | None:
        """What these data lack to show the effect at all; None where nothing is lacking.

        Args:
            sensor: whose effect it would be.
            c: all the session's rows; for the gyroscope those in motion too.
        """
        del sensor, c
        return None

    def c_columns(
        self, sensor: str, variant: float | None = None
    ) -> tuple[tuple[int, int, str], ...]:
        """Its columns in C, for firmware: output axis, parameter and expression of each.

        An expression is m/s², rad/s or µT per shown unit, of these numbers: ``x0``, ``x1``, ``x2``,
        the true input, and ``f0`` … the force, both in data sheet units; ``before0`` … the force in
        the pose before, g; ``warmth``, °C from the reference; ``time`` since the session's first
        sample and ``since_middle``, s; ``vibration``, g²; ``current``; ``warming``, °C/s.

        Returns:
            Nothing where the effect has no form in C.
        """
        del sensor, variant
        return ()

    def error(
        self, sensor: str, c: Circumstances, sizes: FloatArray, variant: float | None = None
    ) -> FloatArray:
        """``ε`` of the input, m/s², rad/s or µT, shape (n, 3), for sizes (p,) in shown units."""
        return np.asarray(self.columns(sensor, c, variant) @ sizes, np.float64)

    def hidden(self, sensor: str, c: Circumstances, sizes: FloatArray) -> FloatArray:
        """Largest error of the corrected input where readings do not show it, 0 elsewhere.

        Nobody knows the pose before the first hold. An effect of it may be as large as in any pose:
        a component of a direction that may be any is as likely at every value up to 1 g.

        Args:
            sensor: whose effect it is.
            c: n rows with the input as corrected.
            sizes: of its parameters, shown units, shape (p,).

        Returns:
            On each axis, SI, shape (n, 3); every smaller one is as likely.
        """
        found, unknown = np.zeros((len(c), 3)), np.flatnonzero(np.isnan(c.previous[:, 0]))
        if self.kind != "hold" or not len(unknown):
            return found
        there = c.select(unknown)
        taken = self.error(sensor, there, sizes)
        for face in c.gravity * np.concatenate([np.eye(3), -np.eye(3)]):
            before = np.broadcast_to(face, (len(there), 3))
            might = self.error(sensor, replace(there, previous=before), sizes)
            found[unknown] = np.maximum(found[unknown], np.abs(might - taken))
        return found


def c_number(value: float) -> str:
    """A number as a literal of C's ``float``, with all digits that it has."""
    return f"{value:.9e}f"


def c_step(moment: float | None) -> str:
    """1 from a moment on, 0 before, in C; from the session's middle on by default."""
    return "(since_middle >= 0.0f)" if moment is None else f"(time >= {c_number(moment)})"


MILLI_G = ACCELERATION_UNITS["mg"]
DEGREE = RATE_UNITS["deg/s"]
PPM = 1e-6
DATA_SHEET_UNIT = {ACCELEROMETER: ACCELERATION_UNITS["g"], GYROSCOPE: DEGREE, MAGNETOMETER: 1.0}
"""SI (or µT) per g, °/s, µT: the units in which data sheets quote effects."""


def sensed(sensor: str, c: Circumstances) -> FloatArray:
    """The true input of the sensor in the unit of data sheets: g, °/s or µT, shape (n, 3)."""
    values: FloatArray = getattr(c, INPUT_OF[sensor])
    return values / DATA_SHEET_UNIT[sensor]


def warmth(c: Circumstances) -> FloatArray:
    """Temperature from the session's mean, °C, shape (n,); 0 where it is unknown."""
    return np.nan_to_num(c.temperature - c.reference_temperature, nan=0.0)


def since_middle(c: Circumstances) -> FloatArray:
    """Time from the session's middle, min, shape (n,)."""
    return (c.time - c.reference_time) / 60.0


SMALLEST_SIDE = 3
"""Holds on either side of a step; with fewer, disturbed holds are the plainer explanation."""


def step_moments(c: Circumstances) -> tuple[float | None, ...]:
    """Moments half way between neighbouring holds, s; None alone where there are too few holds.

    Args:
        c: one row per hold.
    """
    times = distinct(c.time)
    middles = 0.5 * (times[1:] + times[:-1])
    inner = middles[SMALLEST_SIDE - 1 : len(middles) - SMALLEST_SIDE + 1]
    return tuple(float(moment) for moment in inner) or (None,)


@dataclass(frozen=True)
class Size:
    """How large an effect is on one sensor.

    Attributes:
        unit: shown unit of its parameters.
        si: m/s², rad/s or µT per shown unit and unit of what it multiplies.
        typical: of a consumer part, the prior's standard deviation, in ``unit``.
        grades: realistic magnitudes by sensor grade, in ``unit``.
        chosen: grades whose range is a typical choice and stands in no data sheet.
    """

    unit: str
    si: float
    typical: float
    grades: Grades = field(default_factory=dict)
    chosen: tuple[str, ...] = ()

    def of_field(self, unit: FieldUnit) -> "Size":
        """The same of a field in another unit than µT."""
        return replace(
            self,
            unit=self.unit.replace("µT", unit.name),
            typical=unit.size * self.typical,
            grades={
                grade: (unit.size * low, unit.size * high)
                for grade, (low, high) in self.grades.items()
            },
        )

    def parameter(self, name: str) -> EffectParameter:
        """A parameter of this size."""
        return EffectParameter(name, self.unit, self.typical, self.grades, self.chosen)


class AxisEffect(Effect):
    """An effect whose parameter ``K_i`` moves axis ``i`` only: ``ε_i = K_i · shape_i``."""

    sizes: Mapping[str, Size]

    def suited(self, c: Circumstances) -> "AxisEffect":
        """On a magnetometer in the unit of its field."""
        if MAGNETOMETER not in self.sizes or c.field_unit.name == "uT":
            return self
        made = copy(self)
        made.field_unit = c.field_unit
        made.sizes = {MAGNETOMETER: self.sizes[MAGNETOMETER].of_field(c.field_unit)}
        return made

    @abstractmethod
    def shape(self, sensor: str, c: Circumstances, variant: float | None) -> FloatArray:
        """What ``K_i`` multiplies on each axis, in data sheet units, shape (n, 3)."""

    def c_shape(self, variant: float | None) -> str:
        """``shape`` in C, ``{x}`` being the axis's input; "" where it has none.

        ``{before}`` is the force along the axis in the pose before.
        """
        del variant
        return ""

    def c_columns(
        self, sensor: str, variant: float | None = None
    ) -> tuple[tuple[int, int, str], ...]:
        """See ``Effect``."""
        text, factor = self.c_shape(variant), c_number(self.sizes[sensor].si)
        axes = range(3) if text else ()
        return tuple(
            (i, i, f"{factor} * {text.format(x=f'x{i}', before=f'before{i}')}") for i in axes
        )

    def parameters(self, sensor: str) -> tuple[EffectParameter, ...]:
        """``x``, ``y``, ``z``."""
        return tuple(self.sizes[sensor].parameter(axis) for axis in AXES)

    def columns(self, sensor: str, c: Circumstances, variant: float | None = None) -> FloatArray:
        """Shape (n, 3, 3), diagonal in output axis and parameter."""
        columns = np.zeros((len(c), 9))
        columns[:, ::4] = self.axis_columns(sensor, c, variant)[:, :, 0]
        return columns.reshape(-1, 3, 3)

    def axis_columns(
        self, sensor: str, c: Circumstances, variant: float | None = None
    ) -> FloatArray:
        """See ``Effect``."""
        return np.asarray(self.sizes[sensor].si * self.shape(sensor, c, variant))[:, :, None]


class BiasEffect(AxisEffect):
    """An effect that moves the zero of all three axes by the same course: ``ε_i = K_i · s``."""

    @abstractmethod
    def course(self, c: Circumstances, variant: float | None) -> FloatArray:
        """``s``, in data sheet units, shape (n,)."""

    def shape(self, sensor: str, c: Circumstances, variant: float | None) -> FloatArray:
        """The course on each axis."""
        del sensor
        return np.repeat(self.course(c, variant)[:, None], 3, axis=1)


class ForceEffect(Effect):
    """``ε_i = Σ_j K_ij felt_j`` with the nine parameters ``xx``, ``xy`` … ``zz``."""

    size: Size

    @abstractmethod
    def felt(self, c: Circumstances) -> FloatArray:
        """What the force does, in data sheet units, shape (n, 3)."""

    def c_felt(self) -> tuple[str, ...]:
        """``felt`` in C; nothing where it has none."""
        return ()

    def c_columns(
        self, sensor: str, variant: float | None = None
    ) -> tuple[tuple[int, int, str], ...]:
        """See ``Effect``."""
        del sensor, variant
        factor, felt = c_number(self.size.si), self.c_felt()
        return tuple(
            (i, 3 * i + j, f"{factor} * {one}") for i in range(3) for j, one in enumerate(felt)
        )

    def parameters(self, sensor: str) -> tuple[EffectParameter, ...]:
        """Output axis, then input axis."""
        del sensor
        return tuple(self.size.parameter(out + inp) for out in AXES for inp in AXES)

    def columns(self, sensor: str, c: Circumstances, variant: float | None = None) -> FloatArray:
        """Shape (n, 3, 9): output axis ``i`` has the three columns ``3i`` to ``3i + 2``."""
        own = self.axis_columns(sensor, c, variant)
        columns = np.zeros((len(c), 3, 9))
        for axis in range(3):
            columns[:, axis, 3 * axis : 3 * axis + 3] = own[:, axis]
        return columns

    def axis_columns(
        self, sensor: str, c: Circumstances, variant: float | None = None
    ) -> FloatArray:
        """See ``Effect``: the same on each axis."""
        del sensor, variant
        felt = self.size.si * self.felt(c)
        return np.broadcast_to(felt[:, None], (len(c), 3, 3))
