//! Conversion between points and rows.

use super::bytes::{Checksum, pack, pack_complex, pack_pairs, unpack, unpack_complex, unpack_pairs};
use foldline::diagram::{
    Branch, Connection, Cost, Cycle, Ending, Kind, Origin, Point, Solution, SpecialPoint, Torus, Trust,
};
use foldline::problem::gauss::Points;
use rusqlite::Row;
use rusqlite::types::Value;

/// Added to the degree of cycles at Radau points.
const RADAU: usize = 100;

/// Values of the named columns and the columns of a point, in the order of the insertion. `extra` numbers are stored
/// with the scalars; `named` is the number of named columns. A connecting orbit has further parameters, which are stored
/// with the others but have no named columns.
pub(super) fn values_of(point: &Point, extra: &[f64], named: usize) -> Vec<Value> {
    let count = |n: usize| Value::Integer(i64::try_from(n).unwrap_or(i64::MAX));
    let (degree, profile) = match &point.solution {
        Solution::Equilibrium(state) => (Value::Null, state),
        Solution::Cycle(cycle) => {
            (count(cycle.degree + RADAU * usize::from(cycle.points == Points::Radau)), &cycle.profile)
        }
        // The sign tells tori from cycles; their rotation number takes the place of gains.
        Solution::Torus(torus) => (Value::Integer(-(torus.degree as i64)), &torus.profile),
    };
    let trust = &point.trust;
    let known = named.saturating_sub(2 * point.ranges.len());
    let shown = point.parameters.iter().take(known).chain(point.ranges.as_flattened());
    let mut values: Vec<Value> = shown.map(|v| Value::Real(*v)).collect();
    let period = point.solution.period();
    let mut scalars = vec![
        period.unwrap_or(0.0),
        point.step,
        trust.discretisation,
        trust.residual,
        trust.trivial_defect,
        trust.liouville_defect,
        trust.spectrum,
    ];
    scalars.extend_from_slice(extra);
    let gain = match &point.solution {
        Solution::Torus(torus) => pack(&[torus.rotation]),
        other => pack(other.gain()),
    };
    let light = [
        pack(&point.parameters),
        pack_complex(&point.spectrum),
        pack_pairs(&point.ranges),
        pack(&scalars),
        pack_pairs(&point.averages),
        gain.clone(),
    ];
    let heavy = [pack(profile), mesh_bytes(&point.solution), pack(&point.tangent)];
    let forcing_periods = point.solution.forcing_periods();
    let counts = [point.unstable, forcing_periods as usize];
    let checksums = [numbers_checksum(point.position, counts, &light), checksum(&heavy)];
    let [parameters, spectrum, ranges, scalars, averages, _] = light;
    let [profile, mesh, tangent] = heavy;
    let mesh = if degree == Value::Null { Value::Null } else { Value::Blob(mesh) };
    values.extend([
        period.map_or(Value::Null, Value::Real),
        count(point.unstable),
        Value::Real(trust.discretisation),
        Value::Real(trust.residual),
        Value::Real(trust.trivial_defect),
        Value::Real(trust.liouville_defect),
        count(point.cost.newton),
        count(point.cost.factorisations),
        count(point.cost.rejected),
        count(point.cost.evaluations),
        count(point.cost.linearisations),
        Value::Real(trust.spectrum),
        Value::Real(trust.slope),
        degree,
        Value::Integer(i64::from(forcing_periods)),
        if gain.is_empty() { Value::Null } else { Value::Blob(gain) },
        Value::Blob(parameters),
        Value::Blob(spectrum),
        Value::Blob(ranges),
        Value::Blob(averages),
        Value::Blob(scalars),
        Value::Integer(checksums[0]),
        Value::Integer(checksums[1]),
        Value::Blob(profile),
        mesh,
        Value::Blob(tangent),
    ]);
    values
}

pub(super) fn point_row(number: i64, point: &Point, named: usize) -> Vec<Value> {
    let first = [Value::Integer(number), Value::Integer(point.position)];
    first.into_iter().chain(values_of(point, &[], named)).collect()
}

pub(super) fn special_row(number: i64, branch: &Branch, special: &SpecialPoint, named: usize) -> Vec<Value> {
    let (kind, position, key) = key_of(branch, special);
    let first = [
        Value::Integer(number),
        Value::Text(kind.to_string()),
        Value::Integer(position),
        Value::Blob(key),
        Value::Integer(special.unstable_before as i64),
        Value::Integer(special.unstable_after as i64),
        Value::Real(special.error),
        Value::Text(special.normal_form()),
        Value::Integer(special.coefficients.len() as i64),
        Value::Text(special.remark.clone()),
    ];
    let extra = [&[special.error], &special.coefficients[..], &special.coefficient_errors[..]].concat();
    first.into_iter().chain(values_of(&special.point, &extra, named)).collect()
}

pub(super) fn end_row(number: i64, side: usize, ending: &Ending) -> Vec<Value> {
    let first = [
        Value::Integer(number),
        Value::Integer(side as i64),
        Value::Text(ending.code().to_string()),
        Value::Text(ending.to_string()),
    ];
    first.into_iter().chain(ending_values(ending)).collect()
}

/// Number of bytes of the parameter in a key. Keys of earlier versions consist of the parameter alone.
pub(super) const OF_PARAMETER: usize = 8;

/// Returns the key of a special point within its branch: kind, position, and the bytes of the parameter and of the
/// number of unstable eigenvalues. Two special points of one kind can lie between the same two points, and even at the
/// same parameter.
pub(super) fn key_of(branch: &Branch, special: &SpecialPoint) -> (&'static str, i64, Vec<u8>) {
    let parameter = special.point.parameters.get(branch.free).copied().unwrap_or(0.0);
    let count = special.unstable_before as u64;
    (special.kind.name(), special.point.position, [parameter.to_le_bytes(), count.to_le_bytes()].concat())
}

fn mesh_bytes(solution: &Solution) -> Vec<u8> {
    match solution {
        Solution::Equilibrium(_) => Vec::new(),
        Solution::Cycle(cycle) => pack(&cycle.mesh),
        Solution::Torus(torus) => pack(&torus.mesh),
    }
}

fn checksum(parts: &[Vec<u8>]) -> i64 {
    let mut sum = Checksum::new();
    parts.iter().for_each(|part| sum.bytes(part));
    sum.value()
}

/// Checksum of the light columns of a point. The number of forcing periods is left out if it is 0, as in formats before
/// 6.
fn numbers_checksum(position: i64, [unstable, forcing_periods]: [usize; 2], light: &[Vec<u8>]) -> i64 {
    let mut sum = Checksum::new();
    sum.word(position as u64);
    sum.word(unstable as u64);
    if forcing_periods > 0 {
        sum.word(forcing_periods as u64);
    }
    light.iter().for_each(|part| sum.bytes(part));
    sum.value()
}

/// The torus in a row, from its degree as stored, the bytes of its rotation number, and its mesh and profile.
fn torus_in(
    period: f64,
    degree: i64,
    forcing_periods: usize,
    rotation: &[u8],
    (mesh, profile): (Vec<f64>, Vec<f64>),
) -> Result<Torus, String> {
    let rotation =
        unpack(rotation).and_then(|all| all.first().copied()).ok_or("gain_bytes holds no rotation number")?;
    let degree = usize::try_from(-degree).map_err(|e| e.to_string())?;
    let forcing_periods = u32::try_from(forcing_periods).map_err(|e| e.to_string())?;
    let torus = Torus { period, rotation, forcing_periods, mesh: mesh.into(), degree, profile };
    let nodes = torus.intervals() * (degree + 1) * torus.phases();
    let removed = torus.mesh.is_empty() && torus.profile.is_empty();
    if !removed && (nodes == 0 || !torus.profile.len().is_multiple_of(nodes)) {
        return Err("solution_bytes and mesh_bytes do not belong together".to_string());
    }
    Ok(torus)
}

/// Returns the point in a row and the extra numbers stored with its scalars. If the solution was not queried, it and
/// the tangent are left empty. The error names the invalid column.
pub(super) fn point_in(row: &Row) -> Result<(Point, Vec<f64>), String> {
    let whole = row.as_ref().column_index("solution_bytes").is_ok();
    let blob = |name: &str| row.get::<_, Vec<u8>>(name).map_err(|e| e.to_string());
    let numbers =
        |name: &str| unpack(&blob(name)?).ok_or_else(|| format!("{name} has a length that is not a multiple of 8"));
    let count = |name: &str| {
        row.get::<_, i64>(name)
            .ok()
            .and_then(|n| usize::try_from(n).ok())
            .ok_or_else(|| format!("{name} is not a count"))
    };
    // Columns added after format 2.
    let later = |name: &str| match row.get::<_, i64>(name) {
        Err(rusqlite::Error::InvalidColumnName(_)) => Ok(0),
        _ => count(name),
    };
    let position: i64 = row.get("position").map_err(|e| e.to_string())?;
    // Averages exist since format 7, gains since format 10. Missing ones add nothing to the checksum.
    let newer_bytes = |name: &str| match row.get::<_, Option<Vec<u8>>>(name) {
        Err(rusqlite::Error::InvalidColumnName(_)) => Ok(Vec::new()),
        other => other.map(Option::unwrap_or_default).map_err(|e| e.to_string()),
    };
    // Formats before 4 have no checksums.
    let stated = |name: &str| match row.get::<_, Option<i64>>(name) {
        Err(rusqlite::Error::InvalidColumnName(_)) => Ok(None),
        other => other.map_err(|e| e.to_string()),
    };
    let of_numbers = stated("numbers_checksum")?;
    if let Some(stated) = of_numbers {
        let light = ["parameter_bytes", "spectrum_bytes", "range_bytes", "scalar_bytes"].map(blob);
        let light =
            light.into_iter().chain(["average_bytes", "gain_bytes"].map(newer_bytes)).collect::<Result<Vec<_>, _>>()?;
        if numbers_checksum(position, [count("unstable")?, later("forcing_periods")?], &light) != stated {
            return Err(format!("the numbers of the point at position {position} do not have their checksum"));
        }
    }
    if let Some(stated) = stated("solution_checksum")?.filter(|_| whole) {
        let mesh = row.get::<_, Option<Vec<u8>>>("mesh_bytes").map_err(|e| e.to_string())?.unwrap_or_default();
        if checksum(&[blob("solution_bytes")?, mesh, blob("tangent_bytes")?]) != stated {
            return Err(format!("the solution of the point at position {position} does not have its checksum"));
        }
    }
    let mut scalars = numbers("scalar_bytes")?;
    // The error of the spectrum exists since format 4.
    let spectrum_error = match of_numbers {
        Some(_) if scalars.len() > 6 => scalars.remove(6),
        _ => f64::NAN,
    };
    let [period, step, discretisation, residual, trivial_defect, liouville_defect, extra @ ..] = &scalars[..] else {
        return Err("scalar_bytes is too short".to_string());
    };
    let profile = if whole { numbers("solution_bytes")? } else { Vec::new() };
    let solution = match row.get::<_, Option<i64>>("degree").map_err(|e| e.to_string())? {
        None => Solution::Equilibrium(profile),
        Some(degree) if degree < 0 => {
            Solution::Torus(torus_in(*period, degree, later("forcing_periods")?, &newer_bytes("gain_bytes")?, {
                if whole { (numbers("mesh_bytes")?, profile) } else { Default::default() }
            })?)
        }
        Some(_) => {
            let mesh = if whole { numbers("mesh_bytes")? } else { Vec::new() };
            let degree = count("degree")?;
            let (degree, points) =
                if degree > RADAU { (degree - RADAU, Points::Radau) } else { (degree, Points::Gauss) };
            let nodes = mesh.len().saturating_sub(1) * (degree + 1);
            // Both are empty if the profile has been removed.
            let removed = mesh.is_empty() && profile.is_empty();
            if whole && !removed && (nodes == 0 || profile.len() % nodes != 0) {
                return Err("solution_bytes and mesh_bytes do not belong together".to_string());
            }
            let forcing_periods = u32::try_from(later("forcing_periods")?).map_err(|e| e.to_string())?;
            let gain = unpack(&newer_bytes("gain_bytes")?).ok_or("gain_bytes is not a list of numbers")?;
            Solution::Cycle(Cycle {
                period: *period,
                forcing_periods,
                mesh: mesh.into(),
                degree,
                points,
                profile,
                gain,
            })
        }
    };
    let point = Point {
        position,
        parameters: numbers("parameter_bytes")?,
        solution,
        tangent: if whole { numbers("tangent_bytes")? } else { Vec::new() },
        step: *step,
        spectrum: unpack_complex(&blob("spectrum_bytes")?).ok_or("spectrum_bytes is not a list of pairs")?,
        unstable: count("unstable")?,
        ranges: unpack_pairs(&blob("range_bytes")?).ok_or("range_bytes is not a list of pairs")?,
        averages: unpack_pairs(&newer_bytes("average_bytes")?).ok_or("average_bytes is not a list of pairs")?,
        trust: Trust {
            discretisation: *discretisation,
            residual: *residual,
            trivial_defect: *trivial_defect,
            liouville_defect: *liouville_defect,
            spectrum: spectrum_error,
            slope: row.get("slope_error").unwrap_or(0.0),
        },
        cost: Cost {
            newton: count("newton")?,
            factorisations: count("factorisations")?,
            rejected: count("rejected")?,
            evaluations: later("evaluations")?,
            linearisations: later("linearisations")?,
        },
    };
    Ok((point, extra.to_vec()))
}

/// Values of `detail, kind, count, value_bytes` of an ending; its code and sentence come from the ending itself.
pub(super) fn ending_values(ending: &Ending) -> [Value; 4] {
    let (detail, kind, count, value) = match ending {
        Ending::Bound(value) | Ending::PeriodUnbounded(value) | Ending::Asked(value) => {
            (None, None, None, Some(*value))
        }
        Ending::Joined { at, parameter } => (None, Some(*at), None, Some(*parameter)),
        // `{:?}` writes the period exactly.
        Ending::Connecting { parameter, period, to, .. } => {
            (Some(format!("{period:?} {to}")), None, None, Some(*parameter))
        }
        Ending::StepTooSmall(why)
        | Ending::MeshTooLarge(why)
        | Ending::SolutionUnbounded(why)
        | Ending::NotFinite(why)
        | Ending::GivenUp(why)
        | Ending::HeldCorner(why)
        | Ending::NoStart(why) => (Some(why.clone()), None, None, None),
        Ending::PointLimit(points) => (None, None, Some(*points), None),
        Ending::Closed | Ending::Stopped => (None, None, None, None),
    };
    [
        detail.map_or(Value::Null, Value::Text),
        kind.map_or(Value::Null, |k| Value::Text(k.name().to_string())),
        count.map_or(Value::Null, |n| Value::Integer(i64::try_from(n).unwrap_or(i64::MAX))),
        value.map_or(Value::Null, |v| Value::Blob(pack(&[v]))),
    ]
}

/// Returns the ending in a row of `ends`.
pub(super) fn ending_in(row: &Row) -> Result<Ending, String> {
    let text = |name: &str| row.get::<_, Option<String>>(name).map_err(|e| e.to_string());
    let detail = || Ok::<_, String>(text("detail")?.unwrap_or_default());
    let value = || single(row, "value_bytes");
    Ok(match text("code")?.unwrap_or_default().as_str() {
        "bound" => Ending::Bound(value()?),
        "asked" => Ending::Asked(value()?),
        "closed" => Ending::Closed,
        "joined" => Ending::Joined { at: kind_named(&text("kind")?.unwrap_or_default())?, parameter: value()? },
        "step-too-small" => Ending::StepTooSmall(detail()?),
        "mesh-too-large" => Ending::MeshTooLarge(detail()?),
        "period-unbounded" => Ending::PeriodUnbounded(value()?),
        "solution-unbounded" => Ending::SolutionUnbounded(detail()?),
        "point-limit" => {
            let count: i64 = row.get("count").map_err(|e| e.to_string())?;
            Ending::PointLimit(usize::try_from(count).map_err(|e| e.to_string())?)
        }
        "not-finite" => Ending::NotFinite(detail()?),
        "given-up" => Ending::GivenUp(detail()?),
        "held-corner" => Ending::HeldCorner(detail()?),
        "no-start" => Ending::NoStart(detail()?),
        "stopped" => Ending::Stopped,
        other => {
            let unknown = || format!("unknown ending \"{other}\"");
            let detail = detail()?;
            let (period, to) = detail.split_once(' ').ok_or_else(unknown)?;
            Ending::Connecting {
                connection: Connection::from_name(other).ok_or_else(unknown)?,
                parameter: value()?,
                period: period.parse().map_err(|_| unknown())?,
                to: to.to_string(),
            }
        }
    })
}

/// Values of `origin, origin_name, origin_kind, origin_parameter, origin_bytes`.
pub(super) fn origin_values(origin: &Origin) -> [Value; 5] {
    let (code, name, kind, parameter) = match origin {
        Origin::Seed(name) => ("seed", name, None, None),
        Origin::EndOf(name) => ("end-of", name, None, None),
        Origin::Switch { parent, kind, parameter } => ("switch", parent, Some(*kind), Some(*parameter)),
    };
    [
        Value::Text(code.to_string()),
        Value::Text(name.clone()),
        kind.map_or(Value::Null, |k| Value::Text(k.name().to_string())),
        parameter.map_or(Value::Null, Value::Real),
        parameter.map_or(Value::Null, |v| Value::Blob(pack(&[v]))),
    ]
}

/// Values of `held, follows`: the kind of bifurcation continued along a two-parameter curve, and the index of its
/// second parameter.
pub(super) fn held_values(held: Option<(Kind, usize)>) -> [Value; 2] {
    let kind = held.map(|(kind, _)| Value::Text(kind.name().to_string()));
    let follows = held.map(|(_, follows)| Value::Integer(i64::try_from(follows).unwrap_or(i64::MAX)));
    [kind.unwrap_or(Value::Null), follows.unwrap_or(Value::Null)]
}

/// Returns the kind of bifurcation continued and the second parameter, from a row of `branches`. Format 1 had no such
/// columns and no curves in two parameters.
pub(super) fn held_in(row: &Row) -> Result<Option<(Kind, usize)>, String> {
    let kind = match row.get::<_, Option<String>>("held") {
        Err(rusqlite::Error::InvalidColumnName(_)) | Ok(None) => return Ok(None),
        Ok(Some(name)) => kind_named(&name)?,
        Err(error) => return Err(error.to_string()),
    };
    let follows: i64 = row.get("follows").map_err(|e| e.to_string())?;
    Ok(Some((kind, usize::try_from(follows).map_err(|e| e.to_string())?)))
}

/// Returns the origin in a row of `branches`.
pub(super) fn origin_in(row: &Row) -> Result<Origin, String> {
    let name: String = row.get("origin_name").map_err(|e| e.to_string())?;
    match row.get::<_, String>("origin").map_err(|e| e.to_string())?.as_str() {
        "seed" => Ok(Origin::Seed(name)),
        "end-of" => Ok(Origin::EndOf(name)),
        "switch" => {
            let kind = kind_named(&row.get::<_, String>("origin_kind").map_err(|e| e.to_string())?)?;
            Ok(Origin::Switch { parent: name, kind, parameter: single(row, "origin_bytes")? })
        }
        other => Err(format!("unknown origin \"{other}\"")),
    }
}

pub(super) fn kind_named(name: &str) -> Result<Kind, String> {
    Kind::from_name(name).ok_or_else(|| format!("unknown kind \"{name}\""))
}

pub(super) fn single(row: &Row, name: &str) -> Result<f64, String> {
    let bytes: Vec<u8> = row.get(name).map_err(|e| e.to_string())?;
    unpack(&bytes).and_then(|v| v.first().copied()).ok_or_else(|| format!("{name} is empty"))
}
