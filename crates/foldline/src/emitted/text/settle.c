/* Settling: a trajectory has settled on a known solution if its distance to it falls steadily (modules
   `attractors::orbit` and `attractors::watch`). */

#if FL_SETTLE
#define FL_PULSE 16

FL_FUNCTION double fl_between(const fl_job *job, const double *x, int orbit, int from, int to, double s)
{
    double largest = 0.0;
    FL_UNROLL for (int i = 0; i < FL_N; i++) {
        const double p = (1.0 - s) * job->orbit_states[from * FL_N + i] + s * job->orbit_states[to * FL_N + i];
        largest = fmax(largest, fabs(x[i] - p) / job->orbit_scale[orbit * FL_N + i]);
    }
    return largest;
}

FL_FUNCTION double fl_onto(const fl_job *job, const double *x, int orbit, int fine, int other)
{
    double along = 0.0, length = 0.0;
    FL_UNROLL for (int i = 0; i < FL_N; i++) {
        const double scale = job->orbit_scale[orbit * FL_N + i], here = job->orbit_states[fine * FL_N + i];
        const double chord = (job->orbit_states[other * FL_N + i] - here) / scale;
        along += chord * (x[i] - here) / scale;
        length += chord * chord;
    }
    return fl_between(job, x, orbit, fine, other, length > 0.0 ? fl_limit(along / length, 0.0, 1.0) : 0.0);
}

/* Distance to a known solution. */
FL_RARE double fl_distance(const fl_job *job, const double *x, int orbit)
{
    const int start = job->orbit_first[orbit], count = job->orbit_first[orbit + 1] - start;
    if (count < 2) {
        return fl_between(job, x, orbit, start, start, 0.0);
    }
    double place[FL_N], nearest = 1e300;
    int coarse = 0, fine = 0;
    FL_UNROLL for (int i = 0; i < FL_N; i++) {
        place[i] = x[i] / job->orbit_scale[orbit * FL_N + i];
    }
    for (int k = 0; k < count; k += 4) {
        double square = 0.0;
        FL_UNROLL for (int i = 0; i < FL_N; i++) {
            const double apart = place[i] - job->orbit_coarse[(start + k) * FL_N + i];
            square += apart * apart;
        }
        if (square < nearest) {
            coarse = k;
            nearest = square;
        }
    }
    nearest = 1e300;
    for (int around = 0; around < 7; around++) {
        const int k = (coarse + count + around - 3) % count;
        double square = 0.0;
        FL_UNROLL for (int i = 0; i < FL_N; i++) {
            const double apart =
                (x[i] - job->orbit_states[(start + k) * FL_N + i]) / job->orbit_scale[orbit * FL_N + i];
            square += apart * apart;
        }
        if (square < nearest) {
            fine = k;
            nearest = square;
        }
    }
    return fmin(fl_onto(job, x, orbit, start + fine, start + (fine + count - 1) % count),
                fl_onto(job, x, orbit, start + fine, start + (fine + 1) % count));
}

/* Adds a measurement. Returns 1 once the trajectory has settled. */
FL_FUNCTION int fl_measure(const fl_job *job, fl_run *run)
{
    int nearest = -1;
    double distance = 1e300;
    for (int orbit = 0; orbit < job->orbits; orbit++) {
        const double own = fl_distance(job, run->x, orbit);
        if (own < distance) {
            distance = own;
            nearest = orbit;
        }
    }
    if (nearest < 0) {
        return 0;
    }
    if (nearest != run->nearest) {
        run->nearest = nearest;
        run->measurements = run->windows = 0;
        run->furthest = run->first = run->last = 0.0;
    }
    run->measurements++;
    run->furthest = fmax(run->furthest, distance);
    if (run->measurements % 8 != 0) {
        return 0;
    }
    const double furthest = run->furthest;
    run->furthest = 0.0;
    if (run->windows > 0 && (furthest < run->last || furthest <= 3e-3)) {
        run->windows++;
    } else {
        run->first = furthest;
        run->windows = 1;
    }
    run->last = furthest;
    if (run->windows >= 3 && (furthest <= 3e-3 || (furthest <= 0.05 && furthest <= 0.5 * run->first))) {
        run->settled = nearest;
        return 1;
    }
    return 0;
}
#endif
