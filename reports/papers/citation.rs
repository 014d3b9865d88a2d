//! Citations as methods write them, taken apart: `Authors YEAR. Title. Venue. https://doi.org/...`
//! or `Authors YEAR, Title, Venue, doi:...`, and several of them joined by `; `.

/// A citation that could be taken apart.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Citation {
    /// Names in the order in which they stand, each as it stands.
    pub(crate) authors: Vec<String>,
    pub(crate) title: String,
    /// Journal or proceedings, without volume and number.
    pub(crate) venue: Option<String>,
    pub(crate) volume: Option<String>,
    pub(crate) number: Option<String>,
    pub(crate) year: String,
    pub(crate) doi: Option<String>,
}

/// The citations of a text. They are told apart behind a DOI alone, since notes may hold a
/// semicolon.
pub(crate) fn pieces(text: &str) -> Vec<&str> {
    let mut pieces = Vec::new();
    let mut from = 0;
    for (at, _) in text.match_indices("; ") {
        if doi_of(&text[from..at]).is_some() {
            pieces.push(text[from..at].trim());
            from = at + 2;
        }
    }
    pieces.push(text[from..].trim());
    pieces.retain(|piece| !piece.is_empty());
    pieces
}

/// One citation taken apart; `None` where it is not of the two forms, or could be read in two ways.
pub(crate) fn parse(piece: &str) -> Option<Citation> {
    let (text, doi) = match doi_of(piece) {
        // A second one, or words behind it, would be lost.
        Some((before, doi, after)) if doi_of(before).is_none() && after.is_empty() => {
            (before, Some(doi))
        }
        Some(_) => return None,
        None => (piece, None),
    };
    let text = text.trim_end_matches([' ', ',', '.']);
    // Another address would become a part of the venue.
    if text.contains("://") {
        return None;
    }
    let (authors, year, separator, rest) = split_at_year(text)?;
    let authors = names(authors)?;
    let (title, venue) = match rest.split_once(separator) {
        Some((title, venue)) => (title, Some(venue)),
        None => (rest, None),
    };
    // With commas alone, a further one may belong to the title or to the venue.
    let is_ambiguous = separator == ", " && venue.is_some_and(|venue| venue.contains(", "));
    if title.trim().is_empty() || is_ambiguous {
        return None;
    }
    let (venue, volume, number) = venue.map_or((None, None, None), with_volume);
    Some(Citation {
        authors,
        title: title.trim().to_owned(),
        venue,
        volume,
        number,
        year: year.to_owned(),
        doi: doi.map(str::to_owned),
    })
}

/// What stands before the first DOI, the DOI, and what stands behind it. A DOI with characters that
/// BibTeX or LaTeX would take for their own is none.
fn doi_of(text: &str) -> Option<(&str, &str, &str)> {
    let marks = ["https://doi.org/", "http://doi.org/", "https://dx.doi.org/", "doi:"];
    let found = marks.iter().filter_map(|mark| Some((text.find(mark)?, mark.len())));
    let (at, length) = found.min()?;
    let (before, rest) = (&text[..at], &text[at + length..]);
    let rest = rest.trim_start();
    let end = rest.find(char::is_whitespace).unwrap_or(rest.len());
    let doi = rest[..end].trim_end_matches(['.', ',', ';']);
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-._;()/:".contains(c);
    let is_doi = doi.starts_with("10.") && doi.contains('/') && doi.chars().all(is_plain);
    is_doi.then(|| (before, doi, rest[end..].trim()))
}

/// Authors, year, what separates the parts behind the year, and these parts.
fn split_at_year(text: &str) -> Option<(&str, &str, &'static str, &str)> {
    let bytes = text.as_bytes();
    let is_year = |at: usize| {
        let year = text.get(at..at + 4)?;
        let year: u32 = year.bytes().all(|b| b.is_ascii_digit()).then(|| year.parse().ok())??;
        (1900..2100).contains(&year).then_some(())
    };
    let ends = |at: usize| matches!(bytes.get(at..at + 2), Some(b". " | b", "));
    let at = (1..bytes.len())
        .find(|&at| bytes[at - 1] == b' ' && is_year(at).is_some() && ends(at + 4))?;
    let separator = if bytes[at + 4] == b'.' { ". " } else { ", " };
    let authors = text[..at].trim_end_matches([' ', ',']);
    Some((authors, &text[at..at + 4], separator, text[at + 6..].trim()))
}

/// The names of a list; `None` where something in it does not look like one.
fn names(list: &str) -> Option<Vec<String>> {
    let list = list.replace(", and ", ", ").replace(" and ", ", ");
    let names: Vec<String> = list.split(", ").map(|name| name.trim().to_owned()).collect();
    names.iter().all(|name| is_name(name)).then_some(names)
}

/// A surname, or given names and a surname: each word begins with a capital but for particles, and
/// the last one is no initial, which would be half of a name turned around.
fn is_name(name: &str) -> bool {
    const PARTICLES: [&str; 14] = [
        "van", "von", "der", "den", "de", "du", "la", "le", "di", "da", "del", "dos", "ten", "ter",
    ];
    let words: Vec<&str> = name.split_whitespace().collect();
    let begins_high = |word: &str| word.chars().next().is_some_and(char::is_uppercase);
    let is_initial = words.last().is_none_or(|last| last.ends_with('.'));
    let no_digit = !name.chars().any(|c| c.is_ascii_digit());
    let fine = |word: &&str| begins_high(word) || PARTICLES.contains(word);
    // A sentence may begin like a name.
    no_digit && !is_initial && words.len() <= 5 && words.iter().all(fine)
}

/// A venue without its volume and number, which stand at its end: `Journal 35(1)`, `Journal 19`.
fn with_volume(venue: &str) -> (Option<String>, Option<String>, Option<String>) {
    let venue = venue.trim();
    let whole = || (Some(venue.to_owned()).filter(|venue| !venue.is_empty()), None, None);
    let Some((name, last)) = venue.rsplit_once(' ') else { return whole() };
    let (volume, number) = match last.strip_suffix(')').and_then(|last| last.split_once('(')) {
        Some((volume, number)) => (volume, Some(number)),
        None => (last, None),
    };
    // Four digits are a year: those of a conference.
    let is_volume =
        (1..=3).contains(&volume.len()) && volume.bytes().all(|byte| byte.is_ascii_digit());
    let is_number = number.is_none_or(|n| {
        !n.is_empty() && n.bytes().all(|byte| byte.is_ascii_digit() || byte == b'-')
    });
    if !is_volume || !is_number {
        return whole();
    }
    let name = name.trim_end_matches([',', ' ']).to_owned();
    (Some(name), Some(volume.to_owned()), number.map(str::to_owned))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cite(text: &str) -> Citation {
        parse(text).unwrap_or_else(|| panic!("{text}"))
    }

    #[test]
    fn both_forms_are_taken_apart() {
        let citation = cite(
            "Pan Li, Bin Wang 2015. Q-MAT: Computing It. ACM Transactions on Graphics 35(1). \
             https://doi.org/10.1145/2753755",
        );
        assert_eq!(citation.authors, ["Pan Li", "Bin Wang"]);
        assert_eq!(citation.title, "Q-MAT: Computing It");
        assert_eq!(citation.venue.as_deref(), Some("ACM Transactions on Graphics"));
        assert_eq!(
            (citation.volume.as_deref(), citation.number.as_deref()),
            (Some("35"), Some("1"))
        );
        assert_eq!(
            (citation.year.as_str(), citation.doi.as_deref()),
            ("2015", Some("10.1145/2753755"))
        );

        let citation =
            cite("Dey, Zhao 2002, Approximate medial axis, ACM Solid Modeling, doi:10.1145/5.6");
        assert_eq!(
            (citation.authors.len(), citation.title.as_str()),
            (2, "Approximate medial axis")
        );
        assert_eq!(
            (citation.venue.as_deref(), citation.volume),
            (Some("ACM Solid Modeling"), None)
        );

        let citation =
            cite("N. Amenta, M. Bern, 1999, Surface reconstruction, doi:10.1007/PL00009475");
        assert_eq!(citation.authors, ["N. Amenta", "M. Bern"]);
        assert_eq!((citation.venue, citation.doi.as_deref()), (None, Some("10.1007/PL00009475")));

        let citation = cite("Jan van der Berg and Ann de Vries 1999. A title. SIGGRAPH Asia 2013.");
        assert_eq!(citation.authors, ["Jan van der Berg", "Ann de Vries"]);
        assert_eq!((citation.venue.as_deref(), citation.doi), (Some("SIGGRAPH Asia 2013"), None));
    }

    #[test]
    fn what_could_be_misread_is_not_read() {
        for text in [
            "",
            "This project; not published.",
            "Who, when, where, DOI",
            "After the description in Li et al. 2015, Q-MAT, Graphics 35(1), doi:10.1/2",
            "Li, P., Wang, B. 2015. Title. Venue. doi:10.1/2",
            "Li 2015, A title, with a comma, Journal 3, doi:10.1/2",
            "Li 2015, One, Journal, doi:10.1/2, of Miklos 2010, doi:10.1/3",
            "Li 2015. A title. https://example.org/paper",
            "2015. Title. Venue.",
            "Li 15. Title. Venue.",
        ] {
            assert_eq!(parse(text), None, "{text}");
        }
    }

    #[test]
    fn papers_are_told_apart_behind_a_doi() {
        let two = "A B 1996, One, ICIP, doi:10.1109/1; C D 2003, Two, JCISE 3(4), doi:10.1115/2";
        assert_eq!(pieces(two).len(), 2);
        assert_eq!(pieces("This project; not published."), ["This project; not published."]);
        assert!(pieces(" ").is_empty());
    }

    #[test]
    fn any_text_is_survived() {
        for text in [
            "ä 1999. ö. ü",
            "é 2000",
            " 2000. ",
            "doi:",
            "doi:10.1/{}",
            "x doi:10.1/%#",
            "A 1999, ",
        ] {
            let _ = (parse(text), pieces(text));
        }
    }
}
