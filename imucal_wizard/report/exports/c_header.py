"""C header: matrices, biases and a function per sensor that corrects readings with effects.

``x = M (y − b) − ε(x)`` is solved by this program's fixed-point iteration in single precision.
``imucal_self_test`` applies the functions to readings of the calibration and counts what differs.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from imucal_wizard.core.errors import UsageError
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.model.catalogue import effect
from imucal_wizard.model.effect import DATA_SHEET_UNIT, INPUT_OF, Circumstances, c_number
from imucal_wizard.model.expression import Expression, parse
from imucal_wizard.model.terms import CONVERGED
from imucal_wizard.report.calibration_file import Calibration, SavedEffect, Sensor
from imucal_wizard.report.exports import ExportSettings, ExportTarget, Files
from imucal_wizard.report.proof import Correction, Proof, Samples
from imucal_wizard.report.reduced import Kept

_PASSES = 200
_TEST_READINGS = 6
"""Of each sensor in the self-test."""
_TOLERANCE = 2e-5
"""Of the self-test: single precision has 6e-8, and the steps of the iteration add up."""

_HEAD = """\
#ifndef IMUCAL_CALIBRATION_H
#define IMUCAL_CALIBRATION_H
#include <math.h>
"""
_STRUCT = """\
typedef struct {
  float force[3];     /* specific force for the gyroscope, m/s^2 */
  float before[3];    /* specific force in the pose before, m/s^2 */
  float temperature;  /* degC */
  float time;         /* since the session's first sample, s */
  float vibration;    /* mean square, sum of the axes, (m/s^2)^2 */
  float current;      /* of the board, A or per cent */
  float warming;      /* rate of change of the temperature, degC/s */
} imucal_where;
"""
_MEMBERS = {
    "f": "force",
    "before": "before",
    "warmth": "temperature",
    "time": "time",
    "since_middle": "time",
    "vibration": "vibration",
    "current": "current",
    "warming": "warming",
}
"""Member of the struct that a variable of a function comes from."""
_FUNCTION = """
static inline void imucal_{name}(const float y[3], const imucal_where *where, float out[3]) {{
  const float d0 = y[0] - {B}[0], d1 = y[1] - {B}[1], d2 = y[2] - {B}[2];
  const float l0 = {M}[0][0] * d0 + {M}[0][1] * d1 + {M}[0][2] * d2;
  const float l1 = {M}[1][0] * d0 + {M}[1][1] * d1 + {M}[1][2] * d2;
  const float l2 = {M}[2][0] * d0 + {M}[2][1] * d1 + {M}[2][2] * d2;
  out[0] = l0; out[1] = l1; out[2] = l2;
"""


def has_c(one: SavedEffect) -> bool:
    """Whether an effect can be written in C; one of the user's own cannot."""
    try:
        return bool(effect(one.term).c_columns(one.sensor, one.variant))
    except UsageError:
        return False


def constants(name: str, sensor: Sensor) -> list[str]:
    """Matrix and bias of a sensor in C."""
    rows = ", ".join("{" + ", ".join(map(c_number, row)) + "}" for row in sensor.matrix)
    bias = ", ".join(map(c_number, sensor.bias))
    word = f"IMUCAL_{name.upper()}"
    return [
        f"/* {name}: reads {sensor.bias_unit} */",
        f"static const float {word}_M[3][3] = {{{rows}}};",
        f"static const float {word}_B[3] = {{{bias}}};",
    ]


def _statements(name: str, sensor: Sensor) -> list[str]:
    """The error of the input, effect by effect."""
    lines = []
    for one in sensor.effects:
        known = effect(one.term)
        lines.append(f"    /* {one.term}: {known.equation} */")
        lines += [
            f"    e{axis} += {c_number(one.sizes[place])} * {text};"
            for axis, place, text in known.c_columns(name, one.variant)
        ]
    return lines


def _needed(calibration: Calibration) -> dict[str, list[str]]:
    """Members of the struct that the effects of a sensor read, by sensor; those with one only."""
    found = {}
    for name, sensor in calibration.sensors.items():
        code = " ".join(line for line in _statements(name, sensor) if "/*" not in line)
        words = re.findall(rf"\b({'|'.join(_MEMBERS)})[012]?\b", code)
        if words:
            found[name] = list(dict.fromkeys(_MEMBERS[word] for word in words))
    return found


def _notes(calibration: Calibration, settings: ExportSettings) -> tuple[str, ...]:
    del settings
    proof = "to prove it there: imucal_self_test() returns 0"
    needed = _needed(calibration)
    if not needed:
        return (proof,)
    members = "; ".join(f"of the {name} {', '.join(one)}" for name, one in needed.items())
    return (
        proof,
        f"set before each call what the effects depend on, since zero is a value: {members}",
    )


def _function(name: str, sensor: Sensor) -> list[str]:
    word = f"IMUCAL_{name.upper()}"
    head = _FUNCTION.format(name=name, M=f"{word}_M", B=f"{word}_B").splitlines()
    if not sensor.effects:
        return [*head, "  (void)where;", "}"]
    first, g = sensor.effects[0], c_number(DATA_SHEET_UNIT["accelerometer"])
    body = [
        f"  const float unit = {c_number(DATA_SHEET_UNIT[name])};",
        *(f"  const float f{i} = where->force[{i}] / {g};" for i in range(3)),
        *(f"  const float before{i} = where->before[{i}] / {g};" for i in range(3)),
        f"  const float warmth = where->temperature - {c_number(_reference(sensor))};",
        "  const float time = where->time;",
        f"  const float since_middle = time - {c_number(first.reference_time or 0)};",
        f"  const float vibration = where->vibration / ({g} * {g});",
        "  const float current = where->current;",
        "  const float warming = where->warming;",
        f"  for (int pass = 0; pass < {_PASSES}; ++pass) {{",
        *(f"    const float x{i} = out[{i}] / unit;" for i in range(3)),
        "    float e0 = 0, e1 = 0, e2 = 0;",
        *_statements(name, sensor),
        "    const float n0 = l0 - e0, n1 = l1 - e1, n2 = l2 - e2;",
        "    const float moved = fabsf(n0 - out[0]) + fabsf(n1 - out[1]) + fabsf(n2 - out[2]);",
        "    out[0] = n0; out[1] = n1; out[2] = n2;",
        "    (void)x0; (void)x1; (void)x2;",
        "    if (moved <= 1e-7f * (fabsf(l0) + fabsf(l1) + fabsf(l2))) break;",
        "  }",
        *(f"  (void)f{i}; (void)before{i};" for i in range(3)),
        "  (void)warmth; (void)since_middle; (void)vibration; (void)current;",
        "  (void)warming;",
        "}",
    ]
    return [*head, *body]


def _where(where: Circumstances, row: int) -> str:
    numbers = np.concatenate([where.force[row], where.previous[row]])
    warm, shaken = where.temperature[row], where.vibration[row]
    rest = [warm, where.time[row], shaken, where.current[row], where.warming[row]]
    f, p = numbers[:3], numbers[3:]

    def listed(values: Sequence[float] | FloatArray) -> str:
        return ", ".join(c_number(float(np.nan_to_num(one))) for one in values)

    return f"{{{{{listed(f)}}}, {{{listed(p)}}}, {listed(rest)}}}"


def _self_test(calibration: Calibration) -> list[str]:
    """Readings of the calibration with what they must give."""
    lines = ["", "/* Number of readings that a function corrects wrongly; 0 is right. */"]
    lines += ["static inline int imucal_self_test(void) {", "  int wrong = 0;"]
    proof = Proof(calibration)
    for name, sensor in calibration.sensors.items():
        samples = proof.samples(name)
        if samples is None:
            continue
        rows = np.linspace(0, len(samples.reading) - 1, _TEST_READINGS).astype(int)
        warm = np.nan_to_num(samples.where.temperature, nan=_reference(sensor))
        before = np.nan_to_num(samples.where.previous)
        where = replace(samples.where, temperature=warm, previous=before)
        right = sensor.apply(samples.reading, where)
        size = float(np.abs(right).max())
        lines.append(f"  {{ /* {name} */")
        lines.append(
            "    static const struct { float y[3]; imucal_where where; float x[3]; } test[] = {"
        )
        for row in rows.tolist():
            y, x = (", ".join(map(c_number, one[row])) for one in (samples.reading, right))
            lines.append(f"      {{{{{y}}}, {_where(where, row)}, {{{x}}}}},")
        lines += [
            "    };",
            "    for (unsigned k = 0; k < sizeof test / sizeof *test; ++k) {",
            "      float out[3];",
            f"      imucal_{name}(test[k].y, &test[k].where, out);",
            "      for (int i = 0; i < 3; ++i)",
            f"        if (!(fabsf(out[i] - test[k].x[i]) <= {c_number(_TOLERANCE * size)}))",
            "          ++wrong;",
            "    }",
            "  }",
        ]
    return [*lines, "  return wrong;", "}"]


def _reference(sensor: Sensor) -> float:
    return (sensor.effects[0].reference_temperature or 0.0) if sensor.effects else 0.0


_USE = (
    "",
    "     imucal_where where = {0};            // in C++ where{}",
    "     imucal_accelerometer(y, &where, x);  // float y[3], x[3]",
    "",
    "   imucal_self_test() is 0 where the compiler computes what the program did. */",
)


def _write(calibration: Calibration, settings: ExportSettings) -> Files:
    del settings
    lines = [f"/* {calibration.made_by}", ""]
    lines += ["   x = M (y - b) - e(x): m/s^2, rad/s, uT.", *_USE, _HEAD]
    needed = [f"     {name}: {', '.join(one)}" for name, one in _needed(calibration).items()]
    if needed:
        says = "/* Set before each call, since zero is a value (0 degC) and not an unknown one:"
        lines += [says, *needed, "*/"]
    else:
        lines += ["/* No function of this file depends on it. */"]
    lines += [_STRUCT]
    for name, sensor in calibration.sensors.items():
        lines += ["", *constants(name, sensor), *_function(name, sensor)]
    lines += [*_self_test(calibration), "", "#endif"]
    return {"": ("\n".join(lines) + "\n").encode()}


def float_arrays(text: str) -> dict[str, FloatArray]:
    """Constant arrays of floats in C by name, in single precision."""
    found = {}
    for name, places, numbers in re.findall(
        r"static const float (\w+)((?:\[\d+\])+) = (\{.*\});", text
    ):
        values = [np.float32(one) for one in re.findall(r"[-+0-9.][-+0-9.e]*(?=f)", numbers)]
        shape = [int(one) for one in re.findall(r"\d+", places)]
        found[name] = np.array(values, np.float64).reshape(shape)
    return found


def _read(files: Files, settings: ExportSettings) -> dict[str, Correction]:
    """The functions of the header, statement by statement.

    Raises:
        ValueError: it is no such header.
    """
    del settings
    text = files[""].decode()
    arrays = float_arrays(text)
    found: dict[str, Correction] = {}
    for name in INPUT_OF:
        if f"IMUCAL_{name.upper()}_M" in arrays:
            body = text.split(f"imucal_{name}(const float y[3]")[1].split("\n}")[0]
            word = f"IMUCAL_{name.upper()}"
            found[name] = _applied(arrays[f"{word}_M"], arrays[f"{word}_B"], body)
    if not found:
        raise ValueError("no header of a calibration")
    return found


def _applied(matrix: FloatArray, bias: FloatArray, body: str) -> Correction:
    """One function of the header."""

    def number(pattern: str) -> float:
        match = re.search(pattern + r"([-+0-9.e]+)f", body)
        return float(np.float32(match.group(1))) if match else 0.0

    unit = number(r"const float unit = ")
    warm, middle = (number(rf"{word} - ") for word in (r"where->temperature", r"= time"))
    g = number(r"where->force\[0\] / ")
    errors = [(int(axis), _expression(one)) for axis, one in re.findall(r"  e(\d) \+= (.+);", body)]

    def correct(samples: Samples) -> FloatArray:
        linear = (samples.reading - bias) @ matrix.T
        found = linear
        for _ in range(_PASSES if errors else 0):
            names = _names(samples.where, found / unit, g, warm, middle)
            moved = linear.copy()
            for axis, one in errors:
                moved[:, axis] -= one.value(names)
            change, found = np.abs(moved - found).max(), moved
            if change <= CONVERGED * np.abs(linear).max():
                break
        return found

    return correct


def _expression(text: str) -> Expression:
    """A C expression of floats as one of this program's formulas."""
    plain = re.sub(r"(?<=[0-9.])f\b", "", text)
    return parse(re.sub(r"\b(sqrt|exp|fabs|fmin|fmax)f\b", _plain_name, plain))


def _plain_name(match: re.Match[str]) -> str:
    return match.group(1).removeprefix("f")


def _names(
    where: Circumstances, x: FloatArray, g: float, warm: float, middle: float
) -> Mapping[str, FloatArray]:
    """The variables of the header's functions."""
    force, before = where.force / g, np.nan_to_num(where.previous) / g
    return {
        **{f"x{i}": x[:, i] for i in range(3)},
        **{f"f{i}": force[:, i] for i in range(3)},
        **{f"before{i}": before[:, i] for i in range(3)},
        "warming": where.warming,
        "warmth": np.nan_to_num(where.temperature - warm),
        "time": where.time,
        "since_middle": where.time - middle,
        "vibration": np.nan_to_num(where.vibration) / g**2,
        "current": where.current,
    }


_WITH_EFFECTS = Kept(takes=has_c)
TARGET = ExportTarget(
    name="c-header",
    title="C header: functions with all effects, self-test",
    formula="x = M · (reading − b) − ε(x)",
    suffix=".h",
    cannot_hold=("standard errors",),
    keeps={
        "accelerometer": _WITH_EFFECTS,
        "gyroscope": _WITH_EFFECTS,
        "magnetometer": _WITH_EFFECTS,
    },
    write=_write,
    read=_read,
    notes=_notes,
)
