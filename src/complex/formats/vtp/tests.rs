//! Files that VTK 9.7 wrote of one mesh (`by_vtk`), our own, and damaged ones.

use proptest::prelude::*;

use super::*;
use crate::Vec3;
use crate::complex::formats::look::{Look, SphereValues};
use crate::complex::{MedialMesh, Sphere};

const BY_VTK: [(&str, &[u8]); 7] = [
    ("ascii", include_bytes!("by_vtk/ascii.vtp")),
    ("binary", include_bytes!("by_vtk/binary.vtp")),
    ("binary, zlib", include_bytes!("by_vtk/binary-zlib.vtp")),
    ("appended base64", include_bytes!("by_vtk/appended.vtp")),
    ("appended base64, zlib: the default", include_bytes!("by_vtk/default.vtp")),
    ("appended raw", include_bytes!("by_vtk/raw.vtp")),
    ("appended raw, zlib, big-endian", include_bytes!("by_vtk/raw-zlib.vtp")),
];

/// Two faces, an edge without a face, a sphere without an edge.
fn mesh() -> MedialMesh {
    let spheres = [
        [0.1, -1.0 / 3.0, 1e-300, 0.5],
        [1.0, 0.0, 0.0, 0.25],
        [0.0, 1.0, 0.0, 0.125],
        [1.0, 1.0, 0.5, 0.75],
        [3.0, 0.0, 0.0, 2.5],
        [-7.0, 2.0, 1e22, 1.0],
    ];
    let spheres = spheres.map(|[x, y, z, r]| Sphere::new(Vec3::new(x, y, z), r)).to_vec();
    MedialMesh::from_simplices(spheres, vec![[3, 4]], vec![[0, 1, 2], [1, 2, 3]]).unwrap()
}

fn written(mesh: &MedialMesh, look: &Look) -> Vec<u8> {
    let mut bytes = Vec::new();
    write_to(&mut bytes, mesh, look).unwrap();
    bytes
}

fn message(bytes: impl AsRef<[u8]>) -> String {
    parse_vtp(bytes, "x.vtp").unwrap_err().to_string()
}

#[test]
fn every_encoding_of_vtk_is_read_bit_for_bit() {
    for (name, bytes) in BY_VTK {
        let loaded = parse_vtp(bytes, name).unwrap();
        assert_eq!(loaded.mesh, mesh(), "{name}");
        assert_eq!(loaded.notes, Vec::<String>::new(), "{name}");
    }
}

#[test]
fn own_files_come_back_bit_for_bit_with_values_or_without() {
    let mesh = mesh();
    let plain = written(&mesh, &Look::default());
    assert_eq!(parse_vtp(&plain, "x").unwrap().mesh, mesh);
    let text = String::from_utf8(plain).unwrap();
    assert!(text.contains("<PointData Scalars=\"radius\">"));
    assert!(text.contains("NumberOfVerts=\"1\" NumberOfLines=\"1\""));
    let look = Look { values: Some(SphereValues::stability(&mesh, 1.0)), balls: false };
    let loaded = parse_vtp(written(&mesh, &look), "x").unwrap();
    assert_eq!(loaded.mesh, mesh);
    assert_eq!(loaded.notes, ["1 array of point data was not used"]);
    let empty = MedialMesh::default();
    assert_eq!(parse_vtp(written(&empty, &Look::default()), "x").unwrap().mesh, empty);
}

const PIECES: &str = r#"<VTKFile type="PolyData" version="0.1"><PolyData>
<Piece NumberOfPoints="5" NumberOfLines="1" NumberOfStrips="1">
<PointData><DataArray type="Float32" Name="r" format="ascii">1 1 1 1 1</DataArray></PointData>
<Points><DataArray type="Int8" NumberOfComponents="3" format="ascii">0 0 0 1 0 0 2 0 0 3 0 0 4 0 0</DataArray></Points>
<Lines><DataArray type="UInt8" Name="connectivity">0 1 2</DataArray><DataArray type="Int32" Name="offsets">3</DataArray></Lines>
<Strips><DataArray type="Int16" Name="connectivity">1 2 3 4</DataArray><DataArray type="Int32" Name="offsets">4</DataArray></Strips>
</Piece>
<Piece NumberOfPoints="3" NumberOfPolys="1">
<PointData><DataArray type="Float32" Name="radius">1 2 3</DataArray></PointData>
<Points><DataArray type="Float64" NumberOfComponents="3">0 0 0 1 0 0 0 1 0</DataArray></Points>
<Polys><DataArray type="Int64" Name="connectivity">2 1 0</DataArray><DataArray type="Int64" Name="offsets">3</DataArray></Polys>
</Piece></PolyData></VTKFile>"#;

#[test]
fn polylines_strips_and_pieces_are_taken_apart() {
    let loaded = parse_vtp(PIECES, "x.vtp").unwrap();
    assert_eq!(loaded.mesh.faces, [[1, 2, 3], [2, 3, 4], [5, 6, 7]]);
    let edges = [[0, 1], [1, 2], [1, 3], [2, 3], [2, 4], [3, 4], [5, 6], [5, 7], [6, 7]];
    assert_eq!(loaded.mesh.edges, edges);
    assert_eq!(loaded.mesh.spheres[7].radius, 3.0);
}

#[test]
fn errors_name_the_array_or_the_cell() {
    for (from, to, expected) in [
        (
            "PolyData\" v",
            "ImageData\" v",
            "x.vtp: the file is not VTK PolyData but \"ImageData\"; ParaView saves what it shows as PolyData (.vtp)",
        ),
        (
            "Name=\"r\"",
            "Name=\"size\"",
            "x.vtp: its points have no array `radius` (nor `r`): not a medial mesh",
        ),
        (">1 1 1 1 1<", ">1 1 1 1<", "x.vtp: the array PointData/r: 4 numbers instead of 5"),
        (
            ">1 1 1 1 1<",
            ">1 1 -1 1 1<",
            "x.vtp: the medial mesh is not valid: sphere 2 is not valid: centre [2, 0, 0], radius -1",
        ),
        (
            ">1 1 1 1 1<",
            ">1 1 nan 1 1<",
            "x.vtp: the medial mesh is not valid: sphere 2 is not valid: centre [2, 0, 0], radius NaN",
        ),
        (">0 1 2<", ">0 1 5<", "x.vtp: Lines/connectivity names the point 5 of 5"),
        (
            ">0 1 2<",
            ">0 1 -2<",
            "x.vtp: the array Lines/connectivity: \"-2\" is no number of type UInt8",
        ),
        (
            "Int64\" Name=\"c",
            "Float64\" Name=\"c",
            "x.vtp: the array Polys/connectivity: its numbers are not whole",
        ),
        (
            "NumberOfPoints=\"5\"",
            "NumberOfPoints=\"4294967295\"",
            "x.vtp: the array PointData/r: 5 numbers instead of 4294967295",
        ),
        (
            "NumberOfPoints=\"5\"",
            "NumberOfPoints=\"42949672960\"",
            "x.vtp: 42949672960 points are more than 32-bit indices can name",
        ),
        (
            "NumberOfPoints=\"5\"",
            "NumberOfPoints=\"many\"",
            "x.vtp: Piece: the attribute NumberOfPoints is many, expected a number",
        ),
        (
            "NumberOfPolys=\"1\"",
            "NumberOfPolys=\"2\"",
            "x.vtp: the array Polys/offsets: 1 numbers instead of 2",
        ),
        (
            ">2 1 0</DataArray><DataArray type=\"Int64\" Name=\"offsets\">3<",
            ">2 1</DataArray><DataArray type=\"Int64\" Name=\"offsets\">2<",
            "x.vtp: polygon 0 has 2 corners; a medial mesh has triangles (ParaView's filter Triangulate makes some)",
        ),
        (
            "0.1\">",
            "0.1\" compressor=\"vtkLZ4DataCompressor\">",
            "x.vtp: arrays compressed by vtkLZ4DataCompressor are not read; save with zlib compression or none",
        ),
        (
            "format=\"ascii\">1",
            "format=\"appended\" offset=\"3\">1",
            "x.vtp: there is no element AppendedData",
        ),
        (
            "</Piece></PolyData>",
            "</Piece>",
            "x.vtp: byte 959: not XML: ill-formed document: expected `</PolyData>`, but `</VTKFile>` was found",
        ),
    ] {
        assert!(PIECES.contains(from), "{from}");
        assert_eq!(message(PIECES.replacen(from, to, 1)), expected);
    }
    assert_eq!(message("solid cube"), "x.vtp: there is no element VTKFile");
}

/// Lengths that lie about what is in memory or will be.
#[test]
fn lies_about_lengths_are_refused_before_memory_is_reserved() {
    let text = String::from_utf8(written(&mesh(), &Look::default())).unwrap();
    // The radii: 48 bytes, announced in the first word.
    let radii = "MAAAAAAAAAAAAAAAAADgPw";
    assert!(text.contains(radii));
    let error = message(text.replacen(radii, "/////////38AAAAAAADgPw", 1));
    assert_eq!(
        error,
        "x.vtp: the array PointData/radius should have 48 bytes, it has 9223372036854775807"
    );
    let error = message(text.replacen("NumberOfPoints=\"6\"", "NumberOfPoints=\"4294967295\"", 1));
    assert_eq!(error, "x.vtp: the array PointData/radius should have 34359738360 bytes, it has 48");
    // A bomb: 10^9 points of which all bytes are zero.
    let (points, bytes) = (1_000_000_000_u64, 8_000_000_000_u64);
    let header: Vec<u8> = [1, bytes, 0, 9].into_iter().flat_map(u64::to_le_bytes).collect();
    let header = base64::Engine::encode(&base64::prelude::BASE64_STANDARD, header);
    let bomb = format!(
        "<VTKFile type=\"PolyData\" header_type=\"UInt64\" compressor=\"vtkZLibDataCompressor\"><PolyData>\
         <Piece NumberOfPoints=\"{points}\"><PointData><DataArray type=\"Float64\" Name=\"radius\" format=\"binary\">\
         {header}AAAAAAAAAAAA</DataArray></PointData><Points><DataArray NumberOfComponents=\"3\" type=\"Float64\" \
         format=\"binary\">{header}AAAAAAAAAAAA</DataArray></Points></Piece></PolyData></VTKFile>"
    );
    assert!(message(&bomb).contains("more than the"), "{}", message(&bomb));
}

#[test]
fn cut_files_are_errors() {
    for (name, bytes) in BY_VTK {
        // Behind the data of the last array only elements are closed, and behind appended data nobody looks.
        let text = |word: &[u8]| bytes.windows(word.len()).rposition(|window| window == word);
        let end = match text(b"<AppendedData") {
            Some(_) => text(b"\n  </AppendedData").unwrap(),
            None => text(b"</VTKFile").unwrap(),
        };
        for length in (0..end).step_by(7) {
            assert!(parse_vtp(&bytes[..length], "x").is_err(), "{name}, {length}");
        }
    }
}

proptest! {
    #[test]
    fn damage_never_panics(
        which in 0..BY_VTK.len(), places in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
    ) {
        let mut bytes = BY_VTK[which].1.to_vec();
        for (place, byte) in places {
            let place = place.index(bytes.len());
            bytes[place] = byte;
        }
        if let Ok(loaded) = parse_vtp(&bytes, "x") {
            prop_assert_eq!(loaded.mesh.check(), Ok(()));
        }
    }
}
