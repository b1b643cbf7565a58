"""Limits of the guided procedure: patience, holds, rotations, poses, the magnetometer's circles."""

# The preview of a stream
MAX_PREVIEW_GRAVITY_ERROR = 0.15
"""A gravity within 15 % of what it should be is a matter of calibration, not of units."""
MIN_PRINTED_DECIMALS = 3
"""Fewer decimals of m/s² hide the noise."""

# Rest
NOISE_FACTOR = 5.0
"""Limit of rest over the noise. Published recordings need from 1.7 to 11 (3 to 120 times the
variance)."""
MIN_REST_LIMIT_G = 0.003
"""No limit of rest is below 3 mg: a desk on which somebody leans shakes by as much."""
MIN_SWAY_LIMIT_DEG = 0.3
"""The same for the standard deviation of a gyroscope, °/s."""
MIN_RATE_LIMIT_DEG = 0.8
"""The same for its mean rate, °/s: a bias that drifts is not a rotation."""
COARSE_LIMIT_G = 0.02
COARSE_RATE_LIMIT_DEG = 1.0
"""A device that shows more than this, g and °/s, is not lying on anything, whatever its noise."""
HAND_HELD_EXCESS = 10.0
"""A hand moves a device by at most this many times the coarse limits."""

# Settling
JUMP_FACTOR = 4.0
"""A window this many times the typical spread of a rest is a movement."""
MAX_DRIFT_G = 0.003
"""How far a mean may wander during the settling, g."""
CALMER_FACTOR = 3.0
"""A last second this many times calmer than the rest: what went before was not rest yet."""
MIN_SETTLE_WINDOWS = 10
"""Windows before a rest has a typical spread."""
MIN_PROVISIONAL_WINDOWS = 15
"""Windows from which noise is taken when the whole length of rest never comes."""
MAX_UNIT_FACTOR = 1.25
"""Gravity that is off by more than this factor says that the unit is another."""

# Patience with a device that does not come to rest
OFFER_SECONDS = 15.0
"""Time without a hold after which the ways out are offered."""
LOOSEN_SECONDS = 15.0
"""Time after the offer until the limits of rest widen by themselves."""
LOOSEN_FACTOR = 2.0
MAX_LOOSENED = 16.0
"""Limits of rest widen to this many times what the settle step has set."""
RECENT_SECONDS = 5.0
"""Only a device that has been nearly at rest for this long gets wider limits."""
WINDOW_SECONDS = 0.5
"""What a window of stillness reaches back: a rest is known to be one only after that."""

# Holds and the motions between them
MAX_HOLD_SECONDS = 300.0
"""A hold ends after this: it says nothing more, and memory stays flat."""
MAX_MOTION_SECONDS = 60.0
"""A motion longer than this shows a gyroscope's drift and little else."""
MOTION_REACH_BLOCKS = 4
"""Blocks by which a motion reaches into the hold that ends it."""
REQUEST_TOLERANCE_DEG = 8.0
"""How near to a requested direction without a name a hold must be: the poses with names are not
it."""
MIN_WARMING = 5.0
"""°C above the coldest hold from which a device counts as warmed up."""

# Rotations
MAX_AXIS_TILT_DEG = 25.0
"""An axis this far from level still shows its rotations in gravity."""
MIN_ATTEMPT_DEG = 5.0
"""A motion smaller than this was no attempt at a rotation ..."""
MIN_ATTEMPT_RATE = 30.0
"""... unless it was as fast as this on the way, °/s."""
MAX_CIRCLES = 3
"""Whole circles beyond which no hand turns a device between two holds."""
MIN_AXIS_SHARE = 0.75
"""Share of the squared rate that must be about the axis (30° off it)."""
MAX_ANGLE_DISAGREEMENT = 0.25
"""Share of an angle by which gravity and gyroscope may differ before the fit."""
MIN_CONTRADICTION_DEG = 45.0
"""From here on a rotation in gravity is no mere change of place."""
AMBIGUOUS_SENSE_DEG = 120.0
"""From here on gravity may have seen more than half a circle from the other side."""
FAST_RATE = 150.0
SLOW_RATE = 60.0
"""Peak rates, °/s, that count as fast and as slow when advice is given."""
SPEED_RATIO = 1.4
"""Peak rates that differ by this factor are different speeds."""
SPEEDS_WANTED = 3
"""Different speeds about each axis: slow, medium, fast."""
USUAL_RANGE = 250.0
"""The smallest full scale that is usual, °/s: below it no gyroscope clips."""
NEAR_RANGE_SHARE = 0.9
"""Share of the full scale from which a rotation is about to be clipped."""
FULL_ANGLE_DEG = 170.0
"""An angle that fills the gauge of a rotation."""

# A rotation as the accelerometer alone sees it
MAX_PATH_TILT_DEG = 35.0
"""Along its way the axis may be so far from level; a hand's own acceleration is part of it."""
MIN_GRAVITY_SHARE = 0.8
"""Share of the samples that must show gravity, and a level axis."""
END_SAMPLES = 5
"""Samples averaged at either end, where the device rests."""

# Magnetometer: faces and circles
FACE_NEAR_DEG = 25.0
"""A face lies on the table when it points down within this."""
FACE_STAYS_DEG = 35.0
"""It does so until it points elsewhere by more."""
FACE_STEADY_SECONDS = 1.0
"""Time after which a face is there to stay: in a tumble every face passes by."""
FULL_CIRCLE_DEG = 350.0
"""From here on a circle is a whole one."""
SECTOR_DEG = 5.0
"""A circle is complete when hardly a sector of it is missing."""
MIN_CIRCLE_RADIUS = 6.0
"""Radius of a circle over the noise of a reading, from which its angle can be told."""
SLIGHT_DEG = 30.0
"""Nobody means so little of a circle when taking something back ..."""
SLIGHT_SECONDS = 2.0
"""... or so little of a tumble."""
PROGRESS_DEG = 30.0
"""So much of a circle is progress."""
FIELD_PATIENCE = 20.0
"""Time without progress after which the way on is offered, s."""
FIELD_UPDATE_SECONDS = 0.2
"""Time between two looks at all samples of the field."""

# Magnetometer: samples
MAX_FIELD_READING = 1e15
"""No magnetometer reads more, in whatever unit."""
STIR_SHARE = 0.1
"""Share of the field by which the readings of a second differ when the device turns."""
STIR_SECONDS = 1.0
"""Time of readings in which a rotation shows."""
MAX_LYING_SECONDS = 5.0
"""Rest from which more of it says nothing new: a device that lies for an hour would drown the
circles in samples of one direction."""
MAX_BLOCK_GAP = 1.0
"""Blocks farther apart than this, s, are not of one stretch."""
MIDDLE_SAMPLES = 3
"""Samples from the middle of a block whose mean is judged: more would cut a corner in a
rotation."""
MAX_SAMPLES_PER_AREA = 15
"""Samples kept of one area of the sphere; where more come, some between them are dropped."""

# Magnetometer: what can be told
MAX_SHOWN_DOUBT = 0.3
"""Doubt somewhere on the sphere, as a share of the field, above which no figure is shown."""
MAX_JUDGED_DOUBT = 0.05
"""Doubt below which size and shape of the field are judged."""
MAX_ACCEPTED_DOUBT = 0.02
"""Doubt anywhere on the sphere with which the step is done."""
BLOCKS_BESIDE = 5
"""Doubtful blocks beside a disturbed one that are left out with it, to either side."""
MIN_DISTURBANCE = 0.03
"""Share of the field below which nothing is called disturbed while it happens."""
DISTURBANCE_QUIET_SECONDS = 0.4
"""Time without a disturbance after which it is over: a loudspeaker has pauses."""
LASTING_SECONDS = 10.0
"""Disturbance after which it will not pass by itself."""
SILENT_SECONDS = 2.0
"""Time without a sample after which the sensor is missed."""
RESTING_SECONDS = 8.0
"""Rest after which the hand is reminded to turn."""
FACE_GAIN_SHARE = 0.7
"""A face that fills so much of what the best would fill may be the next one, if it is nearer."""
