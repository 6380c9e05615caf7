//! The page and the data of a run in one file that needs neither server nor network.
//!
//! **Idea.** The data are the messages that the server would send: descriptions as JSON, columns and solutions as
//! frames in base64. Every point has all its quantities; as profiles are nearly all of a run, a limited number of
//! solutions is included: those of all special points, and further ones spread evenly along each branch.

use crate::orbit::Place;
use crate::page::{PAGE, STYLE, script};
use crate::watch::{Failure, Watch};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};
use std::path::Path;

/// Size of all solutions in bytes, before base64, up to which further ones are included.
const SPACE: usize = 6 << 20;

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
pub fn html(folder: &Path) -> Result<(String, Amount), Failure> {
    let watch = Watch::open(folder)?;
    let mut data = Vec::new();
    let state = watch.state();
    let text: Value = serde_json::from_str(&state).unwrap_or_default();
    let mut description = watch.description();
    // The file may be passed on; a path of this computer does not belong in it.
    description["folder"] = folder.file_name().map(|name| name.to_string_lossy()).into();
    for part in ["study", "model"] {
        let name = description[part]["file"].as_str().and_then(|file| file.rsplit(['/', '\\']).next());
        description[part]["file"] = name.map(str::to_string).into();
    }
    data.push(script_of("run", "application/json", &escaped(&description.to_string())));
    data.push(script_of("state", "application/json", &escaped(&state)));
    let columns: Vec<usize> = (0..watch.quantities()).collect();
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
    let solutions = solutions(&watch, &text["state"], &mut data)?;
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

/// Adds solutions of special points, and of every k-th point such that they fit into [`SPACE`].
fn solutions(watch: &Watch, state: &Value, data: &mut Vec<String>) -> Result<usize, Failure> {
    let list = |key: &str| state[key].as_array().map(Vec::as_slice).unwrap_or_default();
    let mut places = Vec::new();
    for own in list("special") {
        let (Some(branch), Some(index)) = (own["branch"].as_i64(), own["index"].as_i64()) else { continue };
        places.push((branch, Place::Special(index)));
    }
    let (mut count, mut size) = (0, 0);
    let mut add = |branch: i64, place: Place, size: &mut usize| -> Result<(), Failure> {
        if let Some(bytes) = watch.solution(branch, place)? {
            let name = match place {
                Place::Position(position) => format!("solution-{branch}-{position}"),
                Place::Special(index) => format!("special-{branch}-{index}"),
            };
            let bytes = single(&bytes);
            *size += bytes.len();
            count += 1;
            data.push(script_of(&name, "text/plain", &STANDARD.encode(&bytes)));
        }
        Ok(())
    };
    for (branch, place) in places {
        add(branch, place, &mut size)?;
    }
    let reaches: Vec<(i64, [i64; 2])> = list("branches")
        .iter()
        .filter_map(|own| Some((own["id"].as_i64()?, [own["reach"][0].as_i64()?, own["reach"][1].as_i64()?])))
        .collect();
    // The size of one solution, from the first point of each branch.
    for (branch, [first, _]) in &reaches {
        add(*branch, Place::Position(*first), &mut size)?;
    }
    let points: i64 = reaches.iter().map(|(_, [first, last])| last - first).sum();
    let mean = (size / (list("special").len() + reaches.len()).max(1)).max(1);
    let room = (SPACE.saturating_sub(size) / mean).max(1);
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
    let length = 8 + frame.first_chunk().map_or(0, |bytes| u32::from_le_bytes(*bytes) as usize);
    let mut head = header(frame);
    head["single"] = json!(true);
    let (numbers, _) = frame.get(length..).unwrap_or_default().as_chunks::<8>();
    let mut text = head.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(8), b' ');
    let mut out = (text.len() as u32).to_le_bytes().to_vec();
    out.extend([0; 4]);
    out.extend(text);
    numbers.iter().for_each(|bytes| out.extend((f64::from_le_bytes(*bytes) as f32).to_le_bytes()));
    out
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
