#!/bin/bash
# A small Slurm cluster on one machine, without systemd, for tests. As root on Debian 12, after
#   apt-get update && apt-get install -y --no-install-recommends slurm-wlm munge
# Usage:  eval "$(start-slurm.sh start [NODES])"   # prints: export SLURM_CONF=…
#         start-slurm.sh stop
set -eu
ROOT=${SLURM_TEST_ROOT:?an empty folder for its state}
NODES=${2:-1}
HOST=$(hostname -s)
CPUS=$(($(nproc) / NODES)); [ "$CPUS" -gt 0 ] || CPUS=1
MEM=$(awk -v n="$NODES" '/MemTotal/ {print int($2 / 1024 * 0.9 / n)}' /proc/meminfo)

# kill -0 is not enough: daemons that have ended remain as zombies if no parent process reaps them
alive() {
    local pid state
    pid=$(cat "$1" 2>/dev/null) || return 1
    state=$(sed -n 's/^State:[[:space:]]*\(.\).*/\1/p' "/proc/$pid/status" 2>/dev/null) || return 1
    [ -n "$state" ] && [ "$state" != Z ]
}

start() {
    mkdir -p "$ROOT"/{state,spool,log}
    # munge authenticates clients and daemons; its package makes the key
    chown munge: /etc/munge/munge.key; chmod 400 /etc/munge/munge.key
    install -d -o munge -g munge -m 755 /run/munge
    install -d -o munge -g munge -m 700 /var/log/munge /var/lib/munge
    if ! alive /run/munge/munged.pid; then
        runuser -u munge -- /usr/sbin/munged --force
        touch "$ROOT/own-munge"
    fi
    cat >"$ROOT/slurm.conf" <<CONF
ClusterName=breccia
SlurmctldHost=$HOST(127.0.0.1)
AuthType=auth/munge
CredType=cred/munge
AuthInfo=cred_expire=5
SlurmUser=root
SlurmdUser=root
StateSaveLocation=$ROOT/state
SlurmdSpoolDir=$ROOT/spool/%n
SlurmctldPidFile=$ROOT/slurmctld.pid
SlurmdPidFile=$ROOT/%n.pid
SlurmctldLogFile=$ROOT/log/slurmctld.log
SlurmdLogFile=$ROOT/log/%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
MpiDefault=none
ReturnToService=2
KillWait=5
SchedulerParameters=batch_sched_delay=0,sched_interval=2
CONF
    for n in $(seq "$NODES"); do
        echo "NodeName=n$n NodeHostname=$HOST NodeAddr=127.0.0.1 Port=$((17000 + n))" \
            "CPUs=$CPUS RealMemory=$MEM State=UNKNOWN" >>"$ROOT/slurm.conf"
    done
    echo "PartitionName=main Nodes=n[1-$NODES] Default=YES MaxTime=INFINITE State=UP" >>"$ROOT/slurm.conf"
    export SLURM_CONF=$ROOT/slurm.conf
    alive "$ROOT/slurmctld.pid" || slurmctld
    for n in $(seq "$NODES"); do
        mkdir -p "$ROOT/spool/n$n"
        alive "$ROOT/n$n.pid" || slurmd -N "n$n"
    done
    for _ in $(seq 60); do
        if [ "$(sinfo -h -N -o %t 2>/dev/null | grep -c '^idle$')" = "$NODES" ]; then
            echo "export SLURM_CONF=$SLURM_CONF"
            return
        fi
        sleep 0.5
    done
    tail -n 5 "$ROOT"/log/*.log >&2
    return 1
}

stop() {
    export SLURM_CONF=$ROOT/slurm.conf
    scancel --user=root 2>/dev/null || true
    local pid munge=
    [ ! -e "$ROOT/own-munge" ] || munge=/run/munge/munged.pid
    for pid in "$ROOT"/n*.pid "$ROOT/slurmctld.pid" $munge; do
        alive "$pid" && kill "$(cat "$pid")"
        for _ in $(seq 50); do alive "$pid" || break; sleep 0.1; done
    done
    rm -rf "$ROOT"
}

"${1:-start}"
