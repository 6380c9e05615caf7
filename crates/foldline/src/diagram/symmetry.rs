//! Symmetries of a model.

/// A permutation of the states with changes of sign, (R x)_i = ±x_σ(i). Under a symmetry of x' = f(x) or x ↦ f(x),
/// f(R x) = R f(x), the image of a solution is a solution.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Symmetry {
    /// For each state i, σ(i) and whether the sign changes. States beyond the last keep their value.
    images: Vec<(usize, bool)>,
}

impl Symmetry {
    /// Returns the symmetry that every model has.
    pub fn identity() -> Symmetry {
        Symmetry { images: Vec::new() }
    }

    /// Returns the symmetry that takes state i to ±x_σ(i), given σ(i) and whether the sign changes for every state.
    pub fn new(images: Vec<(usize, bool)>) -> Symmetry {
        let still = images.iter().enumerate().all(|(i, image)| *image == (i, false));
        Symmetry { images: if still { Vec::new() } else { images } }
    }

    /// Returns the change of sign of the states for which `negated` is true.
    pub fn reflection(negated: &[bool]) -> Symmetry {
        Symmetry::new(negated.iter().copied().enumerate().collect())
    }

    /// True if it changes nothing.
    pub fn is_identity(&self) -> bool {
        self.images.is_empty()
    }

    /// Returns σ(i), and whether the sign changes.
    pub fn image(&self, i: usize) -> (usize, bool) {
        self.images.get(i).copied().unwrap_or((i, false))
    }

    /// True if it does more than change signs.
    pub fn permutes(&self) -> bool {
        self.images.iter().enumerate().any(|(i, (from, _))| *from != i)
    }

    /// Number of states n; 0 for the identity.
    pub fn dim(&self) -> usize {
        self.images.len()
    }

    /// Replaces every state x of n components in `states` by R x.
    pub fn apply(&self, states: &mut [f64]) {
        if self.is_identity() {
            return;
        }
        let mut own = vec![0.0; self.dim()];
        for x in states.chunks_exact_mut(self.dim()) {
            own.copy_from_slice(x);
            for (i, value) in x.iter_mut().enumerate() {
                let (from, negated) = self.image(i);
                *value = if negated { -own[from] } else { own[from] };
            }
        }
    }

    /// Returns R x.
    pub fn of(&self, x: &[f64]) -> Vec<f64> {
        let mut image = x.to_vec();
        self.apply(&mut image);
        image
    }

    /// Returns the least and the greatest value of component i of the image of a solution with these `ranges`.
    pub fn range(&self, ranges: &[[f64; 2]], i: usize) -> [f64; 2] {
        let (from, negated) = self.image(i);
        let [low, high] = ranges[from];
        if negated { [-high, -low] } else { [low, high] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_image_of_a_state_is_permuted_and_changes_signs() {
        let turn = Symmetry::new(vec![(1, true), (0, false)]);
        let mut twice = vec![1.0, 2.0, 3.0, 4.0, 5.0];
        turn.apply(&mut twice);
        assert_eq!(twice, [-2.0, 1.0, -4.0, 3.0, 5.0]);
        assert_eq!(turn.range(&[[1.0, 2.0], [3.0, 5.0], [7.0, 8.0]], 0), [-5.0, -3.0]);
        assert_eq!(turn.range(&[[1.0, 2.0], [3.0, 5.0], [7.0, 8.0]], 2), [7.0, 8.0]);
        assert_eq!(Symmetry::reflection(&[false, false]), Symmetry::identity());
        assert_eq!(Symmetry::reflection(&[false, true]).of(&[1.0, 2.0]), [1.0, -2.0]);
    }
}
