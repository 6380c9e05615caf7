//! The page and the data of a run in one file that needs neither server nor network.
//!
//! **Idea.** The data are the messages that the server would send: descriptions as JSON, columns and solutions as
//! frames in base64. Every point has all its quantities except harmonics, of which only those asked for are included. As
//! profiles are nearly all of a run, a limited number of solutions is included: those of all special points, and further
//! ones spread evenly along each branch.

use crate::axes::{self, Axis};
use crate::orbit::Place;
use crate::page::{PAGE, STYLE, script};
use crate::watch::{Failure, Watch};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use foldline_store::run_file::RunFileError;
use serde_json::{Value, json};
use std::path::Path;

/// Choices for a page.
#[derive(Clone, Debug)]
pub struct Shown {
    /// Names of harmonics and of combinations of quantities that are axes in addition to the stored quantities.
    pub axes: Vec<String>,
    /// View with which the page opens, as in the address of the page: `#x=Omega&y=r_max`.
    pub view: String,
    /// Size of all solutions in bytes, before base64, up to which further ones are included.
    pub space: usize,
    /// True if the solutions of all special points are included, whatever their size.
    pub special: bool,
}

impl Default for Shown {
    fn default() -> Shown {
        Shown { axes: Vec::new(), view: String::new(), space: 6 << 20, special: true }
    }
}

/// Contents of a file written by [`html`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Amount {
    /// Number of points of branches.
    pub points: usize,
    /// Number of solutions, special points included.
    pub solutions: usize,
}

/// Returns the run in a folder as one HTML document.
///
/// # Errors
/// If the run cannot be read.
pub fn html(folder: &Path, shown: &Shown) -> Result<(String, Amount), Failure> {
    let watch = Watch::opened(folder, |model| {
        let mut all = axes::stored(model);
        for name in &shown.axes {
            // A quantity that does not exist cannot be chosen on the page.
            let _ = axes::add(&mut all, name, model);
        }
        all
    })?;
    let mut data = Vec::new();
    let mut text: Value = serde_json::from_str(&watch.state()).unwrap_or_default();
    special_values(&watch, &mut text["state"])?;
    let mut description = watch.description();
    // The file may be passed on; a path of this computer does not belong in it.
    description["folder"] = folder.file_name().map(|name| name.to_string_lossy()).into();
    for part in ["study", "model"] {
        let name = description[part]["file"].as_str().and_then(|file| file.rsplit(['/', '\\']).next());
        description[part]["file"] = name.map(str::to_string).into();
    }
    data.push(script_of("run", "application/json", &escaped(&description.to_string())));
    data.push(script_of("state", "application/json", &escaped(&text.to_string())));
    if !shown.view.is_empty() {
        data.push(script_of("view", "application/json", &escaped(&Value::from(&*shown.view).to_string())));
    }
    let columns: Vec<usize> = (0..watch.axes().len()).collect();
    let (mut since, mut parts) = (0, 0);
    loop {
        let bytes = watch.points(watch.notice().epoch, since, &columns)?;
        let next = header(&bytes)["next"].as_u64().unwrap_or(since);
        data.push(script_of(&format!("points-{parts}"), "text/plain", &STANDARD.encode(&bytes)));
        parts += 1;
        if next == since || next >= watch.notice().points {
            break;
        }
        since = next;
    }
    let solutions = solutions(&watch, &text["state"], shown, &mut data)?;
    let page = PAGE
        .replace("<link rel=\"stylesheet\" href=\"app.css\">", &format!("<style>\n{STYLE}</style>"))
        .replace("<link rel=\"icon\" href=\"icon.svg\">", POLICY)
        .replace(
            "<script type=\"module\" src=\"app.js\"></script>",
            &format!("{}\n<script type=\"module\">\n{}</script>", data.concat(), script()),
        );
    Ok((page, Amount { points: watch.notice().points as usize, solutions }))
}

/// The file loads nothing, and can send nothing anywhere.
const POLICY: &str = "<meta http-equiv=\"content-security-policy\" content=\"default-src 'none'; script-src \
     'unsafe-inline'; style-src 'unsafe-inline'; img-src blob: data:; base-uri 'none'; form-action 'none'\">\n\
     <link rel=\"icon\" href=\"data:,\">";

/// Completes the values of special points by those that need profiles.
fn special_values(watch: &Watch, state: &mut Value) -> Result<(), Failure> {
    let needs = |(k, own): (usize, &Axis)| own.quantity.needs_profile().then_some(k);
    let columns: Vec<usize> = watch.axes().iter().enumerate().filter_map(needs).collect();
    if columns.is_empty() {
        return Ok(());
    }
    let frame = watch.special(&columns)?;
    let (rows, numbers) = (header(&frame)["rows"].as_u64().unwrap_or(0) as usize, numbers(&frame));
    let found: Vec<&[f64]> = numbers.chunks_exact(rows.max(1)).collect();
    for own in state["special"].as_array_mut().into_iter().flatten() {
        let place = [own["branch"].as_f64(), own["index"].as_f64()];
        let Some(row) = (0..rows).find(|row| [Some(found[0][*row]), Some(found[1][*row])] == place) else { continue };
        for (k, column) in columns.iter().zip(&found[2..]) {
            own["values"][*k] = column[row].into();
        }
    }
    Ok(())
}

/// Returns the frame of one solution in single precision, as pages contain it; `None` if there is no such point.
///
/// # Errors
/// If the file cannot be read.
pub fn solution(watch: &Watch, branch: i64, place: Place) -> Result<Option<Vec<u8>>, RunFileError> {
    Ok(watch.solution(branch, place)?.map(|frame| single(&frame)))
}

/// Adds solutions of special points, and of every k-th point such that they fit into the space.
fn solutions(watch: &Watch, state: &Value, shown: &Shown, data: &mut Vec<String>) -> Result<usize, Failure> {
    let full = |size: usize| !shown.special && size >= shown.space;
    let list = |key: &str| state[key].as_array().map(Vec::as_slice).unwrap_or_default();
    let mut places = Vec::new();
    for own in list("special") {
        let (Some(branch), Some(index)) = (own["branch"].as_i64(), own["index"].as_i64()) else { continue };
        places.push((branch, Place::Special(index)));
    }
    let (mut count, mut size) = (0, 0);
    let mut add = |branch: i64, place: Place, size: &mut usize| -> Result<(), Failure> {
        if let Some(bytes) = solution(watch, branch, place)? {
            let name = match place {
                Place::Position(position) => format!("solution-{branch}-{position}"),
                Place::Special(index) => format!("special-{branch}-{index}"),
            };
            *size += bytes.len();
            count += 1;
            data.push(script_of(&name, "text/plain", &STANDARD.encode(&bytes)));
        }
        Ok(())
    };
    for (branch, place) in places {
        if full(size) {
            return Ok(count);
        }
        add(branch, place, &mut size)?;
    }
    let reaches: Vec<(i64, [i64; 2])> = list("branches")
        .iter()
        .filter_map(|own| Some((own["id"].as_i64()?, [own["reach"][0].as_i64()?, own["reach"][1].as_i64()?])))
        .collect();
    // The size of one solution, from the first point of each branch.
    for (branch, [first, _]) in &reaches {
        if full(size) {
            return Ok(count);
        }
        add(*branch, Place::Position(*first), &mut size)?;
    }
    let points: i64 = reaches.iter().map(|(_, [first, last])| last - first).sum();
    let mean = (size / (list("special").len() + reaches.len()).max(1)).max(1);
    let room = (shown.space.saturating_sub(size) / mean).max(1);
    let every = (points.max(1) as usize).div_ceil(room).max(1);
    for (branch, [first, last]) in reaches {
        let positions =
            (first + 1..=last).filter(|position| (position - first) % every as i64 == 0 || *position == last);
        for position in positions {
            add(branch, Place::Position(position), &mut size)?;
        }
    }
    Ok(count)
}

/// The frame with float32 instead of float64, which suffices for pictures; the numbers in its header stay exact.
fn single(frame: &[u8]) -> Vec<u8> {
    let mut head = header(frame);
    head["single"] = json!(true);
    let mut text = head.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(8), b' ');
    let mut out = (text.len() as u32).to_le_bytes().to_vec();
    out.extend([0; 4]);
    out.extend(text);
    numbers(frame).iter().for_each(|value| out.extend((*value as f32).to_le_bytes()));
    out
}

/// All numbers of a frame.
fn numbers(frame: &[u8]) -> Vec<f64> {
    let length = 8 + frame.first_chunk().map_or(0, |bytes| u32::from_le_bytes(*bytes) as usize);
    let (numbers, _) = frame.get(length..).unwrap_or_default().as_chunks::<8>();
    numbers.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect()
}

fn header(frame: &[u8]) -> Value {
    let length = frame.first_chunk().map_or(0, |bytes| u32::from_le_bytes(*bytes) as usize);
    frame.get(8..8 + length).and_then(|text| serde_json::from_slice(text).ok()).unwrap_or_default()
}

fn script_of(id: &str, kind: &str, text: &str) -> String {
    format!("<script type=\"{kind}\" id=\"data-{id}\">{text}</script>\n")
}

/// JSON that cannot end the element that contains it.
fn escaped(json: &str) -> String {
    json.replace('<', "\\u003c")
}
