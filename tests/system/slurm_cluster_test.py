"""deploy/slurm/cluster.sh: a Slurm cluster of virtual nodes for as long as a command runs, and no longer."""

import os
import subprocess
import tempfile
import unittest

from slurm_cluster import CLUSTER, run_in_cluster, why_no_cluster

WRITE_NODE = "#!/bin/bash\necho \"$SLURM_ARRAY_TASK_ID $SLURMD_NODENAME\"\nsleep 1\n"


@unittest.skipIf(why_no_cluster(), f"no cluster: {why_no_cluster()}")
class Cluster(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="weft slurm ")
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def path(self, name):
        return os.path.join(self.folder, name)

    def test_array_runs_on_all_nodes_before_what_depends_on_it(self):
        script = (f'cd "{self.folder}"; printf %s \'{WRITE_NODE}\' > job.sh\n'
                  'first=$(sbatch --parsable --mem=64 --array=0-3 --output=task-%a job.sh)\n'
                  'sbatch --wait --mem=64 --dependency=afterok:$first --output=/dev/null --wrap "cat task-* > all"\n')
        self.assertEqual(run_in_cluster(["bash", "-ec", script], nodes=2).returncode, 0)
        with open(self.path("all"), encoding="utf-8") as file:
            tasks, nodes = zip(*(line.split() for line in file))
        self.assertEqual(sorted(tasks), ["0", "1", "2", "3"])
        self.assertEqual(set(nodes), {"w1", "w2"})

    def test_partitions_refuse_what_their_names_say(self):
        script = ('sbatch --partition=closed --wrap true > /dev/null; sbatch --partition=short --time=2 --wrap true > /dev/null\n'
                  'until squeue --noheader --format="%P %r" | sort | tee reasons | grep -q TimeLimit; do sleep 0.2; done; cat reasons\n')
        reasons = run_in_cluster(["timeout", "60", "bash", "-ec", script], cwd=self.folder).stdout.splitlines()
        self.assertEqual(reasons, ["closed PartitionDown", "short PartitionTimeLimit"])

    def test_ends_with_its_command_and_leaves_nothing(self):
        done = run_in_cluster(["bash", "-c", 'echo "$WEFT_SLURM_STATE"; exit 7'])
        self.assertEqual(done.returncode, 7)
        state = done.stdout.strip()
        self.assertFalse(os.path.exists(state))
        commands = []
        for name in filter(str.isdigit, os.listdir("/proc")):
            try:
                with open(f"/proc/{name}/cmdline", "rb") as file:
                    commands.append(file.read().decode(errors="replace"))
            except OSError:
                continue
        self.assertEqual([command for command in commands if state in command], [])

    def test_two_clusters_do_not_know_each_other(self):
        submit = ["bash", "-c", "sbatch --parsable --hold --wrap true; sleep 1; squeue --noheader | wc -l"]
        both = [subprocess.Popen([CLUSTER, *submit], stdout=subprocess.PIPE, text=True) for _ in range(2)]
        self.assertEqual([one.communicate(timeout=120)[0].split() for one in both], [["1", "1"]] * 2)

    def test_refuses_what_it_cannot_do(self):
        for arguments, words in ((["--nodes", "none", "true"], "no positive number"), (["--what"], "unknown option"),
                                 ([], "no command")):
            done = subprocess.run([CLUSTER, *arguments], capture_output=True, text=True, timeout=60, check=False)
            self.assertEqual(done.returncode, 125)
            self.assertIn(words, done.stderr)


if __name__ == "__main__":
    unittest.main()
