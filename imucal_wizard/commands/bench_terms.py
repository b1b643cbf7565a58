"""Terms as they are written on the command line of ``bench``, by sensor."""

from collections.abc import Sequence

from imucal_wizard.errors import UsageError

SENSORS = ("accelerometer", "gyroscope", "magnetometer")
BASES = {
    "accelerometer": ("bias", "scale", "non-orthogonality"),
    "gyroscope": ("bias", "scale", "non-orthogonality"),
    "magnetometer": ("bias", "soft-iron"),
}


def base_terms(text: str) -> dict[str, tuple[str, ...]]:
    """The terms of ``--base`` by sensor; ``none`` is none of them.

    A word with a sensor in front is that sensor's alone; a sensor without any has the others. Scale
    and non-orthogonality of a magnetometer are its soft iron.

    Raises:
        UsageError: a word that is no term of a base.
    """
    words = [word.strip() for word in text.split(",") if word.strip()]
    _check_base(words)
    plain = [word for word in words if "/" not in word]
    found = {}
    for sensor, whole in BASES.items():
        own = [word.partition("/")[2] for word in words if word.startswith(f"{sensor}/")]
        asked = set(own or plain)
        if sensor == "magnetometer" and "non-orthogonality" in asked:
            asked.add("soft-iron")
        found[sensor] = tuple(term for term in whole if term in asked) if asked else whole
    return found


def _check_base(words: Sequence[str]) -> None:
    inertial = {"none", *BASES["accelerometer"]}
    known = {*inertial, "soft-iron"}
    for word in words:
        sensor, slash, term = word.rpartition("/")
        own_terms = known if sensor in ("", "magnetometer") else inertial
        if term not in own_terms or (slash and sensor not in BASES):
            raise UsageError(
                f"--base: {word!r} is not in the base; it has {', '.join(sorted(own_terms))}"
            )


def wanted_terms(texts: Sequence[str]) -> dict[str, list[str]]:
    """The terms of ``--add`` by sensor.

    Raises:
        UsageError: not ``TERM`` or ``SENSOR/TERM``, or a term of another sensor.
    """
    from imucal_wizard.effects.catalogue import builtin_effects

    wanted: dict[str, list[str]] = {name: [] for name in SENSORS}
    only = {one.name: one.sensors[0] for one in builtin_effects() if len(one.sensors) == 1}
    only["soft-iron"] = "magnetometer"
    for text in texts:
        sensor, _, term = text.rpartition("/")
        if sensor not in ("", *SENSORS):
            raise UsageError(f"--add {text!r}: {sensor!r} is no sensor here; write gyroscope/TERM")
        if not sensor and only.get(term, SENSORS[0]) != SENSORS[0]:
            raise UsageError(f"{term} is an effect of the {only[term]}; write {only[term]}/{term}")
        wanted[sensor or SENSORS[0]].append(term)
    return wanted
