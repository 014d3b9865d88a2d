//! From the bytes of a file to a polygon soup.
//!
//! Counts are compared with the size of the file before memory is reserved for them.

use std::fmt;
use std::path::Path;

use super::report::Fault;
use super::soup::PolygonSoup;
use super::{obj, off, ply, stl};
use crate::read_regular;

/// A surface file format.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Format {
    /// Geomview's object file format, with colours and normals passed over.
    Off,
    /// Wavefront OBJ.
    Obj,
    /// Stanford polygon file format, text or binary.
    Ply,
    /// Stereolithography, text or binary.
    Stl,
}

impl Format {
    /// The format of a path's extension, in upper or lower case.
    ///
    /// # Errors
    /// [`Fault::UnknownFormat`] when it is unknown.
    pub fn of(path: &Path) -> Result<Self, Fault> {
        let extension = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
        match extension.as_str() {
            "off" | "coff" | "noff" | "cnoff" | "stoff" => Ok(Self::Off),
            "obj" => Ok(Self::Obj),
            "ply" => Ok(Self::Ply),
            "stl" => Ok(Self::Stl),
            _ => Err(Fault::UnknownFormat { extension }),
        }
    }
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Off => "OFF",
            Self::Obj => "OBJ",
            Self::Ply => "PLY",
            Self::Stl => "STL",
        })
    }
}

/// Refuses text in UTF-16, whose line ends and digits hold a zero byte each.
pub(crate) fn check_encoding(bytes: &[u8]) -> Result<(), &'static str> {
    match bytes {
        [0xff, 0xfe, _, 0, ..] | [0xfe, 0xff, 0, ..] => {
            Err("text in UTF-16 is not read; write the file in UTF-8 or ASCII")
        }
        _ => Ok(()),
    }
}

/// Parses the content of a file that may have no face.
pub(super) fn parse_points(bytes: &[u8], format: Format) -> Result<PolygonSoup, Fault> {
    check_encoding(bytes).map_err(|why| Fault::Unsupported(why.into()))?;
    match format {
        Format::Off => off::parse(bytes),
        Format::Obj => obj::parse(bytes),
        Format::Ply => ply::parse(bytes),
        Format::Stl => stl::parse(bytes),
    }
}

/// Parses the content of a file.
pub(super) fn parse(bytes: &[u8], format: Format) -> Result<PolygonSoup, Fault> {
    let soup = parse_points(bytes, format)?;
    match soup.len() {
        0 => Err(Fault::NoFaces { vertices: soup.vertices.len() }),
        _ => Ok(soup),
    }
}

/// The content of a regular file: a pipe or a device may never end.
pub(super) fn content(path: &Path) -> Result<Vec<u8>, Fault> {
    read_regular(path).map_err(|error| Fault::Io(format!("cannot be read: {error}")))
}

#[cfg(test)]
mod tests {
    use super::super::text::Cursor;
    use super::*;
    use crate::Vec3;

    const TETRAHEDRON: &str = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n";
    const FACET: &str = "facet normal 0 0 -nan(ind)\n outer loop\n  vertex 0 0 0\n  \
                         vertex 1 0 0\n  vertex 0 1 0\n endloop\nendfacet\n";
    const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\n\
        property float y\nproperty float z\nelement face 1\n\
        property list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 0.1 0\n3 0 1 2\n";

    fn refuses(format: Format, text: &str, expected: &str) {
        assert_eq!(parse(text.as_bytes(), format).unwrap_err().to_string(), expected, "{text:?}");
    }

    #[test]
    fn lines_are_counted_for_every_kind_of_line_end_and_joined_only_in_obj() {
        for end in ["\n", "\r\n", "\r"] {
            let text = ["a b", "# c", "", "d#e", "f"].join(end);
            let mut cursor = Cursor::new(text.as_bytes(), Some(b'#'));
            assert_eq!(cursor.lines_left(9), 3);
            let tokens: Vec<_> =
                std::iter::from_fn(|| cursor.token()).map(|t| (t.text, t.line)).collect();
            assert_eq!(tokens, [(&b"a"[..], 1), (b"b", 1), (b"d", 4), (b"f", 5)]);
        }
        let text = b"f 1 2\\\n 3 \\ \r\n4\ng";
        let mut cursor = Cursor { joins: true, ..Cursor::new(text, Some(b'#')) };
        let line: Vec<_> = std::iter::from_fn(|| cursor.token_on_line()).map(|t| t.text).collect();
        assert_eq!(line, [&b"f"[..], b"1", b"2", b"3", b"4"]);
        assert!(cursor.next_line());
        assert_eq!(cursor.line, 4);
        let mut cursor = Cursor::new(text, None);
        assert_eq!(std::iter::from_fn(|| cursor.token()).count(), 7);
    }

    #[test]
    fn a_byte_order_mark_is_no_part_of_an_stl_file() {
        let facet = "facet normal 0 0 1 outer loop vertex 0 0 0 vertex 1 0 0 vertex 0 1 0 endloop endfacet\n";
        let text = format!("\u{feff}solid one\n{facet}endsolid one\n");
        assert_eq!(stl::parse(text.as_bytes()).map(|soup| soup.len()), Ok(1));
    }

    #[test]
    fn layouts_of_the_same_tetrahedron_in_off() {
        let stream = TETRAHEDRON.replace('\n', " ");
        for text in [
            format!("OFF\n4 4 6\n{TETRAHEDRON}"),
            format!("OFF 4 4\n{TETRAHEDRON}"),
            format!("OFF4 4 6\n{TETRAHEDRON}"),
            format!("\u{feff}OFF\n4\n4\n6\n{TETRAHEDRON}"),
            format!("OFF 4 4 6 {stream}"),
            format!("OFF\r\n# c\r\n4 4 6 # d\r\n\r\n{}", TETRAHEDRON.replace('\n', "\r\n")),
            format!("OFF\r4 4 6\r{}", TETRAHEDRON.replace('\n', "\r")),
            TETRAHEDRON.lines().fold("COFF\n4 4 0\n".to_owned(), |t, l| {
                t + l + if l.starts_with('3') { " 0.5 0.5 0.5\n" } else { " 255 0 0 255\n" }
            }),
            TETRAHEDRON.lines().fold("NOFF\n4 4 0\n".to_owned(), |t, l| {
                t + l + if l.starts_with('3') { "\n" } else { " 0 0 1\n" }
            }),
        ] {
            let soup = off::parse(text.as_bytes()).unwrap_or_else(|e| panic!("{text:?}: {e}"));
            assert_eq!((soup.vertices.len(), soup.len()), (4, 4), "{text:?}");
            assert_eq!((soup.polygon(3), soup.vertices[3]), (&[1, 2, 3][..], Vec3::Z), "{text:?}");
        }
        let colours = TETRAHEDRON.replace("0 0 1\n", "0 0 1 255 0 0\n");
        for (text, warning) in [
            (
                format!("{TETRAHEDRON}\nthe end\n"),
                "line 12: text after the last face (line 10) is ignored",
            ),
            (colours, "numbers after the coordinates of vertices are ignored"),
        ] {
            let soup = off::parse(format!("OFF\n4 4 6\n{text}").as_bytes()).unwrap();
            assert_eq!(
                (soup.vertices[3], &soup.warnings[..]),
                (Vec3::Z, &[warning.to_owned()][..])
            );
        }
    }

    #[test]
    fn statements_of_obj_that_matter() {
        let text = "# c\nmtllib a b.mtl\nf 1 2/1 3//1 \\\n 4/1/1\nv 0 0 0\nv 1 0 0 1.0\n\
                    v 1 1 0 255 0 0\nv 0 1 0\nf -4 -3 -2\r\nusemtl x\n";
        let soup = obj::parse(text.as_bytes()).unwrap();
        assert_eq!((soup.polygon(0), soup.polygon(1)), (&[0, 1, 2, 3][..], &[0, 1, 2][..]));
        assert_eq!((soup.vertices.len(), &*soup.lines, soup.warnings), (4, &[3, 9][..], vec![]));
        assert_eq!(obj::parse(b"hello world\n\nvx\n").unwrap().warnings.len(), 1);
    }

    /// A binary STL file with a header, an announced count and some equal triangles.
    fn binary_stl(name: &str, announced: u32, triangles: usize) -> Vec<u8> {
        let mut bytes = name.as_bytes().to_vec();
        bytes.resize(80, b' ');
        bytes.extend(announced.to_le_bytes());
        for _ in 0..triangles {
            let corners: [f32; 12] = [0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
            bytes.extend(corners.iter().flat_map(|c| c.to_le_bytes()));
            bytes.extend([0, 0]);
        }
        bytes
    }

    #[test]
    fn text_and_binary_stl_by_content() {
        for text in [
            format!("solid a b\n{FACET}{FACET}endsolid a b\n"),
            format!("SOLID\n{}endsolid\nsolid\n{FACET}endsolid", FACET.to_uppercase()),
            format!("solid\n{FACET}{FACET}endsolid\n").replace("end", "end "),
        ] {
            assert_eq!(stl::parse(text.as_bytes()).unwrap().len(), 2, "{text}");
        }
        for name in ["", "solid x", "solid\nfacet normal 0 0 0\n"] {
            let soup = stl::parse(&binary_stl(name, 2, 2)).unwrap();
            assert_eq!((soup.len(), soup.vertices.len(), soup.vertices[4].x), (2, 6, 1.0));
        }
        let mut trailing = binary_stl("x", 2, 2);
        trailing.extend(b"the end");
        let soup = stl::parse(&trailing).unwrap();
        assert_eq!((soup.len(), &*soup.warnings[0]), (2, "7 bytes after 2 triangles ignored"));
        for (name, announced, triangles, holds) in
            [("solid", 1000, 1, 50), ("x", 1, 2, 100), ("x", 0, 1, 50), ("x", u32::MAX, 0, 0)]
        {
            let error = stl::parse(&binary_stl(name, announced, triangles)).unwrap_err();
            let expected = format!(
                "the header announces {announced} triangles, but the file holds {holds} bytes after its header, 50 for \
                 each triangle"
            );
            assert_eq!(error.to_string(), expected);
        }
    }

    #[test]
    fn ply_in_double_precision_and_binary_with_the_element_at_fault() {
        let soup = ply::parse(PLY.as_bytes()).unwrap();
        assert_eq!((&*soup.lines, soup.vertices[2].y), (&[13][..], 0.1));
        assert_eq!(ply::parse(PLY.replace('\n', "\r\n").as_bytes()).unwrap().lines, [13]);
        let header = PLY.replace("ascii", "binary_big_endian");
        let mut file = header.as_bytes()[..header.find("0 0 0").unwrap()].to_vec();
        for x in [0_f32, 0., 0., 1., 0., 0., 0., 1., 0.] {
            file.extend(x.to_be_bytes());
        }
        file.push(3);
        file.extend([0_i32, 1, 2].iter().flat_map(|i| i.to_be_bytes()));
        assert_eq!(ply::parse(&file).unwrap().polygon(0), [0, 1, 2]);
        let message = |bytes: &[u8]| ply::parse(bytes).unwrap_err().to_string();
        let cut = message(&file[..file.len() - 1]);
        assert_eq!(cut, "the file ends before face 0 of 1");
        let last = file.len() - 1;
        file[last] = 9;
        assert_eq!(message(&file), "face 0 refers to vertex 9, but there are 3 vertices");
        let from_end = file.len() - 13 - 4;
        file[from_end..from_end + 4].copy_from_slice(&f32::INFINITY.to_be_bytes());
        assert_eq!(message(&file), "vertex 2 has the coordinate inf, which is not finite");
    }

    #[test]
    fn ply_as_other_programs_write_it() {
        let short = PLY.replace("1 0 0\n0 0.1 0", "1. -.0 +0\n0 .1 0.e1");
        let soup = ply::parse(short.as_bytes()).unwrap();
        assert_eq!(soup.vertices[1..], [Vec3::X, Vec3::new(0.0, 0.1, 0.0)]);
        let cr = short.replace('\n', "\r");
        assert_eq!(ply::parse(cr.as_bytes()).unwrap().lines, [13]);
        let error = ply::parse(cr.replace("3 0 1 2", "3 0 1 x").as_bytes()).unwrap_err();
        assert_eq!(error.to_string(), "line 13: expected face 0, found \"x\"");
        // A comment in Latin-1, and in binary files rows that begin with the byte of a line end.
        for end in ["\n", "\r\n", "\r"] {
            let header = PLY.replace("element vertex", "comment caf@\nelement vertex");
            let mut file = header.replace("ascii", "binary_little_endian").into_bytes();
            file.truncate(header.replace("ascii", "binary_little_endian").find("0 0 0").unwrap());
            let mut file = String::from_utf8(file).unwrap().replace('\n', end).into_bytes();
            *file.iter_mut().find(|byte| **byte == b'@').unwrap() = 0xe9;
            let first = f32::from_le_bytes([b'\n', b'\r', b'\n', 0]);
            for x in [first, 0., 0., 1., 0., 0., 0., 1., 0.] {
                file.extend(x.to_le_bytes());
            }
            file.push(3);
            file.extend([0_i32, 1, 2].iter().flat_map(|i| i.to_le_bytes()));
            let soup = ply::parse(&file).unwrap_or_else(|error| panic!("{end:?}: {error}"));
            assert_eq!((soup.vertices[0].x, soup.polygon(0)), (first.into(), &[0, 1, 2][..]));
        }
    }

    /// Files with their errors.
    const OFF_ERRORS: &str = r#" => the file ends before the keyword OFF
OFF => the file ends before the number of vertices
ply\n => line 1: expected the keyword OFF, found "ply"
OFF\n1 -1 0\n0 0 0\n => line 2: expected the number of faces, found "-1"
OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1\n => line 6: expected 3 vertices of face 0, got 2, found the end of the line
OFF\n3 1 0\n0 0 0 1\n1 0 0\n0 1 0\n3 0 1 2\n => line 3: expected the end of the line (other numbers than a colour need a prefix of OFF), found "1"
OFF\n3 1 0\n0 0 0\n1,5 0 0\n0 1 0\n3 0 1 2\n => line 4: expected 3 coordinates of vertex 1 of 3, found "1,5", a decimal comma
OFF\n3 1 0\n0 0 0\n1 x 0\n0 1 0\n3 0 1 2\n => line 4: expected 3 coordinates of vertex 1 of 3, found "x"
OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n => line 6: face 0 refers to vertex 3, but there are 3 vertices
OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n2 0 1\n => line 6: face 0 has 2 corners; at least 3 are needed
OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n3 0 2 1\n => line 7: expected no number after the 1 announced faces, found "3"
OFF\n3 2 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n => the file ends before face 1 of 2
OFF\n1000000000 2 0\n0 0 0\n => the header announces 1000000000 vertices, but the file holds only 7 bytes more
OFF\n1 1 0\n0 1e999 0\n3 0 0 0\n => line 3: vertex 0 has the coordinate inf, which is not finite
OFF BINARY\n => binary OFF is not read; write the surface as text
4OFF\n => OFF with four or n dimensions is not a surface in space"#;
    const OBJ_ERRORS: &str = r#"v 0 0 zero\n => line 1: expected 3 coordinates after v, found "zero"
v 0 0\nv => line 1: expected 3 coordinates after v, found the end of the line
v 0 0 => the file ends before 3 coordinates after v
v 0 0 nan\n => line 1: vertex 0 has the coordinate NaN, which is not finite
v 0 0 0\nf 1 1 x\n => line 2: expected v, v/vt, v//vn or v/vt/vn, found "x"
v 0 0 0\nf 1 1 1/a\n => line 2: expected v, v/vt, v//vn or v/vt/vn, found "1/a"
v 0 0 0\n\nf 1 0 1\n => line 3: face 0 refers to vertex 0, but there is 1 vertex
v 0 0 0\nf 1 -2 1\n => line 2: face 0 refers to vertex -2, but there is 1 vertex
v 0 0 0\nf 1 1 1\nf 1 2 1\n => line 3: face 1 refers to vertex 2, but there is 1 vertex
v 0 0 0\nf 1 -9223372036854775808 1\n => line 2: face 0 refers to vertex -9223372036854775808, but there is 1 vertex
v 0 0 0\nf 1 1\n => line 2: face 0 has 2 corners; at least 3 are needed"#;

    /// Replacements in [`PLY`] with the beginnings of their errors.
    const PLY_ERRORS: &str = r#"ply => pyl => line 1: expected a PLY header, found
ascii => text => line 2: expected a PLY header, found
format ascii 1.0\n =>  => line 1: expected a PLY header, found No format line found.
float z => float w => line 9: expected element vertex with x, y and z before it,
property float z => property list uchar float z => line 6: expected a number as the property z, found "list"
property list uchar int vertex_indices => property int vertex_indices => line 8: expected a list as the property vertex_indices, found "int"
float y => floot y => line 5: expected a PLY header, found
element face 1 => element face x => line 7: expected a PLY header, found
element face 1\nproperty list uchar int vertex_indices\n =>  => no face among 3 vertices; wrap the points
element face => element tristrips => PLY triangle strips are not read;
1 0 0\n => 1 0\n => line 11: expected vertex 1, found
3 0 1 2 => 3 0 1 3 => line 13: face 0 refers to vertex 3, but there are 3 vertices
3 0 1 2 => 3 0 1 -1 => line 13: expected face 0, found
3 0 1 2 => 3 0 1 1.5 => line 13: expected face 0, found
3 0 1 2 => 2 0 1 => line 13: face 0 has 2 corners; at least 3 are needed
3 0 1 2 => -1 0 1 => line 13: expected face 0, found
0 0.1 0\n => 0 nan 0\n => line 12: vertex 2 has the coordinate NaN, which is not finite
1 0 0\n => 1 0 0..\n => line 11: expected vertex 1, found "0.."
3 0 1 2\n =>  => the file ends before face 0
vertex 3 => vertex 99 => the header announces 99 vertices, but the file holds only 28"#;

    #[test]
    fn text_in_utf_16_is_named() {
        for big in [false, true] {
            let bytes = |unit: u16| if big { unit.to_be_bytes() } else { unit.to_le_bytes() };
            let text: Vec<u8> = "\u{feff}OFF\n".encode_utf16().flat_map(bytes).collect();
            let error = parse(&text, Format::Off).unwrap_err().to_string();
            assert_eq!(error, "text in UTF-16 is not read; write the file in UTF-8 or ASCII");
        }
    }

    #[test]
    fn errors_name_the_line() {
        // In `text => error`, `\n` ends a line of the file.
        for (format, table) in [(Format::Off, OFF_ERRORS), (Format::Obj, OBJ_ERRORS)] {
            for case in table.lines() {
                let (text, expected) = case.split_once(" => ").expect(case);
                refuses(format, &text.replace("\\n", "\n"), expected);
            }
        }
        let open = format!("solid\n{}endsolid", FACET.replace(" endloop", " vertex 0 0 0"));
        for (text, expected) in [
            ("solid x\n", "the file ends before facet or endsolid"),
            (&format!("solid\n{}", &FACET[..60]), "line 5: expected vertex, found \"vert\""),
            (&open, "line 7: expected endloop, found \"vertex\""),
            ("PK", "line 1: expected the word solid or a binary header of 84 bytes, found \"PK\""),
        ] {
            refuses(Format::Stl, text, expected);
        }
        for case in PLY_ERRORS.lines() {
            let case = case.replace("\\n", "\n");
            let [from, to, expected] = case.splitn(3, " => ").collect::<Vec<_>>()[..] else {
                panic!("{case}");
            };
            let text = PLY.replacen(from, to, 1);
            let error = parse(text.as_bytes(), Format::Ply).unwrap_err().to_string();
            assert!(error.starts_with(expected), "{from} to {to}: {error}");
        }
    }
}
