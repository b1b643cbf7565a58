"""The C header: compiled and run, and every effect in it against the program's own correction."""

import re
import shutil
import subprocess
from pathlib import Path

import msgspec
import numpy as np
import pytest

from imucal_wizard.core.errors import UsageError
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.model.catalogue import effect, effects_for
from imucal_wizard.model.effect import INPUT_OF, SENSORS, Circumstances, Effect
from imucal_wizard.report.calibration_file import SavedEffect, Sensor
from imucal_wizard.report.exports import ExportSettings, c_header, write_export
from imucal_wizard.report.proof import Samples
from tests.report.devices import calibration

COMPILER = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
EFFECTS = [
    pytest.param(sensor, one, id=f"{sensor}-{one.name}")
    for sensor in SENSORS
    for one in effects_for(sensor)
]


def some(sensor: str) -> Samples:
    """Circumstances of no particular kind, and readings of the size that the sensor has."""
    random = np.random.default_rng(3)
    size = {"accelerometer": 9.0, "gyroscope": 2.0, "magnetometer": 40.0}[sensor]

    def vectors(length: float) -> FloatArray:
        return np.asarray(length * random.standard_normal((20, 3)))

    reading = vectors(size)
    where = Circumstances(
        force=vectors(9.0),
        rate=np.zeros((20, 3)),
        temperature=random.uniform(10.0, 40.0, 20),
        time=random.uniform(0.0, 300.0, 20),
        previous=vectors(9.0),
        vibration=random.uniform(0.0, 1.0, 20),
        magnetic=vectors(40.0),
        current=random.uniform(0.0, 5.0, 20),
        reference_temperature=25.0,
        reference_time=150.0,
    )
    return Samples(reading, where.sensing(sensor, reading), reading)


def with_effects(sensor: str, effects: list[Effect]) -> Sensor:
    """A sensor's calibration with effects of usual size."""
    random = np.random.default_rng(4)
    saved = []
    for one in effects:
        parameters = one.parameters(sensor)
        typical = np.minimum(one.typical(sensor), 10.0)
        saved.append(
            SavedEffect(
                term=one.name,
                sensor=sensor,
                equation=one.equation,
                parameters=[p.name for p in parameters],
                sizes=(typical * random.standard_normal(len(parameters))).tolist(),
                unit=parameters[0].unit,
                variant=120.0 if one.name in ("warm-up", "bias-step") else None,
                reference_temperature=25.0,
                reference_time=150.0,
            )
        )
    plain = calibration(felt=False)[sensor]
    return msgspec.structs.replace(plain, effects=saved)


@pytest.mark.parametrize(("sensor", "one"), EFFECTS)
def test_every_effect_of_the_catalogue_has_its_form_in_c(sensor: str, one: Effect) -> None:
    """Statement by statement the header corrects as the program does, in single precision."""
    fitted, samples = with_effects(sensor, [one]), some(sensor)
    made = msgspec.structs.replace(calibration(felt=False), sensors={sensor: fitted})
    assert c_header.has_c(fitted.effects[0])
    files = c_header.TARGET.write(made, ExportSettings())
    corrected = c_header.TARGET.read(files, ExportSettings())[sensor](samples)
    expected = fitted.apply(samples.reading, samples.where)
    plain = msgspec.structs.replace(fitted, effects=[]).apply(samples.reading)
    size = np.abs(expected).max()
    np.testing.assert_allclose(corrected, expected, atol=2e-6 * size)
    if one.name != "current" or INPUT_OF[sensor] == "magnetic":
        assert np.abs(expected - plain).max() > 0.0


def compiled(header: Path) -> Path:
    """The self-test of a header as a program."""
    if COMPILER is None:
        pytest.skip("no C compiler (cc, gcc or clang) is installed")
    source, program = header.with_suffix(".c"), header.with_suffix("")
    source.write_text(
        f'#include "{header.name}"\nint main(void) {{ return imucal_self_test(); }}\n'
    )
    strict = ["-std=c99", "-O1", "-Wall", "-Wextra", "-Wno-unused-function", "-Werror"]
    subprocess.run([COMPILER, *strict, source, "-o", program, "-lm"], check=True)
    return program


def test_the_self_test_of_the_header_passes_and_sees_a_wrong_number(tmp_path: Path) -> None:
    """All effects of all sensors at once, compiled without a warning."""
    made = calibration(felt=False)
    kinds = {
        sensor: [one for one in effects_for(sensor) if one.name not in ("misalignment", "current")]
        for sensor in SENSORS
    }
    sensors = {name: with_effects(name, kinds[name]) for name in made.sensors}
    path = tmp_path / "calibration.h"
    done = write_export(msgspec.structs.replace(made, sensors=sensors), "c-header", path)
    for one in done.sensors.values():
        assert one.rms_exported == pytest.approx(one.rms_calibration, rel=1e-3)
    assert subprocess.run([compiled(path)], check=False).returncode == 0
    text = path.read_text()
    place = re.search(r"IMUCAL_GYROSCOPE_B\[3\] = \{([-+0-9.e]+)f", text)
    assert place is not None
    path.write_text(text.replace(place.group(1), f"{float(place.group(1)) + 0.01:.9e}", 1))
    assert subprocess.run([compiled(path)], check=False).returncode > 0


@pytest.mark.parametrize(
    ("sensor", "term", "needs"),
    [
        ("accelerometer", "second-order", ""),
        ("accelerometer", "bias-temperature", "temperature"),
        ("accelerometer", "bias-drift", "time"),
        ("accelerometer", "hysteresis", "before"),
        ("accelerometer", "vibration-rectification", "vibration"),
        ("gyroscope", "g-sensitivity", "force"),
        ("magnetometer", "current", "current"),
    ],
)
def test_the_header_names_what_must_be_set_before_a_call(
    sensor: str, term: str, needs: str, tmp_path: Path
) -> None:
    """A temperature that is left at zero is 0 °C, far from that of the calibration."""
    made = calibration(felt=False)
    one = with_effects(sensor, [effect(term)])
    done = write_export(
        msgspec.structs.replace(made, sensors={**made.sensors, sensor: one}),
        "c-header",
        tmp_path / "c.h",
    )
    text, notes = (tmp_path / "c.h").read_text(), " ".join(done.notes)
    assert (f"     {sensor}: {needs}\n" in text) is bool(needs)
    assert (f"of the {sensor} {needs}" in notes) is bool(needs)
    assert ("No function of this file depends on it" in text) is not bool(needs)


def test_an_effect_that_nothing_here_knows_is_refused_and_nothing_written(tmp_path: Path) -> None:
    """One of the user's own: neither the program nor the header can apply it."""
    made = calibration(felt=False)
    sensor = made["accelerometer"]
    unknown = SavedEffect("mine", "accelerometer", "k x", ["x"], [1.0], "mg")
    sensor = msgspec.structs.replace(sensor, effects=[unknown])
    alone = msgspec.structs.replace(made, sensors={"accelerometer": sensor})
    with pytest.raises(UsageError, match="has the effect 'mine', which is none of this program"):
        write_export(alone, "c-header", tmp_path / "c.h")
    assert not list(tmp_path.iterdir())
