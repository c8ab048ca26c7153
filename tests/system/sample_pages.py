"""Pages of made-up jobs (tests/services/results/report/sample_reports.cpp) in a browser."""

import json
import os
import subprocess
import tempfile

from browser import PageTest
from studio import BIN


class ReportPages(PageTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        folder = tempfile.TemporaryDirectory(prefix="weft reports ")
        cls.addClassCleanup(folder.cleanup)
        cls.folder = folder.name
        subprocess.run([os.path.join(BIN, "sample_reports"), cls.folder], check=True)

    def open(self, name):
        """Its text, as it is seen."""
        return self.show(f"{self.folder}/{name}.html")

    def text(self, selector):
        return self.js(f"document.querySelector({json.dumps(selector)})?.innerText ?? null")

    def count(self, selector):
        return self.js(f"document.querySelectorAll({json.dumps(selector)}).length")
