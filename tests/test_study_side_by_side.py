"""Two programs on one port, copies of what is being written, modes of files; a few attempts."""

import numpy as np
import pytest

from benchmarks.attacks import side_by_side as attack

pytestmark = pytest.mark.study


def test_nothing_is_lost_by_a_second_program_or_a_copy() -> None:
    chance = np.random.default_rng(1)
    attempts = (attack.on_one_port(), attack.copies(4, chance), attack.umasks())
    assert [problem for one in attempts for problem in one if problem] == []
