//! Binary glTF: all triangles of the scene, in one soup; [`crate::glb`] says how they are read.
//!
//! A glTF mesh repeats its vertices where normals or textures differ; equal positions are welded afterwards, as in STL.

use crate::glb::{Part, parts};
use crate::surface::error::{Fault, Place};
use crate::surface::soup::PolygonSoup;

/// Parses a binary glTF file.
pub(super) fn parse(bytes: &[u8]) -> Result<PolygonSoup, Fault> {
    let scene = parts(bytes)?;
    let mut soup = PolygonSoup { warnings: scene.passed_over, ..PolygonSoup::default() };
    let mut segments = 0;
    for Part { points, triangles, segments: lines, .. } in scene.parts {
        let first = soup.vertices.len() as u32;
        for point in points {
            let vertex = soup.vertices.len();
            soup.push_vertex(point.to_array(), || Place::Element("vertex", vertex))?;
        }
        for triangle in triangles {
            // In range: `push_vertex` refuses more vertices than 32 bits name.
            soup.corners.extend(triangle.map(|corner| first + corner));
            soup.end_polygon(None)?;
        }
        segments += lines.len();
    }
    if segments > 0 {
        soup.warnings.push(format!("{segments} lines are no part of a surface and are ignored"));
    }
    let turned = "glTF has y up: read with z up, (x, y, z) as (x, -z, y), as Blender does";
    soup.warnings.push(turned.to_owned());
    Ok(soup)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use serde_json::json;

    use crate::glb::pack;
    use crate::glb::tests::{binary, file, scene, with};
    use crate::surface::{Fault, Format, inspect_bytes};

    #[test]
    fn a_solid_is_one_and_the_turn_is_told() {
        let inspection = inspect_bytes(&file(&scene()), Format::Glb).unwrap();
        assert_eq!(inspection.refused, None);
        let told = ["glTF has y up: read with z up, (x, y, z) as (x, -z, y), as Blender does"];
        assert_eq!(inspection.report.warnings, told);
    }

    #[test]
    fn a_number_that_is_none_is_told_by_its_vertex() {
        let mut bytes = binary();
        bytes[16..20].copy_from_slice(&f32::NAN.to_le_bytes());
        let bytes = pack(&scene().to_string(), &bytes).unwrap();
        let fault = inspect_bytes(&bytes, Format::Glb).unwrap_err().fault;
        let is_named =
            matches!(fault, Fault::Coordinate { vertex: 1, value, .. } if value.is_nan());
        assert!(is_named, "{fault}");
        let points = with("/meshes/0/primitives/0/mode", json!(0));
        let fault = inspect_bytes(&file(&points), Format::Glb).unwrap_err().fault;
        assert_eq!(fault, Fault::NoFaces { vertices: 4 });
    }

    proptest! {
        #[test]
        fn damage_never_panics(
            places in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
        ) {
            let mut bytes = file(&scene());
            for (place, byte) in places {
                let place = place.index(bytes.len());
                bytes[place] = byte;
            }
            let _ = inspect_bytes(&bytes, Format::Glb);
        }
    }
}
