//! The 3D views of the page: a surface and the medial meshes of its results.
//!
//! A view is a script file of one call, so that a page that was opened from a disk can load it:
//! browsers let it load scripts from there, and nothing else. Its text is JSON as gzip in Base64.
//!
//! Coarse surfaces are refined without changing their shape, because errors belong to vertices; very
//! fine ones are coarsened.

use std::collections::HashMap;

use medial::complex::{MedialMesh, MedialUnion, SheetGraph, SheetOptions};
use medial::surface::TriMesh;
use medial_run::text::significant;
use serde_json::json;

use crate::page::{pack, page_of_view};
use crate::render::{Camera, ColourMap, Errors, Scale};

/// Edges of a refined surface, as a share of its diagonal, while it has at most [`REFINED`] vertices.
const EDGE: f64 = 1.0 / 50.0;
const REFINED: usize = 20_000;

/// A surface with more vertices is coarsened, to cells of this share of its diagonal.
const MOST: usize = 60_000;
const CELL: f64 = 1.0 / 250.0;

/// Colours of a table.
const COLOURS: usize = 64;

/// A surface with the medial meshes of some results, in its unit, and their errors.
pub struct View3d<'a> {
    camera: Camera,
    /// Refined or coarsened.
    surface: TriMesh,
    results: Vec<(String, &'a MedialMesh)>,
    errors: Vec<Vec<f64>>,
    graphs: Vec<SheetGraph>,
}

impl<'a> View3d<'a> {
    /// A view of a surface with medial meshes, and their captions.
    ///
    /// # Errors
    /// When a medial mesh is empty or not valid.
    pub fn new(surface: &TriMesh, results: Vec<(String, &'a MedialMesh)>) -> Result<Self, String> {
        let camera = Camera::fitting(surface);
        let surface = match surface.vertices.len() {
            0..MOST => refined(surface),
            _ => coarsened(surface),
        };
        let mut errors = vec![];
        let (low, high) = surface.bounding_box().unwrap_or_default();
        let sizes = SheetOptions::of_diagonal(low.distance(high));
        let mut graphs = vec![];
        for (label, axis) in &results {
            let union = MedialUnion::new(axis).map_err(|error| format!("{label}: {error}"))?;
            graphs.push(SheetGraph::new(axis, sizes));
            // The union's distances are positive outside of it: a vertex inside is one that it reaches beyond.
            let signed = union.signed_batch(&surface.vertices);
            errors.push(signed.into_iter().map(|signed| -signed).collect());
        }
        Ok(Self { camera, surface, results, errors, graphs })
    }

    /// For each result how far its union reaches beyond the surface, at the vertices; negative where it falls
    /// short.
    pub(crate) fn errors(&self) -> Vec<Errors<'_>> {
        let surface = &self.surface;
        let values = self.errors.iter();
        values.map(|values| Errors { mesh: surface, values, caption: String::new() }).collect()
    }

    /// The file of the view with a name.
    pub fn script(&self, name: &str) -> String {
        format!("{START}{}{MIDDLE}{}{END}", serde_json::Value::from(name), self.packed())
    }

    /// A page of this view alone: one file, which opens without a network.
    pub fn page(&self, title: &str) -> String {
        page_of_view(title, &self.packed())
    }

    fn packed(&self) -> String {
        let Self { camera, surface, errors, .. } = self;
        let (low, high) = surface.bounding_box().unwrap_or_default();
        let diagonal = low.distance(high);
        let step = (high - low).max_element() / f64::from(u16::MAX);
        let end = Errors::common_scale(&self.errors().iter().collect::<Vec<_>>(), diagonal);
        let radii = Scale::radii(self.results.iter().map(|(_, axis)| *axis));
        let maps = [ColourMap::Viridis, ColourMap::Diverging, ColourMap::Parts];
        let colours = maps.map(|map| {
            (0..COLOURS).map(|k| map.at(k as f64 / (COLOURS - 1) as f64)).collect::<Vec<_>>()
        });
        let results = self.results.iter().zip(&self.graphs).zip(errors);
        let results = results.map(|(((label, axis), graph), errors)| {
            let spheres = axis.spheres.iter().flat_map(|sphere| {
                let [x, y, z] = sphere.centre.to_array();
                // More digits than a browser draws.
                [x, y, z, sphere.radius]
                    .map(|number| significant(number, 7).parse().unwrap_or(number))
            });
            let sheets = graph.sheet_of_face.iter().map(|&sheet| SheetGraph::colour(sheet));
            let seams: Vec<&[u32; 2]> = graph.seams.iter().flat_map(|seam| &seam.edges).collect();
            json!({
                "label": label,
                "structure": [graph.areas.len(), graph.seams.len(), graph.junctions.len()],
                "spheres": spheres.collect::<Vec<f64>>(),
                "edges": axis.edges.as_flattened(),
                "faces": axis.faces.as_flattened(),
                "seams": seams.into_iter().flatten().collect::<Vec<_>>(),
                "junctions": graph.junctions,
                "errors": errors.iter().map(|error| byte_of(error / end)).collect::<Vec<u8>>(),
                "sheets": sheets.map(|c| (255.0 * c).round() as u8).collect::<Vec<u8>>(),
            })
        });
        let places = surface.vertices.iter().flat_map(|&vertex| {
            let steps = ((vertex - low) / step.max(f64::MIN_POSITIVE)).round().to_array();
            steps.map(|steps| steps as u16)
        });
        let mut last = 0;
        let faces = surface.faces.as_flattened().iter().map(|&vertex| {
            // Small differences pack well.
            i64::from(vertex) - i64::from(std::mem::replace(&mut last, vertex))
        });
        let view = json!({
            "direction": camera.direction.to_array(),
            "up": camera.up.to_array(),
            "low": low.to_array(),
            "step": step,
            "diagonal": diagonal,
            // At the ends of the colours, in % of the diagonal.
            "largest_error": 100.0 * end / diagonal,
            "radii": [radii.lo, radii.hi],
            "colours": colours,
            // In steps from the lowest corner; faces as differences from the number before.
            "vertices": places.collect::<Vec<u16>>(),
            "faces": faces.collect::<Vec<i64>>(),
            "results": results.collect::<Vec<_>>(),
        });
        pack(view.to_string().as_bytes())
    }
}

/// An error as a byte: 128 for none, 1 and 255 for the ends and all beyond.
fn byte_of(share: f64) -> u8 {
    (128.0 + 127.0 * share.clamp(-1.0, 1.0)).round() as u8
}

const START: &str = "medialView(";
const MIDDLE: &str = ",\"";
const END: &str = "\");\n";

/// The text of a view within its file; `None` where that was changed to something that is no Base64: it would become
/// part of the page.
pub(crate) fn text_of(script: &str) -> Option<&str> {
    let inner = script.strip_prefix(START)?.strip_suffix(END)?;
    let text = inner.rsplit_once(MIDDLE)?.1;
    text.bytes().all(|byte| byte.is_ascii_alphanumeric() || b"+/=".contains(&byte)).then_some(text)
}

/// The same surface with shorter edges: long ones are halved as long as there is room.
fn refined(mesh: &TriMesh) -> TriMesh {
    let (low, high) = mesh.bounding_box().unwrap_or_default();
    let longest = EDGE * low.distance(high);
    let mut mesh = mesh.clone();
    while mesh.vertices.len() < REFINED {
        let finer = halved(&mesh, longest);
        if finer.vertices.len() == mesh.vertices.len() {
            break; // no edge was too long
        }
        mesh = finer;
    }
    mesh
}

/// The mesh with all edges halved that are longer than `longest`. An edge is halved in both its faces, so nothing
/// comes apart.
fn halved(mesh: &TriMesh, longest: f64) -> TriMesh {
    let mut vertices = mesh.vertices.clone();
    let mut middles: HashMap<[u32; 2], u32> = HashMap::new(); // looked up, never iterated
    let mut middle = |a: u32, b: u32| {
        let [p, q] = [a, b].map(|v| mesh.vertices[v as usize]);
        (p.distance(q) > longest).then(|| {
            *middles.entry([a.min(b), a.max(b)]).or_insert_with(|| {
                vertices.push(p.midpoint(q));
                vertices.len() as u32 - 1
            })
        })
    };
    let old = mesh.vertices.len() as u32;
    let mut faces = Vec::with_capacity(mesh.faces.len());
    for &[a, b, c] in &mesh.faces {
        let middles = [middle(a, b), middle(b, c), middle(c, a)];
        if let [Some(x), Some(y), Some(z)] = middles {
            faces.extend([[a, x, z], [x, b, y], [z, y, c], [x, y, z]]);
            continue; // while all edges are long
        }
        // Around the face, the middles of halved sides among its corners.
        let ring = [a, b, c].into_iter().zip(middles).flat_map(|(v, middle)| [Some(v), middle]);
        let mut ring: Vec<u32> = ring.flatten().collect();
        // A fan from a middle: from a corner it would have a face without area.
        let start = ring.iter().position(|&vertex| vertex >= old).unwrap_or(0);
        ring.rotate_left(start);
        faces.extend((2..ring.len()).map(|k| [ring[0], ring[k - 1], ring[k]]));
    }
    TriMesh { vertices, faces }
}

/// The surface with one vertex for each cell of a grid, the first one in it.
fn coarsened(mesh: &TriMesh) -> TriMesh {
    let (low, high) = mesh.bounding_box().unwrap_or_default();
    let cell = (CELL * low.distance(high)).max(f64::MIN_POSITIVE);
    let mut vertices = vec![];
    let mut cells: HashMap<[i64; 3], u32> = HashMap::new(); // looked up, never iterated
    let places: Vec<u32> = (mesh.vertices.iter())
        .map(|&vertex| {
            let key = ((vertex - low) / cell).floor().to_array().map(|x| x as i64);
            *cells.entry(key).or_insert_with(|| {
                vertices.push(vertex);
                vertices.len() as u32 - 1
            })
        })
        .collect();
    let faces = mesh.faces.iter().map(|face| face.map(|v| places[v as usize]));
    let faces = faces.filter(|[a, b, c]| a != b && b != c && c != a).collect();
    TriMesh { vertices, faces }
}

#[cfg(test)]
mod tests {
    use super::*;
    use base64::Engine;
    use base64::prelude::BASE64_STANDARD;
    use medial::Vec3;
    use medial::complex::Sphere;

    fn tetrahedron() -> TriMesh {
        let vertices = vec![Vec3::ZERO, Vec3::X, 0.01 * Vec3::Y, 0.5 * Vec3::Z];
        TriMesh { vertices, faces: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]] }
    }

    fn area(mesh: &TriMesh) -> f64 {
        (0..mesh.faces.len())
            .map(|f| {
                let [a, b, c] = mesh.triangle(f);
                0.5 * (b - a).cross(c - a).length()
            })
            .sum()
    }

    #[test]
    fn halving_keeps_the_surface_closed_and_its_area() {
        let coarse = tetrahedron();
        let fine = refined(&coarse);
        assert!(fine.vertices.len() > 100);
        assert!((area(&fine) - area(&coarse)).abs() < 1e-12);
        let mut sides: Vec<[u32; 2]> =
            fine.faces.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]).collect();
        sides.sort_unstable();
        assert!(sides.iter().all(|&[a, b]| sides.binary_search(&[b, a]).is_ok()));
        let longest = sides.iter().map(|side| {
            let [p, q] = side.map(|v| fine.vertices[v as usize]);
            p.distance(q)
        });
        assert!(longest.fold(0.0, f64::max) <= EDGE * 1.2);
    }

    #[test]
    fn a_fine_surface_is_coarsened_at_its_own_vertices() {
        let fine = refined(&tetrahedron());
        let coarse = coarsened(&fine);
        assert!(coarse.vertices.len() < fine.vertices.len());
        assert!(coarse.vertices.iter().all(|vertex| fine.vertices.contains(vertex)));
        assert!((area(&coarse) - area(&fine)).abs() < 0.02);
    }

    #[test]
    fn errors_are_encoded_as_bytes() {
        let ends = [-2.0, -1.0, 0.0, 0.5, 1.0, 9.0].map(byte_of);
        assert_eq!(ends, [1, 1, 128, 192, 255, 255]);
    }

    #[test]
    fn a_view_is_a_script_with_all_arrays() {
        let surface = tetrahedron();
        let spheres = vec![Sphere::new(Vec3::ZERO, 0.1), Sphere::new(Vec3::X, 0.2)];
        let axis = MedialMesh::from_simplices(spheres, vec![[0, 1]], vec![]).unwrap();
        let view = View3d::new(&surface, vec![("a \"b\"".into(), &axis)]).unwrap();
        let [errors] = view.errors().try_into().unwrap();
        assert!((errors.values[0] - 0.1).abs() < 1e-12 && (errors.values[1] - 0.2).abs() < 1e-12);
        let script = view.script("mesh-x");
        assert_eq!(script, view.script("mesh-x"));
        let packed = BASE64_STANDARD.decode(text_of(&script).unwrap()).unwrap();
        assert_eq!(text_of(&script.replace(END, "</script>\");\n")), None);
        let mut bytes = vec![];
        std::io::Read::read_to_end(
            &mut flate2::read::GzDecoder::new(packed.as_slice()),
            &mut bytes,
        )
        .unwrap();
        let view: serde_json::Value = serde_json::from_slice(&bytes).unwrap();
        let [vertices, faces] =
            ["vertices", "faces"].map(|key| view[key].as_array().unwrap().len());
        assert_eq!(vertices % 3 + faces % 3, 0);
        let result = &view["results"][0];
        let lengths = ["spheres", "edges", "faces", "errors", "sheets"]
            .map(|key| result[key].as_array().unwrap().len());
        assert_eq!(lengths, [8, 2, 0, vertices / 3, 0]);
    }
}
