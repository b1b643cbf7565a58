"""Temperature and time are told from a reference that belongs to the session."""

import numpy as np

from imucal_wizard.model.catalogue import effect
from tests.model.sphere import at_rest, full_sphere


def test_rows_selected_keep_the_reference_of_the_session() -> None:
    """The mean temperature and the middle of the session do not move with the rows."""
    whole = at_rest(full_sphere(5), temperature=np.array([20.0, 22.0, 24.0, 26.0, 38.0]))
    part = whole.select(np.array([0, 4]))
    assert (part.reference_temperature, part.reference_time) == (26.0, 120.0)
    np.testing.assert_array_equal(part.force, whole.force[[0, 4]])
    thermal = effect("bias-temperature")
    np.testing.assert_array_equal(
        thermal.columns("accelerometer", part),
        thermal.columns("accelerometer", whole)[[0, 4]],
    )


def test_an_unknown_temperature_moves_nothing() -> None:
    """A row without temperature stands at the reference, and none of the others shifts."""
    c = at_rest(full_sphere(3), temperature=np.array([20.0, np.nan, 30.0]))
    columns = effect("bias-temperature").columns("gyroscope", c)
    assert c.reference_temperature == 25.0
    np.testing.assert_array_equal(columns[1], np.zeros((3, 3)))
    assert columns[2, 0, 0] == -columns[0, 0, 0] > 0.0
