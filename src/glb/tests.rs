//! Small scenes, with one thing at a time that is right or wrong; readers of meshes try the same.

use proptest::prelude::*;
use serde_json::{Value, json};

use super::*;

/// A tetrahedron: 12 coordinates in single precision, then 12 indices in 16 bits, at byte 48.
pub(crate) fn binary() -> Vec<u8> {
    let points = [[0.0_f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let mut bytes: Vec<u8> = points.as_flattened().iter().flat_map(|x| x.to_le_bytes()).collect();
    let faces = [0_u16, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3];
    bytes.extend(faces.iter().flat_map(|i| i.to_le_bytes()));
    bytes
}

pub(crate) fn scene() -> Value {
    json!({
        "asset": { "version": "2.0" }, "scene": 0, "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "indices": 1 }] }],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3" },
            { "bufferView": 1, "componentType": 5123, "count": 12, "type": "SCALAR" },
        ],
        "bufferViews": [
            { "buffer": 0, "byteOffset": 0, "byteLength": 48 },
            { "buffer": 0, "byteOffset": 48, "byteLength": 24 },
        ],
        "buffers": [{ "byteLength": 72 }],
    })
}

/// The scene with the value at a JSON pointer replaced.
pub(crate) fn with(pointer: &str, value: Value) -> Value {
    let mut scene = scene();
    match scene.pointer_mut(pointer) {
        Some(place) => *place = value,
        None => {
            let (parent, key) = pointer.rsplit_once('/').expect("a pointer");
            scene.pointer_mut(parent).expect("a parent")[key] = value;
        }
    }
    scene
}

pub(crate) fn file(scene: &Value) -> Vec<u8> {
    pack(&scene.to_string(), &binary()).unwrap()
}

fn message(scene: &Value) -> String {
    parts(&file(scene)).map(|_| ()).unwrap_err().to_string()
}

#[test]
fn a_solid_comes_with_z_up() {
    let part = &parts(&file(&scene())).unwrap().parts[0];
    assert_eq!(part.points, [Vec3::ZERO, Vec3::X, Vec3::Z, -Vec3::Y]);
    assert_eq!(part.triangles, [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]);
    for point in [Vec3::new(1.0, -2.0, 3.0), Vec3::new(-0.0, 0.0, 1e-300)] {
        assert_eq!(
            z_up(y_up(point)).to_array().map(f64::to_bits),
            point.to_array().map(f64::to_bits)
        );
    }
}

#[test]
fn nodes_move_turn_scale_and_mirror() {
    let nodes = json!([
        { "children": [1, 2], "translation": [10.0, 0.0, 0.0] },
        // A quarter about z: x becomes y.
        { "mesh": 0, "rotation": [0.0, 0.0, 0.5_f64.sqrt(), 0.5_f64.sqrt()], "scale": [2.0, 2.0, 2.0] },
        { "mesh": 0, "matrix": [-1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 5.0, 1.0] },
    ]);
    let scene = parts(&file(&with("/nodes", nodes))).unwrap();
    assert_eq!(scene.parts.len(), 2);
    let near = |a: Vec3, b: [f64; 3]| assert!(a.distance(z_up(b.into())) < 1e-12, "{a}");
    near(scene.parts[0].points[1], [10.0, 2.0, 0.0]);
    near(scene.parts[0].points[2], [8.0, 0.0, 0.0]);
    near(scene.parts[1].points[1], [9.0, 0.0, 5.0]);
    assert_eq!(scene.parts[0].triangles[0], [0, 2, 1]);
    // Mirrored: turned, so that it still looks outward.
    assert_eq!(scene.parts[1].triangles[0], [0, 1, 2]);
}

#[test]
fn strips_fans_lines_and_loops_are_taken_apart() {
    let of = |mode: u32, count: u32| {
        let mut scene = with("/meshes/0/primitives/0/mode", mode.into());
        scene["accessors"][1]["count"] = count.into();
        let part = parts(&file(&scene)).unwrap().parts.remove(0);
        (part.triangles, part.segments)
    };
    // Indices 0 2 1 0 1 3 ...
    assert_eq!(of(5, 5).0, [[0, 2, 1], [2, 0, 1], [1, 0, 1]]);
    assert_eq!(of(6, 4).0, [[2, 1, 0], [1, 0, 0]]);
    assert_eq!(of(1, 4).1, [[0, 2], [1, 0]]);
    assert_eq!(of(3, 3).1, [[0, 2], [2, 1]]);
    assert_eq!(of(2, 3).1, [[0, 2], [2, 1], [1, 0]]);
    assert_eq!(of(0, 4), (vec![], vec![]));
    assert_eq!(of(5, 2), (vec![], vec![]));
    assert_eq!(of(6, 0), (vec![], vec![]));
}

#[test]
fn quantised_and_interleaved_numbers_are_read() {
    // 16-bit numbers of the indices as normalised coordinates, 2 bytes between vertices.
    let mut scene = with(
        "/accessors/0",
        json!({
            "bufferView": 1, "componentType": 5122, "normalized": true, "count": 3, "type": "VEC3",
        }),
    );
    scene["bufferViews"][1]["byteStride"] = 8.into();
    scene["meshes"][0]["primitives"][0] = json!({ "attributes": { "POSITION": 0 } });
    scene["extensionsRequired"] = json!(["KHR_mesh_quantization", "KHR_materials_unlit"]);
    let part = parts(&file(&scene)).unwrap().parts.remove(0);
    let unit = 1.0 / 32767.0;
    assert_eq!(part.points[0], z_up(Vec3::new(0.0, 2.0 * unit, unit)));
    assert_eq!(part.points[1], z_up(Vec3::new(unit, 3.0 * unit, 0.0)));
    assert_eq!(part.triangles, [[0, 1, 2]]);
}

#[test]
fn errors_name_the_element() {
    let draco = json!([{ "attributes": { "POSITION": 0 }, "extensions": { "KHR_draco_mesh_compression": {} } }]);
    for (pointer, value, expected) in [
        ("/scene", json!(7), "the file names scene 7, but there are 1"),
        ("/scenes/0/nodes", json!([3]), "the scene names node 3, but there are 1"),
        ("/nodes/0/mesh", json!(1), "node 0 names mesh 1, but there are 1"),
        (
            "/nodes/0/children",
            json!([0]),
            "node 0 is reached twice; the nodes of a scene have to form trees",
        ),
        ("/nodes/0/children", json!([9]), "node 0 names node 9, but there are 1"),
        (
            "/scenes/0/nodes",
            json!([0, 0]),
            "node 0 is reached twice; the nodes of a scene have to form trees",
        ),
        (
            "/meshes/0/primitives/0/indices",
            json!(9),
            "a primitive names accessor 9, but there are 2",
        ),
        ("/meshes/0/primitives/0/mode", json!(7), "mesh 0, primitive 0: there is no mode 7"),
        ("/meshes/0/primitives/0/attributes", json!({}), "mesh 0, primitive 0: it has no POSITION"),
        (
            "/meshes/0/primitives",
            draco,
            "the file needs the extension \"KHR_draco_mesh_compression\", which is not read; export it without compression",
        ),
        (
            "/extensionsRequired",
            json!(["EXT_meshopt_compression"]),
            "the file needs the extension \"EXT_meshopt_compression\", which is not read; export it without compression",
        ),
        ("/accessors/0/count", json!(5), "accessor 0 needs 60 bytes, but bufferView 0 has 48"),
        (
            "/accessors/0/count",
            json!(4294967295_u64),
            "accessor 0 needs 51539607540 bytes, but bufferView 0 has 48",
        ),
        (
            "/accessors/0/count",
            json!(u64::MAX),
            "accessor 0 needs 18446744073709551615 bytes, but bufferView 0 has 48",
        ),
        (
            "/accessors/0/byteOffset",
            json!(u64::MAX),
            "accessor 0 needs 18446744073709551615 bytes, but bufferView 0 has 48",
        ),
        (
            "/accessors/0/type",
            json!("VEC2"),
            "mesh 0, primitive 0, POSITION: it has 2 numbers for each vertex instead of 3",
        ),
        (
            "/accessors/0/type",
            json!("MAT4"),
            "accessor 0: its type is not SCALAR, VEC2, VEC3 or VEC4",
        ),
        ("/accessors/0/componentType", json!(5124), "accessor 0: no component type 5124"),
        (
            "/accessors/0/sparse",
            json!({ "count": 1 }),
            "accessor 0: it is sparse, which is not read; export it as a plain array",
        ),
        ("/accessors/0/bufferView", Value::Null, "accessor 0: it has no bytes (no bufferView)"),
        (
            "/accessors/1/componentType",
            json!(5122),
            "mesh 0, primitive 0, indices: its indices are not unsigned whole numbers",
        ),
        ("/accessors/1/count", json!(11), "mesh 0, primitive 0: 11 corners are no whole triangles"),
        (
            "/accessors/0/count",
            json!(3),
            "mesh 0, primitive 0, indices names vertex 3, but there are 3",
        ),
        (
            "/bufferViews/0/byteStride",
            json!(4),
            "accessor 0: its elements of 12 bytes overlap: the stride is 4",
        ),
        (
            "/bufferViews/0/byteLength",
            json!(73),
            "bufferView 0 needs 73 bytes, but buffer 0 has 72",
        ),
        (
            "/bufferViews/0/byteOffset",
            json!(u64::MAX),
            "bufferView 0 needs 18446744073709551615 bytes, but buffer 0 has 72",
        ),
        ("/bufferViews/0/buffer", json!(1), "bufferView 0 names buffer 1, but there are 1"),
        (
            "/buffers/0/byteLength",
            json!(4294967295_u64),
            "buffer 0 needs 4294967295 bytes, but the binary chunk has 72",
        ),
        (
            "/buffers/0/uri",
            json!("x.bin"),
            "buffer 0: its bytes are not in this file; export everything into one .glb",
        ),
    ] {
        assert_eq!(message(&with(pointer, value)), expected);
    }
    assert!(message(&with("/nodes", json!(3))).starts_with("the JSON text: invalid type"));
}

#[test]
fn a_container_that_lies_is_refused() {
    let good = file(&scene());
    let fail = |bytes: &[u8]| parts(bytes).map(|_| ()).unwrap_err();
    assert_eq!(fail(b"{\"asset\":{}}"), GlbError::Magic);
    assert_eq!(fail(b"glTF"), GlbError::Version(0));
    let holds = good.len();
    assert_eq!(
        fail(&good[..holds - 4]),
        GlbError::Length { announced: holds as u32, holds: holds - 4 }
    );
    let altered = |at: usize, word: u32| {
        let mut bytes = good.clone();
        bytes[at..at + 4].copy_from_slice(&word.to_le_bytes());
        fail(&bytes)
    };
    assert_eq!(altered(4, 1), GlbError::Version(1));
    assert_eq!(altered(8, u32::MAX), GlbError::Length { announced: u32::MAX, holds });
    assert_eq!(
        altered(12, u32::MAX),
        GlbError::Chunk { chunk: 0, announced: u32::MAX, left: holds - 20 }
    );
    assert_eq!(altered(16, 0), GlbError::NoJson);
    // A chunk of another kind is not the binary one.
    let json = u32::from_le_bytes([good[12], good[13], good[14], good[15]]) as usize;
    assert!(matches!(altered(20 + json + 4, 7), GlbError::Range { has: 0, .. }));
}

/// A small file may not become a huge scene.
#[test]
fn meshes_that_are_repeated_too_often_are_refused() {
    let primitive = json!({ "attributes": { "POSITION": 0 }, "indices": 1 });
    let mut scene = with("/meshes/0/primitives", Value::Array(vec![primitive; 1000]));
    scene["nodes"] = Value::Array(vec![json!({ "mesh": 0 }); 1000]);
    scene["scenes"][0]["nodes"] = (0..1000).collect();
    assert!(message(&scene).starts_with("the scene repeats its meshes to"), "{}", message(&scene));
    // A chain as deep as it is long needs no deep stack.
    let nodes: Vec<Value> =
        (1..100_000).map(|k| json!({ "children": [k] })).chain([json!({ "mesh": 0 })]).collect();
    assert_eq!(parts(&file(&with("/nodes", nodes.into()))).unwrap().parts.len(), 1);
}

proptest! {
    #[test]
    fn damage_never_panics(places in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6)) {
        let mut bytes = file(&scene());
        for (place, byte) in places {
            let place = place.index(bytes.len());
            bytes[place] = byte;
        }
        let _ = parts(&bytes);
    }
}
