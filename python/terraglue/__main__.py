"""The command `terraglue` of the package: the program that the wheel holds."""

import os
import sys

from .paths import PROGRAM


def main():
    if not os.access(PROGRAM, os.X_OK):
        # wheels are archives, and not every installer keeps the mode
        PROGRAM.chmod(0o755)
    os.execv(PROGRAM, [str(PROGRAM), *sys.argv[1:]])


if __name__ == "__main__":
    main()
