//! Writes binary glTF 2.0 (`.glb`), which viewers, browsers and Blender show without conversion.
//!
//! ```text
//! "glTF" 2 length | length "JSON" text | length "BIN\0" bytes
//! ```
//!
//! One mesh `medial axis`, whose primitives share their vertices, the spheres: faces as triangles, edges *without a
//! face* as lines, spheres without an edge as points. A vertex has a position, a colour (`COLOR_0`, linear
//! light), the radius (`_RADIUS`) and the value it is coloured by (`_STABILITY`, `_ERROR`). The mesh's `extras`
//! describe the colours. On request a second mesh `spheres` holds the spheres as round bodies.
//!
//! - glTF has `y` up, medial meshes by habit `z`: `(x, y, z)` is written as `(x, z, -y)`, which Blender turns back.
//! - Numbers are rounded to single precision ([`single_precision_loss`]), the only one of glTF.
//! - Sheets have two sides and may meet in threes, where no smooth normal is right: they have none, and viewers shade
//!   them flat, as the specification demands then.
//!
//! Source: The Khronos Group, glTF 2.0 Specification, <https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html>.

use std::collections::HashMap;

use serde_json::{Map, Value, json};

use super::{Look, SphereValues};
use crate::Vec3;
use crate::complex::MedialMesh;

/// Codes of glTF: types of numbers; vertices and indices; ways to join vertices.
const FLOAT: u32 = 5126;
const U16: u32 = 5123;
const U32: u32 = 5125;
const VERTICES: u32 = 34962;
const INDICES: u32 = 34963;
const POINTS: u32 = 0;
const LINES: u32 = 1;
const TRIANGLES: u32 = 4;

/// The attribute of the radii. Names that begin with `_` belong to the application.
const RADIUS: &str = "_RADIUS";

/// Vertices and triangles of a ball.
const BALL: [usize; 2] = [42, 80];

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
/// When it has no sphere, a number beyond single precision, or more than 4 GB.
pub(super) fn file(mesh: &MedialMesh, look: &Look) -> Result<Vec<u8>, String> {
    if mesh.spheres.is_empty() {
        return Err(
            "a mesh without a sphere cannot be written as glTF, which has no empty arrays".into()
        );
    }
    let values = look.values.clone().unwrap_or_else(|| SphereValues::radius(mesh));
    for (id, (sphere, value)) in mesh.spheres.iter().zip(&values.values).enumerate() {
        let [x, y, z] = sphere.centre.to_array();
        let numbers = [x, y, z, sphere.radius, *value];
        if let Some(number) = numbers.into_iter().find(|&number| !(number as f32).is_finite()) {
            return Err(format!(
                "sphere {id}: {number:e} is beyond single precision, the only one of glTF; write .ma or .vtp"
            ));
        }
    }
    let ball_bytes = if look.balls { 32 * BALL[0] + 12 * BALL[1] } else { 0 };
    too_large((ball_bytes as u64) * mesh.spheres.len() as u64)?;
    let mut out = Arrays::default();
    let mut meshes = vec![axis(&mut out, mesh, &values)];
    if look.balls {
        meshes.push(spheres(&mut out, mesh, &values));
    }
    let nodes: Vec<Value> = (0..)
        .zip(&meshes)
        .map(|(k, mesh): (u32, _)| json!({ "mesh": k, "name": mesh["name"] }))
        .collect();
    let document = json!({
        "asset": { "version": "2.0", "generator": concat!("medial ", env!("CARGO_PKG_VERSION")) },
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
    pack(document.to_string().into_bytes(), out.binary)
}

/// The container of a JSON text and its binary chunk, both filled up to whole words.
fn pack(mut json: Vec<u8>, mut binary: Vec<u8>) -> Result<Vec<u8>, String> {
    json.resize(json.len().next_multiple_of(4), b' ');
    binary.resize(binary.len().next_multiple_of(4), 0);
    let total = 12 + 8 + json.len() + 8 + binary.len();
    too_large(total as u64)?;
    let mut file = Vec::with_capacity(total);
    file.extend(b"glTF");
    file.extend([2, total as u32].into_iter().flat_map(u32::to_le_bytes));
    for (kind, bytes) in [(b"JSON", json), (b"BIN\0", binary)] {
        file.extend((bytes.len() as u32).to_le_bytes());
        file.extend(kind);
        file.extend(bytes);
    }
    Ok(file)
}

fn too_large(bytes: u64) -> Result<(), String> {
    if bytes <= u64::from(u32::MAX) {
        return Ok(());
    }
    Err(format!("{bytes} bytes are more than the 4 GB of a binary glTF file; write .ma or .vtp"))
}

fn y_up(point: Vec3) -> Vec3 {
    Vec3::new(point.x, point.z, -point.y)
}

/// The mesh of faces, lone edges and lone spheres on common vertices.
fn axis(out: &mut Arrays, mesh: &MedialMesh, values: &SphereValues) -> Value {
    let points: Vec<Vec3> = mesh.spheres.iter().map(|sphere| y_up(sphere.centre)).collect();
    let mut attributes = Map::new();
    attributes.insert("POSITION".into(), out.positions(&points).into());
    let colours = (0..points.len()).map(|sphere| colour(values, sphere));
    attributes.insert("COLOR_0".into(), out.colours(colours).into());
    let radii = mesh.spheres.iter().map(|sphere| sphere.radius);
    attributes.insert(RADIUS.into(), out.scalars(radii).into());
    let attribute = format!("_{}", values.name.to_ascii_uppercase());
    if attribute != RADIUS {
        attributes.insert(attribute, out.scalars(values.values.iter().copied()).into());
    }
    let primitives = [
        (TRIANGLES, mesh.faces.as_flattened().to_vec()),
        (LINES, mesh.lone_edges().as_flattened().to_vec()),
        (POINTS, mesh.isolated()),
    ];
    let primitives: Vec<Value> = primitives
        .into_iter()
        .filter(|(_, indices)| !indices.is_empty())
        .map(|(mode, indices)| {
            let indices = out.indices(&indices);
            json!({ "attributes": attributes, "indices": indices, "material": 0, "mode": mode })
        })
        .collect();
    json!({ "name": "medial axis", "primitives": primitives, "extras": extras(values) })
}

/// The meaning of numbers and colours; Blender shows it as custom properties of the mesh.
fn extras(values: &SphereValues) -> Value {
    json!({
        "colour_by": values.name, "colour_meaning": values.meaning, "colour_map": values.map.name(),
        "colour_low": values.low, "colour_high": values.high,
        "unit": "the input's unit, which glTF calls a metre", "radius_attribute": RADIUS,
        "axes": "the input's (x, y, z) is (x, z, -y) here, so that its z is up",
    })
}

/// The mesh of all spheres as round bodies. One mesh instead of instances of one: instances would share their colours,
/// and thousands of objects make Blender slow.
fn spheres(out: &mut Arrays, mesh: &MedialMesh, values: &SphereValues) -> Value {
    let (ball, triangles) = ball();
    let ball: Vec<Vec3> = ball.into_iter().map(y_up).collect();
    let (mut points, mut normals, mut indices) = (Vec::new(), Vec::new(), Vec::new());
    for sphere in &mesh.spheres {
        // Below 2^32: the size of the file was checked.
        let first = points.len() as u32;
        points.extend(ball.iter().map(|&p| y_up(sphere.centre) + p * sphere.radius));
        normals.extend(&ball);
        indices.extend(triangles.as_flattened().iter().map(|v| first + v));
    }
    let colours = (0..points.len()).map(|vertex| colour(values, vertex / BALL[0]));
    let attributes = json!({
        "POSITION": out.positions(&points), "NORMAL": out.vectors(&normals), "COLOR_0": out.colours(colours),
    });
    let primitive = json!({
        "attributes": attributes, "indices": out.indices(&indices), "material": 0, "mode": TRIANGLES,
    });
    json!({ "name": "spheres", "primitives": [primitive], "extras": extras(values) })
}

/// Opaque, in the linear light that glTF requires, in 16 bits since 8 bits of light show steps in dark colours.
fn colour(values: &SphereValues, sphere: usize) -> [u16; 4] {
    let [r, g, b] = values.map.linear(values.place(sphere));
    [r, g, b, 1.0].map(|light| (light * f64::from(u16::MAX)).round() as u16)
}

/// The arrays of a file.
#[derive(Default)]
struct Arrays {
    binary: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Arrays {
    /// Vectors with their box, which glTF demands of positions.
    fn positions(&mut self, points: &[Vec3]) -> usize {
        let id = self.vectors(points);
        let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for point in points {
            let rounded = Vec3::from(point.to_array().map(|x| f64::from(x as f32)));
            (low, high) = (low.min(rounded), high.max(rounded));
        }
        self.accessors[id]["min"] = json!(low.to_array());
        self.accessors[id]["max"] = json!(high.to_array());
        id
    }

    fn vectors(&mut self, vectors: &[Vec3]) -> usize {
        let numbers = vectors.iter().flat_map(|v| v.to_array());
        let bytes = numbers.flat_map(|x| (x as f32).to_le_bytes()).collect();
        self.array(bytes, FLOAT, "VEC3", 12, VERTICES)
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

/// The unit ball as an icosahedron with every triangle cut in four, counter-clockwise from outside.
fn ball() -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let golden = (1.0 + 5.0_f64.sqrt()) / 2.0;
    let mut vertices: Vec<Vec3> = Vec::with_capacity(BALL[0]);
    for (x, t) in [(1.0, 1.0), (-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)] {
        let y = t * golden;
        vertices.extend([[0.0, x, y], [x, y, 0.0], [y, 0.0, x]].map(Vec3::from));
    }
    let corners: Vec<Vec3> = vertices.clone();
    let mut middles: HashMap<[u32; 2], u32> = HashMap::new();
    let mut quarters = Vec::with_capacity(BALL[1]);
    for [a, b, c] in
        (0..12).flat_map(|a| (a + 1..12).flat_map(move |b| (b + 1..12).map(move |c| [a, b, c])))
    {
        let [p, q, r] = [a, b, c].map(|v| corners[v as usize]);
        // Neighbours are two units apart, others more than three.
        if [(p, q), (q, r), (p, r)].iter().any(|&(p, q)| p.distance(q) > 2.5) {
            continue;
        }
        let [b, c] = if (q - p).cross(r - p).dot(p) > 0.0 { [b, c] } else { [c, b] };
        let [ab, bc, ca] = [[a, b], [b, c], [c, a]].map(|[p, q]| {
            *middles.entry([p.min(q), p.max(q)]).or_insert_with(|| {
                vertices.push((corners[p as usize] + corners[q as usize]) * 0.5);
                vertices.len() as u32 - 1
            })
        });
        quarters.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
    }
    (vertices.into_iter().map(Vec3::normalize).collect(), quarters)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::complex::Sphere;

    fn mesh() -> MedialMesh {
        let spheres = [[0.0, 0.0, 0.0, 0.5], [1.0, 0.0, 0.0, 0.25], [0.0, 1.0, 0.0, 0.125]];
        let spheres = spheres.map(|[x, y, z, r]| Sphere::new(Vec3::new(x, y, z), r)).to_vec();
        MedialMesh::from_simplices(spheres, vec![[1, 2]], vec![]).unwrap()
    }

    /// The document and the binary chunk of a file, its lengths checked.
    fn unpacked(file: &[u8]) -> (Value, &[u8]) {
        let word = |at: usize| u32::from_le_bytes(file[at..at + 4].try_into().unwrap()) as usize;
        let end = 20 + word(12);
        assert_eq!((&file[..4], word(4), word(8)), (&b"glTF"[..], 2, file.len()));
        assert_eq!((&file[16..20], &file[end + 4..end + 8]), (&b"JSON"[..], &b"BIN\0"[..]));
        assert_eq!(end + 8 + word(end), file.len());
        (serde_json::from_slice(&file[20..end]).unwrap(), &file[end + 8..])
    }

    #[test]
    fn every_array_lies_in_the_binary_chunk_and_holds_its_numbers() {
        let mesh = mesh();
        let values = Some(SphereValues::stability(&mesh, 1.0));
        let bytes = file(&mesh, &Look { values, balls: true }).unwrap();
        let (document, binary) = unpacked(&bytes);
        let [axis, balls] = [0, 1].map(|k| document["meshes"][k]["primitives"].clone());
        let modes: Vec<_> =
            axis.as_array().unwrap().iter().map(|p| p["mode"].as_u64().unwrap()).collect();
        assert_eq!(modes, [u64::from(LINES), u64::from(POINTS)]);
        let array = |accessor: &Value| {
            let accessor = &document["accessors"][accessor.as_u64().unwrap() as usize];
            let view = &document["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
            let [start, length] =
                ["byteOffset", "byteLength"].map(|key| view[key].as_u64().unwrap() as usize);
            (accessor["count"].as_u64().unwrap() as usize, &binary[start..start + length])
        };
        let singles = |accessor: &Value| {
            let four = array(accessor).1.as_chunks().0;
            four.iter().map(|&b| f32::from_le_bytes(b)).collect::<Vec<_>>()
        };
        let attributes = &axis[0]["attributes"];
        assert_eq!(singles(&attributes[RADIUS]), [0.5, 0.25, 0.125]);
        assert_eq!(singles(&attributes["POSITION"])[6..], [0.0, 0.0, -1.0]);
        assert_eq!(singles(&attributes["_STABILITY"])[0], 1.0);
        assert_eq!(array(&attributes["COLOR_0"]).0, 3);
        assert_eq!(array(&balls[0]["attributes"]["POSITION"]).0, 3 * BALL[0]);
        assert_eq!(array(&balls[0]["indices"]).0, 3 * 3 * BALL[1]);
    }

    #[test]
    fn unwritable_meshes_are_refused_by_name() {
        let fail = |mesh: &MedialMesh| file(mesh, &Look::default()).unwrap_err();
        assert!(fail(&MedialMesh::default()).contains("without a sphere"));
        let mut large = mesh();
        large.spheres[2].radius = 1e39;
        assert!(fail(&large).starts_with("sphere 2: 1e39 is beyond single precision"));
        let spheres = vec![mesh().spheres[0]; 2_000_000];
        let many = MedialMesh { spheres, ..MedialMesh::default() };
        let error = file(&many, &Look { values: None, balls: true }).unwrap_err();
        assert!(error.starts_with("4608000000 bytes are more than the 4 GB"), "{error}");
    }

    #[test]
    fn a_ball_is_closed_round_and_outward() {
        let (vertices, triangles) = ball();
        assert_eq!([vertices.len(), triangles.len()], BALL);
        assert!(vertices.iter().all(|v| (v.length() - 1.0).abs() < 1e-15));
        let sixfold: f64 = triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|v| vertices[v as usize]);
                a.dot(b.cross(c))
            })
            .sum();
        // Of an icosphere of 80 triangles, against 4.18879 of the ball.
        assert!((sixfold / 6.0 - 3.6587).abs() < 1e-3, "{sixfold}");
        let sides = triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
        let mut sides: Vec<_> = sides.collect();
        sides.sort_unstable();
        assert!(sides.windows(2).all(|pair| pair[0] != pair[1]), "every side once in a direction");
        assert!(sides.iter().all(|&[a, b]| sides.binary_search(&[b, a]).is_ok()), "closed");
    }
}
