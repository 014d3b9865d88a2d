//! Files that are wrong, cut off, altered at random or greedy: a result or a typed error, always,
//! at once, and with bounded memory.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::sync::LazyLock;

use crate::shapes::*;
use medial::Vec3;
use medial::surface::{self, Fault, Format, Loaded, Repair};
use proptest::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

/// Counts the bytes of the current thread, and their maximum.
struct Counting;

thread_local! {
    static HELD: Cell<usize> = const { Cell::new(0) };
    static PEAK: Cell<usize> = const { Cell::new(0) };
}

#[allow(unsafe_code)] // An allocator cannot be written without.
// SAFETY: every call is handed on unchanged to the system's allocator.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        HELD.with(|held| {
            held.set(held.get() + layout.size());
            PEAK.with(|peak| peak.set(peak.get().max(held.get())));
        });
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        HELD.with(|held| held.set(held.get().saturating_sub(layout.size())));
        unsafe { System.dealloc(pointer, layout) };
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

/// Reads within one thread and checks the limit of memory: 16 MB and 100 times the size.
fn read(bytes: &[u8], format: Format) -> Result<Loaded, surface::SurfaceError> {
    static ONE_THREAD: LazyLock<ThreadPool> =
        LazyLock::new(|| ThreadPoolBuilder::new().num_threads(1).build().unwrap());
    ONE_THREAD.install(|| {
        let start = HELD.with(Cell::get);
        PEAK.with(|peak| peak.set(start));
        let result = surface::read_bytes(bytes, format);
        let (peak, size) = (PEAK.with(Cell::get).saturating_sub(start), bytes.len());
        assert!(peak <= 16_000_000 + 100 * size, "{peak} bytes for a file of {size}");
        if let Ok(loaded) = &result {
            surface::validate(&loaded.mesh).expect("reading guarantees validity");
        }
        result
    })
}

fn repairs(text: &str) -> Vec<Repair> {
    read(text.as_bytes(), Format::Off).unwrap().report.repairs
}

fn fault(text: &str) -> Fault {
    read(text.as_bytes(), Format::Off).unwrap_err().fault
}

/// The cube as OFF with its faces from `edit`.
fn cube_with(edit: impl FnOnce(&mut Vec<[u32; 3]>)) -> String {
    let mut mesh = cube();
    edit(&mut mesh.faces);
    to_off(&mesh)
}

#[test]
fn hand_written_defects_are_repaired_and_reported() {
    assert_eq!(repairs(&cube_with(|_| {})), []);
    let twice = cube_with(|f| f.push(f[0]));
    assert_eq!(repairs(&twice), [Repair::DroppedDuplicateFaces { faces: 1 }]);
    let thrice = cube_with(|f| f.extend([[f[0][1], f[0][0], f[0][2]], f[0]]));
    assert_eq!(repairs(&thrice), [Repair::DroppedDuplicateFaces { faces: 2 }]);
    let collapsed = cube_with(|f| f.push([0, 0, 1]));
    assert_eq!(repairs(&collapsed), [Repair::DroppedDegenerateFaces { faces: 1 }]);
    let inward = to_off(&inverted(cube()));
    assert_eq!(repairs(&inward), [Repair::TurnedOutward { components: 1 }]);
    let mixed = cube_with(|f| f[3..6].iter_mut().for_each(|face| face.swap(0, 1)));
    assert_eq!(repairs(&mixed), [Repair::ReorientedFaces { faces: 3 }]);
    // The first face decides the orientation of the others, but not which ones are reported.
    let first = cube_with(|f| f[0].swap(0, 1));
    assert_eq!(repairs(&first), [Repair::ReorientedFaces { faces: 1 }]);
    let loose = cube_with(|_| {}).replace("OFF\n8 ", "OFF\n9 ").replacen(
        "1.0 1.0 1.0\n",
        "1.0 1.0 1.0\n7 7 7\n",
        1,
    );
    assert_eq!(repairs(&loose), [Repair::DroppedUnreferencedVertices { vertices: 1 }]);
    let tiny = cube_with(|_| {}).replacen("0.0 0.0 0.0", "1e-300 -0.0 0.0", 1);
    assert_eq!(repairs(&tiny), [Repair::FlushedCoordinates { coordinates: 1 }]);
    let mut soup = cube();
    soup.vertices = (0..12).flat_map(|f| soup.triangle(f)).collect();
    soup.faces = (0..12).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect();
    assert_eq!(repairs(&to_off(&soup)), [Repair::WeldedVertices { vertices: 28 }]);
    let quads = "OFF 8 6 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 1\n1 0 1\n1 1 1\n0 1 1\n\
                 4 0 3 2 1\n4 4 5 6 7\n4 0 1 5 4\n4 1 2 6 5\n4 2 3 7 6\n4 3 0 4 7\n";
    assert_eq!(repairs(quads), [Repair::TriangulatedPolygons { polygons: 6, triangles: 12 }]);
    // A quadrilateral with a corner twice is a triangle.
    let short = cube_with(|_| {}).replacen("3 0 2 3\n", "4 0 2 3 3\n", 1);
    assert_eq!(repairs(&short), []);
}

#[test]
fn surfaces_that_bound_no_solid_are_refused() {
    let open = cube_with(|f| f.truncate(11));
    assert!(matches!(fault(&open), Fault::Open { edges: 3, .. }));
    let corner = joined(&[cube(), cuboid(Vec3::ONE, Vec3::splat(2.0))]);
    let as_is = |mesh: &surface::TriMesh| {
        let found = surface::inspect_bytes("test.off", to_off(mesh).as_bytes());
        found.unwrap().as_is().unwrap_err().fault
    };
    assert!(matches!(as_is(&corner), Fault::NonManifoldVertex { vertices: 1, .. }));
    let edge = joined(&[cube(), cuboid(Vec3::new(1.0, 1.0, 0.0), Vec3::new(2.0, 2.0, 1.0))]);
    assert!(matches!(as_is(&edge), Fault::NonManifoldEdge { edges: 1, .. }));
    let flat = "OFF\n3 2 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n3 0 2 1\n";
    assert!(matches!(fault(flat), Fault::ZeroVolume { faces: 2, .. }));
    // A sphere pressed into a tilted plane, as flat as rounding allows.
    let press = |v: Vec3| (v.x + 0.3 * v.z, v.y + 0.2 * v.z);
    let tilt = |(x, y): (f64, f64)| Vec3::new(x, y, x / 3.0 + y / 7.0);
    let pressed = to_off(&moved(sphere(2), |v| tilt(press(v))));
    assert!(matches!(fault(&pressed), Fault::ZeroVolume { faces: 128, .. }));
    let point = to_off(&moved(cube(), |_| Vec3::ONE));
    assert!(matches!(fault(&point), Fault::Collapsed { faces: 12 }));
    let overflowing = to_off(&moved(cube(), |v| (v - 0.5) * f64::MAX * 2.0));
    assert!(matches!(fault(&overflowing), Fault::Extent { .. }));
    let vanishing = to_off(&moved(cube(), |v| v * 1e-310));
    assert!(matches!(fault(&vanishing), Fault::Extent { diagonal } if diagonal > 0.0));
    for none in ["OFF\n0 0 0\n", "OFF\n3 0 0\n0 0 0\n1 0 0\n0 1 0\n"] {
        assert!(matches!(fault(none), Fault::NoFaces { .. }));
    }
    // The usual Klein bottle, crossing itself where it must.
    let (n, m) = (8_u32, 6_u32);
    let id = |i: u32, j: u32| if i < n { i * m + j % m } else { (2 * m - j % m) % m };
    let mut bottle = torus(n, m);
    bottle.faces = (0..n)
        .flat_map(|i| (0..m).map(move |j| (i, j)))
        .flat_map(|(i, j)| {
            [[id(i, j), id(i + 1, j), id(i + 1, j + 1)], [id(i, j), id(i + 1, j + 1), id(i, j + 1)]]
        })
        .collect();
    assert!(matches!(fault(&to_off(&bottle)), Fault::NonOrientable { .. }));
    let strip = |i: u32, j: u32| if i < n { 2 * i + j } else { 1 - j };
    let mut moebius = torus(n, 2);
    moebius.faces = (0..n)
        .flat_map(|i| [[(i, 0), (i + 1, 0), (i + 1, 1)], [(i, 0), (i + 1, 1), (i, 1)]])
        .map(|corners| corners.map(|(i, j)| strip(i, j)))
        .collect();
    assert!(matches!(fault(&to_off(&moebius)), Fault::NonOrientable { .. }));
}

#[test]
fn digits_lost_far_from_the_origin_in_single_precision_are_named() {
    let single = |v: Vec3| Vec3::from_array(v.to_array().map(|x| f64::from(x as f32)));
    let mut torus = torus(40, 20);
    let named = |mesh: &surface::TriMesh, shift: f64| {
        let far = to_off(&moved(mesh.clone(), |v| single(v + shift)));
        let found = surface::inspect_bytes("torus.off", far.as_bytes()).unwrap();
        let warnings = found.report.warnings.iter();
        (warnings.filter(|warning| warning.contains("digits are lost")).count(), found.solid())
    };
    assert_eq!(named(&torus, 1.0).0, 0);
    let (count, solid) = named(&torus, 1e4);
    assert_eq!((count, solid.unwrap().report.warnings.len()), (1, 1));
    // The same distances in double precision lose nothing that matters.
    let far = to_off(&moved(torus.clone(), |v| v + 1e7 / 3.0));
    assert_eq!(read(far.as_bytes(), Format::Off).unwrap().report.warnings, [""; 0]);
    torus.faces.pop();
    let Fault::LostDigits { fault, .. } = named(&torus, 1e4).1.unwrap_err().fault else { panic!() };
    assert!(matches!(*fault, Fault::Open { edges: 3, .. }));
}

#[test]
fn sizes_at_the_ends_of_the_range_are_no_excuse() {
    for (factor, shift) in [(1e200, 0.0), (1e-160, 0.0), (1e-307, 0.0), (1.0, 1e12), (8e307, 0.0)] {
        let mesh = moved(cube(), |v| v * factor + shift);
        let loaded = read(to_off(&mesh).as_bytes(), Format::Off).unwrap();
        assert_eq!(loaded.mesh, mesh);
        let expected = factor * 3_f64.sqrt();
        assert!((loaded.report.diagonal / expected - 1.0).abs() < 1e-12);
        let volume = (factor == 1.0).then_some(1.0);
        assert_eq!(loaded.report.volume, volume);
        assert_eq!(loaded.report.repairs, []);
    }
}

#[test]
fn headers_that_promise_too_much_are_errors_and_not_allocations() {
    let billion = 1_000_000_000_u64;
    let header = |format: &str, v: u64, f: u64| {
        format!(
            "ply\nformat {format} 1.0\nelement vertex {v}\nproperty float x\nproperty float y\n\
             property float z\nelement face {f}\nproperty list uchar int vertex_indices\nend_header\n"
        )
    };
    for text in [
        format!("OFF\n{billion} {billion} 0\n0 0 0\n"),
        "OFF\n99999999999999999999 1 0\n".to_owned(),
        format!("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n{billion} 0 1 2\n"),
    ] {
        assert!(read(text.as_bytes(), Format::Off).is_err());
    }
    for encoding in ["ascii", "binary_little_endian", "binary_big_endian"] {
        for (v, f) in [(billion, 1), (0, billion), (u64::MAX, u64::MAX)] {
            assert!(read(header(encoding, v, f).as_bytes(), Format::Ply).is_err());
        }
        // Elements of no size may be announced in any number.
        let empty = header(encoding, 0, 0)
            .replace("element face", &format!("element void {billion}\nelement face"));
        assert!(read(empty.as_bytes(), Format::Ply).is_err());
    }
    for encoding in ["ascii", "binary_little_endian", "binary_big_endian"] {
        let list = header(encoding, 0, 0).replace("float z", "list uchar float z");
        let error = read(list.as_bytes(), Format::Ply).unwrap_err().to_string();
        assert_eq!(error, "line 6: expected a number as the property z, found \"list\"");
    }
    let mut list = header("binary_little_endian", 0, 1).replace("uchar", "uint").into_bytes();
    list.extend(u32::MAX.to_le_bytes());
    assert!(read(&list, Format::Ply).is_err());
    let mut stl = vec![0; 84];
    stl[80..].copy_from_slice(&u32::MAX.to_le_bytes());
    assert!(matches!(read(&stl, Format::Stl).unwrap_err().fault, Fault::Count { .. }));
}

#[test]
fn large_and_adverse_files_stay_within_time_and_memory() {
    use std::fmt::Write;
    let off = |vertices: &str, faces: &str| {
        let (v, f) = (vertices.lines().count(), faces.lines().count());
        format!("OFF\n{v} {f} 0\n{vertices}{faces}")
    };
    let lines = |n: u32, line: &dyn Fn(u32) -> String| {
        (0..n).fold(String::new(), |mut text, i| {
            writeln!(text, "{}", line(i)).unwrap();
            text
        })
    };
    let corners = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 1 1\n";
    let circle = |i: u32| {
        let a = f64::from(i) * 1e-3;
        format!("{:.3} {:.3} {}", a.cos() * (1.0 + a), a.sin() * (1.0 + a), i % 7)
    };
    let files = [
        // A plain large one, with short numbers.
        to_off(&moved(torus(200, 200), |v| (v * 99.0).round())),
        // The same face all over, and all faces at one edge.
        off(corners, &"3 0 1 2\n".repeat(100_000)),
        off(
            &lines(20_000, &|i| format!("{} {} 1", i % 300, i / 300)),
            &lines(19_998, &|i| format!("3 0 1 {}", i + 2)),
        ),
        // Nearly all pairs intersect.
        off(
            &lines(15_000, &circle),
            &lines(5_000, &|i| format!("3 {i} {} {}", i + 5_000, i + 10_000)),
        ),
        // One polygon with corners over and over, and one that is a long spiral.
        off(corners, &format!("{}{}\n", 300_000, " 0 1 2 3 4".repeat(60_000))),
        off(
            &lines(20_000, &circle),
            &format!("20000 {}\n", lines(20_000, &|i| i.to_string()).replace('\n', " ")),
        ),
        // Thousands of shells around one another.
        to_off(&joined(
            &(1..3_000).map(|i| moved(sphere(0), |v| v * f64::from(i))).collect::<Vec<_>>(),
        )),
    ];
    for file in files {
        if let Err(error) = read(file.as_bytes(), Format::Off) {
            assert!(error.to_string().len() < 300);
        }
    }
}

/// Small valid files of every format and variant.
fn valid_files() -> Vec<(Vec<u8>, Format)> {
    let mesh = sphere(0);
    let mut files = vec![(to_off(&mesh).into_bytes(), Format::Off)];
    let coloured = to_off(&mesh).replacen("OFF", "COFF", 1).replace(".0\n", ".0 1 2 3 4\n");
    files.push((coloured.into_bytes(), Format::Off));
    let mut obj = String::from("# c\no x\n");
    for v in &mesh.vertices {
        obj += &format!("v {} {} {}\nvn 0 0 1\n", v.x, v.y, v.z);
    }
    for f in &mesh.faces {
        obj += &format!("f {}//1 -{} \\\n {}/2\n", f[0] + 1, 6 - f[1], f[2] + 1);
    }
    files.push((obj.into_bytes(), Format::Obj));
    for (encoding, big) in
        [("ascii", None), ("binary_little_endian", Some(false)), ("binary_big_endian", Some(true))]
    {
        files.push((to_ply(&mesh, encoding, big), Format::Ply));
    }
    let mut text = String::from("solid s\n");
    let mut binary = b"solid".to_vec();
    binary.resize(80, 0);
    binary.extend((mesh.faces.len() as u32).to_le_bytes());
    for face in 0..mesh.faces.len() {
        text += "facet normal 0 0 0\nouter loop\n";
        binary.extend([0; 12]);
        for v in mesh.triangle(face) {
            text += &format!("vertex {} {} {}\n", v.x, v.y, v.z);
            binary.extend(v.to_array().iter().flat_map(|&x| (x as f32).to_le_bytes()));
        }
        text += "endloop\nendfacet\n";
        binary.extend([0; 2]);
    }
    text += "endsolid\n";
    files.extend([(text.into_bytes(), Format::Stl), (binary, Format::Stl)]);
    files
}

/// PLY with mixed types, an extra property before and after, and a foreign element in between.
fn to_ply(mesh: &surface::TriMesh, encoding: &str, big: Option<bool>) -> Vec<u8> {
    let mut bytes = format!(
        "ply\r\nformat {encoding} 1.0\r\ncomment c\r\nelement vertex {}\r\nproperty uchar red\r\n\
         property double x\r\nproperty float y\r\nproperty short z\r\nelement edge 1\r\n\
         property list ushort int8 ends\r\nelement face {}\r\nproperty list int uint vertex_index\r\n\
         property float quality\r\nend_header\r\n",
        mesh.vertices.len(),
        mesh.faces.len()
    )
    .into_bytes();
    // Values as (text, little-endian bytes), rows as lists of them.
    let mut row = |values: &[(String, Vec<u8>)]| match big {
        None => {
            let words: Vec<&str> = values.iter().map(|v| v.0.as_str()).collect();
            bytes.extend((words.join(" ") + "\r\n").bytes());
        }
        Some(big) => values.iter().for_each(|(_, value)| {
            let mut value = value.clone();
            if big {
                value.reverse();
            }
            bytes.extend(value);
        }),
    };
    for v in &mesh.vertices {
        row(&[
            ("200".into(), vec![200]),
            (v.x.to_string(), v.x.to_le_bytes().to_vec()),
            (v.y.to_string(), (v.y as f32).to_le_bytes().to_vec()),
            (v.z.to_string(), (v.z as i16).to_le_bytes().to_vec()),
        ]);
    }
    row(&[
        ("2".into(), 2_u16.to_le_bytes().to_vec()),
        ("-1".into(), vec![255]),
        ("1".into(), vec![1]),
    ]);
    for f in &mesh.faces {
        let index = |i: u32| (i.to_string(), i.to_le_bytes().to_vec());
        row(&[
            index(3),
            index(f[0]),
            index(f[1]),
            index(f[2]),
            ("0.5".into(), 0.5_f32.to_le_bytes().to_vec()),
        ]);
    }
    bytes
}

#[test]
fn every_format_holds_the_same_octahedron() {
    for (bytes, format) in valid_files() {
        let loaded = read(&bytes, format).unwrap_or_else(|e| panic!("{format}: {e}"));
        let report = loaded.report;
        assert_eq!((report.vertices, report.faces, report.euler), (6, 8, 2), "{format}");
        assert!((report.volume.unwrap() - 4.0 / 3.0).abs() < 1e-15);
        assert!(report.warnings.is_empty(), "{format}: {:?}", report.warnings);
        let only_welds = report.repairs.iter().all(|r| matches!(r, Repair::WeldedVertices { .. }));
        assert!(only_welds && (report.repairs.is_empty() || format == Format::Stl));
    }
}

#[test]
fn every_truncation_has_a_result() {
    for (bytes, format) in valid_files() {
        for length in 0..bytes.len() {
            // Only blanks or a closing word may be missing.
            if read(&bytes[..length], format).is_ok() {
                assert!(bytes.len() - length < 12, "{format} cut to {length} of {}", bytes.len());
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(800))]

    #[test]
    fn altered_files_never_panic_or_hang(
        which in 0..8_usize,
        edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>(), 0..5), 1..6),
    ) {
        let mut bytes = valid_files().swap_remove(which).0;
        let digits = b"0123456789+-.eE \n/\\#";
        for (at, value, kind) in edits {
            let at = at.index(bytes.len());
            match kind {
                0 => bytes[at] ^= value.max(1),
                1 => bytes[at] = digits[usize::from(value) % digits.len()],
                2 => bytes.insert(at, digits[usize::from(value) % digits.len()]),
                3 if bytes.len() > 1 => { bytes.remove(at); }
                _ => bytes.truncate(at.max(1)),
            }
        }
        for other in [Format::Off, Format::Obj, Format::Ply, Format::Stl] {
            let _ = read(&bytes, other);
        }
    }
}
