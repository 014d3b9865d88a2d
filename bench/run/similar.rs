//! Suggestions for unknown words.

/// Smallest Jaro-Winkler similarity (1 for equal words) of a suggestion.
const MIN_SIMILARITY: f64 = 0.8;

/// `; did you mean ...?` for the known word that is most like the given one, or nothing.
pub fn did_you_mean<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    let word = word.to_lowercase();
    let alike = known.into_iter().map(|known| (strsim::jaro_winkler(&word, known), known));
    match alike.max_by(|a, b| a.0.total_cmp(&b.0)) {
        Some((similarity, known)) if similarity >= MIN_SIMILARITY => {
            format!("; did you mean `{known}`?")
        }
        _ => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::did_you_mean;

    #[test]
    fn only_what_is_alike_is_proposed() {
        let known = ["angle", "lambda", "qmat", "pmat"];
        assert_eq!(did_you_mean("qamt", known), "; did you mean `qmat`?");
        assert_eq!(did_you_mean("Lamda", known), "; did you mean `lambda`?");
        assert_eq!(did_you_mean("nothing", known), "");
    }
}
