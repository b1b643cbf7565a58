"""Sessions of which pages are overwritten, half overwritten, empty or garbled byte by byte."""

import sqlite3
import tempfile
from collections.abc import Callable, Iterator
from contextlib import closing
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.attacks import Outcome
from imucal_wizard.acquire.files import Batch, RecordingOptions
from imucal_wizard.acquire.files.session_salvage import read_session, repair
from imucal_wizard.core.errors import ImucalError
from imucal_wizard.run.review import review_session
from imucal_wizard.sessions import Session
from tests.cli.kept_sessions import printed, sat

NUMBER = 5
ATTACK = "openings of sessions with damaged pages"

FULL_TRIES, FEW_TRIES, REPLAYED = 777, 30, 10
"""Openings; each tenth session is replayed and repaired, too."""
PAGE, PIECE_BYTES = 4096, 90
"""A piece is shorter than a page, as those of a serial line are."""
MAX_DAMAGED_PAGES = 12

Damage = Callable[[np.ndarray, np.random.Generator], None]


def _zeros(page: np.ndarray, _rng: np.random.Generator) -> None:
    page[:] = 0


def _noise(page: np.ndarray, rng: np.random.Generator) -> None:
    page[:] = rng.integers(0, 256, len(page))


def _half(page: np.ndarray, rng: np.random.Generator) -> None:
    start = int(rng.integers(0, len(page)))
    page[start:] = rng.integers(0, 256, len(page) - start)


def _bytes(page: np.ndarray, rng: np.random.Generator) -> None:
    page[rng.integers(0, len(page), 30)] = rng.integers(0, 256, 30)


WAYS: tuple[Damage, ...] = (_zeros, _noise, _half, _bytes)


def run(full: bool) -> Outcome:
    """Damage random pages and read every piece that lies outside them."""
    rng, outcome = np.random.default_rng(5), Outcome()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "whole.imucal"
        pieces, pages = _session(path)
        whole = np.frombuffer(path.read_bytes(), np.uint8)
        read = 0
        for number in range(FULL_TRIES if full else FEW_TRIES):
            damaged = path.with_name("damaged.imucal")
            data = whole.copy()
            count = int(rng.integers(1, MAX_DAMAGED_PAGES)) if number % 2 else 1
            hit = rng.choice(len(data) // PAGE, count, replace=False).tolist()
            for page in hit:
                WAYS[number % len(WAYS)](data[PAGE * page : PAGE * (page + 1)], rng)
            damaged.write_bytes(data.tobytes())
            wanted = {one for one, page in zip(pieces, pages, strict=True) if page not in hit}
            read += len(wanted)
            outcome.count(_opened(damaged, wanted, replayed=number % REPLAYED == 0))
        outcome.notes.append(
            f"{read:,} pieces outside the damaged pages of {len(whole) // PAGE} read again"
        )
    return outcome


def _session(path: Path) -> tuple[list[tuple[float, bytes]], list[int]]:
    """A session of short pieces; the pieces, and the page in which each lies."""
    sat(path, share=0.0)
    data = printed()
    with Session.open(path) as session:
        for start in range(0, len(data), PIECE_BYTES):
            session.write_pieces([(start / 8000.0, data[start : start + PIECE_BYTES])])
    with closing(sqlite3.connect(path)) as connection:
        connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")
        pieces = connection.execute("SELECT arrival, data FROM raw WHERE data != x''").fetchall()
    file = path.read_bytes()
    return pieces, [file.find(piece) // PAGE for _, piece in pieces]


def _opened(path: Path, wanted: set[tuple[float, bytes]], *, replayed: bool) -> str:
    """What was lost of a damaged session."""
    try:
        missing = wanted - _pieces(path)[0]
        if missing:
            return f"{len(missing)} of {len(wanted)} readable pieces"
        if replayed:
            review_session(path, RecordingOptions())
            if done := repair(path):
                again, lost = _pieces(done[0])
                done[0].unlink()
                if lost or not wanted <= again:
                    return "the repaired file lacks pieces"
    except ImucalError as error:
        return f"refused: {error}"
    except Exception as error:  # noqa: BLE001 - any other error is what this looks for
        return f"{type(error).__name__}: {error}"
    return ""


def _pieces(path: Path) -> tuple[set[tuple[float, bytes]], str]:
    """The pieces that are read of a session, and what of it is lost."""

    def decode(_: dict[str, Any], batches: Iterator[Batch]) -> set[tuple[float, bytes]]:
        pieces = chain(*(batch for batch in batches if isinstance(batch, list)))
        return {(arrival, data) for data, arrival in pieces}

    return read_session(path, decode, 1 << 16)
