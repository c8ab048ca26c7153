#!/usr/bin/env bash
# A Slurm cluster of virtual nodes on this machine, for as long as a command runs. munge, slurmctld and a slurmd per
# node live in namespaces of their own: network, processes, mounts and host name are nobody else's, so several clusters
# can run at once, and all processes end with the command.
#
# Usage: deploy/slurm/cluster.sh [--nodes N] [--cpus N] [--cpu-percent N] [--memory-mib N] [--state DIR] [--keep]
#                                COMMAND [ARGUMENT...]
#
#   --nodes N       virtual nodes, w1 to wN (1)
#   --cpus N        processors of each node, which Slurm believes without asking the machine (1)
#   --cpu-percent N processors of a node are slower: the kernel gives a node so much of a processor for each of them, so
#                   that nodes are as fast as they are slow however many there are (control groups, version 1 or 2)
#   --memory-mib N  memory of each node (4096)
#   --state DIR     logs and spool; by default a temporary folder that is removed at the end unless --keep is given
#
# COMMAND finds the cluster by SLURM_CONF; logs, configuration and process ids are in WEFT_SLURM_STATE. Partitions: main
# (all nodes), urgent (takes nodes from jobs of main, which wait again), short (1 minute at most), closed (down). The exit status is that of COMMAND; 125 when the cluster
# did not start. Needs root, since slurmd changes users, and the packages of deploy/packages-slurm.txt.
set -euo pipefail
nodes=1 cpus=1 percent='' memory_mib=4096 state='' keep=''

fail() {
  printf 'cluster.sh: %s\n' "$*" >&2
  exit 125
}

while [[ ${1:-} == --* ]]; do
  case $1 in
    --nodes) nodes=${2:-} && shift 2 ;;
    --cpus) cpus=${2:-} && shift 2 ;;
    --cpu-percent) percent=${2:-} && shift 2 ;;
    --memory-mib) memory_mib=${2:-} && shift 2 ;;
    --state) state=${2:-} && shift 2 ;;
    --keep) keep=1 && shift ;;
    --help) sed -n '2,/^set /{/^set /d;s/^# \?//;p}' "${BASH_SOURCE[0]}" && exit 0 ;;
    *) fail "unknown option $1; --help lists them" ;;
  esac
done
[[ $# -gt 0 ]] || fail "no command; --help shows how to call this"
for number in "$nodes" "$cpus" "$memory_mib" "${percent:-100}"; do
  [[ $number =~ ^[1-9][0-9]{0,6}$ ]] || fail "\"$number\" is no positive number"
done

# Groups of the nodes, so that the kernel limits all that runs on them.
groups=/sys/fs/cgroup
[[ -d $groups/cpu ]] && groups=$groups/cpu
group_of() { printf '%s/weft-%s-w%d' "$groups" "${WEFT_SLURM_GROUP:-}" "$1"; }
make_group() {
  local group period_us=50000
  group=$(group_of "$1")
  mkdir "$group" || return 1
  if [[ -f $group/cpu.cfs_quota_us ]]; then
    echo $period_us > "$group/cpu.cfs_period_us" && echo $((period_us * percent * cpus / 100)) > "$group/cpu.cfs_quota_us"
  else
    echo "$((period_us * percent * cpus / 100)) $period_us" > "$group/cpu.max"
  fi
}
remove_groups() {
  local i attempt
  for i in $(seq "$nodes"); do
    # The kernel needs a moment for processes that have been killed.
    for attempt in $(seq 50); do
      [[ -d $(group_of "$i") ]] || break
      rmdir "$(group_of "$i")" 2> /dev/null || sleep 0.1
    done
  done
}

if [[ -z ${WEFT_SLURM_INSIDE:-} ]]; then
  PATH=$PATH:/usr/sbin:/sbin
  for program in munged slurmctld slurmd sbatch unshare ip; do
    command -v "$program" > /dev/null ||
      fail "$program is not installed: run deploy/install-packages.sh --with-slurm"
  done
  [[ $(id -u) == 0 ]] || fail "needs root: slurmd changes users"
  [[ -n $state ]] && keep=1
  state=${state:-$(mktemp -d "${TMPDIR:-/tmp}/weft-slurm.XXXXXX")}
  mkdir -p "$state"
  state=$(cd "$state" && pwd)
  chmod 755 "$state"
  export WEFT_SLURM_GROUP=$$
  if [[ -n $percent ]]; then
    trap remove_groups EXIT
    [[ -d $groups/cpu || ! -f $groups/cgroup.subtree_control ]] || echo +cpu > "$groups/cgroup.subtree_control" || true
    for i in $(seq "$nodes"); do
      make_group "$i" || fail "$groups cannot be written, so nodes cannot be made slower"
    done
  fi
  status=0
  PATH=$PATH WEFT_SLURM_INSIDE=1 unshare --net --uts --ipc --pid --mount --mount-proc --fork --kill-child \
    bash "${BASH_SOURCE[0]}" --nodes "$nodes" --cpus "$cpus" ${percent:+--cpu-percent "$percent"} --memory-mib "$memory_mib" \
    --state "$state" "$@" || status=$?
  [[ -n $keep ]] || rm -rf "$state"
  exit "$status"
fi

# From here on: process 1 of the namespaces.
unset WEFT_SLURM_INSIDE
hostname weft-slurm
ip link set lo up
# Slurm refuses to talk over loopback alone; both ends of this pair are here.
ip link add slurm0 type veth peer name slurm1
ip address add 10.213.0.1/24 dev slurm0
ip link set slurm0 up
ip link set slurm1 up

mkdir -p "$state/munge" "$state/spool" "$state/controller" "$state/log"
chmod 700 "$state/munge"
munge_socket=$state/munge/socket
[[ -s $state/munge/key ]] || (umask 077 && head -c 1024 /dev/urandom > "$state/munge/key")

cat > "$state/slurm.conf" << END
ClusterName=weft
SlurmctldHost=weft-slurm(10.213.0.1)
AuthType=auth/munge
AuthInfo=socket=$munge_socket
CredType=cred/munge
SlurmUser=root
SlurmdUser=root
SlurmctldPort=6817
SlurmctldPidFile=$state/slurmctld.pid
SlurmctldLogFile=$state/log/slurmctld.log
SlurmdPidFile=$state/slurmd-%n.pid
SlurmdLogFile=$state/log/slurmd-%n.log
SlurmdSpoolDir=$state/spool/%n
StateSaveLocation=$state/controller
SwitchType=switch/none
MpiDefault=none
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core_Memory
SlurmdParameters=config_overrides
ReturnToService=2
# Nodes that are gone are noticed in seconds, not in the 5 minutes of a real cluster.
SlurmdTimeout=10
SlurmctldTimeout=10
InactiveLimit=0
KillWait=2
MinJobAge=300
MessageTimeout=10
SchedulerParameters=sched_interval=5,batch_sched_delay=0,requeue_setup_env_fail
PreemptType=preempt/partition_prio
PreemptMode=REQUEUE
JobRequeue=1
MaxArraySize=10001
MaxJobCount=20000
END
for i in $(seq "$nodes"); do
  printf 'NodeName=w%d NodeHostname=weft-slurm NodeAddr=10.213.0.1 Port=%d CPUs=%d RealMemory=%d State=UNKNOWN\n' \
    "$i" $((17000 + i)) "$cpus" "$memory_mib" >> "$state/slurm.conf"
done
cat >> "$state/slurm.conf" << END
PartitionName=main Nodes=ALL Default=YES MaxTime=INFINITE State=UP PriorityTier=10
PartitionName=urgent Nodes=ALL MaxTime=INFINITE State=UP PriorityTier=100 PreemptMode=off
PartitionName=short Nodes=ALL MaxTime=1 State=UP PriorityTier=10
PartitionName=closed Nodes=ALL MaxTime=INFINITE State=DOWN PriorityTier=10
END
export SLURM_CONF=$state/slurm.conf WEFT_SLURM_STATE=$state

# munge checks who owns its folders; --force turns what it dislikes about them into warnings.
munged --force --key-file="$state/munge/key" --socket="$munge_socket" --pid-file="$state/munge/pid" \
  --log-file="$state/munge/log" --seed-file="$state/munge/seed" 2> "$state/munge/start.log" ||
  fail "munged did not start: $(tail -n 3 "$state/munge/start.log")"
slurmctld -c -f "$SLURM_CONF" || fail "slurmctld did not start; its log is $state/log/slurmctld.log (--keep keeps it)"
for i in $(seq "$nodes"); do
  (
    [[ -z $percent ]] || echo 0 > "$(group_of "$i")/cgroup.procs" || exit 1
    exec slurmd -N "w$i" -f "$SLURM_CONF"
  ) ||
    fail "slurmd of w$i did not start; its log is $state/log/slurmd-w$i.log (--keep keeps it)"
done
for attempt in $(seq 150); do
  idle=$(sinfo --noheader --partition=main --states=idle --format=%D 2> /dev/null || true)
  [[ $idle == "$nodes" ]] && break
  [[ $attempt -lt 150 ]] || fail "after 30 s the nodes are not idle: $(sinfo --noheader 2>&1 | tr '\n' ' ')"
  sleep 0.2
done

# Run beside this shell, which stays process 1: it reaps orphans, and everything ends with it.
status=0
"$@" || status=$?
exit "$status"
