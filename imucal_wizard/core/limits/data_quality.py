"""Limits of the data-quality checks: one set for streams and recordings."""

from imucal_wizard.core.units import STANDARD_GRAVITY

MIN_CHECKED_SAMPLES = 50
"""Fewer samples say nothing about the device."""
MAX_REPEATED_SHARE = 0.2
"""Share of samples equal to the previous one; above it, the device prints faster than it
measures."""
MAX_COPIED = 4
"""Equal samples in a row that may be copies of one; a longer run is a rest without noise."""
MIN_COPIES, MIN_COPIES_RATIO = 5, 10.0
"""Samples equal to the previous one on all axes that are no chance: so many, and so many times what
chance makes of them, since noise is not the same throughout a block."""
MAX_REST_STEPS = 1.5
"""Change in steps of the readings, up to which a resting sensor makes it whose noise is below its
step."""
MAX_IDLE_VALUES = 5
"""Different values on each axis of a sensor; with more on one of them, the sensor measures."""
MAX_ZERO_RATE_SHARE = 0.3
"""Share of samples with a rate of exactly zero on all axes; above it, zero is no coincidence."""
MAX_FORCE_STEP = 0.004
"""m/s²; coarser steps hide the noise of a consumer accelerometer unless its noise exceeds them."""
MAX_RATE_STEP = 0.002
"""rad/s; the same for a gyroscope."""
MAX_UNDITHERED_STEPS = 2.0
"""Ratio of step to noise; below it, noise dithers the steps away in the mean of a hold."""

MIN_PLATEAU = 4
"""Consecutive equal samples at the extreme of a motion that indicate clipping, if entered by a
jump."""
MIN_PLATEAU_JUMP = 5.0
"""Jump into the plateau, in resolution steps; a smooth peak is entered by smaller steps."""
MIN_LONG_PLATEAU, MIN_LONG_PLATEAU_JUMP = 8, 3.0
"""The same for longer plateaus: noise would have changed so many samples, and a smooth peak this
flat changes by a single step."""
MIN_FLAT_ENDS, MAX_RANGE_DIFFERENCE = 2, 0.05
"""Extremes of the six of a sensor that must be flat, and their relative difference: one range holds
for all axes and both senses, apart from the bias."""
NEAR_TOP, PLATEAU_BAND = 0.9, 0.015
"""Share of the extreme rate above which a sample is near it, and half the relative width of a
plateau: several times the noise of a gyroscope at rates of use."""
MIN_FLAT_SHARE = 0.7
"""Share of the samples near the extreme that lie in that band; a smooth turn has a third there."""
MIN_SHORTFALL, MIN_UNKNOWN_SHORTFALL = 0.02, 0.12
"""Part of the angle that is lost at the end of the range: against the same gyroscope's slower
rotations, and where there are none (no sensor's scale is wrong by as much)."""
MIN_SLOW_MOTIONS = 3
"""Slower motions that determine the gyroscope's scale."""
MAX_STEADY_SHARE = 0.6
"""Share of a rotation's angle at its largest rate; a hand that clips as much loses 14 % of it, a
turntable nothing."""
MIN_PLATEAU_RATIO = 3.0
"""Ratio of the longest plateau at the extreme to the longest elsewhere: coarse readings form
plateaus in every position of rest."""
MIN_FORCE_RANGE = 1.7 * STANDARD_GRAVITY
"""m/s²; the smallest common accelerometer range is ±2 g. Two seconds at rest end below it."""
MIN_RATE_RANGE = 2.0
"""rad/s; the smallest common gyroscope range is ±125 °/s (2.18 rad/s)."""
MIN_COUNT_SPAN = 1000.0
"""Span in counts above which the extreme value of an axis can be the end of its range."""
MIN_FULL_SCALE_SHARE = 0.995
"""Share of a known full scale above which a reading is clipped."""
COUNT_ENDS = (32767.0, -32768.0, 65535.0)
"""End values of 16-bit converters."""

MIN_GRAVITY = 2.0
"""m/s²; a smaller reading at rest is not gravity in any confused unit."""
MAX_REST_VARIATION = 0.03
"""Relative variation of the magnitude of gravity while the device lies still."""
MAX_GRAVITY_ERROR = 0.2
"""Relative error of gravity that no sensor exceeds if its unit is right."""
GRAVITY_BLOCK_SECONDS = 0.5
"""Length of the blocks in which gravity is measured, s."""

MIN_DATE_SECONDS = 1e8
"""Times from here on count from a date (1970): no device has been running for three years."""
RESTART_GAP_SECONDS = 1.0000175
"""Gap inserted between two segments whose true distance in time is unknown; no hold spans it. Its
length marks it: clocks that count in milliseconds or microseconds have no gap of this length."""
RESTART_GAP_TOLERANCE = 2.5e-7
"""Seconds: rounding of times that count from a date, and less than half a microsecond."""
MAX_STEP_RATIO = 1.75
"""Sampling intervals; after a longer step, a sample is missing."""
MIN_MISSING_STEP = 1.5
"""Sampling intervals of a long step less what its neighbours are too short: one where a time is
wrong, two or more where a sample is missing."""
MIN_MISSING_SHARE = 0.2
"""Share of the long steps in which a sample is missing; below it, they are those of late times."""
MAX_JITTER_SHARE = 0.05
"""Share of long steps; above it, uneven steps are jitter of the clock and not lost samples."""
MAX_UNEVEN_PART, MAX_BURST_RATIO = 0.1, 5.0
"""Long steps that are not a whole number of intervals, or longer than this many intervals, are
pauses between bursts."""

MIN_PAUSES, MAX_PAUSE_SHARE = 3, 0.5
"""Pauses of that many intervals, and their share of the time, above which the samples arrived in
bursts: a single pause is a gap, and a sensor does not pause for most of the time."""

GAP_REACH_SECONDS = 0.25
"""Time to either side of a gap in which rates change as they do in it: a hand turns a device for a
second or more, and trembles several times in this time."""
MIN_PLACES_AROUND_GAP = 8
"""Places there at which the same number of samples is left out, for a variance known to a half."""
MAX_GAP_VARIANCE = 1.0
"""What a gap adds to the variance of a rotation's angle, over that by the noise of the rates, up to
which the rotation counts, with that much more noise: as much as a rotation that lasts twice as
long."""

USUAL_SAMPLING_RATES = 5.0, 20_000.0
"""Hz; devices that record a motion sample no slower and no faster."""

MIN_POSITION_RATIO = 20.0
"""Ratio of the variation between rests to the noise, above which a sensor responds to its
orientation."""
MAX_GRAVITY_SPREAD = 0.25
"""Relative spread of the magnitude of gravity over all orientations, including bias and scale
errors."""
MIN_RESTS = 20
"""Blocks at rest needed to decide which sensor responds to gravity."""
MAX_QUIET_RATIO = 3.0
"""Blocks with less noise than this many times that of the quietest tenth are at rest."""
MAX_REMOVED_GRAVITY = 0.3
"""Share of gravity; below it, the device has removed gravity."""

MIN_FLICKER_STEPS = 0.5
"""Noise in resolution steps from which a reading changes all the time; one that does not is at the
end of its range or repeated."""
SILENT_VARIANCE_SHARE = 1e-6
"""Ratio of the variance of a clipped axis to its variance in other holds."""
MAX_CLIPPED_SHARE = 0.01
"""Share of a hold's samples at the end of the range up to which its mean is right: clipping of one
sample in a hundred moves it by 0.3 % of the noise of a sample."""
MIN_SILENT_HOLDS = 2
"""Holds that must show the same reading without noise; a single one may have been a stuck
sensor."""

MIN_FIELD_SAMPLES = 60
"""Magnetometer samples with which a fit is tried: ten in each of six directions."""
