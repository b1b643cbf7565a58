"""The calibration report: what it says, that it is self-contained, and that it prints whole."""

import json
import math
import os
import re
import shutil
import subprocess
from html.parser import HTMLParser
from pathlib import Path

import msgspec
import numpy as np
import pytest
from scipy import stats

from imucal_wizard.api import load
from imucal_wizard.cli.main import main
from imucal_wizard.core.gravity import normal_gravity
from imucal_wizard.core.quantities import quantity
from imucal_wizard.estimate.parameters import triangular_parameters
from imucal_wizard.report.calibration_file import (
    AsFound,
    Calibration,
    Device,
    SavedRung,
    Value,
)
from imucal_wizard.report.device_history import save_in_history
from imucal_wizard.report.figures import allan_figure
from imucal_wizard.sessions.catalogue import Catalogue
from tests.report.devices import calibration
from tests.report.test_device_history import shifted

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
QUIET = [
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-sync",
    "--disable-background-networking",
    "--disable-component-update",
    "--enable-logging=stderr",
    "--no-pdf-header-footer",
]


class Visible(HTMLParser):
    """Visible texts, tags and addresses of a page."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.texts: list[str] = []
        self.addresses: list[str] = []
        self.tags: list[str] = []
        self._inside: list[str] = []
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Note an element."""
        self.tags.append(tag)
        names = ("src", "href", "data", "xlink:href", "action", "srcset")
        self.addresses += [value or "" for name, value in attrs if name in names]
        if tag not in ("meta", "br", "path", "circle"):
            self._inside.append(tag)

    def handle_endtag(self, tag: str) -> None:
        """Leave an element."""
        if tag in self._inside:
            while self._inside.pop() != tag:
                pass

    def handle_data(self, data: str) -> None:
        """Note a text."""
        hidden = {"style", "title", "desc", "head"} & set(self._inside)
        if data.strip() and not hidden:
            self.texts.append(" ".join(data.split()))

    @property
    def text(self) -> str:
        """All visible text."""
        return " ".join(self.texts)


def full(**changes: object) -> Calibration:
    """A calibration that has everything a report can show."""
    made = calibration(turns=6)
    sensor = made["accelerometer"]
    true = triangular_parameters(np.array(sensor.matrix), np.array(sensor.bias))
    parameters = {
        "bias_x": Value(true["bias_x"], "m/s^2", 1e-3),
        "sensitivity_x": Value(true["sensitivity_x"], "1", 2e-5),
        "theta_yz": Value(true["theta_yz"], "rad", None, carried=False),
    }
    joint = np.diag([1e-6, 4e-10, 0.0])
    joint[0, 1] = joint[1, 0] = -0.9 * 1e-3 * 2e-5
    sensor = msgspec.structs.replace(
        sensor,
        parameters=parameters,
        parameter_covariance=joint.tolist(),
        degrees_of_freedom=12,
        not_determined=["theta_yz"],
        verdict="complete",
        grade="good",
        limit=0.02,
        could_be=0.01,
        floor=9e-5,
        held_out_interval=(8e-5, 1.2e-4),
        repeatability=2e-4,
        repeatability_unit="m/s^2",
        as_found=AsFound(5e-3, "january.json", "2026-01-05T10:00:00+00:00"),
    )
    rungs = [
        SavedRung(["bias", "scale"], None, 2e-3, 3e-3, 1e-4),
        SavedRung(["bias", "scale", "second-order"], "second-order", 1e-4, 1e-4, 1e-4, True),
    ]
    whole = msgspec.structs.replace(
        made,
        sensors={**made.sensors, "accelerometer": sensor},
        device=Device("IMU <7>", "00:1A:7D", "witmotion", {"accelerometer": "−9 to 9 m/s²"}),
        place={"gravity": "given", "name": "Lab 2 & 3"},
        operator="A. <script>alert(1)</script> Meyer",
        ladders={"accelerometer": rungs},
        says={"accelerometer": "The model is complete."},
        fingerprint="sha256:" + 64 * "a",
        measured="2026-02-03T04:05:06+00:00",
    )
    return msgspec.structs.replace(whole, **changes)


def reported(folder: Path, saved: Calibration, *options: str) -> str:
    """The report of a calibration."""
    path, out = folder / "my.json", folder / "report.html"
    path.write_bytes(msgspec.json.encode(saved))
    assert main(["report", str(path), "-o", str(out), *options]) == 0
    return out.read_text()


def test_the_report_says_what_a_quality_manager_asks_for(tmp_path: Path) -> None:
    said = Visible(reported(tmp_path, full())).text
    for words in (
        "IMU <7>",
        "00:1A:7D",
        "Lab 2 & 3",
        "2026-02-03",
        "20.0 to 30.0 °C",
        "9.806650 m/s²: stated by the operator",
        "GOOD",
        "january.json of 2026-01-05",
        "Nominal, without a stated uncertainty: theta_yz (not determined by these data)",
        "nominal: not determined by these data",
        "+ second-order",
        "confirmed by data held out",
        "Correlation coefficients: sensitivity x, bias x: −0.90",
        "k = 2.18",
        "12 degrees of freedom",
        "7 values; rms",
        "No accreditation is claimed",
        64 * "a",
        "imucal-wizard",
    ):
        assert words in said, words


def test_expanded_uncertainties_are_students_quantile_times_the_standard_error(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    capsys.readouterr()
    reported(tmp_path, full(), "--json", "-")
    found = json.loads(capsys.readouterr().out)["sensors"]["accelerometer"]
    k = stats.t.ppf(0.975, 12)
    assert found["expanded_uncertainty"]["bias_x"] == pytest.approx(k * 1e-3)
    assert found["expanded_uncertainty"]["theta_yz"] is None
    assert found["as_found"] == 5e-3


def test_a_factor_without_degrees_of_freedom_is_not_called_students(tmp_path: Path) -> None:
    made = full()
    plain = msgspec.structs.replace(made["accelerometer"], degrees_of_freedom=None)
    made = msgspec.structs.replace(made, sensors={**made.sensors, "accelerometer": plain})
    said = Visible(reported(tmp_path, made)).text
    assert (
        "k = 2.00 for a coverage probability of about 95 % (normal distribution: the file" in said
    )


def changed(sensor: str, **changes: object) -> Calibration:
    """That calibration with one sensor alone, changed."""
    one = msgspec.structs.replace(full()[sensor], **changes)
    return full(sensors={sensor: one}, hold_means=[], rotation_increments=[], field_means=[])


def test_the_method_is_told_as_far_as_the_file_shows_it(tmp_path: Path) -> None:
    fitted = "were estimated by weighted least squares"
    said = Visible(reported(tmp_path, full())).text
    assert "of the accelerometer, the gyroscope and the magnetometer were est" in said
    for words in (fitted, "left out of the fit one at a time", "a test at 1 %"):
        assert words in said
    assert "by hand" not in said
    bare: dict[str, object] = {
        "rms_held_out": None,
        "held_out_interval": None,
        "verdict": None,
        "grade": None,
    }
    bare |= {"could_be": None, "degrees_of_freedom": 1}
    made = changed("accelerometer", method="six-position", **bare)
    said = Visible(reported(tmp_path, made)).text
    assert "published method “six-position”" in said
    assert "theta_yz (the six-position method does not fit it)" in said
    assert "on the data fitted, none held out" in said
    assert "Student's t, 1 degree of freedom" in said
    for words in (fitted, "left out of the fit", "a test at 1 %", "Decision rule", "Could be:"):
        assert words not in said
    assert "traceability rests on the stated gravity alone" in said
    made = changed("gyroscope", method="rate table", frame="own", effects=[])
    said = Visible(reported(tmp_path, made)).text
    assert "The stated rate or angle of each step of the rate table is the reference" in said
    assert "rests on the stated rates or angles of the rate table and the clock alone" in said
    assert "the angle of each step of the rate table" in said
    assert "gravity before" not in said
    field = {"bias_x": Value(12.0, "uT", 0.1)}
    said = Visible(reported(tmp_path, changed("magnetometer", parameters=field))).text
    assert "rests on the stated magnitude of the field alone" in said
    field |= {"field": Value(48.0, "uT", 0.1)}
    said = Visible(reported(tmp_path, changed("magnetometer", parameters=field))).text
    assert "No accreditation is claimed." in said
    assert "the same in all orientations, is the reference of the magnetometer" in said


def test_as_found_of_counts_is_by_one_scale_and_bias_fitted_to_them(tmp_path: Path) -> None:
    made = changed("accelerometer", bias_unit="count", parameters={}, parameter_covariance=None)
    sensor = msgspec.structs.replace(made["accelerometer"], as_found=None)
    said = Visible(
        reported(tmp_path, msgspec.structs.replace(made, sensors={"accelerometer": sensor}))
    ).text
    assert "corrected by one common scale and a bias fitted to these readings" in said
    assert "nominal conversion" not in said


def test_the_reason_of_the_grade_is_the_error_that_could_be(tmp_path: Path) -> None:
    made = changed("accelerometer", could_be=0.03, grade="doubtful")
    said = Visible(reported(tmp_path, made)).text
    assert "These data cannot exclude errors above the limit of use, 2.0 mg." in said
    assert "neither its error as left nor the error that could be exceeds the limit" in said
    said = Visible(reported(tmp_path, full())).text
    assert "“complete”. The error is within the limit of use." in said


def test_numbers_of_holds_are_whole_and_a_short_noise_measurement_has_no_rows(
    tmp_path: Path,
) -> None:
    one = full(hold_means=full().hold_means[:1], rotation_increments=[])
    first = reported(tmp_path, one).partition("</figure>")[0]
    assert re.findall(r'class="mid">([\d.]+)</text>', first) == ["1"]
    noise = {
        "schema": "imucal-wizard/noise/1",
        "sensors": {
            "accelerometer": {
                "axes": {},
                "tau": [],
                "deviation": {"x": [], "y": [], "z": []},
                "units": {"deviation": "m/s^2"},
            }
        },
    }
    (tmp_path / "noise.json").write_text(json.dumps(noise))
    said = Visible(reported(tmp_path, full(), "--noise", str(tmp_path / "noise.json"))).text
    assert "too short for coefficients" in said
    assert "bias instability" not in said


def test_normal_gravity_is_that_of_the_published_tables() -> None:
    """Moritz, Geodetic Reference System 1980: equator, 45°, pole; free air 0.3086 mGal per m."""
    published = {0.0: 9.7803267715, 45.0: 9.806199203, 90.0: 9.8321863685}
    for latitude, gravity in published.items():
        assert normal_gravity(math.radians(latitude), 0.0) == pytest.approx(gravity, abs=2e-9)
    fall = normal_gravity(math.radians(45.0), 0.0) - normal_gravity(math.radians(45.0), 1000.0)
    assert fall == pytest.approx(3.086e-3, rel=1e-3)


def test_the_history_of_the_item_is_told(tmp_path: Path) -> None:
    """Two calibrations and a recheck: the newer one found what the older one had left."""
    folder, place = tmp_path / "s", tmp_path / "my.json"
    for day in (1, 20):
        made = shifted(day, 0.005 * day)
        sensor = made["accelerometer"]
        bias = {"bias_x": Value(sensor.bias[0], "m/s^2", 0.002)}
        sensors = {"accelerometer": msgspec.structs.replace(sensor, parameters=bias)}
        save_in_history(msgspec.structs.replace(made, sensors=sensors), place, folder)
    with Catalogue(folder) as catalogue:
        recheck = {"schema": "imucal-wizard/recheck/1", "verdict": "no-go", "says": "bias_x moved"}
        catalogue.add_recheck({"name": "arm"}, recheck | {"created": "2031-04-01"})
    out = tmp_path / "report.html"
    assert main(["report", str(place), "-o", str(out), "--sessions", str(folder)]) == 0
    said = Visible(out.read_text()).text
    assert "History of the item" in said
    assert "2031-03-01 accelerometer" in said
    assert "2031-03-20 accelerometer" in said
    assert said.count("this report") == 1
    assert "NO-GO bias_x moved" in said
    rows = [
        re.findall(r"<td[^>]*>(.*?)</td>", row)
        for row in re.findall(r"<tr>(.*?)</tr>", out.read_text(), re.DOTALL)
    ]
    found = load(place)["accelerometer"].as_found
    assert found is not None
    newer = ["2031-03-20", "accelerometer", quantity(found.error, "m/s^2"), "0.0102 mg"]
    assert [*newer, "not judged", "this report"] in rows
    # 0.095 m/s² in 19 days, each value ± 0.002 m/s², in mg per month of 30.44 days
    assert ["accelerometer", "bias x", "2", "15.52 ± 0.46", "–", "mg", "–"] in rows
    assert ["2031-04-01", "NO-GO", "bias_x moved"] in rows
    assert main(["report", str(place), "-o", str(out), "--sessions", str(tmp_path / "t")]) == 0
    assert "History of the item" not in Visible(out.read_text()).text


def test_the_gravity_used_is_of_the_place_of_the_calibration(tmp_path: Path) -> None:
    """A place that is stated for the report is compared with, and was not used."""
    there = {"gravity": "normal", "latitude": "47.4", "height": "400"}
    page = reported(tmp_path, full(place=there), "--latitude", "60", "--height", "100")
    said = Visible(page).text
    assert "from latitude 47.4°, height 400 m" in said
    assert "Normal gravity at latitude 60°, height 100 m is 9.8188" in said


def test_gravity_of_another_place_is_compared(tmp_path: Path) -> None:
    page = reported(tmp_path, full(), "--latitude", "60", "--height", "100")
    said = Visible(page).text
    assert "Normal gravity at latitude 60°, height 100 m is 9.8188" in said
    assert "which adds to all sensitivities" in said


def test_the_report_needs_nothing_from_outside_and_runs_nothing(tmp_path: Path) -> None:
    page = reported(tmp_path, full())
    seen = Visible(page)
    assert seen.addresses == []
    assert not {"script", "link", "img", "iframe", "object"} & set(seen.tags)
    assert not re.search(r"url\(|@import", page)
    assert "&lt;script&gt;alert(1)" in page
    assert seen.tags.count("svg") == seen.tags.count("desc") == 3


def test_a_repeatability_that_the_method_does_not_show_is_not_measured(tmp_path: Path) -> None:
    sensor = msgspec.structs.replace(full()["accelerometer"], repeatability=None)
    page = reported(tmp_path, full(sensors={**full().sensors, "accelerometer": sensor}))
    assert "not measured" in page
    assert "no pose was repeated" not in page


def test_the_text_of_a_deviation_that_rises_does_not_say_that_it_falls() -> None:
    taus, deviation = np.array([1.0, 10.0, 100.0]), np.array([1.0, 2.0, 4.0])
    text = allan_figure("allan", "Allan deviation", taus, {"x": deviation}, "µg").text
    assert text == "The largest deviation is 4.0 µg; the least: x: 1.0 µg at 1.0 s."


def test_a_calibration_without_single_measurements_has_no_figures(tmp_path: Path) -> None:
    bare = full(hold_means=[], rotation_increments=[], field_means=[], ladders={}, device=None)
    seen = Visible(reported(tmp_path, bare))
    assert "svg" not in seen.tags
    assert "does not hold the single measurements" in seen.text


@pytest.mark.parametrize(
    ("content", "says"),
    [
        ("{}", "is not a calibration: its schema is None"),
        ('{"schema": "imucal-wizard/noise/1"}', "is not a calibration"),
        ("ax,ay,az\n1,2,3\n", "is not JSON"),
        ('{"schema": "imucal-wizard/calibration/1", "sensors": 3}', "is damaged"),
    ],
)
def test_other_files_are_refused_in_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], content: str, says: str
) -> None:
    path = tmp_path / "other.json"
    path.write_text(content)
    assert main(["report", str(path)]) == 2
    said = capsys.readouterr().err
    assert says in said
    assert len(said.strip().splitlines()) == 1
    assert not (tmp_path / "other.report.html").exists()


@pytest.mark.parametrize(
    ("key", "value", "says"),
    [
        ("degrees_of_freedom", -3, "degrees of freedom are -3"),
        ("parameter_covariance", [[1.0, 2.0], [3.0]], "not a valid one of 3 numbers"),
        ("matrix", [[1.0, 0.0, 0.0]] * 3, "matrix is singular"),
    ],
)
def test_an_edited_sensor_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], key: str, value: object, says: str
) -> None:
    saved = json.loads(msgspec.json.encode(full()))
    saved["sensors"]["accelerometer"][key] = value
    path = tmp_path / "edited.json"
    path.write_text(json.dumps(saved))
    assert main(["report", str(path)]) == 2
    assert says in capsys.readouterr().err


def test_an_edited_measurement_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    saved = json.loads(msgspec.json.encode(full()))
    saved["rotation_increments"][1]["edges"] = [1.0]
    path = tmp_path / "edited.json"
    path.write_text(json.dumps(saved))
    assert main(["report", str(path)]) == 2
    assert "not one edge more than intervals" in capsys.readouterr().err


def test_another_file_is_not_overwritten(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    reported(tmp_path, full())
    reported(tmp_path, full())  # its own report is
    (tmp_path / "report.html").write_text("<html>mine</html>")
    assert main(["report", str(tmp_path / "my.json"), "-o", str(tmp_path / "report.html")]) == 2
    assert "is not a calibration report" in capsys.readouterr().err
    assert "mine" in (tmp_path / "report.html").read_text()


def browser() -> str:
    """A Chromium; the test is skipped without one."""
    found = os.environ.get("IMUCAL_BROWSER") or next(filter(None, map(shutil.which, BROWSERS)), "")
    if not found:
        pytest.skip("no Chromium here: install one, or name it in IMUCAL_BROWSER")
    return found


@pytest.mark.study
def test_the_report_prints_whole_and_silently_in_a_browser(tmp_path: Path) -> None:
    import pypdf

    page = reported(tmp_path, full())
    pdf, log = tmp_path / "report.pdf", tmp_path / "net.json"
    ended = subprocess.run(
        [
            browser(),
            *QUIET,
            f"--user-data-dir={tmp_path / 'profile'}",
            f"--log-net-log={log}",
            f"--print-to-pdf={pdf}",
            (tmp_path / "report.html").as_uri(),
        ],
        capture_output=True,
        text=True,
        check=True,
        timeout=120,
    )
    assert "CONSOLE" not in ended.stderr
    requested = set(re.findall(r'"url":"([a-z]+://[^"]*)"', log.read_text()))
    assert not {url for url in requested if url.startswith(("http", "ws")) and "google" not in url}
    sheets = pypdf.PdfReader(pdf).pages
    assert all(abs(float(one.mediabox.width) - 595.3) < 1.0 for one in sheets)  # A4
    printed = "".join("".join(one.extract_text().split()) for one in sheets)
    for text in Visible(page).texts:
        assert "".join(text.split()) in printed, text
    assert f"page{len(sheets)}of{len(sheets)}" in printed


@pytest.mark.study
def test_nothing_is_wider_than_the_sheet_or_the_window(tmp_path: Path) -> None:
    """The page in frames of the widths of a telephone, of A4 without margins, and of a screen."""
    reported(tmp_path, full())
    widths = (340, 680, 1400)
    frames = "".join(
        f'<iframe src="report.html" width="{w}" height="800"></iframe>' for w in widths
    )
    script = """
    onload = () => { document.title = [...document.querySelectorAll("iframe")].map(frame => {
      const page = frame.contentDocument, wide = page.documentElement.clientWidth;
      const scrolls = element => element.closest(".scroll");
      return [...page.body.querySelectorAll("*")].filter(one => !scrolls(one)
        && one.getBoundingClientRect().right > wide + 1).length;
    }).join(" ") + "."; }"""
    (tmp_path / "frames.html").write_text(f"<title>-</title>{frames}<script>{script}</script>")
    ended = subprocess.run(
        [
            browser(),
            *QUIET,
            "--allow-file-access-from-files",
            "--virtual-time-budget=2000",
            f"--user-data-dir={tmp_path / 'profile'}",
            "--dump-dom",
            (tmp_path / "frames.html").as_uri(),
        ],
        capture_output=True,
        text=True,
        check=True,
        timeout=120,
    )
    assert "<title>0 0 0.</title>" in ended.stdout
