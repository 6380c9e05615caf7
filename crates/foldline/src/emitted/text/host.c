/* Runs a job on the processor. Reads from the standard input: six 64-bit integers (count, orbits, samples of these,
   records, direction, unused), then as doubles begin, end, longest step, step limit, relative tolerance, level, strobe,
   absolute tolerances, plane, shared parameters, starts, own parameters, and first samples, scales and samples of the
   orbits. Writes doubles: final states, times, outcomes, accepted and rejected steps, solutions reached, numbers of
   crossings, crossings and their times. */

#include <stdio.h>
#include <stdlib.h>

static double *fl_read(size_t count)
{
    double *values = calloc(count + 1, sizeof *values);
    if (values == NULL || fread(values, sizeof *values, count, stdin) != count) {
        fprintf(stderr, "the input is too short\n");
        exit(1);
    }
    return values;
}

int main(void)
{
    long long sizes[6];
    unsigned long long next = 0;
    static fl_job job;
    if (fread(sizes, sizeof *sizes, 6, stdin) != 6) {
        return 1;
    }
    const size_t count = (size_t)sizes[0], orbits = (size_t)sizes[1], samples = (size_t)sizes[2];
    const double *head = fl_read(7), *absolute = fl_read(FL_N), *plane = fl_read(FL_N);
    const double *shared = fl_read(FL_PARAMETERS);
    job.count = sizes[0];
    job.begin = head[0];
    job.end = head[1];
    job.sign = head[1] < head[0] ? -1.0 : 1.0;
    job.longest = head[2];
    job.limit = head[3];
    job.relative = head[4];
    for (int i = 0; i < FL_N; i++) {
        job.absolute[i] = absolute[i];
        job.size = fmax(job.size, absolute[i]);
    }
    job.size = job.size / job.relative;
    fl_scalars(shared, job.s);
    job.starts = fl_read(FL_N * count);
    job.own = FL_OWN ? fl_read(FL_PARAMETERS * count) : NULL;
    double *states = calloc(FL_N * count, sizeof(double)), *times = calloc(count, sizeof(double));
    int *outcomes = calloc(count, sizeof(int)), *settled = calloc(count, sizeof(int));
    unsigned *steps = calloc(count, sizeof(unsigned)), *rejected = calloc(count, sizeof(unsigned));
    job.states = states;
    job.times = times;
    job.outcomes = outcomes;
    job.steps = steps;
    job.rejected = rejected;
    job.next = &next;
#if FL_SETTLE
    const double *first = fl_read(orbits + 1);
    int *firsts = calloc(orbits + 1, sizeof(int));
    for (size_t k = 0; k <= orbits; k++) {
        firsts[k] = (int)first[k];
    }
    job.orbits = (int)orbits;
    job.orbit_first = firsts;
    job.orbit_scale = fl_read(FL_N * orbits);
    job.orbit_states = fl_read(FL_N * samples);
    double *coarse = calloc(FL_N * samples + 1, sizeof(double));
    for (size_t k = 0; k < orbits; k++) {
        for (int at = firsts[k] * FL_N; at < firsts[k + 1] * FL_N; at++) {
            coarse[at] = job.orbit_states[at] / job.orbit_scale[k * FL_N + at % FL_N];
        }
    }
    job.orbit_coarse = coarse;
    job.settled = settled;
#endif
    (void)orbits, (void)samples, (void)plane;
#if FL_SECTION
    const size_t records = (size_t)sizes[3];
    double *recorded = calloc(records * FL_N * count, sizeof(double)), *at = calloc(records * count, sizeof(double));
    int *crossings = calloc(count, sizeof(int));
    for (int i = 0; i < FL_N; i++) {
        job.plane[i] = plane[i];
    }
    job.level = head[5];
    job.strobe = head[6];
    job.direction = (int)sizes[4];
    job.records = (int)records;
    job.recorded = recorded;
    job.recorded_at = at;
    job.crossings = crossings;
#endif
    fl_run_all(&job);
    fwrite(states, sizeof(double), FL_N * count, stdout);
    fwrite(times, sizeof(double), count, stdout);
    const int *integers[2] = {outcomes, settled};
    const unsigned *counts[2] = {steps, rejected};
    double *out = calloc(count, sizeof(double));
    for (int k = 0; k < 4; k++) {
        for (size_t c = 0; c < count; c++) {
            out[c] = k == 0 ? integers[0][c] : k == 3 ? integers[1][c] : (double)counts[k - 1][c];
        }
        fwrite(out, sizeof(double), count, stdout);
    }
#if FL_SECTION
    for (size_t c = 0; c < count; c++) {
        out[c] = crossings[c];
    }
    fwrite(out, sizeof(double), count, stdout);
    fwrite(recorded, sizeof(double), records * FL_N * count, stdout);
    fwrite(at, sizeof(double), records * count, stdout);
#endif
    return 0;
}
