"""The words of which the names of columns are made, and which channel they mean together."""

import re

SENSORS: dict[str, str] = {
    word: channel
    for channel, words in {
        "a": "a acc accl accel accelerometer acceleration acceler accelero xl",
        "g": "g gyr gyro gyroscope gyros w omega rate angularrate angularvelocity rotation",
        "m": "m mag magn magnet magneto magnetometer magnetic magneticfield field compass",
    }.items()
    for word in words.split()
}
SINGLE: dict[str, str] = {
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
"""``AccelX:0.12`` is a reading with its label and no name."""
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
"""What may stand in a name beside sensor and axis and changes nothing of what is measured."""

# the device has already taken gravity out of these, or left only gravity in
_NOT_A_READING = re.compile(
    r"linear|(?<!including)gravity|quat|euler|orient|angle|yaw|pitch|roll|heading"
    r"|^(?:ypr|rpy|areal|aworld)$"
)


def no_reading(word: str) -> bool:
    """Whether a name, squeezed, says that this is made of readings and is none itself."""
    return bool(_NOT_A_READING.search(word))


def channel_of(name: str) -> str:
    """``ax`` for "AccelX", "acc_x", "imu/acceleration.x", "acc.0"; ``""`` for what it is not."""
    word = squeezed(name)
    if no_reading(word):
        return ""
    if word in SINGLE:
        return SINGLE[word]
    match = _SENSOR_AXIS.fullmatch(word)
    if match is not None and match["sensor"] in SENSORS:
        return SENSORS[match["sensor"]] + _AXES[match["axis"]]
    if _LABELLED.search(name):
        return ""
    words = [found.lower() for found in _WORD.findall(name)]
    return _time_of(words) or _axis_of(words)


def sensor_word(word: str) -> str:
    """``a``, ``g`` or ``m`` for a word that names a sensor, ``temp`` for one that names heat."""
    word = word.lower()
    if no_reading(word):
        return ""
    single = SINGLE.get(word, "")
    return single if single == "temp" else SENSORS.get(word, "")


def squeezed(name: str) -> str:
    """Nothing but the small letters and digits of a name."""
    return re.sub(r"[^a-z0-9]", "", name.lower())


def _time_of(words: list[str]) -> str:
    """``t`` for the words of "Time since start in ms", "field.header.stamp"."""
    if not _OF_TIME & set(words):
        return ""
    return "t" if set(words) <= _OF_TIME | _BESIDE_TIME else ""


def _axis_of(words: list[str]) -> str:
    """The channel of several words, one of which is the axis and at least one the sensor."""
    words = _parted(words)
    letters = [word for word in words if word in ("x", "y", "z")]
    if len(letters) > 1 or not words:
        return ""
    axis = letters[0] if letters else _AXES.get(words[-1], "")
    rest = [w for w in _joined(words) if w not in _BESIDE_SENSORS and not w.isdigit()]
    rest = [w for w in rest if w not in ("x", "y", "z")]
    if rest[1:] == ["rs", "s"]:  # EuRoC's w_RS_S_x: from the reference frame to the sensor's
        rest = rest[:1]
    sensors = {SENSORS.get(w, "") for w in rest}
    return sensors.pop() + axis if len(sensors) == 1 and axis and "" not in sensors else ""


def _parted(words: list[str]) -> list[str]:
    """The words, with ``accx`` as two and ``imu0`` as one that says nothing."""
    parts: list[str] = []
    for word in words:
        match = _SENSOR_AXIS.fullmatch(word)
        known = match is not None and match["sensor"] in SENSORS
        parts += [match["sensor"], match["axis"]] if match is not None and known else [word]
    return parts


def _joined(words: list[str]) -> list[str]:
    """The words, with each phrase that names a sensor as that sensor's letter."""
    for phrase, letter in _PHRASES.items():
        for place in range(len(words) - len(phrase) + 1):
            if tuple(words[place : place + len(phrase)]) == phrase:
                return [*words[:place], letter, *_joined(words[place + len(phrase) :])]
    return words
