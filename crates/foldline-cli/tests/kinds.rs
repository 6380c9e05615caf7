//! Boundary-value problems, connecting orbits, maps and branches with held quantities: each kind is stopped, cut off as by a kill,
//! resumed, verified by an independent route, and exported.

use std::path::{Path, PathBuf};
use std::process::Command;

/// A kind of problem: the model in `models`, a study, and the parameter whose values are compared.
struct Kind {
    model: &'static str,
    study: &'static str,
    parameter: &'static str,
}

const BOUNDARY: Kind = Kind {
    model: "thermal-explosion",
    study: "[[seed]]\nname = \"cold\"\nstate = \"zero\"\n\
        [[branch]]\nname = \"slab\"\nfrom = \"cold\"\nfree = \"p\"\nrange = [0, 8]\nmark = { p = 4 }\n\
        [[curve]]\nname = \"folds\"\nhold = \"fold\"\nof = \"slab\"\nfree = \"e\"\nrange = [0.2, 0.3]\n",
    parameter: "p",
};

const HELD_BOUNDARY: Kind = Kind {
    model: "thermal-explosion",
    study: "[[seed]]\nname = \"cold\"\nstate = \"zero\"\n\
        [[branch]]\nname = \"slab\"\nfrom = \"cold\"\nfree = \"p\"\nrange = [0, 4]\n\
        [[branch]]\nname = \"level\"\nfrom = \"slab\"\nfree = [\"e\", \"p\"]\nhold = { \"u@0.5\" = 0.8 }\n\
        range = { e = [0, 0.6], p = [0, 8] }\nmark = { e = [0.1, 0.4] }\n",
    parameter: "p",
};

const CONNECTING: Kind = Kind {
    model: "duffing-van-der-pol",
    study: "[[seed]]\nname = \"saddle\"\nstate = { x = 0, v = 0 }\n\
        [[branch]]\nname = \"rest\"\nfrom = \"saddle\"\nfree = \"nu\"\nrange = [0.5, 1.5]\n\
        [[curve]]\nname = \"loop\"\nhold = \"homoclinic\"\nof = \"rest\"\nfree = \"eps\"\nrange = [0.05, 0.6]\nmark = { eps = [0.1, 0.5] }\n",
    parameter: "nu",
};

const MAP: Kind = Kind {
    model: "henon",
    study: "[[seed]]\nname = \"seed\"\nstate = { x = 0.2, y = 0.2 }\nparameters = { alpha = 0.3 }\n\
        [[branch]]\nname = \"fixed\"\nfrom = \"seed\"\nfree = \"alpha\"\nrange = [-1, 1.6]\nswitch = { period-doubling = 3 }\n",
    parameter: "alpha",
};

const HELD: Kind = Kind {
    model: "duffing-forced",
    study: "[[seed]]\nname = \"slow\"\nattractor = \"cycle\"\nparameters = { omega = 0.5, A = 0.06, zeta = 0.02 }\nsamples = 8\n\
        [[branch]]\nname = \"response\"\nfrom = \"slow\"\nfree = \"omega\"\nrange = [0.5, 1.8]\n\
        [[branch]]\nname = \"height\"\nfrom = \"response\"\nfree = [\"omega\", \"A\"]\nhold = { x_h1 = 0.5 }\nrange = { omega = [0.8, 1.5], A = [0, 0.3] }\n",
    parameter: "omega",
};

fn foldline(folder: &Path, arguments: &[&str], codes: &[i32]) -> String {
    let output = Command::new(env!("CARGO_BIN_EXE_foldline")).args(arguments).current_dir(folder).output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.code().is_some_and(|code| codes.contains(&code)), "{arguments:?}: {said}");
    String::from_utf8(output.stdout).unwrap()
}

/// The cells of the columns `names` in a table without commas in cells.
fn columns(csv: &str, names: [&str; 3]) -> Vec<[String; 3]> {
    let mut lines = csv.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let heads = lines.next().unwrap();
    let at =
        names.map(|name| heads.iter().position(|head| *head == name).unwrap_or_else(|| panic!("{name}: {heads:?}")));
    lines.map(|cells| at.map(|k| cells[k].to_string())).collect()
}

impl Kind {
    /// A folder with the study and a finished run `whole`.
    fn desk(&self) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        let models = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models");
        std::fs::copy(models.join(format!("{}.toml", self.model)), folder.path().join("m.toml")).unwrap();
        std::fs::write(folder.path().join("s.toml"), format!("model = \"m.toml\"\ntolerance = 1e-7\n{}", self.study))
            .unwrap();
        foldline(folder.path(), &["run", "s.toml", "--out", "whole", "--jobs", "1"], &[0]);
        folder
    }

    /// Branch, kind and parameter of all special points.
    fn special(&self, folder: &Path, run: &str) -> Vec<(String, String, f64)> {
        let csv = foldline(folder, &["table", run, "--format", "csv"], &[0]);
        let all = columns(&csv, ["branch", "kind", self.parameter]);
        all.into_iter().map(|[branch, kind, value]| (branch, kind, value.parse().unwrap())).collect()
    }

    #[track_caller]
    fn same(&self, folder: &Path, run: &str) {
        let [found, expected] = [run, "whole"].map(|run| self.special(folder, run));
        assert!(!expected.is_empty());
        assert_eq!(found.len(), expected.len(), "{run}: {found:?} {expected:?}");
        // The first step after resuming may differ, so results agree to the tolerance.
        for (a, b) in found.iter().zip(&expected) {
            assert!((&a.0, &a.1) == (&b.0, &b.1) && (a.2 - b.2).abs() < 1e-7 * (1.0 + b.2.abs()), "{run}: {a:?} {b:?}");
        }
    }

    /// The finished run cut off after some accepted points, which has the effect of a kill, and resumed.
    fn goes_on_after_a_kill(&self) {
        let desk = self.desk();
        let folder = desk.path();
        let whole = rusqlite::Connection::open(folder.join("whole/run.sqlite")).unwrap();
        let count: i64 = whole.query_row("SELECT count(*) FROM points", [], |row| row.get(0)).unwrap();
        for kept in [1, count / 3, 2 * count / 3, count - 2] {
            let out = format!("cut{kept}");
            std::fs::create_dir(folder.join(&out)).unwrap();
            let file: PathBuf = folder.join(&out).join("run.sqlite");
            std::fs::copy(folder.join("whole/run.sqlite"), &file).unwrap();
            crate::runs::cut_off(&file, kept);
            foldline(folder, &["run", "s.toml", "--out", &out, "--jobs", "1", "--resume"], &[0]);
            self.same(folder, &out);
        }
        // Stopped by its user; whatever was reached is kept.
        let limited = ["run", "s.toml", "--out", "short", "--jobs", "1", "--time-limit", "0.01s"];
        foldline(folder, &limited, &[0, 3]);
        foldline(folder, &["run", "s.toml", "--out", "short", "--jobs", "1", "--resume"], &[0]);
        self.same(folder, "short");
    }

    fn is_verified(&self) {
        let desk = self.desk();
        let said = foldline(desk.path(), &["verify", "whole"], &[0]);
        assert!(
            said.contains("100.0 % within the stated error") || said.contains(" 0 outside the stated error"),
            "{said}"
        );
    }

    /// Tables, CSV and NetCDF have the values of the parameter.
    fn is_exported(&self) {
        let desk = self.desk();
        let folder = desk.path();
        let special = self.special(folder, "whole");
        let json = foldline(folder, &["table", "whole", "--format", "json"], &[0]);
        for (branch, kind, value) in &special {
            assert!(json.contains(branch.as_str()) && json.contains(kind.as_str()), "{branch} {kind}");
            assert!(json.contains(&format!("{value:?}")) || json.contains(&format!("{value}")), "{value}: {json}");
        }
        foldline(folder, &["export", "whole", "--format", "csv"], &[0]);
        let points = std::fs::read_to_string(folder.join("whole/csv/points.csv")).unwrap();
        let table = foldline(folder, &["table", "whole", "--points", "--format", "csv"], &[0]);
        assert_eq!(points.lines().count(), table.lines().count());
        assert!(points.lines().next().unwrap().split(',').any(|head| head == self.parameter), "{points}");
        foldline(folder, &["export", "whole", "--format", "netcdf"], &[0]);
        let bytes = std::fs::read(folder.join("whole/run.nc")).unwrap();
        // The signature of HDF5.
        assert!(bytes.starts_with(b"\x89HDF\r\n\x1a\n") && bytes.len() > 1000);
    }
}

macro_rules! kinds {
    ($($kill:ident, $verify:ident, $export:ident: $kind:ident;)*) => {
        $(
            #[test]
            fn $kill() {
                $kind.goes_on_after_a_kill();
            }
            #[test]
            fn $verify() {
                $kind.is_verified();
            }
            #[test]
            fn $export() {
                $kind.is_exported();
            }
        )*
    };
}

kinds! {
    boundary_value_problems_go_on_after_a_kill, boundary_value_problems_are_verified, boundary_value_problems_are_exported: BOUNDARY;
    held_boundary_value_problems_go_on_after_a_kill, held_boundary_value_problems_are_verified,
        held_boundary_value_problems_are_exported: HELD_BOUNDARY;
    connecting_orbits_go_on_after_a_kill, connecting_orbits_are_verified, connecting_orbits_are_exported: CONNECTING;
    maps_go_on_after_a_kill, maps_are_verified, maps_are_exported: MAP;
    held_quantities_go_on_after_a_kill, held_quantities_are_verified, held_quantities_are_exported: HELD;
}
