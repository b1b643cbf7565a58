"""A model with effects on disk: it corrects what was read as the bench's own fit does."""

import json
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest

from imucal_wizard.api import load
from imucal_wizard.cli.main import main
from imucal_wizard.core.description import Description
from imucal_wizard.core.errors import DataError, RecordingError, UsageError
from imucal_wizard.core.readings import FloatArray, Series
from imucal_wizard.diagnose.bench import Bench
from imucal_wizard.diagnose.benches import Benches
from imucal_wizard.estimate.accelerometer import AccelerometerExperiment
from imucal_wizard.estimate.recording import fit_readings
from imucal_wizard.model.catalogue import load_effect
from imucal_wizard.report.calibration_file import Sensor, read_calibration
from imucal_wizard.report.calibration_record import described, from_report, sensor_record
from imucal_wizard.report.device_history import save_in_history
from imucal_wizard.report.proof import Proof, own
from imucal_wizard.tui.options import WizardOptions
from imucal_wizard.tui.services import WizardServices
from tests.diagnose.recordings import MG, fitted, tumbled


def errors(values: FloatArray, gravity: float) -> float:
    """Rms of the length of corrected vectors against gravity, m/s²."""
    return float(np.sqrt(np.mean((np.linalg.norm(values, axis=1) - gravity) ** 2)))


def written(benches: Benches, path: Path) -> Path:
    """The calibration that the wizard saves after the bench."""
    return from_report(benches.fitted(), "a test", "2026-01-01").save(path)


def means(bench: Bench) -> FloatArray:
    """The accelerometer's reading in each hold."""
    assert isinstance(bench.measured, AccelerometerExperiment)
    return np.array([hold.accelerometer for hold in bench.measured.holds])


def test_a_sensor_that_cannot_be_fitted_anew_is_named_and_the_others_are_saved(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A changed accelerometer is another reference, which these data may not suffice for."""
    whole = tumbled()
    benches = Benches(whole.report, whole.readings)
    benches.accelerometer.add("second-order")
    bench = Benches.bench

    def refused(self: Benches, sensor: str) -> Bench | None:
        if sensor == "magnetometer":
            raise DataError("its rows determine nothing")
        return bench(self, sensor)

    monkeypatch.setattr(Benches, "bench", refused)
    saved = load(written(benches, tmp_path / "c.json"))
    assert set(saved.sensors) == set(whole.report.sensors) - {"magnetometer"}
    assert saved.sensors["accelerometer"].model[-1] == "second-order"
    assert "the magnetometer is not calibrated: its rows determine nothing" in saved.warnings
    assert benches.fitted().why_not("magnetometer") in saved.warnings


def test_what_the_bench_added_is_saved_and_applied(tmp_path: Path) -> None:
    benches = Benches(*fitted("second-order:5:x"))
    bench = benches.accelerometer
    plain = load(written(benches, tmp_path / "plain.json")).sensors["accelerometer"]
    bench.add("second-order")
    saved = load(written(benches, tmp_path / "c.json")).sensors["accelerometer"]
    assert plain.effects == []
    assert saved.model[-1] == "second-order"
    (effect,) = saved.effects
    garbled, data = tmp_path / "garbled.json", json.loads((tmp_path / "c.json").read_bytes())
    data["sensors"]["accelerometer"]["effects"][0]["sensor"] = "gyroscope"
    garbled.write_text(json.dumps(data))
    with pytest.raises(RecordingError, match="effect of another sensor"):
        load(garbled)
    assert (effect.term, effect.parameters, effect.unit) == ("second-order", [*"xyz"], "mg/g²")
    assert effect.sizes[0] == pytest.approx(5.0, abs=0.3)
    assert saved.parameters["second-order_x"].standard_error is not None
    before = errors(plain.apply(means(bench)), benches.report.gravity)
    after = errors(saved.apply(means(bench)), benches.report.gravity)
    assert after == pytest.approx(bench.fit.rms_fitted, rel=1e-6)
    assert after < 0.2 * before
    assert after < 0.2 * MG


def test_what_the_bench_added_is_saved_after_the_data_are_fitted_again(tmp_path: Path) -> None:
    """As at the wizard's end, with the validation: nobody has looked at the new benches yet."""
    report, readings = fitted("second-order:5:x")
    benches = Benches(report, readings)
    benches.accelerometer.add("second-order")
    again = Benches(fit_readings(readings), readings, before=benches)
    saved = load(written(again, tmp_path / "c.json")).sensors["accelerometer"]
    assert saved.model[-1] == "second-order"


def test_the_gyroscope_is_saved_against_the_gravity_of_the_completed_accelerometer(
    tmp_path: Path,
) -> None:
    benches = Benches(*fitted("second-order:5:x"))
    plain = load(written(benches, tmp_path / "plain.json"))["gyroscope"].rms_held_out
    benches.accelerometer.add("second-order")
    saved = load(written(benches, tmp_path / "c.json"))["gyroscope"].rms_held_out
    bench = benches.bench("gyroscope")
    assert bench is not None
    assert saved == bench.fit.rms_held_out
    assert saved is not None
    assert plain is not None
    assert saved < 0.7 * plain


def test_a_step_inside_a_hold_is_proven_by_the_file(tmp_path: Path) -> None:
    """The device is held in the hand: a reading that stands for half the hold is of all of it."""
    report, readings = fitted("gyroscope/bias-step:0.3:x", poses="26", seed=5, rotations=6)
    benches = Benches(report, readings)
    bench = benches.bench("gyroscope")
    assert bench is not None
    bench.add("bias-step")
    assert bench.fit.rms_fitted < 1.5 * (bench.fit.floor_fitted or 0.0)
    saved = read_calibration(written(benches, tmp_path / "c.json"))  # refused if it contradicts
    (step,) = saved["gyroscope"].effects
    moment = (step.variant or 0.0) + readings.accelerometer.time[0]
    assert any(hold.start + 1.0 < moment < hold.end - 1.0 for hold in saved.hold_means)


def test_a_temperature_that_changes_in_rotations_and_holds_is_in_the_file(tmp_path: Path) -> None:
    """Scale and bias follow it by far more than the noise: the mean of two holds is not enough."""
    _, readings = fitted(poses="26", seed=6, rotations=4)
    gyroscope, start = readings.gyroscope, readings.accelerometer.time[0]
    assert gyroscope is not None
    since = gyroscope.time - start
    warm = (8.0 * np.sin(2.0 * np.pi * since / 150.0))[:, None]
    scale, bias = np.array([2e-3, -1e-3, 1.5e-3]), np.radians([0.05, -0.03, 0.04])
    values = gyroscope.values * (1.0 + scale * warm) + bias * warm
    warmed = replace(
        readings,
        gyroscope=replace(gyroscope, values=values),
        temperature=Series(gyroscope.time, 25.0 + warm, "degC"),
    )
    benches = Benches(fit_readings(warmed), warmed)
    bench = benches.bench("gyroscope")
    assert bench is not None
    for name in ("bias-temperature", "scale-temperature"):
        bench.add(name)
    assert bench.fit.rms_fitted < 1.5 * (bench.fit.floor_fitted or 0.0)
    saved = read_calibration(written(benches, tmp_path / "c.json"))  # refused if it contradicts
    proven = Proof(saved).errors(own(saved), frame=False)["gyroscope"]
    # an interval has the mean of its temperature, however the rate changes in it
    assert proven == pytest.approx(bench.fit.rms_fitted, rel=0.03)
    without = [msgspec.structs.replace(one, temperature=None) for one in saved.rotation_increments]
    older = msgspec.structs.replace(saved, rotation_increments=without)
    assert Proof(older).errors(own(older), frame=False)["gyroscope"] > 1.1 * proven
    changed = [one.temperature for one in saved.rotation_increments]
    assert all(one is not None and max(one) > min(one) for one in changed)


def test_a_step_of_an_older_file_counts_for_whole_holds(tmp_path: Path) -> None:
    """A hold is before or after it: a moment between the middles of two may lie in the longer."""
    report, readings = fitted("bias-step:20:x", poses="18", seed=4, rotations=6)
    benches = Benches(report, readings)
    benches.accelerometer.add("bias-step")
    path = written(benches, tmp_path / "c.json")
    known = json.loads(path.read_text())
    hold = known["hold_means"][len(known["hold_means"]) // 2]
    (step,) = known["sensors"]["accelerometer"]["effects"]
    assert step["splits"] is True
    step["variant"] += 0.3 * (hold["end"] - hold["start"])  # into a hold that was after it
    path.write_text(json.dumps(known))
    with pytest.raises(RecordingError, match="error on the measurements"):
        read_calibration(path)
    del step["splits"]
    path.write_text(json.dumps(known))
    assert not read_calibration(path).splits_holds


def test_an_effect_of_the_temperature_wants_to_be_told_the_temperature(tmp_path: Path) -> None:
    benches = Benches(*fitted("bias-temperature:1:x"))
    bench = benches.accelerometer
    bench.add("bias-temperature")
    saved = load(written(benches, tmp_path / "c.json")).sensors["accelerometer"]
    with pytest.raises(UsageError, match="bias-temperature depends on the temperature"):
        saved.apply(means(bench))
    corrected = saved.apply(means(bench), bench.measured.circumstances)
    np.testing.assert_allclose(
        corrected, bench.fit.correct(means(bench), bench.measured.circumstances), rtol=0, atol=1e-12
    )


def test_an_effect_that_is_not_known_here_is_named(tmp_path: Path) -> None:
    benches = Benches(*fitted("second-order:5:x"))
    benches.accelerometer.add("second-order")
    path = written(benches, tmp_path / "c.json")
    path.write_text(path.read_text().replace('"term": "second-order"', '"term": "my-own"'))
    with pytest.raises(UsageError, match="my-own"):
        load(path).sensors["accelerometer"].apply(np.zeros((1, 3)))


def test_an_effect_in_another_unit_is_not_applied(tmp_path: Path) -> None:
    benches = Benches(*fitted("second-order:5:x"))
    benches.accelerometer.add("second-order")
    path = written(benches, tmp_path / "c.json")
    path.write_text(path.read_text().replace('"mg/g²"', '"µg/g²"'))
    with pytest.raises(UsageError, match=r"'second-order' in 'µg/g²'.* has it in mg/g²"):
        load(path).sensors["accelerometer"].apply(np.zeros((1, 3)))


OWN_EFFECT = """
from imucal_wizard.model.effects.second_order import SecondOrder


class Mine(SecondOrder):
    name = "my-own"
"""


def test_report_and_export_take_an_effect_of_the_users_own(tmp_path: Path) -> None:
    benches = Benches(*fitted("second-order:5:x"))
    benches.accelerometer.add("second-order")
    path, own = written(benches, tmp_path / "c.json"), tmp_path / "own.py"
    path.write_text(path.read_text().replace("second-order", "my-own"))
    own.write_text(OWN_EFFECT)
    for command in ("report", "export --to json", "export --to ardupilot"):
        name, *options = command.split()
        place = tmp_path / f"{options[-1] if options else name}.out"
        call = [name, str(path), *options, "-o", str(place)]
        assert main(call) == 2
        assert main([*call, "--effects", str(own)]) == 0
        assert place.exists()
    with pytest.raises(UsageError, match="my-own"):
        WizardServices(WizardOptions()).export(path, "ardupilot")
    wizard = WizardServices(WizardOptions(effects=(load_effect(own),)))
    assert wizard.export(path, "ardupilot").path.exists()


def test_the_error_as_found_takes_an_effect_of_the_users_own(tmp_path: Path) -> None:
    """Of the calibration before, which has the effect."""
    benches = Benches(*fitted("second-order:5:x"))
    benches.accelerometer.add("second-order")
    path, own = written(benches, tmp_path / "c.json"), tmp_path / "own.py"
    path.write_text(path.read_text().replace("second-order", "my-own"))
    own.write_text(OWN_EFFECT)
    made = [
        described(
            read_calibration(path),
            Description("arm"),
            measured=f"2031-03-{day:02d}",
            session=f"{day}",
        )
        for day in (1, 20)
    ]
    effects, folder = [load_effect(own)], tmp_path / "s"
    for number, one in enumerate(made):
        save_in_history(one, tmp_path / f"{number}.json", folder, effects=effects)
    sensor = read_calibration(tmp_path / "1.json")["accelerometer"]
    assert sensor.as_found is not None
    assert sensor.as_found.error == pytest.approx(sensor.rms_fitted, rel=0.01)


def test_a_magnetometers_effects_are_saved_in_the_accelerometers_frame(tmp_path: Path) -> None:
    """The misalignment is in the matrix, and the sizes are those of that frame."""
    made = tumbled("magnetometer/current:0.3:x")
    benches = Benches(made.report, made.readings)
    bench = benches.bench("magnetometer")
    assert bench is not None
    bench.add("current")
    saved = load(written(benches, tmp_path / "c.json")).sensors["magnetometer"]
    assert saved.frame == "accelerometer"
    assert [effect.term for effect in saved.effects] == ["current"]
    assert saved.effects[0].sizes == bench.fit.sizes[0].tolist()
    where = bench.measured.circumstances
    readings = np.random.default_rng(1).normal(0.0, 40.0, (len(where), 3))
    own = bench.fit.correct(readings, where)
    np.testing.assert_allclose(saved.apply(readings, where), own, rtol=0, atol=1e-9)


def scatter_of_dip(saved: Sensor, benches: Benches) -> float:
    """Of the field's angle to the vertical over the holds, °, by means of the readings alone."""
    report, readings = benches.report, benches.readings
    assert readings is not None
    assert readings.magnetometer is not None
    series, plain = readings.magnetometer, report.sensors["accelerometer"]
    force = np.array([plain.matrix @ (hold.accelerometer - plain.bias) for hold in report.holds])
    means = [series.between(hold.start, hold.end).values.mean(axis=0) for hold in report.holds]
    field = (np.array(means) - saved.bias) @ np.array(saved.matrix).T
    cosine = (force * field).sum(axis=1)
    cosine /= np.linalg.norm(force, axis=1) * np.linalg.norm(field, axis=1)
    return float(np.degrees(np.arccos(cosine)).std())


def test_the_alignment_of_the_second_stage_is_applied_once_with_the_bench_and_without(
    tmp_path: Path,
) -> None:
    made = tumbled()
    benches = Benches(made.report, made.readings)
    bench = benches.bench("magnetometer")
    assert bench is not None
    looked = load(written(benches, tmp_path / "looked.json")).sensors["magnetometer"]
    assert np.array_equal(looked.matrix, benches.report.sensors["magnetometer"].matrix)
    bench.add("bias-drift")
    added = load(written(benches, tmp_path / "added.json")).sensors["magnetometer"]
    for saved in (looked, added):
        assert saved.frame == "accelerometer"
        assert scatter_of_dip(saved, benches) < 0.1
    assert benches.report.magnetic is not None
    (term,) = benches.fitted().sensors["magnetometer"].terms
    assert term.name == "bias-drift"
    own = sensor_record(benches.report.magnetic.fit)
    assert scatter_of_dip(own, benches) > 0.5
