//! The scene: drawable layers, and their facets.

use medial::Vec3;
use medial::complex::{MedialMesh, Sphere};
use medial::geometry::DisjointSets;
use medial::surface::{TriMesh, smooth_normals};
use rayon::prelude::*;

use super::camera::Frame;
use super::light::{GLASS, Paint, PixelLight, crevices, decode, encode};
use super::picture::{Background, Picture};
use super::raster::{Batch, Facet, Kind, Look, rasterise};
use super::scale::Scale;
use super::{FEWEST_PIXELS, MOST_PIXELS, RenderError};

/// A picture's content, without the camera.
#[derive(Clone, Debug)]
pub(crate) struct Scene<'a> {
    /// The drawn layers, all in one unit.
    pub(crate) layers: Vec<Layer<'a>>,
    /// Width and height in pixels.
    pub(crate) size: [usize; 2],
    pub(crate) background: Background,
}

/// Something to draw.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Layer<'a> {
    /// A closed surface, in plain grey.
    Surface(&'a TriMesh),
    /// A closed surface as faint glass: its rims and its sharp edges, with the inside visible.
    Glass(&'a TriMesh),
    /// A closed surface as glass where nothing else is: the missing parts of a reconstruction.
    Ghost(&'a TriMesh),
    /// A surface coloured by a value at each vertex.
    Values { mesh: &'a TriMesh, values: &'a [f64], scale: Scale },
    /// A medial mesh: faces as sheets with their edges, edges without a face as tubes, spheres without an edge as
    /// balls.
    Axis {
        mesh: &'a MedialMesh,
        /// The colours of the spheres' radii; without them one colour for sheets and one for curves.
        colour: Option<Scale>,
    },
}

impl Scene<'_> {
    /// Takes the picture. Parallel; the same pixels for any number of threads. Time linear in the number of triangles
    /// and of pixels.
    pub(crate) fn picture(&self, frame: &Frame) -> Result<Picture, RenderError> {
        let [width, height] = self.size;
        // Too small to be a picture, or too large for the exact arithmetic of edges.
        if !self.size.iter().all(|side| (FEWEST_PIXELS..=MOST_PIXELS).contains(side)) {
            return Err(RenderError::Size { width, height });
        }
        let canvas = Canvas {
            frame,
            scale: frame.scale(self.size),
            shorter: self.size[0].min(self.size[1]) as f64,
        };
        let mut batches = Vec::new();
        for layer in &self.layers {
            layer.add_to(&mut batches, &canvas)?;
        }
        let lights = rasterise(batches, frame, self.size);
        // Crevices need the depth of neighbours, so they come after all facets are drawn.
        let shares = crevices(&lights, self.size);
        let pixels = (lights.par_iter().zip(&shares))
            .map(|(light, &share)| composed(light, share, self.background))
            .collect();
        Ok(Picture { width, height, pixels })
    }
}

/// A pixel over the background; `share` of the light of solid facets is left by crevices.
fn composed(light: &PixelLight, share: f32, background: Background) -> [u8; 4] {
    let seen = light.solid_share + light.glass_share;
    let sum: [f32; 3] =
        std::array::from_fn(|k| share * light.solid[k] + light.glass_share * GLASS[k]);
    match background {
        Background::Transparent if seen <= 0.0 => background.pixel(),
        Background::Transparent => {
            // Straight alpha: the colour is that of the covered part alone.
            let [r, g, b] = encode(sum.map(|s| s / seen));
            [r, g, b, (255.0 * seen.min(1.0)).round() as u8]
        }
        Background::Colour(rgb) => {
            let behind = decode(rgb);
            let rest = (1.0 - seen).max(0.0);
            let [r, g, b] = encode(std::array::from_fn(|k| sum[k] + rest * behind[k]));
            [r, g, b, 255]
        }
    }
}

/// Plain colours: the surface, sheets, curves.
const GREY: [u8; 3] = [0xD6, 0xD9, 0xDD];
const SHEET: [u8; 3] = [0x6F, 0xA8, 0xDC];
const CURVE: [u8; 3] = [0xD5, 0x5E, 0x00];

/// Radius of tubes, and of balls in tubes' radii, as shares of the picture's shorter side.
const TUBE: f64 = 0.0042;
const DOT: f64 = 1.7;

/// Edges shorter than the first, in pixels, have no lines, since these would cover the faces; longer than the second,
/// full ones.
const LINE_FADE: [f64; 2] = [3.0, 12.0];

/// Ink of full lines on sheets, of sharp edges on surfaces, and on glass.
const SHEET_INK: f32 = 0.62;
const SHARP_INK: f32 = 0.35;
const GLASS_INK: f32 = 0.45;

/// The picture that layers are made for.
struct Canvas<'a> {
    frame: &'a Frame,
    /// Pixels for a unit.
    scale: f64,
    /// The shorter side, in pixels.
    shorter: f64,
}

impl Layer<'_> {
    /// Adds the facets of the layer.
    fn add_to(&self, batches: &mut Vec<Batch>, canvas: &Canvas<'_>) -> Result<(), RenderError> {
        let (facets, look) = match *self {
            Self::Surface(mesh) => {
                let paint = Paint::plain(decode(GREY));
                let look = Look { paint, ink: SHARP_INK, kind: Kind::Solid };
                (surface_facets(mesh, |_, _| 0.5), look)
            }
            Self::Glass(mesh) | Self::Ghost(mesh) => {
                // Rims are more opaque: the values of a facet are how much it faces the eye.
                let facing = |_, normal| canvas.frame.back.dot(normal).abs() as f32;
                let kind = if matches!(self, Self::Ghost(_)) { Kind::Ghost } else { Kind::Glass };
                let paint = Paint::plain([0.0; 3]);
                (surface_facets(mesh, facing), Look { paint, ink: GLASS_INK, kind })
            }
            Self::Values { mesh, values, scale } => {
                let (vertices, found) = (mesh.vertices.len(), values.len());
                if vertices != found {
                    return Err(RenderError::Values { values: found, vertices });
                }
                // No lines: ink would look like a value.
                let look = Look { paint: Paint::map(scale.map), ink: 0.0, kind: Kind::Solid };
                (surface_facets(mesh, |v, _| scale.place(values[v as usize])), look)
            }
            Self::Axis { mesh, colour } => {
                batches.extend(axis_batches(mesh, colour, canvas));
                return Ok(());
            }
        };
        batches.push(Batch { facets, look }); // of equal depth the earlier layer stays
        Ok(())
    }
}

/// The facets of a surface: smooth, with lines along its sharp edges. `place` in the colour map is by vertex and normal.
fn surface_facets(mesh: &TriMesh, place: impl Fn(u32, Vec3) -> f32 + Sync) -> Vec<Facet> {
    let flat: Vec<Vec3> = (0..mesh.faces.len())
        .into_par_iter()
        .map(|face| {
            let [a, b, c] = mesh.triangle(face);
            // Of unit sides: the square of a tiny length would vanish.
            let (u, v) = ((b - a).normalize_or_zero(), (c - a).normalize_or_zero());
            u.cross(v).normalize_or_zero()
        })
        .collect();
    let (normals, sharp) =
        (smooth_normals(mesh, &flat, CREASE.to_radians().cos()), sharp_sides(mesh, &flat));
    (mesh.faces.par_iter().enumerate())
        .map(|(face, corners)| {
            let normals = normals(face);
            let places = std::array::from_fn(|k| place(corners[k], normals[k]));
            let lines = sharp[face].map(u8::from);
            Facet { corners: mesh.triangle(face), normals, places, lines }
        })
        .collect()
}

/// The number of an edge in a medial mesh, whose edges are sorted.
fn edge_of(mesh: &MedialMesh, a: u32, b: u32) -> Option<usize> {
    mesh.edges.binary_search(&[a.min(b), a.max(b)]).ok()
}

/// Faces as flat facets with lines along their sides; edges without a face as tubes, spheres without an edge as balls.
fn axis_batches(mesh: &MedialMesh, colour: Option<Scale>, canvas: &Canvas<'_>) -> [Batch; 2] {
    // How many faces each edge has.
    let mut uses = vec![0; mesh.edges.len()];
    for &[a, b, c] in &mesh.faces {
        for edge in [edge_of(mesh, a, b), edge_of(mesh, b, c), edge_of(mesh, a, c)] {
            edge.into_iter().for_each(|edge| uses[edge] += 1);
        }
    }
    let place = |sphere: &Sphere| colour.map_or(1.0, |scale| scale.place(sphere.radius));
    let paint = |plain| colour.map_or_else(|| Paint::plain(decode(plain)), |s| Paint::map(s.map));
    let sheet = |face: &[u32; 3]| {
        let spheres = face.map(|v| &mesh.spheres[v as usize]);
        let corners = spheres.map(|sphere| sphere.centre);
        let flat = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize_or_zero();
        let lines = std::array::from_fn(|k| {
            // Along a border only one facet draws its half.
            let used = edge_of(mesh, face[k], face[(k + 1) % 3]).map_or(0, |edge| uses[edge]);
            if used == 1 { 2 } else { 1 }
        });
        Facet { corners, normals: [flat; 3], places: spheres.map(place), lines }
    };
    let mut lengths: Vec<f64> = (mesh.edges.iter())
        .map(|edge| edge.map(|v| mesh.spheres[v as usize].centre))
        .map(|[a, b]| a.distance(b))
        .collect();
    lengths.sort_by(f64::total_cmp);
    // By the median, so that the lines of one mesh are all alike.
    let median = lengths.get(lengths.len() / 2).map_or(0.0, |length| length * canvas.scale);
    let fade = (median - LINE_FADE[0]) / (LINE_FADE[1] - LINE_FADE[0]);
    let ink = SHEET_INK * fade.clamp(0.0, 1.0) as f32;
    let sheets = Batch {
        facets: mesh.faces.par_iter().map(sheet).collect(),
        look: Look { paint: paint(SHEET), ink, kind: Kind::Solid },
    };

    let radius = TUBE * canvas.shorter / canvas.scale;
    let mut facets = Vec::new();
    let mut has_edge = vec![false; mesh.spheres.len()];
    let mut has_tube = has_edge.clone();
    for (ends, used) in mesh.edges.iter().zip(uses) {
        if used == 0 {
            let spheres = ends.map(|v| &mesh.spheres[v as usize]);
            tube(spheres.map(|sphere| sphere.centre), radius, spheres.map(place), &mut facets);
        }
        for &v in ends {
            has_edge[v as usize] = true;
            has_tube[v as usize] |= used == 0;
        }
    }
    for (v, sphere) in mesh.spheres.iter().enumerate() {
        // Balls close the ends of tubes.
        let size = if has_tube[v] { 1.0 } else { DOT };
        if has_tube[v] || !has_edge[v] {
            ball(sphere.centre, size * radius, place(sphere), &mut facets);
        }
    }
    let look = Look { paint: paint(CURVE), ink: 0.0, kind: Kind::Solid };
    [sheets, Batch { facets, look }]
}

/// Sides of a tube or ball: with smooth normals no corner shows at a few pixels' width.
const SIDES: usize = 12;

/// The facets of a round shape from rings of points: each ring by the centre and radius of its circle, the share of its
/// normals that points along the axis, and its place in the colour map.
fn lathe(axis: Vec3, rings: &[(Vec3, f64, f64, f32)], into: &mut Vec<Facet>) {
    let (u, v) = axis.any_orthonormal_pair();
    // Corners are a ring and a spoke; the last spoke is exactly the first one.
    let corner = |(ring, spoke): (usize, usize)| {
        let (centre, radius, along, place) = rings[ring];
        let (sin, cos) = (std::f64::consts::TAU * (spoke % SIDES) as f64 / SIDES as f64).sin_cos();
        let across = cos * u + sin * v;
        let normal = (1.0 - along * along).max(0.0).sqrt() * across + along * axis;
        (centre + radius * across, normal, place)
    };
    for (ring, spoke) in (1..rings.len()).flat_map(|ring| (0..SIDES).map(move |s| (ring, s))) {
        let [a, b] = [(ring - 1, spoke), (ring - 1, spoke + 1)];
        let [c, d] = [(ring, spoke + 1), (ring, spoke)];
        for corners in [[a, b, c], [a, c, d]].map(|corners| corners.map(corner)) {
            into.push(Facet {
                corners: corners.map(|(at, ..)| at),
                normals: corners.map(|(_, normal, _)| normal),
                places: corners.map(|(.., place)| place),
                lines: [0; 3],
            });
        }
    }
}

/// A tube between two points, with its place in the colour map at both. Open: balls close its ends.
fn tube(ends: [Vec3; 2], radius: f64, places: [f32; 2], into: &mut Vec<Facet>) {
    let Some(along) = (ends[1] - ends[0]).try_normalize() else { return };
    lathe(along, &[0, 1].map(|k| (ends[k], radius, 0.0, places[k])), into);
}

fn ball(centre: Vec3, radius: f64, place: f32, into: &mut Vec<Facet>) {
    // Circles of latitude; those of the poles are points.
    let rings = std::array::from_fn::<_, { SIDES / 2 + 1 }, _>(|k| {
        let (sin, cos) = (std::f64::consts::TAU * k as f64 / SIDES as f64).sin_cos();
        (centre + radius * cos * Vec3::Y, radius * sin, cos, place)
    });
    lathe(Vec3::Y, &rings, into);
}

/// Faces at a larger angle to each other, in degrees, meet in a sharp edge.
const CREASE: f64 = 35.0;

/// Sharp edges that are connected are shown if they are longer together than this share of the surface's diagonal:
/// shorter ones are noise of a smooth surface, a drilled hole is longer.
const SHORTEST: f64 = 0.06;

/// For each face whether its side from corner `k` to `k + 1` is sharp and part of a long crease. Cost that of a sort of
/// the sides.
fn sharp_sides(mesh: &TriMesh, flat: &[Vec3]) -> Vec<[bool; 3]> {
    let smooth = CREASE.to_radians().cos();
    let mut sides: Vec<([u32; 2], usize)> = (0..3 * mesh.faces.len())
        .into_par_iter()
        .map(|side| {
            let corners = mesh.faces[side / 3];
            let [a, b] = [corners[side % 3], corners[(side % 3 + 1) % 3]];
            ([a.min(b), a.max(b)], side)
        })
        .collect();
    sides.par_sort_unstable(); // no two are equal, so the order is one
    // An edge with one face, or with more than two, is always sharp.
    let edges = sides.chunk_by(|a, b| a.0 == b.0).filter(|edge| match edge {
        [(_, a), (_, b)] => flat[a / 3].dot(flat[b / 3]) <= smooth,
        _ => true,
    });
    let edges: Vec<_> = edges.collect();
    // Creases are connected by common vertices.
    let mut creases = DisjointSets::singletons(mesh.vertices.len());
    for edge in &edges {
        creases.join(edge[0].0[0], edge[0].0[1]);
    }
    let mut lengths = vec![0.0; mesh.vertices.len()];
    for edge in &edges {
        let [a, b] = edge[0].0;
        lengths[creases.find(a) as usize] +=
            mesh.vertices[a as usize].distance(mesh.vertices[b as usize]);
    }
    let diagonal = mesh.bounding_box().map_or(0.0, |(lo, hi)| lo.distance(hi));
    let mut sharp = vec![[false; 3]; mesh.faces.len()];
    for &([a, _], side) in edges.into_iter().flatten() {
        sharp[side / 3][side % 3] = lengths[creases.find(a) as usize] >= SHORTEST * diagonal;
    }
    sharp
}
