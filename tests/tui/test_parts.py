"""The parts that screens are made of, without a screen."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from imucal_wizard.core.poses import DIRECTIONS, FACES
from imucal_wizard.core.quantities import number, unit_sign, value_and_error
from imucal_wizard.guide.kinds import Act, EventKind
from imucal_wizard.guide.operator_view import IDENTITY, about, product, times, turn_to
from imucal_wizard.guide.state import AxisMotion, Event, RotationStatus
from imucal_wizard.guide.wording import (
    ALL_TAKEN,
    DISTURBED,
    HOLD_STILL,
    NO_FIELD,
    TUMBLE,
    TURN_ROUND,
    lay_down,
    turn_up,
)
from imucal_wizard.report.plot import scatter
from imucal_wizard.run.snapshot import StreamStatus
from imucal_wizard.tui.drawing import cube_rows
from imucal_wizard.tui.panels.step import compact_row, pose_rows, rotation_rows, stream_row
from imucal_wizard.tui.panels.traces import trace, trace_rows
from imucal_wizard.tui.sounds import PATTERNS, Sounds
from imucal_wizard.tui.text import bar, clean, compact, wrapped
from imucal_wizard.tui.widgets.big_text import enlarged
from tests.characters import CHARACTERS
from tests.tui.terminals import lines, plain

SI = ("m/s^2", "rad/s")


@given(st.text(CHARACTERS))
def test_cleaned_text_holds_nothing_a_terminal_obeys(text: str) -> None:
    assert all(c.isprintable() or c == " " for c in clean(text))


@given(st.floats(allow_nan=True, allow_infinity=True))
def test_any_number_is_short(value: float) -> None:
    assert len(number(value)) <= 10


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (2.94, "2.94"),
        (0.012345, "0.0123"),
        (-7.0, "−7.00"),
        (123456.0, "123456"),
        (0.9996, "1.00"),
        (0.09996, "0.100"),
        (99.96, "100"),
    ],
)
def test_numbers_keep_three_digits_of_what_they_are_rounded_to(value: float, text: str) -> None:
    assert number(value) == text


@pytest.mark.parametrize(
    ("value", "places", "text"),
    [(1.04, 1, "1.0"), (0.96, 1, "1.0"), (123.4, 1, "123"), (20000.0, 0, "20k"), (3e6, 0, "3M")],
)
def test_a_value_beside_a_bar_is_never_cut_to_another_number(
    value: float, places: int, text: str
) -> None:
    assert compact(value, places) == text


def test_a_value_is_shown_to_the_second_digit_of_its_standard_error() -> None:
    assert value_and_error(1.0279451, 0.0000219) == ("1.027945", "0.000022")
    assert value_and_error(-0.58016, 0.019) == ("−0.580", "0.019")


def test_a_path_is_never_broken_at_a_hyphen() -> None:
    rows = wrapped("✓ /home/someone/.local/share/imucal-wizard/sessions/one.json", 66)
    assert len(rows) == 1
    longer = wrapped("saved in /home/someone/.local/share/imucal-wizard/one.json", 50)
    assert longer[1][0][0].endswith("imucal-wizard/one.json")


def test_a_mere_ratio_has_no_unit() -> None:
    assert unit_sign("1") == ""


def test_the_axes_of_a_sensor_are_shown_with_the_same_decimals() -> None:
    values = (1.04, 0.96, 1.1)
    motions = [AxisMotion(f"a{x}", v, 5.3, "mg") for x, v in zip("xyz", values, strict=True)]
    row = plain(compact_row(motions))
    assert [word for word in row.split() if word[0].isdigit()] == ["1.0", "1.0", "1.1"]


@given(st.floats(0, 1), st.integers(3, 60))
def test_a_bar_is_as_wide_as_asked(fraction: float, width: int) -> None:
    assert len(bar(fraction, width)) == width


@pytest.mark.parametrize("name", list(DIRECTIONS))
def test_the_wanted_attitude_has_the_wanted_direction_on_top(name: str) -> None:
    x, y, z = (float(value) for value in DIRECTIONS[name])
    now = product(about((0.6, 0.0, 0.8), 1.1), about((0.0, 1.0, 0.0), 0.4))
    top = times(turn_to(now, (x, y, z)).of(now), (x, y, z))
    assert top == pytest.approx((0.0, 0.0, 1.0), abs=1e-12)


def test_a_device_at_rest_shows_its_top_front_and_right_face() -> None:
    picture = cube_rows(IDENTITY, 30, 14)
    text = "\n".join(picture)
    assert [face in text for face in ("+z", "−y", "+x")] == [True] * 3
    assert [face in text for face in ("−z", "+y", "−x")] == [False] * 3
    rows = {face: next(i for i, row in enumerate(picture) if face in row) for face in ("+z", "−y")}
    assert rows["+z"] < rows["−y"]


@given(st.floats(-math.pi, math.pi), st.integers(6, 40), st.integers(3, 20))
def test_a_drawing_fills_its_place_and_no_more(angle: float, columns: int, rows: int) -> None:
    picture = cube_rows(about((0.6, 0.0, 0.8), angle), columns, rows, axis="y")
    assert len(picture) == rows
    assert {len(row) for row in picture} == {columns}


@given(st.lists(st.floats(-10, 10), max_size=300), st.integers(1, 40), st.integers(1, 6))
def test_a_trace_fills_its_place_whatever_comes(
    values: list[float], columns: int, rows: int
) -> None:
    picture = trace(np.array(values), -5.0, 5.0, columns, rows)
    assert len(picture) == rows
    assert {len(row) for row in picture} == {columns}


def test_a_rising_trace_rises() -> None:
    top, bottom = trace(np.linspace(-1, 1, 100), -1.0, 1.0, 10, 2)
    assert not top[:5].strip()
    assert top[5:].strip()
    assert bottom[:5].strip()


def test_rates_are_drawn_in_degrees_below_accelerations_and_both_as_wide() -> None:
    values = np.hstack(
        [np.full((100, 3), 9.8), np.radians(np.linspace(-90, 90, 300).reshape(100, 3))]
    )
    above, below = (plain(row) for row in trace_rows(values, SI, 80, 2))
    assert above.startswith(" a")
    assert above.endswith(" m/s²")
    assert below.startswith(" ω")
    assert below.endswith(" −100…100 °/s")
    assert above.index("  z ") == below.index("  z ")


def test_without_a_gyroscope_no_rates_are_drawn() -> None:
    values = np.hstack([np.full((100, 3), 9.8), np.full((100, 3), np.nan)])
    (only,) = trace_rows(values, SI, 80, 2)
    assert only[0][0] == " a"


def test_channels_that_are_dead_leave_the_trace_empty() -> None:
    assert trace(np.full(50, np.nan), -1.0, 1.0, 10, 1) == [" " * 10]


@pytest.mark.parametrize(
    ("width", "height", "rows"), [(160, 8, 7), (78, 4, 4), (40, 4, 1), (20, 4, 1), (9, 4, 2)]
)
def test_the_instruction_is_as_large_as_there_is_room(width: int, height: int, rows: int) -> None:
    shown = [row for row in enlarged("TURN +X −Y UP", width, height) if row.strip()]
    assert len(shown) == rows
    assert max(map(len, shown)) <= width


def test_residuals_far_beyond_the_noise_have_another_sign() -> None:
    rows = scatter(np.arange(2.0), np.array([0.1, -0.9]), 40, 8, error=np.full(2, 0.1))
    assert "∘" in rows[3]
    assert "●" in rows[6]
    assert "┼" in rows[3]


def test_a_rate_in_counts_has_no_unit_of_rate_and_a_found_scale_names_its_source() -> None:
    def rate_row(rotation: RotationStatus) -> str:
        return "".join(text for text, _ in rotation_rows(rotation, 80)[1])

    counts = RotationStatus("x", "+z", 87.0, -945.0, 6476.0, unit="count")
    assert rate_row(counts) == " rate    −945 count, fastest 6476   scale and range not known"
    scaled = replace(counts, rate=-7.2, fastest=49.4, unit="°/s", scaled_by=4)
    assert "−7 °/s, fastest 49   scale from 4 rotations about x" in rate_row(scaled)


@pytest.mark.parametrize("act", [Act.CONNECT, Act.ENDED])
def test_a_rotation_without_samples_has_no_angle_and_no_rate(act: Act) -> None:
    rows = rotation_rows(RotationStatus("x", "+z", range_limit=250.0, wanted=6), 80, act)
    shown = ["".join(text for text, _ in row) for row in rows]
    assert shown[:2] == [" so far  –", " rate    –"]
    assert "0 of 6" in shown[2]


def test_a_rotation_says_which_angles_count_and_praises_nothing_before_it_moves() -> None:
    def rows(angle: float, fastest: float) -> list[str]:
        status = RotationStatus("x", "+z", angle, 0.0, fastest, range_limit=250.0)
        shown = ["".join(text for text, _ in row) for row in rotation_rows(status, 80)]
        assert max(map(len, shown)) <= 80
        return shown

    rest, half, circle = rows(0.0, 0.0), rows(-170.0, 90.0), rows(450.0, 90.0)
    assert rest[0].endswith(" 20° to 3 circles count")
    assert "within range" not in rest[1]
    assert "within range" in half[1]
    assert "▕█" in half[0]
    assert "█»▏" in circle[0]
    assert "«" in rows(-340.0, 90.0)[0]


def test_a_counted_axis_ends_in_whole_numbers() -> None:
    counted = scatter(np.arange(1.0, 41.0), np.ones(40), 40, 8)
    assert counted[-1].split() == ["1", "40"]


def test_every_kind_of_event_has_a_sound() -> None:
    assert set(PATTERNS) == {str(kind) for kind in EventKind}


def test_an_important_sound_is_not_cut_off_by_a_lesser_one() -> None:
    rung: list[float] = []
    waiting: list[object] = []
    now = [0.0]
    sounds = Sounds(lambda: rung.append(now[0]), lambda _s, f: waiting.append(f), lambda: now[0])
    sounds.hear([Event(EventKind.LINK_LOST, 0.0, "lost")])
    now[0] = 0.2
    sounds.hear([Event(EventKind.STILL, 0.2, "still")])
    assert rung == [0.0]
    now[0] = 60.0
    sounds.hear([Event(EventKind.STILL, 60.0, "still")])
    assert rung == [0.0, 60.0]


def test_every_instruction_is_in_block_letters_at_eighty_columns() -> None:
    """Also the longest, the corners of the validation: they are read from two metres."""
    others = [
        HOLD_STILL,
        ALL_TAKEN,
        "PUT IT DOWN",
        "HANDS OFF",
        "LIFT IT",
        "ROTATE ABOUT Z",
    ]
    others += ["TILT IT AS SHOWN", "NOT CONNECTED", "NO SAMPLES", "DATA ENDED", "ONE MOMENT"]
    field = (*map(lay_down, FACES), TURN_ROUND, TUMBLE, DISTURBED, NO_FIELD)
    for words in (*map(turn_up, DIRECTIONS), *others, *field):
        rows = enlarged(words, 78, 4)
        assert len(rows) == 4
        assert max(map(len, rows)) <= 78
        assert set("".join(rows)) <= set(" █▀▄"), words


def test_how_far_the_limits_are_loosened_is_readable_in_eighty_columns() -> None:
    """The temperature gives way to it, and the source does."""
    source = "virtual IMU on /dev/pts/4"
    stream = StreamStatus(source=source, connected=True, rate=100.0, temperature=26.4)
    noise = "1.0 1.0 1.1 mg, 0.096 0.095 0.096 °/s"
    calm = plain(stream_row(stream, noise, 1.0, False, 80))
    loose = plain(stream_row(stream, noise, 21.0, False, 80))
    assert "26.4 °C" in calm
    assert "limits ×21" in loose
    assert noise in loose
    assert len(loose) <= 80


def test_a_lost_connection_is_shown_without_the_rate_that_the_stream_had() -> None:
    lost = StreamStatus(source="virtual IMU", connected=False, rate=100.0, lost=3)
    assert plain(stream_row(lost, "", 1.0, False, 80)).startswith(" ▲ not connected, 3 lost")


def test_each_kind_of_pose_has_its_name_and_all_26_fit_80_columns() -> None:
    rows = lines(pose_rows((), tuple(DIRECTIONS), "+x+y", None, 80, 9))
    assert [row[:9].strip() for row in rows] == ["faces", "edges", "", "corners", ""]
    assert max(map(len, rows)) <= 80
