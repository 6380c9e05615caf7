/* Switches: their signs, and the first sign change within a step (modules `simulation::kink`, `section` and `root`).
   Rarely executed; works on a copy of the trajectory. */

#if FL_SWITCHES || FL_SECTION
FL_TABLE fl_d[6] = {
    -12715105075.0 / 11282082432.0, 87487479700.0 / 32700410799.0, -10690763975.0 / 1880347072.0,
    701980252875.0 / 199316789632.0, -1453857185.0 / 822651844.0, 69997945.0 / 29380423.0};

/* Continuous solution of a component along the step tried. */
FL_FUNCTION double fl_at(const fl_run *run, int i, double theta)
{
    const double h = run->h, change = run->next[i] - run->x[i];
    const double b = h * run->k[0][i] - change, c = change - h * run->k[6][i] - b;
    const double d = h * (fl_d[0] * run->k[0][i] + fl_d[1] * run->k[2][i] + fl_d[2] * run->k[3][i] +
                          fl_d[3] * run->k[4][i] + fl_d[4] * run->k[5][i] + fl_d[5] * run->k[6][i]);
    const double rest = 1.0 - theta;
    return theta == 1.0 ? run->next[i] : run->x[i] + theta * (change + rest * (b + theta * (c + rest * d)));
}

FL_FUNCTION void fl_state_at(const fl_run *run, double theta, double *x)
{
    FL_UNROLL for (int i = 0; i < FL_N; i++) {
        x[i] = fl_at(run, i, theta);
    }
}

/* A scalar function along a step. `switch_` is the number of a switch, or -1 for the section. */
typedef struct {
    const fl_job *job;
    const fl_run *run;
    int switch_;
    double factor;
} fl_course;

/* Value at a state. */
FL_FUNCTION double fl_of(const fl_course *course, const double *x)
{
#if FL_SWITCHES
    if (course->switch_ >= 0) {
        double values[FL_SWITCHES];
        fl_switches(FL_S(course->job, course->run), FL_TIME(x), x, values);
        return course->factor * values[course->switch_];
    }
#endif
#if FL_SECTION
    double value = -course->job->level;
    for (int i = 0; i < FL_N; i++) {
        value += course->job->plane[i] * x[i];
    }
    return course->factor * value;
#else
    return 0.0;
#endif
}

/* Value at a fraction of the step: on the continuous solution, or by a step that ends there. */
FL_RARE double fl_value(const fl_course *course, double theta, int exactly)
{
    double x[FL_N];
    const fl_run *run = course->run;
    if (exactly && theta > 0.0 && theta < 1.0) {
        double k[7][FL_N];
        for (int i = 0; i < FL_N; i++) {
            k[0][i] = run->k[0][i];
        }
        fl_stages(FL_S(course->job, run), FL_SIGNS(run), run->x, theta * run->h, k, x, 0);
    } else {
        fl_state_at(run, theta, x);
    }
    return fl_of(course, x);
}

/* Minimum between a and b, and its place; stops early below zero. */
FL_RARE double fl_lowest(const fl_course *course, double factor, double a, double b, int exactly, double *place)
{
    const double golden = 0.6180339887498949;
    double c = b - golden * (b - a), d = a + golden * (b - a);
    double gc = factor * fl_value(course, c, exactly), gd = factor * fl_value(course, d, exactly);
    while (b - a > 1e-8 && gc >= 0.0 && gd >= 0.0) {
        if (gc < gd) {
            b = d, d = c, gd = gc;
            c = b - golden * (b - a);
            gc = factor * fl_value(course, c, exactly);
        } else {
            a = c, c = d, gc = gd;
            d = a + golden * (b - a);
            gd = factor * fl_value(course, d, exactly);
        }
    }
    *place = gc < gd ? c : d;
    return gc < gd ? gc : gd;
}

/* Root between a and b, at which the values have opposite signs (oliveira2021). */
FL_RARE double fl_root(const fl_course *course, double a, double b, double ga, double gb)
{
    const double width = 1e-15;
    if (ga == 0.0 || gb == 0.0) {
        return ga == 0.0 ? a : b;
    }
    const int rising = gb > ga;
    const double truncation = 0.2 / (b - a);
    const double halvings = ceil(log2((b - a) / (2.0 * width)));
    double allowance = width * ldexp(1.0, (int)(halvings > 0.0 ? halvings : 0.0) + 1);
    while (b - a > 2.0 * width) {
        const double middle = 0.5 * (a + b);
        const double projection = fmax(allowance - 0.5 * (b - a), 0.0);
        const double secant = (gb * a - ga * b) / (gb - ga);
        const double truncated = truncation * (b - a) * (b - a);
        const double towards = copysign(1.0, middle - secant);
        const double estimate = truncated <= fabs(middle - secant) ? secant + towards * truncated : middle;
        double x = fabs(estimate - middle) <= projection ? estimate : middle - towards * projection;
        x = x != x ? middle : fmin(fmax(x, a + width), b - width);
        if (x <= a || x >= b) {
            break;
        }
        const double gx = fl_value(course, x, 1);
        if (gx != gx) {
            break;
        }
        if (gx == 0.0) {
            return x;
        }
        if ((gx > 0.0) == rising) {
            b = x, gb = gx;
        } else {
            a = x, ga = gx;
        }
        allowance *= 0.5;
    }
    return fmin(fmax((gb * a - ga * b) / (gb - ga), a), b);
}

#define FL_MOST_SAMPLES 9

/* Adds the extrema beyond zero between samples of one sign; returns the number of samples, which stay in order. */
FL_RARE int fl_insert_extrema(const fl_course *course, double (*samples)[2], int count, int exactly)
{
    double extrema[FL_MOST_SAMPLES][2], largest = 0.0;
    int added = 0;
    for (int c = 0; c < count; c++) {
        largest = fmax(largest, fabs(samples[c][1]));
    }
    for (int c = 0; c < count; c++) {
        const double sign = copysign(1.0, samples[c][1]);
        const int left = c > 0 ? c - 1 : 0, right = c + 1 < count ? c + 1 : count - 1;
        const double low = sign * samples[c][1], before = sign * samples[left][1], after = sign * samples[right][1];
        if (!(low > 0.0 && before >= low && after >= low)) {
            continue;
        }
        const double p = c == 0 ? low : right == c ? low : before;
        const double q = c == 0 ? sign * samples[1][1] : right == c ? before : low;
        const double r = c == 0 ? sign * samples[2][1] : right == c ? sign * samples[c - 2][1] : after;
        const double curvature = p - 2.0 * q + r;
        const double slope = c == left || c == right ? 0.5 * (4.0 * q - 3.0 * p - r) : 0.5 * (r - p);
        const double estimate = low - (curvature > 0.0 ? 0.5 * slope * slope / curvature : 0.0);
        if (estimate < 0.02 * largest) {
            double place;
            const double lowest = fl_lowest(course, sign, samples[left][0], samples[right][0], exactly, &place);
            if (lowest <= 0.0) {
                extrema[added][0] = place;
                extrema[added][1] = sign * lowest;
                added++;
            }
        }
    }
    for (int e = 0; e < added; e++) {
        int at = count++;
        for (; at > 0 && samples[at - 1][0] > extrema[e][0]; at--) {
            samples[at][0] = samples[at - 1][0];
            samples[at][1] = samples[at - 1][1];
        }
        samples[at][0] = extrema[e][0];
        samples[at][1] = extrema[e][1];
    }
    return count;
}
#endif

#if FL_SWITCHES
/* First zero of a switch along the step, from its values at the start and at every quarter; 2 if there is none. */
FL_RARE double fl_zero(const fl_course *course, const double *values)
{
    double samples[2 * FL_MOST_SAMPLES][2];
    for (int c = 0; c < 5; c++) {
        samples[c][0] = 0.25 * c;
        samples[c][1] = values[c];
    }
    const int count = fl_insert_extrema(course, samples, 5, 0);
    for (int c = 0; c + 1 < count; c++) {
        double a = samples[c][0];
        const double b = samples[c + 1][0], ga = samples[c][1], gb = samples[c + 1][1];
        if (gb >= 0.0) {
            continue;
        }
        if (ga <= 0.0) {
            double summit;
            if (fl_lowest(course, -1.0, a, b, 0, &summit) >= 0.0) {
                return a;
            }
            a = summit;
        }
        const double low = a == 0.0 ? ga : fl_value(course, a, 1), high = fl_value(course, b, 1);
        if (high >= 0.0) {
            continue;
        }
        return low <= 0.0 ? a : fl_root(course, a, b, low, high);
    }
    return 2.0;
}

/* First sign change of a switch within the step tried, which then ends there. Returns the switch, or -1; its fraction
   of the step goes to `theta`. `ahead` holds the switches at every quarter. */
FL_RARE int fl_shorten(const fl_job *job, fl_run *run, double (*ahead)[FL_SWITCHES], double *theta)
{
    int found = -1;
    *theta = 2.0;
    for (int switch_ = 0; switch_ < FL_SWITCHES; switch_++) {
        double values[5], low = 1.7976931348623157e308, high = 0.0;
        for (int c = 0; c < 5; c++) {
            values[c] = run->signs[switch_] * (c == 0 ? run->switches[switch_] : ahead[c - 1][switch_]);
            values[c] = c == 0 ? fmax(values[c], 0.0) : values[c];
            low = fmin(low, values[c]);
            high = fmax(high, values[c]);
        }
        if (low > 0.5 * high) {
            continue;
        }
        const fl_course course = {job, run, switch_, run->signs[switch_]};
        const double place = fl_zero(&course, values);
        if (place < *theta && place <= 1.0) {
            *theta = place;
            found = switch_;
        }
    }
    if (found >= 0) {
        const double length = *theta * run->h;
        fl_stages(FL_S(job, run), run->signs, run->x, length, run->k, run->next, 1);
        run->h = length;
        run->end = fl_end_of(job, run->time, length);
    }
    return found;
}

/* Continues beyond the kink reached: with the opposite sign of the switch. Returns how the trajectory ended, if so. */
FL_RARE int fl_pass(const fl_job *job, fl_run *run, int switch_, double theta)
{
    int outcome = FL_GOING;
    fl_switches(FL_S(job, run), FL_TIME(run->x), run->x, run->switches);
    run->stuck = theta < 1e-8 ? run->stuck + 1 : 0;
    if (run->stuck > 50) {
        outcome = FL_STEP_TOO_SMALL;
    } else if (run->stuck > 0) {
        double speeds[2] = {0.0, 0.0};
        fl_speeds(FL_S(job, run), FL_TIME(run->x), run->x, run->signs, switch_, speeds);
        if (job->sign * speeds[0] > 0.0 && job->sign * speeds[1] < 0.0) {
            outcome = FL_SLIDES;
        }
    }
    run->signs[switch_] = -run->signs[switch_];
    fl_slope(FL_S(job, run), run->signs, run->x, run->k[0]);
    run->switches[switch_] = 0.0;
    return outcome;
}

/* Initial signs of the switches, taken slightly later for a trajectory that starts on a zero. */
FL_RARE void fl_first_signs(const fl_job *job, fl_run *run)
{
    double f[FL_N], moved[FL_N], later[FL_SWITCHES];
    fl_switches(FL_S(job, run), FL_TIME(run->x), run->x, run->switches);
    fl_field(FL_S(job, run), FL_TIME(run->x), run->x, f);
    for (int i = 0; i < FL_N; i++) {
        moved[i] = run->x[i] + job->sign * 1e-9 * f[i];
    }
    fl_switches(FL_S(job, run), FL_TIME(moved), moved, later);
    for (int c = 0; c < FL_SWITCHES; c++) {
        run->signs[c] = copysign(1.0, run->switches[c] == 0.0 ? later[c] : run->switches[c]);
    }
}
#endif
