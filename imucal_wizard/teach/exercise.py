"""The two files of an exercise: the recording and the sealed answer."""

import json
import secrets
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import msgspec

from imucal_wizard.core.errors import RecordingError, UsageError
from imucal_wizard.core.input import read_schema
from imucal_wizard.core.output import write_atomically
from imucal_wizard.core.quantities import with_unit
from imucal_wizard.core.records import dataclass
from imucal_wizard.simulate.hidden import HIDDEN_TERMS, Hidden
from imucal_wizard.simulate.recording import simulate_recording
from imucal_wizard.teach.draw import draw_effect, exercise_sensors, random_generator, virtual_sensor
from imucal_wizard.teach.seal import (
    Locked,
    Sealed,
    lock_text,
    seal_text,
    unlock_text,
    unseal_text,
)

ANSWER_SUFFIX = ".mystery"
"""Of the answer, beside the recording or session of the same name."""
LOCKED_SCHEMA = "imucal-wizard/mystery/2"
LOCKED_NOTE = "encrypted with the class's key; imucal-wizard simulate opens it"
COVERED_SCHEMA = "imucal-wizard/mystery/1"
COVERED_NOTE = (
    "not secret: the computer of a live exercise knows its answer; imucal-wizard simulate opens it"
)


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
        UsageError: an unknown grade or set of poses, an empty key, a recording named ``.mystery``,
            or a file that cannot be written.
    """
    answer = recording.with_suffix(ANSWER_SUFFIX)
    if answer == recording:
        raise UsageError(f"{recording} is the name of the answer; name the recording .csv")
    if key is not None and not key.strip():
        raise UsageError("the key is empty; give a word", settings=("key",))
    word = random_key() if key is None else key
    rng = random_generator(seed)
    truth = draw_effect(rng, grade, exercise_sensors(magnetometer=magnetometer))
    sealed = _locked(recording.name, grade, truth, word)
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
    write_atomically(answer, sealed)
    return Exercise(recording, answer, word)


def random_key() -> str:
    """A random key."""
    return f"{secrets.token_hex(2)}-{secrets.token_hex(2)}"


def _locked(recording: str, grade: str, truth: Hidden, key: str) -> bytes:
    """The file of an encrypted answer."""
    about = {"schema": LOCKED_SCHEMA, "note": LOCKED_NOTE, "recording": recording, "grade": grade}
    locked = lock_text(_canonical(truth), key, _bound(about))
    return _file(about, {"salt": locked.salt, "nonce": locked.nonce, "sealed": locked.text})


def cover_answer(path: Path, recording: str, grade: str, truth: Hidden, key: str) -> None:
    """Cover the answer to a live exercise, which is not secret.

    Raises:
        UsageError: the file cannot be written.
    """
    about = {"schema": COVERED_SCHEMA, "note": COVERED_NOTE, "recording": recording, "grade": grade}
    covered = seal_text(_canonical(truth), key, secrets.token_bytes(16))
    parts = {"salt": covered.salt, "digest": covered.digest, "sealed": covered.text}
    write_atomically(path, _file(about, parts))


def _file(about: dict[str, str], parts: dict[str, bytes]) -> bytes:
    document = {**about, **{name: part.hex() for name, part in parts.items()}}
    return json.dumps(document, indent=1).encode() + b"\n"


def _bound(about: Mapping[str, object]) -> str:
    """What stands in clear in an answer and cannot be changed."""
    return json.dumps([about[name] for name in ("schema", "recording", "grade")])


def reveal(answer: Path, key: str) -> Hidden:
    """The hidden effect.

    Raises:
        RecordingError: the file is missing or is not a sealed answer.
        DataError: the key does not open it.
    """
    what = "a sealed answer of an exercise"
    data = read_schema(answer, (LOCKED_SCHEMA, COVERED_SCHEMA), what)
    try:
        found = msgspec.json.decode(data)
        second = "nonce" if found["schema"] == LOCKED_SCHEMA else "digest"
        parts = [bytes.fromhex(found[name]) for name in ("salt", second, "sealed")]
        bound = _bound(found) if second == "nonce" else ""
        if bound:
            text = unlock_text(Locked(*parts), key, bound)
        else:
            text = unseal_text(Sealed(*parts), key)
        return _hidden(json.loads(text))
    except (ValueError, KeyError, TypeError) as error:
        raise RecordingError(f"{answer} is not {what}: it is damaged") from error


def truth_in_words(truth: Hidden) -> str:
    """``gyroscope/g-sensitivity on xy, 0.0512 °/s/g``."""
    prefix = "" if truth.sensor == "accelerometer" else f"{truth.sensor}/"
    unit = HIDDEN_TERMS[truth.sensor][truth.term].unit
    return f"{prefix}{truth.term} on {truth.letters}, {with_unit(f'{truth.size:g}', unit)}"


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
