"""`weft avatar` where things go wrong in the studio, and what is tried of that without pictures."""

import os
import unittest

import avatar_test as shirt
from studio import vertex_states, weft


def setUpModule():
    shirt.setUpModule()


def tearDownModule():
    shirt.tearDownModule()


class Trials(unittest.TestCase):
    def test_trials_and_meshes_to_watch(self):
        meshes = shirt.path("meshes")
        table = weft("evaluate", shirt.sources[0], "--avatar", shirt.avatar, "--cameras", "2", "--frames", 45, "--trials",
                     "--meshes", meshes, check=0).stdout
        for method in ("elsewhere", "one dark", "after dark", "never dark"):
            self.assertIn(method, table)
        folder = f"{meshes}/{os.path.basename(shirt.sources[0])}-2"
        self.assertEqual(len(os.listdir(folder)), 45)
        self.assertEqual(set(vertex_states(f"{folder}/0044/mesh.ply")) - {shirt.DRIVEN}, set())
        self.assertTrue(os.path.exists(f"{folder}/0044/truth.ply"))


if __name__ == "__main__":
    unittest.main()
