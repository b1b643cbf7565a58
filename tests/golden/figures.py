"""Which figures of a command's JSON document are compared, and how closely.

Parameters agree within a small share of their standard errors, errors of the fit within a few per
cent. Held-out errors and floors depend on definitions (which holds are one direction, which noise
counts) and are compared loosely. Sentences are not compared.
"""

import math
from collections.abc import Iterator, Mapping
from typing import Any

Document = dict[str, Any]

PARAMETER_ERRORS = {"gyroscope": 0.5}
"""Difference allowed in a parameter, in its standard errors; 0.05 for the other sensors.

The gyroscope's rows are weighted by two estimates of their noise in turn.
"""
PER_CENT = {"gyroscope": 25.0}
"""Difference allowed in a standard error or fitted rms; 5 % for the other sensors."""
HELD_OUT_FACTOR = 1.6
FLOOR_FACTOR = 2.5
ANGLE = 0.01
"""Difference allowed in a rotation's angle, rad."""
PARTIAL_PER_MILLE = 1.0
"""Difference allowed in a parameter that has no standard error."""


def figures(document: Document) -> Document:
    """The figures that are compared, of any command's document."""
    kept: Document = {"schema": document.get("schema")}
    if isinstance(document.get("holds"), list):
        kept["rate"] = document["rate"].get("accelerometer")
        kept["holds"] = [[h["start"], h["end"], h["pose"]] for h in document["holds"]]
        kept["rotations"] = [
            [r["start"], r["end"], r["axis"], r["angle"]] for r in document["rotations"]
        ]
    sensors = document.get("sensors", {})
    kept["sensors"] = {name: _sensor(record) for name, record in sensors.items()}
    return _rounded(kept)  # type: ignore[no-any-return]  # the same shape


def _sensor(record: Any) -> Document:
    """One sensor of ``fit`` or ``bench``, or the methods of ``compare``."""
    if isinstance(record, list):
        return {
            "methods": {
                one["method"]: None if one["result"] is None else _sensor(one["result"])
                for one in record
            }
        }
    kept = {
        key: record[key]
        for key in ("model", "method", "frame", "bias_unit", "disturbed_holds")
        if key in record
    }
    if "ladder" in record:  # bench; the verdict of fit is another, coarser one
        kept["verdict"] = record["verdict"]
        kept["explanation"] = next(iter(record["explanations"]), None)
        kept["ladder"] = [
            {key: rung[key] for key in ("added", "rms_fitted", "rms_held_out", "floor")}
            for rung in record["ladder"]
        ]
    kept |= {key: record[key] for key in ("rms_before", "rms_fitted") if key in record}
    kept |= {key: record[key] for key in ("rms_held_out", "floor") if key in record}
    kept["parameters"] = {
        name: [one["value"], one["standard_error"], one["unit"]]
        for name, one in record.get("parameters", {}).items()
    }
    return kept


def _rounded(value: Any) -> Any:
    """The same with numbers of seven digits."""
    if isinstance(value, float):
        return float(f"{value:.7g}")
    if isinstance(value, dict):
        return {key: _rounded(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_rounded(one) for one in value]
    return value


def differences(expected: Document, found: Document) -> list[str]:
    """Each difference beyond what is allowed, as a line with its place."""
    lines: list[str] = []
    if expected["schema"] != found["schema"]:
        lines.append(f"schema: {expected['schema']} became {found['schema']}")
    if expected.get("holds"):
        lines += _times("holds", expected, found)
        lines += _times("rotations", expected, found)
    if expected["sensors"].keys() != found["sensors"].keys():
        return [*lines, f"sensors: {list(expected['sensors'])} became {list(found['sensors'])}"]
    for name, record in expected["sensors"].items():
        lines += _sensor_differences(name, name, record, found["sensors"][name])
    return lines


def _times(key: str, expected: Document, found: Document) -> Iterator[str]:
    """Holds or rotations: as many, at the same times within a sample, of the same name."""
    if len(expected[key]) != len(found[key]):
        yield f"{key}: {len(expected[key])} became {len(found[key])}"
        return
    sample = 1.01 / expected["rate"]
    for index, (one, other) in enumerate(zip(expected[key], found[key], strict=True)):
        if any(abs(one[k] - other[k]) > sample for k in (0, 1)):
            yield f"{key}[{index}]: {one[:2]} s became {other[:2]} s"
        if one[2] != other[2]:
            yield f"{key}[{index}]: {one[2]} became {other[2]}"
        if key == "rotations" and abs(one[3] - other[3]) > ANGLE:
            yield f"{key}[{index}]: angle {one[3]} became {other[3]}"


def _sensor_differences(
    place: str, sensor: str, expected: Document, found: Document | None
) -> Iterator[str]:
    if found is None:
        yield f"{place}: there is no result any more"
        return
    for method, one in expected.get("methods", {}).items():
        if method not in found["methods"]:
            yield f"{place}: {method} is gone"
        elif one is None:
            if found["methods"][method] is not None:
                yield f"{place}: {method} was refused and gives a result"
        else:
            where = f"{place}/{method}"
            yield from _sensor_differences(where, sensor, one, found["methods"][method])
    if "methods" in expected:
        return
    words = ("model", "method", "frame", "bias_unit", "verdict", "explanation", "disturbed_holds")
    for key in words:
        if expected.get(key) != found.get(key):
            yield f"{place}: {key} {expected.get(key)} became {found.get(key)}"
    yield from _errors(place, sensor, expected, found)
    rungs, others = expected.get("ladder", []), found.get("ladder", [])
    if [rung["added"] for rung in rungs] != [rung["added"] for rung in others]:
        yield f"{place}: the ladder {rungs} became {others}"
    else:
        for index, (rung, other) in enumerate(zip(rungs, others, strict=True)):
            yield from _errors(f"{place}/ladder[{index}]", sensor, rung, other)
    yield from _parameters(place, sensor, expected["parameters"], found["parameters"])


def _errors(place: str, sensor: str, expected: Document, found: Document) -> Iterator[str]:
    """Rms before and fitted closely; held out and floor within a factor."""
    close = 1.0 + PER_CENT.get(sensor, 5.0) / 100.0
    limits = {"rms_before": close, "rms_fitted": close, "rms_held_out": HELD_OUT_FACTOR}
    if sensor != "magnetometer":  # its floor has one definition per command
        limits["floor"] = FLOOR_FACTOR
    for key, factor in limits.items():
        one, other = expected.get(key), found.get(key)
        if one is None:
            continue
        if other is None or not abs(math.log(other / one)) <= math.log(factor):
            yield f"{place}: {key} {one} became {other}"


def _parameters(
    place: str, sensor: str, expected: Mapping[str, Any], found: Mapping[str, Any]
) -> Iterator[str]:
    """Values within a share of their standard errors, these within some per cent."""
    if expected.keys() != found.keys():
        yield f"{place}: parameters {list(expected)} became {list(found)}"
        return
    share = PARAMETER_ERRORS.get(sensor, 0.05)
    close = math.log(1.0 + PER_CENT.get(sensor, 5.0) / 100.0)
    for name, (value, error, unit) in expected.items():
        new_value, new_error, new_unit = found[name]
        if unit != new_unit:
            yield f"{place}: {name} in {unit} became {new_unit}"
        elif not error:
            if not math.isclose(value, new_value, rel_tol=1e-3 * PARTIAL_PER_MILLE, abs_tol=1e-9):
                yield f"{place}: {name} {value} became {new_value}"
        elif not abs(new_value - value) <= share * error:
            yield f"{place}: {name} moved by {(new_value - value) / error:.3f} standard errors"
        elif new_error is None or not abs(math.log(new_error / error)) <= close:
            yield f"{place}: the standard error of {name} {error} became {new_error}"
