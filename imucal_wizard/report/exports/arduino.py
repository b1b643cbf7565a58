"""Arduino: a sketch that corrects readings, without effects.

``corrected = M (reading − b)`` in the float of the board, and a line per second over the serial
port as the self-test: what the first hold read, and what it becomes and should become.
"""

import numpy as np

from imucal_wizard.model.effect import c_number
from imucal_wizard.report.calibration_file import Calibration
from imucal_wizard.report.exports import ExportSettings, ExportTarget, Files
from imucal_wizard.report.exports.c_header import constants, float_arrays
from imucal_wizard.report.proof import Correction, Proof
from imucal_wizard.report.reduced import Kept

_SKETCH = """
void imucalApply(const float M[3][3], const float b[3], float v[3]) {
  const float d[3] = {v[0] - b[0], v[1] - b[1], v[2] - b[2]};
  for (int i = 0; i < 3; i++)
    v[i] = M[i][0] * d[0] + M[i][1] * d[1] + M[i][2] * d[2];
}

void setup() { Serial.begin(115200); }

void loop() {
  // Put your sensor's readings here, in the unit named above.
"""


def _write(calibration: Calibration, settings: ExportSettings) -> Files:
    del settings
    lines = [f"// {calibration.made_by}"]
    for name, sensor in calibration.sensors.items():
        lines += constants(name, sensor)
    lines.append(_SKETCH.rstrip("\n"))
    proof = Proof(calibration)
    for name in calibration.sensors:
        samples = proof.samples(name)
        first = [0.0, 0.0, 0.0] if samples is None else samples.reading[0]
        matrix, bias = np.array(calibration[name].matrix), np.array(calibration[name].bias)
        wanted = " ".join(f"{one:.6f}" for one in matrix @ (np.array(first) - bias))
        word, values = f"IMUCAL_{name.upper()}", ", ".join(map(c_number, first))
        lines += [
            f"  float {name}[3] = {{{values}}};",
            f"  imucalApply({word}_M, {word}_B, {name});",
            f'  Serial.print("{name} ");',
            *(
                f"  Serial.print({name}[{i}], 6);" + (" Serial.print(' ');" if i < 2 else "")
                for i in range(3)
            ),
            f'  Serial.println(" expected {wanted}");',
        ]
    return {"": ("\n".join([*lines, "  delay(1000);", "}"]) + "\n").encode()}


def _read(files: Files, settings: ExportSettings) -> dict[str, Correction]:
    """``M (reading − b)`` of the sketch, in single precision.

    Raises:
        ValueError: it has no such constants.
    """
    del settings
    arrays = float_arrays(files[""].decode())
    names = [key.removesuffix("_M") for key in arrays if key.endswith("_M")]
    if not names or b"imucalApply" not in files[""]:
        raise ValueError("no sketch with a calibration")

    def correction(word: str) -> Correction:
        matrix, bias = arrays[f"{word}_M"], arrays[f"{word}_B"]
        return lambda samples: np.asarray((samples.reading - bias) @ matrix.T)

    return {word.removeprefix("IMUCAL_").lower(): correction(word) for word in names}


TARGET = ExportTarget(
    name="arduino",
    title="Arduino: sketch with constants and a function",
    formula="x = M · (reading − b)",
    suffix=".ino",
    cannot_hold=("effects: the constants are those of the model without them", "standard errors"),
    keeps={name: Kept() for name in ("accelerometer", "gyroscope", "magnetometer")},
    write=_write,
    read=_read,
    notes=lambda _calibration, _settings: (
        "the sketch prints what each corrected reading is and should be",
        "Arduino's editor wants the sketch in a folder of its own name",
    ),
)
