#!/usr/bin/env bash
# Tests scenes/slurm_array.sh on a Slurm of its own: one node with two slots, in a scratch folder.
#
# Where Slurm's daemons cannot be found it says so and counts as skipped. With --install it installs
# Debian's packages first. Nothing of the machine's own Slurm, if there is one, is looked at.
set -u
root=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.." && pwd)
source "$root/scenes/setup.sh"
cli=$root/build/release/native/pharos-cli

[ "${1-}" != --install ] || need_packages slurmctld slurmd slurm-client munge
for program in slurmctld slurmd munged sbatch; do
    if ! PATH=$PATH:/usr/sbin command -v "$program" >/dev/null; then
        echo "SKIP slurm: $program is not installed (tests/slurm.sh --install)"
        echo "0 passed, 0 failed, 1 skipped"
        exit 0
    fi
done
if [ "$(id -u)" != 0 ]; then
    echo "SKIP slurm: its daemons need root to start jobs"
    echo "0 passed, 0 failed, 1 skipped"
    exit 0
fi
PATH=$PATH:/usr/sbin

scratch=$(mktemp -d) passed=0 failed=0 daemons=()
end() {
    for pid in "${daemons[@]}"; do kill "$pid" 2>/dev/null; done
    wait 2>/dev/null
    rm -rf "$scratch"
}
trap end EXIT

pass_or_fail() {
    if [ "$1" = 0 ]; then
        echo "PASS $2"
        passed=$((passed + 1))
    else
        echo "FAIL $2"
        failed=$((failed + 1))
    fi
}

start_slurm() {
    local host=$(hostname -s) port=$((20000 + RANDOM % 20000))
    mkdir -p "$scratch"/{state,spool,munge}
    chmod 755 "$scratch"
    dd if=/dev/urandom of="$scratch/munge/key" bs=128 count=1 2>/dev/null
    chmod 700 "$scratch/munge"
    chmod 400 "$scratch/munge/key"
    cat >"$scratch/slurm.conf" <<CONF
ClusterName=pharos
SlurmctldHost=$host
SlurmctldPort=$port
SlurmdPort=$((port + 1))
SlurmUser=root
AuthType=auth/munge
AuthInfo=socket=$scratch/munge/socket
CredType=cred/munge
StateSaveLocation=$scratch/state
SlurmdSpoolDir=$scratch/spool
SlurmctldPidFile=$scratch/slurmctld.pid
SlurmdPidFile=$scratch/slurmd.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
MpiDefault=none
ReturnToService=2
SchedulerType=sched/backfill
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SchedulerParameters=sched_interval=1,bf_interval=1,batch_sched_delay=0
NodeName=$host CPUs=2 State=UNKNOWN
PartitionName=all Nodes=$host Default=YES State=UP
CONF
    export SLURM_CONF=$scratch/slurm.conf
    munged -F --force --key-file="$scratch/munge/key" --socket="$scratch/munge/socket" \
        --pid-file="$scratch/munge/pid" --log-file="$scratch/munge/log" --seed-file="$scratch/munge/seed" &
    daemons+=($!)
    for _ in $(seq 50); do [ ! -S "$scratch/munge/socket" ] || break; sleep 0.1; done
    slurmctld -D -i >"$scratch/slurmctld.log" 2>&1 &
    daemons+=($!)
    slurmd -D >"$scratch/slurmd.log" 2>&1 &
    daemons+=($!)
    for _ in $(seq 100); do
        [[ $(sinfo -h -o %t 2>/dev/null) != idle* ]] || return 0
        sleep 0.2
    done
    return 1
}

# Waits for the queue to be empty.
drain() {
    local _
    for _ in $(seq 600); do
        [ -n "$(squeue -h 2>/dev/null)" ] || return 0
        sleep 0.2
    done
    return 1
}

# same NAME A B: the pictures are equal within the bar of merged shards.
same() {
    oiiotool --fail 1e-6 --diff "$2" "$3" >"$scratch/diff" 2>&1
    local status=$?
    [ "$status" = 0 ] || tail -n 12 "$scratch/diff"
    pass_or_fail "$status" "$1"
}

dump=$scratch/scene.pharos
PHAROS_WRITE_DUMP=$dump "$root/build/release/tests/native/session_test" --gtest_filter=Scripts.TakeADumpFromHere >/dev/null
start_slurm
pass_or_fail $? "slurm starts with one node of two slots"
if [ "$failed" = 0 ]; then
    SAMPLES=11 SHARDS=4 PHAROS_CLI=$cli bash "$root/scenes/slurm_array.sh" "$dump" "$scratch/merged.exr"
    pass_or_fail $? "an array of four tasks is submitted"
    drain
    pass_or_fail $? "all tasks end"
    "$cli" render "$dump" -o "$scratch/whole.exr" --samples 11 --guiding off
    same "four uneven shards are the single run" "$scratch/merged.exr" "$scratch/whole.exr"
    "$cli" render "$dump" -o "$scratch/train.exr" --samples 16 --guiding neural --save-field "$scratch/guide.field"
    "$cli" render "$dump" -o "$scratch/whole.exr" --samples 7 --guiding neural --field "$scratch/guide.field"
    SAMPLES=7 SHARDS=3 FIELD=$scratch/guide.field bash "$root/scenes/slurm_array.sh" "$dump" "$scratch/guided.exr" && drain
    same "so are three with a frozen field" "$scratch/guided.exr" "$scratch/whole.exr"
fi
[ "$failed" = 0 ] || tail -n 20 "$scratch"/slurm*.log "$scratch"/*.exr.*.log 2>/dev/null
echo "$passed passed, $failed failed"
[ "$failed" = 0 ]
