"""Binary frames: cut out of any bytes, proven by their checksum, in step again after garbage."""

import json
import os
import struct
import threading
from binascii import crc_hqx
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from imucal_wizard.acquire.decode import decoder_for
from imucal_wizard.acquire.decode.base import Column
from imucal_wizard.acquire.decode.frames import (
    FrameCutter,
    FrameDecoder,
    FrameDetector,
    FrameShape,
)
from imucal_wizard.acquire.decode.witmotion import SHAPE
from imucal_wizard.acquire.files import RecordingOptions
from imucal_wizard.acquire.files.recording_files import read_files
from imucal_wizard.acquire.intake import LINK_BREAK, Intake
from imucal_wizard.acquire.listen import listen_to_port
from imucal_wizard.acquire.ports import PortInfo
from imucal_wizard.acquire.setup import StreamSetup
from imucal_wizard.acquire.transport import Transport
from imucal_wizard.core.errors import RecordingError
from imucal_wizard.core.readings import join_readings
from imucal_wizard.core.units import STANDARD_GRAVITY
from tests.acquire.ports import Pty
from tests.shared_data import shared_data


def frame(kind: int, *numbers: int) -> bytes:
    """One frame of WitMotion's protocol."""
    body = struct.pack("<BB4h", 0x55, kind, *numbers, *(0 for _ in range(4 - len(numbers))))
    return body + bytes([sum(body) & 0xFF])


def sample(number: int) -> bytes:
    """One sample: specific force, rate, angle (of no use here) and field."""
    return (
        frame(0x51, number % 7, -8, 2039, 2531)
        + frame(0x52, 1, -2, number % 5, 2531)
        + frame(0x53, 100, 200, 300, 0)
        + frame(0x54, -120, 340, 210, 2531)
    )


def samples(count: int) -> bytes:
    """Consecutive samples."""
    return b"".join(map(sample, range(count)))


def test_the_vectors_of_the_protocol_are_decoded() -> None:
    vectors = json.loads(shared_data("wire/vectors.json").read_text())
    cycle = b"".join(bytes.fromhex(vectors[f"wit_{name}"]["hex"]) for name in ("acc", "gyr", "mag"))
    rows = decoder_for("witmotion").feed(cycle * 8)
    assert rows.malformed == 0
    acc = np.array([16, -8, 2040]) * 16 / 32768
    np.testing.assert_allclose(rows.values[0, :3], acc)
    np.testing.assert_allclose(rows.values[0, 3], 25.31)
    np.testing.assert_allclose(rows.values[0, 4:7], np.array([1, -2, 0]) * 2000 / 32768)
    np.testing.assert_allclose(rows.values[0, 7:10], [-120, 340, 210])


class _Counts(FrameDecoder):
    """``AA 55 | length | int16 … | CRC-16``."""

    def _read(self, frame: bytes, gap: bool) -> None:
        if gap:
            self._lost()
        self._row(struct.unpack_from("<3h", frame, 3))


COUNTS = FrameShape(
    sync=b"\xaa\x55",
    header=3,
    length=lambda header: header[2] + 5 if header[2] == 6 else 0,
    valid=lambda frame: crc_hqx(frame[:-2], 0xFFFF) == int.from_bytes(frame[-2:], "little"),
)


def _counts(*numbers: int) -> bytes:
    body = b"\xaa\x55\x06" + struct.pack("<3h", *numbers)
    return body + crc_hqx(body, 0xFFFF).to_bytes(2, "little")


def test_a_protocol_of_one_frame_per_sample_is_a_shape_and_one_method() -> None:
    columns = tuple(Column("a" + axis, "count", "a" + axis) for axis in "xyz")
    decoder, detector = _Counts("counts", COUNTS, columns), FrameDetector(COUNTS)
    assert not detector.feed(_counts(1, 2, 3) + _counts(4, 5, 6))
    assert detector.feed(_counts(7, 8, 9))
    spoilt = bytearray(_counts(0xAA, 0x55, -1))
    spoilt[5] ^= 1
    rows = decoder.feed(b"\x55" + _counts(1, 2, -3) + bytes(spoilt) + _counts(4, 5, 6))
    np.testing.assert_array_equal(rows.values, [[1, 2, -3], [4, 5, 6]])
    assert (rows.malformed, rows.skipped) == (1, (0, 1))


def test_a_stream_of_frames_is_recognised_and_read() -> None:
    intake = Intake()
    data = samples(300)
    parts = [intake.feed(data[i : i + 44], i / 4400) for i in range(0, len(data), 44)]
    assert intake.format == "witmotion"
    assert intake.needs == ()
    readings = join_readings([part for part in parts if part is not None])
    assert len(readings) == 300
    assert readings.gyroscope is not None
    assert readings.magnetometer is not None
    assert readings.magnetometer.unit == "count"
    assert readings.accelerometer.values[0, 2] == pytest.approx(
        2039 * 16 / 32768 * STANDARD_GRAVITY
    )
    assert readings.gyroscope.values[0, 0] == pytest.approx(np.radians(2000 / 32768))
    assert intake.rate == pytest.approx(100.0, rel=0.02)
    assert "register 0x63" in " ".join(intake.warnings)
    assert intake.preview.line == data[-24:].hex(" ")


@settings(max_examples=40, deadline=None)
@example(garbage=[(1 / 128, b"\x00")], cuts=[])  # in the first cycle, from which types are learned
@given(
    garbage=st.lists(st.tuples(st.floats(0, 1), st.binary(min_size=1, max_size=30)), max_size=5),
    cuts=st.lists(st.floats(0, 1), max_size=30),
)
def test_garbage_costs_the_samples_it_spoils_wherever_the_bytes_are_cut(
    garbage: list[tuple[float, bytes]], cuts: list[float]
) -> None:
    data = samples(60)
    for where, what in garbage:
        place = int(where * len(data))
        data = data[:place] + what + data[place:]
    places = sorted({0, len(data), *(int(cut * len(data)) for cut in cuts)})
    whole, pieces = decoder_for("witmotion"), decoder_for("witmotion")
    one = whole.feed(data)
    parts = [pieces.feed(data[a:b]) for a, b in pairwise(places)]
    there = [part.values for part in parts if len(part.values)]
    np.testing.assert_array_equal(np.concatenate(there), one.values)
    assert sum(part.malformed for part in parts) == one.malformed
    assert len(one.values) >= 60 - 2 * len(garbage)


def test_a_lost_frame_spoils_its_sample_only_and_keeps_the_others_in_step() -> None:
    data = samples(40)
    del_at = 20 * 44 + 11  # the rate of sample 20
    rows = decoder_for("witmotion").feed(data[:del_at] + data[del_at + 11 :])
    assert (len(rows.values), rows.malformed) == (39, 1)
    assert [i for i, skipped in enumerate(rows.skipped) if skipped] == [20]


def test_a_wrong_checksum_is_no_frame_and_memory_stays_bounded() -> None:
    cutter = FrameCutter(SHAPE)
    spoilt = bytearray(sample(0)[:11])
    spoilt[4] ^= 1
    assert cutter.feed(bytes(spoilt)) == []
    assert len(cutter.feed(os.urandom(1 << 16) + sample(1))) >= 3
    assert len(cutter._rest) < 11


@settings(max_examples=30, deadline=None)
@given(data=st.binary(min_size=200, max_size=3000))
def test_garbage_is_not_taken_for_frames(data: bytes) -> None:
    intake = Intake()
    intake.feed(data, 0.0)
    assert intake.format != "witmotion"


def test_text_with_the_sync_letters_in_it_stays_text() -> None:
    line = "UQ,%.2f,ax,0.1,UR,0.2,9.8\n"
    intake = Intake()
    intake.feed("".join(line % i for i in range(60)).encode(), 0.0)
    assert intake.format != "witmotion"


def test_a_broken_link_joins_no_halves() -> None:
    """The break is no byte of the stream: any byte may be part of a frame."""
    data = samples(50)
    intake = Intake(StreamSetup(format="witmotion", rate=100.0))
    first = intake.feed(data[: 30 * 44 + 5], 0.0)
    assert intake.feed(LINK_BREAK, 1.0) is None
    second = intake.feed(data[35 * 44 :], 2.0) or intake.flush()
    assert first is not None
    assert second is not None
    assert (len(first), len(second)) == (30, 15)
    assert intake.malformed == 0


def test_a_raw_file_is_read_as_the_stream_is(tmp_path: Path) -> None:
    path = tmp_path / "capture.bin"
    path.write_bytes(b"\x00\x17" + samples(300))
    with pytest.raises(RecordingError) as caught:
        read_files([path])
    assert caught.value.settings == ("rate 100",)
    file = read_files([path], RecordingOptions(rate=100.0))
    stream = Intake(StreamSetup(rate=100.0)).feed(b"\x00\x17" + samples(300), 0.0)
    assert stream is not None
    np.testing.assert_array_equal(file.accelerometer.values, stream.accelerometer.values)
    np.testing.assert_array_equal(file.accelerometer.time, stream.accelerometer.time)
    named = read_files([path], RecordingOptions(rate=100.0, as_format="witmotion"))
    assert len(named) == len(file) == 300


def test_frames_come_through_pyserial_from_a_pseudo_terminal(pty: Pty) -> None:
    transport = Transport(pty.path)
    transport.open()
    intake, count = Intake(StreamSetup(rate=100.0)), 0
    data = samples(120)
    for place in range(0, len(data), 100):
        pty.send(data[place : place + 100])
    while more := transport.read(0.5):
        readings = intake.feed(more, 2.0)
        count += 0 if readings is None else len(readings)
    transport.close()
    assert intake.format == "witmotion"
    assert count == 120


def test_listening_to_a_port_names_the_format(pty: Pty) -> None:
    sender = threading.Timer(0.2, pty.send, [samples(60)])
    sender.start()
    assert listen_to_port(PortInfo(pty.path), seconds=1.0).format == "witmotion"
    sender.join()
