//! Publications: studies, and figures made from their runs.

use crate::claims::Claim;
use crate::runs::Runs;
use foldline_plot::Figure;

/// A publication.
pub struct Publication {
    /// Key in docs/references.bib, or the name given on the command line.
    pub name: &'static str,
    /// Authors and title.
    pub title: &'static str,
    /// All studies that a figure may need.
    pub studies: &'static [StudyPlan],
    /// Figures in their order.
    pub figures: &'static [FigurePlan],
}

impl Publication {
    /// Returns the figure of that name; leading zeros do not count.
    pub fn figure(&self, name: &str) -> Option<&'static FigurePlan> {
        let plain = name.trim_start_matches('0');
        self.figures.iter().find(|figure| figure.name == plain)
    }

    /// Returns the study of that name.
    pub fn study(&self, name: &str) -> Option<&'static StudyPlan> {
        self.studies.iter().find(|study| study.name == name)
    }
}

/// A built-in study.
pub struct StudyPlan {
    /// Name of its folder among the runs.
    pub name: &'static str,
    /// Name of its file.
    pub file: &'static str,
    /// Its text.
    pub text: &'static str,
    /// Name of the file of its model.
    pub model_file: &'static str,
    /// Text of its model.
    pub model: &'static str,
    /// Nominal computing time in seconds, for the estimate of what remains; the measured speed scales it.
    pub weight: f64,
}

/// A figure.
pub struct FigurePlan {
    /// Number or name of the figure, such as `7`.
    pub name: &'static str,
    /// Title.
    pub title: &'static str,
    /// Names of the studies it needs.
    pub runs: &'static [&'static str],
    /// Makes the figure; the error gives the reason why it cannot be made.
    pub make: fn(&Runs) -> Result<Made, String>,
}

impl FigurePlan {
    /// Stem of its file names: `figure-07`, or the name of a figure without a number.
    pub fn file_stem(&self) -> String {
        match self.name.parse::<u32>() {
            Ok(number) => format!("figure-{number:02}"),
            Err(_) => format!("figure-{}", self.name),
        }
    }
}

/// A figure that was made.
pub struct Made {
    /// The picture as plain data.
    pub figure: Figure,
    /// Description in a few sentences. An empty line ends a paragraph; a paragraph of lines with cells separated by
    /// tabs is a table whose first line is the head.
    pub caption: String,
    /// Claims decided by its numbers.
    pub claims: Vec<Claim>,
}
