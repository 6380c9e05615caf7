//! Forces that jump or have kinks at given instants of the period, written with `mod(t, T)`: the switch of a comparison jumps
//! together with the sawtooth, also at the instant 0 at which the period begins. The response of a linear oscillator follows from
//! the Fourier series of the force.

use std::f64::consts::TAU;
use std::process::Command;

/// Mean square of the response of x'' + 0.1 x' + x to pieces (begin, end, value, slope) of a force of period 1 in t/T.
fn mean_square(pieces: &[(f64, f64, f64, f64)], period: f64) -> [f64; 2] {
    let mean: f64 = pieces.iter().map(|(a, b, v, s)| v * (b - a) + 0.5 * s * (b - a).powi(2)).sum();
    let mut sum = mean * mean;
    for k in 1..4000 {
        let w = TAU * f64::from(k);
        // ∫ (v + s (τ - a)) e^{-iwτ} dτ over [a, b].
        let mut c = [0.0, 0.0];
        for (a, b, v, s) in pieces {
            let end = v + s * (b - a);
            let at = |tau: f64, value: f64| {
                let (sin, cos) = (w * tau).sin_cos();
                // value e^{-iwτ} i/w + s e^{-iwτ}/w²
                [value * sin / w + s * cos / (w * w), value * cos / w - s * sin / (w * w)]
            };
            let (high, low) = (at(*b, end), at(*a, *v));
            (c[0], c[1]) = (c[0] + high[0] - low[0], c[1] + high[1] - low[1]);
        }
        let omega = w / period;
        let gain = (1.0 - omega * omega).powi(2) + (0.1 * omega).powi(2);
        sum += 2.0 * (c[0] * c[0] + c[1] * c[1]) / gain;
    }
    [mean, sum.sqrt()]
}

#[test]
fn pulse_trains_and_tables_over_the_period_give_the_response_of_their_fourier_series() {
    let table = "[tables.f]\nx = [0, 0.2, 0.5, 0.6, 1.0]\ny = [0, 1, -0.5, 0.8, 0]\n";
    let lines = [(0.0, 0.2, 0.0, 5.0), (0.2, 0.5, 1.0, -5.0), (0.5, 0.6, -0.5, 13.0), (0.6, 1.0, 0.8, -2.0)];
    let cases = [
        ("", "if(mod(t, T) < 0.3*T, 1, 0)", vec![(0.0, 0.3, 1.0, 0.0)]),
        ("", "if(mod(t + 0.4*T, T) < 0.3*T, 1, 0)", vec![(0.0, 0.3, 1.0, 0.0)]),
        ("", "max(mod(t, T)/T - 0.5, 0)", vec![(0.5, 1.0, 0.0, 1.0)]),
        ("", "abs(mod(t, T)/T - 0.5)", vec![(0.0, 0.5, 0.5, -1.0), (0.5, 1.0, 0.0, 1.0)]),
        (table, "f(mod(t, T)/T)", lines.to_vec()),
        (table, "f(mod(t + 0.3*T, T)/T)", lines.to_vec()),
    ];
    for (tables, force, pieces) in cases {
        let folder = std::env::temp_dir().join(format!("foldline-pulses-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let model = format!(
            "[parameters]\nT = 7.0\n[forcing]\nperiod = \"T\"\n{tables}[states]\n\"x''\" = \"-0.1*x' - x + {force}\"\n"
        );
        std::fs::write(folder.join("model.toml"), model).unwrap();
        let study = "model = \"model.toml\"\ntolerance = 1e-7\n[[seed]]\nname = \"s\"\nattractor = \"cycle\"\nsamples = 4\n[[branch]]\nname = \
                     \"b\"\nfrom = \"s\"\nfree = \"T\"\nrange = [6, 13.5]\nmark = { T = [7, 13] }\n";
        std::fs::write(folder.join("study.toml"), study).unwrap();
        let command = |arguments: &[&str]| {
            Command::new(env!("CARGO_BIN_EXE_foldline")).args(arguments).current_dir(&folder).output().unwrap()
        };
        let ran = command(&["run", "study.toml", "--out", "run", "--quiet"]);
        let said = String::from_utf8_lossy(&ran.stderr).into_owned();
        let table = command(&["table", "run", "--points", "--branch", "b", "--format", "csv"]);
        std::fs::remove_dir_all(&folder).unwrap();
        assert_eq!(ran.status.code(), Some(0), "{force}: {said}");
        let table = String::from_utf8(table.stdout).unwrap();
        let mut rows = table.lines().map(|line| line.split(',').map(str::to_string).collect::<Vec<_>>());
        let header = rows.next().unwrap();
        let column = |name: &str| header.iter().position(|own| own == name).unwrap();
        let mut compared = 0;
        for row in rows {
            let number = |name: &str| row[column(name)].parse::<f64>().unwrap();
            let [mean, rms] = mean_square(&pieces, number("T"));
            let within = 10.0 * number("discretisation").max(1e-9);
            assert!((number("x_mean") - mean).abs() < within, "{force}: mean {} instead of {mean}", number("x_mean"));
            assert!((number("x_rms") - rms).abs() < within, "{force}: rms {} instead of {rms}", number("x_rms"));
            compared += 1;
        }
        assert!(compared > 5, "{force}: {compared} points");
    }
}
