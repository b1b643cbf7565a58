"""An exercise hides one effect of realistic size and keeps it to itself until the key is given."""

import hashlib
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cryptography.hazmat.primitives.ciphers.aead import AESGCM
from hypothesis import given
from hypothesis import strategies as st

from imucal_wizard.cli import main as cli
from imucal_wizard.core.errors import DataError, UsageError
from imucal_wizard.model.catalogue import effect
from imucal_wizard.simulate.hidden import Hidden, parse_hidden
from imucal_wizard.teach.draw import GRADE_NOISE, draw_effect, hidden_choices
from imucal_wizard.teach.exercise import cover_answer, make_exercise, reveal, truth_in_words
from imucal_wizard.teach.guess import Outcome, judge_guess, parse_guess
from imucal_wizard.teach.seal import PADDED_BYTES, lock_text, seal_text, unseal_text
from tests.characters import CHARACTERS

GRADES = tuple(GRADE_NOISE)


@pytest.fixture(scope="module")
def exercise(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A sealed answer whose key is ``gimbal``, beside a short recording."""
    path = tmp_path_factory.mktemp("class") / "out.csv"
    make_exercise(path, key="gimbal", seed=3, poses="6")
    return path.with_suffix(".mystery")


@pytest.mark.parametrize("grade", GRADES)
def test_sizes_are_those_of_the_grade_and_units_those_of_the_simulator(grade: str) -> None:
    """Every draw can be simulated, in the unit of the catalogue, inside the grade's range."""
    rng = np.random.default_rng(1)
    for _ in range(200):
        hidden = draw_effect(rng, grade, ("accelerometer", "gyroscope", "magnetometer"))
        letters = "".join("xyz"[axis] for axis in hidden.axes)
        parameters = {one.name: one for one in effect(hidden.term).parameters(hidden.sensor)}
        low, high = parameters[letters].grades[grade]
        assert low <= abs(hidden.size) * 1.005
        assert abs(hidden.size) <= high * 1.005
        assert hidden.unit == parameters[letters].unit
        assert parse_hidden(f"{hidden.sensor}/{hidden.term}:1:{letters}").axes == hidden.axes


def test_every_effect_that_such_a_recording_shows_is_drawn_sooner_or_later() -> None:
    rng = np.random.default_rng(2)
    drawn = {
        (hidden.sensor, hidden.term)
        for hidden in (draw_effect(rng, "consumer") for _ in range(600))
    }
    wanted = {(own[0].sensor, own[0].effect.name) for own in hidden_choices("consumer")}
    assert drawn == wanted
    assert len(wanted) >= 20


def test_an_unknown_grade_is_refused() -> None:
    with pytest.raises(UsageError, match="consumer, industrial"):
        hidden_choices("military")


@given(
    st.text(CHARACTERS, max_size=60),
    st.text(CHARACTERS, min_size=1, max_size=20),
    st.binary(min_size=16, max_size=16),
)
def test_what_is_sealed_opens_with_its_key_and_with_no_other(
    text: str, key: str, salt: bytes
) -> None:
    """Surrogates aside, which are no text."""
    text, key = (s.encode("utf-8", "ignore").decode().rstrip() for s in (text, key))
    sealed = seal_text(text, key, salt, rounds=10)
    assert unseal_text(sealed, key, rounds=10) == text
    assert len(sealed.text) == PADDED_BYTES
    with pytest.raises(DataError, match="key"):
        unseal_text(sealed, f"{key}?", rounds=10)


def test_an_answer_opens_only_unchanged_and_only_with_its_key(
    exercise: Path, tmp_path: Path
) -> None:
    """Every field is authenticated; the texts of two answers share nothing but their length."""
    document = json.loads(exercise.read_text())
    path = tmp_path / "changed.mystery"
    for name in ("recording", "grade", "salt", "nonce", "sealed"):
        value = document[name]
        changed = {**document, name: ("1" if value[0] == "0" else "0") + value[1:]}
        path.write_text(json.dumps(changed))
        with pytest.raises(DataError, match="does not open it"):
            reveal(path, "gimbal")
    for key in ("Gimbal", "gimba", "", "gimbal?"):
        with pytest.raises(DataError, match="does not open it"):
            reveal(exercise, key)
    texts = {lock_text(text, "k", "about", cost=16).text for text in ("", "a", "a" * 200)}
    assert len({len(text) for text in texts}) == 1
    assert len(texts) == 3


def test_an_answer_is_scrypt_and_aes_gcm_as_the_standard_library_derives_the_key(
    exercise: Path,
) -> None:
    found = json.loads(exercise.read_text())
    salt, nonce, sealed = (bytes.fromhex(found[name]) for name in ("salt", "nonce", "sealed"))
    key = hashlib.scrypt(b"gimbal", salt=salt, n=2**15, r=8, p=1, dklen=32, maxmem=2**26)
    about = json.dumps(["imucal-wizard/mystery/2", found["recording"], found["grade"]])
    plain = json.loads(AESGCM(key).decrypt(nonce, sealed, about.encode()))
    assert plain["term"] == reveal(exercise, "gimbal").term


def test_answers_of_earlier_versions_and_of_live_exercises_open(tmp_path: Path) -> None:
    truth = parse_hidden("gyroscope/g-sensitivity:0.05:xy")
    path = tmp_path / "old.mystery"
    cover_answer(path, "a.csv", "consumer", truth, "newton")
    assert json.loads(path.read_text())["schema"] == "imucal-wizard/mystery/1"
    assert "not secret" in json.loads(path.read_text())["note"]
    assert reveal(path, "newton") == truth


def test_the_files_say_nothing_of_the_answer(exercise: Path) -> None:
    """Neither name, nor size, nor axis: of any effect, in either file."""
    truth = reveal(exercise, "gimbal")
    recording = exercise.with_suffix(".csv").read_text()
    sealed = exercise.read_text()
    comments = "".join(line for line in recording.splitlines() if line.startswith("#"))
    for own in hidden_choices("consumer"):
        assert own[0].effect.name not in sealed + comments
    assert f"{truth.size:g}" not in comments
    assert set(json.loads(sealed)) == {
        *("schema", "note", "recording", "grade", "salt", "nonce", "sealed")
    }


def test_the_same_seed_is_the_same_exercise_and_another_salt(tmp_path: Path) -> None:
    made = [make_exercise(tmp_path / f"{k}.csv", key="k", seed=5, poses="6") for k in range(2)]
    assert reveal(made[0].answer, "k") == reveal(made[1].answer, "k")
    first, second = (json.loads(one.answer.read_text()) for one in made)
    assert first["salt"] != second["salt"]
    assert first["sealed"] != second["sealed"]
    assert made[0].recording.read_bytes() == made[1].recording.read_bytes()


def test_without_a_key_one_is_made_and_opens_it(tmp_path: Path) -> None:
    made = make_exercise(tmp_path / "out.csv", seed=1, poses="6")
    assert isinstance(reveal(made.answer, made.key), Hidden)


@pytest.mark.parametrize(
    ("guess", "outcome"),
    [
        ("second-order:x", Outcome.RIGHT),
        ("accelerometer/second-order:x", Outcome.RIGHT),
        ("second-order:y", Outcome.FAMILY),
        ("asymmetry:x", Outcome.FAMILY),
        ("cross-product:x", Outcome.FAMILY),
        ("third-order:x", Outcome.WRONG),
        ("gyroscope/second-order:x", Outcome.WRONG),
    ],
)
def test_a_guess_is_right_of_the_right_family_or_wrong(guess: str, outcome: Outcome) -> None:
    truth = parse_hidden("second-order:3:x")
    assert judge_guess(parse_guess(guess), truth)[0] is outcome


def test_the_first_letter_is_enough_of_an_axis_with_several() -> None:
    truth = parse_hidden("gyroscope/g-sensitivity:0.05:xy")
    assert judge_guess(parse_guess("gyroscope/g-sensitivity:x"), truth)[0] is Outcome.RIGHT
    assert judge_guess(parse_guess("gyroscope/g-sensitivity:xy"), truth)[0] is Outcome.RIGHT
    assert judge_guess(parse_guess("gyroscope/g-sensitivity:xz"), truth)[0] is Outcome.FAMILY


def test_the_key_opens_the_answer_and_tells_a_guess_its_worth(
    exercise: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    truth = reveal(exercise, "gimbal")
    letters = "".join("xyz"[axis] for axis in truth.axes)
    guess = f"{truth.sensor}/{truth.term}:{letters}"
    arguments = ["simulate", "--reveal", str(exercise), "--key", "gimbal", "--guess", guess]
    assert cli.main(arguments) == 0
    said = capsys.readouterr().out
    assert "right" in said
    assert truth_in_words(truth) in said


def test_an_exercise_and_its_answer_are_told_to_scripts(
    exercise: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """One JSON document and nothing else; an exercise names no effect, its answer does."""

    def document_of(*argv: str) -> dict[str, Any]:
        assert cli.main(["simulate", *argv, "--json", "-"]) == 0
        document: dict[str, Any] = json.loads(capsys.readouterr().out)
        assert document.pop("schema") == "imucal-wizard/simulate/1"
        return document

    plain, secret = tmp_path / "plain.csv", tmp_path / "secret.csv"
    size = {"term": "second-order", "axes": "x", "size": 3.0, "unit": "mg/g²"}
    assert document_of(str(plain), "--hidden", "second-order:3:x", "--poses", "6") == {
        "recording": str(plain),
        "seed": 0,
        "hidden": [{"sensor": "accelerometer", **size}],
    }
    made = document_of(str(secret), "--mystery", "--key", "gimbal", "--poses", "6")
    assert made == {
        "recording": str(secret),
        "answer": str(secret.with_suffix(".mystery")),
        "key": "gimbal",
    }
    truth = reveal(exercise, "gimbal")
    name = f"{truth.sensor}/{truth.term}:{truth.letters}"
    opened = document_of("--reveal", str(exercise), "--key", "gimbal", "--guess", name)
    assert opened["truth"]["size"] == truth.size
    assert opened["guess"]["outcome"] == "right"


def test_a_wrong_key_is_exit_status_one_and_tells_nothing(
    exercise: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["simulate", "--reveal", str(exercise), "--key", "gimball"]) == 1
    captured = capsys.readouterr()
    assert captured.out == ""
    assert "key" in captured.err
    assert captured.err.count("\n") == 1


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ([], "OUT.csv"),
        (["a.csv", "--mystery", "--hidden", "second-order:3:x"], "give one"),
        (["a.mystery", "--mystery"], ".csv"),
        (["a.csv", "--mystery", "--key", " "], "empty"),
        (["a.csv", "--mystery", "--grade", "military"], "military"),
        (["a.csv", "--key", "word"], "--mystery"),
        (["a.csv", "--guess", "second-order:x"], "--reveal"),
        (["--reveal", "a.mystery"], "--key"),
        (["--reveal", "none.mystery", "--key", "k"], "none.mystery"),
        (["--reveal", "a.mystery", "--key", "k", "--guess", "magic:x"], "magic"),
        (["--reveal", "a.mystery", "--key", "k", "--guess", "second-order"], "TERM:AXIS"),
        (["--reveal", "a.mystery", "--key", "k", "--guess", "second-order:q"], "axis"),
        (["/no/such/folder/a.csv", "--mystery"], "/no/such/folder"),
    ],
)
def test_wrong_usage_is_one_clear_line_and_exit_status_two(
    arguments: list[str], says: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["simulate", *arguments]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1
    assert says in captured.err


@pytest.mark.parametrize("text", ["", "{}", "[1]", '{"schema": 3}', "null", "\x00"])
def test_a_file_that_is_not_a_sealed_answer_is_refused(
    text: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "x.mystery"
    path.write_text(text)
    assert cli.main(["simulate", "--reveal", str(path), "--key", "k"]) == 2
    assert "not a sealed answer" in capsys.readouterr().err


def test_an_exercise_with_a_magnetometer_betrays_nothing_by_its_columns(tmp_path: Path) -> None:
    """The current has a column whatever is hidden; without a magnetometer none is drawn for it."""
    headers = set()
    for seed in (1, 2):
        path = tmp_path / f"{seed}.csv"
        make_exercise(path, key="gimbal", seed=seed, poses="6", magnetometer=True)
        headers.add(path.read_text().splitlines()[1])
    (header,) = headers
    assert "mx[uT]" in header
    assert "current[A]" in header
    drawn = {draw_effect(np.random.default_rng(seed), "consumer").sensor for seed in range(100)}
    assert drawn == {"accelerometer", "gyroscope"}
    guess = parse_guess("magnetometer/current:x")
    assert judge_guess(guess, Hidden("magnetometer", "current", 0.3, (0,)))[0] is Outcome.RIGHT
