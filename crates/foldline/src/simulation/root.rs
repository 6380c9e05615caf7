//! Roots and minima of a scalar function on a bracket.
//!
//! **Source.** oliveira2021 (interpolate, truncate, project: never slower than bisection); kiefer1953 (golden section).

/// Root of `g` between `a` and `b`, at which its values `ga` and `gb` have opposite signs, to about `width` in the
/// argument.
pub(super) fn root(mut g: impl FnMut(f64) -> f64, [a, b]: [f64; 2], [ga, gb]: [f64; 2], width: f64) -> f64 {
    let (mut a, mut b, mut ga, mut gb) = (a, b, ga, gb);
    if ga == 0.0 {
        return a;
    }
    if gb == 0.0 {
        return b;
    }
    let rising = gb > ga;
    let truncation = 0.2 / (b - a);
    let mut allowance = width * 2f64.powi(((b - a) / (2.0 * width)).log2().ceil().max(0.0) as i32 + 1);
    while b - a > 2.0 * width {
        let middle = 0.5 * (a + b);
        let projection = (allowance - 0.5 * (b - a)).max(0.0);
        let secant = (gb * a - ga * b) / (gb - ga);
        let truncated = truncation * (b - a) * (b - a);
        let towards = (middle - secant).signum();
        let estimate = if truncated <= (middle - secant).abs() { secant + towards * truncated } else { middle };
        let x = if (estimate - middle).abs() <= projection { estimate } else { middle - towards * projection };
        // An estimate that rounding places on an end is moved inside, so that the next bracket is narrow.
        let x = if x.is_nan() { middle } else { x.max(a + width).min(b - width) };
        if x <= a || x >= b {
            break;
        }
        let gx = g(x);
        if gx.is_nan() {
            break;
        }
        if gx == 0.0 {
            return x;
        }
        if (gx > 0.0) == rising {
            (b, gb) = (x, gx);
        } else {
            (a, ga) = (x, gx);
        }
        allowance *= 0.5;
    }
    // The secant through the last bracket is closer than either of its ends.
    ((gb * a - ga * b) / (gb - ga)).max(a).min(b)
}

/// Minimiser of `g` between `a` and `b`, and the value there; stops early once the value is below zero.
pub(super) fn lowest(mut g: impl FnMut(f64) -> f64, [a, b]: [f64; 2]) -> (f64, f64) {
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    let (mut a, mut b) = (a, b);
    let (mut c, mut d) = (b - GOLDEN * (b - a), a + GOLDEN * (b - a));
    let (mut gc, mut gd) = (g(c), g(d));
    // The function is quadratic near the minimum: an argument more accurate than √ε gains nothing.
    while b - a > 1e-8 && gc >= 0.0 && gd >= 0.0 {
        if gc < gd {
            (b, d, gd) = (d, c, gc);
            c = b - GOLDEN * (b - a);
            gc = g(c);
        } else {
            (a, c, gc) = (c, d, gd);
            d = a + GOLDEN * (b - a);
            gd = g(d);
        }
    }
    if gc < gd { (c, gc) } else { (d, gd) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roots_are_found_to_the_width_and_never_much_slower_than_by_bisection() {
        type Case = (fn(f64) -> f64, f64);
        let cases: [Case; 4] = [
            (|x| x * x - 0.5, 0.5f64.sqrt()),
            (|x| (20.0 * (x - 0.9)).tanh(), 0.9),
            (|x| (x - 0.3).powi(9), 0.3),
            (|x| if x < 0.123 { -1e-9 } else { 1.0 }, 0.123),
        ];
        for (g, exact) in cases {
            let mut evaluations = 0;
            let x = root(
                |x| {
                    evaluations += 1;
                    g(x)
                },
                [0.0, 1.0],
                [g(0.0), g(1.0)],
                1e-13,
            );
            assert!((x - exact).abs() < 4e-13, "{x} against {exact}");
            // Bisection needs 43 = ⌈log₂(1 / 2e-13)⌉ evaluations, this method at most one more and one for the end.
            assert!(evaluations <= 45, "{evaluations}");
        }
    }

    #[test]
    fn a_shallow_dip_below_zero_is_found() {
        let (x, value) = lowest(|x| (x - 0.37).powi(2) - 1e-12, [0.0, 1.0]);
        assert!(value < 0.0 && (x - 0.37).abs() < 1e-6);
        let (x, value) = lowest(|x| (x - 0.37).powi(2) + 1e-3, [0.0, 1.0]);
        assert!((x - 0.37).abs() < 1e-7 && (value - 1e-3).abs() < 1e-14);
    }
}
