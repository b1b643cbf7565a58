"""Cold ``fit`` of the Xsens pair, held-out error included: ``python -m benchmarks.fit_cold``.

With ``--against CHECKOUT`` the program of another commit is measured in the same run, in turn.
"""

import statistics
import tempfile

from benchmarks.measure import (
    HERE,
    PYTHON,
    SHARED,
    Cost,
    machine,
    other_checkout,
    program_environment,
    run_once,
)

PAIR = ("imu_tk_xsens/xsens_acc.mat", "imu_tk_xsens/xsens_gyro.mat")
RUNS = 11


def main() -> None:
    """Print CPU, wall time and memory of the whole process, and of Python with NumPy alone."""
    other = other_checkout()
    files = [str(SHARED / name) for name in PAIR]
    fit = [PYTHON, "-m", "imucal_wizard", "fit", *files, "--as", "imu_tk"]
    with tempfile.TemporaryDirectory() as bytecode:
        here = program_environment(HERE, bytecode)
        commands = {
            "fit, cold, all in": (fit, here),
            "fit, cold, --no-verdict": ([*fit, "--no-verdict"], here),
            "of it Python and NumPy": ([PYTHON, "-c", "import numpy"], here),
        }
        if other is not None:
            commands["the other checkout, all in"] = fit, program_environment(other, bytecode)
        runs: dict[str, list[Cost]] = {name: [] for name in commands}
        for _ in range(RUNS + 1):  # in turn, so that a busy machine disturbs all alike
            for name, (command, environment) in commands.items():
                runs[name].append(run_once(command, environment))
    print(machine())
    print(f"{'':28}{'CPU s':>8}{'least':>8}{'wall s':>8}{'MiB':>8}{'CPU / other':>13}")
    costs = {name: every[1:] for name, every in runs.items()}
    median = {name: statistics.median(one.cpu for one in every) for name, every in costs.items()}
    for name, every in costs.items():
        wall = statistics.median(one.wall for one in every)
        memory = statistics.median(one.memory for one in every)
        share = "" if other is None else f"{median[name] / median[list(costs)[-1]]:13.2f}"
        print(
            f"{name:28}{median[name]:8.3f}{min(one.cpu for one in every):8.3f}{wall:8.2f}"
            f"{memory:8.0f}{share}"
        )
    print(
        "wanted: under 0.9 s CPU; of that of commit 0bc0840 half with --no-verdict, 0.8 all in "
        f"(medians of {RUNS} runs after one that is not counted)"
    )


if __name__ == "__main__":
    main()
