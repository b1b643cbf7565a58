"""A formula typed in the bench is an effect like any other, and can do nothing else."""

import time

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from imucal_wizard.core.errors import UsageError
from imucal_wizard.model.catalogue import effect
from imucal_wizard.model.formula import VARIABLES, FormulaEffect
from imucal_wizard.model.lesson import lesson, session_poses, session_rotations


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("k*a**2", "second-order"),
        ("k*abs(a)", "asymmetry"),
        ("k*a*abs(a)", "odd-quadratic"),
        ("k * a * a * a", "third-order"),
        ("k*T", "bias-temperature"),
        ("k*T*a/1000", "scale-temperature"),
        ("k*exp(-t/180)", "warm-up"),
        ("k*(t - 600)/60", "bias-drift"),
        ("k*(t >= 600)", "bias-step"),
        ("k*where(t < 600, 0, 1)", "bias-step"),
        ("x: kx*px; y: ky*py; z: kz*pz", "hysteresis"),
        ("k*v", "vibration-rectification"),
    ],
)
def test_a_formula_gives_the_columns_of_the_effect_it_spells(text: str, name: str) -> None:
    """Same units, same kind, one coefficient per axis."""
    known, typed = effect(name), FormulaEffect(text, "accelerometer")
    expected = known.columns("accelerometer", session_poses())
    columns = typed.columns("accelerometer", session_poses())
    np.testing.assert_allclose(columns, expected, atol=1e-12 * np.abs(expected).max())
    assert typed.kind == ("time" if name == "scale-temperature" else known.kind)


def test_a_formula_of_the_gyroscope_is_in_degrees_per_second() -> None:
    """``1e-6*k*w**2`` is the second-order term; named coefficients are shared between axes."""
    square = FormulaEffect("1e-6*k*w**2", "gyroscope")
    expected = effect("second-order").columns("gyroscope", session_rotations())
    np.testing.assert_allclose(
        square.columns("gyroscope", session_rotations()), expected, atol=1e-18
    )
    shared = FormulaEffect("x: s*ay; y: s*ax", "gyroscope")
    assert [one.name for one in shared.parameters("gyroscope")] == ["s"]
    linear = effect("g-sensitivity").columns("gyroscope", session_rotations())
    expected = linear[:, :, 1] + linear[:, :, 3]
    np.testing.assert_allclose(
        shared.columns("gyroscope", session_rotations())[:, :, 0], expected, atol=1e-18
    )


def test_coefficients_are_named_as_typed_with_a_prior_as_wide_as_a_consumer_part() -> None:
    """Each may move the reading by 3 mg rms over an ordinary session."""
    typed = FormulaEffect("x: k1*ay*az + drift*t; z: k1", "accelerometer")
    names = [one.name for one in typed.parameters("accelerometer")]
    assert names == ["k1", "drift"]
    for one, column in zip(
        typed.parameters("accelerometer"),
        np.moveaxis(typed.columns("accelerometer", session_poses()), 2, 0),
        strict=True,
    ):
        moved = one.typical * np.sqrt((column**2).sum(axis=1).mean())
        assert moved == pytest.approx(3.0 * 9.80665e-3)
        assert one.unit == "mg"


def test_a_formula_is_told_like_a_lesson_and_says_what_it_lacks() -> None:
    """Its own text, what it depends on, what must vary."""
    typed = FormulaEffect("k*T*a", "accelerometer")
    explained = lesson(typed, "accelerometer")
    assert explained.equation == "k*T*a"
    assert "temperature minus the session's mean" in explained.signature
    cold = session_poses().select(slice(0, 4))
    assert "only one temperature" in (typed.lacking("accelerometer", cold) or "")
    assert typed.lacking("accelerometer", session_poses()) is None
    assert set(VARIABLES) >= {"ax", "wy", "pz", "a", "w", "p", "T", "t", "v", "g"}


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "the formula is empty"),
        ("k*", "cannot be read"),
        ("k*\x00", "cannot be read"),
        ("a**2", "0 coefficients"),
        ("+".join(f"k{n}*a" for n in range(13)), "39 coefficients"),
        ("k*a + 1", "a sum of terms with one coefficient each"),
        ("k**2*a", "a sum of terms with one coefficient each"),
        ("k*c*a", "a sum of terms with one coefficient each"),
        ("abs(k)*a", "a sum of terms with one coefficient each"),
        ("max(k*a, j*a)", "a sum of terms with one coefficient each"),
        ("a/k", "no finite value somewhere"),
        ("k*log(a)", "no finite value somewhere"),
        ("k*a/T", "no finite value somewhere"),
        ("k*1e999*a", "no finite value somewhere"),
        ("k*0*a", "near 1"),
        ("k*a*1e200", "near 1"),
        ("k*a*0x" + "f" * 280, "too large"),
        ("q: k*a", "write x:, y: or z:"),
        ("k*a; j*w", "write x:, y: or z:"),
        ("k*min(a)", "too few or too many arguments"),
        ("k*abs(a, a)", "too few or too many arguments"),
        ("k*abs", "abs is a function"),
        ("k = a", "one expression"),
        ("k\nk*a", "one expression"),
        ("k" + "*a" * 200, "1 to 300 characters"),
        ("-" * 100 + "k", "too many brackets"),
        ("k*(1 < a < 2)", "two things at a time"),
    ],
)
def test_a_formula_that_cannot_be_fitted_is_refused_with_what_to_write(
    text: str, says: str
) -> None:
    """A usage error before anything is fitted."""
    with pytest.raises(UsageError, match=says):
        FormulaEffect(text, "accelerometer")


@pytest.mark.parametrize(
    "text",
    [
        "k*().__class__.__bases__[0].__subclasses__()",
        "k*__import__('os').getpid()",
        "k*a.tofile('/tmp/x')",
        "k*a[0]",
        "k*open('/etc/passwd')",
        "k*eval('1')",
        "k*'a'*10000000",
        "k*[1]*10000000",
        "k*f'{a}'",
        "k*(lambda x: x)(a)",
        "k*(a if k else w)",
        "k*(a and w)",
        "k*True",
        "k*1j",
        "k*sum(x for x in a)",
        "k*abs(a, out=ax)",
        "k*abs(*a)",
        "(k := a)",
        "k*__builtins__",
        "k @ a",
        "k << 100",
        "k % a",
        "k // a",
    ],
)
def test_only_arithmetic_is_let_through(text: str) -> None:
    """Attributes, indexing, texts, lists, calls of anything else: refused, not evaluated."""
    with pytest.raises(UsageError, match="formula"):
        FormulaEffect(text, "accelerometer")


@pytest.mark.parametrize("text", ["k*9**9**9**9", "k*a**100", "k*2**a", "k*a**(0-9)", "k*8**8.5"])
def test_powers_are_small_numbers(text: str) -> None:
    """Neither memory nor time can be eaten by a tower of powers."""
    with pytest.raises(UsageError, match="a power must be one number from -8 to 8"):
        FormulaEffect(text, "accelerometer")


def test_the_longest_formula_is_evaluated_quickly() -> None:
    """Ten thousand rows, as many functions as fit: well under two seconds."""
    text = "k*(" + "+".join(["exp(-abs(a))"] * 20) + ")"
    typed = FormulaEffect(text, "accelerometer")
    many = session_poses().select(np.arange(10_000) % len(session_poses()))
    begin = time.perf_counter()
    typed.columns("accelerometer", many)
    assert time.perf_counter() - begin < 2.0


def test_the_circumstances_cannot_be_written_to() -> None:
    """Evaluation leaves the data as they were."""
    before = session_poses().force.copy()
    FormulaEffect("k*abs(ax)*sign(ay)*where(az > 0, ax, ay)", "accelerometer")
    np.testing.assert_array_equal(session_poses().force, before)


@given(st.text(alphabet="kaxywTtpvg0123456789.+-*/() <>=,:;_'[]{}#\\\n", max_size=40))
@pytest.mark.filterwarnings("error")
def test_whatever_is_typed_is_an_effect_or_a_usage_error(text: str) -> None:
    """No other error reaches the screen."""
    try:
        typed = FormulaEffect(text, "accelerometer")
    except UsageError:
        return
    assert np.isfinite(typed.columns("accelerometer", session_poses())).all()
