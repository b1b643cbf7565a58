"""The history of a device: its calibrations, rechecks and sessions, as the catalogue lists them."""

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from imucal_wizard.core.records import dataclass
from imucal_wizard.sessions.session_list import SessionInfo


@dataclass(frozen=True)
class KnownDevice:
    """A device of the catalogue.

    Attributes:
        name: the newest that was given; the serial number where there is none.
        serial: serial number, or "".
        chip: kind of chip, or "".
        format: of its readings, or "".
        calibrations: number of measurements that have a calibration.
        rechecks: number of rechecks.
        sessions: number of sessions.
        last: newest of all, seconds since 1970.
    """

    name: str
    serial: str = ""
    chip: str = ""
    format: str = ""
    calibrations: int = 0
    rechecks: int = 0
    sessions: int = 0
    last: float = 0.0


def distinct_names(devices: Sequence[KnownDevice]) -> list[str]:
    """The names of devices, with the serial number where several have the same name."""
    count = Counter(one.name.casefold() for one in devices)
    return [
        f"{one.name} {one.serial}".rstrip() if count[one.name.casefold()] > 1 else one.name
        for one in devices
    ]


@dataclass(frozen=True)
class PastParameter:
    """One parameter of a past calibration.

    Attributes:
        value: in ``unit``.
        standard_error: or None.
        unit: unit word.
        determined: False if it has its nominal value.
    """

    value: float
    standard_error: float | None
    unit: str
    determined: bool


@dataclass(frozen=True, eq=False)
class PastSensor:
    """One sensor of a past calibration.

    Attributes:
        model: terms.
        unit: of the errors.
        bias_unit: of the readings.
        verdict: or "".
        grade: or "".
        error: as left: held out, fitted where nothing could be held out; ``unit``.
        as_found: error of the same readings by the calibration before, ``unit``; or None.
        as_found_by: name of that calibration's file; "" for the nominal conversion.
        freedom: degrees of freedom of the standard errors, or None.
        parameters: by name.
        covariance: of all parameters in their order, or None.
    """

    model: tuple[str, ...]
    unit: str
    bias_unit: str
    verdict: str
    grade: str
    error: float | None
    as_found: float | None
    as_found_by: str
    freedom: int | None
    parameters: Mapping[str, PastParameter]
    covariance: list[list[float]] | None


@dataclass(frozen=True, eq=False)
class PastCalibration:
    """A calibration of the history.

    Attributes:
        path: the file.
        measured: date of the measurement, seconds since 1970.
        saved: date of the file.
        session: name of its session's file, or "".
        measurement: equal of calibrations of one measurement.
        temperature: lowest and highest, °C, or None.
        place: or "".
        operator: or "".
        note: or "".
        sensors: by name.
    """

    path: Path
    measured: float
    saved: float
    session: str
    measurement: str
    temperature: tuple[float, float] | None
    place: str
    operator: str
    note: str
    sensors: Mapping[str, PastSensor]


@dataclass(frozen=True, eq=False)
class PastRecheck:
    """A recheck of the history.

    Attributes:
        path: the file.
        checked: date, seconds since 1970.
        verdict: ``go``, ``no-go`` or ``insufficient``.
        calibration: name of the calibration's file, or "".
        session: name of its session's file, or "".
        document: the result.
    """

    path: Path
    checked: float
    verdict: str
    calibration: str
    session: str
    document: Mapping[str, Any]


@dataclass(frozen=True, eq=False)
class DeviceHistory:
    """What is known of one device, oldest first.

    Attributes:
        device: the device.
        calibrations: one of each measurement, the one saved last.
        rechecks: all.
        sessions: all.
    """

    device: KnownDevice
    calibrations: tuple[PastCalibration, ...]
    rechecks: tuple[PastRecheck, ...]
    sessions: tuple[SessionInfo, ...]
