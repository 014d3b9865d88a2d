//! Writes a medial mesh as binary glTF.

use serde_json::{Map, Value, json};

use super::{balls, normals};
use crate::Vec3;
use crate::complex::MedialMesh;
use crate::complex::formats::lone::{isolated, lone_edges};
use crate::complex::formats::look::{Look, SphereValues};
use crate::glb::{GENERATOR, GlbError, RADIUS, pack, y_up};

/// Codes of glTF: single precision, 16-bit and 32-bit whole numbers; vertices and indices; ways to join vertices.
const FLOAT: u32 = 5126;
const U16: u32 = 5123;
const U32: u32 = 5125;
const VERTICES: u32 = 34962;
const INDICES: u32 = 34963;
const POINTS: u32 = 0;
const LINES: u32 = 1;
const TRIANGLES: u32 = 4;

/// The largest rounding of a coordinate or radius to single precision, in the unit of the mesh.
///
/// ```
/// use medial::complex::{MedialMesh, Sphere, single_precision_loss};
///
/// let sphere = Sphere::new(medial::Vec3::new(0.1, 0.5, 0.0), 0.25);
/// let mesh = MedialMesh::from_simplices(vec![sphere], vec![], vec![])?;
/// let expected = (0.1_f64 - f64::from(0.1_f32)).abs();
/// assert_eq!(single_precision_loss(&mesh), expected);
/// # Ok::<(), medial::complex::ComplexError>(())
/// ```
pub fn single_precision_loss(mesh: &MedialMesh) -> f64 {
    let numbers = mesh.spheres.iter().flat_map(|s| [s.centre.x, s.centre.y, s.centre.z, s.radius]);
    numbers.map(|x| (x - f64::from(x as f32)).abs()).fold(0.0, f64::max)
}

/// The file of a medial mesh in canonical form.
///
/// # Errors
/// When it has no sphere, a number that single precision does not reach, or more than 4 GB.
pub(in crate::complex::formats) fn file(
    mesh: &MedialMesh,
    look: &Look,
) -> Result<Vec<u8>, GlbError> {
    if mesh.spheres.is_empty() {
        let why = "a mesh without a sphere cannot be written as glTF, which has no empty arrays";
        return Err(GlbError::Unsupported(why.to_owned()));
    }
    let values = look.values.clone().unwrap_or_else(|| SphereValues::radius(mesh));
    check_range(mesh, &values)?;
    let mut out = Scene::default();
    let mut meshes = vec![axis(&mut out, mesh, &values)];
    if look.balls {
        let bytes =
            (balls::VERTICES * 32 + balls::TRIANGLES * 12) as u64 * mesh.spheres.len() as u64;
        if bytes > u64::from(u32::MAX) {
            return Err(GlbError::TooLarge { bytes });
        }
        meshes.push(spheres(&mut out, mesh, &values));
    }
    let node = |(k, mesh): (usize, &Value)| json!({ "mesh": k, "name": mesh["name"] });
    let nodes: Vec<Value> = meshes.iter().enumerate().map(node).collect();
    let document = json!({
        "asset": { "version": "2.0", "generator": format!("{GENERATOR} {}", env!("CARGO_PKG_VERSION")) },
        "scene": 0,
        "scenes": [{ "nodes": (0..nodes.len()).collect::<Vec<_>>() }],
        "nodes": nodes,
        "meshes": meshes,
        "materials": [{
            "name": "colours of vertices", "doubleSided": true,
            "pbrMetallicRoughness": { "metallicFactor": 0.0, "roughnessFactor": 0.9 },
        }],
        "accessors": out.accessors,
        "bufferViews": out.views,
        "buffers": [{ "byteLength": out.binary.len() }],
    });
    pack(&document.to_string(), &out.binary)
}

fn check_range(mesh: &MedialMesh, values: &SphereValues) -> Result<(), GlbError> {
    for (id, (sphere, value)) in mesh.spheres.iter().zip(&values.values).enumerate() {
        let [x, y, z] = sphere.centre.to_array();
        let is_beyond = |number: &f64| !(*number as f32).is_finite();
        if let Some(number) = [x, y, z, sphere.radius, *value].into_iter().find(is_beyond) {
            let why = format!(
                "{number:e} is beyond single precision, the only one of glTF; write .ma or .vtp"
            );
            return Err(GlbError::element(format!("sphere {id}"), why));
        }
    }
    Ok(())
}

/// The mesh of faces, lone edges and lone spheres on common vertices.
fn axis(out: &mut Scene, mesh: &MedialMesh, values: &SphereValues) -> Value {
    let faces = normals::turned_alike(mesh);
    let mut attributes = Map::new();
    let points: Vec<Vec3> = mesh.spheres.iter().map(|sphere| y_up(sphere.centre)).collect();
    attributes.insert("POSITION".into(), out.positions(&points).into());
    let colours = out.colours((0..points.len()).map(|sphere| colour(values, sphere)));
    attributes.insert("COLOR_0".into(), colours.into());
    let radii = out.scalars(mesh.spheres.iter().map(|sphere| sphere.radius));
    attributes.insert(RADIUS.into(), radii.into());
    let attribute = format!("_{}", values.name.to_ascii_uppercase());
    if attribute != RADIUS {
        attributes.insert(attribute, out.scalars(values.values.iter().copied()).into());
    }
    let mut primitives = Vec::new();
    let mut primitive = |mode: u32, attributes: &Map<String, Value>, indices: usize| {
        let object = json!({
            "attributes": attributes, "indices": indices, "material": 0, "mode": mode,
        });
        primitives.push(object);
    };
    if !faces.is_empty() {
        let normals: Vec<Vec3> = normals::normals(mesh, &faces).into_iter().map(y_up).collect();
        let mut attributes = attributes.clone();
        attributes.insert("NORMAL".into(), out.vectors(&normals).into());
        primitive(TRIANGLES, &attributes, out.indices(faces.as_flattened()));
    }
    // Without normals viewers show lines and points unshaded.
    let lines = lone_edges(mesh);
    if !lines.is_empty() {
        primitive(LINES, &attributes, out.indices(lines.as_flattened()));
    }
    let single = isolated(mesh);
    if !single.is_empty() {
        primitive(POINTS, &attributes, out.indices(&single));
    }
    json!({ "name": "medial axis", "primitives": primitives, "extras": extras(values) })
}

/// What the numbers and colours mean; Blender shows it as custom properties of the mesh.
fn extras(values: &SphereValues) -> Value {
    json!({
        "colour_by": values.name, "colour_meaning": values.meaning, "colour_map": values.map.name(),
        "colour_low": values.low, "colour_high": values.high,
        "unit": "that of the input, which glTF calls a metre", "radius_attribute": RADIUS,
        "axes": "the input's (x, y, z) stands as (x, z, -y), so that its z is up",
    })
}

/// The mesh of all spheres as round bodies.
fn spheres(out: &mut Scene, mesh: &MedialMesh, values: &SphereValues) -> Value {
    let (ball, triangles) = balls::ball();
    let ball: Vec<Vec3> = ball.into_iter().map(y_up).collect();
    let all = mesh.spheres.iter();
    let points: Vec<Vec3> =
        all.flat_map(|s| ball.iter().map(|&p| y_up(s.centre) + p * s.radius)).collect();
    let normals: Vec<Vec3> = mesh.spheres.iter().flat_map(|_| ball.iter().copied()).collect();
    let indices: Vec<u32> = (0..mesh.spheres.len())
        .flat_map(|sphere| {
            triangles.iter().flatten().map(move |&v| (sphere * ball_size()) as u32 + v)
        })
        .collect();
    let colours = (0..points.len()).map(|vertex| colour(values, vertex / ball_size()));
    let attributes = json!({
        "POSITION": out.positions(&points), "NORMAL": out.vectors(&normals), "COLOR_0": out.colours(colours),
    });
    let primitive = json!({
        "attributes": attributes, "indices": out.indices(&indices), "material": 0, "mode": TRIANGLES,
    });
    json!({ "name": "spheres", "primitives": [primitive], "extras": extras(values) })
}

fn ball_size() -> usize {
    balls::VERTICES
}

/// Opaque, in linear light as glTF asks, in 16 bits since 8 bits of light show steps in dark colours.
fn colour(values: &SphereValues, sphere: usize) -> [u16; 4] {
    let [r, g, b] = values.map.linear(values.place(sphere));
    [r, g, b, 1.0].map(|light| (light * f64::from(u16::MAX)).round() as u16)
}

/// The arrays of a file.
#[derive(Default)]
struct Scene {
    binary: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Scene {
    /// Vectors with their box, which glTF demands of positions.
    fn positions(&mut self, points: &[Vec3]) -> usize {
        let id = self.vectors(points);
        let single = |p: &Vec3| p.to_array().map(|x| f64::from(x as f32));
        let fold = |start: f64, pick: fn(f64, f64) -> f64| {
            points
                .iter()
                .map(single)
                .fold([start; 3], |sum, p| std::array::from_fn(|k| pick(sum[k], p[k])))
        };
        self.accessors[id]["min"] = json!(fold(f64::INFINITY, f64::min));
        self.accessors[id]["max"] = json!(fold(f64::NEG_INFINITY, f64::max));
        id
    }

    fn vectors(&mut self, vectors: &[Vec3]) -> usize {
        let bytes =
            vectors.iter().flat_map(|v| v.to_array()).flat_map(|x| (x as f32).to_le_bytes());
        self.array(bytes.collect(), FLOAT, "VEC3", 12, VERTICES)
    }

    fn scalars(&mut self, values: impl Iterator<Item = f64>) -> usize {
        let bytes = values.flat_map(|x| (x as f32).to_le_bytes()).collect();
        self.array(bytes, FLOAT, "SCALAR", 4, VERTICES)
    }

    fn colours(&mut self, colours: impl Iterator<Item = [u16; 4]>) -> usize {
        let bytes = colours.flatten().flat_map(u16::to_le_bytes).collect();
        let id = self.array(bytes, U16, "VEC4", 8, VERTICES);
        self.accessors[id]["normalized"] = true.into();
        id
    }

    fn indices(&mut self, indices: &[u32]) -> usize {
        let bytes = indices.iter().flat_map(|v| v.to_le_bytes()).collect();
        self.array(bytes, U32, "SCALAR", 4, INDICES)
    }

    /// All elements have a multiple of four bytes, so that every array begins at one.
    fn array(&mut self, bytes: Vec<u8>, code: u32, kind: &str, size: usize, target: u32) -> usize {
        self.views.push(json!({
            "buffer": 0, "byteOffset": self.binary.len(), "byteLength": bytes.len(), "target": target,
        }));
        self.accessors.push(json!({
            "bufferView": self.views.len() - 1, "componentType": code, "count": bytes.len() / size, "type": kind,
        }));
        self.binary.extend(bytes);
        self.accessors.len() - 1
    }
}
