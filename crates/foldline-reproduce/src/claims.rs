//! Claims of a publication and their verdicts.
//!
//! **Idea.** A claim is decided by a [`Finding`]: a number with its error, or a fact that holds or does not. The
//! verdict follows from these alone. A number that could not be computed decides nothing.

use std::fmt;

/// Verdict on a claim.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// The numbers agree to the precision of the publication.
    Agrees,
    /// The numbers agree, and more is known: more digits, or the conditions under which the claim holds.
    Refined,
    /// The numbers differ.
    Contradicted,
    /// The numbers could not be computed well enough.
    NotDecided,
}

impl Verdict {
    /// Every verdict.
    pub const ALL: [Verdict; 4] = [Verdict::Agrees, Verdict::Refined, Verdict::Contradicted, Verdict::NotDecided];

    /// Name in words.
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
    /// The claim, reworded.
    pub statement: String,
    /// Value in the publication: a number, or that the claim holds.
    pub study: String,
    /// Computed value.
    pub ours: String,
    /// Estimated error of the computed value; `None` if it is no number.
    pub error: Option<f64>,
    /// Verdict.
    pub verdict: Verdict,
    /// Remark.
    pub note: String,
    /// True if it is an additional check or extension, not a claim of the publication.
    pub check: bool,
}

impl Claim {
    /// Returns a statement that the publication does not make: a check, or an extension; `expected` is the expected
    /// result.
    pub fn check(
        figure: &'static str,
        statement: impl Into<String>,
        expected: impl Into<String>,
        finding: Result<Finding, String>,
    ) -> Claim {
        Claim { check: true, ..Claim::decided(figure, statement, expected, finding) }
    }

    /// Returns a claim decided by a finding; an error gives the reason why there is none.
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

    /// Adds a remark after that of the finding.
    pub fn noting(mut self, note: &str) -> Claim {
        self.note = if self.note.is_empty() { note.into() } else { format!("{}. {note}", self.note) };
        self
    }
}

/// Computed evidence on a claim.
#[derive(Clone, Debug)]
pub struct Finding {
    /// In words or digits.
    pub ours: String,
    /// Estimated error of a number.
    pub error: Option<f64>,
    /// Verdict on the claim.
    pub verdict: Verdict,
    /// A remark.
    pub note: String,
}

impl Finding {
    /// Compares a number `ours` ± `error` with a number that the publication gives to the precision `reading`.
    ///
    /// If they differ by more than both uncertainties together, the claim is contradicted. Otherwise they agree; if the
    /// error is less than a hundredth of the reading, more digits are known than before and the claim is refined.
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

    /// A quantity that should vanish: tests if `ours` is at most `bound`, the tolerance of the run.
    pub fn vanishing(ours: f64, bound: f64) -> Finding {
        let verdict = match ours.is_finite() {
            false => Verdict::NotDecided,
            true if ours <= bound => Verdict::Agrees,
            true => Verdict::Contradicted,
        };
        Finding { ours: format!("{ours:.1e}"), error: Some(bound), verdict, note: String::new() }
    }

    /// A fact, with the numbers that support it.
    pub fn fact(holds: bool, ours: String) -> Finding {
        let verdict = if holds { Verdict::Agrees } else { Verdict::Contradicted };
        Finding { ours, error: None, verdict, note: String::new() }
    }

    /// A fact that holds with qualifications: under conditions, or more precisely than claimed.
    pub fn qualified(holds: bool, ours: String) -> Finding {
        let verdict = if holds { Verdict::Refined } else { Verdict::Contradicted };
        Finding { ours, error: None, verdict, note: String::new() }
    }

    /// A fact claimed of several cases; one counterexample contradicts it.
    pub fn cases(holds: &[bool], ours: String) -> Finding {
        let verdict = match (holds.is_empty(), holds.iter().all(|h| *h)) {
            (true, _) => Verdict::NotDecided,
            (_, true) => Verdict::Agrees,
            (_, false) => Verdict::Contradicted,
        };
        Finding { ours, error: None, verdict, note: String::new() }
    }

    /// Sets the error of the numbers.
    pub fn within(mut self, error: f64) -> Finding {
        self.error = Some(error);
        self
    }

    /// Adds a remark.
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
    fn failures_decide_nothing() {
        let claim = Claim::decided("7", "it holds", "yes", Err("no branch".into()));
        assert_eq!((claim.verdict, claim.note.as_str()), (Verdict::NotDecided, "no branch"));
    }

    #[test]
    fn numbers_have_as_many_digits_as_the_error_justifies() {
        assert_eq!(digits(10.340617138, 2e-7), "10.3406171");
        assert_eq!(digits(51.7, 3.0), "52");
    }
}
