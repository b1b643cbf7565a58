"""Limits of the guided procedure: patience, holds, rotations, poses, the magnetometer's circles."""

from imucal_wizard.core.limits.stillness import BLOCK_SECONDS, WINDOW_BLOCKS

# The preview of a stream
MAX_PREVIEW_GRAVITY_ERROR = 0.15
"""A deviation of gravity up to 15 % is an error of calibration, not of the unit."""
MIN_PRINTED_DECIMALS = 3
"""Fewer decimals in m/s² hide the noise."""

# Rest
NOISE_FACTOR = 5.0
"""Ratio of the limit of rest to the noise. Published recordings need 1.7 to 11 (3 to 120 times the
variance)."""
MIN_REST_LIMIT_G = 0.003
"""g; the smallest limit of rest: a desk on which somebody leans shakes by this much."""
MIN_SWAY_LIMIT_DEG = 0.3
"""°/s; the smallest limit of a gyroscope's standard deviation."""
COARSE_LIMIT_G = 0.02
COARSE_RATE_LIMIT_DEG = 1.0
"""g and °/s; a device that moves more than this does not rest, whatever its noise."""
HAND_HELD_EXCESS = 10.0
"""A hand-held device moves by at most this many times the coarse limits."""

# Settling
JUMP_FACTOR = 4.0
"""Ratio of a window's standard deviation to that of the rest, above which it is a movement."""
MAX_DRIFT_G = 0.003
"""Largest drift of the mean while the device settles, g."""
CALMER_FACTOR = 3.0
"""If the last second is calmer by this factor, the device was not yet at rest before it."""
MIN_SETTLE_WINDOWS = 10
"""Windows needed for the typical standard deviation of a rest."""
MIN_PROVISIONAL_WINDOWS = 15
"""Windows from which the noise is taken provisionally if no rest is long enough."""
MAX_UNIT_FACTOR = 1.25
"""If gravity is wrong by more than this factor, the unit is wrong."""

# Patience with a device that does not come to rest
OFFER_SECONDS = 15.0
"""Time without a hold after which the alternatives are offered, s."""
LOOSEN_SECONDS = 15.0
"""Time after the offer until the limits of rest are widened automatically, s."""
LOOSEN_FACTOR = 2.0
"""Factor by which the limits of rest are widened each time."""
MAX_LOOSENED = 16.0
"""Limits of rest are widened to at most this many times their value after the settle step."""
RECENT_SECONDS = 5.0
"""The limits are widened only if the device has been nearly at rest for this long, s."""
WINDOW_SECONDS = WINDOW_BLOCKS * BLOCK_SECONDS
"""Length of the window over which stillness is decided, s."""

# Holds and the motions between them
MAX_HOLD_SECONDS = 300.0
"""A hold ends after this time, s: more samples add no information, and memory stays bounded."""
MAX_MOTION_SECONDS = 60.0
"""s; a longer motion mainly shows the drift of the gyroscope."""
MOTION_REACH_BLOCKS = 4
"""Blocks by which a motion extends into the hold that ends it."""
REQUEST_TOLERANCE_DEG = 8.0
"""Tolerance of a requested direction that is not a named pose; it excludes the named poses."""
MIN_WARMING = 5.0
"""°C above the coldest hold at which a device counts as warmed up."""

# Rotations
MAX_AXIS_TILT_DEG = 25.0
"""Gravity still shows the rotation about an axis that is off level by this angle."""
MIN_ATTEMPT_DEG = 5.0
"""A smaller motion was no attempt at a rotation ..."""
MIN_ATTEMPT_RATE = 30.0
"""... unless its peak rate reached this, °/s."""
MAX_CIRCLES = 3
"""Full turns that no hand exceeds between two holds."""
MIN_AXIS_SHARE = 0.75
"""Share of the squared rate that must lie on the axis (30° off it)."""
MAX_ANGLE_DISAGREEMENT = 0.25
"""Share of an angle by which gravity and gyroscope may differ before the fit."""
MIN_CONTRADICTION_DEG = 45.0
"""Above this angle, a rotation shown by gravity is more than a change of place."""
AMBIGUOUS_SENSE_DEG = 120.0
"""Above this angle, gravity may show the rotation with the opposite sense."""
ROTATION_RATES = (50.0, 120.0, 220.0)
"""Peak rates of the rotations that are asked for, °/s: slow, medium, fast. An error that grows with
the rate shows in the difference between them, and the smallest usual range ends at 250."""
FAST_RATE = 150.0
SLOW_RATE = 60.0
"""Peak rates, °/s, from which a rotation is called fast, and up to which slow."""
SPEED_RATIO = 1.4
"""Peak rates that differ by this factor count as different speeds."""
SPEEDS_WANTED = 3
"""Different speeds about each axis: slow, medium, fast."""
USUAL_RANGE = 250.0
"""The smallest common full scale, °/s; below it no gyroscope clips."""
NEAR_RANGE_SHARE = 0.9
"""Share of the full scale above which a rotation is close to clipping."""
FULL_ANGLE_DEG = 170.0
"""Angle at which the gauge of a rotation is full: a larger one needs a second grip."""

# A rotation seen by the accelerometer alone
MAX_PATH_TILT_DEG = 35.0
"""Deviation of the axis from level during the motion; the acceleration of the hand is part of
it."""
MIN_GRAVITY_SHARE = 0.8
"""Share of the samples that must show gravity and a level axis."""
END_SAMPLES = 5
"""Samples averaged at each end, where the device is at rest."""

# Magnetometer: faces and circles
FACE_NEAR_DEG = 25.0
"""A face counts as down if it points down within this angle ..."""
FACE_STAYS_DEG = 35.0
"""... until it points elsewhere by more than this."""
FACE_STEADY_SECONDS = 1.0
"""Time after which a face counts as down: while tumbling, every face passes by."""
FULL_CIRCLE_DEG = 350.0
"""Angle from which a circle is complete."""
SECTOR_DEG = 5.0
"""Width of the sectors by which the completeness of a circle is counted."""
MIN_CIRCLE_RADIUS = 6.0
"""Ratio of the radius of a circle to the noise of a reading, needed to measure its angle."""
SLIGHT_DEG = 30.0
"""An undo does not refer to less of a circle than this ..."""
SLIGHT_SECONDS = 2.0
"""... or to a shorter tumble."""
PROGRESS_DEG = 30.0
"""Angle of a circle that counts as progress."""
FIELD_PATIENCE = 20.0
"""Time without progress after which continuing is offered, s."""
FIELD_UPDATE_SECONDS = 0.2
"""Time between two evaluations of all field samples, s."""

# Magnetometer: samples
STIR_SHARE = 0.1
"""Relative change of the readings within a second while the device turns."""
STIR_SECONDS = 1.0
"""Time within which a rotation is visible in the readings, s."""
MAX_LYING_SECONDS = 5.0
"""Rest beyond which samples add no information, s: a device lying for an hour would outweigh the
circles with samples of one direction."""
MAX_BLOCK_GAP = 1.0
"""Blocks farther apart than this belong to different stretches, s."""
MIDDLE_SAMPLES = 3
"""Samples in the middle of a block whose mean is judged; more would cut corners during a
rotation."""
MAX_SAMPLES_PER_AREA = 15
"""Samples kept per area of the sphere; further ones are thinned."""

# Magnetometer: judgement
MAX_SHOWN_DOUBT = 0.3
"""Largest standard error on the sphere, as a share of the field, at which figures are shown."""
MAX_JUDGED_DOUBT = 0.05
"""Largest standard error at which magnitude and shape of the field are judged."""
MAX_ACCEPTED_DOUBT = 0.02
"""Largest standard error anywhere on the sphere at which the step is complete."""
BLOCKS_BESIDE = 5
"""Doubtful blocks on each side of a disturbed one that are left out with it."""
MIN_DISTURBANCE = 0.03
"""Smallest relative deviation of the field that is reported as a disturbance while measuring."""
DISTURBANCE_QUIET_SECONDS = 0.4
"""Time without a deviation after which a disturbance is over, s: a loudspeaker pauses."""
LASTING_SECONDS = 10.0
"""Duration after which a disturbance is considered permanent, s."""
SILENT_SECONDS = 2.0
"""Time without a sample after which the sensor is reported as silent, s."""
RESTING_SECONDS = 8.0
"""Rest after which the operator is reminded to turn the device, s."""
FACE_GAIN_SHARE = 0.7
"""Gain of a nearer face, as a share of the best face's gain, at which it is proposed instead."""
