#!/usr/bin/env bash
# Runs a resumable command in a Slurm job, and puts the job back into the queue when its time was over first.
# The last line of a batch script, with exec, so that Slurm's signal comes here:
#
#     #SBATCH --signal=B:USR1@120      two minutes before the wall time
#     #SBATCH --requeue
#     exec bash jobs/until_done.sh srun --mpi=pmi2 --kill-on-bad-exit=1 hpcclear run ...
#
# USR1 and TERM are handed on; hpcclear then saves what is finished and exits 3 within 5 s. After USR1 the job is
# requeued and the same command goes on; after TERM (scancel, or a node that goes down) it ends, to be resubmitted by hand.
set -u
most_turns=${MOST_TURNS:-100} # a job that never gets anywhere is not requeued for ever

# Steps of a requeued job are numbered from 0 again, and MPICH names its shared memory after job and step: what a killed
# turn left behind would be taken for this one's. So each turn begins at a step of its own.
for ((step = 0; step < ${SLURM_RESTART_COUNT:-0}; step++)); do
    srun --nodes=1 --ntasks=1 true
done

"$@" &
child=$!
out_of_time=no
trap 'out_of_time=yes; kill -USR1 "$child"' USR1
trap 'kill -TERM "$child"' TERM INT
wait "$child"
code=$?
while kill -0 "$child" 2>/dev/null; do # a signal ends `wait`, not the command
    wait "$child"
    code=$?
done
trap '' USR1 TERM INT # nobody is left to hand them to
if [ "$code" = 3 ] && [ "$out_of_time" = yes ]; then
    turn=$((${SLURM_RESTART_COUNT:-0} + 1))
    if [ "$turn" -ge "$most_turns" ]; then
        echo "job $SLURM_JOB_ID had $turn turns and is not done; submit it again to go on" >&2
    else
        echo "job $SLURM_JOB_ID: turn $turn is over, requeued to go on"
        scontrol requeue "$SLURM_JOB_ID"
    fi
fi
exit "$code"
