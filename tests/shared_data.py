"""Where the optional real recordings lie: ``../shared/data`` beside the checkout."""

import os
from pathlib import Path

import pytest

_BESIDE = Path(__file__).resolve().parents[1].parent / "shared" / "data"


def shared_data(name: str) -> Path:
    """The path of one real recording; skips the test where the recordings are not there.

    ``IMUCAL_SHARED_DATA`` names another folder.
    """
    folder = Path(os.environ.get("IMUCAL_SHARED_DATA", _BESIDE))
    path = folder / name
    if not path.exists():
        pytest.skip(f"needs the real recordings: {path} is not there (set IMUCAL_SHARED_DATA)")
    return path
