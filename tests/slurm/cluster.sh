# A Slurm cluster of this one machine, as root, in a folder of its own; source it.
#   start_cluster FOLDER    starts munged, slurmctld and slurmd, and sets SLURM_CONF for the clients
#   stop_cluster            cancels all jobs and ends the daemons

start_cluster() {
    folder=$1
    mkdir -p "$folder/spool" "$folder/state"
    (umask 077 && head -c 1024 /dev/urandom >"$folder/munge.key")
    cores=$(env -u OMP_NUM_THREADS nproc) # which otherwise answers 1
    cat >"$folder/slurm.conf" <<CONF
ClusterName=test
# MPICH names its shared memory after job and step: never those of an earlier cluster on this machine.
FirstJobId=$((RANDOM * 1000 + 1))
MaxJobId=60000000
SlurmctldHost=$(hostname -s)
SlurmUser=root
SlurmctldPort=16817
SlurmdPort=16818
AuthType=auth/munge
# Requeued jobs start again once their old credential has expired: two minutes by default.
AuthInfo=socket=$folder/munge.socket,cred_expire=5
SlurmctldPidFile=$folder/slurmctld.pid
SlurmdPidFile=$folder/slurmd.pid
SlurmctldLogFile=$folder/slurmctld.log
SlurmdLogFile=$folder/slurmd.log
StateSaveLocation=$folder/state
SlurmdSpoolDir=$folder/spool
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
MpiDefault=none
ReturnToService=2
InactiveLimit=0
KillWait=10
SchedulerParameters=sched_interval=2,batch_sched_delay=1
NodeName=$(hostname -s) CPUs=$cores State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
CONF
    export SLURM_CONF=$folder/slurm.conf
    munged --force --key-file="$folder/munge.key" --socket="$folder/munge.socket" \
        --pid-file="$folder/munged.pid" --log-file="$folder/munged.log" --seed-file="$folder/munge.seed"
    slurmctld
    slurmd
    for _ in $(seq 60); do
        if [ "$(sinfo --noheader --format=%T 2>/dev/null)" = idle ]; then
            return
        fi
        sleep 1
    done
    echo "Slurm did not start; see $folder/*.log" >&2
    tail -n 5 "$folder"/*.log >&2
    return 1
}

stop_cluster() {
    scancel --quiet --user=root || true
    for daemon in slurmd slurmctld munged; do
        if [ -s "$folder/$daemon.pid" ]; then
            process=$(cat "$folder/$daemon.pid")
            kill "$process" || true
            for _ in $(seq 100); do # it still writes into the folder
                kill -0 "$process" 2>/dev/null || break
                sleep 0.2
            done
        fi
    done
}
