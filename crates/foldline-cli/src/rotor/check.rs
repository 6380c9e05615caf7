//! Report of `foldline check` on a rotor.

use foldline_shaft::{Frame, Machine};

/// Number of natural frequencies listed.
const LISTED: usize = 4;

/// Lines on mass, degrees of freedom, frame, frequencies at rest and sag; parameters `[k]`.
pub fn lines(machine: &Machine, parameters: &[f64]) -> Vec<String> {
    let rotor = &machine.assembled.rotor;
    let mut lines = Vec::new();
    let mass = match &rotor.given {
        Some(_) => String::new(),
        None => format!("mass {:.6} kg, ", rotor.mass()),
    };
    lines.push(format!("rotor: {mass}{} nodes, {} degrees of freedom", rotor.stations.len(), rotor.dofs()));
    let frame = match machine.frame() {
        Frame::Rotating => "isotropic: the equations are in the rotating frame".to_string(),
        Frame::Fixed if machine.assembled.anisotropy.is_empty() => {
            "isotropic, but the equations are in the fixed frame, as the model asks".to_string()
        }
        Frame::Fixed => format!("the equations are in the fixed frame: {}", machine.assembled.anisotropy.join("; ")),
    };
    lines.push(frame);
    let rest = machine.linear(&machine.at_speed(parameters, 0.0));
    match rest.modes(2 * LISTED, false) {
        Some(modes) => {
            let mut values: Vec<String> = Vec::new();
            for mode in &modes {
                let text = format!("{:.4}", mode.value.im / std::f64::consts::TAU);
                // At rest forward and backward whirl of an isotropic rotor have one frequency.
                if !values.contains(&text) && values.len() < LISTED {
                    values.push(text);
                }
            }
            lines.push(format!("natural frequencies at rest: {} Hz", values.join(", ")));
        }
        None => lines.push("natural frequencies at rest: not computed, a coefficient is not finite".into()),
    }
    lines.extend(sag(machine, parameters));
    lines
}

/// Sag under gravity, compared with the clearance of each ring.
fn sag(machine: &Machine, parameters: &[f64]) -> Vec<String> {
    let rotor = &machine.assembled.rotor;
    let Some(sag) = machine.sag(&machine.at_speed(parameters, 0.0)) else {
        return vec!["sag: none, the shaft has no supports that carry it".into()];
    };
    let down = |station: usize| -sag[rotor.first(station) + 1];
    let deepest = (0..rotor.stations.len()).max_by(|a, b| down(*a).abs().total_cmp(&down(*b).abs())).unwrap_or(0);
    let model = if rotor.gravity.is_zero() { " (the model is without gravity)" } else { "" };
    let mut lines = vec![format!("sag: {:.6} mm at {}{model}", 1e3 * down(deepest), rotor.called(deepest))];
    for (name, station, clearance, centre) in machine.rings(parameters) {
        let first = rotor.first(station);
        let offset = (sag[first] - centre[0]).hypot(sag[first + 1] - centre[1]);
        let ratio = offset / clearance;
        let said = match (rotor.gravity.is_zero(), ratio > 1.0) {
            (true, true) => {
                "; with gravity the shaft would rest on the ring: give `gravity`, or take the ring as centred on the sagged shaft"
            }
            (false, true) => "; the shaft rests on the ring",
            _ => "",
        };
        lines.push(format!("ring `{name}`: sag {:.4} mm, {ratio:.2} of the clearance{said}", 1e3 * offset));
    }
    lines
}
