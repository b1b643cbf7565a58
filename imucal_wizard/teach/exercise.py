"""The two files of an exercise: the recording and the sealed answer."""

import json
import secrets
from pathlib import Path
from typing import Any

from imucal_wizard.core.errors import RecordingError, UsageError
from imucal_wizard.core.output import write_atomically
from imucal_wizard.core.quantities import with_unit
from imucal_wizard.core.records import dataclass
from imucal_wizard.simulate.hidden import HIDDEN_TERMS, Hidden
from imucal_wizard.simulate.recording import simulate_recording
from imucal_wizard.teach.draw import draw_effect, exercise_sensors, random_generator, virtual_sensor
from imucal_wizard.teach.seal import Sealed, seal_text, unseal_text

MYSTERY_SCHEMA = "imucal-wizard/mystery/1"
NOTE = "sealed against a glance, not against an attacker; imucal-wizard simulate opens it"


@dataclass(frozen=True)
class Exercise:
    """The files of an exercise.

    Attributes:
        recording: for the student.
        answer: sealed answer.
        key: the key that opens the answer.
    """

    recording: Path
    answer: Path
    key: str


def make_exercise(
    recording: Path,
    *,
    grade: str = "consumer",
    key: str | None = None,
    seed: int | None = None,
    rate: float = 100.0,
    poses: str = "26+repeats",
    magnetometer: bool = False,
) -> Exercise:
    """Write a recording with one randomly hidden effect, and the sealed answer beside it.

    Args:
        recording: CSV file to write; the answer gets the same name with ``.mystery``.
        grade: grade of the sensor.
        key: the key that opens the answer; random if left out.
        seed: the same seed gives the same exercise; random when left out.
        rate: samples per second.
        poses: as ``simulate_recording``.
        magnetometer: whether the device has a magnetometer and an ammeter; the effect may then be
            in the magnetometer.

    Raises:
        UsageError: an unknown grade or set of poses, an empty key, or a recording named
            ``.mystery``.
        RecordingError: a file cannot be written.
    """
    answer = recording.with_suffix(".mystery")
    if answer == recording:
        raise UsageError(f"{recording} is the name of the answer; name the recording .csv")
    if key is not None and not key.strip():
        raise UsageError("the key is empty; give a word", settings=("key",))
    word = random_key() if key is None else key
    rng = random_generator(seed)
    truth = draw_effect(rng, grade, exercise_sensors(magnetometer=magnetometer))
    hand = int(rng.integers(2**62))
    simulate_recording(
        recording,
        hidden=[truth],
        seed=hand,
        rate=rate,
        poses=poses,
        model=virtual_sensor(hand, grade),
        magnetometer=magnetometer,
        ammeter=magnetometer,
    )
    write_answer(answer, recording.name, grade, truth, word)
    return Exercise(recording, answer, word)


def random_key() -> str:
    """A random key."""
    return f"{secrets.token_hex(2)}-{secrets.token_hex(2)}"


def write_answer(path: Path, recording: str, grade: str, truth: Hidden, key: str) -> None:
    """Seal an answer.

    Raises:
        RecordingError: the file cannot be written.
    """
    document = _document(recording, grade, seal_text(_canonical(truth), key, _salt()))
    write_atomically(path, json.dumps(document, indent=1).encode() + b"\n")


def reveal(answer: Path, key: str) -> Hidden:
    """The hidden effect.

    Raises:
        RecordingError: the file is missing or is not a sealed answer.
        DataError: the key does not open it.
    """
    try:
        found = json.loads(answer.read_bytes())
        sealed = Sealed(*(bytes.fromhex(found[name]) for name in ("salt", "digest", "sealed")))
        known = found["schema"] == MYSTERY_SCHEMA
    except OSError as error:
        raise RecordingError(f"{answer} cannot be read: {error.strerror or error}") from error
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise RecordingError(f"{answer} is not a sealed answer of an exercise") from error
    if not known:
        raise RecordingError(f"{answer} is of another version: {found['schema']!r}")
    return _hidden(json.loads(unseal_text(sealed, key)))


def truth_in_words(truth: Hidden) -> str:
    """``gyroscope/g-sensitivity on xy, 0.0512 °/s/g``."""
    prefix = "" if truth.sensor == "accelerometer" else f"{truth.sensor}/"
    unit = HIDDEN_TERMS[truth.sensor][truth.term].unit
    return f"{prefix}{truth.term} on {truth.letters}, {with_unit(f'{truth.size:g}', unit)}"


def _salt() -> bytes:
    return secrets.token_bytes(16)


def _canonical(truth: Hidden) -> str:
    """The answer in a canonical text form, from which the digest is computed."""
    found = {
        "axes": list(truth.axes),
        "sensor": truth.sensor,
        "size": truth.size,
        "term": truth.term,
        "unit": truth.unit,
    }
    return json.dumps(found, sort_keys=True, separators=(",", ":"))


def _hidden(found: dict[str, Any]) -> Hidden:
    return Hidden(found["sensor"], found["term"], float(found["size"]), tuple(found["axes"]))


def _document(recording: str, grade: str, sealed: Sealed) -> dict[str, str]:
    return {
        "schema": MYSTERY_SCHEMA,
        "note": NOTE,
        "recording": recording,
        "grade": grade,
        "salt": sealed.salt.hex(),
        "digest": sealed.digest.hex(),
        "sealed": sealed.text.hex(),
    }
