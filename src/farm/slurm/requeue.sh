# Queues this job again, which Slurm does not do by itself with jobs that failed. A job that was cancelled
# gets the same signal as one whose time is up: its reason distinguishes the two. A job that Slurm has queued
# again itself has no reason.
requeue() {
    for _ in 1 2 3 4 5 6; do
        case $(squeue -h -o '%T %r' -j "$job" || echo silent) in
            RUNNING* | 'COMPLETING TimeLimit')
                # Slurm ends the sleep, and this job.
                scontrol requeue "$job" && { sleep 60; break; }
                ;;
            silent) ;;
            *) break ;;
        esac
        sleep 10
    done
}
