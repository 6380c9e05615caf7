/* The Dormand-Prince 5(4) pair and its step control (modules `simulation::tableau` and `simulation::ensemble`). */

/* Rows of the tableau one after the other, then the weights of the error, then those of the continuous solution. */
FL_TABLE fl_a[20] = {
    1.0 / 5.0,
    3.0 / 40.0, 9.0 / 40.0,
    44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0,
    19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0,
    9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0,
    35.0 / 384.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0};
FL_TABLE fl_e[6] = {
    71.0 / 57600.0, -71.0 / 16695.0, 71.0 / 1920.0, -17253.0 / 339200.0, 22.0 / 525.0, -1.0 / 40.0};
#define FL_SAFETY 0.9
#define FL_BETA 0.04
#define FL_ALPHA (0.2 - 0.75 * FL_BETA)
#define FL_LEAST 0.2
#define FL_MOST 10.0

/* How a trajectory ended. */
enum {
    FL_GOING = -1, FL_REACHED = 0, FL_STOPPED = 1, FL_ESCAPED = 2, FL_UNDEFINED = 3, FL_STEP_TOO_SMALL = 4,
    FL_STEP_LIMIT = 5, FL_SLIDES = 6
};

/* The work; arrays in device memory, trajectories along the last index. */
typedef struct {
    long long count;             /* number of trajectories */
    double begin, end, sign;     /* time span and its direction */
    double longest;              /* longest step */
    double limit;                /* largest number of steps, accepted and rejected */
    double size;                 /* size of the largest component that the tolerance implies */
    double relative;             /* tolerance */
    double absolute[FL_N];
    double s[FL_SCALARS];        /* values that depend on shared parameters alone, by fl_scalars */
    const double *starts;        /* [FL_N][count] */
    const double *own;           /* [FL_PARAMETERS][count], with FL_OWN */
    double *states;              /* [FL_N][count] final states */
    double *times;               /* [count] final times */
    int *outcomes;               /* [count] how they ended */
    unsigned *steps;             /* [count] accepted steps */
    unsigned *rejected;          /* [count] rejected steps */
    unsigned long long *next;    /* counter of trajectories taken, initially 0 */
#if FL_SETTLE
    int orbits;                  /* number of known solutions */
    const int *orbit_first;      /* [orbits + 1] first sample of each */
    const double *orbit_scale;   /* [orbits][FL_N] */
    const double *orbit_states;  /* [samples][FL_N] */
    const double *orbit_coarse;  /* [samples][FL_N], every fourth over the scale; else unused */
    int *settled;                /* [count] solution reached, or -1 */
#endif
#if FL_SECTION
    double plane[FL_N];          /* normal of the section ... */
    double level;                /* ... and value there */
    int direction;               /* 1 rising, -1 falling, 0 both */
    double strobe;               /* record at multiples of this time after the begin instead, if positive */
    int records;                 /* end after this many */
    double *recorded;            /* [records][FL_N][count] */
    double *recorded_at;         /* [records][count] */
    int *crossings;              /* [count] number recorded */
#endif
} fl_job;

/* A trajectory in progress. */
typedef struct {
    double x[FL_N], next[FL_N], k[7][FL_N];
    double time, h, end, planned, second, most, bound, error, largest;
    long long trajectory;
    unsigned tried, steps;
    int stuck;
#if FL_SWITCHES
    double signs[FL_SWITCHES], switches[FL_SWITCHES];
#endif
#if FL_OWN
    double s[FL_SCALARS];
#endif
#if FL_SETTLE
    int nearest, measurements, windows, settled;
    double furthest, first, last;
#endif
#if FL_SECTION
    int crossings;
#endif
} fl_run;

#if FL_OWN
#define FL_S(job, run) ((run)->s)
#else
#define FL_S(job, run) ((job)->s)
#endif
#if FL_SWITCHES
#define FL_SIGNS(run) ((run)->signs)
#else
#define FL_SIGNS(run) ((const double *)0)
#endif

/* f at x; with switches, on the branch that their signs select. */
FL_FUNCTION void fl_slope(const double *s, const double *signs, const double *x, double *f)
{
#if FL_SWITCHES
    int finite = 1;
    fl_given(s, FL_TIME(x), x, signs, f);
    FL_UNROLL for (int i = 0; i < FL_N; i++) {
        finite &= isfinite(f[i]) ? 1 : 0;
    }
    if (!finite) {
        /* A branch may be undefined beyond its switch. */
        double own[FL_N];
        fl_field(s, FL_TIME(x), x, own);
        FL_UNROLL for (int i = 0; i < FL_N; i++) {
            f[i] = isfinite(f[i]) ? f[i] : own[i];
        }
    }
#else
    (void)signs;
    fl_field(s, FL_TIME(x), x, f);
#endif
}

#define FL_STAGE(to, change)                                                                                          \
    FL_UNROLL for (int i = 0; i < FL_N; i++) { (to)[i] = x[i] + h * (change); }

/* Stages 2 to 7 of a step of length h from x with slope k[0]; the last state goes to `next`. */
FL_FUNCTION void fl_stages(const double *s, const double *signs, const double *x, double h, double (*k)[FL_N],
                           double *next, int last)
{
    double y[FL_N];
    FL_STAGE(y, fl_a[0] * k[0][i])
    fl_slope(s, signs, y, k[1]);
    FL_STAGE(y, fl_a[1] * k[0][i] + fl_a[2] * k[1][i])
    fl_slope(s, signs, y, k[2]);
    FL_STAGE(y, fl_a[3] * k[0][i] + fl_a[4] * k[1][i] + fl_a[5] * k[2][i])
    fl_slope(s, signs, y, k[3]);
    FL_STAGE(y, fl_a[6] * k[0][i] + fl_a[7] * k[1][i] + fl_a[8] * k[2][i] + fl_a[9] * k[3][i])
    fl_slope(s, signs, y, k[4]);
    FL_STAGE(y, fl_a[10] * k[0][i] + fl_a[11] * k[1][i] + fl_a[12] * k[2][i] + fl_a[13] * k[3][i] + fl_a[14] * k[4][i])
    fl_slope(s, signs, y, k[5]);
    FL_STAGE(next, fl_a[15] * k[0][i] + fl_a[16] * k[2][i] + fl_a[17] * k[3][i] + fl_a[18] * k[4][i] + fl_a[19] * k[5][i])
    if (last) {
        fl_slope(s, signs, next, k[6]);
    }
}

#if !FL_QUICK
/* Binary logarithm of a positive normal number to 2e-5, and power of 2 to 3e-6 (module `simulation::ensemble::pace`). */
FL_FUNCTION double fl_log2(double x)
{
    const double exponent = fl_double((fl_bits(x) >> 52) | 0x4330000000000000ull) - (4503599627370496.0 + 1023.0);
    const double mantissa = fl_double((fl_bits(x) & ((1ull << 52) - 1ull)) | 0x3ff0000000000000ull);
    const double s = (mantissa - 1.0) / (mantissa + 1.0);
    const double square = s * s;
    const double artanh = s * (1.0 + square * (1.0 / 3.0 + square * (1.0 / 5.0 + square * (1.0 / 7.0))));
    return exponent + 2.0 * 1.4426950408889634 * artanh;
}

FL_FUNCTION double fl_exp2(double x)
{
    const double shifted = x + FL_ROUNDER;
    const double y = (x - (shifted - FL_ROUNDER)) * 0.6931471805599453;
    const double power = 1.0 + y * (1.0 + y * (0.5 + y * (1.0 / 6.0 + y * (1.0 / 24.0 + y * (1.0 / 120.0)))));
    return fl_double(fl_bits(power) + (fl_bits(shifted) << 52));
}

FL_FUNCTION double fl_second(double error)
{
    return FL_BETA * fl_log2(error > 1e-4 ? error : 1e-4);
}
#endif

FL_FUNCTION int fl_too_small(double h, double time)
{
    return fabs(h) <= 4.0 * 2.220446049250313e-16 * fabs(time) || fabs(h) < 1e-300;
}

FL_FUNCTION double fl_end_of(const fl_job *job, double time, double h)
{
    return (job->end - time - h) * job->sign <= 0.0 ? job->end : time + h;
}

/* Error of the step tried, its acceptance, and the length of the next one. Returns 1 if it is accepted. */
FL_FUNCTION int fl_judge(const fl_job *job, fl_run *run)
{
    double sum = 0.0, largest = 0.0;
    FL_UNROLL for (int i = 0; i < FL_N; i++) {
        const double e = fl_e[0] * run->k[0][i] + fl_e[1] * run->k[2][i] + fl_e[2] * run->k[3][i] +
                         fl_e[3] * run->k[4][i] + fl_e[4] * run->k[5][i] + fl_e[5] * run->k[6][i];
        const double size = fl_larger(run->x[i], run->next[i]);
        const double scaled = fl_share(run->h * e, job->absolute[i] + job->relative * size);
        sum += scaled * scaled;
        largest = fl_larger(largest, size);
    }
    run->largest = largest;
    const double square = sum * (1.0 / FL_N);
#if FL_QUICK
    /* The logarithm of the root, bounded as below, in single precision. */
    const int holds = square <= 1.0;
    const float of_root = 0.5f * __log2f(fminf(fmaxf((float)square, 1e-20f), 1e20f));
    const float before = holds ? (float)run->second : 0.0f;
    double factor = (double)(0.9f * exp2f((float)-FL_ALPHA * of_root + before));
    const double fresh = (double)((float)FL_BETA * fmaxf(of_root, -13.287712f));
    run->error = square;
#else
    const double error = sqrt(square);
    const int holds = error <= 1.0;
    const double bounded = fl_limit(error, 1e-10, 1e10);
    double factor = FL_SAFETY * fl_exp2(-FL_ALPHA * fl_log2(bounded) + (holds ? run->second : 0.0));
    const double fresh = fl_second(error);
    run->error = error;
#endif
    const double limit = holds ? run->most : 1.0;
    factor = factor < limit ? factor : limit;
    factor = factor > FL_LEAST && square == square ? factor : FL_LEAST;
    double planned = run->h * factor;
    planned = planned < job->longest ? planned : job->longest;
    run->planned = planned > -job->longest ? planned : -job->longest;
    run->end = fl_end_of(job, run->time, run->h);
    run->second = holds ? fresh : run->second;
    run->most = holds ? FL_MOST : 1.0;
    return holds;
}
