"""Cold ``fit`` of the Xsens pair, held-out error included: ``python -m benchmarks.fit_cold``."""

from benchmarks.measure import PYTHON, SHARED, machine, median_cost

PAIR = ("imu_tk_xsens/xsens_acc.mat", "imu_tk_xsens/xsens_gyro.mat")


def main() -> None:
    """Print CPU, wall time and memory of the whole process, and of Python with NumPy alone."""
    files = [str(SHARED / name) for name in PAIR]
    fit = median_cost([PYTHON, "-m", "imucal_wizard", "fit", *files, "--as", "imu_tk"])
    numpy = median_cost([PYTHON, "-c", "import numpy"])
    print(machine())
    print(f"{'':28}{'CPU s':>8}{'wall s':>8}{'MiB':>8}")
    for name, cost in (("fit, cold, all in", fit), ("of it Python and NumPy", numpy)):
        print(f"{name:28}{cost.cpu:8.2f}{cost.wall:8.2f}{cost.memory:8.0f}")
    print("wanted: fit under 0.9 s CPU")


if __name__ == "__main__":
    main()
