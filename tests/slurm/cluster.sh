# A Slurm cluster of this one machine, as root, in a folder of its own; source it.
#   start_cluster FOLDER    starts munged, slurmctld and slurmd, and sets SLURM_CONF for the clients
#   stop_cluster            cancels all jobs and ends the daemons

start_cluster() {
    folder=$1
    mkdir -p "$folder/spool-$(hostname -s)" "$folder/state"
    (umask 077 && head -c 1024 /dev/urandom >"$folder/munge.key")
    cores=$(env -u OMP_NUM_THREADS nproc) # which otherwise answers 1
    host=$(hostname -s)
    {
        sed "s|@first@|$((RANDOM * 1000 + 1))|; s|@host@|$host|; s|@folder@|$folder|" tests/slurm/slurm.conf
        echo "KillWait=10"
        echo "NodeName=$host CPUs=$cores State=UNKNOWN"
    } >"$folder/slurm.conf"
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
    for daemon in "slurmd-$(hostname -s)" slurmctld munged; do
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
