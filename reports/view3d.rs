//! The 3D views of the page: a surface and the medial meshes of its results.
//!
//! A view is a script file of one call, so that a page that was opened from a disk can load it:
//! browsers let it load scripts from there, and nothing else. Its text is gzip in Base64 of
//!
//! | bytes | what |
//! |---|---|
//! | 4 | length of the head, little-endian as all that follows |
//! | head | JSON, the meaning of the arrays; filled up with spaces to a multiple of four |
//! | `u32` | faces of the surface, three vertices each, as differences from the number before |
//! | for each result | spheres, four `f32` each; edges, two `u32` each; faces, three `u32` each; seams, two `u32` for each edge; junctions, one `u32` each |
//! | `u16` | vertices of the surface, in steps from the lowest corner |
//! | for each result | one byte for each vertex: its signed error, 128 for none; one byte for each face: the colour of its sheet |
//!
//! Coarse surfaces are refined without changing their shape, because errors belong to vertices; very
//! fine ones are coarsened.

use std::collections::HashMap;

use medial::Vec3;
use medial::complex::{MedialMesh, MedialUnion, SheetGraph, SheetOptions};
use medial::surface::TriMesh;
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
        let results = self.results.iter().zip(&self.graphs).map(|((label, axis), graph)| {
            let counts = [axis.spheres.len(), axis.edges.len(), axis.faces.len()];
            let seams = seams(graph).count();
            let sizes = [graph.areas.len(), graph.seams.len(), graph.junctions.len()];
            json!({"label": label, "counts": counts, "seams": seams, "structure": sizes})
        });
        let head = json!({
            "direction": camera.direction.to_array(),
            "up": camera.up.to_array(),
            "surface": [surface.vertices.len(), surface.faces.len()],
            "low": low.to_array(),
            "step": step,
            "diagonal": diagonal,
            // At the ends of the colours, in % of the diagonal.
            "largest_error": 100.0 * end / diagonal,
            "radii": [radii.lo, radii.hi],
            "colours": colours,
            "results": results.collect::<Vec<_>>(),
        });
        let mut head = head.to_string().into_bytes();
        // The browser reads the arrays in place, which must begin at a multiple of four.
        head.resize(head.len().next_multiple_of(4), b' ');
        let mut bytes = (head.len() as u32).to_le_bytes().to_vec();
        bytes.append(&mut head);
        self.arrays(surface, (low, step), &mut bytes);
        for (values, graph) in errors.iter().zip(&self.graphs) {
            bytes.extend(values.iter().map(|error| byte_of(error / end)));
            let colours = graph.sheet_of_face.iter().map(|&sheet| SheetGraph::colour(sheet));
            bytes.extend(colours.map(|colour| (255.0 * colour).round() as u8));
        }
        pack(&bytes)
    }

    /// Everything but the errors.
    fn arrays(&self, surface: &TriMesh, (low, step): (Vec3, f64), bytes: &mut Vec<u8>) {
        let mut last = 0_u32;
        for &vertex in surface.faces.iter().flatten() {
            // Small differences pack well.
            bytes.extend(vertex.wrapping_sub(last).to_le_bytes());
            last = vertex;
        }
        for ((_, axis), graph) in self.results.iter().zip(&self.graphs) {
            for sphere in &axis.spheres {
                let [x, y, z] = sphere.centre.to_array();
                let numbers = [x, y, z, sphere.radius].map(|number| (number as f32).to_le_bytes());
                bytes.extend(numbers.as_flattened());
            }
            let vertices = axis.edges.as_flattened().iter().chain(axis.faces.as_flattened());
            let vertices = vertices.chain(seams(graph).flatten()).chain(&graph.junctions);
            bytes.extend(vertices.flat_map(|vertex| vertex.to_le_bytes()));
        }
        for &vertex in &surface.vertices {
            let steps = ((vertex - low) / step.max(f64::MIN_POSITIVE)).round().to_array();
            bytes.extend(steps.map(|steps| (steps as u16).to_le_bytes()).as_flattened());
        }
    }
}

/// The edges of all seams.
fn seams(graph: &SheetGraph) -> impl Iterator<Item = &[u32; 2]> {
    graph.seams.iter().flat_map(|seam| &seam.edges)
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
        let length = u32::from_le_bytes(bytes[..4].try_into().unwrap()) as usize;
        assert_eq!(length % 4, 0);
        let head: serde_json::Value = serde_json::from_slice(&bytes[4..4 + length]).unwrap();
        let [vertices, faces] = [0, 1].map(|k| head["surface"][k].as_u64().unwrap() as usize);
        assert_eq!(head["results"][0]["counts"], serde_json::json!([2, 1, 0]));
        assert_eq!(bytes.len(), 4 + length + 12 * faces + 2 * 16 + 8 + 6 * vertices + vertices);
    }
}
