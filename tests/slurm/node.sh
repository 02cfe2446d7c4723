#!/bin/sh
# A Slurm of one node with two processors for tests: node.sh start FOLDER prints the SLURM_CONF to use, node.sh stop FOLDER ends it.
# Needs munged, slurmctld and slurmd (Debian: slurm-wlm, munge), and root. FOLDER is emptied by whoever made it.
set -eu
action=$1
mkdir -p "$2"
place=$(cd "$2" && pwd)
conf=$place/slurm.conf
stop() {
    for name in slurmd slurmctld munged; do
        if [ -s "$place/$name.pid" ]; then kill "$(cat "$place/$name.pid")" 2>/dev/null || true; fi
    done
}
case $action in
stop) stop; exit 0 ;;
start) ;;
*) echo "node.sh start|stop FOLDER" >&2; exit 2 ;;
esac
mkdir -p "$place/state" "$place/spool" "$place/munge"
chmod 755 "$place" "$place/munge"
host=$(hostname -s)
port=$((20000 + $$ % 20000))
dd if=/dev/urandom of="$place/munge/key" bs=1 count=128 2>/dev/null
chmod 600 "$place/munge/key"
munged --force --key-file="$place/munge/key" --socket="$place/munge/socket" --pid-file="$place/munged.pid" \
    --log-file="$place/munge/log" --seed-file="$place/munge/seed" 2>"$place/munge/messages"
cat >"$conf" <<END
ClusterName=test
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=$port
SlurmdPort=$((port + 1))
SlurmUser=root
AuthType=auth/munge
AuthInfo=socket=$place/munge/socket
CredType=cred/munge
StateSaveLocation=$place/state
SlurmdSpoolDir=$place/spool
SlurmctldPidFile=$place/slurmctld.pid
SlurmdPidFile=$place/slurmd.pid
SlurmctldLogFile=$place/slurmctld.log
SlurmdLogFile=$place/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
JobAcctGatherType=jobacct_gather/none
ReturnToService=2
KillWait=2
SchedulerParameters=sched_interval=1,batch_sched_delay=0
NodeName=$host NodeAddr=127.0.0.1 CPUs=2 State=UNKNOWN
PartitionName=test Nodes=ALL Default=YES MaxTime=INFINITE State=UP
END
export SLURM_CONF="$conf"
slurmctld
slurmd
# a node is not ready at once
for _ in 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20; do
    state=$(sinfo -h -o %t 2>/dev/null || true)
    case $state in idle*|mix*|alloc*) echo "$conf"; exit 0 ;; esac
    sleep 0.5
done
echo "slurm did not start: $state" >&2
tail -n 5 "$place/slurmctld.log" "$place/slurmd.log" >&2
stop
exit 1
