//! Rotors given by their matrices.

use crate::model_file::Reader;
use crate::toml_walk::Value;
use foldline_shaft::{Given, Rotor, Station};
use toml::de::DeTable;

/// Maximum number of degrees of freedom: a model can have up to 1000 states.
const MOST: usize = 500;

impl Reader<'_> {
    /// Reads `matrices = { M = [[…]], C = …, K = …, G = …, positions = […] }`.
    pub(super) fn matrices(&mut self, value: &Value, root: &DeTable, rotor: &mut Rotor) {
        let Some(table) = self.walk.table(value, "`matrices`") else { return };
        self.walk.only(table, &["M", "C", "K", "G", "positions"], "`matrices`");
        if let Some(own) = root.get("shaft") {
            let hint = "keep the matrices, or the sections of the shaft";
            return self.walk.report(own.span(), "a rotor with matrices has no `[[shaft]]`", hint);
        }
        let Some(mass) = table.get("M").and_then(|own| self.matrix(own, "M", None)) else {
            if table.get("M").is_none() {
                let hint = "give M and K, and C and G where they are not zero";
                self.walk.report(value.span(), "`matrices` has no mass matrix `M`", hint);
            }
            return;
        };
        let n = mass.len();
        if n % 4 != 0 || n == 0 || n > MOST {
            let message = format!("the matrices have {n} rows");
            let hint = format!(
                "give x, y and the rotations about x and y of each node in this order: 4 rows a node, at most {MOST}"
            );
            return self.walk.report(value.span(), message, hint);
        }
        if table.get("K").is_none() {
            return self.walk.report(value.span(), "`matrices` has no stiffness matrix `K`", "give it");
        }
        let zero = || vec![vec![0.0; n]; n];
        let mut other = |key: &str| match table.get(key) {
            Some(own) => self.matrix(own, key, Some(n)),
            None => Some(zero()),
        };
        let (damping, stiffness, gyroscopic) = (other("C"), other("K"), other("G"));
        let (Some(damping), Some(stiffness), Some(gyroscopic)) = (damping, stiffness, gyroscopic) else { return };
        for (key, matrix, sign) in [("M", &mass, 1.0), ("G", &gyroscopic, -1.0)] {
            self.symmetry(table, key, matrix, sign);
        }
        let nodes = n / 4;
        let positions = match table.get("positions") {
            Some(own) => self.numbers(own, "the positions of the nodes"),
            None => (0..nodes).map(|k| k as f64).collect(),
        };
        if positions.len() != nodes {
            if !positions.is_empty() {
                let message = format!("{} positions for {nodes} nodes", positions.len());
                self.walk.report(value.span(), message, "give the position of every node in m");
            }
            return;
        }
        let station = |(k, z): (usize, &f64)| Station { name: k.to_string(), position: Some(*z) };
        rotor.stations = positions.iter().enumerate().map(station).collect();
        rotor.nodes = nodes;
        rotor.given = Some(Given { mass, damping, stiffness, gyroscopic });
    }

    /// Reads a square matrix, row by row.
    fn matrix(&mut self, value: &Value, key: &str, size: Option<usize>) -> Option<Vec<Vec<f64>>> {
        let Some(list) = value.get_ref().as_array() else {
            self.walk.report(
                value.span(),
                format!("the matrix `{key}` is not a list of rows"),
                "write `[[1, 0], [0, 1]]`",
            );
            return None;
        };
        let n = size.unwrap_or(list.len());
        if list.len() != n {
            let message = format!("the matrix `{key}` has {} rows, and M has {n}", list.len());
            self.walk.report(value.span(), message, "give all matrices the same size");
            return None;
        }
        let mut rows = Vec::with_capacity(n);
        for own in list {
            let row = self.numbers(own, &format!("a row of `{key}`"));
            if row.len() != n {
                if !row.is_empty() {
                    let message = format!("a row of `{key}` has {} numbers instead of {n}", row.len());
                    self.walk.report(own.span(), message, "give a square matrix");
                }
                return None;
            }
            rows.push(row);
        }
        Some(rows)
    }

    /// Reports a mass matrix that is not symmetric, or a gyroscopic matrix that is not skew-symmetric.
    fn symmetry(&mut self, table: &DeTable, key: &str, a: &[Vec<f64>], sign: f64) {
        let n = a.len();
        let largest = a.iter().flatten().fold(0.0, |m: f64, x| m.max(x.abs()));
        let off = (0..n).flat_map(|i| (0..n).map(move |j| (i, j))).find(|&(i, j)| {
            let unit = (a[i][i] * a[j][j]).abs().sqrt().max(a[i][j].abs()).max(1e-9 * largest);
            (a[i][j] - sign * a[j][i]).abs() > 1e-7 * unit
        });
        if let (Some((i, j)), Some(value)) = (off, table.get(key)) {
            let property = if sign > 0.0 { "symmetric" } else { "skew-symmetric" };
            let message = format!(
                "the matrix `{key}` is not {property}: entries ({i}, {j}) and ({j}, {i}) are {} and {}",
                a[i][j], a[j][i]
            );
            self.walk.report(
                value.span(),
                message,
                "check the order of the degrees of freedom: x, y, then rotations about x and y",
            );
        }
    }
}
