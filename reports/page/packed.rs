//! Text that stands in the page compressed, for the script.

use std::io::Write;

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use flate2::Compression;
use flate2::write::GzEncoder;

/// Bytes as gzip in Base64.
pub(crate) fn pack(bytes: &[u8]) -> String {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::best());
    // A vector takes all that is written.
    let packed = encoder.write_all(bytes).and_then(|()| encoder.finish());
    BASE64_STANDARD.encode(packed.unwrap_or_default())
}

/// An element that holds a text packed. A browser reads over it in no time.
pub(crate) fn packed(id: Option<&str>, text: &str) -> String {
    let id = id.map_or(String::new(), |id| format!(" id=\"{id}\""));
    let text = pack(text.as_bytes());
    format!("<script type=\"text/plain\" class=\"packed\"{id}>{text}</script>\n")
}

#[cfg(test)]
mod tests {
    use std::io::Read;

    use flate2::read::GzDecoder;

    use super::*;

    #[test]
    fn what_is_packed_comes_back_and_is_the_same_each_time() {
        let text = "</script><b>\u{e9}".repeat(100);
        let element = packed(Some("rows"), &text);
        assert_eq!(element, packed(Some("rows"), &text));
        assert!(element.len() < text.len(), "{element}");
        let inside = element.split_once('>').unwrap().1.strip_suffix("</script>\n").unwrap();
        let bytes = BASE64_STANDARD.decode(inside).unwrap();
        let mut back = String::new();
        GzDecoder::new(bytes.as_slice()).read_to_string(&mut back).unwrap();
        assert_eq!(back, text);
    }
}
