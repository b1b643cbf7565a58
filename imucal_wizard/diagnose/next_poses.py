"""The measurements to take next after each verdict, as requests to the operator.

Requests that separate two explanations are chosen by ``optimal_design``; where the base model
itself is not determined, the pose that adds most information about it comes first.
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from imucal_wizard.core.errors import DataError
from imucal_wizard.core.limits.procedure import ROTATION_RATES
from imucal_wizard.core.poses import (
    AXES,
    CORNERS,
    DIRECTIONS,
    EDGES,
    FACES,
    NAMED,
    POSE_TOLERANCE_DEG,
    START_POSES,
    direction_in_words,
    nearest_pose,
    pose_in_words,
)
from imucal_wizard.core.quantities import fixed, size_with_unit
from imucal_wizard.core.readings import FloatArray, IntArray
from imucal_wizard.core.statistics import median
from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.diagnose.bench import Bench, BenchFindings
from imucal_wizard.diagnose.curve_shape import DECIMALS
from imucal_wizard.diagnose.detectability import USUAL_SIZES
from imucal_wizard.diagnose.diagnosis import Apart, Diagnosis
from imucal_wizard.diagnose.free_curves import shape_of
from imucal_wizard.diagnose.optimal_design import (
    ROTATIONS_PER_AXIS,
    WARMER,
    Explained,
    Patterns,
    beside,
    choose,
    closure_of,
    one_more_hold,
    pose_patterns,
    poses_done,
    rotation_patterns,
)
from imucal_wizard.diagnose.suspects import Suspect
from imucal_wizard.diagnose.verdict import Verdict
from imucal_wizard.measurement.requests import MeasurementRequest
from imucal_wizard.model.effect import ACCELEROMETER, GYROSCOPE, MAGNETOMETER, Circumstances
from imucal_wizard.model.identifiability import design, identifiable
from imucal_wizard.model.rows.table import ResidualTable
from imucal_wizard.model.terms import Term

MIN_GROWTH_PER_POSE = 1.02
MIN_GROWTH_OF_ROTATIONS = 1.0 / 0.9
"""Requests that let the length grow by less are not worth the operator's time."""
MAX_POSES = 12
"""What an operator does in three or four minutes."""
MAX_POSES_WHEN_SETTLED = 6
"""So many poses are proposed where nothing has to be decided."""
MAX_PAIRS = 6
"""Pairs of explanations compared at most."""
MAX_REPEATED_HOLDS = 4
"""Holds or rotations that are measured again where nothing explains what is left: the worst. As
many new directions, where repeats agree."""
DOES_IT_REPEAT = "does this repeat?"
FROM_ANOTHER_SIDE = "reach it from another pose than before: does the reading change?"
NOT_SEEN_YET = "a direction that no hold has seen yet"
POSES_INSIDE_STEEP_PART = 4
"""With ``MIN_HOLDS_INSIDE`` of them inside, one may lie outside."""
MIN_SPARE_DIRECTIONS = 2
"""Directions beyond what determines the model, to leave out one and to contradict the rest."""
MAX_P_WORTH_SEPARATING = 0.05
"""A suspect of this p-value is worth separating from another. A choice: larger, and poses are asked
for because of suspects that noise makes; smaller, and weak effects are not separated."""
ELSEWHERE = "one metre away from the first place, and away from iron"

Requests = tuple[MeasurementRequest, ...]


def request(
    up: FloatArray, why: str, *, brief: str = "", warm: bool = False, axis: str = "", count: int = 0
) -> MeasurementRequest:
    """A request for a pose, or for ``count`` rotations about an axis from it.

    Args:
        up: in the body frame, unit vector.
        why: what it is good for, in words.
        brief: what this one alone is good for, where ``why`` says more.
        warm: with the device warmed up first.
        axis: the body axis to rotate about, or "".
        count: how many rotations.
    """
    x, y, z = (float(one) for one in up)
    return MeasurementRequest((x, y, z), _pose_name(up), why, warm, axis, count, brief)


def _pose_name(up: FloatArray) -> str | None:
    """The name of the pose with this direction up, or None."""
    return nearest_pose(up, DIRECTIONS, POSE_TOLERANCE_DEG)


def _rotations(axes: str, why: str) -> Requests:
    """Rotations about some axes, in both senses at each rate."""
    rates = ", ".join(f"{rate:.0f}" for rate in ROTATION_RATES)
    return tuple(
        request(
            DIRECTIONS[START_POSES[axis]],
            f"with {pose_in_words(START_POSES[axis])}, rotate about {axis} in both senses, each "
            f"slowly, faster and fast ({rates} °/s): {why}",
            brief=f"rotate about {axis} in both senses, each at {rates} °/s",
            axis=axis,
            count=ROTATIONS_PER_AXIS,
        )
        for axis in axes
    )


def circles(why: str, faces: Sequence[str] = tuple(FACES), warm: bool = False) -> Requests:
    """A whole circle about the vertical on each of these faces, for a magnetometer."""
    return tuple(
        request(
            FACES[face],
            f"with {pose_in_words(face)}, a whole circle about the vertical: {why}",
            brief=f"a whole circle about the vertical with {pose_in_words(face)}",
            warm=warm,
            axis=face[1],
            count=1,
        )
        for face in faces
    )


def first_requests(sensor: str) -> Requests:
    """What a sensor needs of which nothing can be determined yet."""
    return {
        ACCELEROMETER: lambda: missing_directions(
            np.zeros((0, 3)), ("bias", "scale", "non-orthogonality")
        ),
        GYROSCOPE: lambda: _rotations("xyz", "the gyroscope needs rotations about every axis"),
        MAGNETOMETER: lambda: circles("the magnetometer needs the field from every direction"),
    }[sensor]()


def next_requests(
    bench: Bench, findings: BenchFindings, verdict: Verdict
) -> tuple[Requests, tuple[Apart, ...]]:
    """What to measure next after a verdict, and the explanations that were compared for it."""
    table = bench.rows
    if not bench.measured.guided:
        return (), ()
    if not bench.measured.at_rest:
        return _next_circles(table, findings, verdict), ()
    if verdict is Verdict.AMBIGUOUS:
        return _separate_explanations(bench, findings)
    if verdict is Verdict.DISTURBED:
        return _repeat_disturbed(table, findings), ()
    if verdict is Verdict.UNEXPLAINED:
        return (*inside_steep_part(bench, findings), *_new_or_again(bench)), ()
    if verdict is Verdict.NOT_REPEATABLE:
        return (*inside_steep_part(bench, findings), *_worst_again(table, FROM_ANOTHER_SIDE)), ()
    if verdict is Verdict.INSUFFICIENT:
        if bench.measured.needs_reference:
            return first_requests(bench.sensor), ()
        return missing_directions(_ups(table)[1], bench.fit.base), ()
    return (), ()


def to_measure(
    diagnosis: Diagnosis, chosen: Suspect | None = None
) -> tuple[Requests, Apart | None]:
    """What to measure next whatever the verdict, and between which two effects that decides.

    What the verdict asks for; where it asks for nothing, what separates the likeliest explanation
    from the one most like it; else more of everything. Nothing of a sensor that waits for another.

    Args:
        diagnosis: of a sensor.
        chosen: the suspect that the user looks at; a disturbed hold is to be repeated.
    """
    bench, findings = diagnosis.bench, diagnosis.findings
    if bench is None or findings is None or diagnosis.verdict is Verdict.WAITING:
        return diagnosis.next_poses, None
    table = bench.rows
    if chosen is not None and chosen.hold is not None:
        accused = replace(findings, opinion=replace(findings.opinion, holds=(chosen.hold,)))
        return next_requests(bench, accused, Verdict.DISTURBED)[0], None
    if diagnosis.next_poses:
        return diagnosis.next_poses, diagnosis.apart[-1] if diagnosis.apart else None
    if not bench.measured.guided:
        return (), None
    if not bench.measured.at_rest:
        return circles("more of them show smaller effects"), None
    inside = inside_steep_part(bench, findings)
    if inside:
        return inside, None
    like = _newest_and_its_like if bench.fit.terms else _likeliest_and_its_like
    pair = like(bench, findings)
    apart = None
    if pair is not None and not diagnosis.base_left_out:
        moving = bool(table.moving.any())
        noise = table.floor[~table.moving]
        requests, apart = _separate(bench, *pair, MAX_POSES_WHEN_SETTLED, noise, rotate=moving)
        if requests:
            return requests, apart
    return _more_of_all(table), apart


def disturbed_parts(
    table: ResidualTable, findings: BenchFindings
) -> tuple[tuple[int, ...], tuple[int, ...], tuple[tuple[float, float], ...]]:
    """Numbers of the holds and rotations, and stretches of time (s), said to be disturbed."""
    holds: list[int] = []
    rotations: list[int] = []
    stretches: list[tuple[float, float]] = []
    for row in map(table.first_row, findings.opinion.holds):
        if table.kind[row] == "field":
            stretches.append((float(table.span[row, 0]), float(table.span[row, 1])))
        elif table.moving[row]:
            rotations.append(int(table.index[row]))
        else:
            source, own = table.source_of(row)
            holds.append(source.item(own))
    return tuple(holds), tuple(rotations), tuple(stretches)


def measured_again(table: ResidualTable, items: Sequence[int]) -> bool:
    """Whether each of these holds has another one in its pose that is not among them.

    Args:
        table: the rows.
        items: the holds, see ``ResidualTable.item``.
    """
    pose, item, still = table.pose, table.item, ~table.moving
    others = {*pose[still & ~np.isin(item, items)].tolist()} - {-1}
    own = [{*pose[still & (item == one)].tolist()} for one in items]
    return bool(own) and all(one & others for one in own)


def _repeat_disturbed(table: ResidualTable, findings: BenchFindings) -> Requests:
    """The direction of the hold, or the rotation, that is called disturbed, once more."""
    holds, rotations, _ = disturbed_parts(table, findings)
    numbers, ups = _ups(table)
    found = []
    still = [one for one in findings.opinion.holds if not table.moving[table.first_row(one)]]
    for hold in () if measured_again(table, still) else holds:
        up = ups[int(np.flatnonzero(numbers == hold)[0])]
        brief = f"another hold there shows whether hold {hold + 1} was disturbed"
        why = f"{_words(up)} again: another hold there shows whether hold {hold + 1} was disturbed"
        found.append(request(up, why, brief=brief))
    found += [
        _rotation_again(table, one, "another rotation shows whether it was disturbed")
        for one in rotations
    ]
    return tuple(found)


def _rotation_again(table: ResidualTable, number: int, why: str) -> MeasurementRequest:
    """A rotation once more, about its main axis, from the pose in which it began."""
    closure = closure_of(table)
    place = int(np.flatnonzero(closure.labels.index == number)[0]) // 2
    first, past = closure.samples.offsets[place : place + 2]
    axis = AXES[int(np.argmax((closure.motion.rate[first:past] ** 2).sum(axis=0)))]
    up = closure.before[place]
    words = f"rotation {number + 1} again, from {_words(up)}, about {axis}: {why}"
    brief = f"rotation {number + 1} once more, about {axis}"
    return request(up, words, brief=brief, axis=axis, count=1)


def _new_or_again(bench: Bench) -> Requests:
    """Corners that were not held, then what the repeats leave to be asked.

    Where enough repeats agree, other directions. Else the holds that fit worst once more; where
    visits are known to differ, from another side. Where rotations fit worse than holds do, the
    worst rotations once more.
    """
    table, repeats = bench.rows, bench.fit.repeatability
    white = (table.residual / table.floor) ** 2
    moving = table.moving & table.judged
    if moving.any() and white[moving].mean() > white[~table.moving].mean():
        numbers = np.unique(table.index[moving])
        size = np.sqrt([white[moving & (table.index == one)].mean() for one in numbers])
        worst = np.argsort(-size, kind="stable")[:MAX_REPEATED_HOLDS]
        return tuple(
            _rotation_again(table, int(numbers[k]), _off_by(size[k], DOES_IT_REPEAT)) for k in worst
        )
    ups = _ups(table)[1]
    new = _corners_not_held(ups, NOT_SEEN_YET)
    if repeats is not None and repeats.agree:
        return (*new, *_between(np.array([*ups, *(one.direction for one in new)])))
    differ = repeats is not None and not repeats.repeatable
    return (*new, *_worst_again(table, FROM_ANOTHER_SIDE if differ else DOES_IT_REPEAT))


def _between(held: FloatArray) -> Requests:
    """Named poses that were not held, each as far as possible from all that were.

    Args:
        held: directions, unit vectors, shape (n, 3).
    """
    seen = {nearest_pose(up, NAMED, POSE_TOLERANCE_DEG) for up in held}
    left = {name: up for name, up in NAMED.items() if name not in seen}
    chosen: list[MeasurementRequest] = []
    while left and len(chosen) < MAX_REPEATED_HOLDS:
        name = min(left, key=lambda one: round(float((held @ left[one]).max()), 6))
        up = left.pop(name)
        words = f"{pose_in_words(name)}: {NOT_SEEN_YET}"
        chosen.append(request(up, words, brief=NOT_SEEN_YET))
        held = np.array([*held, up])
    return tuple(chosen)


def _off_by(size: float, then: str) -> str:
    return f"it was off by {size:.1f} times the noise; {then}"


def _worst_again(table: ResidualTable, then: str) -> Requests:
    """The holds that fit worst once more, with what is asked of them."""
    numbers, ups = _ups(table)
    rest = ~table.moving
    white = (table.residual / table.floor)[rest] ** 2
    size = np.sqrt([white[table.index[rest] == one].mean() for one in numbers])
    chosen: dict[str, MeasurementRequest] = {}
    for place in np.argsort(-size, kind="stable"):
        words = _words(ups[place])
        if len(chosen) < MAX_REPEATED_HOLDS and words not in chosen:
            brief = _off_by(size[place], then)
            chosen[words] = request(ups[place], f"{words} again: {brief}", brief=brief)
    return tuple(chosen.values())


def inside_steep_part(bench: Bench, findings: BenchFindings) -> Requests:
    """Poses or rotations inside the steep part of a free curve whose width nothing shows yet.

    Of a curve of the model, or of the likeliest one that may be added.
    """
    fit, known = bench.fit, {one.name: one for one in bench.curves}
    terms = [term.name for term in fit.terms if term.effect.free]
    terms += [one.term for one in findings.suspects if one.term in known][:1]
    for term in terms:
        shape, curve = shape_of(fit, term, findings.suspects), known[term]
        if shape is None or shape.steep is None or shape.steep.width is not None:
            continue
        low, high = shape.steep.between
        inside = np.linspace(low, high, POSES_INSIDE_STEEP_PART + 2)[1:-1]
        unit = shape.x_unit
        ends = " and ".join(fixed(one, DECIMALS.get(unit, 0)) for one in (low, high))
        why = f"the error of {shape.axis} changes between {ends} {unit}, and its width is not known"
        if shape.against == "rate":
            rates = ", ".join(fixed(one, 0) for one in np.abs(inside))
            how = f"rotate about {shape.axis} in both senses, fastest at {rates} °/s"
            start = START_POSES[shape.axis]
            words = f"with {pose_in_words(start)}, {how}: {why}"
            count = 2 * POSES_INSIDE_STEEP_PART
            up = DIRECTIONS[start]
            return (request(up, words, brief=how, axis=shape.axis, count=count),)
        if shape.against == "force":
            along = curve.axis if curve.felt is None else curve.felt
            share = np.clip(inside * STANDARD_GRAVITY / bench.measured.circumstances.gravity, -1, 1)
            axes = np.eye(3)
            ups = np.outer(share, axes[along])
            ups += np.outer(np.sqrt(1.0 - share**2), axes[(along + 1) % 3])
            letter = AXES[along]
            places = [f"{fixed(one, DECIMALS[unit])} {unit} along {letter}" for one in inside]
            return tuple(
                request(up, f"{_words(up)}, {place}: {why}", brief=f"{place}: {why}")
                for up, place in zip(ups, places, strict=True)
            )
    return ()


def _more_of_all(table: ResidualTable) -> Requests:
    """Where nothing has to be decided: corners not held yet, the first poses again; rotations."""
    if table.moving.any():
        return _rotations("xyz", "more of them show smaller effects")
    ups = _ups(table)[1]
    names = list(dict.fromkeys(name for name in map(_pose_name, ups) if name))
    again = tuple(
        request(
            DIRECTIONS[name],
            f"{pose_in_words(name)} again, to show a drift",
            brief="once more, to show a drift",
        )
        for name in names[:MAX_REPEATED_HOLDS]
    )
    return (*_corners_not_held(ups, "not held in the fit so far"), *again)


def missing_directions(up: FloatArray, base: tuple[str, ...]) -> Requests:
    """Poses until the directions determine the terms of the base, the most informative one first.

    Args:
        up: directions held, unit vectors, shape (n, 3).
        base: terms that are to be determined.
    """
    held = list(up)
    names = [*FACES, *EDGES, *CORNERS]
    found: list[MeasurementRequest] = []

    def information_gain(name: str) -> float:
        """Growth of the information; a faint prior stands for what no direction has shown yet."""
        columns, row = design(np.reshape(held, (-1, 3))), design(DIRECTIONS[name][None])[0]
        information = columns.T @ columns + 1e-3 * np.eye(len(row))
        return round(float(row @ np.linalg.solve(information, row)), 6)

    while len(found) < MAX_POSES and not _determined(np.reshape(held, (-1, 3)), base):
        best = max(names, key=information_gain)
        held.append(DIRECTIONS[best])
        brief = f"needed to determine {', '.join(base)}"
        found.append(request(DIRECTIONS[best], f"{pose_in_words(best)}: {brief}", brief=brief))
    return tuple(found)


def _determined(up: FloatArray, base: tuple[str, ...]) -> bool:
    try:
        found = identifiable(up)
    except DataError:
        return False
    whole = "non-orthogonality" not in base or not found.dropped
    return whole and set(base) <= set(found.terms) and found.spare >= MIN_SPARE_DIRECTIONS


def _corners_not_held(ups: FloatArray, why: str) -> Requests:
    held = {_pose_name(one) for one in ups}
    return tuple(
        request(up, f"{pose_in_words(name)}: {why}", brief=why)
        for name, up in CORNERS.items()
        if name not in held
    )


def _next_circles(table: ResidualTable, findings: BenchFindings, verdict: Verdict) -> Requests:
    """The circles that would help after this verdict, for a magnetometer."""
    if verdict is Verdict.AMBIGUOUS:
        if any("current" in terms for terms in findings.opinion.explanations):
            return circles(
                "once more, half of it with the motors on, to separate a current from slow changes"
            )
        return circles(
            "once more with the device warmer, to separate a drift from temperature", warm=True
        )
    if verdict in (Verdict.UNEXPLAINED, Verdict.NOT_REPEATABLE):
        return circles(f"again, {ELSEWHERE}: an error that stays the same is one of the sensor")
    if verdict is Verdict.DISTURBED:
        # faces on which a circle sees the directions that are accused
        field = table.direction[np.isin(table.item, findings.opinion.holds)]
        near = np.argmax(-field @ np.array(list(FACES.values())).T, axis=1)
        names = list(FACES)
        return circles("once more, to decide", tuple(dict.fromkeys(names[k] for k in near)))
    if verdict is Verdict.INSUFFICIENT:
        return circles("the magnetometer needs the field from every direction")
    return ()


def rivals(findings: BenchFindings) -> tuple[str, ...]:
    """The effects among which these data cannot choose, the likeliest first."""
    for members in findings.opinion.terms:
        if len(members) > 1:
            return members
    found = [term for terms in findings.opinion.explanations for term in terms]
    return tuple(dict.fromkeys(found))


def explanation_of(bench: Bench, findings: BenchFindings, term: str) -> Explained | None:
    """An effect at the size it would have; None for what is no suspect."""
    suspect = next((one for one in findings.suspects if one.term == term), None)
    effect = next((one for one in bench.effects if one.name == term), None)
    if suspect is None or effect is None or suspect.candidate is None or suspect.trial is None:
        return None
    return Explained(effect, suspect.candidate.variant, suspect.trial.size)


def _separate_explanations(
    bench: Bench, findings: BenchFindings
) -> tuple[Requests, tuple[Apart, ...]]:
    """Requests for the likeliest two explanations; where none helps, for the next two."""
    compared: list[Apart] = []
    table = bench.rows
    noise = table.floor[~table.moving] * findings.opinion.noise
    for names in list(combinations(rivals(findings), 2))[:MAX_PAIRS]:
        first, second = (explanation_of(bench, findings, name) for name in names)
        if first is None or second is None:
            continue
        where = bench.measured.circumstances
        shown = (one.effect.columns(bench.sensor, where, one.variant) for one in (first, second))
        rotate = bool(table.moving.any()) and not any(np.nan_to_num(one).any() for one in shown)
        requests, apart = _separate(bench, first, second, MAX_POSES, noise, rotate=rotate)
        compared.append(apart)
        if requests:
            gain = f"; {brings(apart)}"
            return tuple(replace(one, why=one.why + gain) for one in requests), tuple(compared)
    return (), tuple(compared)


def brings(apart: Apart) -> str:
    """What the requests bring, in words."""
    word = "rotations" if apart.turning else "poses"
    count = f"{'both' if apart.poses == 2 else f'all {apart.poses}'} {word} together"
    count = "this pose" if apart.poses == 1 else count
    before, after = (
        size_with_unit(one, apart.unit) if np.isfinite(one) else "no size"
        for one in (apart.before, apart.after)
    )
    return f"{count}: from {after} instead of {before}"


def _separate(
    bench: Bench, first: Explained, second: Explained, most: int, noise: FloatArray, *, rotate: bool
) -> tuple[Requests, Apart]:
    """The requests that separate two explanations, and what they bring.

    Args:
        bench: of one sensor.
        first: the likelier explanation.
        second: the other one.
        most: requests at most.
        noise: of the rows at rest, shape (n,).
        rotate: by rotations; else by poses.
    """
    chosen: Sequence[MeasurementRequest]
    if rotate:
        name = first.effect.parameters(bench.sensor)[int(np.abs(first.size).argmax())].name
        axis = name[:1] if name[:1] in AXES else AXES[0]
        now, more = rotation_patterns(bench.fit, bench.measured.gravity, first, second, axis)
        worth, before, after = choose(now, lambda _: [(axis, more)], 1, MIN_GROWTH_OF_ROTATIONS)
        why = f"separates {first.effect.name} from {second.effect.name}"
        chosen, count = _rotations("".join(worth), why), ROTATIONS_PER_AXIS * len(worth)
    else:
        where, table = bench.measured.circumstances, bench.rows
        radial = "hold" in table.kind
        # the noise of a hold, over the axes where each is a row
        sigma = np.sqrt((noise.reshape(len(where), -1) ** 2).mean(axis=1))
        others = beside(bench.fit, first, second)
        chosen, before, after = separating_poses(
            first, second, where, sigma, most, radial=radial, others=others
        )
        count = len(chosen)
    size = float(np.abs(first.size).max())
    parameters = first.effect.parameters(bench.sensor)
    largest = USUAL_SIZES * max(one.typical for one in parameters)
    # a larger effect is not to be expected: no size would do
    before = before * size if before * size <= max(largest, size) else np.inf
    names = first.effect.name, second.effect.name
    return chosen, Apart(*names, before, after * size, size, parameters[0].unit, count, rotate)


def separating_poses(
    first: Explained,
    second: Explained,
    done: Circumstances,
    sigma: FloatArray,
    most: int = 6,
    *,
    radial: bool = True,
    others: Sequence[Term] = (),
) -> tuple[Requests, float, float]:
    """Poses that separate two explanations of a misfit.

    Args:
        first: the likelier explanation.
        second: the other one.
        done: circumstances of the holds there are.
        sigma: noise of these holds, SI, shape (n,).
        most: how many poses to propose at most.
        radial: a hold shows the error along gravity; else (a gyroscope at rest) of each axis.
        others: effects of the model beside them.

    Returns:
        The poses; the size of the first explanation (in shares of its estimate) needed to
        separate it from the second with the data there are, and with these poses.
    """
    typical = np.array([median(sigma)])

    def patterns(where: Circumstances, noise: FloatArray) -> Patterns:
        return pose_patterns(first, second, where, noise, radial, others)

    def offers(chosen: Sequence[tuple[str, bool]]) -> list[tuple[tuple[str, bool], Patterns]]:
        return [
            ((name, warm), patterns(one_more_hold(done, chosen, name, warm), typical))
            for name in NAMED
            for warm in (False, True)
        ]

    now = poses_done(patterns(done, sigma), radial, others)
    chosen, before, after = choose(now, offers, most, MIN_GROWTH_PER_POSE)
    requests = (_separating_request(name, warm, first, second) for name, warm in chosen)
    return tuple(requests), before, after


def _separating_request(
    name: str, warm: bool, first: Explained, second: Explained
) -> MeasurementRequest:
    warmed = f", the device {WARMER:.0f} °C warmer" if warm else ""
    brief = f"separates {first.effect.name} from {second.effect.name}"
    made = request(NAMED[name], f"{pose_in_words(name)}{warmed}: {brief}", brief=brief, warm=warm)
    return replace(made, pose=name if name in DIRECTIONS else None)


def _ups(table: ResidualTable) -> tuple[IntArray, FloatArray]:
    """Numbers of the holds, and up at each, shapes (n,) and (n, 3)."""
    rest = np.flatnonzero(~table.moving)
    numbers, first = np.unique(table.index[rest], return_index=True)
    return numbers, table.direction[rest[first]]


def _words(up: FloatArray) -> str:
    """A direction in words."""
    name = _pose_name(up)
    return pose_in_words(name) if name else direction_in_words(up)


def _newest_and_its_like(
    bench: Bench, _findings: BenchFindings
) -> tuple[Explained, Explained] | None:
    """The newest effect of the model, and another of its family that is not in it."""
    term, size = bench.fit.terms[-1], bench.fit.sizes[-1]
    where, family = bench.measured.circumstances, term.effect.family
    for other in bench.catalogue:
        if family is None or other.family != family or other.name in bench.fit.model:
            continue
        if bench.lacking(other) is None:
            any_size = np.ones(len(other.parameters(bench.sensor)))
            like = Explained(other, other.variants(where)[0], any_size)
            return Explained(term.effect, term.variant, size), like
    return None


def _likeliest_and_its_like(
    bench: Bench, findings: BenchFindings
) -> tuple[Explained, Explained] | None:
    """The likeliest suspect that looks like another, and that one."""
    for suspect in findings.suspects:
        if suspect.like and suspect.p < MAX_P_WORTH_SEPARATING:
            first = explanation_of(bench, findings, suspect.term)
            second = explanation_of(bench, findings, suspect.like[0])
            if first is not None and second is not None:
                return first, second
    return None
