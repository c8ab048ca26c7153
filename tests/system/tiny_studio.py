"""Makes what tests share anew: tiny_studio.py FOLDER. See studio.py."""

import os
import shutil
import sys

from studio import make_tiny_studio

if __name__ == "__main__":
    shutil.rmtree(sys.argv[1], ignore_errors=True)
    os.makedirs(sys.argv[1])
    make_tiny_studio(sys.argv[1])
