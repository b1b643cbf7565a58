"""Warnings with a kind."""

import json
import pickle

import pytest

from imucal_wizard.core.notices import (
    Notice,
    NoticeKind,
    begun,
    not_calibrated,
    not_in_verdicts,
    of_kind,
    reworded,
    same_matter,
)
from imucal_wizard.core.output import encode_json

DEAD = Notice("the gyroscope's x axis never changes", NoticeKind.DEAD, "gyroscope")


def test_a_warning_is_found_by_kind_and_sensor_and_not_by_its_words() -> None:
    plain = "the gyroscope's x axis never changes, either"
    other = Notice("as the gyroscope", NoticeKind.DEAD, "accelerometer")
    refused = not_calibrated("gyroscope", "too few rotations")
    found = [plain, DEAD, other, refused]
    assert of_kind(found, NoticeKind.DEAD, sensor="gyroscope") == [DEAD]
    assert of_kind(found, NoticeKind.DEAD) == [DEAD, other]
    assert of_kind(found, NoticeKind.NOT_CALIBRATED) == [refused]
    assert refused == "the gyroscope is not calibrated: too few rotations"


def test_words_before_a_warning_leave_its_kind() -> None:
    (found,) = of_kind([begun("a.csv: ", DEAD)], NoticeKind.DEAD, sensor="gyroscope")
    assert found == f"a.csv: {DEAD}"
    assert type(begun("a.csv: ", "no kind")) is str


def test_two_statements_are_of_one_matter_by_kind_and_sensor() -> None:
    assert same_matter(DEAD, reworded("it shows nothing", DEAD))
    assert not same_matter(DEAD, Notice(DEAD, NoticeKind.DEAD, "accelerometer"))
    assert not same_matter(str(DEAD), str(DEAD))
    assert type(reworded("no kind", "either")) is str


def test_what_a_verdict_beside_it_says_is_not_warned_of() -> None:
    refused = not_calibrated("gyroscope", "no rotations")
    spoken = f"{refused} {DEAD[0].upper()}{DEAD[1:]}."
    warnings = [refused, DEAD, "one sample is missing"]
    assert not_in_verdicts(warnings, {"gyroscope": spoken}) == ["one sample is missing"]
    assert not_in_verdicts(warnings, {"gyroscope": "complete"}) == [DEAD, "one sample is missing"]
    assert not_in_verdicts(warnings, {"accelerometer": spoken}) == warnings


def test_a_checkpoint_keeps_the_kind() -> None:
    kept = pickle.loads(pickle.dumps(DEAD))  # noqa: S301 (of this test)
    assert (kept, kept.kind, kept.sensor) == (DEAD, NoticeKind.DEAD, "gyroscope")


def test_a_document_holds_the_text() -> None:
    assert json.loads(encode_json({"warnings": [DEAD]})) == {"warnings": [str(DEAD)]}
    with pytest.raises(TypeError, match="complex"):
        encode_json([1j])
