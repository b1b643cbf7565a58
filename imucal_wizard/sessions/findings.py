"""Finished holds and rotations as rows of the session file, for people and other programs."""

import json
import sqlite3
from typing import Any

from imucal_wizard.procedure.collected import Collected
from imucal_wizard.procedure.holds import Hold
from imucal_wizard.procedure.rotations import Rotation

_Row = tuple[Any, ...]


class Findings:
    """Keeps two tables equal to what has been collected, writing only what is new."""

    def __init__(self) -> None:
        self._written: dict[str, list[_Row]] = {"hold": [], "rotation": []}

    def write(self, connection: sqlite3.Connection, collected: Collected) -> None:
        """Write what differs from last time; what was taken back is deleted."""
        holds = (*collected.holds, *collected.validation)
        self._equal(connection, "hold", [_hold_row(hold) for hold in holds])
        self._equal(connection, "rotation", [_rotation_row(one) for one in collected.rotations])

    def _equal(self, connection: sqlite3.Connection, table: str, rows: list[_Row]) -> None:
        before = self._written[table]
        for index, row in enumerate(rows):
            if index >= len(before) or before[index] != row:
                places = ", ".join("?" * (len(row) + 1))
                connection.execute(
                    f"INSERT OR REPLACE INTO {table} VALUES ({places})",  # noqa: S608 - own names
                    (index, *row),
                )
        if len(rows) < len(before) or not before:
            connection.execute(
                f"DELETE FROM {table} WHERE id >= ?",  # noqa: S608 - one of two own names
                (len(rows),),
            )
        self._written[table] = rows


def _hold_row(hold: Hold) -> _Row:
    gyroscope = hold.gyroscope
    value = {
        "mean_accelerometer": hold.accelerometer.tolist(),
        "covariance_accelerometer": hold.accelerometer_covariance.tolist(),
        "mean_gyroscope": None if gyroscope is None else gyroscope.tolist(),
        "samples": hold.samples,
        "temperature": hold.temperature,
        "hand_held": hold.hand_held,
    }
    return hold.start, hold.end, hold.pose, json.dumps(value)


def _rotation_row(rotation: Rotation) -> _Row:
    start, end = rotation.before.end, rotation.after.start
    value = json.dumps({"samples": len(rotation.time)})
    return start, end, rotation.axis, rotation.problem, value
