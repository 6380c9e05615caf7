/* Everything below is plain C99 with the following macros. Compiled as CUDA the entry is the kernel `fl_kernel`, which
   any number of threads may run; compiled as C it is the function `fl_run_all`. */

#ifdef __CUDACC__
#define FL_FUNCTION static __device__ __forceinline__
#define FL_RARE static __device__ __noinline__
#define FL_TABLE static __constant__ double
#define FL_UNROLL _Pragma("unroll")
FL_FUNCTION unsigned long long fl_bits(double x) { return (unsigned long long)__double_as_longlong(x); }
FL_FUNCTION double fl_double(unsigned long long bits) { return __longlong_as_double((long long)bits); }
#else
#include <math.h>
#include <string.h>
#define FL_FUNCTION static inline
#ifdef __GNUC__
#define FL_RARE static __attribute__((unused))
#else
#define FL_RARE static
#endif
#define FL_TABLE static const double
#define FL_UNROLL
FL_FUNCTION unsigned long long fl_bits(double x) { unsigned long long bits; memcpy(&bits, &x, 8); return bits; }
FL_FUNCTION double fl_double(unsigned long long bits) { double x; memcpy(&x, &bits, 8); return x; }
#endif

/* FL_QUICK: on a card, unless FL_EXACT is defined. Step lengths come from single-precision logarithms, from sizes and
   reciprocals of 20 bits, so they differ from those of the exact control in the sixth digit. Quotients and roots are
   refined to full precision without the branches of the general ones; they are wrong where a denominator is subnormal
   or above 1e307. */
#if defined(__CUDACC__) && !defined(FL_EXACT)
#define FL_QUICK 1
FL_FUNCTION double fl_reciprocal(double b)
{
    double y;
    asm("rcp.approx.ftz.f64 %0, %1;" : "=d"(y) : "d"(b));
    return y;
}

FL_FUNCTION double fl_share(double a, double b)
{
    return a * fl_reciprocal(b);
}

/* Quotient for a denominator of moderate size. */
FL_FUNCTION double fl_divide_plain(double a, double b)
{
    const double first = fl_reciprocal(b), e = fma(-b, first, 1.0);
    const double y = fma(first, fma(e, e, e), first), q = a * y;
    return fma(fma(-b, q, a), y, q);
}

FL_FUNCTION double fl_divide(double a, double b)
{
    const unsigned size = __double2hiint(b) & 0x7fffffff;
    const double q = fl_divide_plain(a, b);
    return size - 0x00100000u < 0x7fd00000u - 0x00100000u ? q : a * fl_reciprocal(b);
}

FL_FUNCTION double fl_sqrt(double x)
{
    double y;
    asm("rsqrt.approx.ftz.f64 %0, %1;" : "=d"(y) : "d"(x));
    double g = x * y, h = 0.5 * y;
    const double r = fma(-g, h, 0.5);
    g = fma(g, r, g);
    h = fma(h, r, h);
    g = fma(fma(-g, g, x), h, g);
    /* Zero, infinity and NaN are their own roots, up to the sign. */
    const unsigned size = __double2hiint(x);
    return size - 0x00100000u < 0x7fe00000u ? g : x < 0.0 ? y : x;
}

/* Magnitude of the larger of two numbers, to 20 bits. */
FL_FUNCTION double fl_larger(double a, double b)
{
    const int p = __double2hiint(a) & 0x7fffffff, q = __double2hiint(b) & 0x7fffffff;
    return __hiloint2double(p > q ? p : q, 0);
}

/* True if a square lies in the range in which a plain root needs no scaling. */
FL_FUNCTION int fl_plain(double square)
{
    return (unsigned)(__double2hiint(square) - (124 << 20)) < (unsigned)(1890 << 20);
}
#else
#define FL_QUICK 0
FL_FUNCTION double fl_share(double a, double b) { return a / b; }
FL_FUNCTION double fl_divide(double a, double b) { return a / b; }
FL_FUNCTION double fl_divide_plain(double a, double b) { return a / b; }
FL_FUNCTION double fl_sqrt(double x) { return sqrt(x); }
FL_FUNCTION double fl_larger(double a, double b) { return fmax(fabs(a), fabs(b)); }
FL_FUNCTION int fl_plain(double square) { return square >= 1e-279 && square <= 1e299; }
#endif
