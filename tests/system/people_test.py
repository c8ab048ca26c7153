"""The studio's people: bodies and motions as files, and cloth that is worn by them."""

import os
import tempfile
import unittest

from studio import weft


class Bodies(unittest.TestCase):
    def test_a_body_wears_the_shirt_and_stands_in_the_recipe(self):
        with tempfile.TemporaryDirectory(prefix="weft test ") as folder:
            body, take = os.path.join(folder, "anna.body"), os.path.join(folder, "take")
            made = weft("body", "make", "--stature-mm", 1650, "--girth", 0.95, "--out", body, check=0).stdout
            self.assertIn("1650 mm tall", made)
            key = made.split("hash ")[1].split()[0]
            simulate = ["simulate", "--preset", "shirt-drive", "--cell-mm", 20, "--no-pictures", "--frames", 1, "--out", take]
            weft(*simulate, "--body", body, check=0)
            with open(os.path.join(take, "recipe.txt"), encoding="utf-8") as recipe:
                self.assertIn(f"body {key}", recipe.read())
            again = weft(*simulate)
            self.assertEqual(again.returncode, 2, again.stderr)
            self.assertIn("body", again.stderr)

    def test_what_is_wrong_is_named(self):
        with tempfile.TemporaryDirectory(prefix="weft test ") as folder:
            body = os.path.join(folder, "anna.body")
            refused = weft("body", "make", "--waist-girth", 2, "--out", body)
            self.assertEqual(refused.returncode, 2)
            self.assertIn("waist_girth is 2, expected 0.7 to 1.4", refused.stderr)
            self.assertFalse(os.path.exists(body))
            weft("body", "make", "--seed", 3, "--out", body, check=0)
            skirt = weft("simulate", "--preset", "shirt-drive", "--garment", "skirt", "--no-pictures", "--body", body,
                         "--out", os.path.join(folder, "take"))
            self.assertEqual(skirt.returncode, 2)
            self.assertIn("choose the garment tshirt", skirt.stderr)


if __name__ == "__main__":
    unittest.main()
