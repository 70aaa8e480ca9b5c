"""The command `itn` that a wheel installs: the program within the package, which finds the driver that pip installed."""
import os
import sys
from pathlib import Path


def main() -> None:
    os.execv(Path(__file__).with_name("bin") / "itn", sys.argv)  # importing the package has offered the driver
