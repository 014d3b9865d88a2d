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
