/* One trajectory after the other in every thread (module `simulation::ensemble`). */

/* First slope and step length. Returns how the trajectory ended, if at once. */
FL_FUNCTION int fl_begin(const fl_job *job, fl_run *run)
{
    double f[FL_N], there[FL_N], y[FL_N];
    const double span = fabs(job->end - job->begin);
    run->time = job->begin;
    run->tried = run->steps = 0;
    run->stuck = 0;
    run->most = FL_MOST;
    run->second = FL_BETA * -13.287712379549449;
#if !FL_QUICK
    run->second = fl_second(0.0);
#endif
    double largest = 0.0;
    FL_UNROLL for (int i = 0; i < FL_N; i++) {
        run->x[i] = job->starts[i * job->count + run->trajectory];
        largest = fmax(largest, fabs(run->x[i]));
    }
    run->bound = FL_BOUND * (job->size + largest);
#if FL_OWN
    {
        double p[FL_PARAMETERS + 1];
        for (int i = 0; i < FL_PARAMETERS; i++) {
            p[i] = job->own[i * job->count + run->trajectory];
        }
        fl_scalars(p, run->s);
    }
#endif
#if FL_SETTLE
    run->nearest = run->settled = -1;
    run->measurements = run->windows = 0;
    run->furthest = run->first = run->last = 0.0;
#endif
#if FL_SECTION
    run->crossings = 0;
#endif
#if FL_SWITCHES
    {
        fl_run copy = *run;
        fl_first_signs(job, &copy);
        *run = copy;
    }
#endif
    fl_slope(FL_S(job, run), FL_SIGNS(run), run->x, f);
    int finite = 1;
    double size = 0.0, slope = 0.0;
    FL_UNROLL for (int i = 0; i < FL_N; i++) {
        const double weight = 1.0 / (job->absolute[i] + job->relative * fabs(run->x[i]));
        finite &= isfinite(run->x[i]) && isfinite(f[i]) ? 1 : 0;
        size += run->x[i] * weight * (run->x[i] * weight);
        slope += f[i] * weight * (f[i] * weight);
        run->k[0][i] = f[i];
    }
    const double trial = size > 1e-10 && slope > 1e-10 ? fmin(0.01 * sqrt(size / slope), span) : fmin(span, 1e-6);
    FL_UNROLL for (int i = 0; i < FL_N; i++) {
        y[i] = run->x[i] + job->sign * trial * f[i];
    }
    fl_slope(FL_S(job, run), FL_SIGNS(run), y, there);
    double curvature = 0.0;
    FL_UNROLL for (int i = 0; i < FL_N; i++) {
        const double weight = 1.0 / (job->absolute[i] + job->relative * fabs(run->x[i]));
        curvature += (there[i] - f[i]) * weight * ((there[i] - f[i]) * weight);
    }
    const double both = fmax(sqrt(curvature) / fmax(trial, 1e-300), sqrt(slope)) / sqrt((double)FL_N);
    const double second = both > 1e-15 ? pow(0.01 / both, 0.2) : fmax(trial * 1e-3, 1e-6);
    const double step = isfinite(second) ? fmin(second, 100.0 * trial) : 1e-3 * trial;
    run->h = job->sign * fmin(fmin(step, span), job->longest);
    return !finite ? FL_UNDEFINED : span == 0.0 ? FL_REACHED : FL_GOING;
}

/* Tries a step. Returns how the trajectory ended, if so. */
FL_FUNCTION int fl_advance(const fl_job *job, fl_run *run, unsigned turn)
{
    int stopped = 0;
    fl_stages(FL_S(job, run), FL_SIGNS(run), run->x, run->h, run->k, run->next, 1);
    const int accepted = fl_judge(job, run);
#if FL_SWITCHES
    int kink = -1;
    double theta = 2.0;
    double ahead[4][FL_SWITCHES];
    {
        int suspect = 0;
        double y[FL_N];
        for (int place = 0; place < 4; place++) {
            fl_state_at(run, 0.25 * (place + 1), y);
            fl_switches(FL_S(job, run), FL_TIME(y), y, ahead[place]);
        }
        FL_UNROLL for (int c = 0; c < FL_SWITCHES; c++) {
            const double first = fmax(run->signs[c] * run->switches[c], 0.0);
            double low = fmin(1.7976931348623157e308, first), high = first;
            for (int place = 0; place < 4; place++) {
                low = fmin(low, run->signs[c] * ahead[place][c]);
                high = fmax(high, run->signs[c] * ahead[place][c]);
            }
            suspect |= !(low > 0.5 * high);
        }
        if (suspect && accepted) {
            fl_run copy = *run;
            kink = fl_shorten(job, &copy, ahead, &theta);
            *run = copy;
        }
    }
#endif
#if FL_SECTION
    if (accepted && run->h != 0.0) {
        fl_run copy = *run;
        stopped |= fl_cross(job, &copy);
        run->crossings = copy.crossings;
    }
#endif
    run->tried++;
    if (accepted) {
        run->steps++;
        run->time = run->end;
        FL_UNROLL for (int i = 0; i < FL_N; i++) {
            run->x[i] = run->next[i];
            run->k[0][i] = run->k[6][i];
        }
#if FL_SWITCHES
        FL_UNROLL for (int c = 0; c < FL_SWITCHES; c++) {
            run->switches[c] = ahead[3][c];
        }
#endif
    }
    const double remaining = job->end - run->time;
    run->h = accepted && fabs(run->planned) * 1.01 >= fabs(remaining) ? remaining : run->planned;
#if FL_SETTLE
    if (turn % FL_PULSE == 0) {
        stopped |= fl_measure(job, run);
    }
#else
    (void)turn;
#endif
    if (!accepted) {
        if (fl_too_small(run->h, run->time)) {
            return isfinite(run->error) ? FL_STEP_TOO_SMALL : FL_UNDEFINED;
        }
        return run->tried >= job->limit ? FL_STEP_LIMIT : FL_GOING;
    }
    int outcome = FL_GOING;
    if (!(run->largest <= run->bound)) {
        outcome = FL_ESCAPED;
    } else if (stopped) {
        outcome = FL_STOPPED;
    } else if (remaining == 0.0) {
        outcome = FL_REACHED;
    } else if (run->h == 0.0) {
        outcome = FL_STEP_TOO_SMALL;
    } else if (run->tried >= job->limit) {
        outcome = FL_STEP_LIMIT;
    }
#if FL_SWITCHES
    if (kink >= 0 && outcome == FL_GOING) {
        fl_run copy = *run;
        outcome = fl_pass(job, &copy, kink, theta);
        *run = copy;
    }
#endif
    return outcome;
}

FL_FUNCTION void fl_store(const fl_job *job, const fl_run *run, int outcome)
{
    FL_UNROLL for (int i = 0; i < FL_N; i++) {
        job->states[i * job->count + run->trajectory] = run->x[i];
    }
    job->times[run->trajectory] = run->time;
    job->outcomes[run->trajectory] = outcome;
    job->steps[run->trajectory] = run->steps;
    job->rejected[run->trajectory] = run->tried - run->steps;
#if FL_SETTLE
    job->settled[run->trajectory] = run->settled;
#endif
#if FL_SECTION
    job->crossings[run->trajectory] = run->crossings;
#endif
}

FL_FUNCTION unsigned long long fl_take(const fl_job *job)
{
#ifdef __CUDACC__
    return atomicAdd(job->next, 1ull);
#else
    return (*job->next)++;
#endif
}

/* Threads take trajectories until none is left. A thread that has finished one begins the next while the others of its
   warp go on. */
FL_FUNCTION void fl_work(const fl_job *job)
{
    fl_run run;
    int outcome = FL_REACHED;
    run.trajectory = -1;
    for (unsigned turn = 1;; turn++) {
        if (outcome != FL_GOING) {
            if (run.trajectory >= 0) {
                fl_store(job, &run, outcome);
            }
            const unsigned long long next = fl_take(job);
            if (next >= (unsigned long long)job->count) {
                break;
            }
            run.trajectory = (long long)next;
            outcome = fl_begin(job, &run);
            if (outcome != FL_GOING) {
                continue;
            }
        }
        outcome = fl_advance(job, &run, turn);
    }
}

#ifdef __CUDACC__
#ifndef FL_THREADS
#define FL_THREADS 128
#endif
#ifndef FL_BLOCKS
#define FL_BLOCKS 4
#endif
/* Set before the kernel starts. */
__constant__ fl_job fl_the_job;

extern "C" __global__ void __launch_bounds__(FL_THREADS, FL_BLOCKS) fl_kernel()
{
    fl_work(&fl_the_job);
}
#else
void fl_run_all(const fl_job *job);
void fl_run_all(const fl_job *job)
{
    fl_work(job);
}
#endif
