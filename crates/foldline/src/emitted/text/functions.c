/* Elementary functions: those of the tape, operation by operation (module `model::kernels`). Without contraction of
   products and sums the results agree to the bit. */

#define FL_ROUNDER 6755399441055744.0

FL_FUNCTION double fl_square(double x)
{
    return x * x;
}

FL_FUNCTION double fl_power_of_two(double k)
{
    return fl_double((fl_bits(k + FL_ROUNDER) + 1023ull) << 52);
}

/* k, r and the rounding error of r, with x = k ln 2 + r. */
FL_FUNCTION double fl_reduce(double x, double *r, double *error)
{
    const double k = (x * 1.4426950408889634 + FL_ROUNDER) - FL_ROUNDER;
    const double high = x - k * fl_double(0x3fe62e42fee00000ull);
    const double low = k * fl_double(0x3dea39ef35793c76ull);
    *r = high - low;
    *error = (high - *r) - low;
    return k;
}

FL_FUNCTION double fl_series(double r)
{
    const double r2 = r * r, r4 = r2 * r2, r8 = r4 * r4;
    const double two = 0.5 + r * (1.0 / 6.0);
    const double four = 1.0 / 24.0 + r * (1.0 / 120.0);
    const double six = 1.0 / 720.0 + r * (1.0 / 5040.0);
    const double eight = 1.0 / 40320.0 + r * (1.0 / 362880.0);
    const double ten = 1.0 / 3628800.0 + r * (1.0 / 39916800.0);
    const double twelve = 1.0 / 479001600.0 + r * (1.0 / 6227020800.0);
    return r2 * (((two + r2 * four) + r4 * (six + r2 * eight)) + r8 * (ten + r2 * twelve));
}

FL_FUNCTION double fl_limit(double x, double low, double high)
{
    x = x > high ? high : x;
    return x < low ? low : x;
}

FL_FUNCTION double fl_exp(double x)
{
    double r, error;
    const double k = fl_reduce(fl_limit(x, -746.0, 710.0), &r, &error);
    const double p = 1.0 + (r + (fl_series(r) + error));
    const double half = (k * 0.5 + FL_ROUNDER) - FL_ROUNDER;
    return p * fl_power_of_two(half) * fl_power_of_two(k - half);
}

FL_FUNCTION double fl_tanh(double x)
{
    double m = copysign(1.0, x);
    /* Beyond this the result rounds to 1; a contact law is there most of the time. */
    if (!(fabs(x) >= 19.5)) {
        double r, error;
        const double k = fl_reduce(2.0 * fabs(x), &r, &error);
        const double s = fl_power_of_two(k);
        m = s * (r + (fl_series(r) + error)) + (s - 1.0);
        m = copysign(fl_divide_plain(m, m + 2.0), x);
    }
    return m;
}

FL_FUNCTION double fl_expm1(double x)
{
    double r, error;
    const double k = fl_reduce(fl_limit(x, -44.0, 40.0), &r, &error);
    const double s = fl_power_of_two(k);
    const double m = s * (r + (fl_series(r) + error)) + (s - 1.0);
    return x > 40.0 ? fl_exp(x) : m;
}

FL_FUNCTION double fl_sech_squared(double x)
{
    const double s = fl_exp(-2.0 * fabs(x));
    const double d = 1.0 + s;
    return fl_divide(4.0 * s, d * d);
}

FL_RARE double fl_hypot_scaled(double a, double b)
{
    const double p = fabs(a), q = fabs(b), m = p > q ? p : q;
    const double big = fl_double((1023ull + 600ull) << 52), small = fl_double((1023ull - 600ull) << 52);
    const double scale = m < 1e-140 ? big : m > 1e150 ? small : 1.0;
    const double back = m < 1e-140 ? small : m > 1e150 ? big : 1.0;
    return fl_sqrt(p * scale * (p * scale) + q * scale * (q * scale)) * back;
}

FL_FUNCTION double fl_hypot(double a, double b)
{
    const double square = a * a + b * b;
    double root = fl_sqrt(square);
    if (!fl_plain(square)) {
        root = fl_hypot_scaled(a, b);
    }
    return root;
}

FL_FUNCTION double fl_sign(double x)
{
    return x > 0.0 ? 1.0 : x < 0.0 ? -1.0 : x;
}

FL_FUNCTION double fl_heaviside(double x)
{
    return 0.5 * (fl_sign(x) + 1.0);
}

FL_FUNCTION double fl_min(double a, double b)
{
    return a < b || a != a ? a : b;
}

FL_FUNCTION double fl_max(double a, double b)
{
    return a > b || a != a ? a : b;
}

/* (e^x - 1)/x and its derivatives (module `model::exprel`). */
FL_FUNCTION double fl_exprel(double x)
{
    const double quotient = fl_divide(fl_expm1(x), x);
    return x == 0.0 ? 1.0 : quotient;
}

FL_RARE double fl_exprel_derivative(int order, double x)
{
    const double m = order;
    double value = fl_exprel(x), term = 1.0, sum = 1.0 / (m + 1.0);
    if (x != x) {
        return x;
    }
    if (fabs(x) > m + 2.0) {
        for (int k = 1; k <= order; k++) {
            value = (fl_exp(x) - k * value) / x;
        }
        return value;
    }
    for (int j = 1; j < 400; j++) {
        term = x >= 0.0 ? term * x / j : term * -x / (m + j);
        const double more = term / (j + m + 1.0);
        sum += more;
        if (more < 1e-18 * sum) {
            break;
        }
    }
    return x >= 0.0 ? sum : fl_exp(x) * sum;
}
