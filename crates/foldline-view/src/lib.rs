//! The explorer: a local server with one page that shows a run in a browser, and the same page as a file.
//!
//! **Idea.** A run is watched through its file ([`foldline_store::run_file`]), whether it is complete or still being
//! computed by another process. [`serve`] answers one browser on this computer: `gate` refuses everything that does
//! not come from the page itself, `routes` maps a closed list of paths to `watch`, which reads the file. [`html`]
//! puts the page and the data into one file that needs no server. A [`Desk`] lets the page go on with a longer study:
//! `orders` checks what it sends, and another process computes.
//!
//! The page is in `page/`: plain JavaScript modules, joined into one script by `page`.
//!
//! **Departures.** No web framework: twelve paths need no router
//! (docs/decisions/0037-explorer.md).

mod axes;
mod body;
mod browser;
mod describe;
mod desk;
mod frame;
mod gate;
mod html;
mod log;
mod orbit;
mod orders;
mod page;
mod query;
mod routes;
mod server;
mod watch;

pub use browser::open as open_browser;
pub use desk::{Desk, Example, Files, Program};
pub use html::{Amount, Shown, html, solution};
pub use orbit::Place;
pub use page::script;
pub use server::{Server, Stop};
pub use watch::{Failure, Watch};
