"""What the programs load before their first line runs."""

import os
import subprocess
import unittest

from studio import BIN, LONG_S

# OpenCV's image files bring GDAL and 100 libraries more: 0.1 s of every start, and of every worker's.
HEAVY = ("libopencv_imgcodecs", "libopencv_highgui", "libgdal", "libvtk", "libQt")


def loaded(program):
    """The file names of all libraries that the dynamic loader opens for the program."""
    done = subprocess.run(["ldd", os.path.join(BIN, program)], capture_output=True, text=True, timeout=LONG_S, check=True)
    return [line.split()[0] for line in done.stdout.splitlines()]


class Startup(unittest.TestCase):
    def test_no_program_loads_libraries_that_it_does_not_use(self):
        for program in ("weft", "weftd", "weft-worker"):
            libraries = loaded(program)
            self.assertIn("libc.so.6", libraries)
            for heavy in HEAVY:
                self.assertFalse([name for name in libraries if name.startswith(heavy)], f"{program} loads {heavy}")


if __name__ == "__main__":
    unittest.main()
