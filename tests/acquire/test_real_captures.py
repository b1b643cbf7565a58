"""What real devices sent: lines are read, binary protocols are named."""

from imucal_wizard.acquire.decode import decoder_for
from imucal_wizard.acquire.intake import Intake
from tests.shared_data import shared_data


def test_the_real_lines_are_read() -> None:
    lines = shared_data("wire/real_lines.txt").read_bytes().splitlines(keepends=True)
    vectornav = [line for line in lines if line.startswith(b"$VNIMU")]
    assert len(decoder_for("vnimu").feed(b"".join(vectornav)).values) == 2
    long_header = next(i for i, line in enumerate(lines) if line.startswith(b"rtcDate"))
    rows = decoder_for("openlog-artemis").feed(lines[long_header] + lines[long_header + 1])
    assert rows.values[0, 1:5].tolist() == [58725.54, -638.67, 153.32, 782.23]
    short_header = next(i for i, line in enumerate(lines) if line.startswith(b"aX,aY"))
    rows = decoder_for("openlog-artemis").feed(lines[short_header] + lines[short_header + 1])
    assert rows.values[0, :3].tolist() == [933.11, -44.43, -300.29]
    raw = [line for line in lines if line.startswith((b"Raw:", b"Uni:"))]
    assert len(decoder_for("raw-uni").feed(b"".join(raw)).values) == 1


def test_real_binary_captures_are_named_and_not_mistaken_for_text() -> None:
    for path, protocol in (
        ("wire/xsens/einride_1.output.bin", "Xsens"),
        ("wire/vectornav/jerabaul29_F00294_vn100_binary_logger.dat", "VectorNav"),
    ):
        intake = Intake()
        intake.feed(shared_data(path).read_bytes(), 0.0)
        assert not intake.ready
        assert protocol in intake.problem
        assert "text" in intake.problem
