"""Limits of rest, holds and rotations: the same for streams and recordings."""

BLOCK_SECONDS = 0.1
"""Length of the blocks on which stillness is decided, s: much longer than a sample, much shorter
than the half second in which a hand comes to rest."""
MIN_BLOCK_SAMPLES = 4
"""Fewer samples give no useful variance; slow devices get longer blocks."""
WINDOW_BLOCKS = 5
"""Blocks in a window (half a second), over which the standard deviation is taken."""
TIME_TOLERANCE = 1e-6
"""Seconds by which sums of block lengths may deviate from a whole number."""

USUAL_REST_SECONDS = 2.0
"""Rest in each position that the user is asked for."""
MIN_USUAL_RATE = (WINDOW_BLOCKS + 1) * MIN_BLOCK_SAMPLES / USUAL_REST_SECONDS
"""Hz; at fewer samples per second a hold needs a longer rest."""
MIN_HOLD_SECONDS = 1.0
"""Shorter rests in a recording are as often a slow moment of a rotation as a hold."""
REST_FACTOR = 3.5
"""Standard deviation of a window over that usual in its rest, above which the rest ends: the noise
of half a second scatters by a third of itself at the lowest rates, a motion exceeds ten times."""
MIN_SHAKEN = 2.0
"""Vibration of a hold, as a variance, over that of most, from which on its support vibrates: that
of half a second of noise is known to a fifth at the lowest rates."""
HISTORY_BLOCKS = 50
"""Blocks that a stream keeps before a rest is found (five seconds): with strict limits the rest
began before its windows met them."""
GUARD_BLOCKS = 1
"""Blocks dropped at each end of a hold, where the device may already move."""
NOISE_FREQUENCIES = 2
"""Whole cycles in a hold, from one up, at which the noise of its mean is measured: few, because
slow noise is larger at lower frequencies."""
SHORTEST_AVERAGE = 0.6
"""Seconds of the shortest part of a hold that is compared with its neighbour: a filter in the
sensor with a corner of 5 Hz lessens the Allan variance of such parts by 8 %, of shorter ones by
more."""
MIN_LONG_HOLD = 12.0
"""Seconds of a hold that shows slow noise by such parts: they then lie apart by more than a decade
of time, so that noise which rises as flicker noise does is told from noise that rises otherwise."""
MAX_SETTLING_SIGMA = 4.0
"""Distance of a block's mean from the middle of its hold, in standard deviations; beyond it the
device still moves."""
MAX_TRIMMED_BLOCKS = 10
"""Blocks trimmed at each end of a hold (one second); longer motion is not an end effect."""
MIN_BLOCKS_TO_TRIM = 8
"""Blocks needed to compare the ends of a hold with its middle."""

SETTLING_SECONDS = 4.0
"""Seconds at the beginning of a hold in which its reading may still settle; later, it drifts."""
SETTLING_TIMES = (1.0, 1.5, 2.2, 3.2, 4.5, 6.5, 9.0)
"""Time constants of settling that are tried, in blocks: neighbours differ by less than a half."""
FINER_TIMES = (0.8, 0.85, 0.9, 0.95, 1.0, 1.05, 1.1, 1.15, 1.2)
"""Multiples of the best of them that are tried next."""
MIN_SETTLING = 25.0
"""χ² with one amplitude per axis from which on a hold settles: noise exceeds it in one of some
thousand holds, the choice of a time constant included."""
MIN_SETTLING_AXIS = 9.0
"""χ² of one axis from which on it settles with the others."""
TAIL_DOUBT = 0.2
"""Share of the rest of the settling that is not known after its removal: settling is only nearly
exponential."""
LONGER_PIECE = 1.4
"""Length of each piece of a rest whose mean is kept over that of the one before: settling becomes
slower. The first is one block."""
MAX_SLOW_TO_FAST = 3.0
"""Slow variance of a hold (between its blocks) over its fast variance (within them), above which it
is a slow motion: noise makes at most a quarter, a tremor above 3 Hz at most 2, a motion that lasts
longer than a second more than 20."""
MIN_SWAY = 0.015
"""Slow standard deviation of a hold, in units of gravity, below which it is not judged. The mean of
a direction that sways by s is shorter than gravity by s²/2: here by 0.11 mg, the noise of the mean
of a good sensor (0.1 mg/√Hz, half a second). A turn at 5 °/s reaches it within 0.6 s (ωT/√12)."""
MIN_SLOW_MOMENT = 0.005
"""The same above which a hold of a stream must be clearly slower than the motion before it: a hand
that holds a device freely sways by 0.3°, the slow moments of a waved one last seconds and turn by
0.5° to 2°."""
STEADY_SIGMA = 3.0
"""Standard deviations by which the means of a vibrating hold's blocks may scatter beyond what its
samples make of them."""
MAX_SWAY = 0.035
"""The same above which a hold is a slow motion, whatever its noise: its mean is 0.6 mg short, which
no repetition shows."""

ONE_POSITION = 0.05
"""Half the range of the liveliest axis over the magnitude of the readings, below which the device
stayed in one position: it leaned by less than 3°."""
ONE_POSITION_NOISE = 10.0
"""Half that range over the noise, below which counts are those of one position. Their zero may be
anywhere: a ±16 g sensor with a voltage output reads 26 g on each axis when nothing acts on it.
Noise alone makes 4 at most, six faces at least 10 if one gravity is three counts or more."""
MIN_SPEED_RATIO = 8.0
"""Rms rate of gravity's direction between the holds over that within them. A hand that turns a
device from pose to pose at 30 °/s and holds it freely reaches 12, a table hundreds; the slowest
moments of a device that is never put down reach 7."""
MIN_SELECTED_RATIO = 2.0
"""The same over what selecting slow moments makes: rates with two normal components have, in their
calmest share p, √(p/2) of their rms."""

QUIET_BLOCKS = 20
"""Blocks in the quietest two seconds of a recording, which give its noise."""
MIN_SHARE_OF_POSITIONS = 0.5
"""Positions in which a gyroscope reads the mean of a quiet stretch, as a share of the most that any
has, for it to be at rest: the rate of a turn about the vertical is found in one position, and by
chance in a few in which the device moves; the bias in all."""
MIN_RESTING_POSITIONS = 6
"""Positions that the rate of rest must have for another one to be called a turn: as many as a
calibration needs. A bias that drifts by several °/s in a minute is the same in two or three."""
OTHER_POSITION = 0.5
"""Distance of two mean readings of the accelerometer, in units of gravity, above which they are of
different positions: 29°."""
MAX_QUIET_STRETCHES = 100
"""Stretches of two seconds, the quietest first, among which the one at rest is looked for: six
circles of ten seconds about the vertical have thirty."""
CALM_FACTOR = 2.0
"""Standard deviations of that noise within which a stretch is calm and continues the course of the
resting rate, which the mean of two seconds gives to a tenth of it."""
COURSE_STRETCHES = 10
"""Calm stretches (twenty seconds or more) whose course goes on, for at most as long again."""
VARIANCE_FACTORS = (2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192, 256)
"""Limits tried on a recording, as multiples of its quietest variance; beyond the last one, they
double."""
MAX_FORCE_LIMIT = 0.05
"""Loosest limit of the accelerometer's standard deviation, in units of gravity: 50 mg, a strong
tremor."""
MAX_VIBRATION = 0.3
"""Standard deviation of the accelerometer on a vibrating support, in units of gravity, up to which
there are holds: beside gravity, three of them reach the end of a range of ±2 g."""
MAX_RATE_LIMIT = 0.2
"""Loosest limit of the gyroscope's standard deviation, as a share of that of the liveliest
windows."""
LIVELY_SHARE = 0.95
"""Share of the windows that are calmer than what counts as the liveliest; single jerks are
excluded."""

MIN_RATE_LIMIT_DEG = 0.8
"""°/s; the smallest limit of a gyroscope's mean rate at rest: a bias that drifts or follows the
force (0.1 °/s per g is usual) is not a rotation."""
MIN_TURN_DEG = 5.0
"""°/s by which the mean rate of a hold differs from that of those beside it if it is a turn: a hand
that sways turns by 1 °/s in the mean of two seconds ..."""
TURNING_SIGMAS = 6.0
"""... and in standard errors."""
HOLDS_BESIDE = 4
"""Holds to either side whose median is that of rest; a bias drifts little meanwhile."""
MAX_TILT_OF_TURN = 0.1
"""Share of a rate that sensors before their calibration may show across the axis of rotation: their
axes are off by up to 5°."""
LIVELY_RATE = 0.5
"""rad/s of gravity's direction from which on a block shows the size of a gyroscope's counts."""
MIN_LIVELY_BLOCKS = 20
"""Such blocks, two seconds of turning, below which that size is not known."""
MIN_ROTATION_SECONDS = 2.5
"""A hand needs longer to turn a device once around and back to the same place."""
SAME_PLACE = 0.01
"""Largest difference between two holds in the same place, as a share of gravity."""
ROTATION_OVERLAP_SECONDS = 0.05
"""Seconds of the adjoining holds that a rotation includes, so that no motion is missed."""
MIN_LEVEL_GRAVITY = 0.25
"""Share of gravity in the plane of rotation; below it the tilt is undefined."""
