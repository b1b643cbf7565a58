"""Statistics without SciPy's special functions."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import norm

from imucal_wizard.core.statistics import normal_below


@given(st.lists(st.floats(-60.0, 60.0), min_size=1, max_size=20))
def test_the_normal_distribution_is_that_of_scipy(deviations: list[float]) -> None:
    """To the error that Abramowitz & Stegun state, halved."""
    found = normal_below(np.array(deviations))
    np.testing.assert_allclose(found, norm.cdf(deviations), rtol=0.0, atol=7.6e-8)
