//! Numbers and names as text, and names that are safe as file names.

/// A number with a fixed count of significant digits, without an exponent where it can be read
/// without one: `1.52`, `0.0371`, `34702`, `1.2e-9`.
pub fn significant(value: f64, digits: usize) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let scientific = format!("{:.*e}", digits.saturating_sub(1), value);
    // Taken after rounding: 9.996 has the exponent of 10.0.
    let exponent: i32 =
        scientific.rsplit_once('e').and_then(|(_, exponent)| exponent.parse().ok()).unwrap_or(0);
    if !(-5..9).contains(&exponent) {
        return scientific;
    }
    let decimals = (digits as i32 - 1 - exponent).max(0) as usize;
    format!("{value:.decimals$}")
}

/// A number with at most four significant digits and no trailing zero: `0.3333`, `60`.
pub fn trimmed(value: f64) -> String {
    let text = significant(value, 4);
    text.parse::<f64>().map_or(text, |rounded| rounded.to_string())
}

/// The least of 1, 2 and 5 times a power of ten that is not below a positive number.
pub fn round_up(value: f64) -> f64 {
    let power = 10.0_f64.powf(value.log10().floor());
    // Divisions round: a step of 0.1 that comes out a hair larger must not become 0.2.
    let found = [1.0, 2.0, 5.0].into_iter().find(|m| m * power >= value * (1.0 - 1e-9));
    found.unwrap_or(10.0) * power
}

/// The multiples of a round step in a range, and the step: the range has at most `most` of them.
pub fn round_steps(low: f64, high: f64, most: f64) -> (f64, Vec<f64>) {
    let step = round_up((high - low) / most);
    // An end that misses a multiple by rounding alone still has it.
    let first = (low / step - 1e-9).ceil() as i64;
    let last = (high / step + 1e-9).floor() as i64;
    (step, (first..=last).map(|k| k as f64 * step).collect())
}

/// A count with commas between the thousands: `34,702`.
pub fn grouped(count: u64) -> String {
    let digits = count.to_string();
    let mut text = String::with_capacity(digits.len() + digits.len() / 3);
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// `1 mesh`, `13 meshes`.
pub fn counted(count: usize, one: &str, many: &str) -> String {
    format!("{} {}", grouped(count as u64), if count == 1 { one } else { many })
}

/// Lines of cells in columns, two spaces apart; some columns are flush right.
pub fn aligned(lines: &[Vec<String>], is_right: impl Fn(usize) -> bool) -> String {
    let widest = |k: usize| lines.iter().map(|line| line[k].chars().count()).max().unwrap_or(0);
    let cell = |(k, cell): (usize, &String)| match is_right(k) {
        true => format!("{cell:>0$}", widest(k)),
        false => format!("{cell:<0$}", widest(k)),
    };
    let line =
        |cells: &Vec<String>| cells.iter().enumerate().map(cell).collect::<Vec<_>>().join("  ");
    lines.iter().map(|cells| line(cells).trim_end().to_owned() + "\n").collect()
}

/// Betti numbers as `1, 4, 0`, where they were computed.
pub fn betti(numbers: Option<[u64; 3]>) -> String {
    numbers.map_or("unknown".to_owned(), |[b0, b1, b2]| format!("{b0}, {b1}, {b2}"))
}

/// Memory in MB of a million bytes.
pub fn megabytes(bytes: u64) -> String {
    grouped((bytes as f64 / 1e6).round() as u64)
}

/// Text without control characters, which neither XML nor a table row can carry, and which a
/// terminal would obey.
pub fn printable(text: &str) -> String {
    text.chars()
        .map(|c| match c {
            '\n' | '\r' | '\t' => ' ',
            c if c.is_control() => '\u{fffd}',
            // Direction marks would reorder the text around them.
            '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}' => {
                '\u{fffd}'
            }
            c => c,
        })
        .collect()
}

/// Words as a command line, quoted where a shell would need it.
pub fn command_line(words: impl IntoIterator<Item: AsRef<str>>) -> String {
    // No shell gives these characters a meaning.
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_./=,:@%+".contains(c);
    let quoted = |word: &str| match !word.is_empty() && word.chars().all(is_plain) {
        true => word.to_owned(),
        false => format!("'{}'", word.replace('\'', r"'\''")),
    };
    words.into_iter().map(|word| quoted(word.as_ref())).collect::<Vec<_>>().join(" ")
}

/// Text cut to a number of characters, with an ellipsis where something was cut.
pub fn shortened(text: &str, limit: usize) -> String {
    if text.chars().count() <= limit {
        return text.to_owned();
    }
    text.chars().take(limit.saturating_sub(1)).chain(['…']).collect()
}

/// Distinct file stems for names, in their order: ASCII letters, digits, `-`, `_` and `.` stay,
/// everything else becomes `_`. No stem is empty, begins with a dot or is longer than 80 bytes,
/// and no two are equal, not even where case is ignored.
pub fn file_stems<'a>(names: impl IntoIterator<Item = &'a str>) -> Vec<String> {
    let mut stems: Vec<String> = Vec::new();
    for name in names {
        let base: String = name
            .chars()
            .map(|c| if c.is_ascii_alphanumeric() || "-_.".contains(c) { c } else { '_' })
            .take(80)
            .collect();
        let base = base.trim_start_matches('.').trim_end_matches('.');
        let base = if base.is_empty() { "unnamed" } else { base };
        let mut stem = base.to_owned();
        let mut number = 2; // the first one has none
        // Case-insensitive file systems would overwrite `bear` with `Bear`.
        while stems.iter().any(|other| other.eq_ignore_ascii_case(&stem)) {
            stem = format!("{base}-{number}");
            number += 1;
        }
        stems.push(stem); // taken for those that follow
    }
    stems
}

/// One name as a file stem: ASCII letters, digits, `-`, `_` and `.` stay, everything else becomes
/// `_`; never empty, beginning with a dot, or longer than 80 bytes.
pub fn file_stem(name: &str) -> String {
    file_stems([name]).remove(0)
}

/// Escapes text for HTML and XML, element content and quoted attributes alike.
pub fn escape_html(text: &str) -> String {
    let text = printable(text).replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
    text.replace('"', "&quot;").replace('\'', "&#39;")
}

/// Smallest Jaro-Winkler similarity (1 for equal words) of a suggestion.
const MIN_SIMILARITY: f64 = 0.8;

/// `; did you mean ...?` for the most similar known word, or an empty text.
pub fn did_you_mean<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    // Ids have no capitals, and titles do.
    let word = word.to_lowercase();
    let alike = known.into_iter().map(|known| (strsim::jaro_winkler(&word, known), known));
    match alike.max_by(|a, b| a.0.total_cmp(&b.0)) {
        Some((similarity, known)) if similarity >= MIN_SIMILARITY => {
            format!("; did you mean `{known}`?")
        }
        _ => String::new(),
    }
}

/// A fraction of the diagonal as a percentage with three significant digits.
pub fn percent(fraction: f64) -> String {
    format!("{} %", significant(100.0 * fraction, 3))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn significant_digits_survive_rounding_up() {
        assert_eq!(significant(0.0, 3), "0");
        assert_eq!(significant(9.996, 3), "10.0");
        assert_eq!(significant(1.5249, 3), "1.52");
        assert_eq!(significant(0.037_149, 3), "0.0371");
        assert_eq!(significant(34_702.4, 3), "34702");
        assert_eq!(significant(1.234e-9, 3), "1.23e-9");
        assert_eq!(significant(-0.5, 2), "-0.50");
        assert_eq!([1.0 / 3.0, 60.0, 0.30000000000000004].map(trimmed), ["0.3333", "60", "0.3"]);
    }

    #[test]
    fn thousands_are_grouped() {
        let texts: Vec<String> = [0, 999, 1000, 34_702, 1_234_567].map(grouped).into();
        assert_eq!(texts, ["0", "999", "1,000", "34,702", "1,234,567"]);
    }

    #[test]
    fn stems_are_safe_and_distinct() {
        let names = ["bear", "../../etc/passwd", "Bear", "", "..", "a b", "a/b", "日本", ".hidden"];
        let stems = file_stems(names);
        let expected = "bear _.._etc_passwd Bear-2 unnamed unnamed-2 a_b a_b-2 __ hidden";
        assert_eq!(stems.join(" "), expected);
        assert!(file_stems(["x".repeat(500).as_str()])[0].len() <= 80);
    }

    #[test]
    fn hostile_text_is_inert() {
        assert_eq!(
            escape_html("<script>alert('x')</script>&\"\u{0}\u{202e}"),
            "&lt;script&gt;alert(&#39;x&#39;)&lt;/script&gt;&amp;&quot;\u{fffd}\u{fffd}"
        );
    }

    #[test]
    fn only_similar_words_are_proposed() {
        let known = ["angle", "lambda", "qmat", "pmat"];
        assert_eq!(did_you_mean("qamt", known), "; did you mean `qmat`?");
        assert_eq!(did_you_mean("Lamda", known), "; did you mean `lambda`?");
        assert_eq!(did_you_mean("nothing", known), "");
    }
}
