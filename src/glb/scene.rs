//! The meshes of a scene, carried where their nodes put them.
//!
//! 1. From the roots of the scene, every node is visited once; a second visit is an error, so that neither a cycle nor
//!    shared children can make the walk long.
//! 2. The transform of a node is that of its parent times its own (section 3.5.3).
//! 3. Each primitive becomes a [`Part`]: its vertices, and its triangles, segments and single points by its mode
//!    (section 3.7.2.1). Primitives of a mesh that share their vertices are one part.

use std::collections::{BTreeMap, HashSet};

use glam::{DMat3, DMat4, DQuat};

use super::accessor::{Array, index_error};
use super::document::{Document, Node, Primitive, unread};
use super::{GENERATOR, GlbError, RADIUS, chunks, z_up};
use crate::Vec3;

/// Vertices with what joins them, in the coordinates of the scene turned to `z` up.
#[derive(Clone, Debug, Default)]
pub(crate) struct Part {
    /// May have coordinates that are not finite.
    pub points: Vec<Vec3>,
    /// Radii, where the vertices have some.
    pub radii: Option<Vec<f64>>,
    /// Counter-clockwise seen from the front, also under a reflection.
    pub triangles: Vec<[u32; 3]>,
    pub segments: Vec<[u32; 2]>,
}

/// All parts of a scene.
#[derive(Clone, Debug, Default)]
pub(crate) struct SceneParts {
    pub parts: Vec<Part>,
    /// Whether this crate wrote the file.
    pub is_own: bool,
    /// One sentence for each kind of thing that was passed over.
    pub passed_over: Vec<String>,
}

/// Vertices and corners that any file may have, and so many more for each of its bytes. Without repetition every vertex
/// and every corner takes a byte at least; a strip has three corners for each index.
const FREE_ELEMENTS: u64 = 3_000_000;
const ELEMENTS_PER_BYTE: u64 = 3;

/// The largest share by which the axes of a node may be scaled differently, or be oblique, while radii still mean
/// something: rounding of exporters in single precision.
const UNEVEN: f64 = 1e-4;

/// The geometry of a file's scene.
///
/// # Errors
/// When the file is not as [`super`] says, names what does not exist, needs what is not read, or repeats its meshes too
/// often.
pub(crate) fn parts(bytes: &[u8]) -> Result<SceneParts, GlbError> {
    let (json, binary) = chunks(bytes)?;
    let document = Document::parse(json)?;
    let most = FREE_ELEMENTS + ELEMENTS_PER_BYTE * bytes.len() as u64;
    let generator = document.asset.generator.as_deref().unwrap_or_default();
    let scene = SceneParts { is_own: generator.starts_with(GENERATOR), ..SceneParts::default() };
    let mut walk = Walk { document: &document, binary, most, elements: 0, tally: [0; 2], scene };
    walk.run()?;
    let [skins, targets] = walk.tally;
    let mut scene = walk.scene;
    let mut note = |count: usize, what: &str| {
        if count > 0 {
            scene.passed_over.push(format!("{count} {what}"));
        }
    };
    note(skins, "nodes with a skin were read in the pose of their mesh");
    note(targets, "primitives with morph targets were read without them");
    Ok(scene)
}

struct Walk<'a> {
    document: &'a Document,
    binary: &'a [u8],
    most: u64,
    elements: u64,
    /// Skins and primitives with morph targets.
    tally: [usize; 2],
    scene: SceneParts,
}

impl Walk<'_> {
    fn run(&mut self) -> Result<(), GlbError> {
        let nodes = &self.document.nodes;
        let mut visited = vec![false; nodes.len()];
        let turned = DMat4::IDENTITY;
        let mut ahead: Vec<(usize, DMat4)> =
            roots(self.document)?.into_iter().rev().map(|root| (root, turned)).collect();
        while let Some((index, above)) = ahead.pop() {
            let node = nodes
                .get(index)
                .ok_or_else(|| index_error("the scene".into(), "node", index, nodes.len()))?;
            if std::mem::replace(&mut visited[index], true) {
                return Err(GlbError::Twice(index));
            }
            let transform = above * local(node);
            if let Some(mesh) = node.mesh {
                self.tally[0] += usize::from(node.skin.is_some());
                self.mesh(mesh, index, &transform)?;
            }
            for &child in node.children.iter().rev() {
                if child >= nodes.len() {
                    let at = format!("node {index}");
                    return Err(index_error(at, "node", child, nodes.len()));
                }
                ahead.push((child, transform));
            }
        }
        Ok(())
    }

    /// Adds the parts of a mesh under the transform of a node.
    fn mesh(&mut self, mesh: usize, node: usize, transform: &DMat4) -> Result<(), GlbError> {
        let meshes = &self.document.meshes;
        let Some(found) = meshes.get(mesh) else {
            return Err(index_error(format!("node {node}"), "mesh", mesh, meshes.len()));
        };
        // Parts of this mesh by the accessors of their vertices.
        let mut known: BTreeMap<(usize, Option<usize>), usize> = BTreeMap::new();
        for (index, primitive) in found.primitives.iter().enumerate() {
            let at = format!("mesh {mesh}, primitive {index}");
            self.tally[1] += usize::from(!primitive.targets.is_empty());
            if let Some(extension) = primitive
                .extensions
                .keys()
                .find(|name| primitive.attributes.is_empty() || name.contains("draco"))
            {
                return Err(GlbError::Unsupported(unread(extension)));
            }
            let &position = primitive
                .attributes
                .get("POSITION")
                .ok_or_else(|| GlbError::element(&*at, "it has no POSITION"))?;
            let key = (position, primitive.attributes.get(RADIUS).copied());
            let part = match known.get(&key) {
                Some(&part) => part,
                None => {
                    let part = self.vertices(key, &at, node, transform)?;
                    self.scene.parts.push(part);
                    known.insert(key, self.scene.parts.len() - 1);
                    self.scene.parts.len() - 1
                }
            };
            self.simplices(primitive, part, &at, transform)?;
        }
        Ok(())
    }

    /// A part without simplices.
    fn vertices(
        &mut self,
        (position, radius): (usize, Option<usize>),
        at: &str,
        node: usize,
        transform: &DMat4,
    ) -> Result<Part, GlbError> {
        let positions = Array::new(self.document, self.binary, position)?;
        self.count(positions.count as u64)?;
        let points = positions.numbers(&format!("{at}, POSITION"))?;
        let points: Vec<Vec3> =
            points.map(|p: [f64; 3]| z_up(moved(transform, p.into()))).collect();
        let radii = match radius {
            None => None,
            Some(accessor) => {
                let at = format!("{at}, {RADIUS}");
                let radii = Array::new(self.document, self.binary, accessor)?;
                if radii.count != points.len() {
                    let why = format!("{} radii for {} vertices", radii.count, points.len());
                    return Err(GlbError::element(at, why));
                }
                let scale = even_scale(transform).ok_or_else(|| {
                    let why = "it scales its axes differently, so that radii mean nothing; apply the scale first";
                    GlbError::element(format!("node {node}"), why)
                })?;
                Some(radii.numbers(&at)?.map(|[r]: [f64; 1]| r * scale).collect())
            }
        };
        Ok(Part { points, radii, ..Part::default() })
    }

    fn simplices(
        &mut self,
        primitive: &Primitive,
        part: usize,
        at: &str,
        transform: &DMat4,
    ) -> Result<(), GlbError> {
        let vertices = self.scene.parts[part].points.len();
        let indices = match primitive.indices {
            Some(accessor) => {
                let array = Array::new(self.document, self.binary, accessor)?;
                self.count(array.count as u64)?;
                array.indices(&format!("{at}, indices"), vertices)?
            }
            None if vertices > u32::MAX as usize => {
                return Err(GlbError::element(at, "more vertices than 32-bit indices can name"));
            }
            None => (0..vertices as u32).collect(),
        };
        let mode = primitive.mode.unwrap_or(TRIANGLES);
        let mut triangles = triangles(mode, &indices, at)?;
        let segments = segments(mode, &indices, at)?;
        if mode > TRIANGLE_FAN {
            return Err(GlbError::element(at, format!("there is no mode {mode}")));
        }
        self.count(3 * triangles.len() as u64 + 2 * segments.len() as u64)?;
        if DMat3::from_mat4(*transform).determinant() < 0.0 {
            triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
        }
        let part = &mut self.scene.parts[part];
        part.triangles.extend(triangles);
        part.segments.extend(segments);
        Ok(())
    }

    /// Counts what is about to be kept.
    fn count(&mut self, elements: u64) -> Result<(), GlbError> {
        self.elements += elements;
        if self.elements > self.most {
            return Err(GlbError::Repeated { elements: self.elements, most: self.most });
        }
        Ok(())
    }
}

const LINES: u32 = 1;
const LINE_LOOP: u32 = 2;
const LINE_STRIP: u32 = 3;
const TRIANGLES: u32 = 4;
const TRIANGLE_STRIP: u32 = 5;
const TRIANGLE_FAN: u32 = 6;

fn triangles(mode: u32, indices: &[u32], at: &str) -> Result<Vec<[u32; 3]>, GlbError> {
    let whole = |corners: &[u32]| [corners[0], corners[1], corners[2]];
    Ok(match mode {
        TRIANGLES if !indices.len().is_multiple_of(3) => {
            let why = format!("{} corners are no whole triangles", indices.len());
            return Err(GlbError::element(at, why));
        }
        TRIANGLES => indices.chunks_exact(3).map(whole).collect(),
        // Every other triangle of a strip is turned.
        TRIANGLE_STRIP => (0..indices.len().saturating_sub(2))
            .map(|i| [indices[i], indices[i + 1 + i % 2], indices[i + 2 - i % 2]])
            .collect(),
        TRIANGLE_FAN => (1..indices.len().max(2) - 1)
            .map(|i| [indices[i], indices[i + 1], indices[0]])
            .collect(),
        _ => Vec::new(),
    })
}

fn segments(mode: u32, indices: &[u32], at: &str) -> Result<Vec<[u32; 2]>, GlbError> {
    let pair = |ends: &[u32]| [ends[0], ends[1]];
    Ok(match mode {
        LINES if !indices.len().is_multiple_of(2) => {
            return Err(GlbError::element(
                at,
                format!("{} ends are no whole lines", indices.len()),
            ));
        }
        LINES => indices.chunks_exact(2).map(pair).collect(),
        LINE_STRIP | LINE_LOOP => {
            let closing = match (mode, indices) {
                (LINE_LOOP, [first, .., last]) => Some([*last, *first]),
                _ => None,
            };
            indices.windows(2).map(pair).chain(closing).collect()
        }
        _ => Vec::new(),
    })
}

/// The roots of the scene that a viewer would show; without any scene, the nodes that are nobody's children.
fn roots(document: &Document) -> Result<Vec<usize>, GlbError> {
    let scenes = &document.scenes;
    match (document.scene, scenes.first()) {
        (Some(scene), _) => match scenes.get(scene) {
            Some(scene) => Ok(scene.nodes.clone()),
            None => Err(index_error("the file".into(), "scene", scene, scenes.len())),
        },
        (None, Some(first)) => Ok(first.nodes.clone()),
        (None, None) => {
            let children: HashSet<usize> =
                document.nodes.iter().flat_map(|node| node.children.iter().copied()).collect();
            Ok((0..document.nodes.len()).filter(|node| !children.contains(node)).collect())
        }
    }
}

/// The transform of a node in that of its parent.
fn local(node: &Node) -> DMat4 {
    if let Some(columns) = &node.matrix {
        return DMat4::from_cols_array(columns);
    }
    let scale = node.scale.map_or(Vec3::ONE, Vec3::from);
    let rotation = node.rotation.map_or(DQuat::IDENTITY, DQuat::from_array);
    let translation = node.translation.map_or(Vec3::ZERO, Vec3::from);
    // In single precision exporters miss the unit length by some 1e-7, which would scale the mesh.
    let length = rotation.length();
    let rotation = if length > 0.0 { rotation / length } else { DQuat::IDENTITY };
    DMat4::from_scale_rotation_translation(scale, rotation, translation)
}

/// A point under a transform. The identity leaves every bit, also the sign of zero, which sums lose.
fn moved(transform: &DMat4, point: Vec3) -> Vec3 {
    if *transform == DMat4::IDENTITY { point } else { transform.transform_point3(point) }
}

/// The factor of lengths of a transform that scales all directions alike.
fn even_scale(transform: &DMat4) -> Option<f64> {
    let DMat3 { x_axis: x, y_axis: y, z_axis: z } = DMat3::from_mat4(*transform);
    // The identity has to give exactly 1.
    let lengths = [x.length(), y.length(), z.length()];
    let longest = lengths.into_iter().fold(0.0, f64::max);
    let is_even = lengths.iter().all(|length| longest - length <= UNEVEN * longest);
    let oblique = [x.dot(y), y.dot(z), z.dot(x)];
    let is_square = oblique.iter().all(|dot| dot.abs() <= UNEVEN * longest * longest);
    let is_known = is_even && is_square && longest.is_finite();
    is_known.then(|| if lengths == [1.0; 3] { 1.0 } else { lengths.iter().sum::<f64>() / 3.0 })
}
