"""Commands in a Slurm cluster of virtual nodes (deploy/slurm/cluster.sh)."""

import functools
import os
import shutil
import subprocess

CLUSTER = os.path.join(os.environ["WEFT_SOURCE"], "deploy", "slurm", "cluster.sh")
PATIENCE_S = 600


@functools.cache
def why_no_cluster():
    """Empty where a cluster can be started."""
    path = os.environ["PATH"] + ":/usr/sbin:/sbin"
    for program in ("munged", "slurmctld", "slurmd", "sbatch", "unshare", "ip"):
        if not shutil.which(program, path=path):
            return f"{program} is not installed"
    if os.geteuid() != 0:
        return "root is needed"
    done = subprocess.run(["unshare", "--net", "--uts", "--ipc", "--pid", "--mount", "--mount-proc", "--fork", "true"],
                          capture_output=True, check=False, timeout=60)
    return "" if done.returncode == 0 else "namespaces are not permitted"


def run_in_cluster(command, nodes=1, cpus=1, **options):
    """Runs `command` while a cluster is up. 125 is the exit status of a cluster that did not start."""
    return subprocess.run([CLUSTER, "--nodes", str(nodes), "--cpus", str(cpus), *command], capture_output=True, text=True,
                          timeout=PATIENCE_S, check=False, **options)
