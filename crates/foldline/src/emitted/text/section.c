/* Sections: crossings of a plane, or states at multiples of a time (module `simulation::section`). */

#if FL_SECTION
/* Records the state at a fraction of the step just accepted. Returns 1 once enough have been recorded. */
FL_RARE int fl_record(const fl_job *job, const fl_run *run, double theta, double time, int crossings)
{
    double x[FL_N];
    if (theta <= 0.0 || theta >= 1.0) {
        fl_state_at(run, theta <= 0.0 ? 0.0 : 1.0, x);
    } else {
        double k[7][FL_N];
        for (int i = 0; i < FL_N; i++) {
            k[0][i] = run->k[0][i];
        }
        fl_stages(FL_S(job, run), FL_SIGNS(run), run->x, theta * run->h, k, x, 0);
    }
    for (int i = 0; i < FL_N; i++) {
        job->recorded[((long long)crossings * FL_N + i) * job->count + run->trajectory] = x[i];
    }
    job->recorded_at[(long long)crossings * job->count + run->trajectory] = time;
    return crossings + 1 >= job->records;
}

/* Records all crossings within the step accepted, before its end becomes the present state. Returns 1 to stop. */
FL_RARE int fl_cross(const fl_job *job, fl_run *run)
{
    if (job->strobe > 0.0) {
        for (;;) {
            const double time = job->begin + job->sign * job->strobe * (run->crossings + 1);
            if ((run->end - time) * job->sign < 0.0) {
                return 0;
            }
            const double theta = run->end == time ? 1.0 : (time - run->time) / run->h;
            const int stops = fl_record(job, run, theta, time, run->crossings);
            run->crossings++;
            if (stops) {
                return 1;
            }
        }
    }
    const fl_course course = {job, run, -1, 1.0};
    double samples[2 * FL_MOST_SAMPLES][2];
    for (int c = 0; c < FL_MOST_SAMPLES; c++) {
        samples[c][0] = 0.125 * c;
        samples[c][1] = fl_value(&course, 0.125 * c, 0);
    }
    const int count = fl_insert_extrema(&course, samples, FL_MOST_SAMPLES, 1);
    for (int c = 0; c + 1 < count; c++) {
        const double a = samples[c][0], b = samples[c + 1][0], ga = samples[c][1], gb = samples[c + 1][1];
        const int rising = ga < 0.0 && gb >= 0.0, falling = ga > 0.0 && gb <= 0.0;
        if (!((rising && job->direction >= 0) || (falling && job->direction <= 0))) {
            continue;
        }
        const double low = fl_value(&course, a, 1), high = fl_value(&course, b, 1);
        const double theta = low * high < 0.0 ? fl_root(&course, a, b, low, high) : fabs(low) < fabs(high) ? a : b;
        const double time = theta == 1.0 ? run->end : run->time + theta * run->h;
        const int stops = fl_record(job, run, theta, time, run->crossings);
        run->crossings++;
        if (stops) {
            return 1;
        }
    }
    return 0;
}
#endif
