# Queues this job again, because Slurm itself does not queue a failed job again. Slurm sends the
# same signal to a cancelled job and to a job at its time limit. Only the second has the reason
# TimeLimit. A job that Slurm itself has queued again has no reason.
requeue() {
    for _ in 1 2 3 4 5 6; do
        case $(squeue -h -o '%T %r' -j "$job" || echo silent) in
            RUNNING* | 'COMPLETING TimeLimit')
                # Slurm ends this job during the sleep.
                scontrol requeue "$job" && { sleep 60; break; }
                ;;
            silent) ;;
            *) break ;;
        esac
        sleep 10
    done
}
