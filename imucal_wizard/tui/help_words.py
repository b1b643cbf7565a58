"""What each step wants, in plain words."""

_SENSES = (
    "To the left is counter-clockwise, to the right is clockwise, as you see it when the axis "
    "that is named points at you."
)
WORDS: dict[str, tuple[str, ...]] = {
    "source": (
        (
            "Choose where the samples come from: a port, the virtual IMU (a sensor "
            "that exists only in this program, to practise on), a recording, or an earlier session."
        ),
        (
            "The preview shows what arrives. When the device lies still, the size of gravity "
            "should be near 9.81 m/s², 1 g or 1000 mg; then the unit is right. The gyroscope's "
            "unit cannot be seen at rest; if it is not known you are asked for it."
        ),
    ),
    "columns": (
        (
            "Say what each number of the newest line is: ax, ay, az are needed, gx, gy, gz for "
            "the gyroscope, mx, my, mz for the magnetometer; what means nothing here is 'not "
            "used'. Turn the device and watch which number follows gravity."
        ),
        (
            "Units: at rest the size of the acceleration is 9.81 m/s², 1 g or 1000 mg; whole "
            "numbers in the hundreds or thousands are counts. The turn rate's unit is in the "
            "sketch or the data sheet. The Earth's field is 22 to 67 µT, but iron on the board "
            "adds its own: where it looks wrong here, look at the sketch."
        ),
    ),
    "settle": (
        (
            "Lay the device down on something that does not shake and take your hands off. The "
            "program measures how much every axis trembles by itself; from that it knows later "
            "what still means. If it never gets still: the table shakes, or a cable pulls."
        ),
    ),
    "up-down": (
        (
            "Put each of the six faces up once, in any order. Hold the device against something "
            "solid until the bar is full; you hear two quick bells. No exact alignment is needed: "
            "20° off is fine. The table shows the first estimate of bias and sensitivity."
        ),
        _SENSES,
    ),
    "poses": (
        (
            "Now the poses: the six faces again, the twelve edges (the device leans at 45°, for "
            "instance on a wedge or against a book). Any pose that is still missing counts, "
            "whichever is asked for. Lean it on something: a hand alone is rarely still enough."
        ),
        "● taken   ◎ asked for next   · missing   [brackets] where the device is now",
        _SENSES,
    ),
    "rotations": (
        (
            "Hold still, turn the device about the axis that is named, stop, hold still again. Any "
            "angle up to 170° will do, and it need not be exact. Turn both ways, at several "
            "speeds, but not so fast that the gyroscope reaches the end of its range."
        ),
        _SENSES,
    ),
    "field": (
        (
            "Lay the face that is named on the table and turn the device once round on it, slowly "
            "(ten seconds and more); then the next face. Or tumble it freely about every axis. "
            "Keep it in one place, an arm's length from computers, phones, steel legs of tables."
        ),
        (
            "The sphere shows in which directions, seen from the device, the field has been. "
            "█ covered   ▒ thin   · gap   ◆ now. To the left it is seen from +z, to the right from "
            "−z. What is a gap stays unknown: the error there would be guessed."
        ),
        (
            "gaps: share of the sphere that no sample is near; six circles are enough whatever it "
            "is, a tumble once it is small. variance: spread of the field's size after correction. "
            "wobble: how far the middle of the samples is off. fit error: what the model does not "
            "explain. Iron that passes disturbs: its samples are left out."
        ),
    ),
    "result": (
        (
            "Before, after, held out: the error without calibration, with it on the data it was "
            "made from, and with it on directions it had not seen. The last is the honest one. "
            "The plot shows what is left of each hold; the band is what noise alone makes."
        ),
        (
            "|a| is the size of the acceleration at rest, which should be gravity. Closure: the "
            "gyroscope carries gravity's direction through a turn; the angle by which it misses "
            "the direction measured afterwards. |m| is the size of the magnetic field, which "
            "should be the same in all directions; hard iron shifts it, soft iron bends it."
        ),
        "v measures a few new orientations, s saves at once, t shows every parameter.",
        "f opens the bench: it shows what the model does not explain, and which effect would.",
        "h shows north: the heading, live, before and after. c: all methods side by side.",
    ),
    "heading": (
        (
            "Heading: where the x axis points, in degrees clockwise from magnetic north, with the "
            "tilt taken out by gravity. To the left by the readings as they come, to the right by "
            "the calibration; ± is what is not known of the calibration, one standard deviation."
        ),
        (
            "Turn the device on the spot: after calibration a quarter turn is 90°. A field or a "
            "dip that is not that of the calibration means iron nearby, or that it is being moved "
            "(gravity is felt truly only at rest). Geographic north is the declination away."
        ),
    ),
    "methods": (
        (
            "The methods of Qureshi and Golnaraghi (Q), of Niespodziany (N) and our own, on the "
            "same holds, rotations and samples. Held out is what to compare: the error on "
            "directions or rotations that the method had not seen."
        ),
        (
            "Relative is N's figure of merit, the error of the magnitude as a share of it. "
            "M and b off by say how far a method's matrix and bias are from the first one's; where "
            "that is less than what the parameters are known to, the methods agree."
        ),
    ),
    "more": (
        (
            "The bench has asked for these poses: they tell apart what the data so far cannot. "
            "Hold each as before, in any order; then make the turns it asks for. After the last "
            "one everything is fitted again and the bench opens with your model, on all the data."
        ),
        "s goes back to the bench with what there is. ● taken   ◎ asked for next   · missing",
        _SENSES,
    ),
    "validate": (
        (
            "A few new orientations that the fit has not seen. What is left of the error "
            "there is what to expect in use. Hold the device still in each, as before."
        ),
    ),
    "parameters": (
        (
            "bias: the reading when there is nothing to measure. sensitivity: reading per input; "
            "the correction is its reciprocal. theta: how far two axes are from a right angle. "
            "cross: the part of a turn about the second axis that shows up about the first."
        ),
        (
            "±: one standard error from what is left over by the fit; in brackets from repeated "
            "poses alone. Not carried: these data say nothing of it; it stays at its nominal value."
        ),
    ),
    "save": (
        "The calibration is on disk. The place is shown; q leaves.",
        "t shows every parameter.",
        "f opens the bench: it shows what the model does not explain, and which effect would.",
        "h shows north: the heading, live, before and after. c: all methods side by side.",
    ),
}
