//! Commands with placeholders.

use super::error::PluginFault;

/// What the runner fills in, beside the parameters.
pub(super) const PLACEHOLDERS: [&str; 7] =
    ["surface", "initial", "output", "spheres", "native", "seed", "threads"];

/// A word of a command: text and placeholders in turn.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Word(Vec<Piece>);

#[derive(Clone, Debug, PartialEq, Eq)]
enum Piece {
    Text(String),
    Placeholder(String),
}

impl Word {
    /// Reads a word: `{name}` is a placeholder, `{{` and `}}` are the braces themselves.
    pub fn parse(word: &str) -> Result<Self, PluginFault> {
        let unpaired = || PluginFault::Brace(word.to_owned());
        let (mut pieces, mut text, mut rest) = (Vec::new(), String::new(), word);
        while let Some(at) = rest.find(['{', '}']) {
            text.push_str(&rest[..at]);
            let (brace, after) = rest[at..].split_at(1);
            if let Some(after) = after.strip_prefix(brace) {
                text.push_str(brace);
                rest = after;
                continue;
            }
            let (name, after) = after.split_once('}').ok_or_else(unpaired)?;
            if brace == "}" || name.contains('{') {
                return Err(unpaired());
            }
            pieces.push(Piece::Text(std::mem::take(&mut text)));
            pieces.push(Piece::Placeholder(name.to_owned()));
            rest = after;
        }
        text.push_str(rest);
        pieces.push(Piece::Text(text));
        pieces.retain(|piece| *piece != Piece::Text(String::new()));
        Ok(Self(pieces))
    }

    /// Names of the placeholders.
    pub fn placeholders(&self) -> impl Iterator<Item = &str> {
        self.0.iter().filter_map(|piece| match piece {
            Piece::Placeholder(name) => Some(name.as_str()),
            Piece::Text(_) => None,
        })
    }

    /// The word where it has no placeholder.
    pub fn plain(&self) -> Option<String> {
        self.placeholders().next().is_none().then(|| self.fill(|_| String::new()))
    }

    /// The word with every placeholder replaced.
    pub fn fill(&self, value: impl Fn(&str) -> String) -> String {
        let piece = |piece: &Piece| match piece {
            Piece::Text(text) => text.clone(),
            Piece::Placeholder(name) => value(name),
        };
        self.0.iter().map(piece).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_text_and_placeholders() {
        let fill = |text: &str| Word::parse(text).map(|word| word.fill(str::to_uppercase));
        let cases =
            [("-k={k}:{seed}", "-k=K:SEED"), ("", ""), ("a}}{{b", "a}{b"), ("{{{x}}}", "{X}")];
        for (text, filled) in cases {
            assert_eq!(fill(text).expect("braces in pairs"), filled);
        }
        for text in ["{", "}", "{a", "a}", "{a{b}}", "{}}"] {
            assert!(matches!(fill(text), Err(PluginFault::Brace(_))), "{text}");
        }
    }
}
