//! Orthonormal basis of what many vectors span.

use super::{axpy, dot};

/// Length, relative to the longest vector, below which what is left of a vector is rounding.
const ROUNDING: f64 = 1e-12;

/// Orthonormal basis `[r][n]` of the span of the given vectors `[n]` by orthogonalisation, the longest first; `None` if there are more
/// than `most` directions. Exact up to 1e-12 of the longest vector.
pub fn spanned(mut left: Vec<Vec<f64>>, most: usize) -> Option<Vec<f64>> {
    let norm = |v: &Vec<f64>| dot(v, v).sqrt();
    let largest = left.iter().map(norm).fold(0.0, f64::max);
    let (mut basis, mut count) = (Vec::new(), 0);
    loop {
        let next = left.iter().max_by(|a, b| norm(a).total_cmp(&norm(b))).filter(|v| norm(v) > ROUNDING * largest);
        let Some(next) = next else { return Some(basis) };
        if count == most {
            return None;
        }
        let length = norm(next);
        let own: Vec<f64> = next.iter().map(|x| x / length).collect();
        for v in &mut left {
            // Twice, so that rounding leaves nothing behind.
            for _ in 0..2 {
                let along = dot(&own, v);
                axpy(-along, &own, v);
            }
        }
        left.retain(|v| norm(v) > ROUNDING * largest);
        basis.extend(own);
        count += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::spanned;

    #[test]
    fn directions_are_counted_and_orthonormal() {
        let vectors = vec![vec![3.0, 0.0, 4.0], vec![6.0, 0.0, 8.0], vec![1.0, 1.0, 0.0]];
        let basis = spanned(vectors.clone(), 2).unwrap();
        assert_eq!(basis.len(), 6);
        let product: f64 = (0..3).map(|i| basis[i] * basis[3 + i]).sum();
        assert!(product.abs() < 1e-15, "{product}");
        assert_eq!(spanned(vectors, 1), None);
    }
}
