//! Lists of spheres as robot planners and granular simulations use them.
//!
//! | extension | layout |
//! |---|---|
//! | `.csv` | rows `x,y,z,r` below a header |
//! | `.txt`, `.xyzr` | rows `x y z r` without a header: clumps of spheres |
//! | `.json` | `{"spheres": [{"center": [x, y, z], "radius": r}, ...]}` |
//! | `.yaml`, `.yml` | `collision_spheres: {LINK: [{center: [x, y, z], radius: r}, ...]}` as cuRobo reads it |
//! | `.xrdf` | the sections `collision` and `geometry` of Isaac's Extended Robot Description Format |
//! | `.urdf` | `collision` elements with a `sphere`, of a `link` |
//! | `.xml` | MJCF: `geom` elements of type `sphere`, of a `body` |
//!
//! The link is named after the file. The readers search a document for lists of spheres, one for each link. They skip
//! other shapes and ignore frames, joints and classes: a list is in the frame of its link.
//!
//! Sources: cuRobo, <https://curobo.org>; XRDF 1.0, <https://nvidia-isaac-ros.github.io/concepts/manipulation/xrdf.html>;
//! URDF, <https://wiki.ros.org/urdf/XML>; MJCF, <https://mujoco.readthedocs.io/en/stable/XMLreference.html>.

use std::io::{self, Write};
use std::path::Path;

use roxmltree::{Document, Node};
use serde_json::Value;
use serde_saphyr::NonFiniteFloatPolicy;

use super::ma::{canonical, finite, lines, note, parse_ma, shortened};
use super::{LoadedMa, MaError, MaErrorKind, ReadOptions, extension};
use crate::Vec3;
use crate::complex::{MedialMesh, Sphere};

/// The text of a format: its extensions, and the text before all spheres, of each, between two, and behind all.
struct Layout(&'static [&'static str], &'static str, &'static str, &'static str, &'static str);

/// `{link}` is a quoted string.
const LAYOUTS: [Layout; 7] = [
    Layout(&["csv"], "x,y,z,r\n", "{x},{y},{z},{r}\n", "", ""),
    Layout(&["txt", "xyzr"], "", "{x} {y} {z} {r}\n", "", ""),
    Layout(
        &["json"],
        "{\"spheres\": [\n",
        "  {\"center\": [{x}, {y}, {z}], \"radius\": {r}}",
        ",\n",
        "\n]}\n",
    ),
    Layout(
        &["yaml", "yml"],
        "collision_spheres:\n  {link}:\n",
        "    - center: [{x}, {y}, {z}]\n      radius: {r}\n",
        "",
        "",
    ),
    Layout(
        &["xrdf"],
        "format: xrdf\nformat_version: 1.0\ncollision:\n  geometry: {link}\ngeometry:\n  {link}:\n    spheres:\n      \
         {link}:\n",
        "        - center: [{x}, {y}, {z}]\n          radius: {r}\n",
        "",
        "",
    ),
    Layout(
        &["urdf"],
        "<?xml version=\"1.0\"?>\n<robot name={link}>\n  <link name={link}>\n",
        "    <collision><origin xyz=\"{x} {y} {z}\" rpy=\"0 0 0\"/><geometry><sphere radius=\"{r}\"/></geometry>\
         </collision>\n",
        "",
        "  </link>\n</robot>\n",
    ),
    Layout(
        &["xml"],
        "<mujoco model={link}>\n  <worldbody>\n    <body name={link}>\n",
        "      <geom type=\"sphere\" pos=\"{x} {y} {z}\" size=\"{r}\"/>\n",
        "",
        "    </body>\n  </worldbody>\n</mujoco>\n",
    ),
];

fn layout(extension: &str) -> Option<&'static Layout> {
    LAYOUTS.iter().find(|layout| layout.0.contains(&extension))
}

/// The elements of a medial mesh that a file of this name cannot hold, as a note; `None` if it holds all.
///
/// ```
/// use medial::complex::{MedialMesh, Sphere, left_out};
///
/// let spheres = [0.0, 1.0].map(|x| Sphere::new(medial::Vec3::new(x, 0.0, 0.0), 0.5));
/// let mesh = MedialMesh::from_simplices(spheres.to_vec(), vec![[0, 1]], vec![])?;
/// assert_eq!(left_out("arm.ma", &mesh), None);
/// assert_eq!(left_out("arm.csv", &mesh).unwrap(), "left out 1 edge and 0 faces: .csv holds spheres alone");
/// # Ok::<(), medial::complex::ComplexError>(())
/// ```
pub fn left_out(path: impl AsRef<Path>, mesh: &MedialMesh) -> Option<String> {
    let extension = extension(path.as_ref());
    layout(&extension).filter(|_| !mesh.edges.is_empty())?;
    let [edges, faces] = [(mesh.edges.len(), "edge"), (mesh.faces.len(), "face")]
        .map(|(count, one)| format!("{count} {one}{}", if count == 1 { "" } else { "s" }));
    Some(format!("left out {edges} and {faces}: .{extension} holds spheres alone"))
}

/// Writes the spheres of a mesh into the file `path`, whose extension is one of [`LAYOUTS`].
pub(super) fn write_spheres(out: &mut dyn Write, path: &Path, mesh: &MedialMesh) -> io::Result<()> {
    let extension = extension(path);
    let Layout(_, head, row, between, tail) = layout(&extension).expect("a format of spheres");
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let link = stem.replace(char::is_control, "_");
    let link = match &*extension {
        "urdf" | "xml" => {
            let escaped = link.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;");
            format!("\"{escaped}\"")
        }
        _ => Value::from(link).to_string(),
    };
    write!(out, "{}", head.replace("{link}", &link))?;
    for (k, Sphere { centre, radius }) in mesh.spheres.iter().enumerate() {
        let numbers = [("{x}", centre.x), ("{y}", centre.y), ("{z}", centre.z), ("{r}", *radius)];
        let text = numbers.iter().fold((*row).to_owned(), |text, (field, number)| {
            text.replace(field, &decimal(*number))
        });
        write!(out, "{}{text}", if k > 0 { between } else { "" })?;
    }
    write!(out, "{tail}")
}

/// The shortest decimal that is read back as this number, with a point and without an exponent: `1e-5` is a text to
/// readers of YAML 1.1, and `1` may be an index.
fn decimal(number: f64) -> String {
    let text = number.to_string();
    if text.contains('.') { text } else { text + ".0" }
}

type Loaded = Result<LoadedMa, MaError>;

fn malformed(name: &str, line: Option<usize>, why: String) -> MaError {
    MaError { line, ..MaError::of(name, MaErrorKind::Malformed(why)) }
}

/// The spheres of one link.
#[derive(Default)]
struct Link {
    name: String,
    spheres: Vec<Sphere>,
    /// Elements of other shapes.
    others: usize,
}

/// The spheres of the requested link as a medial mesh; `name` is the file in errors.
fn chosen(mut links: Vec<Link>, name: &str, options: ReadOptions) -> Loaded {
    let refused = |why| Err(malformed(name, None, why));
    let others: usize = links.iter().map(|link| link.others).sum();
    links.retain(|link| !link.spheres.is_empty());
    let count = links.len();
    let index = match (options.block, count) {
        (_, 0) if others > 0 => {
            return refused(format!("no spheres (found {others} other shapes)"));
        }
        (_, 0) => return refused("no spheres".to_owned()),
        (None, 1) => 0,
        (None, _) => {
            let listed = links.iter().enumerate().take(MOST_LISTED);
            let listed: Vec<String> =
                listed.map(|(k, link)| format!("{} {}", k + 1, shortened(&link.name))).collect();
            let more = if count > MOST_LISTED { ", ..." } else { "" };
            let listed = listed.join(", ");
            return refused(format!("{count} links ({listed}{more}); select one by --block K"));
        }
        (Some(k), _) if (1..=count).contains(&k) => k - 1,
        (Some(k), _) => {
            let why = format!("there is no block {k}: the file holds {count}, counted from 1");
            return refused(why);
        }
    };
    let Link { mut spheres, others, .. } = links.swap_remove(index);
    let mut notes = Vec::new();
    note(&mut notes, others, "element", "skipped: not a sphere");
    let all = spheres.len();
    // cuRobo switches spheres off by a negative radius.
    spheres.retain(|sphere| sphere.radius >= 0.0);
    note(&mut notes, all - spheres.len(), "sphere", "dropped: negative radius");
    if spheres.is_empty() {
        return refused(format!("no spheres (found {all} with a negative radius)"));
    }
    canonical(spheres, vec![], vec![], options.radii, notes).map_err(|kind| MaError::of(name, kind))
}

/// Most links that an error lists.
const MOST_LISTED: usize = 60;

/// Reads rows `x,y,z,r` or `x y z r`, below a header or without one.
pub(super) fn parse_rows(bytes: &[u8], name: &str, options: ReadOptions) -> Loaded {
    let mut columns = [0, 1, 2, 3];
    let mut link = Link::default();
    for (k, line) in lines(bytes, name).enumerate() {
        let fields = fields(&line.text);
        let is_header = k == 0 && fields.iter().all(|field| field.parse::<f64>().is_err());
        if is_header {
            let names: Vec<String> =
                fields.iter().map(|field| field.trim_matches('"').to_ascii_lowercase()).collect();
            let place = |known: &[&str]| names.iter().position(|name| known.contains(&&**name));
            for (column, known) in columns.iter_mut().zip(COLUMNS) {
                *column = place(known).ok_or_else(|| {
                    let found = shortened(&line.text);
                    line.malformed(format!(
                        "no column {} (found {found:?}, expected x,y,z,r)",
                        known[0]
                    ))
                })?;
            }
            continue;
        }
        let mut numbers = [0.0; 4];
        for ((number, column), known) in numbers.iter_mut().zip(columns).zip(COLUMNS) {
            let field = fields.get(column).copied().unwrap_or_default();
            *number = finite(field, known[0]).map_err(|why| line.malformed(why))?;
        }
        if columns == [0, 1, 2, 3] && fields.len() > 4 && k == 0 {
            let found = shortened(&line.text);
            let why = format!("more than four numbers without a header (found {found:?})");
            return Err(line.malformed(why));
        }
        let [x, y, z, radius] = numbers;
        link.spheres.push(Sphere::new(Vec3::new(x, y, z), radius));
    }
    chosen(vec![link], name, options)
}

/// Names of the columns in a header.
const COLUMNS: [&[&str]; 4] = [&["x"], &["y"], &["z"], &["r", "radius"]];

/// The fields of a row, which commas or semicolons separate where there are any.
fn fields(text: &str) -> Vec<&str> {
    match text.contains([',', ';']) {
        true => text.split([',', ';']).map(str::trim).collect(),
        false => text.split_ascii_whitespace().collect(),
    }
}

/// Reads rows of four numbers, or the lists of [`parse_ma`], which share their extensions.
pub(super) fn parse_clump(bytes: &[u8], name: &str, options: ReadOptions) -> Loaded {
    // The first line of the others can be four counts; the second of none is four numbers then.
    let is_row = |text: &str| {
        let fields = fields(text);
        let are_numbers = fields.iter().all(|field| field.parse::<f64>().is_ok());
        fields.len() == 4 && (are_numbers || fields[0].eq_ignore_ascii_case("x"))
    };
    let mut first = lines(bytes, name).take(2).peekable();
    let is_clump = first.peek().is_some() && first.all(|line| is_row(&line.text));
    if is_clump { parse_rows(bytes, name, options) } else { parse_ma(bytes, name, options) }
}

/// Reads every list of spheres in a JSON document: an object for each, with `center` or `origin`, and `radius`.
pub(super) fn parse_json(bytes: &[u8], name: &str, options: ReadOptions) -> Loaded {
    let document = serde_json::from_slice(bytes).map_err(|error| {
        malformed(name, Some(error.line()).filter(|&line| line > 0), error.to_string())
    })?;
    from_document(&document, name, options)
}

/// [`parse_json`] for YAML: cuRobo's files, with or without the rest of the robot's configuration, and XRDF.
pub(super) fn parse_yaml(bytes: &[u8], name: &str, options: ReadOptions) -> Loaded {
    // Every node of a text takes a byte. Aliases, which repeat nodes, have a limit of their own.
    let budget = serde_saphyr::budget! {
        max_nodes: bytes.len() + 1, max_events: 2 * bytes.len() + 8,
    };
    let options_of_yaml = serde_saphyr::options! {
        budget: budget,
        with_snippet: false,
        // Other parts of a robot's configuration may hold them.
        non_finite_float_policy: NonFiniteFloatPolicy::AsString,
    };
    let read = serde_saphyr::from_slice_with_options(bytes, options_of_yaml);
    let document: Value = read.map_err(|error| {
        let text = error.to_string();
        let why = text.lines().next().unwrap_or_default().to_owned();
        let line = error.location().map(|location| location.line() as usize);
        malformed(name, line, why)
    })?;
    from_document(&document, name, options)
}

fn from_document(document: &Value, name: &str, options: ReadOptions) -> Loaded {
    let mut links = Vec::new();
    collect(document, "", &mut links).map_err(|why| malformed(name, None, why))?;
    chosen(links, name, options)
}

/// Adds the lists of spheres in `value`, whose key is `key`. The readers bound the depth of `value`.
fn collect(value: &Value, key: &str, links: &mut Vec<Link>) -> Result<(), String> {
    match value {
        Value::Array(items) if items.iter().any(|item| centre(item).is_some()) => {
            let mut link = Link { name: key.to_owned(), ..Link::default() };
            for (k, item) in items.iter().enumerate() {
                let sphere = sphere(item);
                link.spheres.push(sphere.map_err(|why| format!("{key}, sphere {}: {why}", k + 1))?);
            }
            links.push(link);
            Ok(())
        }
        Value::Array(items) => items.iter().try_for_each(|item| collect(item, key, links)),
        Value::Object(map) => map.iter().try_for_each(|(key, value)| collect(value, key, links)),
        _ => Ok(()),
    }
}

fn centre(item: &Value) -> Option<&Value> {
    ["center", "origin", "centre"].iter().find_map(|key| item.get(key))
}

fn sphere(item: &Value) -> Result<Sphere, String> {
    let number = |value: &Value, field: &str| {
        let number = value.as_f64().filter(|number| number.is_finite());
        number.ok_or_else(|| format!("the {field} {} is not a finite number", text(value)))
    };
    let centre = centre(item).ok_or("the center is missing")?;
    let Some([x, y, z]) = centre.as_array().map(Vec::as_slice) else {
        return Err(format!("the center {} is not a list of three numbers", text(centre)));
    };
    let [x, y, z] = [number(x, "x")?, number(y, "y")?, number(z, "z")?];
    let radius = number(item.get("radius").ok_or("the radius is missing")?, "radius")?;
    Ok(Sphere::new(Vec3::new(x, y, z), radius))
}

fn text(value: &Value) -> String {
    shortened(&value.to_string())
}

/// Reads the spheres of a URDF or MJCF document; its root element decides.
pub(super) fn parse_xml(bytes: &[u8], name: &str, options: ReadOptions) -> Loaded {
    let text = str::from_utf8(bytes).map_err(|error| malformed(name, None, error.to_string()))?;
    let document = Document::parse(text)
        .map_err(|error| malformed(name, Some(error.pos().row as usize), error.to_string()))?;
    let root = document.root_element().tag_name().name();
    let (owners, shape): (&[&str], &str) = match root {
        "robot" => (&["link"], "collision"),
        "mujoco" => (&["worldbody", "body"], "geom"),
        _ => {
            let found = shortened(root);
            let why = format!("unknown root element (found {found:?}, expected robot or mujoco)");
            return Err(malformed(name, None, why));
        }
    };
    let mut links = Vec::new();
    for owner in document.descendants().filter(|node| owners.contains(&node.tag_name().name())) {
        let tag = owner.tag_name().name();
        let mut link =
            Link { name: owner.attribute("name").unwrap_or(tag).into(), ..Link::default() };
        for element in owner.children().filter(|child| child.has_tag_name(shape)) {
            let Some([centre, radius]) = attributes(element) else {
                link.others += 1;
                continue;
            };
            let row = document.text_pos_at(element.range().start).row as usize;
            let sphere = numbers(centre, radius).map_err(|why| malformed(name, Some(row), why))?;
            link.spheres.push(sphere);
        }
        links.push(link);
    }
    chosen(links, name, options)
}

/// The centre and the radius of a `collision` or `geom` element; `None` for another shape.
fn attributes<'a>(element: Node<'a, '_>) -> Option<[&'a str; 2]> {
    let child = |parent: Node<'a, '_>, tag| parent.children().find(|node| node.has_tag_name(tag));
    let (centre, radius) = if element.has_tag_name("geom") {
        (element.attribute("type") == Some("sphere")).then_some(())?;
        (element.attribute("pos"), element.attribute("size"))
    } else {
        let sphere = child(child(element, "geometry")?, "sphere")?;
        let origin = child(element, "origin");
        (origin.and_then(|origin| origin.attribute("xyz")), sphere.attribute("radius"))
    };
    // Without a position, a shape is at the origin of its link.
    Some([centre.unwrap_or("0 0 0"), radius.unwrap_or_default()])
}

fn numbers(centre: &str, radius: &str) -> Result<Sphere, String> {
    let [x, y, z] = *centre.split_ascii_whitespace().collect::<Vec<_>>() else {
        return Err(format!("the position {:?} is not three numbers", shortened(centre)));
    };
    let centre = Vec3::new(finite(x, "x")?, finite(y, "y")?, finite(z, "z")?);
    // MJCF allows three sizes, of which a sphere uses the first.
    let radius = radius.split_ascii_whitespace().next().ok_or("the radius is missing")?;
    Ok(Sphere::new(centre, finite(radius, "radius")?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::complex::{WRITABLE, read, read_content, write};

    fn load(name: &str, text: &str) -> Result<LoadedMa, MaError> {
        read_content(name, text.as_bytes(), ReadOptions::default())
    }

    fn radii(name: &str, text: &str) -> Vec<f64> {
        let loaded = load(name, text).unwrap_or_else(|error| panic!("{text}: {error}"));
        loaded.mesh.spheres.iter().map(|sphere| sphere.radius).collect()
    }

    #[test]
    fn every_number_is_read_back_bit_for_bit() {
        let numbers = [0.1, -1.0 / 3.0, 1e-300, -0.0, 6.02e23, f64::MIN_POSITIVE, 0.5, 1e200, 7.0];
        let spheres = (0..numbers.len()).map(|i| {
            let [x, y, z, r] = [0, 1, 2, 3].map(|k| numbers[(i + k) % numbers.len()]);
            Sphere::new(Vec3::new(x, y, z), r.abs())
        });
        let mesh = MedialMesh::from_simplices(spheres.collect(), vec![[0, 1]], vec![]).unwrap();
        let folder = tempfile::tempdir().unwrap();
        for extension in LAYOUTS.iter().flat_map(|layout| layout.0) {
            assert!(WRITABLE.contains(extension));
            // A name that must be quoted in YAML and escaped in XML.
            let path = folder.path().join(format!("{{x}} & <\"12\">: 'a'.{extension}"));
            write(&path, &mesh).unwrap();
            let loaded = read(&path).unwrap();
            assert_eq!(
                (&loaded.mesh.spheres, loaded.notes),
                (&mesh.spheres, vec![]),
                "{extension}"
            );
            let bits = |mesh: &MedialMesh| {
                let numbers = mesh.spheres.iter().flat_map(|s| s.centre.to_array());
                numbers.map(f64::to_bits).collect::<Vec<_>>()
            };
            assert_eq!(bits(&loaded.mesh), bits(&mesh), "{extension}");
            let error = write(&path, &MedialMesh::default()).unwrap_err().to_string();
            assert!(error.ends_with(": no sphere to write"), "{error}");
        }
    }

    #[test]
    fn layouts_of_other_programs_are_read() {
        let curobo = "robot_cfg:\n  kinematics:\n    collision_spheres:\n      a: &a\n        - \"center\": [0, 0, 1.0e-1]\n          \
                      \"radius\": 0.5 # m\n        - {center: [0, 0, 0], radius: -10}\n      b: []\n";
        let loaded = load("x.yml", curobo).unwrap();
        assert_eq!(loaded.mesh.spheres, [Sphere::new(Vec3::new(0.0, 0.0, 0.1), 0.5)]);
        assert_eq!(loaded.notes, ["1 sphere was dropped: negative radius"]);
        let urdf = "<!-- x --><robot name='r'><link name='a'><visual><geometry><sphere radius='9'/></geometry></visual>\
                    <collision><geometry><sphere radius='2'/></geometry></collision>\
                    <collision><geometry><box size='1 1 1'/></geometry></collision></link><link name='b'/></robot>";
        assert_eq!(load("x.urdf", urdf).unwrap().notes, ["1 element was skipped: not a sphere"]);
        let mjcf = "<mujoco><worldbody><geom type='plane' size='1 1 1'/><body name='a'><body name='b'>\
                    <geom type='sphere' size='3 0 0'/></body></body></worldbody></mujoco>";
        for (name, text, expected) in [
            ("x.csv", "Z,radius,id,y,X\n1,2,7,3,4\n", &[2.0][..]),
            ("x.csv", "0, 0, 0, 1\r\n0, 0, 1, 2\r\n", &[1.0, 2.0]),
            ("x.csv", "\u{feff}\"x\";\"y\";\"z\";\"r\"\n0;0;0;1\n", &[1.0]),
            ("x.txt", "# clump\n0 0 0 1\n0 0 1 2\n", &[1.0, 2.0]),
            ("x.xyzr", "x y z r\n0 0 0 1\n", &[1.0]),
            ("x.xyzr", "2\n0 0 0 1\n1 0 0 2\n", &[1.0, 2.0]),
            ("x.txt", "1 0 0 0\nv 0 0 0 3\n", &[3.0]),
            ("x.json", "[{\"origin\": [0, 0, 0], \"radius\": 1}]", &[1.0]),
            ("x.json", "{\"link\": [{\"center\": [0, 0, 0], \"radius\": 2}], \"n\": 3}", &[2.0]),
            ("x.urdf", urdf, &[2.0]),
            ("x.xml", urdf, &[2.0]),
            ("x.xml", mjcf, &[3.0]),
        ] {
            assert_eq!(radii(name, text), expected, "{text}");
        }
    }

    #[test]
    fn one_of_several_links_is_chosen() {
        let item = "[{center: [0, 0, 0], radius: 1}]";
        let text = format!(
            "geometry:\n  g:\n    spheres:\n      arm: {item}\n      none: []\n      hand: {item}\n"
        );
        let error = load("x.xrdf", &text).unwrap_err().to_string();
        assert_eq!(error, "x.xrdf: 2 links (1 arm, 2 hand); select one by --block K");
        let block = |k| {
            let options = ReadOptions { block: Some(k), ..ReadOptions::default() };
            read_content("x.xrdf", text.as_bytes(), options)
        };
        assert_eq!(block(2).unwrap().mesh.spheres.len(), 1);
        let error = block(3).unwrap_err().to_string();
        assert_eq!(error, "x.xrdf: there is no block 3: the file holds 2, counted from 1");
    }

    #[test]
    fn faults_are_errors_with_their_place() {
        let deep_json = "[".repeat(100_000);
        let deep_yaml = "- ".repeat(100_000);
        let deep_xml = format!("<robot>{}", "<link>".repeat(200_000));
        let bomb = "a: &a [x, x, x, x, x, x, x, x, x]\nb: &b [*a, *a, *a, *a, *a, *a, *a, *a, *a]\n\
                    c: &c [*b, *b, *b, *b, *b, *b, *b, *b, *b]\nd: &d [*c, *c, *c, *c, *c, *c, *c, *c, *c]\n\
                    e: &e [*d, *d, *d, *d, *d, *d, *d, *d, *d]\nf: &f [*e, *e, *e, *e, *e, *e, *e, *e, *e]\n\
                    g: &g [*f, *f, *f, *f, *f, *f, *f, *f, *f]\nh: [*g, *g, *g, *g, *g, *g, *g, *g, *g]\n";
        for (name, text, expected) in [
            ("x.csv", "", ": no spheres"),
            ("x.csv", "x,y,z,r\n", ": no spheres"),
            ("x.csv", "x,y,z\n0,0,0\n", ", line 1: no column r (found \"x,y,z\""),
            ("x.csv", "x,y,z,r\n0,0,0\n", ", line 2: the r \"\" is not a finite number"),
            ("x.csv", "x,y,z,r\n\n0,0,nan,1\n", ", line 3: the z \"nan\" is not a finite number"),
            ("x.csv", "0,0,,0,1\n", ", line 1: the z \"\" is not a finite number"),
            ("x.csv", "0,0,0,1,5\n", ", line 1: more than four numbers"),
            ("x.xyzr", "0 0 0 1\n0 0 1 inf\n", ", line 2: the r \"inf\" is not"),
            ("x.json", "", ", line 1: EOF"),
            ("x.json", "{\n]", ", line 2: "),
            ("x.json", "{\"a\": []}", ": no spheres"),
            ("x.json", "3", ": no spheres"),
            (
                "x.json",
                "{\"a\": [{\"center\": [0, 0, 0]}]}",
                ": a, sphere 1: the radius is missing",
            ),
            (
                "x.json",
                "{\"a\": [{\"center\": [0, 0], \"radius\": 1}]}",
                ": a, sphere 1: the center [0,0] is not",
            ),
            (
                "x.json",
                "{\"a\": [{\"center\": [0, 0, \"0\"], \"radius\": 1}]}",
                ": a, sphere 1: the z \"0\" is not",
            ),
            (
                "x.json",
                "[{\"center\": [0, 0, 0], \"radius\": 1e999}]",
                ", line 1: number out of range",
            ),
            ("x.json", &deep_json, ", line 1: recursion limit"),
            (
                "x.yaml",
                "a:\n  - center: [0, 0, 0]\n    radius: .nan\n",
                ": a, sphere 1: the radius \".nan\" is not a finite number",
            ),
            ("x.yaml", "a: [\n", ", line "),
            ("x.yaml", "collision_spheres: spheres/franka.yml\n", ": no spheres"),
            (
                "x.yaml",
                "a:\n  - {center: [0, 0, 0], radius: -1}\n",
                ": no spheres (found 1 with a negative radius)",
            ),
            ("x.yaml", &deep_yaml, ""),
            ("x.yaml", bomb, ""),
            ("x.urdf", "<robot>\n<link>\n</robot>", ", line 3: "),
            (
                "x.urdf",
                "<sdf/>",
                ": unknown root element (found \"sdf\", expected robot or mujoco)",
            ),
            ("x.urdf", "<!DOCTYPE r [<!ENTITY a 'b'>]><robot/>", ", line 1: "),
            (
                "x.urdf",
                "<robot>\n<link><collision><geometry><sphere/></geometry></collision></link></robot>",
                ", line 2: the radius is missing",
            ),
            (
                "x.urdf",
                "<robot><link><collision><geometry><mesh/></geometry></collision></link></robot>",
                ": no spheres (found 1 other shapes)",
            ),
            (
                "x.xml",
                "<mujoco><worldbody><geom type='sphere' size='1' pos='0 0'/></worldbody></mujoco>",
                ", line 1: the position \"0 0\" is not three numbers",
            ),
            ("x.xml", &deep_xml, ""),
        ] {
            let error = load(name, text).map(|loaded| loaded.mesh).unwrap_err().to_string();
            assert!(
                error.starts_with(&format!("{name}{expected}")),
                "{name} {:.60}: {error}",
                text
            );
            assert!(error.lines().count() == 1 && error.len() < 400, "{error}");
        }
        assert!(read_content("x.urdf", b"\xff", ReadOptions::default()).is_err());
        assert!(read_content("x.yaml", b"\xff", ReadOptions::default()).is_err());
    }
}
