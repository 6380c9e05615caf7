//! Claims of a publication, and what the computed numbers say about them.
//!
//! **Idea.** A claim is decided by a [`Finding`]: a number with its error, or a fact that holds or does not. The verdict follows
//! from these alone. What could not be computed decides nothing.

use std::fmt;

/// What the numbers say about a claim.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// The same, as far as the publication is precise.
    Agrees,
    /// The same, and more can be said: more digits, or the conditions under which it holds.
    Refined,
    /// Not the same.
    Contradicted,
    /// It could not be computed well enough.
    NotDecided,
}

impl Verdict {
    /// Every verdict.
    pub const ALL: [Verdict; 4] = [Verdict::Agrees, Verdict::Refined, Verdict::Contradicted, Verdict::NotDecided];

    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Verdict::Agrees => "agrees",
            Verdict::Refined => "refined",
            Verdict::Contradicted => "contradicted",
            Verdict::NotDecided => "not decided",
        }
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.pad(self.name())
    }
}

/// A claim with its verdict.
#[derive(Clone, Debug)]
pub struct Claim {
    /// The figure it belongs to.
    pub figure: &'static str,
    /// What is claimed, in our words.
    pub statement: String,
    /// What the publication gives: a number, or that it holds.
    pub study: String,
    /// What was computed.
    pub ours: String,
    /// Estimated error of what was computed; `None` where it is no number.
    pub error: Option<f64>,
    /// What follows.
    pub verdict: Verdict,
    /// What should be known about it.
    pub note: String,
    /// Whether it is ours, a check or an extension, rather than the publication's.
    pub check: bool,
}

impl Claim {
    /// Something that the publication does not claim: a check of ours, or what goes beyond; `expected` is what should come out.
    pub fn check(
        figure: &'static str,
        statement: impl Into<String>,
        expected: impl Into<String>,
        finding: Result<Finding, String>,
    ) -> Claim {
        Claim { check: true, ..Claim::decided(figure, statement, expected, finding) }
    }

    /// A claim decided by what was found; an error is the reason why nothing was.
    pub fn decided(
        figure: &'static str,
        statement: impl Into<String>,
        study: impl Into<String>,
        finding: Result<Finding, String>,
    ) -> Claim {
        let finding = finding.unwrap_or_else(|why| Finding {
            ours: "·".into(),
            error: None,
            verdict: Verdict::NotDecided,
            note: why,
        });
        Claim {
            figure,
            statement: statement.into(),
            study: study.into(),
            ours: finding.ours,
            error: finding.error,
            verdict: finding.verdict,
            note: finding.note,
            check: false,
        }
    }

    /// With a remark, after what the finding says.
    pub fn noting(mut self, note: &str) -> Claim {
        self.note = if self.note.is_empty() { note.into() } else { format!("{}. {note}", self.note) };
        self
    }
}

/// What was found about a claim.
#[derive(Clone, Debug)]
pub struct Finding {
    /// In words or digits.
    pub ours: String,
    /// Estimated error of a number.
    pub error: Option<f64>,
    /// What follows for the claim.
    pub verdict: Verdict,
    /// A remark.
    pub note: String,
}

impl Finding {
    /// A number `ours` ± `error` against a number that the publication gives as precisely as `reading`.
    ///
    /// Farther apart than both uncertainties together: contradicted. Otherwise it agrees; and where our error is less than a
    /// hundredth of the reading, more digits are known than before: refined.
    pub fn number(ours: f64, error: f64, study: f64, reading: f64) -> Finding {
        let apart = (ours - study).abs();
        let verdict = match (apart.is_finite() && error.is_finite(), apart <= reading + error) {
            (false, _) => Verdict::NotDecided,
            (true, false) => Verdict::Contradicted,
            // An error larger than the reading could hide a difference.
            (true, true) if error > reading => Verdict::NotDecided,
            (true, true) if error < 0.01 * reading => Verdict::Refined,
            (true, true) => Verdict::Agrees,
        };
        Finding { ours: digits(ours, error), error: Some(error), verdict, note: String::new() }
    }

    /// A quantity that should vanish: whether `ours` is at most `bound`, which the tolerance of the run allows.
    pub fn vanishing(ours: f64, bound: f64) -> Finding {
        let verdict = match ours.is_finite() {
            false => Verdict::NotDecided,
            true if ours <= bound => Verdict::Agrees,
            true => Verdict::Contradicted,
        };
        Finding { ours: format!("{ours:.1e}"), error: Some(bound), verdict, note: String::new() }
    }

    /// A fact, with the numbers that show it.
    pub fn fact(holds: bool, ours: String) -> Finding {
        let verdict = if holds { Verdict::Agrees } else { Verdict::Contradicted };
        Finding { ours, error: None, verdict, note: String::new() }
    }

    /// A fact that more can be said about: it holds, under conditions or more precisely than claimed.
    pub fn qualified(holds: bool, ours: String) -> Finding {
        let verdict = if holds { Verdict::Refined } else { Verdict::Contradicted };
        Finding { ours, error: None, verdict, note: String::new() }
    }

    /// A fact that is claimed of several cases: one in which it does not hold contradicts it.
    pub fn cases(holds: &[bool], ours: String) -> Finding {
        let verdict = match (holds.is_empty(), holds.iter().all(|h| *h)) {
            (true, _) => Verdict::NotDecided,
            (_, true) => Verdict::Agrees,
            (_, false) => Verdict::Contradicted,
        };
        Finding { ours, error: None, verdict, note: String::new() }
    }

    /// With the error of the numbers in it.
    pub fn within(mut self, error: f64) -> Finding {
        self.error = Some(error);
        self
    }

    /// With a remark.
    pub fn noting(mut self, note: impl Into<String>) -> Finding {
        self.note = note.into();
        self
    }
}

/// A number with as many decimals as its error justifies.
pub fn digits(value: f64, error: f64) -> String {
    let decimals = if error > 0.0 && error.is_finite() { (-error.log10()).ceil().clamp(0.0, 10.0) as usize } else { 8 };
    format!("{value:.decimals$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_verdict_follows_from_the_numbers() {
        let verdict = |ours, error, study, reading| Finding::number(ours, error, study, reading).verdict;
        assert_eq!(verdict(4.38, 0.01, 4.4, 0.05), Verdict::Agrees);
        assert_eq!(verdict(4.38, 1e-8, 4.4, 0.05), Verdict::Refined);
        assert_eq!(verdict(4.30, 1e-8, 4.4, 0.05), Verdict::Contradicted);
        assert_eq!(verdict(4.38, 0.1, 4.4, 0.05), Verdict::NotDecided);
        assert_eq!(verdict(f64::NAN, 0.1, 4.4, 0.05), Verdict::NotDecided);
        assert_eq!(Finding::cases(&[true, false], String::new()).verdict, Verdict::Contradicted);
        assert_eq!(Finding::cases(&[], String::new()).verdict, Verdict::NotDecided);
        assert_eq!(Finding::vanishing(2e-6, 1e-6).verdict, Verdict::Contradicted);
    }

    #[test]
    fn what_failed_decides_nothing() {
        let claim = Claim::decided("7", "it holds", "yes", Err("no branch".into()));
        assert_eq!((claim.verdict, claim.note.as_str()), (Verdict::NotDecided, "no branch"));
    }

    #[test]
    fn as_many_digits_as_the_error_leaves() {
        assert_eq!(digits(10.340617138, 2e-7), "10.3406171");
        assert_eq!(digits(51.7, 3.0), "52");
    }
}
