//! The scene: what can be drawn, and the facets that it becomes.

use medial::complex::{MedialMesh, Sphere};
use medial::surface::TriMesh;
use medial::{ColourMap, Vec3};
use rayon::prelude::*;

use super::camera::{Camera, Frame};
use super::light::{GLASS, Paint, crevices, decode, encode};
use super::picture::{Background, Picture};
use super::raster::{Batch, Facet, Kind, Lines, Look, PixelLight, rasterise};
use super::{RenderError, check_size};

/// What a picture is of, but for the camera.
#[derive(Clone, Debug)]
pub struct Scene<'a> {
    /// What is drawn. All in one unit.
    pub layers: Vec<Layer<'a>>,
    /// Width and height in pixels.
    pub size: [usize; 2],
    /// What is behind everything.
    pub background: Background,
}

/// Something to draw.
#[derive(Clone, Copy, Debug)]
pub enum Layer<'a> {
    /// A closed surface, in plain grey.
    Surface(&'a TriMesh),
    /// A closed surface as faint glass: its rims and its sharp edges, with the inside visible.
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
    fn place(&self, value: f64) -> f32 {
        let extent = self.hi - self.lo;
        if extent > 0.0 { ((value - self.lo) / extent) as f32 } else { 0.5 }
    }
}

impl Scene<'_> {
    /// Takes the picture. Parallel; the same pixels for any number of threads. Time linear in the number of triangles
    /// and of pixels.
    ///
    /// ```
    /// use medial::Vec3;
    /// use medial::surface::TriMesh;
    /// use medial_reports::render::{Background, Camera, Layer, Scene};
    ///
    /// let vertices = vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z];
    /// let faces = vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
    /// let tetrahedron = TriMesh { vertices, faces };
    /// let layers = vec![Layer::Surface(&tetrahedron)];
    /// let scene = Scene { layers, size: [320, 240], background: Background::WHITE };
    /// let picture = scene.picture(&scene.frame(&Camera::fitting(&tetrahedron))?)?;
    /// assert_eq!(picture.pixel(0, 0), Some([255; 4]));
    /// assert!(picture.to_png()?.starts_with(b"\x89PNG"));
    /// # Ok::<(), medial_reports::render::RenderError>(())
    /// ```
    ///
    /// # Errors
    /// When a side of the picture is out of range, or a layer's values are not one for each vertex.
    pub fn picture(&self, frame: &Frame) -> Result<Picture, RenderError> {
        check_size(self.size)?;
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
        Ok(Picture::of(self.size, pixels))
    }

    /// Sets a camera up so that the first layer that has points fills the picture.
    ///
    /// # Errors
    /// As [`Frame::fit`].
    pub fn frame(&self, camera: &Camera) -> Result<Frame, RenderError> {
        let points = self.layers.iter().map(Layer::points).find(|points| !points.is_empty());
        Frame::fit(camera, &points.unwrap_or_default())
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

/// Width of lines, as a share of the picture's shorter side, and the least in pixels.
const LINE_WIDTH: f64 = 0.0016;
const LEAST_LINE: f64 = 0.9;

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

impl Canvas<'_> {
    fn lines(&self, opacity: f32) -> Option<Lines> {
        let width = (LINE_WIDTH * self.shorter).max(LEAST_LINE);
        (opacity > 0.0).then_some(Lines { half_width: (0.5 * width) as f32, opacity })
    }
}

impl Layer<'_> {
    /// The points by which a camera is set up: those of surfaces, else the centres of spheres.
    fn points(&self) -> Vec<Vec3> {
        match self {
            Self::Surface(mesh)
            | Self::Glass(mesh)
            | Self::Ghost(mesh)
            | Self::Values { mesh, .. } => mesh.vertices.clone(),
            Self::Axis { mesh, .. } => mesh.spheres.iter().map(|s| s.centre).collect(),
        }
    }

    /// Adds the facets of the layer.
    fn add_to(&self, batches: &mut Vec<Batch>, canvas: &Canvas<'_>) -> Result<(), RenderError> {
        let (facets, look) = match *self {
            Self::Surface(mesh) => {
                let paint = Paint::Plain(decode(GREY));
                let look = Look { paint, lines: canvas.lines(SHARP_INK), kind: Kind::Solid };
                (surface_facets(mesh, |_, _| 0.5), look)
            }
            Self::Glass(mesh) | Self::Ghost(mesh) => {
                // Rims are more opaque: what varies along a facet is how much it faces the eye.
                let facing = |_, normal| canvas.frame.back.dot(normal).abs() as f32;
                let kind = if matches!(self, Self::Ghost(_)) { Kind::Ghost } else { Kind::Glass };
                let paint = Paint::Plain([0.0; 3]);
                (surface_facets(mesh, facing), Look { paint, lines: canvas.lines(GLASS_INK), kind })
            }
            Self::Values { mesh, values, scale } => {
                let (vertices, given) = (mesh.vertices.len(), values.len());
                if vertices != given {
                    return Err(RenderError::Values { values: given, vertices });
                }
                // No lines: ink would be taken for a value.
                let look = Look { paint: Paint::map(scale.map), lines: None, kind: Kind::Solid };
                (surface_facets(mesh, |v, _| scale.place(values[v as usize])), look)
            }
            Self::Axis { mesh, colour } => {
                batches.extend(axis_batches(mesh, colour, canvas));
                return Ok(());
            }
        };
        batches.push(Batch { facets, look });
        Ok(())
    }
}

/// The facets of a surface: smooth, with lines along its sharp edges. `place` in the colour map is by vertex and normal.
fn surface_facets(mesh: &TriMesh, place: impl Fn(u32, Vec3) -> f32 + Sync) -> Vec<Facet> {
    let creases = creases(mesh);
    (mesh.faces.par_iter().enumerate())
        .map(|(face, corners)| {
            let normals = creases.normals[face];
            Facet {
                corners: mesh.triangle(face),
                normals,
                places: std::array::from_fn(|k| place(corners[k], normals[k])),
                lines: creases.sharp[face].map(u8::from),
            }
        })
        .collect()
}

impl AxisColour {
    /// Where a sphere is in the colour map.
    fn place(self, sphere: &Sphere) -> f32 {
        match self {
            Self::Radius(scale) => scale.place(sphere.radius),
            Self::Plain => 1.0,
        }
    }

    fn paint(self, plain: [u8; 3]) -> Paint {
        match self {
            Self::Radius(scale) => Paint::map(scale.map),
            Self::Plain => Paint::Plain(decode(plain)),
        }
    }
}

/// The number of an edge in a medial mesh, whose edges are sorted.
fn edge_of(mesh: &MedialMesh, a: u32, b: u32) -> Option<usize> {
    mesh.edges.binary_search(&[a.min(b), a.max(b)]).ok()
}

/// Faces as flat facets with lines along their sides; edges without a face as tubes, spheres without an edge as balls.
fn axis_batches(mesh: &MedialMesh, colour: AxisColour, canvas: &Canvas<'_>) -> [Batch; 2] {
    // How many faces each edge has.
    let mut uses = vec![0; mesh.edges.len()];
    for &[a, b, c] in &mesh.faces {
        for edge in [edge_of(mesh, a, b), edge_of(mesh, b, c), edge_of(mesh, a, c)] {
            edge.into_iter().for_each(|edge| uses[edge] += 1);
        }
    }
    let sheet = |face: &[u32; 3]| {
        let spheres = face.map(|v| &mesh.spheres[v as usize]);
        let corners = spheres.map(|sphere| sphere.centre);
        let flat = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize_or_zero();
        let lines = std::array::from_fn(|k| {
            // Along a border only one facet draws its half.
            let used = edge_of(mesh, face[k], face[(k + 1) % 3]).map_or(0, |edge| uses[edge]);
            if used == 1 { 2 } else { 1 }
        });
        Facet { corners, normals: [flat; 3], places: spheres.map(|s| colour.place(s)), lines }
    };
    let mut lengths: Vec<f64> = (mesh.edges.iter())
        .map(|edge| edge.map(|v| mesh.spheres[v as usize].centre))
        .map(|[a, b]| a.distance(b))
        .collect();
    lengths.sort_by(f64::total_cmp);
    // By the median, so that the lines of one mesh are all alike.
    let median = lengths.get(lengths.len() / 2).map_or(0.0, |length| length * canvas.scale);
    let fade = (median - LINE_FADE[0]) / (LINE_FADE[1] - LINE_FADE[0]);
    let lines = canvas.lines(SHEET_INK * fade.clamp(0.0, 1.0) as f32);
    let sheets = Batch {
        facets: mesh.faces.par_iter().map(sheet).collect(),
        look: Look { paint: colour.paint(SHEET), lines, kind: Kind::Solid },
    };

    let radius = TUBE * canvas.shorter / canvas.scale;
    let mut facets = Vec::new();
    let mut has_edge = vec![false; mesh.spheres.len()];
    let mut has_tube = has_edge.clone();
    for (ends, used) in mesh.edges.iter().zip(uses) {
        if used == 0 {
            let spheres = ends.map(|v| &mesh.spheres[v as usize]);
            let places = spheres.map(|sphere| colour.place(sphere));
            tube(spheres.map(|sphere| sphere.centre), radius, places, &mut facets);
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
            ball(sphere.centre, size * radius, colour.place(sphere), &mut facets);
        }
    }
    let look = Look { paint: colour.paint(CURVE), lines: None, kind: Kind::Solid };
    [sheets, Batch { facets, look }]
}

/// Sides of a tube: with smooth normals no corner shows at a few pixels' width.
const TUBE_SIDES: usize = 10;

/// A tube between two points, with its place in the colour map at both. Open: balls close its ends.
fn tube(ends: [Vec3; 2], radius: f64, places: [f32; 2], into: &mut Vec<Facet>) {
    let Some(along) = (ends[1] - ends[0]).try_normalize() else { return };
    let (u, v) = along.any_orthonormal_pair();
    for k in 0..TUBE_SIDES {
        // The last side ends exactly where the first one begins.
        let n = [k, (k + 1) % TUBE_SIDES].map(|spoke| {
            let turn = std::f64::consts::TAU * spoke as f64 / TUBE_SIDES as f64;
            turn.cos() * u + turn.sin() * v
        });
        // Corners are a side and an end.
        for corners in [[(0, 0), (1, 0), (1, 1)], [(0, 0), (1, 1), (0, 1)]] {
            into.push(Facet {
                corners: corners.map(|(side, end): (usize, usize)| ends[end] + radius * n[side]),
                normals: corners.map(|(side, _)| n[side]),
                places: corners.map(|(_, end)| places[end]),
                lines: [0; 3],
            });
        }
    }
}

/// A ball is an octahedron with each side cut into so many parts, blown up.
const BALL_CUTS: usize = 4;

fn ball(centre: Vec3, radius: f64, place: f32, into: &mut Vec<Facet>) {
    for octant in 0..8 {
        let signs = [0, 1, 2].map(|bit| if octant >> bit & 1 == 0 { 1.0 } else { -1.0 });
        for i in 0..BALL_CUTS {
            for j in 0..BALL_CUTS - i {
                let up = [[i, j], [i + 1, j], [i, j + 1]];
                let down = [[i + 1, j], [i + 1, j + 1], [i, j + 1]];
                // The last triangle of a row has none beside it that points down.
                let has_down = i + j + 1 < BALL_CUTS;
                for triangle in std::iter::once(up).chain(has_down.then_some(down)) {
                    let normals = triangle.map(|[i, j]| {
                        let k = BALL_CUTS - i - j;
                        let at = Vec3::new(i as f64, j as f64, k as f64);
                        (Vec3::from_array(signs) * at).normalize()
                    });
                    let corners = normals.map(|n| centre + radius * n);
                    into.push(Facet { corners, normals, places: [place; 3], lines: [0; 3] });
                }
            }
        }
    }
}

/// Faces at a larger angle to each other, in degrees, meet in a sharp edge.
const CREASE: f64 = 35.0;

/// More faces than this at a vertex are the fan of a flat disc or the tip of a cone, where the normal of each face is
/// taken as it is. The cost is quadratic in this number.
const MOST_AROUND: usize = 64;

/// Sharp edges that are connected are shown if they are longer together than this share of the surface's diagonal:
/// shorter ones are noise of a smooth surface, a drilled hole is longer.
const SHORTEST: f64 = 0.06;

/// Normals and sharp sides of every face.
struct Creases {
    /// At the three corners.
    normals: Vec<[Vec3; 3]>,
    /// Whether the side from corner `k` to `k + 1` is sharp, or has no or several faces beyond, and is part of a long
    /// crease.
    sharp: Vec<[bool; 3]>,
}

/// Finds normals that are smooth where the surface is, and its sharp edges: round parts look round, and edges of
/// machine parts stay sharp. Cost linear in the surface's size but for a sort of its sides.
///
/// A corner takes the mean of the faces around its vertex that are within [`CREASE`] of its own face, weighted by the
/// sine of their angle there over the lengths of its sides, which is exact on a sphere (N. Max, "Weights for computing
/// vertex normals from facet normals", J. Graphics Tools 4 (1999)).
fn creases(mesh: &TriMesh) -> Creases {
    let flat: Vec<Vec3> = (0..mesh.faces.len())
        .into_par_iter()
        .map(|face| {
            let [a, b, c] = mesh.triangle(face);
            // Of unit sides: the square of a tiny length would vanish.
            let (u, v) = ((b - a).normalize_or_zero(), (c - a).normalize_or_zero());
            u.cross(v).normalize_or_zero()
        })
        .collect();
    // The faces around vertex v, and which of their corners it is: around[start[v]..start[v + 1]].
    let mut start = vec![0_u32; mesh.vertices.len() + 1];
    mesh.faces.iter().flatten().for_each(|&vertex| start[vertex as usize + 1] += 1);
    for k in 1..start.len() {
        start[k] += start[k - 1];
    }
    let mut next = start.clone();
    let mut around = vec![[0; 2]; 3 * mesh.faces.len()];
    for (face, corners) in mesh.faces.iter().enumerate() {
        for (corner, &vertex) in corners.iter().enumerate() {
            let free = &mut next[vertex as usize];
            around[*free as usize] = [face as u32, corner as u32];
            *free += 1;
        }
    }
    let smooth = CREASE.to_radians().cos();
    let corner = |face: usize, vertex: u32| {
        let [from, to] = [0, 1].map(|k| start[vertex as usize + k] as usize);
        if to - from > MOST_AROUND {
            return flat[face];
        }
        let sum: Vec3 = (around[from..to].iter())
            .filter(|at| flat[face].dot(flat[at[0] as usize]) > smooth)
            .map(|&[face, corner]| {
                let points = mesh.triangle(face as usize);
                let [a, b, c] = [0, 1, 2].map(|k| points[(corner as usize + k) % 3]);
                let (u, v) = (b - a, c - a);
                let lengths = u.length() * v.length();
                let sine = u.cross(v).length() / lengths;
                // Zero lengths: a face without area has no say.
                if sine.is_finite() { sine / lengths * flat[face as usize] } else { Vec3::ZERO }
            })
            .sum();
        sum.normalize_or(flat[face])
    };
    let normals = (0..mesh.faces.len()).into_par_iter();
    let normals = normals.map(|face| mesh.faces[face].map(|v| corner(face, v))).collect();
    let mut sharp = sharp_sides(mesh, &flat, smooth);
    drop_short(mesh, &mut sharp);
    Creases { normals, sharp }
}

fn sharp_sides(mesh: &TriMesh, flat: &[Vec3], smooth: f64) -> Vec<[bool; 3]> {
    let mut sides: Vec<([u32; 2], u32)> = (0..3 * mesh.faces.len() as u32)
        .into_par_iter()
        .map(|side| {
            let corners = mesh.faces[side as usize / 3];
            let [a, b] = [corners[side as usize % 3], corners[(side as usize + 1) % 3]];
            ([a.min(b), a.max(b)], side)
        })
        .collect();
    sides.par_sort_unstable();
    let mut sharp = vec![[false; 3]; mesh.faces.len()];
    // An edge with one face, or with more than two, is always sharp.
    for edge in sides.chunk_by(|a, b| a.0 == b.0) {
        let is_smooth = match edge {
            [(_, a), (_, b)] => flat[*a as usize / 3].dot(flat[*b as usize / 3]) > smooth,
            _ => false,
        };
        for (_, side) in edge {
            sharp[*side as usize / 3][*side as usize % 3] = !is_smooth;
        }
    }
    sharp
}

/// Drops the sharp sides that are connected to few others.
fn drop_short(mesh: &TriMesh, sharp: &mut [[bool; 3]]) {
    let sides: Vec<[usize; 4]> = (0..3 * sharp.len())
        .map(|side| (side / 3, side % 3))
        .filter(|&(face, k)| sharp[face][k])
        .map(|(face, k)| {
            let corners = mesh.faces[face];
            [face, k, corners[k] as usize, corners[(k + 1) % 3] as usize]
        })
        .collect();
    // Connected by common vertices: a forest whose roots are the least vertex of each set.
    let mut parent: Vec<usize> = (0..mesh.vertices.len()).collect();
    for &[_, _, a, b] in &sides {
        let (a, b) = (root(&mut parent, a), root(&mut parent, b));
        parent[a.max(b)] = a.min(b);
    }
    let mut lengths = vec![0.0; mesh.vertices.len()];
    for &[_, _, a, b] in &sides {
        // Either face of an edge has it among its sides.
        lengths[root(&mut parent, a)] += 0.5 * mesh.vertices[a].distance(mesh.vertices[b]);
    }
    let diagonal = mesh.bounding_box().map_or(0.0, |(lo, hi)| lo.distance(hi));
    for [face, k, a, _] in sides {
        sharp[face][k] = lengths[root(&mut parent, a)] >= SHORTEST * diagonal;
    }
}

/// The first vertex of a connected set; paths are halved on the way.
fn root(parent: &mut [usize], mut vertex: usize) -> usize {
    while parent[vertex] != vertex {
        parent[vertex] = parent[parent[vertex]];
        vertex = parent[vertex];
    }
    vertex
}
