"""The characters of texts that Hypothesis makes."""

from hypothesis import strategies as st

CHARACTERS = st.characters(exclude_categories=["Cs"])
"""All but the surrogates, which is all that UTF-8 encodes: the default of ``st.text``, for which
Hypothesis tries to encode each of a million characters, three seconds in a fresh clone."""
