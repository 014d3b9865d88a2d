//! Layers: what can be drawn, and the facets that it becomes.

use medial::Vec3;
use medial::complex::{MedialMesh, stability_ratio};
use medial::surface::TriMesh;
use rayon::prelude::*;

use super::camera::Frame;
use super::colour::{ColourMap, decode};
use super::creases::creases;
use super::error::RenderError;
use super::facets::{Batch, Facet, Kind, Lines, Paint};
use super::round::{ball, tube};

/// Something to draw. All layers of a scene are in the same unit.
#[derive(Clone, Copy, Debug)]
pub enum Layer<'a> {
    /// A closed surface, in plain grey.
    Surface(&'a TriMesh),
    /// A closed surface as faint glass: its rims and its sharp edges, with what is inside visible.
    Glass(&'a TriMesh),
    /// A closed surface as glass where nothing else is: what a reconstruction lacks.
    Ghost(&'a TriMesh),
    /// A surface coloured by a value at each vertex.
    Values {
        /// The surface.
        mesh: &'a TriMesh,
        /// A value for each vertex.
        values: &'a [f64],
        /// The colours of the values.
        scale: Scale,
    },
    /// A medial mesh: faces as sheets with their edges, edges without a face as tubes, spheres without an edge as
    /// balls.
    Axis {
        /// The medial mesh.
        mesh: &'a MedialMesh,
        /// Its colours.
        colour: AxisColour,
    },
}

/// What a medial mesh is coloured by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AxisColour {
    /// One colour for sheets, one for curves.
    Plain,
    /// The radii of the spheres.
    Radius(Scale),
    /// The stability ratio of edges, and of faces the least of their edges' ([`stability_ratio`]), from 0 to 1. The
    /// number is the unit of the mesh as a fraction of the bounding-box diagonal.
    Stability(f64),
}

/// A colour map over a range of values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// The value at the low end.
    pub lo: f64,
    /// The value at the high end.
    pub hi: f64,
    /// The colours.
    pub map: ColourMap,
}

impl Scale {
    /// Radii from the least to the largest of some medial meshes.
    pub fn radii<'m>(meshes: impl IntoIterator<Item = &'m MedialMesh>) -> Self {
        let radii = meshes.into_iter().flat_map(|mesh| mesh.spheres.iter().map(|s| s.radius));
        let (lo, hi) = radii.fold((f64::INFINITY, 0.0), |(lo, hi), r| (r.min(lo), r.max(hi)));
        Self { lo: lo.min(hi), hi, map: ColourMap::Viridis }
    }

    /// Errors of either sign up to a largest.
    pub fn errors(largest: f64) -> Self {
        Self { lo: -largest, hi: largest, map: ColourMap::Diverging }
    }

    /// Where a value is, 0 to 1 inside the range; in the middle of a range without extent.
    pub(super) fn place(&self, value: f64) -> f32 {
        let extent = self.hi - self.lo;
        if extent > 0.0 { ((value - self.lo) / extent) as f32 } else { 0.5 }
    }
}

/// Plain colours: the surface, sheets, curves.
const GREY: [u8; 3] = [0xD6, 0xD9, 0xDD];
const SHEET: [u8; 3] = [0x6F, 0xA8, 0xDC];
const CURVE: [u8; 3] = [0xD5, 0x5E, 0x00];

/// Radius of tubes, and of balls in tubes' radii, as shares of the picture's shorter side.
const TUBE: f64 = 0.0042;
const DOT: f64 = 1.7;

/// Width of lines, as a share of the picture's shorter side, and the least in pixels.
const LINE_WIDTH: f64 = 0.0016;
const LEAST_LINE: f64 = 0.9;

/// Edges shorter than the first, in pixels, have no lines, since these would cover the faces; longer than the
/// second, full ones.
const LINE_FADE: [f64; 2] = [3.0, 12.0];

/// Ink of full lines on sheets, of sharp edges on surfaces, and on glass.
const SHEET_INK: f32 = 0.62;
const SHARP_INK: f32 = 0.35;
const GLASS_INK: f32 = 0.45;

/// The picture that layers are made for.
#[derive(Clone, Copy)]
pub(super) struct Canvas<'a> {
    pub(super) frame: &'a Frame,
    pub(super) size: [usize; 2],
}

impl Canvas<'_> {
    fn shorter(&self) -> f64 {
        self.size[0].min(self.size[1]) as f64
    }

    /// Pixels for a unit.
    fn scale(&self) -> f64 {
        self.frame.scale(self.size[0], self.size[1])
    }

    fn lines(&self, opacity: f32) -> Option<Lines> {
        let width = (LINE_WIDTH * self.shorter()).max(LEAST_LINE);
        (opacity > 0.0).then_some(Lines { half_width: (0.5 * width) as f32, opacity })
    }
}

impl Layer<'_> {
    /// The points by which a camera is set up: those of surfaces, else the centres of spheres.
    pub(super) fn points(&self) -> Vec<Vec3> {
        match self {
            Self::Surface(mesh)
            | Self::Glass(mesh)
            | Self::Ghost(mesh)
            | Self::Values { mesh, .. } => mesh.vertices.clone(),
            Self::Axis { mesh, .. } => mesh.spheres.iter().map(|s| s.centre).collect(),
        }
    }

    /// The facets of the layer.
    pub(super) fn batches(&self, canvas: &Canvas<'_>) -> Result<Vec<Batch>, RenderError> {
        match *self {
            Self::Surface(mesh) => {
                let lines = canvas.lines(SHARP_INK);
                let facets = surface_facets(mesh, |_| [0.5; 3]);
                Ok(vec![Batch {
                    facets,
                    paint: Paint::Plain(decode(GREY)),
                    lines,
                    kind: Kind::Solid,
                }])
            }
            Self::Glass(mesh) => Ok(vec![glass(mesh, Kind::Glass, canvas)]),
            Self::Ghost(mesh) => Ok(vec![glass(mesh, Kind::Ghost, canvas)]),
            Self::Values { mesh, values, scale } => {
                let (vertices, values_given) = (mesh.vertices.len(), values.len());
                if vertices != values_given {
                    return Err(RenderError::Values { values: values_given, vertices });
                }
                let places = |face: usize| {
                    mesh.faces[face].map(|vertex| scale.place(values[vertex as usize]))
                };
                let facets = surface_facets(mesh, places);
                let paint = Paint::map(scale.map);
                Ok(vec![Batch { facets, paint, lines: None, kind: Kind::Solid }])
            }
            Self::Axis { mesh, colour } => {
                Ok(vec![sheets(mesh, colour, canvas), curves(mesh, colour, canvas)])
            }
        }
    }
}

/// The facets of a surface: smooth, with lines along its sharp edges.
fn surface_facets(mesh: &TriMesh, places: impl Fn(usize) -> [f32; 3] + Sync) -> Vec<Facet> {
    let creases = creases(mesh);
    let facet = |face: usize| Facet {
        corners: mesh.triangle(face),
        normals: creases.normals[face],
        places: places(face),
        lines: creases.sharp[face].map(u8::from),
    };
    (0..mesh.faces.len()).into_par_iter().map(facet).collect()
}

fn glass(mesh: &TriMesh, kind: Kind, canvas: &Canvas<'_>) -> Batch {
    let mut facets = surface_facets(mesh, |_| [0.0; 3]);
    facets.par_iter_mut().for_each(|facet| {
        facet.places = std::array::from_fn(|k| {
            canvas.frame.towards_eye(facet.corners[k]).dot(facet.normals[k]).abs() as f32
        });
    });
    let lines = canvas.lines(GLASS_INK);
    Batch { facets, paint: Paint::Plain([0.0; 3]), lines, kind }
}

/// Faces as flat facets with lines along their sides.
fn sheets(mesh: &MedialMesh, colour: AxisColour, canvas: &Canvas<'_>) -> Batch {
    let uses = uses_of_edges(mesh);
    let facet = |corners: &[u32; 3]| {
        let points = corners.map(|v| mesh.spheres[v as usize].centre);
        let flat = (points[1] - points[0]).cross(points[2] - points[0]).normalize_or_zero();
        let lines = std::array::from_fn(|k| {
            // Along a border only one facet draws its half.
            let used = edge(mesh, corners[k], corners[(k + 1) % 3]).map_or(0, |e| uses[e]);
            if used == 1 { 2 } else { 1 }
        });
        Facet {
            corners: points,
            normals: [flat; 3],
            places: face_places(mesh, corners, colour),
            lines,
        }
    };
    let facets = mesh.faces.par_iter().map(facet).collect();
    let fade =
        (median_length(mesh) * canvas.scale() - LINE_FADE[0]) / (LINE_FADE[1] - LINE_FADE[0]);
    let lines = canvas.lines(SHEET_INK * fade.clamp(0.0, 1.0) as f32);
    Batch { facets, paint: paint(colour, SHEET), lines, kind: Kind::Solid }
}

/// Edges without a face as tubes, spheres without an edge as balls.
fn curves(mesh: &MedialMesh, colour: AxisColour, canvas: &Canvas<'_>) -> Batch {
    let radius = TUBE * canvas.shorter() / canvas.scale();
    let uses = uses_of_edges(mesh);
    let mut facets = Vec::new();
    let mut joints = vec![None; mesh.spheres.len()];
    let mut is_used = vec![false; mesh.spheres.len()];
    for (ends, _) in mesh.edges.iter().zip(uses).filter(|(_, used)| *used == 0) {
        let places = edge_places(mesh, ends, colour);
        tube(ends.map(|v| mesh.spheres[v as usize].centre), radius, places, &mut facets);
        for k in 0..2 {
            joints[ends[k] as usize] = Some(places[k]);
        }
    }
    mesh.edges.iter().flatten().for_each(|&v| is_used[v as usize] = true);
    for (id, sphere) in mesh.spheres.iter().enumerate() {
        match (joints[id], is_used[id]) {
            (Some(place), _) => ball(sphere.centre, radius, place, &mut facets),
            (None, false) => {
                ball(sphere.centre, DOT * radius, sphere_place(mesh, id, colour), &mut facets);
            }
            (None, true) => {}
        }
    }
    Batch { facets, paint: paint(colour, CURVE), lines: None, kind: Kind::Solid }
}

fn paint(colour: AxisColour, plain: [u8; 3]) -> Paint {
    match colour {
        AxisColour::Plain => Paint::Plain(decode(plain)),
        AxisColour::Radius(scale) => Paint::map(scale.map),
        AxisColour::Stability(_) => Paint::map(ColourMap::Viridis),
    }
}

fn sphere_place(mesh: &MedialMesh, id: usize, colour: AxisColour) -> f32 {
    match colour {
        AxisColour::Radius(scale) => scale.place(mesh.spheres[id].radius),
        // A ball alone is no spike.
        AxisColour::Stability(_) | AxisColour::Plain => 1.0,
    }
}

fn edge_places(mesh: &MedialMesh, ends: &[u32; 2], colour: AxisColour) -> [f32; 2] {
    match colour {
        AxisColour::Stability(unit) => [ratio(mesh, *ends, unit); 2],
        _ => ends.map(|v| sphere_place(mesh, v as usize, colour)),
    }
}

fn face_places(mesh: &MedialMesh, corners: &[u32; 3], colour: AxisColour) -> [f32; 3] {
    let [a, b, c] = *corners;
    match colour {
        AxisColour::Stability(unit) => {
            let ratios = [[a, b], [b, c], [a, c]].map(|ends| ratio(mesh, ends, unit));
            [ratios[0].min(ratios[1]).min(ratios[2]); 3]
        }
        _ => corners.map(|v| sphere_place(mesh, v as usize, colour)),
    }
}

fn ratio(mesh: &MedialMesh, ends: [u32; 2], unit: f64) -> f32 {
    let [a, b] = ends.map(|v| {
        let mut sphere = mesh.spheres[v as usize];
        sphere.centre *= unit;
        sphere.radius *= unit;
        sphere
    });
    stability_ratio(a, b) as f32
}

fn edge(mesh: &MedialMesh, a: u32, b: u32) -> Option<usize> {
    mesh.edges.binary_search(&[a.min(b), a.max(b)]).ok()
}

/// How many faces each edge has.
fn uses_of_edges(mesh: &MedialMesh) -> Vec<u32> {
    let mut uses = vec![0; mesh.edges.len()];
    for &[a, b, c] in &mesh.faces {
        for side in [[a, b], [b, c], [a, c]] {
            if let Some(edge) = edge(mesh, side[0], side[1]) {
                uses[edge] += 1;
            }
        }
    }
    uses
}

/// Median length of the edges, 0 without any.
fn median_length(mesh: &MedialMesh) -> f64 {
    let centre = |v: u32| mesh.spheres[v as usize].centre;
    let mut lengths: Vec<f64> =
        mesh.edges.iter().map(|&[a, b]| centre(a).distance(centre(b))).collect();
    let middle = lengths.len() / 2;
    if lengths.is_empty() {
        return 0.0;
    }
    *lengths.select_nth_unstable_by(middle, f64::total_cmp).1
}
