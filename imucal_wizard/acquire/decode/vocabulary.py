"""The vocabulary of columns: the channel and the unit that a name means."""

import re
from dataclasses import replace
from pathlib import PurePath

from imucal_wizard.acquire.decode.base import Column
from imucal_wizard.core import units

SENSOR_CHANNELS: dict[str, tuple[str, ...]] = {
    "accelerometer": ("ax", "ay", "az"),
    "gyroscope": ("gx", "gy", "gz"),
    "magnetometer": ("mx", "my", "mz"),
    "temperature": ("temp",),
    "current": ("current",),
    "throttle": ("throttle",),
}
"""The channels of each sensor, in axis order."""
LETTER_OF_SENSOR = {"accelerometer": "a", "gyroscope": "g", "magnetometer": "m"}
"""The first letter of a sensor's channels."""
SENSOR_LETTERS: dict[str, str] = {
    word: channel
    for channel, words in {
        "a": "a acc accl accel accelerometer acceleration acceler accelero xl",
        "g": "g gyr gyro gyroscope gyros w omega rate angularrate angularvelocity rotation",
        "m": "m mag magn magnet magneto magnetometer magnetic magneticfield field compass",
    }.items()
    for word in words.split()
}
SINGLE_CHANNELS: dict[str, str] = {
    word: channel
    for channel, words in {
        "t": "t time timestamp timestamps ts micros millis tick ticks clock uptime timeus timems "
        "rtctime datetime stamp elapsed",
        "temp": "temp temperature tmp tempr imutemp imudegc",
        "current": "current amps amperes motorcurrent batterycurrent",
        "throttle": "throttle",
        "counter": "counter count cnt seq sequence packet packetcounter index sample samplecount "
        "loopiteration nsamples samples samplenumber idx packetnumber framecount",
    }.items()
    for word in words.split()
}
_AXES = {"x": "x", "y": "y", "z": "z", "0": "x", "1": "y", "2": "z"}
_SENSOR_AXIS = re.compile(r"(?P<sensor>[a-z]+)(?P<axis>[xyz012])")
_LABELLED = re.compile(r"[:=]\s*[^\s:=]")
"""``AccelX:0.12`` is a reading with its label, not a name."""
_WORD = re.compile(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])|\d+")

_PHRASES: dict[tuple[str, ...], str] = {
    ("angular", "velocity"): "g",
    ("angular", "rate"): "g",
    ("angular", "speed"): "g",
    ("rotation", "rate"): "g",
    ("turn", "rate"): "g",
    ("rate", "of", "turn"): "g",
    ("specific", "force"): "a",
    ("magnetic", "field"): "m",
    ("flux", "density"): "m",
}


def _set_of(words: str) -> frozenset[str]:
    return frozenset(words.split())


_OF_TIME = frozenset({"time", "timestamp", "timestamps", "stamp", "elapsed", "clock"})
_BESIDE_TIME = _set_of(
    "since start in boot reboot seconds milliseconds ms us ns header device sensor imu host unix "
    "epoch utc local logging rosbag field cal shimmer sample accelerometer gyroscope gyro"
)
_BESIDE_SENSORS = _set_of(
    "imu sensor sensors data field msg message raw cal uncal uncalibrated calibrated total ln wr "
    "shimmer adc smooth value val measurement axis header dev device including gravity"
)
"""Words in a name, besides sensor and axis, that do not change its meaning."""

# derived quantities, and accelerations from which the device has removed gravity
_NOT_A_READING = re.compile(
    r"linear|(?<!including)gravity|quat|euler|orient|angle|yaw|pitch|roll|heading"
    r"|^(?:ypr|rpy|areal|aworld)$"
)


def is_derived(word: str) -> bool:
    """Whether a squeezed name means a derived quantity and not a reading."""
    return bool(_NOT_A_READING.search(word))


def channel_of(name: str) -> str:
    """The channel of a name (``ax`` for "AccelX", "acc_x", "imu/acceleration.x"), or ``""``."""
    word = squeeze_name(name)
    if is_derived(word):
        return ""
    if word in SINGLE_CHANNELS:
        return SINGLE_CHANNELS[word]
    match = _SENSOR_AXIS.fullmatch(word)
    if match is not None and match["sensor"] in SENSOR_LETTERS:
        return SENSOR_LETTERS[match["sensor"]] + _AXES[match["axis"]]
    if _LABELLED.search(name):
        return ""
    words = [found.lower() for found in _WORD.findall(name)]
    return _time_of(words) or _axis_of(words)


def sensor_word(word: str) -> str:
    """``a``, ``g`` or ``m`` for the name of a sensor, ``temp`` for a temperature, or ``""``."""
    word = word.lower()
    if is_derived(word):
        return ""
    single = SINGLE_CHANNELS.get(word, "")
    return single if single == "temp" else SENSOR_LETTERS.get(word, "")


def squeeze_name(name: str) -> str:
    """A name reduced to lower-case letters and digits."""
    return re.sub(r"[^a-z0-9]", "", name.lower())


def _time_of(words: list[str]) -> str:
    """``t`` if the words mean a time ("Time since start in ms", "header.stamp"), or ``""``."""
    if not _OF_TIME & set(words):
        return ""
    return "t" if set(words) <= _OF_TIME | _BESIDE_TIME else ""


def _axis_of(words: list[str]) -> str:
    """The channel of several words that name one sensor and one axis; or ``""``."""
    words = _parted(words)
    letters = [word for word in words if word in ("x", "y", "z")]
    if len(letters) > 1 or not words:
        return ""
    axis = letters[0] if letters else _AXES.get(words[-1], "")
    rest = [w for w in _joined(words) if w not in _BESIDE_SENSORS and not w.isdigit()]
    rest = [w for w in rest if w not in ("x", "y", "z")]
    if rest[1:] == ["rs", "s"]:  # EuRoC's w_RS_S_x: from the reference frame to the sensor's
        rest = rest[:1]
    sensors = {SENSOR_LETTERS.get(w, "") for w in rest}
    return sensors.pop() + axis if len(sensors) == 1 and axis and "" not in sensors else ""


def _parted(words: list[str]) -> list[str]:
    """The words, with ``accx`` split in two."""
    parts: list[str] = []
    for word in words:
        match = _SENSOR_AXIS.fullmatch(word)
        known = match is not None and match["sensor"] in SENSOR_LETTERS
        parts += [match["sensor"], match["axis"]] if match is not None and known else [word]
    return parts


def _joined(words: list[str]) -> list[str]:
    """The words, with each phrase that names a sensor replaced by its letter."""
    for phrase, letter in _PHRASES.items():
        for place in range(len(words) - len(phrase) + 1):
            if tuple(words[place : place + len(phrase)]) == phrase:
                return [*words[:place], letter, *_joined(words[place + len(phrase) :])]
    return words


_SUFFIXES: dict[str, str] = {
    "us": "us",
    "ms": "ms",
    "s": "s",
    "sec": "s",
    "ns": "ns",
    "g": "g",
    "mg": "mg",
    "ms2": "m/s^2",
    "mps2": "m/s^2",
    "dps": "deg/s",
    "mdps": "mdeg/s",
    "degs": "deg/s",
    "mdegs": "mdeg/s",
    "rad": "rad/s",
    "rads": "rad/s",
    "mrads": "mrad/s",
    "rps": "rad/s",
    "ut": "uT",
    "degc": "degC",
    "c": "degC",
    "raw": "count",
    "lsb": "count",
}
_BRACKETED = re.compile(r"^(?P<name>[^\[(]*)[\[(](?P<unit>.*?)[\])]?\s*$")
_INDEXED = re.compile(r"^(?P<name>.+)\[(?P<index>[012])\]$")
_IN_UNIT = re.compile(r"^(?P<name>.+)\s+in\s+(?P<unit>\S+)$")
_TWO_WORDS = re.compile(r"^(?P<name>.+)_(?P<unit>m?(?:rad|deg)_s|m_s_?2|mps_2)$", re.IGNORECASE)
_IMPLIED = {
    "micros": "us",
    "millis": "ms",
    "timeus": "us",
    "timems": "ms",
    "rtctime": "s",
    "imudegc": "degC",
    "secondselapsed": "s",
}
_LINEAR = re.compile(r"linear[\W_]*(?=acc)", re.IGNORECASE)


def column_of_name(name: str, file: str = "") -> Column:
    """The column that a name in a header means.

    Args:
        name: the name.
        file: name of the file, which may name the sensor of the bare axes ``x``, ``y``, ``z``.

    Returns:
        The column; its channel is ``""`` for an unknown name, its unit ``""`` if the name has
        none. An unknown word in brackets stays as it is.
    """
    name = name.strip().strip("\"'").strip()
    bare, unit = _split_unit(name)
    index = _INDEXED.match(bare)
    bare, axis = (index["name"], "." + index["index"]) if index else (bare, "")
    channel = ""
    if not unit:
        channel, unit = _with_suffix(bare, axis)
    channel = _of_unit(channel or channel_of(bare + axis), bare, unit)
    if not channel and bare.lower() in ("x", "y", "z") and (sensor := _sensor_of_file(file)):
        channel = sensor + bare.lower()
    if channel and not unit:
        unit = _IMPLIED.get(squeeze_name(bare), "degC" if channel == "temp" else "")
    unit = units.unit_for_sensor(quantity_of(channel) or "", unit)
    return Column(channel, unit if channel else "", name)


def _sensor_of_file(file: str) -> str:
    """The sensor named by a file such as ``Gyroscope.csv``, or ""."""
    words = [word.lower() for word in _WORD.findall(PurePath(file).stem)]
    sensors = {sensor_word(w) for w in words if w.startswith(("acc", "gyr", "mag"))} - {""}
    return sensors.pop() if len(sensors) == 1 else ""


def _split_unit(name: str) -> tuple[str, str]:
    """A name without its unit, and the unit; an index in brackets stays with the name."""
    if _INDEXED.match(name):
        return name, ""
    match = _BRACKETED.match(name) or _IN_UNIT.match(name)
    if match is None:
        return name, ""
    unit = units.canonical_unit(match["unit"])
    return match["name"].strip(), unit


def _of_unit(channel: str, bare: str, unit: str) -> str:
    """The channel, corrected by the unit: ``X (rad/s)`` is a rate, ``T (°C)`` is not a time."""
    word = squeeze_name(bare)
    if word == "t" and unit in units.TEMPERATURE_UNITS:
        return "temp"
    if channel or word not in ("x", "y", "z"):
        return channel
    sensors = [s for s, letter in LETTER_OF_SENSOR.items() if unit in units.UNIT_FACTORS[s]]
    return LETTER_OF_SENSOR[sensors[0]] + word if len(sensors) == 1 else ""


def unit_belongs(channel: str, unit: str) -> bool:
    """Whether a unit is valid for this channel."""
    sensor = quantity_of(channel)
    if not unit or sensor is None:
        return False
    if unit == units.COUNT:
        return channel[0] in "agm"
    return unit in units.UNIT_FACTORS[sensor]


def quantity_of(channel: str) -> str | None:
    """The quantity of a channel, as ``units.UNIT_FACTORS`` names it; None if it has none."""
    names = {"t": "time", "temp": "temperature", "current": "current", "throttle": "throttle"}
    if channel in names:
        return names[channel]
    if len(channel) == 2 and channel[1] in "xyz":
        return next(name for name, letter in LETTER_OF_SENSOR.items() if letter == channel[0])
    return None


def columns_of_names(names: list[str]) -> tuple[Column, ...]:
    """The columns of several names, each channel once.

    A first column without a name is the index of a table. If there is no other accelerometer,
    ``linear_acceleration.x`` is one: it is the name of specific force in ROS. (On phones it
    excludes gravity, which the magnitude of gravity shows.)
    """
    columns = [column_of_name(name) for name in names]
    if names[:1] == [""]:
        columns[0] = Column("counter", name="column 1")
    if not any(quantity_of(one.channel) == "accelerometer" for one in columns):
        again = [
            replace(column_of_name(_LINEAR.sub("", one.name)), name=one.name) for one in columns
        ]
        columns = [
            new if quantity_of(new.channel) == "accelerometer" else one
            for one, new in zip(columns, again, strict=True)
        ]
    return unique_channels(columns)


def unique_channels(columns: list[Column]) -> tuple[Column, ...]:
    """Each channel at its first position only; of several times, the most specific one."""
    times = [one for one in columns if one.channel == "t"]
    best = min(
        times, key=lambda t: ("rtc" in t.name.lower(), not unit_belongs("t", t.unit)), default=""
    )
    seen: set[str] = set()
    kept = []
    for one in columns:
        again = one.channel in seen or (one.channel == "t" and one is not best)
        kept.append(Column("", "", one.name) if again else one)
        if one.channel and not again:
            seen.add(one.channel)
    return tuple(kept)


def header_columns(fields: list[str]) -> tuple[Column, ...] | None:
    """The columns that a line of names declares.

    Returns:
        None if a field is a number, or unless two of the names are known, one of them an axis.
    """
    if any(re.fullmatch(r"\s*[-+.]?\d.*", field) for field in fields):
        return None
    columns = columns_of_names(fields)
    channels = {one.channel for one in columns if one.channel}
    axes = any(len(channel) == 2 and quantity_of(channel) for channel in channels)
    return columns if len(channels) >= 2 and axes else None


def with_unit_line(columns: tuple[Column, ...], words: list[str]) -> tuple[Column, ...] | None:
    """The columns with the units from a separate line below the names.

    Returns:
        None if most words are not units of their columns.
    """
    found = tuple(
        replace(one, unit=units.unit_for_sensor(quantity_of(one.channel) or "", word))
        if one.channel
        else one
        for one, word in zip(columns, words, strict=True)
    )
    good = [unit_belongs(one.channel, one.unit) for one in found if one.channel]
    return found if sum(good) > len(good) / 2 else None


def _with_suffix(name: str, axis: str) -> tuple[str, str]:
    """The channel and unit of a name that ends in its unit: ``acc_x_mg``, ``timestamp_ms``."""
    two = _TWO_WORDS.match(name)
    head, _, tail = (two["name"], "_", two["unit"]) if two else name.rpartition("_")
    unit = _SUFFIXES.get(squeeze_name(tail), "") if head else ""
    channel = channel_of(head + axis) if unit else ""
    return channel, unit if channel else ""
